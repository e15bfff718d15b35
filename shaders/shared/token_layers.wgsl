// Layers on the token grid. A dispatch runs several, one for each workgroup in z. Needs binding layers: array<TokenLayer>.
var<private> layer: TokenLayer;

// Sets the layer of an invocation; its number within it.
fn start_layer(wid: vec3<u32>, groups: vec3<u32>, lane: u32) -> u32 {
    layer = layers[params.layer + wid.z];
    return linear_invocation(vec3(wid.xy, 0u), groups, lane);
}
