//! Names of the random numbers. Every draw is a hash of a seed, an iteration, an index and a salt
//! (`shared/random.wgsl`); salts keep draws apart that share the rest. Which number a name has is
//! part of every result: same seed, same bytes.

/// Salts of the draws, by what is drawn.
pub mod salt {
    /// Pixel of a ray.
    pub const PIXEL: u32 = 0;
    /// Second pixel of a ray whose first one has no depth.
    pub const PIXEL_AGAIN: u32 = 1;
    /// Place of a sample within its stratum.
    pub const JITTER: u32 = 2;
    /// Whether a ray seeks a rare class.
    pub const RARE: u32 = 3;
    /// Candidate pixels of such a ray.
    pub const RARE_CANDIDATE: u32 = 4;
    /// First values of the decoders.
    pub const DECODERS: u32 = 7;
    /// First values of the fusion.
    pub const FUSION: u32 = 9;
    /// Points by which the overlap of keyframes is measured.
    pub const KEYFRAME_POINT: u32 = 11;
    /// First values of the per-sample head. Its number is that of [`KEYFRAME_POINT`] by mistake, and
    /// stays, since results depend on it: the draws coincide with those of the frame whose index is
    /// [`first_values::SAMPLE_HEAD`](super::first_values::SAMPLE_HEAD).
    pub const SAMPLE_HEAD_AS_KEYFRAME_POINT: u32 = KEYFRAME_POINT;
    /// Keyframes of a window.
    pub const WINDOW_KEYFRAME: u32 = 21;
    /// Keyframes whose semantics are trained.
    pub const SEMANTIC_KEYFRAME: u32 = 22;
    /// First values of the geometry planes.
    pub const GEOMETRY_PLANES: u32 = 0;
    /// First values of the appearance planes.
    pub const APPEARANCE_PLANES: u32 = 1;
    /// First values of the semantic planes.
    pub const SEMANTIC_PLANES: u32 = 2;
}

/// What stands for the iteration when first values are drawn.
pub mod first_values {
    /// Radius of the normal distribution of plane features.
    pub const PLANE_RADIUS: u32 = 0x1717;
    /// Angle of the normal distribution of plane features.
    pub const PLANE_ANGLE: u32 = 0x1718;
    /// Decoders.
    pub const DECODERS: u32 = 0x1719;
    /// Fusion.
    pub const FUSION: u32 = 0x1720;
    /// Per-sample head.
    pub const SAMPLE_HEAD: u32 = 0x1721;
}
