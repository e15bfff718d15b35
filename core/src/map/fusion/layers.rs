//! Layers of the fusion, and which of them one dispatch runs side by side.
use crate::{
    commands::{Buffer, Commands, workgroups_1d},
    config::FusionConfig,
    engine::{Engine, EngineError},
    kernels::{
        token_layer::TOKEN_LAYER,
        tokens::{
            APPEARANCE_AT, COLOR_AT, DEPTHWISE_AT, FIRST_AT, FUSED_AT, GATE_AT, GEOMETRY_AT,
            GEOMETRY_INPUTS, GUIDED_AT, HIDDEN, HIDDEN_AT, LOCAL_AT, LOGITS_AT, NO_BIAS,
            PATCH_INPUTS, RAW_GEOMETRY, RAW_HISTOGRAM, RAW_PATCH, SECOND_AT, SEMANTIC_AT,
            TokenLayer,
        },
    },
};
use alloc::{vec, vec::Vec};

/// One layer of the fusion.
#[derive(Clone, Copy, Debug)]
pub struct FusionLayer {
    /// What it is called in the paper or the design.
    pub name: &'static str,
    /// What the kernels know of it; `weights` and `bias` are places in the parameter buffer.
    pub shape: TokenLayer,
}

impl FusionLayer {
    /// Whether the configuration runs it; its parameters are there in any case.
    pub(super) fn used(&self, config: &FusionConfig) -> bool {
        config.local || self.name != "depthwise"
    }
}

/// Layers in the order of the forward pass, and the parameters that they take.
pub(super) fn layers(
    classes: u32,
    channels: u32,
    config: &FusionConfig,
) -> (Vec<FusionLayer>, u32) {
    let mut at = 0;
    let mut all = Vec::new();
    let mut add =
        |name, from_raw, input, inputs, output, outputs: u32, taps, kind: (bool, bool, bool)| {
            let (depthwise, activation, biased) = kind;
            // `token_loss` reads the colour head four columns wide; layers have no padding.
            let input_stride = if name == "colour head" { 4 } else { outputs };
            let mut shape = TokenLayer {
                from_raw: u32::from(from_raw),
                input,
                inputs,
                output,
                outputs,
                taps,
                depthwise: u32::from(depthwise),
                activation: u32::from(activation),
                weights: at,
                bias: NO_BIAS,
                input_stride,
                output_stride: 1,
            };
            at += shape.weight_count();
            if biased {
                shape.bias = at;
                at += shape.bias_count();
            }
            all.push(FusionLayer { name, shape });
        };
    let (plain, linear) = ((false, false, false), (false, false, true));
    let local = config.local_kernel;
    add(
        "geometry hidden",
        true,
        RAW_GEOMETRY,
        GEOMETRY_INPUTS,
        HIDDEN_AT,
        HIDDEN,
        1,
        (false, true, true),
    );
    add("geometry", false, HIDDEN_AT, HIDDEN, GEOMETRY_AT, 16, 1, linear);
    if channels > 0 {
        // Without bias: keys that all move alike change no softmax, so it would never learn.
        add(FEATURE_LAYER, true, 0, channels, SEMANTIC_AT, 16, 1, plain);
    } else {
        add("class embedding", true, RAW_HISTOGRAM, classes, SEMANTIC_AT, 16, 1, plain);
    }
    add("patch embedding", true, RAW_PATCH, PATCH_INPUTS, APPEARANCE_AT, 16, 1, linear);
    add("Q1", false, GEOMETRY_AT, 16, FIRST_AT, 16, 1, plain);
    add("K1", false, SEMANTIC_AT, 16, FIRST_AT + 16, 16, 1, plain);
    add("V1", false, APPEARANCE_AT, 16, FIRST_AT + 32, 16, 1, plain);
    add("Q2", false, GUIDED_AT, 16, SECOND_AT, 16, 1, plain);
    add("K2", false, APPEARANCE_AT, 16, SECOND_AT + 16, 16, 1, plain);
    add("V2", false, APPEARANCE_AT, 16, SECOND_AT + 32, 16, 1, plain);
    add("depthwise", false, GUIDED_AT, 16, DEPTHWISE_AT, 16, 3, (true, true, true));
    let input = if config.local { DEPTHWISE_AT } else { GUIDED_AT };
    add("pointwise", false, input, 16, LOCAL_AT, 16, local, (false, true, true));
    add("gate", false, GEOMETRY_AT, 48, GATE_AT, 3, config.gate_kernel, linear);
    add("colour head", false, FUSED_AT, 16, COLOR_AT, 3, 1, linear);
    (all, at)
}

/// The layer that reads feature maps, which lie in a buffer of their own.
const FEATURE_LAYER: &str = "feature projection";

/// A step of a pass over a frame's tokens.
pub(super) enum Step<L> {
    /// Layers side by side.
    Layers(L),
    /// Geometry asks semantics for appearance (paper eqs. 1, 2).
    FirstAttention,
    /// Guided semantics ask appearance (paper eqs. 3, 4).
    SecondAttention,
}

/// The forward pass: no layer of a step reads what another one writes.
const FORWARD: [Step<&[&str]>; 8] = [
    Step::Layers(&["geometry hidden", "class embedding", "patch embedding"]),
    Step::Layers(&["geometry", "K1", "V1", "K2", "V2"]),
    Step::Layers(&["Q1"]),
    Step::FirstAttention,
    Step::Layers(&["Q2", "depthwise"]),
    Step::Layers(&["pointwise"]),
    Step::SecondAttention,
    Step::Layers(&["gate"]),
];
/// The backward pass: no layer of a step adds to gradients that another one reads or adds to. The
/// loss has already sent the colour head's on.
const BACKWARD: [Step<&[&str]>; 8] = [
    Step::Layers(&["gate"]),
    Step::Layers(&["pointwise"]),
    Step::SecondAttention,
    Step::Layers(&["depthwise", "V2"]),
    Step::Layers(&["Q2", "K2"]),
    Step::FirstAttention,
    Step::Layers(&["V1", "K1", "Q1"]),
    Step::Layers(&["geometry"]),
];

/// Layers that one dispatch runs.
pub(super) struct Group {
    /// The first one's place in the table.
    pub first: u32,
    layers: Vec<TokenLayer>,
}

impl Group {
    /// Workgroups for as many invocations as the layer with most has.
    pub fn workgroups(&self, invocations: impl Fn(&TokenLayer) -> usize) -> [u32; 3] {
        let most = self.layers.iter().map(invocations).max().unwrap_or(0);
        let [x, y, _] = workgroups_1d(most, TOKEN_LAYER.interface.workgroup_size);
        [x, y, self.layers.len() as u32]
    }
}

/// The dispatches of layers, and the table they find them in.
pub(super) struct Schedule {
    pub table: Buffer<TokenLayer>,
    /// As [`FORWARD`].
    pub forward: Vec<Step<Group>>,
    /// As [`BACKWARD`].
    pub backward: Vec<Step<Group>>,
    /// All layers but the one of feature maps.
    pub weights: Group,
    /// That one.
    pub features: Option<Group>,
    /// The class head, which is shared with the field; its weights are stored output-major.
    pub head: Group,
}

impl Schedule {
    pub fn new(
        e: &mut Engine,
        layers: &[FusionLayer],
        classes: u32,
        config: &FusionConfig,
    ) -> Result<Schedule, EngineError> {
        let mut table: Vec<TokenLayer> = Vec::new();
        let mut group = |layers: Vec<TokenLayer>| {
            let first = table.len() as u32;
            table.extend(&layers);
            Group { first, layers }
        };
        let used: Vec<&FusionLayer> = layers.iter().filter(|l| l.used(config)).collect();
        let mut all = |steps: [Step<&[&str]>; 8]| {
            let of = |step: Step<&[&str]>| match step {
                Step::Layers(names) => {
                    let named = used.iter().filter(|l| names.contains(&l.name));
                    Step::Layers(group(named.map(|l| l.shape).collect()))
                }
                Step::FirstAttention => Step::FirstAttention,
                Step::SecondAttention => Step::SecondAttention,
            };
            steps.map(of).into_iter().collect()
        };
        let (forward, backward) = (all(FORWARD), all(BACKWARD));
        let (features, rest): (Vec<&FusionLayer>, _) =
            used.iter().partition(|l| l.name == FEATURE_LAYER);
        let weights = group(rest.iter().map(|l| l.shape).collect());
        let features = features.first().map(|l| group(vec![l.shape]));
        let head = group(vec![TokenLayer {
            input: FUSED_AT,
            inputs: 16,
            output: LOGITS_AT,
            outputs: classes,
            taps: 1,
            bias: classes * 16,
            input_stride: 1,
            output_stride: 16,
            ..TokenLayer::default()
        }]);
        let words: &[u32] = bytemuck::cast_slice(&table);
        let buffer = e.create("token layers", words.len())?;
        let mut r = Commands::default();
        r.upload(buffer, 0, words);
        e.submit(&r)?;
        Ok(Schedule { table: buffer, forward, backward, weights, features, head })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A misspelt name would leave a layer out, two in one place would race.
    #[test]
    fn every_layer_is_in_one_group_and_none_in_the_way_of_another() {
        for (channels, local) in [(0, true), (11, true), (0, false)] {
            let config = FusionConfig { local, ..FusionConfig::default() };
            let mut e = Engine::cpu();
            let (all, _) = layers(5, channels, &config);
            let s = Schedule::new(&mut e, &all, 5, &config).unwrap();
            let groups = |steps: Vec<Step<Group>>| -> Vec<Group> {
                let group = |step| if let Step::Layers(group) = step { Some(group) } else { None };
                steps.into_iter().filter_map(group).collect()
            };
            let (forward, backward) = (groups(s.forward), groups(s.backward));
            let weights = |groups: &[Group]| -> Vec<u32> {
                let mut found: Vec<u32> =
                    groups.iter().flat_map(|g| &g.layers).map(|l| l.weights).collect();
                found.sort_unstable();
                found
            };
            let of = |kept: &dyn Fn(&FusionLayer) -> bool| -> Vec<u32> {
                let used = all.iter().filter(|l| l.used(&config) && kept(l));
                used.map(|l| l.shape.weights).collect()
            };
            let own_buffer = |l: &FusionLayer| l.name == FEATURE_LAYER;
            let read_by_loss = |l: &FusionLayer| l.name == "colour head";
            assert_eq!(weights(&forward), of(&|l| !own_buffer(l) && !read_by_loss(l)));
            assert_eq!(weights(&backward), of(&|l| l.shape.from_raw == 0 && !read_by_loss(l)));
            assert_eq!(weights(&[s.weights]), of(&|l| !own_buffer(l)));
            assert_eq!(s.features.is_some(), channels > 0);
            for (a, b) in forward.iter().flat_map(others) {
                assert!(apart(outputs(&a), outputs(&b)));
                assert!(b.from_raw == 1 || apart(outputs(&a), inputs(&b)));
            }
            for (a, b) in backward.iter().flat_map(others) {
                assert!(apart(inputs(&a), inputs(&b)));
                assert!(apart(inputs(&a), outputs(&b)));
            }
        }
    }

    fn inputs(l: &TokenLayer) -> [u32; 2] {
        [l.input, l.input + l.inputs]
    }

    fn outputs(l: &TokenLayer) -> [u32; 2] {
        [l.output, l.output + l.outputs]
    }

    /// Whether two ranges of columns have none in common.
    fn apart(a: [u32; 2], b: [u32; 2]) -> bool {
        a[1] <= b[0] || b[1] <= a[0]
    }

    /// Each layer of a group with each other one.
    fn others(group: &Group) -> Vec<(TokenLayer, TokenLayer)> {
        let all = || group.layers.iter().copied().enumerate();
        let pairs = all().flat_map(|a| all().map(move |b| (a, b)));
        pairs.filter(|((i, _), (k, _))| i != k).map(|((_, a), (_, b))| (a, b)).collect()
    }
}
