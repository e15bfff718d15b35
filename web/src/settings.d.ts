// Written by `mte-slam settings --typescript`; a test compares.

/** Name of a preset. */
export type Preset = "tiny" | "fast" | "replica" | "scannet" | "tum";

/** Single values of the configuration by dotted path. */
export interface Overrides {
  /** Seed of every random number. Default 1. */
  "seed"?: number;
  /** Cell of the coarse geometry planes; a whole fraction of `surface_coarse_m`. [m] Default 0.24; above 0. */
  "field.geometry_coarse_m"?: number;
  /** Cell of the fine geometry planes; a whole fraction of `surface_coarse_m`. [m] Default 0.04; above 0. */
  "field.geometry_fine_m"?: number;
  /** Cell of the coarse appearance and semantic planes. [m] Default 0.24; above 0. */
  "field.surface_coarse_m"?: number;
  /** Cell of the fine appearance and semantic planes; a whole fraction of `surface_coarse_m`. [m] Default 0.02; above 0. */
  "field.surface_fine_m"?: number;
  /** Truncation of the signed distance. [m] Default 0.06; above 0. */
  "field.truncation_m"?: number;
  /** Sharpness of the interval weights. [1/truncation] Default 20; above 0. */
  "field.sharpness"?: number;
  /** Use the dataset's bounds where it gives them; else they are estimated and grown. Default true. */
  "field.use_given_bounds"?: boolean;
  /** Margin around the observed surface when bounds are estimated. [m] Default 0.3; at least 0. */
  "field.margin_m"?: number;
  /** Stratified samples per ray in optimisation. Default 32; 1 to 128. */
  "sampling.stratified"?: number;
  /** Samples around the surface per ray in optimisation. Default 8; 1 to 64. */
  "sampling.surface"?: number;
  /** Stratified samples per ray when rendering views. Default 96; 1 to 128. */
  "sampling.render_stratified"?: number;
  /** Second-round samples per ray when rendering views. Default 24; 1 to 64. */
  "sampling.render_surface"?: number;
  /** Depth of the first sample. [m] Default 0.02; at least 0. */
  "sampling.near_m"?: number;
  /** Intervals lighter than this carry no appearance or semantics. Default 0.001; 0 to 1. */
  "sampling.min_weight"?: number;
  /** Share of the rays of mapping, and of those that settle anchors, that seek rare classes. Default 0.25; 0 to 1. */
  "sampling.rare_share"?: number;
  /** The same while the semantics are trained alone; wrong labels are rare, too, and there they would undo what doubting them brings. Default 0.05; 0 to 1. */
  "sampling.semantic_rare_share"?: number;
  /** Pixels that such a ray chooses from: the one whose class was seen least is taken. Default 24; 1 to 64. */
  "sampling.rare_draws"?: number;
  /** Signed distance in free space (to 1). Default 5; at least 0. */
  "loss.free_space"?: number;
  /** Signed distance within 0.4 truncations of the surface. [1/m^2] Default 200; at least 0. */
  "loss.centre"?: number;
  /** Signed distance in the rest of the truncation band. [1/m^2] Default 10; at least 0. */
  "loss.tail"?: number;
  /** Rendered depth. [1/m^2] Default 0.1; at least 0. */
  "loss.depth"?: number;
  /** Rendered color. Default 5; at least 0. */
  "loss.color"?: number;
  /** Cross-entropy of the rendered classes. Default 0.1; at least 0. */
  "loss.semantic"?: number;
  /** Exponent of the inverse frequency that weighs classes in it: 0 as they come, 1 balanced. Default 0.25; 0 to 4. */
  "loss.balance"?: number;
  /** Share that the loss takes back of how much likelier those weights, and rays that seek rare classes, make a class (logit adjustment): 0 nothing, 1 all. Default 0.5; 0 to 1. */
  "loss.adjustment"?: number;
  /** Which tracker. Default align. */
  "tracking.tracker"?: "align" | "render" | "truth";
  /** `align`: Gauss-Newton iterations against the field. Default 6; 0 to 1000. */
  "tracking.align_iterations"?: number;
  /** `align`: most pixels used. [pixels] Default 4096; 1 to 262144. */
  "tracking.align_pixels"?: number;
  /** `align`: how much the field may weigh against the frame-to-keyframe alignment. Default 1; at least 0. */
  "tracking.align_field_weight"?: number;
  /** `align`: expected distance residual. [m] Default 0.01; above 0. */
  "tracking.align_sigma_distance_m"?: number;
  /** `align`: expected residual of the intensity, which is 0 to 1. Default 0.1; above 0, at most 1. */
  "tracking.align_sigma_intensity"?: number;
  /** `render`: rays per iteration. Default 2000; 1 to 32768. */
  "tracking.render_rays"?: number;
  /** `render`: iterations. Default 8; 1 to 10000. */
  "tracking.render_iterations"?: number;
  /** `render`: Adam step of the translation. [m] Default 0.002; above 0. */
  "tracking.render_rate_translation_m"?: number;
  /** `render`: Adam step of the rotation. [rad] Default 0.001; above 0. */
  "tracking.render_rate_rotation_rad"?: number;
  /** Signed distance in free space (to 1). Default 10; at least 0. */
  "tracking.render_loss.free_space"?: number;
  /** Signed distance within 0.4 truncations of the surface. [1/m^2] Default 200; at least 0. */
  "tracking.render_loss.centre"?: number;
  /** Signed distance in the rest of the truncation band. [1/m^2] Default 50; at least 0. */
  "tracking.render_loss.tail"?: number;
  /** Rendered depth. [1/m^2] Default 1; at least 0. */
  "tracking.render_loss.depth"?: number;
  /** Rendered color. Default 5; at least 0. */
  "tracking.render_loss.color"?: number;
  /** Cross-entropy of the rendered classes. Default 0; at least 0. */
  "tracking.render_loss.semantic"?: number;
  /** Exponent of the inverse frequency that weighs classes in it: 0 as they come, 1 balanced. Default 0; 0 to 4. */
  "tracking.render_loss.balance"?: number;
  /** Share that the loss takes back of how much likelier those weights, and rays that seek rare classes, make a class (logit adjustment): 0 nothing, 1 all. Default 0; 0 to 1. */
  "tracking.render_loss.adjustment"?: number;
  /** Map every n-th frame. [frames] Default 5; at least 1. */
  "mapping.every"?: number;
  /** Rays per iteration; at least `window`. Default 4000; 1 to 32768. */
  "mapping.rays"?: number;
  /** Iterations per mapped frame. Default 15; 1 to 100000. */
  "mapping.iterations"?: number;
  /** Iterations on the first frame. Default 200; 1 to 100000. */
  "mapping.first_iterations"?: number;
  /** Iterations over all keyframes after the last frame. Default 100; 0 to 100000. */
  "mapping.final_iterations"?: number;
  /** Iterations of the semantics alone after those: a third of the price, and small classes need them. Default 1000; 0 to 100000. */
  "mapping.semantic_iterations"?: number;
  /** Learning rates of the first frame are larger by this factor. Default 5; above 0. */
  "mapping.first_rate_factor"?: number;
  /** Adam step of the plane features. Default 0.005; above 0. */
  "mapping.rate_planes"?: number;
  /** Adam step of the decoders. Default 0.001; above 0. */
  "mapping.rate_decoders"?: number;
  /** Frames that an iteration draws rays from, with the current one. [frames] Default 8; 1 to 64. */
  "mapping.window"?: number;
  /** Refine the poses of the window, too. Default auto. */
  "mapping.refine_poses"?: "auto" | "on" | "off";
  /** Adam step of the poses' translation. [m] Default 0.0005; at least 0. */
  "mapping.rate_translation_m"?: number;
  /** Adam step of the poses' rotation. [rad] Default 0.0005; at least 0. */
  "mapping.rate_rotation_rad"?: number;
  /** Only every n-th tile of samples trains the geometry decoder. [tiles] Default 8; 1 to 1024. */
  "mapping.decoder_stride"?: number;
  /** Samples whose gradient at the distance's pre-activation (times the rays) is smaller than this are left alone. Default 0.0002; at least 0. */
  "mapping.min_gradient"?: number;
  /** A mapped frame becomes a keyframe at least every n frames. [frames] Default 5; at least 1. */
  "keyframes.every"?: number;
  /** Device memory for keyframe images; over it the least useful are dropped. [MiB] Default 96; 1 to 65536. */
  "keyframes.budget_mib"?: number;
  /** What turns semantic features into classes: `sample` is the paper's, for comparison, in builds with the feature `sample-head` alone. Default ray. */
  "semantics.head"?: "ray" | "sample";
  /** Use it. Default true. */
  "fusion.enabled"?: boolean;
  /** Edge of a token. [pixels] Default 8; 8, 16, 24 or 32. */
  "fusion.token_pixels"?: number;
  /** Every n-th column and row of tokens is a key of the attention. [tokens] Default 2; 1 to 16. */
  "fusion.key_stride"?: number;
  /** Add a token's own appearance to what attention gives in the second stage. Default true. */
  "fusion.residual"?: boolean;
  /** Local module: depthwise convolution before the pointwise one. Default true. */
  "fusion.local"?: boolean;
  /** Edge of the pointwise convolution: 1, or 3 as the paper writes. [tokens] Default 1; 1 or 3. */
  "fusion.local_kernel"?: number;
  /** Edge of the gate's convolution. [tokens] Default 1; 1 or 3. */
  "fusion.gate_kernel"?: number;
  /** Give the fusion the map's own semantic feature at each token's point. Default true. */
  "fusion.memory"?: boolean;
  /** Training steps per mapped frame, about half of them on earlier frames. Default 1; 0 to 1000. */
  "fusion.steps"?: number;
  /** Training steps on the first frame. Default 40; 0 to 10000. */
  "fusion.first_steps"?: number;
  /** Adam step. Default 0.01; above 0. */
  "fusion.rate"?: number;
  /** Weight of the cross-entropy at the fused features. Default 1; at least 0. */
  "fusion.weight_class"?: number;
  /** Weight of the color loss at the fused features. Default 0.5; at least 0. */
  "fusion.weight_color"?: number;
  /** Exponent of the inverse frequency that weighs classes: 0 as they come, 1 balanced. Default 0.5; 0 to 4. */
  "fusion.balance"?: number;
  /** Weight of the feature loss: rays against the fused feature of their pixel. Default 0; at least 0. */
  "fusion.weight"?: number;
  /** The same while the semantics are trained alone, at the end. Default 0.003; at least 0. */
  "fusion.final_weight"?: number;
  /** Training steps in that stage, spread over its iterations. Default 200; 0 to 100000. */
  "fusion.final_steps"?: number;
  /** In that stage: how fast trust in a label falls with its logit below the best one at the fused feature of the pixel; 0: every label is believed. Default 0.5; at least 0. */
  "fusion.doubt"?: number;
  /** Use it. Default true. */
  "suppressor.enabled"?: boolean;
  /** Most anchors. Default 256; 1 to 256. */
  "suppressor.anchors"?: number;
  /** Weight of the compression loss once it is on in full. Default 0; at least 0. */
  "suppressor.weight"?: number;
  /** The same while the semantics are trained alone, at the end. Default 0.003; at least 0. */
  "suppressor.final_weight"?: number;
  /** Mapped frames before the compression loss begins. [mapped frames] Default 1. */
  "suppressor.start"?: number;
  /** Mapped frames over which it rises. [mapped frames] Default 10. */
  "suppressor.ramp"?: number;
  /** How anchors follow their features. Default mean. */
  "suppressor.rule"?: "average" | "mean";
  /** Rate of the moving average. Default 0.05; 0 to 1. */
  "suppressor.beta"?: number;
  /** Most matches that the running mean remembers. [matches] Default 2000; above 0. */
  "suppressor.memory"?: number;
  /** Share of importance and votes that each update keeps. Default 0.999; 0 to 1. */
  "suppressor.decay"?: number;
  /** A feature this far from every anchor of its class spawns one. Default 4; above 0. */
  "suppressor.spawn_distance"?: number;
  /** Anchors of a class closer than this merge. Default 2; above 0. */
  "suppressor.merge_distance"?: number;
  /** Most anchors spawned per maintenance. Default 8; 0 to 256. */
  "suppressor.spawns"?: number;
  /** Anchors merge once they move less than this per update. Default 0.05; at least 0. */
  "suppressor.stable"?: number;
  /** Less important anchors (matches, decayed) are dropped. [matches] Default 100; at least 0. */
  "suppressor.min_importance"?: number;
  /** Updates before an anchor may be dropped or merged. [updates] Default 40. */
  "suppressor.min_age"?: number;
  /** While the semantics are trained alone: how fast trust in a label falls with the (squared) distance of its class's nearest anchor beyond that of the nearest one; 0: every label is believed. Default 1; at least 0. */
  "suppressor.doubt"?: number;
  /** Iterations that settle the anchors by the head's classes at the very end, as a multiple of `mapping.semantic_iterations`; nothing but the anchors changes. Default 0.3; 0 to 10. */
  "suppressor.settle_share"?: number;
  /** What gives a rendered pixel its class. Default head. */
  "suppressor.inference"?: "head" | "anchors";
  /** Edge of a marching cube. [m] Default 0.02; above 0. */
  "mesh.resolution_m"?: number;
  /** Parts with fewer triangles are dropped. Default 100. */
  "mesh.min_component_triangles"?: number;
  /** Number of keyframes each frame is aligned with at the fine levels. Default 3; 1 to 64. */
  "odometry.references"?: number;
  /** Whether the last frame joins the references at the fine levels, too. Default false. */
  "odometry.last_frame"?: boolean;
  /** A frame whose inlier share towards the best reference is below this becomes a keyframe. Default 0.7; 0 to 1. */
  "odometry.keyframe_overlap"?: number;
  /** A frame further than this from every keyframe becomes one: translation plus rotation times median depth, divided by median depth. [m at the median depth] Default 0.08; at least 0. */
  "odometry.keyframe_motion"?: number;
  /** Most keyframes kept; the one that overlaps most with its neighbours is dropped first. Default 200; 2 to 100000. */
  "odometry.max_keyframes"?: number;
  /** Smallest share of visible points that must agree for a frame not to be lost. Default 0.35; 0 to 1. */
  "odometry.min_inlier_ratio"?: number;
  /** Smallest number of inliers as a share of the frame's usable points. Default 0.12; 0 to 1. */
  "odometry.min_overlap"?: number;
  /** Largest translation between frames. [m] Default 0.6; above 0. */
  "odometry.max_step_m"?: number;
  /** Largest rotation between frames. [rad] Default 0.8; above 0. */
  "odometry.max_step_rad"?: number;
  /** From this motion per frame on, corners are matched for a second start: translation over median depth plus rotation. [rad] Default 0.12; at least 0. */
  "odometry.wide_motion"?: number;
  /** Below this inlier share corners are matched for a second start, too. Default 0.85; 0 to 1. */
  "odometry.doubtful_inlier_ratio"?: number;
  /** Refine keyframe poses in a graph of pairwise alignments whenever a keyframe is added: a better path where keyframes overlap much and depth is good, at more time per keyframe. Default false. */
  "odometry.pose_graph"?: boolean;
  /** Most keyframes that a new one is linked with in the graph. Default 6; 1 to 64. */
  "odometry.graph_links"?: number;
  /** Number of keyframe pairs from which the registration of color to depth is estimated; 0: take them as registered. Default 12; 0 to 1000. */
  "odometry.registration_pairs"?: number;
  /** Largest number of levels; each halves the size. Default 5; 1 to 16. */
  "odometry.pyramid.levels"?: number;
  /** Coarsest image side allowed. [pixels] Default 15; 8 to 65536. */
  "odometry.pyramid.smallest_side"?: number;
  /** Depth beyond this is not used. [m] Default 8; above 0. */
  "odometry.pyramid.max_depth_m"?: number;
  /** Use the depth of the locally fitted plane in place of the measured one. Default true. */
  "odometry.pyramid.smooth_depth"?: boolean;
  /** Standard deviation of depth: `depth_noise_m + depth_noise_per_m2 z^2`. Only its shape matters: the scale is estimated from the residuals. [m] Default 0.001; above 0. */
  "odometry.pyramid.depth_noise_m"?: number;
  /** See `depth_noise_m`. [m/m^2] Default 0.0015; at least 0. */
  "odometry.pyramid.depth_noise_per_m2"?: number;
  /** Most Gauss-Newton steps per level, finest level first; coarser levels take the last entry. Default [4, 5, 6, 8]; 0 to 1000. */
  "odometry.align.iterations"?: number[];
  /** Most points used per level; a larger level is subsampled evenly. Default 6000; at least 1. */
  "odometry.align.max_points"?: number;
  /** Width of the Geman-McClure kernel in robust standard deviations. [standard deviations] Default 2.5; above 0. */
  "odometry.align.kernel_width"?: number;
  /** Weight of the photometric term relative to its statistical one. Default 1; at least 0. */
  "odometry.align.photometric_weight"?: number;
  /** Weight of the geometric term relative to its statistical one. Default 1; at least 0. */
  "odometry.align.geometric_weight"?: number;
  /** Correspondences with larger difference in depth are dropped, at the finest level, as a fraction of depth; doubled at each coarser level up to `max_gate`. Default 0.05; above 0. */
  "odometry.align.depth_gate"?: number;
  /** Upper bound of the depth gate (fraction of depth). Default 0.4; above 0. */
  "odometry.align.max_gate"?: number;
  /** Smallest cosine between normals. Default 0.7; -1 to 1. */
  "odometry.align.normal_cos"?: number;
  /** Standard deviation of misregistration, inflates residuals on slopes and edges. [pixels] Default 0.3; at least 0. */
  "odometry.align.pixel_noise"?: number;
  /** Lower bound of the photometric standard deviation (intensity is 0 to 1). Default 0.002; above 0. */
  "odometry.align.min_photometric_sigma"?: number;
  /** Lower bound of the geometric scale in units of the depth noise model. Default 0.05; above 0. */
  "odometry.align.min_geometric_scale"?: number;
  /** A direction whose information is below this fraction of the best one is not updated. Default 0.000001; 0 to 1. */
  "odometry.align.degenerate_ratio"?: number;
  /** A level ends when no point moves further than this by a step. [m at 1 m] Default 0.0001; at least 0. */
  "odometry.align.convergence"?: number;
}
