#![doc = include_str!("../README.md")]
//! # Layouts
//!
//! A recording is recognised by the layout of its files, on disk, in an archive or in a browser:
//!
#![doc = include_str!("layouts.md")]
//!
//! Files that any layout may hold beside its own:
//! - the camera: `cam_params.json` (`{"camera": {w, h, fx, fy, cx, cy, scale}}`, `scale` in depth
//!   units per metre, `k1 k2 p1 p2 k3` if there is distortion),
//!   `intrinsics.json` (the inner object alone, `depth_scale` for `scale`; it marks the layout
//!   `images`, and fits images of its proportions in another size), `camera-intrinsics.txt` (a
//!   3x3 or 4x4 matrix) or `camera.txt` (`fx fy cx cy [k1 k2 p1 p2 k3]`), each also up to
//!   two folders up;
//! - feature maps, in a folder of their own: `000000.npy` or `000000.safetensors` (the tensor
//!   `features`, or the only one), ... by frame number, channels x height x width, float32 or
//!   float16;
//! - `bound.json`: `{"bound": [[x0, x1], [y0, y1], [z0, z1]]}` in metres;
//! - `classes.json`: `{"7": {"name": "bed", "color": [86, 117, 191]}}`, colour optional. Without
//!   it a [`ClassList`] can be given, and else every id in the images is a class;
//! - `scannetv2-labels.combined.tsv` (or up to two folders up): the raw ids in `label-filt/` are
//!   then translated to NYU's 40 classes.
//!
//! Archives of any of them are read in place ([`ZipSource`]).
//!
//! Names are compared without case (`.JPG`, `Color/`), and hidden files (`.DS_Store`, the `._` files
//! and `__MACOSX/` of macOS) do not count.
//!
//! Frames are in numeric order, and the world frame is the data set's own.
extern crate alloc;

mod class_list;
mod decode;
mod depth_probe;
mod depth_range;
mod entries;
mod features;
mod folder;
mod frame_camera;
#[cfg(fuzzing)]
pub mod fuzzing;
pub mod inspect;
mod intrinsics;
mod labels;
mod layouts;
mod memory;
mod names;
mod order;
mod pose_text;
mod reader;
mod resize;
mod scannet_ids;
mod stored;
pub mod stream;
mod write;
mod zip;

pub use class_list::ClassList;
pub use decode::{MAX_PIXELS, MAX_SIDE};
pub use layouts::Layout;
pub use memory::MemorySource;
pub use order::FrameOrder;
pub use reader::{Axes, GivenCamera, LabelSource, OpenOptions, open};
pub use write::{ColorFormat, RecordingWriter, ReplicaWriter, SensWriter, TumWriter, WriteError};
pub use zip::ZipSource;

#[cfg(test)]
mod bad_input_tests;
#[cfg(test)]
mod data_tests;
#[cfg(test)]
mod layout_tests;
#[cfg(test)]
mod test_support;
