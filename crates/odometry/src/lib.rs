#![doc = include_str!("../README.md")]
//! # How it works
//!
//! [`align`] estimates one pose from one or several reference images at once (projective
//! point-to-plane plus photometric residuals, coarse to fine, robust); [`Odometer`] decides what to
//! align with, notices loss and recovers; [`PoseGraph`] makes keyframe poses agree with each other.
//! A frame costs milliseconds; nothing here needs a device.
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

mod align;
mod calibration;
mod config;
mod features;
mod keyframe;
mod linear;
mod odometer;
mod pose_graph;
mod pyramid;
mod registration;
mod registration_search;
mod residuals;
mod result;
mod saved;
mod search;
mod thumbnail;

pub use align::{Alignment, Reference, align, align_many};
pub use config::{AlignConfig, OdometryConfig, PyramidConfig};
pub use keyframe::OdometryKeyframe;
pub use odometer::Odometer;
pub use pose_graph::{Edge, PoseGraph};
pub use pyramid::RgbdPyramid;
pub use registration::ColorRegistration;
pub use result::{LostReason, OdometryResult, Quality};
pub use saved::{OdometerState, Rebuild, since};

#[cfg(test)]
mod tests;

/// Why an alignment could not even be tried.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OdometryError {
    /// An image does not have the size of the camera.
    #[error("frame {frame}: {image}: found {found} pixels, expected {expected}")]
    ImageSize {
        /// `Frame::index`.
        frame: usize,
        /// `colour` or `depth`.
        image: &'static str,
        /// Number of pixels found.
        found: usize,
        /// Number of pixels of the camera.
        expected: usize,
    },
    /// Too few pixels with depth to align anything.
    #[error("frame {frame}: depth: found {found} usable pixels, expected at least {expected}")]
    NoDepth {
        /// `Frame::index`.
        frame: usize,
        /// Pixels with usable depth.
        found: usize,
        /// What alignment needs.
        expected: usize,
    },
    /// A pose given from outside holds NaN or infinity.
    #[error("frame {frame}: initial pose: found a number that is not finite, expected finite")]
    BadPose {
        /// `Frame::index`.
        frame: usize,
    },
    /// An alignment was asked for without any reference image.
    #[error("frame {frame}: references: found 0, expected at least 1")]
    NoReference {
        /// `Frame::index`.
        frame: usize,
    },
}
