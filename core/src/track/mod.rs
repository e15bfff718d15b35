//! Estimating the pose of each frame: where it starts ([`odometry`]) and how the field refines it.
pub(crate) mod gauss_newton;
pub use mte_slam_odometry as odometry;
