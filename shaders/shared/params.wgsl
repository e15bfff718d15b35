// One uniform block for all ray and field kernels. Twin: FieldParams in core/src/layout.rs.
struct Params {
    // Camera [pixels] and batch.
    width: u32, height: u32, rays: u32, samples: u32,
    fx: f32, fy: f32, cx: f32, cy: f32,
    // depth_unit [m per unit of the depth image], truncation [m], sharpness [per truncation], near [m].
    depth_unit: f32, truncation: f32, sharpness: f32, near: f32,
    // flags: see FLAG_* below. first: first pixel of a dense batch.
    seed: u32, iteration: u32, flags: u32, rays_per_frame: u32,
    stratified: u32, surface_samples: u32, classes: u32, first: u32,
    // Field: box [m]; cells are (nx, ny, nz, first cell); inv_cell is (coarse, fine, -, -) [1/m].
    box_min: vec4f,
    box_max: vec4f,
    geometry_coarse: vec4<u32>,
    geometry_fine: vec4<u32>,
    surface_coarse: vec4<u32>,
    surface_fine: vec4<u32>,
    geometry_inv_cell: vec4f,
    surface_inv_cell: vec4f,
    // Loss weights, divided by the number of rays where they are used.
    weight_free: f32, weight_centre: f32, weight_tail: f32, weight_depth: f32,
    weight_color: f32, weight_semantic: f32, min_weight: f32, decoder_stride: u32,
    // Fixed-point scales of the scattered gradients, and the largest single contribution in quanta.
    scale_geometry: f32, scale_appearance: f32, scale_semantic: f32, contribution_limit: f32,
    // align_points: 1 / sigma of both residuals [1/m, 1], scales of the robust weights [m, 1].
    inv_sigma_distance: f32, inv_sigma_intensity: f32, robust_distance: f32, robust_intensity: f32,
    // Gradients at a sample's pre-activation below this (per ray) are dropped: they move nothing but cost a scatter.
    min_gradient: f32, weight_compression: f32, weight_feature: f32, anchors: u32,
    // Token grid of the fused features [tokens], edge of a token [pixels], floats of a token's raw inputs.
    token_columns: u32, token_rows: u32, token_size: u32, raw_stride: u32,
    // How fast trust in a label falls: by anchors, by fused features.
    doubt_anchor: f32, doubt_fused: f32,
    // Samples of a ray that the per-sample head sees.
    slots: u32,
    // Share of drawn rays that are the rarest in class of so many candidates.
    rare_share: f32, rare_draws: u32,
}
@group(0) @binding(0) var<uniform> params: Params;

// Pixels are taken in order from `first`, not drawn.
const FLAG_DENSE: u32 = 1u;
// Depth images guide the samples of rays that have a depth.
const FLAG_GUIDED: u32 = 2u;
// Write gradients with respect to sample positions (tracking, joint pose refinement).
const FLAG_POSE: u32 = 4u;
// Write gradients with respect to plane features (mapping).
const FLAG_MAP: u32 = 8u;
// Mask rays whose depth error passes the outlier threshold.
const FLAG_MASK: u32 = 16u;
// Class of a ray: that of its nearest anchor, not the head's.
const FLAG_ANCHORS: u32 = 32u;
