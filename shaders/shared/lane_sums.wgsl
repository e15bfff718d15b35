// Sums of a feature and its weight over the workgroup's lanes; lane 0 finds them in lane_features and lane_weights[0].
var<workgroup> lane_features: array<array<vec4f, 64>, 4>;
var<workgroup> lane_weights: array<f32, 64>;

fn sum_lanes(lane: u32, feature: array<vec4f, 4>, weight: f32) {
#for j in 0..4
    lane_features[${j}][lane] = feature[${j}];
#end
    lane_weights[lane] = weight;
    workgroupBarrier();
    for (var half = 32u; half > 0u; half /= 2u) {
        if (lane < half) {
#for j in 0..4
            lane_features[${j}][lane] += lane_features[${j}][lane + half];
#end
            lane_weights[lane] += lane_weights[lane + half];
        }
        workgroupBarrier();
    }
}
