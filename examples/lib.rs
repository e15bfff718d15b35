//! Small programs on the library, each run by a test:
//!
//! - `map_a_room`: the built-in room, from frames to a mesh;
//! - `live_camera`: frames from a closure, as a live camera gives them;
//! - `own_source`: a recording whose files lie wherever the program says;
//! - `own_kernel`: a kernel of one's own, on both engines.
//!
//! `cargo run --release -p mte-slam-examples --example map_a_room` runs one.
