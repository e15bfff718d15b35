// Counter-based random numbers: PCG output hash over a folded key. Twin: kernels/shared.rs.
fn pcg(v: u32) -> u32 {
    let state = v * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}
fn random_u32(seed: u32, iteration: u32, index: u32, salt: u32) -> u32 {
    return pcg(pcg(pcg(pcg(seed) ^ iteration) ^ index) ^ salt);
}
// Uniform in [0, 1), 24 bits.
fn random_f32(seed: u32, iteration: u32, index: u32, salt: u32) -> f32 {
    return f32(random_u32(seed, iteration, index, salt) >> 8u) * 5.9604645e-8;
}
