//! From a mesh with classes to objects.
use crate::{
    axes::RoomAxes,
    bounds::RoomBox,
    error::{ObjectsError, invalid},
    measure::{Light, Measures, agreement, measure},
    options::ObjectOptions,
    parts::join,
};
use glam::DVec3;
use mte_slam_mesh::Mesh;
use mte_slam_types::classes::ClassTable;

/// Stands for "no object" in [`Objects::face_object`].
pub const NO_OBJECT: u32 = u32::MAX;
/// Coordinates beyond this are no room's \[m\].
const FARTHEST_M: f32 = 1e6;
/// Least upright surface of structure that yaw is found from alone \[m2\].
const ENOUGH_WALL_M2: f64 = 1.0;

/// One thing, or one surface of the building's structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// The class' name and a number within the class, from 1, for example `chair 2`.
    pub name: String,
    /// Compact index of the class.
    pub class: u8,
    /// The class' id in the data set.
    pub class_id: u16,
    /// The class' name.
    pub class_name: String,
    /// Whether the class is the building's structure ([`ObjectOptions::structure`]).
    pub structure: bool,
    /// How sure the class is, 0 to 1; [`Objects::confidence`] says by what.
    pub confidence: f64,
    /// Smallest box along the room's axes that holds the object, in room coordinates \[m\].
    pub bounds: RoomBox,
    /// Middle of the box in the world \[m\].
    pub center_m: DVec3,
    /// Surface \[m2\]: of what the mesh has, so of the seen part.
    pub area_m2: f64,
    /// Share of the outside that has a surface, 0 to 1: the object is looked at from the six sides
    /// of its box; what faces the side that it is seen from counts against the whole silhouette. A
    /// closed surface has 1, a picture on a wall, which has no back, about one half.
    pub visible_share: f64,
    /// Mean sRGB color (averaged as light), if the mesh has colors.
    pub color: Option<[u8; 3]>,
    /// Number of triangles.
    pub triangles: usize,
}

/// What [`Object::confidence`] is the mean of, over the object's corners of its class, weighted by
/// area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfidenceSource {
    /// The confidences that were given per vertex.
    Given,
    /// Per vertex the share of the other corners of its triangles that have the same class. It
    /// tells ragged labels from smooth ones, not right ones from wrong ones, and is a little lower for small things, whose
    /// outline is long.
    Agreement,
}

/// Surface that belongs to no object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeftOut {
    /// Connected parts (0 for surface without a class, whose parts are not looked for).
    pub parts: usize,
    /// Triangles.
    pub triangles: usize,
    /// Surface \[m2\].
    pub area_m2: f64,
}

/// The objects of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Objects {
    /// The axes that all boxes are along.
    pub axes: RoomAxes,
    /// By class, then largest area first, then by the middle of the box. An object's id is its
    /// place here.
    pub objects: Vec<Object>,
    /// For each triangle of the mesh the id of its object, or [`NO_OBJECT`].
    pub face_object: Vec<u32>,
    /// Parts below the least size.
    pub dropped: LeftOut,
    /// Triangles without a class.
    pub unlabeled: LeftOut,
    /// What confidences are made of.
    pub confidence: ConfidenceSource,
}

impl Objects {
    /// Returns for each vertex of the mesh the id of an object, or [`NO_OBJECT`]: of a triangle
    /// that has the vertex' class if there is one, else of any; the first in the mesh's order.
    ///
    /// # Errors
    /// A mesh other than the one that the objects were made of.
    pub fn vertex_object(&self, mesh: &Mesh) -> Result<Vec<u32>, ObjectsError> {
        mesh.check()?;
        if mesh.triangles.len() != self.face_object.len() {
            let expected = format!("{}, as the objects were made of", self.face_object.len());
            return Err(invalid("triangles of the mesh", mesh.triangles.len(), expected));
        }
        let class_of = |object: u32| self.objects.get(object as usize).map(|o| o.class);
        let mut out = vec![NO_OBJECT; mesh.positions.len()];
        for (t, &object) in mesh.triangles.iter().zip(&self.face_object) {
            for v in t.map(|v| v as usize) {
                let own = mesh.classes.get(v).copied();
                let better = class_of(object) == own && class_of(out[v]) != own;
                if object != NO_OBJECT && (out[v] == NO_OBJECT || better) {
                    out[v] = object;
                }
            }
        }
        Ok(out)
    }
}

/// Makes objects of a mesh with classes: connected surfaces of a class, joined over gaps. A triangle
/// has the class of most of its vertices, else of its first ([`Mesh::triangle_class`]). `confidence`
/// is per vertex, 0 to 1; without it [`ConfidenceSource::Agreement`] takes its place.
///
/// # Errors
/// A mesh that does not hold together, has no classes, or a position that is not finite; options out
/// of range; confidences of another number or out of range; a gap so small that the surface would
/// need too many samples.
pub fn find_objects(
    mesh: &Mesh,
    classes: &ClassTable,
    confidence: Option<&[f32]>,
    options: &ObjectOptions,
) -> Result<Objects, ObjectsError> {
    check(mesh, confidence)?;
    options.check()?;
    let class: Vec<Option<u8>> = (0..mesh.triangles.len())
        .map(|t| mesh.triangle_class(t).filter(|&c| usize::from(c) < classes.len()))
        .collect();
    let structure: Vec<bool> =
        classes.classes.iter().map(|c| options.is_structure(&c.name)).collect();
    let axes = axes(mesh, options.up, &class, &structure)?;
    let parts = parts(mesh, &class, options.gap_m)?;

    let agreeing;
    let (confidence, source) = match confidence {
        Some(given) => (given, ConfidenceSource::Given),
        None => {
            agreeing = agreement(mesh);
            (agreeing.as_slice(), ConfidenceSource::Agreement)
        }
    };
    let light = Light::new();
    let mut dropped = LeftOut::default();
    let mut kept: Vec<(u8, Measures, Vec<u32>)> = Vec::new();
    for triangles in parts {
        let Some(class) = class[triangles[0] as usize] else { continue };
        let area_m2: f64 = triangles.iter().map(|&t| mesh.triangle_area(t as usize)).sum();
        if triangles.len() < options.min_triangles || area_m2 < options.min_area_m2 {
            dropped.parts += 1;
            dropped.triangles += triangles.len();
            dropped.area_m2 += area_m2;
        } else {
            let measures = measure(mesh, &triangles, class, confidence, &axes, &light);
            kept.push((class, measures, triangles));
        }
    }
    kept.sort_by(|(class_a, a, first_a), (class_b, b, first_b)| {
        let (at, bt) = (a.bounds.center(), b.bounds.center());
        class_a
            .cmp(class_b)
            .then(b.area_m2.total_cmp(&a.area_m2))
            .then(at.x.total_cmp(&bt.x))
            .then(at.y.total_cmp(&bt.y))
            .then(at.z.total_cmp(&bt.z))
            .then(first_a[0].cmp(&first_b[0]))
    });
    let mut face_object = vec![NO_OBJECT; mesh.triangles.len()];
    let mut objects: Vec<Object> = Vec::with_capacity(kept.len());
    for (class, measures, triangles) in kept {
        for &t in &triangles {
            face_object[t as usize] = objects.len() as u32;
        }
        let number = 1 + objects.iter().rev().take_while(|o| o.class == class).count();
        let entry = &classes.classes[usize::from(class)];
        objects.push(Object {
            name: format!("{} {number}", entry.name),
            class,
            class_id: entry.raw_id,
            class_name: entry.name.clone(),
            structure: structure[usize::from(class)],
            confidence: measures.confidence,
            center_m: axes.to_world(measures.bounds.center()),
            bounds: measures.bounds,
            area_m2: measures.area_m2,
            visible_share: measures.visible_share,
            color: measures.color,
            triangles: triangles.len(),
        });
    }
    let mut unlabeled = LeftOut::default();
    for t in (0..mesh.triangles.len()).filter(|&t| class[t].is_none()) {
        unlabeled.triangles += 1;
        unlabeled.area_m2 += mesh.triangle_area(t);
    }
    Ok(Objects { axes, objects, face_object, dropped, unlabeled, confidence: source })
}

fn check(mesh: &Mesh, confidence: Option<&[f32]>) -> Result<(), ObjectsError> {
    mesh.check()?;
    let n = mesh.positions.len();
    if mesh.classes.len() != n {
        return Err(invalid("classes of the mesh", "none", "one per vertex"));
    }
    // Written so that NaN fails.
    let fits = |p: &[f32; 3]| p.iter().all(|x| x.abs() <= FARTHEST_M);
    if let Some(i) = mesh.positions.iter().position(|p| !fits(p)) {
        let found = format!("{:?}", mesh.positions[i]);
        let expected = format!("finite numbers up to {FARTHEST_M} m");
        return Err(invalid(format!("position of vertex {i}"), found, expected));
    }
    let Some(confidence) = confidence else { return Ok(()) };
    if confidence.len() != n {
        return Err(invalid("confidences", confidence.len(), format!("{n}, one per vertex")));
    }
    match confidence.iter().position(|c| !(0.0..=1.0).contains(c)) {
        Some(i) => Err(invalid(format!("confidence of vertex {i}"), confidence[i], "0 to 1")),
        None => Ok(()),
    }
}

/// Axes from the walls where there is enough of them, else from all that stands upright.
fn axes(
    mesh: &Mesh,
    up: DVec3,
    class: &[Option<u8>],
    structure: &[bool],
) -> Result<RoomAxes, ObjectsError> {
    let of_structure = |t: usize| class[t].is_some_and(|c| structure[usize::from(c)]);
    let upright = |t: &usize| {
        let [a, b, c] = mesh.corners(*t);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        normal.dot(up).abs() < 0.2
    };
    let wall_m2: f64 = (0..mesh.triangles.len())
        .filter(|&t| of_structure(t))
        .filter(upright)
        .map(|t| mesh.triangle_area(t))
        .sum();
    if wall_m2 >= ENOUGH_WALL_M2 {
        RoomAxes::find(mesh, up, of_structure)
    } else {
        RoomAxes::find(mesh, up, |_| true)
    }
}

/// Triangles of each part, parts by their first triangle.
fn parts(mesh: &Mesh, class: &[Option<u8>], gap_m: f64) -> Result<Vec<Vec<u32>>, ObjectsError> {
    let mut sets = join(mesh, class, gap_m)?;
    let mut part_of_root = vec![u32::MAX; class.len()];
    let mut parts: Vec<Vec<u32>> = Vec::new();
    for t in (0..class.len() as u32).filter(|&t| class[t as usize].is_some()) {
        let part = &mut part_of_root[sets.root(t) as usize];
        if *part == u32::MAX {
            *part = parts.len() as u32;
            parts.push(Vec::new());
        }
        parts[*part as usize].push(t);
    }
    Ok(parts)
}
