// A ray: position at depth z is origin + z * direction, z measured along the camera's axis.
struct Ray {
    origin: vec3f,
    // Sensor depth [m], 0 where there is none.
    depth: f32,
    direction: vec3f,
    // Index of the frame in the window.
    frame: u32,
    color: vec3f,
    // Compact class, 255 where unlabelled.
    label: u32,
}
