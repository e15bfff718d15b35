// Geometry decoder 32-16-16-1 with ReLU, tanh at the end: signed distance in truncations.
// Needs binding decoders: array<vec4f>.
// Weights lie input-major, W[k * O/4 + j] holds outputs 4j..4j+3 of input k: constant indices into
// workgroup memory and one fused multiply-add per four products (measured 3x over a storage buffer).
var<workgroup> gw: array<vec4f, ${SURFACE_VEC4}>;

fn load_geometry_decoder(lane: u32) {
    for (var i = lane; i < ${SURFACE_VEC4}u; i += WORKGROUP_SIZE) {
        gw[i] = decoders[i];
    }
    workgroupBarrier();
}

struct GeometryState {
    h1: array<vec4f, 4>,
    h2: array<vec4f, 4>,
    distance: f32,
}

fn geometry_decoder(f: array<vec4f, 8>) -> GeometryState {
    var s: GeometryState;
    var x = f;
#for j in 0..4
    var a${j} = gw[${GEOMETRY_B1+j}];
#end
#for q in 0..8
#for c in 0..4
    {
        let v = vec4f(x[${q}][${c}]);
#for j in 0..4
        a${j} = fma(gw[${(q*4+c)*4+j}], v, a${j});
#end
    }
#end
#end
#for j in 0..4
    s.h1[${j}] = max(a${j}, vec4f(0.0));
    var b${j} = gw[${GEOMETRY_B2+j}];
#end
#for q in 0..4
#for c in 0..4
    {
        let v = vec4f(s.h1[${q}][${c}]);
#for j in 0..4
        b${j} = fma(gw[${GEOMETRY_W2+(q*4+c)*4+j}], v, b${j});
#end
    }
#end
#end
    var o = gw[${GEOMETRY_B3}].x;
#for j in 0..4
    s.h2[${j}] = max(b${j}, vec4f(0.0));
    o += dot(gw[${GEOMETRY_W3+j}], s.h2[${j}]);
#end
    s.distance = tanh(o);
    return s;
}

struct GeometryDeltas {
    d1: array<vec4f, 4>,
    d2: array<vec4f, 4>,
    d3: f32,
}

// Gradients at the pre-activations for dL/d(distance) = g.
fn geometry_deltas(state: GeometryState, g: f32) -> GeometryDeltas {
    var s = state;
    var d: GeometryDeltas;
    d.d3 = g * (1.0 - s.distance * s.distance);
#for j in 0..4
    d.d2[${j}] = select(vec4f(0.0), gw[${GEOMETRY_W3+j}] * d.d3, s.h2[${j}] > vec4f(0.0));
#end
#for q in 0..4
    {
        var t = vec4f(0.0);
#for c in 0..4
        t[${c}] = dot(gw[${GEOMETRY_W2+(q*4+c)*4}], d.d2[0]) + dot(gw[${GEOMETRY_W2+(q*4+c)*4+1}], d.d2[1])
            + dot(gw[${GEOMETRY_W2+(q*4+c)*4+2}], d.d2[2]) + dot(gw[${GEOMETRY_W2+(q*4+c)*4+3}], d.d2[3]);
#end
        d.d1[${q}] = select(vec4f(0.0), t, s.h1[${q}] > vec4f(0.0));
    }
#end
    return d;
}

// dL/d(features) from the deltas.
fn geometry_feature_gradient(deltas: GeometryDeltas) -> array<vec4f, 8> {
    var d = deltas;
    var g: array<vec4f, 8>;
#for q in 0..8
    {
        var t = vec4f(0.0);
#for c in 0..4
        t[${c}] = dot(gw[${(q*4+c)*4}], d.d1[0]) + dot(gw[${(q*4+c)*4+1}], d.d1[1])
            + dot(gw[${(q*4+c)*4+2}], d.d1[2]) + dot(gw[${(q*4+c)*4+3}], d.d1[3]);
#end
        g[${q}] = t;
    }
#end
    return g;
}
