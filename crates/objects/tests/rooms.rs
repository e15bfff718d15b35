//! The objects of the built-in rooms' true meshes against the things that the rooms were built of.
use mte_slam_mesh::Mesh;
use mte_slam_objects::{
    ClassBox, NO_OBJECT, ObjectOptions, Objects, box_overlap, class_boxes, find_objects,
    group_boxes, write_json,
};
use mte_slam_synth::{SceneKind, SyntheticMesh, SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    classes::{ClassTable, UNLABELLED},
    sequence::Sequence,
};

struct Room {
    built: SyntheticMesh,
    mesh: Mesh,
    table: ClassTable,
}

fn room(scene: SceneKind) -> Room {
    let options = SyntheticOptions { scene, ..SyntheticOptions::tiny() };
    let sequence = SyntheticSequence::new(options);
    let built = sequence.ground_truth_mesh();
    let mut classes = vec![UNLABELLED; built.positions.len()];
    for (triangle, class) in built.triangles.iter().zip(&built.face_class) {
        triangle.iter().for_each(|&i| classes[i as usize] = *class);
    }
    let mesh = Mesh {
        positions: built.positions.clone(),
        triangles: built.triangles.clone(),
        colors: built.colors.clone(),
        classes,
        ..Mesh::default()
    };
    Room { built, mesh, table: sequence.info().classes.clone() }
}

fn truth(room: &Room, found: &Objects) -> Vec<ClassBox> {
    let options = ObjectOptions::default();
    group_boxes(&room.mesh, &found.axes, |t| {
        let class = &room.table.classes[usize::from(room.built.face_class[t])];
        let thing = !options.is_structure(&class.name);
        thing.then_some((room.built.face_object[t], class.raw_id))
    })
    .unwrap()
}

/// Things that touch others of their class are one object, and cannot be told apart by class and
/// place: books of a row or a stack, and the living room's curtains on their common rod.
fn touching(name: &str, scene: SceneKind) -> bool {
    name == "book" || (name == "curtain" && scene == SceneKind::Room)
}

#[test]
fn what_does_not_touch_its_like_is_found_exactly() {
    for (scene, things) in [(SceneKind::Room, 46), (SceneKind::Office, 47), (SceneKind::Hall, 65)] {
        let room = room(scene);
        let found = find_objects(&room.mesh, &room.table, None, &ObjectOptions::default()).unwrap();
        assert!(found.axes.yaw_deg.abs() < 1e-6, "{:?}", found.axes);
        let apart = |boxes: Vec<ClassBox>| -> Vec<ClassBox> {
            let touches = |id: u16| {
                let class = room.table.classes.iter().find(|c| c.raw_id == id).unwrap();
                touching(&class.name, scene)
            };
            boxes.into_iter().filter(|b| !touches(b.class_id)).collect()
        };
        let truth = apart(truth(&room, &found));
        assert_eq!(truth.len(), things, "{}", scene.name());
        let overlap = box_overlap(&apart(class_boxes(&found)), &truth, 0.5);
        assert_eq!(overlap.precision(), Some(1.0), "{}", scene.name());
        assert_eq!(overlap.recall(), Some(1.0), "{}", scene.name());
        assert!(overlap.pairs.iter().all(|p| p.iou > 0.999), "{}", scene.name());
    }
}

#[test]
fn classes_never_mix_and_everything_is_accounted_for() {
    let room = room(SceneKind::Room);
    let options = ObjectOptions { gap_m: 0.3, ..ObjectOptions::default() };
    let found = find_objects(&room.mesh, &room.table, None, &options).unwrap();
    let mut counted = vec![0; found.objects.len()];
    let mut left_out = 0;
    for (t, &object) in found.face_object.iter().enumerate() {
        if object == NO_OBJECT {
            left_out += 1;
        } else {
            counted[object as usize] += 1;
            let object = &found.objects[object as usize];
            assert_eq!(object.class, room.built.face_class[t], "triangle {t} of {}", object.name);
            assert!(room.mesh.corners(t).into_iter().all(|p| {
                let p = found.axes.to_room(p);
                p.cmpge(object.bounds.min - 1e-9).all() && p.cmple(object.bounds.max + 1e-9).all()
            }));
        }
    }
    assert_eq!(left_out, found.dropped.triangles + found.unlabeled.triangles);
    for (object, count) in found.objects.iter().zip(counted) {
        assert_eq!(object.triangles, count, "{}", object.name);
        assert_eq!(object.structure, ["wall", "floor", "ceiling"].contains(&&*object.class_name));
        assert!((0.0..=1.0).contains(&object.visible_share), "{}", object.name);
        // No vertex is shared between solids, so all labels around a vertex are its own.
        assert_eq!(object.confidence, 1.0, "{}", object.name);
    }
    let area: f64 = found.objects.iter().map(|o| o.area_m2).sum();
    assert!((area + found.dropped.area_m2 - room.mesh.area()).abs() < 1e-6);
}

#[test]
fn the_same_mesh_gives_the_same_bytes() {
    let room = room(SceneKind::Office);
    let options = ObjectOptions::default();
    let make = || {
        let found = find_objects(&room.mesh, &room.table, None, &options).unwrap();
        (write_json(&found, &options), found.face_object)
    };
    assert!(make() == make());
}

#[test]
fn a_thing_of_the_generator_has_one_class() {
    for scene in [SceneKind::Room, SceneKind::Office] {
        let room = room(scene);
        assert_eq!(room.built.face_object.len(), room.built.triangles.len());
        let found = find_objects(&room.mesh, &room.table, None, &ObjectOptions::default()).unwrap();
        // Two classes in a thing are an error.
        let all = group_boxes(&room.mesh, &found.axes, |t| {
            Some((room.built.face_object[t], u16::from(room.built.face_class[t])))
        });
        assert!(all.unwrap().len() > 200, "{}", scene.name());
    }
}
