//! Rays of a batch, and what batches ask of the kernels.

/// Pixels are taken in order, not drawn.
pub const FLAG_DENSE: u32 = 1;
/// Depth images guide the samples of rays that have a depth.
pub const FLAG_GUIDED: u32 = 2;
/// Write gradients with respect to sample positions.
pub const FLAG_POSE: u32 = 4;
/// Write gradients with respect to plane features.
pub const FLAG_MAP: u32 = 8;
/// Mask rays whose depth error passes the outlier threshold.
pub const FLAG_MASK: u32 = 16;
/// Class of a ray: that of its nearest anchor, not the head's.
pub const FLAG_ANCHORS: u32 = 32;
/// Bit of `Ray::frame` that takes a ray out of every loss.
pub const RAY_MASKED: u32 = 0x8000_0000;

/// Floats a ray takes in its buffer.
pub const RAY_WORDS: usize = size_of::<Ray>() / 4;

shared_struct! {
    /// A ray: position at depth z is origin + z * direction, z measured along the camera's axis.
    pub struct Ray {
        /// World position of the camera \[m\].
        origin: [f32; 3],
        /// Sensor depth \[m\], 0 where there is none.
        depth: f32,
        /// World direction, 1 along the camera's axis.
        direction: [f32; 3],
        /// Index in the window (8 bits), slot (23 bits), [`RAY_MASKED`].
        frame: u32,
        /// sRGB color in 0..1.
        color: [f32; 3],
        /// Compact class (8 bits), 255 where unlabelled; pixel (24 bits), counted row by row.
        label: u32,
    }
}

impl Ray {
    /// The ray's words.
    pub fn words(&self) -> [u32; RAY_WORDS] {
        bytemuck::cast(*self)
    }

    /// Point at depth z.
    pub fn at(&self, z: f32) -> [f32; 3] {
        [
            self.origin[0] + z * self.direction[0],
            self.origin[1] + z * self.direction[1],
            self.origin[2] + z * self.direction[2],
        ]
    }

    /// Compact class, 255 where unlabelled.
    pub fn class(&self) -> u32 {
        self.label & 255
    }

    /// Pixel, counted row by row.
    pub fn pixel(&self) -> u32 {
        self.label >> 8
    }

    /// Storage slot of the frame.
    pub fn slot(&self) -> u32 {
        (self.frame & !RAY_MASKED) >> 8
    }

    /// Whether no loss may use the ray.
    pub fn masked(&self) -> bool {
        self.frame & RAY_MASKED != 0
    }
}
