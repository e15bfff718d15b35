// NeuS-like weights of the intervals between samples: with phi(s) = sigmoid(sharpness * s), the light that
// reaches sample i is proportional to phi(s_i) while s falls, so alpha_i = max(0, 1 - phi_{i+1} / phi_i).
// Unlike a per-sample opacity the maximum lies at the zero crossing: no bias towards the camera.
fn phi(s: f32) -> f32 {
    return 1.0 / (1.0 + exp(-params.sharpness * s));
}
fn interval_alpha(phi0: f32, phi1: f32) -> f32 {
    return clamp(1.0 - phi1 / max(phi0, 1e-12), 0.0, 1.0);
}
