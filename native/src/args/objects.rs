//! Objects.
use super::values::{direction, gap_metres, square_metres};
use clap::{Args, ValueHint};
use glam::DVec3;
use std::path::PathBuf;

/// The manual of `objects`.
pub const OBJECTS: &str = "Make things of an output folder's mesh: surfaces of one class that are connected, or nearly so, \
become one object with a name such as \"chair 2\", a box along the room's axes, surface, mean colour, confidence and the \
share of its outside that was seen. Needs a run with labels (mesh.ply and mesh_semantic.ply).\n\n\
The output folder receives:\n    \
objects.json   the list, with units; docs/guide/objects.md says what each number means\n    \
objects.glb    the mesh with one named node per object\n\n\
Run it again after `mte-slam mesh`, which replaces the mesh.\n\n\
Examples:\n    \
mte-slam objects out/room0-replica\n    \
mte-slam objects out/kitchen --up 0,-1,0 --gap 0.1 --structure wall,floor,ceiling,window,door";

/// `objects`.
#[derive(Debug, Args)]
pub struct ObjectsArgs {
    /// Output folder of a run.
    #[arg(value_name = "OUT", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Direction of up in the world of OUT/trajectory.txt [default: that of the cameras, made
    /// level by the floor and what else is].
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true)]
    pub up: Option<DVec3>,
    /// Surfaces of one class that are no farther apart than this are one object, in metres.
    #[arg(long, value_name = "M", default_value_t = 0.05, value_parser = gap_metres)]
    pub gap: f64,
    /// Leave out what has less surface than this, in square metres.
    #[arg(long, value_name = "M2", default_value_t = 0.01, value_parser = square_metres)]
    pub min_area: f64,
    /// Leave out what has fewer triangles than this.
    #[arg(long, value_name = "N", default_value_t = 12)]
    pub min_triangles: usize,
    /// Names of the classes that are structure and not things, with commas between them.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "wall,floor,ceiling")]
    pub structure: Vec<String>,
}
