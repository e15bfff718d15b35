//! Objects against those that a built-in room was furnished with: of its true mesh, and of a run.
//!
//! ```text
//! cargo run --release -p mte-slam-objects --example room_objects -- room [OUT FRAMES WIDTH]
//! ```
//!
//! OUT is the folder of `mte-slam demo --frames FRAMES --width WIDTH` or of a run on what `mte-slam
//! synth` wrote of another room. Besides all true objects, a run is compared with the part of them
//! that its frames have seen: it cannot find more.
use mte_slam_mesh::Mesh;
use mte_slam_objects::{
    ClassBox, NO_OBJECT, ObjectOptions, Objects, box_overlap, class_boxes, class_mesh,
    find_objects, group_boxes, ply_classes,
};
use mte_slam_synth::{SceneKind, SyntheticMesh, SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    classes::{ClassTable, UNLABELLED},
    sequence::Sequence,
};
use std::{collections::BTreeMap, error::Error, fs, path::Path};

const LEAST_IOU: f64 = 0.5;
/// Depths this close to a surface's own have seen it \[m\].
const SEEN_WITHIN_M: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let scene = match arguments.first().map(String::as_str) {
        Some("room") => SceneKind::Room,
        Some("office") => SceneKind::Office,
        Some("hall") => SceneKind::Hall,
        _ => return Err("expected room, office or hall".into()),
    };
    let mut options = SyntheticOptions { scene, ..SyntheticOptions::default() };
    if let [_, _, frames, width] = &arguments[..] {
        options.frames = frames.parse()?;
        options.width = width.parse()?;
        options.height = options.width / 4 * 3;
    }
    let mut sequence = SyntheticSequence::new(options);
    let table = sequence.info().classes.clone();
    let built = sequence.ground_truth_mesh();
    let true_mesh = with_classes(&built);
    let settings = ObjectOptions::default();

    let found = find_objects(&true_mesh, &table, None, &settings)?;
    println!("{} true mesh", scene.name());
    compare(&found, &truth(&built, &true_mesh, &found, &table, None)?, &table);

    let [_, out, _, _] = &arguments[..] else { return Ok(()) };
    let out = Path::new(out);
    let classes = ply_classes(&fs::read(out.join("mesh_semantic.ply"))?)?;
    let mesh = class_mesh(&fs::read(out.join("mesh.ply"))?, &classes)?;
    let found = find_objects(&mesh, &classes, None, &settings)?;
    println!("\n{} run, all true objects", scene.name());
    compare(&found, &truth(&built, &true_mesh, &found, &table, None)?, &table);
    let seen = seen_triangles(&true_mesh, &mut sequence)?;
    println!("\n{} run, what its frames have seen of the true objects", scene.name());
    compare(&found, &truth(&built, &true_mesh, &found, &table, Some(&seen))?, &table);
    println!(
        "\nyaw {:.2} degrees ({:.0} % along), dropped {:?}, unlabeled {:?}",
        found.axes.yaw_deg,
        100.0 * found.axes.aligned_share,
        found.dropped,
        found.unlabeled
    );
    Ok(())
}

/// The true mesh; a vertex takes the class of its faces.
fn with_classes(built: &SyntheticMesh) -> Mesh {
    let mut classes = vec![UNLABELLED; built.positions.len()];
    for (triangle, class) in built.triangles.iter().zip(&built.face_class) {
        triangle.iter().for_each(|&i| classes[i as usize] = *class);
    }
    Mesh {
        positions: built.positions.clone(),
        triangles: built.triangles.clone(),
        colors: built.colors.clone(),
        classes,
        ..Mesh::default()
    }
}

/// Boxes of the true objects that are not structure; with `seen`, of their seen triangles, where
/// that is surface enough to be an object.
fn truth(
    built: &SyntheticMesh,
    mesh: &Mesh,
    found: &Objects,
    table: &ClassTable,
    seen: Option<&[bool]>,
) -> Result<Vec<ClassBox>, Box<dyn Error>> {
    let settings = ObjectOptions::default();
    let counts = |t: usize| {
        let class = &table.classes[usize::from(built.face_class[t])];
        !settings.is_structure(&class.name) && seen.is_none_or(|seen| seen[t])
    };
    let mut area_m2: BTreeMap<u32, f64> = BTreeMap::new();
    for t in (0..built.triangles.len()).filter(|&t| counts(t)) {
        *area_m2.entry(built.face_object[t]).or_default() += mesh.triangle_area(t);
    }
    let enough = |object: u32| seen.is_none() || area_m2[&object] >= settings.min_area_m2;
    Ok(group_boxes(mesh, &found.axes, |t| {
        let object = built.face_object[t];
        let id = table.classes[usize::from(built.face_class[t])].raw_id;
        (counts(t) && enough(object)).then_some((object, id))
    })?)
}

/// Whether the middle of each triangle is what a frame's depth shows.
fn seen_triangles(
    mesh: &Mesh,
    sequence: &mut SyntheticSequence,
) -> Result<Vec<bool>, Box<dyn Error>> {
    let mut seen = vec![false; mesh.triangles.len()];
    for index in 0..sequence.info().frames {
        let (frame, camera) = (sequence.frame(index)?, sequence.info().camera);
        let camera_from_world = frame.truth.ok_or("a frame without its pose")?.inverse();
        for (t, seen) in seen.iter_mut().enumerate().filter(|(_, seen)| !**seen) {
            let [a, b, c] = mesh.corners(t);
            let p = camera_from_world.transform_point((a + b + c) / 3.0);
            let (u, v) = (camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
            let inside = |x: f64, n: u32| (0.0..f64::from(n) - 0.5).contains(&x);
            if p.z > 0.0 && inside(u, camera.width) && inside(v, camera.height) {
                let pixel = v.round() as usize * camera.width as usize + u.round() as usize;
                let depth_m = f64::from(frame.depth[pixel]) * sequence.info().depth_unit_m;
                *seen = (depth_m - p.z).abs() <= SEEN_WITHIN_M;
            }
        }
    }
    Ok(seen)
}

fn compare(found: &Objects, truth: &[ClassBox], table: &ClassTable) {
    assert!(found.face_object.iter().any(|o| *o != NO_OBJECT), "there are objects");
    let boxes = class_boxes(found);
    let percent = |x: Option<f64>| x.map_or("-".into(), |x| format!("{:.1}", 100.0 * x));
    let overlap = box_overlap(&boxes, truth, LEAST_IOU);
    println!("  class        found  true  matched  precision %  recall %");
    let line = |name: &str, found: &[ClassBox], truth: &[ClassBox]| {
        let part = box_overlap(found, truth, LEAST_IOU);
        println!(
            "  {name:<12} {:5} {:5} {:8} {:>12} {:>9}",
            part.found,
            part.truth,
            part.pairs.len(),
            percent(part.precision()),
            percent(part.recall())
        );
    };
    for class in &table.classes {
        let of = |boxes: &[ClassBox]| -> Vec<ClassBox> {
            boxes.iter().filter(|b| b.class_id == class.raw_id).copied().collect()
        };
        let (found, truth) = (of(&boxes), of(truth));
        if !found.is_empty() || !truth.is_empty() {
            line(&class.name, &found, &truth);
        }
    }
    line("all", &boxes, truth);
    let mean = overlap.pairs.iter().map(|p| p.iou).sum::<f64>() / overlap.pairs.len().max(1) as f64;
    println!("  mean overlap of the matches {:.1} %", 100.0 * mean);
}
