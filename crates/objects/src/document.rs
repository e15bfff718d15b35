//! `objects.json`.
use crate::{
    objects::{ConfidenceSource, LeftOut, Objects},
    options::ObjectOptions,
};
use glam::DVec3;
use serde::Serialize;

/// Value of `format` in the file.
pub const FORMAT: &str = "mte-slam-objects";
/// Value of `version` in the file. It grows when a reader of the last one would misunderstand.
pub const VERSION: u32 = 1;

#[derive(Serialize)]
struct Document<'a> {
    format: &'static str,
    version: u32,
    units: Units,
    axes: Axes,
    settings: Settings<'a>,
    confidence: &'static str,
    objects: Vec<Entry<'a>>,
    dropped: Left,
    unlabeled: Left,
}

#[derive(Serialize)]
struct Units {
    length: &'static str,
    area: &'static str,
    angle: &'static str,
}

#[derive(Serialize)]
struct Axes {
    x: [f64; 3],
    y: [f64; 3],
    up: [f64; 3],
    yaw_deg: f64,
    aligned_share: f64,
}

#[derive(Serialize)]
struct Settings<'a> {
    gap_m: f64,
    min_area_m2: f64,
    min_triangles: usize,
    structure: &'a [String],
}

#[derive(Serialize)]
struct Entry<'a> {
    id: usize,
    name: &'a str,
    class: Class<'a>,
    structure: bool,
    confidence: f64,
    center_m: [f64; 3],
    extent_m: [f64; 3],
    area_m2: f64,
    visible_share: f64,
    color: Option<[u8; 3]>,
    triangles: usize,
}

#[derive(Serialize)]
struct Class<'a> {
    id: u16,
    name: &'a str,
}

#[derive(Serialize)]
struct Left {
    #[serde(skip_serializing_if = "Option::is_none")]
    parts: Option<usize>,
    triangles: usize,
    area_m2: f64,
}

/// Six digits after the point: a micrometre, below what single precision holds of a room.
fn rounded(x: f64) -> f64 {
    // Adding zero turns -0 into 0.
    (x * 1e6).round() / 1e6 + 0.0
}

fn vector(v: DVec3) -> [f64; 3] {
    v.to_array().map(rounded)
}

/// Returns the bytes of `objects.json`: objects without their triangles, which the GLB has. Numbers
/// are rounded to six digits after the point.
pub fn write_json(objects: &Objects, options: &ObjectOptions) -> Vec<u8> {
    let left =
        |l: &LeftOut, parts| Left { parts, triangles: l.triangles, area_m2: rounded(l.area_m2) };
    let axes = &objects.axes;
    let document = Document {
        format: FORMAT,
        version: VERSION,
        units: Units { length: "m", area: "m^2", angle: "degree" },
        axes: Axes {
            x: vector(axes.x),
            y: vector(axes.y),
            up: vector(axes.up),
            yaw_deg: rounded(axes.yaw_deg),
            aligned_share: rounded(axes.aligned_share),
        },
        settings: Settings {
            gap_m: options.gap_m,
            min_area_m2: options.min_area_m2,
            min_triangles: options.min_triangles,
            structure: &options.structure,
        },
        confidence: match objects.confidence {
            ConfidenceSource::Given => "given",
            ConfidenceSource::Agreement => "agreement",
        },
        objects: objects
            .objects
            .iter()
            .enumerate()
            .map(|(id, o)| Entry {
                id,
                name: &o.name,
                class: Class { id: o.class_id, name: &o.class_name },
                structure: o.structure,
                confidence: rounded(o.confidence),
                center_m: vector(o.center_m),
                extent_m: vector(o.bounds.extent()),
                area_m2: rounded(o.area_m2),
                visible_share: rounded(o.visible_share),
                color: o.color,
                triangles: o.triangles,
            })
            .collect(),
        dropped: left(&objects.dropped, Some(objects.dropped.parts)),
        unlabeled: left(&objects.unlabeled, None),
    };
    // Writing into memory fails for maps with keys that are no text alone, and there are none.
    let mut bytes = serde_json::to_vec_pretty(&document).unwrap_or_default();
    bytes.push(b'\n');
    bytes
}
