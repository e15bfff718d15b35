//! The pinhole camera.
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A pinhole camera without distortion. Pixel (u, v) has its centre at (u, v).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Image width \[pixels\].
    pub width: u32,
    /// Image height \[pixels\].
    pub height: u32,
    /// Focal length along x \[pixels\].
    pub fx: f64,
    /// Focal length along y \[pixels\].
    pub fy: f64,
    /// Principal point, x \[pixels\].
    pub cx: f64,
    /// Principal point, y \[pixels\].
    pub cy: f64,
}

impl Camera {
    /// Returns the number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Returns the point at `depth_m` along z behind pixel (u, v), in the camera frame \[m\].
    pub fn back_project(&self, u: f64, v: f64, depth_m: f64) -> DVec3 {
        DVec3::new((u - self.cx) / self.fx, (v - self.cy) / self.fy, 1.0) * depth_m
    }

    /// Image position of a camera-frame point, or `None` when it is not in front of the camera.
    pub fn project(&self, p_camera: DVec3) -> Option<DVec2> {
        (p_camera.z > 1e-6).then(|| {
            DVec2::new(
                self.fx * p_camera.x / p_camera.z + self.cx,
                self.fy * p_camera.y / p_camera.z + self.cy,
            )
        })
    }

    /// Returns the camera of an image made by keeping the centre of each `step` x `step` block
    /// (nearest-neighbour subsampling at pixel `step * i + (step - 1) / 2`) or averaging it.
    pub fn downscaled(&self, step: u32) -> Camera {
        let s = f64::from(step);
        let shift = (s - 1.0) / 2.0;
        Camera {
            width: self.width / step,
            height: self.height / step,
            fx: self.fx / s,
            fy: self.fy / s,
            cx: (self.cx - shift) / s,
            cy: (self.cy - shift) / s,
        }
    }
}
