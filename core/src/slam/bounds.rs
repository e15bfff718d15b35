//! The box of the map: made with the first frame, grown with later ones.
use super::{Slam, SlamError};
use crate::{
    field::FieldShape,
    frame::Bounds,
    map::{FrameFormat, Map, Scratch},
};
use alloc::vec::Vec;
use glam::DVec3;

/// Box of world points without the outermost 0.2 % on each side.
fn robust_box(points: &[DVec3]) -> Option<Bounds> {
    if points.is_empty() {
        return None;
    }
    let (mut min, mut max) = (DVec3::ZERO, DVec3::ZERO);
    let cut = points.len() / 500;
    for k in 0..3 {
        let mut v: Vec<f64> = points.iter().map(|p| p[k]).collect();
        v.sort_by(f64::total_cmp);
        min[k] = v[cut];
        max[k] = v[v.len() - 1 - cut];
    }
    Some(Bounds { min, max })
}

impl Slam {
    /// Makes the map, or grows it, so that it holds the points and the camera.
    pub(super) async fn fit_bounds(
        &mut self,
        world: &[DVec3],
        camera: DVec3,
    ) -> Result<(), SlamError> {
        let margin = DVec3::splat(self.config.field.margin_m);
        let given = self.info.bounds.filter(|_| self.config.field.use_given_bounds);
        if self.map.is_none() {
            let bounds = match given {
                Some(b) => b,
                None => {
                    let b = robust_box(world).unwrap_or(Bounds { min: camera, max: camera });
                    Bounds { min: b.min.min(camera) - margin, max: b.max.max(camera) + margin }
                }
            };
            let shape = FieldShape::new(bounds, &self.config.field);
            let format = FrameFormat::from(&self.info);
            let map = Map::new(&mut self.engine, &self.config, &format, shape)?;
            self.scratch = Some(Scratch::new(&mut self.engine, &self.config, &map)?);
            self.free_slots = (1..map.slots()).rev().collect();
            self.map = Some(map);
            return Ok(());
        }
        if given.is_some() || self.bounds_refused {
            return Ok(());
        }
        let Some(b) = robust_box(world) else { return Ok(()) };
        let held = Bounds { min: b.min.min(camera), max: b.max.max(camera) };
        let (config, seed) = (self.config.field.clone(), self.config.seed);
        let (engine, map, _) = self.mapped()?;
        if map.shape.grown(held, &config).is_none() {
            return Ok(());
        }
        // Grow with the margin, so that the next frames fit as well.
        let wanted = Bounds { min: held.min - margin, max: held.max + margin };
        if let Some(shape) = map.shape.grown(wanted, &config) {
            if shape.surface_floats().max(shape.geometry_floats()) > engine.max_buffer_words() {
                // The map stays as it is; surfaces outside it are ignored.
                self.bounds_refused = true;
                return Ok(());
            }
            map.grow(engine, shape, seed).await?;
        }
        Ok(())
    }

    /// Whether the map stopped growing because it would pass the engine's limits.
    pub fn bounds_refused(&self) -> bool {
        self.bounds_refused
    }

    /// The map's box \[m\], once there is a map.
    pub fn bounds(&self) -> Option<Bounds> {
        self.map.as_ref().map(|m| m.shape.bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_stray_points_do_not_widen_the_box() {
        let mut points: Vec<DVec3> = (0..2000).map(|i| DVec3::splat(f64::from(i) * 1e-3)).collect();
        points.push(DVec3::splat(90.0));
        points.push(DVec3::splat(-90.0));
        let b = robust_box(&points).unwrap();
        assert!(b.min.min_element() > -0.01 && b.max.max_element() < 2.01, "{b:?}");
        assert!(robust_box(&[]).is_none());
    }
}
