//! Parameters and buffers of the per-sample class head.
use crate::{
    commands::{Buffer, Commands},
    engine::{Engine, EngineError},
    kernels::shared::random_f32,
    layout::CHANNELS,
    map::ParameterTensor,
};
use alloc::vec;
use mte_slam_shaders::random::{first_values, salt};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Units of each hidden layer.
const HIDDEN: u32 = 256;
/// Inputs: the semantic features of a sample, coarse and fine.
pub(super) const INPUTS: u32 = 2 * CHANNELS as u32;
/// Samples that go through the perceptron at once.
pub(super) const PART: u32 = 8192;
/// Rows of partial sums of the weights' gradients.
pub(super) const SPLITS: u32 = 4;
/// Samples per ray of a view: the first intervals that carry weight. Behind them next to no light
/// is left; on the others the head would run for nothing.
pub(super) const VIEW_SLOTS: u32 = 24;

/// A layer: weights input-major, then biases.
#[derive(Clone, Copy, Debug)]
pub struct SampleLayer {
    /// Inputs.
    pub inputs: u32,
    /// Outputs.
    pub outputs: u32,
    /// First weight in the parameters.
    pub weights: u32,
}

impl SampleLayer {
    /// First bias in the parameters.
    pub fn bias(&self) -> u32 {
        self.weights + self.inputs * self.outputs
    }
}

/// The parameters of the head.
pub struct SampleHead {
    /// Weights and biases of all layers.
    pub parameters: ParameterTensor,
    /// 32-256-256-256-C.
    pub layers: [SampleLayer; 4],
}

/// Activations and gradients of the head.
pub(crate) struct SampleScratch {
    pub(super) features: Buffer<[f32; 4]>,
    pub(super) feature_gradient: Buffer<[f32; 4]>,
    pub(super) slot_depths: Buffer<f32>,
    pub(super) slot_weights: Buffer<f32>,
    /// Outputs of the layers for a part's samples; the last are the logits, then their gradients.
    pub(super) outputs: [Buffer<f32>; 4],
    /// Gradients at hidden layers, taking turns.
    pub(super) deltas: [Buffer<f32>; 2],
    pub(super) partials: Buffer<f32>,
    pub(super) no_mask: Buffer<f32>,
}

impl SampleHead {
    /// The head, as this build has one.
    pub(in crate::map) fn new(
        e: &mut Engine,
        classes: u32,
        seed: u32,
    ) -> Result<Option<SampleHead>, EngineError> {
        let mut weights = 0;
        let sizes = [INPUTS, HIDDEN, HIDDEN, HIDDEN, classes];
        let layers = core::array::from_fn(|i| {
            let layer = SampleLayer { inputs: sizes[i], outputs: sizes[i + 1], weights };
            weights = layer.bias() + layer.outputs;
            layer
        });
        let floats = weights as usize;
        let parameters = ParameterTensor::new(e, "sample head", floats)?;
        let head = SampleHead { parameters, layers };
        let mut w = vec![0.0_f32; floats];
        for layer in &head.layers {
            let limit = (6.0 / layer.inputs as f32).sqrt();
            for i in layer.weights..layer.bias() {
                w[i as usize] =
                    (2.0 * random_f32(
                        seed,
                        first_values::SAMPLE_HEAD,
                        i,
                        salt::SAMPLE_HEAD_AS_KEYFRAME_POINT,
                    ) - 1.0)
                        * limit;
            }
        }
        let mut r = Commands::default();
        r.upload(head.parameters.values, 0, &w);
        e.submit(&r)?;
        Ok(Some(head))
    }
}

impl SampleScratch {
    /// `trained` is the most samples of a training batch, `rays` the most rays of any.
    pub(in crate::map) fn new(
        e: &mut Engine,
        head: &SampleHead,
        classes: u32,
        trained: usize,
        rays: usize,
    ) -> Result<SampleScratch, EngineError> {
        let slots = trained.max(rays * VIEW_SLOTS as usize);
        let hidden = |e: &mut Engine, name| e.create(name, (PART * HIDDEN) as usize);
        let partials = SPLITS as usize * head.parameters.floats;
        Ok(SampleScratch {
            features: e.create("sample features", slots * INPUTS as usize)?,
            feature_gradient: e.create("sample feature gradients", trained * INPUTS as usize)?,
            slot_depths: e.create("slot depths", slots)?,
            slot_weights: e.create("slot weights", slots)?,
            outputs: [
                hidden(e, "sample layer 1")?,
                hidden(e, "sample layer 2")?,
                hidden(e, "sample layer 3")?,
                e.create("sample logits", (PART * classes) as usize)?,
            ],
            deltas: [hidden(e, "sample deltas 1")?, hidden(e, "sample deltas 2")?],
            partials: e.create("sample head partials", partials)?,
            no_mask: e.create("no mask", 4)?,
        })
    }
}
