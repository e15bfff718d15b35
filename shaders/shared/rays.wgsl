// Rays of a batch. Needs a binding of `Ray`s.
fn ray_class(r: Ray) -> u32 {
    return r.label & 255u;
}
