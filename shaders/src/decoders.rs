//! Where the layers of the decoders lie in the decoder buffer.
//!
//! A layer's weights are stored input-major, `weights[k * outputs + j]`, and its biases behind
//! them. The class head 16-C follows at [`END`]: its weights output-major, then C biases.

use core::ops::Range;

/// A layer of a decoder. Offsets are in floats from the start of the decoder buffer.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct Layer {
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// First weight.
    pub weights: usize,
    /// First bias.
    pub bias: usize,
}

impl Layer {
    /// A layer that starts at `weights`.
    const fn at(weights: usize, inputs: usize, outputs: usize) -> Layer {
        Layer { inputs, outputs, weights, bias: weights + inputs * outputs }
    }

    /// The layer behind this one.
    const fn then(&self, inputs: usize, outputs: usize) -> Layer {
        Layer::at(self.end(), inputs, outputs)
    }

    /// Where the weights lie.
    pub const fn weight_range(&self) -> Range<usize> {
        self.weights..self.bias
    }

    /// Where the biases lie.
    pub const fn bias_range(&self) -> Range<usize> {
        self.bias..self.bias + self.outputs
    }

    /// The first float behind the layer; a layer takes whole 4-vectors.
    pub const fn end(&self) -> usize {
        (self.bias + self.outputs).next_multiple_of(4)
    }
}

/// Geometry decoder 32-16-16-1.
pub const GEOMETRY: [Layer; 3] = {
    let first = Layer::at(0, 32, 16);
    let second = first.then(16, 16);
    [first, second, second.then(16, 1)]
};
/// Color decoder 32-32-3; the fourth output is unused.
pub const COLOR: [Layer; 2] = {
    let first = GEOMETRY[2].then(32, 32);
    [first, first.then(32, 4)]
};
/// Semantic decoder 32-32-16.
pub const SEMANTIC: [Layer; 2] = {
    let first = COLOR[1].then(32, 32);
    [first, first.then(32, 16)]
};
/// All layers in the order of the buffer.
pub const LAYERS: [Layer; 7] =
    [GEOMETRY[0], GEOMETRY[1], GEOMETRY[2], COLOR[0], COLOR[1], SEMANTIC[0], SEMANTIC[1]];
/// First float behind the layers: the class head.
pub const END: usize = SEMANTIC[1].end();

/// Offset of a layer's part from the start of the geometry decoder \[vec4\].
pub(crate) const fn geometry_vec4(floats: usize) -> u32 {
    (floats / 4) as u32
}

/// Offset of a layer's part from the start of the color and semantic decoders \[vec4\].
pub(crate) const fn surface_vec4(floats: usize) -> u32 {
    ((floats - COLOR[0].weights) / 4) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checkpoints hold the buffer as it is: its layout must not move.
    #[test]
    fn layers_lie_where_checkpoints_have_them() {
        let offsets = LAYERS.map(|l| (l.weights, l.bias));
        let expected = [
            (0, 512),
            (528, 784),
            (800, 816),
            (820, 1844),
            (1876, 2004),
            (2008, 3032),
            (3064, 3576),
        ];
        assert_eq!(offsets, expected);
        assert_eq!(END, 3592);
    }
}
