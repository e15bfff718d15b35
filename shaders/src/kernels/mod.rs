//! The kernels: `NAME.wgsl` beside this crate's manifest, its declaration here in `NAME.rs`.

/// Declares the modules and lists their interfaces.
macro_rules! registry {
    ($($(#[doc = $doc:literal])* $(#[cfg($cfg:meta)])? $module:ident),* $(,)?) => {
        $($(#[doc = $doc])* $(#[cfg($cfg)])? pub mod $module;)*

        /// All interfaces, by name.
        pub static ALL: &[&crate::interface::Interface] = &[$($(#[cfg($cfg)])? &$module::INTERFACE),*];
    };
}

registry! {
    /// Parameter updates.
    adam,
    /// Normal equations against the field.
    align_points,
    /// Attention's gradients at keys and values.
    attend_keys,
    /// Attention's gradients at queries.
    attend_queries,
    /// Cross-attention.
    attend_tokens,
    /// Interval weights.
    composite,
    /// Gradients at the signed distances.
    composite_backward,
    /// Color, classes and losses.
    decode_rays,
    /// Raw features of image patches.
    extract_tokens,
    /// Gradients through the gate.
    gate_backward,
    /// Gating and fusion.
    gate_tokens,
    /// Gradients at features and positions.
    geometry_backward,
    /// Signed distances.
    geometry_forward,
    /// Geometry decoder's gradient.
    geometry_weights,
    /// Anchors dropped, merged, spawned.
    maintain_anchors,
    /// Outliers of tracking.
    mask_rays,
    /// Nearest anchors of a ray's class and of another.
    match_rivals,
    /// Layers on samples.
    #[cfg(feature = "sample-head")]
    matrix_product,
    /// Rays' pose gradients.
    pose_gradient,
    /// Pose updates.
    pose_step,
    /// Single points.
    query_points,
    /// The map's features at the tokens.
    recall_tokens,
    /// Column sums.
    reduce_partials,
    /// Sample placement.
    sample_depths,
    /// Semantic features of samples.
    #[cfg(feature = "sample-head")]
    sample_features,
    /// Classes from samples.
    #[cfg(feature = "sample-head")]
    sample_logits,
    /// Pixels and rays.
    sample_rays,
    /// Gradients into the geometry planes.
    scatter_geometry,
    /// Gradients into the appearance and semantic planes.
    scatter_surface,
    /// Anchors settle by the head's classes.
    settle_anchors,
    /// A layer on the token grid.
    token_layer,
    /// Gradients at such a layer's inputs.
    token_layer_backward,
    /// Losses of the fused features.
    token_loss,
    /// Gradients of such a layer's weights.
    token_weights,
    /// Anchors follow their features.
    update_anchors,
    /// Per-ray decoders' gradients.
    weight_gradient,
}
