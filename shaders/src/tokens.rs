//! What the kernels of the token grid share: parameters, layers, and the columns of a token's row.

/// Floats of the geometry encoding: normal (3), position (3), sines and cosines of 7 bands (42),
/// and what the map holds at the point: its semantic feature (16).
pub const GEOMETRY_INPUTS: u32 = 64;
/// Bands of the positional encoding; wavelengths of 16 m, 8 m .. 0.25 m.
pub const BANDS: u32 = 7;
/// Floats of a patch: 8 x 8 colors.
pub const PATCH_INPUTS: u32 = 192;
/// Hidden units of the geometry embedding.
pub const HIDDEN: u32 = 64;
/// Slope of the leaky rectifiers below 0.
pub const SLOPE: f32 = 0.1;
/// Tokens of a tile of the attention kernels, and invocations of their workgroups.
pub const TILE: usize = 64;

// Columns of a token's raw inputs.
/// Geometry encoding.
pub const RAW_GEOMETRY: u32 = 0;
/// The map's semantic feature at the token's point.
pub const RAW_MEMORY: u32 = 48;
/// Colors of the patch, less one half.
pub const RAW_PATCH: u32 = 64;
/// Mean color (3), 0.
pub const RAW_MEAN: u32 = 256;
/// World position (3) \[m\], 1 where the token has geometry.
pub const RAW_POINT: u32 = 260;
/// Share of the patch's pixels with each class.
pub const RAW_HISTOGRAM: u32 = 264;

// Columns of a token's activations (and of their gradients).
/// Hidden layer of the geometry embedding.
pub const HIDDEN_AT: u32 = 0;
/// G.
pub const GEOMETRY_AT: u32 = 64;
/// S^, after the local module.
pub const LOCAL_AT: u32 = 80;
/// T_a. G, S^ and T_a lie side by side for the gate.
pub const REFINED_AT: u32 = 96;
/// S.
pub const SEMANTIC_AT: u32 = 112;
/// A.
pub const APPEARANCE_AT: u32 = 128;
/// Q1, K1, V1.
pub const FIRST_AT: u32 = 144;
/// T_s.
pub const GUIDED_AT: u32 = 192;
/// Q2, K2, V2.
pub const SECOND_AT: u32 = 208;
/// After the depthwise convolution.
pub const DEPTHWISE_AT: u32 = 256;
/// The gate's convolution (3) and 0, then the normalised gate (3) and 0.
pub const GATE_AT: u32 = 272;
/// Log-sum-exp of both attentions; of the gradients: sum of output x gradient.
pub const STATISTICS_AT: u32 = 280;
/// F.
pub const FUSED_AT: u32 = 284;
/// Color read from F (3), loss.
pub const COLOR_AT: u32 = 300;
/// Gradients at the class logits.
pub const LOGITS_AT: u32 = 304;

shared_struct! {
    /// Parameters of every kernel on the token grid; each uses some.
    pub struct TokenParams {
        /// Columns of the grid.
        columns: u32,
        /// Rows of the grid.
        rows: u32,
        /// Floats a token's activations take.
        stride: u32,
        /// Floats a token's raw inputs take.
        raw_stride: u32,
        /// Image width \[pixels\].
        width: u32,
        /// Image height \[pixels\].
        height: u32,
        /// Edge of a token \[pixels\], a multiple of 8.
        size: u32,
        /// Storage slot of the frame.
        slot: u32,
        /// Focal length \[pixels\].
        fx: f32,
        /// Focal length \[pixels\].
        fy: f32,
        /// Principal point \[pixels\].
        cx: f32,
        /// Principal point \[pixels\].
        cy: f32,
        /// Smallest corner of the map \[m\], the origin of the encoded position.
        box_min: [f32; 4],
        /// Metres per unit of the depth image.
        depth_unit: f32,
        /// Classes.
        classes: u32,
        /// First float of the raw inputs.
        raw_at: u32,
        /// First layer of the dispatch.
        layer: u32,
        /// First column of the queries; keys and values follow.
        query: u32,
        /// Column added to what attention gives, or `NO_RESIDUAL`.
        residual: u32,
        /// Column of the log-sum-exp.
        statistics: u32,
        /// Every n-th column and row of the grid is a key.
        key_stride: u32,
        /// First column of what attention gives.
        output: u32,
        /// Tokens per chunk of the weights' gradients.
        chunk: u32,
        /// Floats per row of partial gradients.
        row: u32,
        /// 1: write the gradients.
        train: u32,
        /// Weight of the cross-entropy.
        weight_class: f32,
        /// Weight of the color loss.
        weight_color: f32,
        /// First weight of the color head.
        color_head: u32,
        /// Unused.
        spare0: u32,
    }
}

shared_struct! {
    /// A layer on the token grid. A dispatch runs several, one for each workgroup in z.
    pub struct TokenLayer {
        /// 1: inputs are raw inputs.
        from_raw: u32,
        /// First column of the inputs.
        input: u32,
        /// Inputs.
        inputs: u32,
        /// First column of the outputs.
        output: u32,
        /// Outputs.
        outputs: u32,
        /// Edge of the kernel: 1 or 3.
        taps: u32,
        /// 1: each output sees its own input only.
        depthwise: u32,
        /// 1: leaky rectifier behind the layer.
        activation: u32,
        /// First weight.
        weights: u32,
        /// First bias, or `NO_BIAS`.
        bias: u32,
        /// Floats from one input's weights to the next one's.
        input_stride: u32,
        /// Floats from one output's weights to the next one's.
        output_stride: u32,
    }
}

impl TokenLayer {
    /// Number of weights, which are stored input-major.
    pub fn weight_count(&self) -> u32 {
        self.taps
            * self.taps
            * self.inputs
            * if self.depthwise == 1 { 1 } else { self.input_stride }
    }

    /// Number of biases, with padding as weights have it.
    pub fn bias_count(&self) -> u32 {
        if self.bias == NO_BIAS { 0 } else { self.input_stride }
    }

    /// Fours of outputs.
    pub fn quads(&self) -> usize {
        self.outputs.div_ceil(4) as usize
    }

    /// Invocations of `token_weights` a chunk of tokens.
    pub fn weight_jobs(&self) -> usize {
        let taps = (self.taps * self.taps * self.inputs) as usize;
        taps * if self.depthwise == 1 { 1 } else { self.quads() }
            + if self.bias == NO_BIAS { 0 } else { self.quads() }
    }
}

/// No bias.
pub const NO_BIAS: u32 = u32::MAX;
/// No residual connection.
pub const NO_RESIDUAL: u32 = u32::MAX;

impl TokenParams {
    /// Tokens of the grid.
    pub fn tokens(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    /// Columns of keys.
    pub fn key_columns(&self) -> u32 {
        self.columns.div_ceil(self.key_stride)
    }

    /// Number of keys.
    pub fn keys(&self) -> usize {
        (self.key_columns() * self.rows.div_ceil(self.key_stride)) as usize
    }

    /// Token of a key.
    pub fn key_token(&self, key: usize) -> usize {
        let key = key as u32;
        let (x, y) = (key % self.key_columns(), key / self.key_columns());
        (y * self.key_stride * self.columns + x * self.key_stride) as usize
    }

    /// Token at an offset of -1..=1 in both directions, if it is on the grid.
    pub fn neighbour(&self, token: usize, dx: i32, dy: i32) -> Option<usize> {
        let (x, y) = (token as i32 % self.columns as i32, token as i32 / self.columns as i32);
        let (x, y) = (x + dx, y + dy);
        let inside = x >= 0 && y >= 0 && x < self.columns as i32 && y < self.rows as i32;
        inside.then(|| (y * self.columns as i32 + x) as usize)
    }
}
