//! Objects of meshes that are put together for one question each.
use glam::{DMat3, DVec3};
use mte_slam_mesh::{Mesh, write_ply, write_ply_by_class};
use mte_slam_objects::{
    ConfidenceSource, NO_OBJECT, ObjectOptions, Objects, ObjectsError, RoomAxes, cameras_up,
    class_mesh, find_objects, level_up, ply_classes, write_objects_glb,
};
use mte_slam_types::{
    classes::{Class, ClassTable, UNLABELLED},
    pose::Pose,
};

const WALL: u8 = 0;
const FLOOR: u8 = 1;
const TABLE: u8 = 2;
const CHAIR: u8 = 3;

fn classes() -> ClassTable {
    let class = |(raw_id, name): (u16, &str)| Class { raw_id, name: name.into(), color: [1; 3] };
    ClassTable {
        classes: [(93, "Wall"), (40, "floor"), (400, "table"), (20, "chair")].map(class).to_vec(),
    }
}

fn small() -> ObjectOptions {
    ObjectOptions { min_triangles: 1, ..ObjectOptions::default() }
}

fn find(mesh: &Mesh, options: &ObjectOptions) -> Objects {
    find_objects(mesh, &classes(), None, options).unwrap()
}

fn invalid(mesh: &Mesh, options: &ObjectOptions, parts: &[&str]) {
    let error = find_objects(mesh, &classes(), None, options).unwrap_err().to_string();
    assert!(parts.iter().all(|p| error.contains(p)), "{error}");
}

/// Adds the sides of a box for which `keep` holds (-x, +x, -y, +y, -z, +z), facing outwards.
fn add_sides(mesh: &mut Mesh, class: u8, lo: [f64; 3], hi: [f64; 3], keep: impl Fn(usize) -> bool) {
    let first = mesh.positions.len() as u32;
    for i in 0..8usize {
        mesh.positions
            .push([0, 1, 2].map(|k| (if i >> k & 1 == 1 { hi[k] } else { lo[k] }) as f32));
        mesh.classes.push(class);
        mesh.colors.push([200, 100, 50]);
    }
    let sides: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    for (_, [a, b, c, d]) in sides.into_iter().enumerate().filter(|(i, _)| keep(*i)) {
        mesh.triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|v| v + first)));
    }
    mesh.drop_unused_vertices();
}

fn add_box(mesh: &mut Mesh, class: u8, lo: [f64; 3], hi: [f64; 3]) {
    add_sides(mesh, class, lo, hi, |_| true);
}

fn turned(mesh: &Mesh, rotation: DMat3) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.transform(&Pose { rotation, translation: DVec3::new(3.0, -2.0, 0.5) });
    mesh
}

/// A room of 5 x 4 x 2.5 m with a table along its walls and a chair that is turned.
fn furnished() -> Mesh {
    let mut mesh = Mesh::default();
    let (lo, hi) = ([0.0, 0.0, 0.0], [5.0, 4.0, 2.5]);
    add_sides(&mut mesh, WALL, lo, hi, |side| side < 4);
    add_sides(&mut mesh, FLOOR, lo, hi, |side| side == 4);
    // Seen from inside.
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    add_box(&mut mesh, TABLE, [1.0, 1.0, 0.0], [2.4, 1.8, 0.75]);
    let mut chair = Mesh::default();
    add_box(&mut chair, CHAIR, [-0.2, -0.2, 0.0], [0.2, 0.2, 0.9]);
    chair.transform(&Pose {
        rotation: DMat3::from_rotation_z(0.4),
        translation: DVec3::new(3.0, 3.0, 0.0),
    });
    append(&mut mesh, chair);
    mesh
}

fn append(mesh: &mut Mesh, other: Mesh) {
    let first = mesh.positions.len() as u32;
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh.positions.extend(other.positions);
    mesh.classes.extend(other.classes);
    mesh.colors.extend(other.colors);
}

#[test]
fn two_chairs_30_cm_apart_stay_two() {
    let mut mesh = Mesh::default();
    add_box(&mut mesh, CHAIR, [0.0, 0.0, 0.0], [0.4, 0.4, 0.9]);
    add_box(&mut mesh, CHAIR, [0.7, 0.0, 0.0], [1.1, 0.4, 0.8]);
    let found = find(&mesh, &small());
    let names: Vec<&str> = found.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["chair 1", "chair 2"]);
    assert!(found.objects[0].bounds.extent().distance(DVec3::new(0.4, 0.4, 0.9)) < 1e-6);
    assert!(found.objects[0].center_m.distance(DVec3::new(0.2, 0.2, 0.45)) < 1e-6);
    assert!((found.objects[0].area_m2 - 1.76).abs() < 1e-6);
    assert_eq!(found.objects[0].color, Some([200, 100, 50]));
    assert_eq!((found.objects[0].class_id, found.objects[0].structure), (20, false));
    // Wide gaps are for the caller to choose.
    assert_eq!(find(&mesh, &ObjectOptions { gap_m: 0.45, ..small() }).objects.len(), 1);
}

#[test]
fn a_table_cut_by_a_gap_of_3_cm_is_one() {
    let mut mesh = Mesh::default();
    add_box(&mut mesh, TABLE, [0.0, 0.0, 0.7], [0.8, 0.8, 0.74]);
    // Its vertices are far from those of the other half: surfaces must be compared.
    add_box(&mut mesh, TABLE, [0.83, 0.3, 0.7], [1.7, 2.5, 0.74]);
    let found = find(&mesh, &small());
    assert_eq!(found.objects.len(), 1);
    assert_eq!(found.face_object, [0; 24]);
    for gap_m in [0.02, 0.0] {
        assert_eq!(find(&mesh, &ObjectOptions { gap_m, ..small() }).objects.len(), 2, "{gap_m}");
    }
}

#[test]
fn touching_things_of_two_classes_are_two() {
    let mut mesh = Mesh::default();
    add_box(&mut mesh, TABLE, [0.0, 0.0, 0.0], [1.0, 1.0, 0.7]);
    add_box(&mut mesh, CHAIR, [1.0, 0.0, 0.0], [1.5, 1.0, 0.7]);
    add_box(&mut mesh, 77, [1.5, 0.0, 0.0], [1.6, 1.0, 0.7]);
    add_box(&mut mesh, UNLABELLED, [1.6, 0.0, 0.0], [2.0, 1.0, 0.7]);
    let found = find(&mesh, &small());
    let names: Vec<&str> = found.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["table 1", "chair 1"]);
    assert_eq!((found.unlabeled.triangles, found.dropped.parts), (24, 0));
    assert_eq!(&found.face_object[24..], [NO_OBJECT; 24]);
    let of_vertex = found.vertex_object(&mesh).unwrap();
    assert_eq!((of_vertex[0], of_vertex[8], of_vertex[16]), (0, 1, NO_OBJECT));
    assert!(found.vertex_object(&Mesh::default()).is_err());
}

#[test]
fn yaw_of_a_turned_room_is_found_within_a_degree() {
    let room = furnished();
    for degrees in [0.0f64, 0.4, 10.0, 37.0, 44.6, -20.0, -44.6, 80.0, 123.4] {
        let mesh = turned(&room, DMat3::from_rotation_z(degrees.to_radians()));
        let found = find(&mesh, &small());
        let off = (found.axes.yaw_deg - degrees + 45.0).rem_euclid(90.0) - 45.0;
        assert!(off.abs() < 1.0 && found.axes.aligned_share > 0.9, "{degrees}: {:?}", found.axes);
        assert!(found.axes.yaw_deg > -45.0 && found.axes.yaw_deg <= 45.0);
        // The table keeps its size, whatever the turn, up to the order of x and y.
        let table = found.objects.iter().find(|o| o.class == TABLE).unwrap();
        let e = table.bounds.extent();
        assert!((e.max_element() - 1.4).abs() < 0.02, "{degrees}: {e}");
        assert!((e.x + e.y - 2.2).abs() < 0.04 && (e.z - 0.75).abs() < 1e-5, "{degrees}: {e}");
    }
}

#[test]
fn yaw_follows_walls_not_what_stands_about() {
    let mut mesh = furnished();
    let axes = find(&mesh, &small()).axes;
    // More surface of turned cupboards than of walls.
    let mut cupboards = Mesh::default();
    for i in 0..12 {
        let x = f64::from(i) * 0.3;
        add_box(&mut cupboards, TABLE, [x, 1.0, 0.0], [x + 0.2, 3.0, 2.0]);
    }
    append(&mut mesh, turned(&cupboards, DMat3::from_rotation_z(0.5)));
    let found = find(&mesh, &small());
    assert!((found.axes.yaw_deg - axes.yaw_deg).abs() < 1e-6);
    let no_walls = ObjectOptions { structure: vec!["floor".into()], ..small() };
    assert!((find(&mesh, &no_walls).axes.yaw_deg - 0.5f64.to_degrees()).abs() < 1.0);
}

#[test]
fn up_is_taken_from_cameras_and_leveled_by_the_floor() {
    let tilt = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_y(-0.8);
    let mesh = turned(&furnished(), tilt);
    let up = tilt * DVec3::Z;
    // Cameras that look down by some 10 degrees, to all sides but one.
    let cameras: Vec<Pose> = (0..5)
        .map(|i| {
            let level = DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y);
            let heading = DMat3::from_rotation_z(f64::from(i)) * level;
            let rotation = tilt * heading * DMat3::from_rotation_x(-0.2);
            Pose { rotation, translation: DVec3::ZERO }
        })
        .collect();
    let near = cameras_up(cameras.iter()).unwrap();
    assert!(near.angle_between(up).to_degrees() > 1.0, "or there is nothing to do");
    let leveled = level_up(&mesh, near).unwrap();
    assert!(leveled.angle_between(up).to_degrees() < 0.1, "{leveled} {up}");
    let found = find(&mesh, &ObjectOptions { up: leveled, ..small() });
    let chair = found.objects.iter().find(|o| o.class == CHAIR).unwrap();
    assert!((chair.bounds.extent().z - 0.9).abs() < 0.01);
    // Up that is an axis but for noise keeps the reference.
    for (up, x) in [(DVec3::Z, DVec3::X), (-DVec3::Y, DVec3::X), (DVec3::X, DVec3::Y)] {
        for noise in [DVec3::X, DVec3::Y, DVec3::Z] {
            let axes = RoomAxes::from_yaw((up + 1e-3 * noise).normalize(), 0.0).unwrap();
            assert!(axes.x.dot(x) > 0.999, "{up} {noise}: {axes:?}");
        }
    }
    assert_eq!(cameras_up([].into_iter()), None);
    assert_eq!(level_up(&Mesh::default(), DVec3::Y), Ok(DVec3::Y));
}

#[test]
fn what_was_seen_of_the_outside() {
    let share = |keep: fn(usize) -> bool| {
        let mut mesh = Mesh::default();
        add_sides(&mut mesh, CHAIR, [0.0, 0.0, 0.0], [0.5, 0.5, 0.5], keep);
        find(&mesh, &small()).objects[0].visible_share
    };
    assert_eq!(share(|_| true), 1.0);
    // Without its bottom a cube is seen from five sides; from below the inside of its top shows.
    assert!((share(|side| side != 4) - 5.0 / 6.0).abs() < 1e-3);
    assert!((share(|side| side == 5) - 0.5).abs() < 1e-3);
    // Three sides around a corner, from each of which the opposite one shows from inside.
    assert!((share(|side| side % 2 == 1) - 0.5).abs() < 1e-3);
}

#[test]
fn confidence_is_what_was_given_else_how_labels_agree() {
    let mut mesh = Mesh::default();
    add_box(&mut mesh, CHAIR, [0.0, 0.0, 0.0], [0.5, 0.5, 0.5]);
    let found = find_objects(&mesh, &classes(), Some(&[0.25; 8]), &small()).unwrap();
    assert_eq!(found.confidence, ConfidenceSource::Given);
    assert_eq!(found.objects[0].confidence, 0.25);
    assert_eq!(find(&mesh, &small()).objects[0].confidence, 1.0);
    mesh.classes[3] = TABLE;
    let found = find(&mesh, &small());
    assert_eq!(found.confidence, ConfidenceSource::Agreement);
    let chair = found.objects.iter().find(|o| o.class == CHAIR).unwrap();
    assert!(chair.confidence > 0.5 && chair.confidence < 0.95, "{}", chair.confidence);
    for bad in [vec![0.5; 7], vec![f32::NAN; 8], vec![1.5; 8]] {
        let error = find_objects(&mesh, &classes(), Some(&bad), &small()).unwrap_err();
        assert!(error.to_string().starts_with("confidence"), "{error}");
    }
}

#[test]
fn small_parts_are_dropped_and_counted() {
    let mut mesh = furnished();
    add_box(&mut mesh, CHAIR, [4.0, 1.0, 0.0], [4.03, 1.03, 0.03]);
    add_box(&mut mesh, TABLE, [4.0, 2.0, 0.0], [4.02, 2.02, 0.02]);
    let found = find(&mesh, &small());
    assert_eq!((found.dropped.parts, found.dropped.triangles), (2, 24));
    let area = 6.0 * (0.03f64.powi(2) + 0.02f64.powi(2));
    assert!((found.dropped.area_m2 - area).abs() < 1e-6);
    assert_eq!(find(&mesh, &ObjectOptions { min_area_m2: 0.0, ..small() }).dropped.parts, 0);
    // Walls have 8 triangles, the floor 2.
    let found = find(&mesh, &ObjectOptions { min_triangles: 9, ..small() });
    assert!(found.objects.iter().all(|o| !o.structure));
    let structure = find(&mesh, &small());
    let named: Vec<&str> =
        structure.objects.iter().filter(|o| o.structure).map(|o| o.name.as_str()).collect();
    assert_eq!(named, ["Wall 1", "floor 1"]);
}

#[test]
fn bad_input_is_named() {
    let good = furnished();
    assert!(find(&Mesh::default(), &small()).objects.is_empty());
    let mut bad = good.clone();
    bad.positions[5][1] = f32::NAN;
    invalid(&bad, &small(), &["vertex 5", "NaN", "finite"]);
    bad.positions[5][1] = 3e7;
    invalid(&bad, &small(), &["vertex 5", "30000000", "1000000 m"]);
    let mut bad = good.clone();
    bad.triangles[3][2] = 9999;
    invalid(&bad, &small(), &["9999", "less than"]);
    let mut bad = good.clone();
    bad.classes.clear();
    invalid(&bad, &small(), &["classes of the mesh", "one per vertex"]);
    bad = good.clone();
    bad.colors.pop();
    invalid(&bad, &small(), &["colours of the mesh"]);
    for up in [DVec3::ZERO, DVec3::NAN, DVec3::new(0.0, 0.0, 2.0)] {
        invalid(&good, &ObjectOptions { up, ..small() }, &["up", "length 1"]);
        assert!(level_up(&good, up).is_err() && RoomAxes::from_yaw(up, 0.0).is_err());
    }
    for gap_m in [-0.1, f64::NAN, 1.5, 1e-9] {
        invalid(&good, &ObjectOptions { gap_m, ..small() }, &["gap", "0.001 to 1 m"]);
    }
    for min_area_m2 in [-1.0, f64::NAN] {
        invalid(&good, &ObjectOptions { min_area_m2, ..small() }, &["least area"]);
    }
    // A kilometer at a millimeter's gap is refused before memory is taken for it.
    let mut vast = Mesh::default();
    add_box(&mut vast, CHAIR, [0.0; 3], [1000.0; 3]);
    invalid(&vast, &ObjectOptions { gap_m: 0.001, ..small() }, &["samples", "larger gap"]);
    // Triangles without an area hurt nothing.
    let mut flat = good.clone();
    flat.triangles.push([0, 0, 0]);
    flat.positions.extend([[1.0; 3]; 3]);
    flat.classes.extend([CHAIR; 3]);
    flat.colors.extend([[0; 3]; 3]);
    let n = flat.positions.len() as u32;
    flat.triangles.push([n - 3, n - 2, n - 1]);
    let options = ObjectOptions { min_area_m2: 0.0, ..small() };
    let found = find(&flat, &options);
    let point = found.objects.iter().find(|o| o.area_m2 == 0.0).unwrap();
    assert_eq!((point.visible_share, point.color), (0.0, None));
    write_objects_glb(&flat, &found).unwrap();
}

#[test]
fn files_of_a_run_are_read_back() {
    let (mesh, table) = (furnished(), classes());
    let (ply, semantic) =
        (write_ply(&mesh).unwrap(), write_ply_by_class(&mesh, &table, 0).unwrap());
    let read_table = ply_classes(&semantic).unwrap();
    assert_eq!(class_mesh(&ply, &read_table).unwrap(), mesh);
    let ids = |t: &ClassTable| -> Vec<(u16, String)> {
        t.classes.iter().map(|c| (c.raw_id, c.name.clone())).collect()
    };
    assert_eq!(ids(&read_table), ids(&table));
    let header = |lines: &str| ply_classes(format!("ply\n{lines}end_header\n").as_bytes());
    let cases = [
        ("", "no classes"),
        ("comment class 1\n", "line 2"),
        ("comment class chair 1\n", "`chair 1`"),
        ("comment class 70000 chair\n", "70000"),
        ("comment class 1 a\ncomment class 1 b\n", "line 3"),
    ];
    for (lines, part) in cases {
        let error = header(lines).unwrap_err().to_string();
        assert!(error.contains(part), "{lines:?}: {error}");
    }
    let many: String = (0..300).map(|i| format!("comment class {i} c\n")).collect();
    assert!(header(&many).unwrap_err().to_string().contains("255"));
    let names = header("comment class 0 (none)\ncomment class 7 coffee table\n").unwrap();
    assert_eq!(ids(&names), [(7, "coffee table".to_owned())]);
    let error = class_mesh(&ply, &names).unwrap_err().to_string();
    assert!(error.contains("vertex") && error.contains("1 classes"), "{error}");
    assert!(matches!(class_mesh(b"no", &table), Err(ObjectsError::Ply(_))));
}
