//! Settings of the semantic modules.
mte_slam_types::choices! {
    /// Where a pixel's class comes from.
    pub enum Head {
        /// Features are composited and decoded once per ray.
        Ray = "ray",
        /// A perceptron 32-256-256-256-C runs on every sample, and its logits are composited
        /// (SNI-SLAM): a baseline to compare with. Fusion and suppressor work on features of rays;
        /// with it they are off.
        Sample = "sample",
    }

    /// How anchors follow their features.
    pub enum AnchorRule {
        /// Moving average with a fixed rate (paper eq. 11).
        Average = "average",
        /// Running mean (paper eq. 12).
        Mean = "mean",
    }

    /// What gives a pixel or a vertex its class.
    pub enum Inference {
        /// The class head.
        Head = "head",
        /// The nearest anchor, once the last optimisation is complete and anchors have settled;
        /// before that, and without a suppressor, the class head.
        Anchors = "anchors",
    }
}

mte_slam_types::settings! {
    /// Semantics.
    pub struct SemanticsConfig {
        /// What turns semantic features into classes: `sample` is the paper's, for comparison, in
        /// builds with the feature `sample-head` alone.
        head: Head = Head::Ray;
    }

    /// Multi-tier feature fusion (paper III-A). Without labels it is off.
    pub struct FusionConfig {
        /// Use it.
        enabled: bool = true;
        /// Edge of a token.
        token_pixels: u32["pixels"] = 8, OneOf(&[8, 16, 24, 32]);
        /// Every n-th column and row of tokens is a key of the attention.
        key_stride: u32["tokens"] = 2, Between(1.0, 16.0);
        /// Add a token's own appearance to what attention gives in the second stage.
        residual: bool = true;
        /// Local module: depthwise convolution before the pointwise one.
        local: bool = true;
        /// Edge of the pointwise convolution: 1, or 3 as the paper writes.
        local_kernel: u32["tokens"] = 1, OneOf(&[1, 3]);
        /// Edge of the gate's convolution.
        gate_kernel: u32["tokens"] = 1, OneOf(&[1, 3]);
        /// Give the fusion the map's own semantic feature at each token's point.
        memory: bool = true;
        /// Training steps per mapped frame, about half of them on earlier frames.
        steps: u32 = 1, Between(0.0, 1000.0);
        /// Training steps on the first frame.
        first_steps: u32 = 40, Between(0.0, 10_000.0);
        /// Adam step.
        rate: f64 = 1e-2, Above(0.0);
        /// Weight of the cross-entropy at the fused features.
        weight_class: f64 = 1.0, AtLeast(0.0);
        /// Weight of the color loss at the fused features.
        weight_color: f64 = 0.5, AtLeast(0.0);
        /// Exponent of the inverse frequency that weighs classes: 0 as they come, 1 balanced.
        balance: f64 = 0.5, Between(0.0, 4.0);
        /// Weight of the feature loss: rays against the fused feature of their pixel.
        weight: f64 = 0.0, AtLeast(0.0);
        /// The same while the semantics are trained alone, at the end.
        final_weight: f64 = 0.003, AtLeast(0.0);
        /// Training steps in that stage, spread over its iterations.
        final_steps: u32 = 200, Between(0.0, 100_000.0);
        /// In that stage: how fast trust in a label falls with its logit below the best one at the
        /// fused feature of the pixel; 0: every label is believed.
        doubt: f64 = 0.5, AtLeast(0.0);
    }

    /// Feature redundancy suppressor (paper III-B). Without labels it is off.
    pub struct SuppressorConfig {
        /// Use it.
        enabled: bool = true;
        /// Most anchors.
        anchors: u32 = 256, Between(1.0, 256.0);
        /// Weight of the compression loss once it is on in full.
        weight: f64 = 0.0, AtLeast(0.0);
        /// The same while the semantics are trained alone, at the end.
        final_weight: f64 = 0.003, AtLeast(0.0);
        /// Mapped frames before the compression loss begins.
        start: u32["mapped frames"] = 1;
        /// Mapped frames over which it rises.
        ramp: u32["mapped frames"] = 10;
        /// How anchors follow their features.
        rule: AnchorRule = AnchorRule::Mean;
        /// Rate of the moving average.
        beta: f64 = 0.05, Between(0.0, 1.0);
        /// Most matches that the running mean remembers.
        memory: f64["matches"] = 2000.0, Above(0.0);
        /// Share of importance and votes that each update keeps.
        decay: f64 = 0.999, Between(0.0, 1.0);
        /// A feature this far from every anchor of its class spawns one.
        spawn_distance: f64 = 4.0, Above(0.0);
        /// Anchors of a class closer than this merge.
        merge_distance: f64 = 2.0, Above(0.0);
        /// Most anchors spawned per maintenance.
        spawns: u32 = 8, Between(0.0, 256.0);
        /// Anchors merge once they move less than this per update.
        stable: f64 = 0.05, AtLeast(0.0);
        /// Less important anchors (matches, decayed) are dropped.
        min_importance: f64["matches"] = 100.0, AtLeast(0.0);
        /// Updates before an anchor may be dropped or merged.
        min_age: u32["updates"] = 40;
        /// While the semantics are trained alone: how fast trust in a label falls with the
        /// (squared) distance of its class's nearest anchor beyond that of the nearest one; 0:
        /// every label is believed.
        doubt: f64 = 1.0, AtLeast(0.0);
        /// Iterations that settle the anchors by the head's classes at the very end, as a multiple
        /// of `mapping.semantic_iterations`; nothing but the anchors changes.
        settle_share: f64 = 0.3, Between(0.0, 10.0);
        /// What gives a rendered pixel its class.
        inference: Inference = Inference::Head;
    }
}
