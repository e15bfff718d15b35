//! Settings of the odometry. One default for every kind of data; none is tuned to a scene.

mte_slam_types::settings! {
    /// RGB-D odometry, from which tracking starts.
    pub struct OdometryConfig {
        /// Number of keyframes each frame is aligned with at the fine levels.
        references: u32 = 3, Between(1.0, 64.0);
        /// Whether the last frame joins the references at the fine levels, too.
        last_frame: bool = false;
        /// A frame whose inlier share towards the best reference is below this becomes a keyframe.
        keyframe_overlap: f64 = 0.7, Between(0.0, 1.0);
        /// A frame further than this from every keyframe becomes one: translation plus rotation
        /// times median depth, divided by median depth.
        keyframe_motion: f64["m at the median depth"] = 0.08, AtLeast(0.0);
        /// Most keyframes kept; the one that overlaps most with its neighbours is dropped first.
        max_keyframes: u32 = 200, Between(2.0, 100_000.0);
        /// Smallest share of visible points that must agree for a frame not to be lost.
        min_inlier_ratio: f64 = 0.35, Between(0.0, 1.0);
        /// Smallest number of inliers as a share of the frame's usable points.
        min_overlap: f64 = 0.12, Between(0.0, 1.0);
        /// Largest translation between frames.
        max_step_m: f64["m"] = 0.6, Above(0.0);
        /// Largest rotation between frames.
        max_step_rad: f64["rad"] = 0.8, Above(0.0);
        /// From this motion per frame on, corners are matched for a second start: translation over
        /// median depth plus rotation.
        wide_motion: f64["rad"] = 0.12, AtLeast(0.0);
        /// Below this inlier share corners are matched for a second start, too.
        doubtful_inlier_ratio: f64 = 0.85, Between(0.0, 1.0);
        /// Refine keyframe poses in a graph of pairwise alignments whenever a keyframe is added: a
        /// better path where keyframes overlap much and depth is good, at more time per keyframe.
        pose_graph: bool = false;
        /// Most keyframes that a new one is linked with in the graph.
        graph_links: u32 = 6, Between(1.0, 64.0);
        /// Number of keyframe pairs from which the registration of color to depth is estimated;
        /// 0: take them as registered.
        registration_pairs: u32 = 12, Between(0.0, 1000.0);
        /// Image pyramids.
        pyramid: PyramidConfig = PyramidConfig::default();
        /// Alignment.
        align: AlignConfig = AlignConfig::default();
    }

    /// How a frame becomes a pyramid.
    pub struct PyramidConfig {
        /// Largest number of levels; each halves the size.
        levels: u32 = 5, Between(1.0, 16.0);
        /// Coarsest image side allowed.
        smallest_side: u32["pixels"] = 15, Between(8.0, 65_536.0);
        /// Depth beyond this is not used.
        max_depth_m: f64["m"] = 8.0, Above(0.0);
        /// Use the depth of the locally fitted plane in place of the measured one.
        smooth_depth: bool = true;
        /// Standard deviation of depth: `depth_noise_m + depth_noise_per_m2 z^2`. Only its shape
        /// matters: the scale is estimated from the residuals.
        depth_noise_m: f64["m"] = 0.001, Above(0.0);
        /// See `depth_noise_m`.
        depth_noise_per_m2: f64["m/m^2"] = 0.0015, AtLeast(0.0);
    }

    /// How one pose is estimated.
    pub struct AlignConfig {
        /// Most Gauss-Newton steps per level, finest level first; coarser levels take the last
        /// entry.
        iterations: [u32; 4] = [4, 5, 6, 8], Between(0.0, 1000.0);
        /// Most points used per level; a larger level is subsampled evenly.
        max_points: u32 = 6000, AtLeast(1.0);
        /// Width of the Geman-McClure kernel in robust standard deviations.
        kernel_width: f64["standard deviations"] = 2.5, Above(0.0);
        /// Weight of the photometric term relative to its statistical one.
        photometric_weight: f64 = 1.0, AtLeast(0.0);
        /// Weight of the geometric term relative to its statistical one.
        geometric_weight: f64 = 1.0, AtLeast(0.0);
        /// Correspondences with larger difference in depth are dropped, at the finest level, as a
        /// fraction of depth; doubled at each coarser level up to `max_gate`.
        depth_gate: f64 = 0.05, Above(0.0);
        /// Upper bound of the depth gate (fraction of depth).
        max_gate: f64 = 0.4, Above(0.0);
        /// Smallest cosine between normals.
        normal_cos: f64 = 0.7, Between(-1.0, 1.0);
        /// Standard deviation of misregistration, inflates residuals on slopes and edges.
        pixel_noise: f64["pixels"] = 0.3, AtLeast(0.0);
        /// Lower bound of the photometric standard deviation (intensity is 0 to 1).
        min_photometric_sigma: f64 = 0.002, Above(0.0);
        /// Lower bound of the geometric scale in units of the depth noise model.
        min_geometric_scale: f64 = 0.05, Above(0.0);
        /// A direction whose information is below this fraction of the best one is not updated.
        degenerate_ratio: f64 = 1e-6, Between(0.0, 1.0);
        /// A level ends when no point moves further than this by a step.
        convergence: f64["m at 1 m"] = 1e-4, AtLeast(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The kernels compute in single precision: what they get is the number as it is written.
    #[test]
    fn defaults_are_the_nearest_single_precision_numbers() {
        let c = AlignConfig::default();
        for (setting, written) in [
            (c.kernel_width, 2.5f32),
            (c.photometric_weight, 1.0),
            (c.geometric_weight, 1.0),
            (c.depth_gate, 0.05),
            (c.max_gate, 0.4),
            (c.normal_cos, 0.7),
            (c.pixel_noise, 0.3),
            (c.min_photometric_sigma, 0.002),
            (c.min_geometric_scale, 0.05),
        ] {
            assert_eq!((setting as f32).to_bits(), written.to_bits());
        }
    }
}
