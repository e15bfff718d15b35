// A ray: position at depth z is origin + z * direction, z measured along the camera's axis.
struct Ray {
    origin: vec3f,
    // Sensor depth [m], 0 where there is none.
    depth: f32,
    direction: vec3f,
    // Index of the frame in the window (8 bits), slot (23 bits), top bit: no loss uses the ray.
    frame: u32,
    color: vec3f,
    // Compact class (8 bits), 255 where unlabelled; pixel (24 bits).
    label: u32,
}

fn ray_class(r: Ray) -> u32 {
    return r.label & 255u;
}
