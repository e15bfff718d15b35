//! The registry of kernels: each exists as `shaders/NAME.wgsl` and as a Rust twin in
//! `kernels/NAME.rs`, registered together with its bindings by [`kernel!`](crate::kernel).
//!
//! To add one: write both files and add a line to `registry!` below. In the shader, binding 0 is
//! `var<uniform> params: Params`, the bindings of the list follow from 1 on, the entry point is
//! `main` with `@workgroup_size(WORKGROUP_SIZE)`.
mod dispatch;
#[macro_use]
mod params;
pub mod shared;
pub mod tokens;

pub use dispatch::{
    CpuBinding, CpuDispatch, add_i32, load_f32, load_i32, load_u32, or_u32, store_f32, store_i32,
    store_u32,
};
pub use params::{FieldKind, ParamsField, ParamsFieldType, ParamsLayout};

/// How a kernel uses a storage buffer.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Access {
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
}

/// One storage buffer of a kernel.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct Binding {
    /// Name of the variable in the shader.
    pub name: &'static str,
    /// Read only, or read and written.
    pub access: Access,
}

/// A kernel: shader, twin, and what both agree on.
pub struct Kernel {
    /// Name of the shader file without extension.
    pub name: &'static str,
    /// Source before the preprocessor ([`crate::shader::compose`]).
    pub wgsl: &'static str,
    /// Invocations a workgroup (along x).
    pub workgroup_size: u32,
    /// Storage buffers at binding 1, 2, ... of group 0.
    pub bindings: &'static [Binding],
    /// Layout of the uniform struct at binding 0.
    pub params: &'static ParamsLayout,
    /// The same computation in Rust.
    pub twin: fn(&CpuDispatch<'_>),
}

impl core::fmt::Debug for Kernel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Kernel").field("name", &self.name).finish_non_exhaustive()
    }
}

/// Registers a kernel with its twin and binding list:
/// ```text
/// kernel! {
///     /// What it computes.
///     pub static ADAM = "adam" {
///         workgroup_size: 256,
///         params: AdamParams,
///         twin: twin,
///         bindings: [parameters: ReadWrite, gradient: Read],
///     }
/// }
/// ```
#[macro_export]
macro_rules! kernel {
    (
        $(#[$doc:meta])*
        pub static $id:ident = $name:literal {
            workgroup_size: $size:expr,
            params: $params:ty,
            twin: $twin:path,
            bindings: [$($binding:ident: $access:ident),* $(,)?] $(,)?
        }
    ) => {
        $(#[$doc])*
        pub static $id: $crate::kernels::Kernel = $crate::kernels::Kernel {
            name: $name,
            wgsl: $crate::embedded_shader!(concat!(
                env!("CARGO_MANIFEST_DIR"), "/../shaders/", $name, ".wgsl"
            )),
            workgroup_size: $size,
            bindings: &[$($crate::kernels::Binding {
                name: stringify!($binding),
                access: $crate::kernels::Access::$access,
            }),*],
            params: &<$params>::LAYOUT,
            twin: $twin,
        };
    };
}

/// Declares the kernel modules and lists their kernels.
macro_rules! registry {
    ($($(#[$doc:meta])* $module:ident: $id:ident),* $(,)?) => {
        $($(#[$doc])* pub mod $module;)*
        static ALL: &[&Kernel] = &[$(&$module::$id),*];
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
    /// Colour, classes and losses.
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
    sample_features: SAMPLE_FEATURES,
    /// Classes from samples.
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
