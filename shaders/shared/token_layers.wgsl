// Layers on the token grid. A dispatch runs several, one for each workgroup in z. Twin: TokenLayer in core/src/kernels/tokens.rs.
struct Layer {
    // from_raw: inputs are raw inputs. input, output: first columns.
    from_raw: u32, input: u32, inputs: u32, output: u32,
    outputs: u32, taps: u32, depthwise: u32, activation: u32,
    weights: u32, bias: u32, input_stride: u32, output_stride: u32,
}
@group(0) @binding(1) var<storage, read> layers: array<Layer>;
var<private> layer: Layer;

// Sets the layer of an invocation; its number within it.
fn start_layer(wid: vec3<u32>, groups: vec3<u32>, lane: u32) -> u32 {
    layer = layers[params.layer + wid.z];
    return linear_invocation(vec3(wid.xy, 0u), groups, lane);
}
