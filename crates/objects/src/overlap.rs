//! Objects against true ones: precision and recall by the overlap of boxes.
use crate::{
    axes::RoomAxes,
    bounds::RoomBox,
    error::{ObjectsError, invalid},
    objects::Objects,
};
use mte_slam_mesh::Mesh;
use std::collections::BTreeMap;

/// A box and its class, of an object that was found or of a true one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassBox {
    /// The class' id in the data set.
    pub class_id: u16,
    /// The box, along axes that found and true objects share.
    pub bounds: RoomBox,
}

/// A found object and the true one that it was matched with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverlapPair {
    /// Place among the found ones.
    pub found: usize,
    /// Place among the true ones.
    pub truth: usize,
    /// Overlap of the boxes, 0 to 1.
    pub iou: f64,
}

/// What came out of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlap {
    /// Matches, best overlap first.
    pub pairs: Vec<OverlapPair>,
    /// Number of found objects.
    pub found: usize,
    /// Number of true objects.
    pub truth: usize,
}

impl Overlap {
    /// Returns the share of found objects that were matched, or `None` of none.
    pub fn precision(&self) -> Option<f64> {
        (self.found > 0).then(|| self.pairs.len() as f64 / self.found as f64)
    }

    /// Returns the share of true objects that were matched, or `None` of none.
    pub fn recall(&self) -> Option<f64> {
        (self.truth > 0).then(|| self.pairs.len() as f64 / self.truth as f64)
    }
}

/// Returns the boxes of objects that are not structure.
pub fn class_boxes(objects: &Objects) -> Vec<ClassBox> {
    let things = objects.objects.iter().filter(|o| !o.structure);
    things.map(|o| ClassBox { class_id: o.class_id, bounds: o.bounds }).collect()
}

/// Returns the boxes of groups of triangles, such as the true objects of a made scene, in the order of
/// their numbers. `group` gives each triangle's number and class id, or `None` where it does not count.
///
/// # Errors
/// A mesh that fails [`Mesh::check`], or a group with triangles of two classes.
pub fn group_boxes(
    mesh: &Mesh,
    axes: &RoomAxes,
    group: impl Fn(usize) -> Option<(u32, u16)>,
) -> Result<Vec<ClassBox>, ObjectsError> {
    mesh.check()?;
    let mut boxes: BTreeMap<u32, ClassBox> = BTreeMap::new();
    for t in 0..mesh.triangles.len() {
        let Some((number, class_id)) = group(t) else { continue };
        let entry = boxes.entry(number).or_insert(ClassBox { class_id, bounds: RoomBox::empty() });
        if entry.class_id != class_id {
            let found = format!("classes {} and {class_id}", entry.class_id);
            return Err(invalid(format!("group {number}"), found, "one class"));
        }
        mesh.corners(t).into_iter().for_each(|p| entry.bounds.include(axes.to_room(p)));
    }
    Ok(boxes.into_values().collect())
}

/// Matches found objects with true ones of the same class, greedily: of all pairs whose boxes
/// overlap by at least `least_iou` (intersection over union), the best ones first, each object once.
/// All boxes must be along the same axes ([`RoomBox::iou`]).
pub fn box_overlap(found: &[ClassBox], truth: &[ClassBox], least_iou: f64) -> Overlap {
    let mut pairs: Vec<OverlapPair> = Vec::new();
    for (i, f) in found.iter().enumerate() {
        for (j, t) in truth.iter().enumerate().filter(|(_, t)| t.class_id == f.class_id) {
            let iou = f.bounds.iou(&t.bounds);
            if iou > 0.0 && iou >= least_iou {
                pairs.push(OverlapPair { found: i, truth: j, iou });
            }
        }
    }
    pairs.sort_by(|a, b| {
        b.iou.total_cmp(&a.iou).then(a.found.cmp(&b.found)).then(a.truth.cmp(&b.truth))
    });
    let (mut found_free, mut truth_free) = (vec![true; found.len()], vec![true; truth.len()]);
    pairs.retain(|p| {
        let free = found_free[p.found] && truth_free[p.truth];
        if free {
            (found_free[p.found], truth_free[p.truth]) = (false, false);
        }
        free
    });
    Overlap { pairs, found: found.len(), truth: truth.len() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn each_object_is_matched_once_and_within_its_class() {
        let at = |class_id: u16, x: f64| ClassBox {
            class_id,
            bounds: RoomBox { min: DVec3::new(x, 0.0, 0.0), max: DVec3::new(x + 1.0, 1.0, 1.0) },
        };
        // The second is nearer to the truth than the first; the third has another class.
        let found = [at(1, 0.2), at(1, 0.1), at(2, 0.0)];
        let overlap = box_overlap(&found, &[at(1, 0.0), at(1, 5.0)], 0.5);
        let pairs: Vec<_> = overlap.pairs.iter().map(|p| (p.found, p.truth)).collect();
        assert_eq!(pairs, [(1, 0)]);
        assert!((overlap.pairs[0].iou - 0.9 / 1.1).abs() < 1e-12);
        assert_eq!((overlap.precision(), overlap.recall()), (Some(1.0 / 3.0), Some(0.5)));
        let none = box_overlap(&[], &[], 0.5);
        assert_eq!((none.precision(), none.recall()), (None, None));
    }
}
