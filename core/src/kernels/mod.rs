//! The kernels' Rust twins and the registry: kernel NAME is `NAME.wgsl` and
//! `src/kernels/NAME.rs` (its declaration) in `mte-slam-shaders`, and its twin `kernels/NAME.rs` here,
//! joined by [`kernel!`](crate::kernel!).
//!
//! To add one: write the three files and add a line to `registry!` in both crates. In the twin, the
//! declaration's bindings are fields of `Views`; a call names them as fields of `Buffers`.
pub mod shared;
pub mod tokens;

use crate::kernel::Kernel;

/// Declares the kernel modules and lists their kernels.
macro_rules! registry {
    ($($(#[doc = $doc:literal])* $(#[cfg($cfg:meta)])? $module:ident: $id:ident),* $(,)?) => {
        $($(#[doc = $doc])* $(#[cfg($cfg)])? pub mod $module;)*
        static ALL: &[&Kernel] = &[$($(#[cfg($cfg)])? &$module::$id),*];
    };
}

registry! {
    /// Parameter updates.
    adam: ADAM,
    /// Normal equations against the field.
    align_points: ALIGN_POINTS,
    /// Attention's gradients at keys and values.
    attend_keys: ATTEND_KEYS,
    /// Attention's gradients at queries.
    attend_queries: ATTEND_QUERIES,
    /// Cross-attention.
    attend_tokens: ATTEND_TOKENS,
    /// Interval weights.
    composite: COMPOSITE,
    /// Gradients at the signed distances.
    composite_backward: COMPOSITE_BACKWARD,
    /// Color, classes and losses.
    decode_rays: DECODE_RAYS,
    /// Raw features of image patches.
    extract_tokens: EXTRACT_TOKENS,
    /// Gradients through the gate.
    gate_backward: GATE_BACKWARD,
    /// Gating and fusion.
    gate_tokens: GATE_TOKENS,
    /// Gradients at features and positions.
    geometry_backward: GEOMETRY_BACKWARD,
    /// Signed distances.
    geometry_forward: GEOMETRY_FORWARD,
    /// Geometry decoder's gradient.
    geometry_weights: GEOMETRY_WEIGHTS,
    /// Anchors dropped, merged, spawned.
    maintain_anchors: MAINTAIN_ANCHORS,
    /// Outliers of tracking.
    mask_rays: MASK_RAYS,
    /// Nearest anchors of a ray's class and of another.
    match_rivals: MATCH_RIVALS,
    /// Layers on samples.
    #[cfg(feature = "sample-head")]
    matrix_product: MATRIX_PRODUCT,
    /// Rays' pose gradients.
    pose_gradient: POSE_GRADIENT,
    /// Pose updates.
    pose_step: POSE_STEP,
    /// Single points.
    query_points: QUERY_POINTS,
    /// The map's features at the tokens.
    recall_tokens: RECALL_TOKENS,
    /// Column sums.
    reduce_partials: REDUCE_PARTIALS,
    /// Sample placement.
    sample_depths: SAMPLE_DEPTHS,
    /// Semantic features of samples.
    #[cfg(feature = "sample-head")]
    sample_features: SAMPLE_FEATURES,
    /// Classes from samples.
    #[cfg(feature = "sample-head")]
    sample_logits: SAMPLE_LOGITS,
    /// Pixels and rays.
    sample_rays: SAMPLE_RAYS,
    /// Gradients into the geometry planes.
    scatter_geometry: SCATTER_GEOMETRY,
    /// Gradients into the appearance and semantic planes.
    scatter_surface: SCATTER_SURFACE,
    /// Anchors settle by the head's classes.
    settle_anchors: SETTLE_ANCHORS,
    /// A layer on the token grid.
    token_layer: TOKEN_LAYER,
    /// Gradients at such a layer's inputs.
    token_layer_backward: TOKEN_LAYER_BACKWARD,
    /// Losses of the fused features.
    token_loss: TOKEN_LOSS,
    /// Gradients of such a layer's weights.
    token_weights: TOKEN_WEIGHTS,
    /// Anchors follow their features.
    update_anchors: UPDATE_ANCHORS,
    /// Per-ray decoders' gradients.
    weight_gradient: WEIGHT_GRADIENT,
}

/// All kernels, in the order of registration.
pub fn all() -> &'static [&'static Kernel] {
    ALL
}
