//! Settings of the odometry. One default for every kind of data; none is tuned to a scene.
use serde::{Deserialize, Serialize};

/// How a frame becomes a pyramid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PyramidConfig {
    /// Largest number of levels; each halves the size.
    pub levels: usize,
    /// Coarsest image side allowed \[pixels\].
    pub smallest_side: u32,
    /// Depth beyond this is not used \[m\].
    pub max_depth_m: f64,
    /// Use the depth of the locally fitted plane in place of the measured one.
    pub smooth_depth: bool,
    /// Standard deviation of depth: `depth_noise_m + depth_noise_per_m2 z^2` \[m\]. Only its shape
    /// matters: the scale is estimated from the residuals.
    pub depth_noise_m: f64,
    /// See `depth_noise_m` \[m / m^2\].
    pub depth_noise_per_m2: f64,
}

impl Default for PyramidConfig {
    fn default() -> Self {
        Self {
            levels: 5,
            smallest_side: 15,
            max_depth_m: 8.0,
            smooth_depth: true,
            depth_noise_m: 0.001,
            depth_noise_per_m2: 0.0015,
        }
    }
}

/// How one pose is estimated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AlignConfig {
    /// Most Gauss-Newton steps a level, finest level first; coarser levels take the last entry.
    pub iterations: [usize; 4],
    /// Most points used at a level; a larger level is subsampled evenly.
    pub max_points: usize,
    /// Width of the Geman-McClure kernel in robust standard deviations.
    pub kernel_width: f32,
    /// Weight of the photometric term relative to its statistical one.
    pub photometric_weight: f32,
    /// Weight of the geometric term relative to its statistical one.
    pub geometric_weight: f32,
    /// Correspondences with larger difference in depth are dropped, at the finest level, as a
    /// fraction of depth; doubled at each coarser level up to `max_gate`.
    pub depth_gate: f32,
    /// Upper bound of the depth gate (fraction of depth).
    pub max_gate: f32,
    /// Smallest cosine between normals.
    pub normal_cos: f32,
    /// Standard deviation of misregistration \[pixels\], inflates residuals on slopes and edges.
    pub pixel_noise: f32,
    /// Lower bound of the photometric standard deviation (intensity is 0..1).
    pub min_photometric_sigma: f32,
    /// Lower bound of the geometric scale in units of the depth noise model.
    pub min_geometric_scale: f32,
    /// A direction whose information is below this fraction of the best one is not updated.
    pub degenerate_ratio: f64,
    /// A level ends when no point moves further than this by a step \[m at 1 m\].
    pub convergence: f64,
}

impl Default for AlignConfig {
    fn default() -> Self {
        Self {
            iterations: [4, 5, 6, 8],
            max_points: 6000,
            kernel_width: 2.5,
            photometric_weight: 1.0,
            geometric_weight: 1.0,
            depth_gate: 0.05,
            max_gate: 0.4,
            normal_cos: 0.7,
            pixel_noise: 0.3,
            min_photometric_sigma: 0.002,
            min_geometric_scale: 0.05,
            degenerate_ratio: 1e-6,
            convergence: 1e-4,
        }
    }
}

/// Everything the [`super::Odometer`] can be told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct OdometryConfig {
    /// Pyramids.
    pub pyramid: PyramidConfig,
    /// Alignment.
    pub align: AlignConfig,
    /// Number of keyframes each frame is aligned with at the fine levels.
    pub references: usize,
    /// Whether the last frame joins the references at the fine levels, too.
    pub last_frame: bool,
    /// A frame whose inlier share towards the best reference is below this becomes a keyframe.
    pub keyframe_overlap: f64,
    /// A frame further than this from every keyframe becomes one \[m at the median depth\]:
    /// translation plus rotation times median depth, divided by median depth.
    pub keyframe_motion: f64,
    /// Most keyframes kept; the one that overlaps most with its neighbours is dropped first.
    pub max_keyframes: usize,
    /// Smallest share of visible points that must agree for a frame not to be lost.
    pub min_inlier_ratio: f64,
    /// Smallest number of inliers as a share of the frame's usable points.
    pub min_overlap: f64,
    /// Largest translation between frames \[m\].
    pub max_step_m: f64,
    /// Largest rotation between frames \[rad\].
    pub max_step_rad: f64,
    /// From this motion a frame on, corners are matched for a second start: translation over
    /// median depth plus rotation \[rad\].
    pub wide_motion: f64,
    /// Below this inlier share corners are matched for a second start, too.
    pub doubtful_inlier_ratio: f64,
    /// Refine keyframe poses in a graph of pairwise alignments whenever a keyframe is added.
    pub pose_graph: bool,
    /// Keyframes a new one is linked with in the graph.
    pub graph_links: usize,
    /// Number of keyframe pairs from which the registration of colour to depth is estimated;
    /// 0: take them as registered.
    pub registration_pairs: usize,
}

impl Default for OdometryConfig {
    fn default() -> Self {
        Self {
            pyramid: PyramidConfig::default(),
            align: AlignConfig::default(),
            references: 3,
            last_frame: false,
            keyframe_overlap: 0.7,
            keyframe_motion: 0.08,
            max_keyframes: 200,
            min_inlier_ratio: 0.35,
            min_overlap: 0.12,
            max_step_m: 0.6,
            max_step_rad: 0.8,
            wide_motion: 0.12,
            doubtful_inlier_ratio: 0.85,
            pose_graph: false,
            graph_links: 6,
            registration_pairs: 12,
        }
    }
}
