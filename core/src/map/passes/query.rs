//! The field at given points: distances, surfaces, and normal equations of a pose.
use crate::{
    call::Call,
    commands::Commands,
    engine::{Engine, EngineError},
    kernels::{
        align_points::{self, ALIGN_ROW},
        query_points,
        shared::{FLAG_ANCHORS, FLAG_MAP},
    },
    map::{Map, Scratch, sample_head, scratch::QUERY_POINTS_MAX},
    pose::Pose,
};
use alloc::vec::Vec;

/// Uploads camera-frame points (x, y, z \[m\], intensity) for [`align`].
pub fn upload_pixels(r: &mut Commands, scratch: &Scratch, pixels: &[[f32; 4]]) {
    r.upload(scratch.points, 0, pixels);
}

/// Sums of the normal equations over the uploaded pixels at a pose; see `align_points`.
///
/// # Errors
/// Engine failures.
pub async fn align(
    engine: &mut Engine,
    map: &Map,
    scratch: &Scratch,
    pose: &Pose,
    count: u32,
) -> Result<[f64; ALIGN_ROW], EngineError> {
    let mut r = Commands::default();
    map.frames.upload_pose(&mut r, 0, pose);
    let mut p = map.base;
    p.rays = count;
    align_points::Buffers {
        poses: map.frames.poses,
        pixels: scratch.points,
        planes_geometry: map.geometry.values,
        planes_appearance: map.appearance.values,
        decoders: map.decoders.values,
        partials: scratch.values,
    }
    .record(&mut r, &p, count as usize);
    engine.submit(&r)?;
    let groups = count.div_ceil(64) as usize;
    let rows: Vec<f32> = engine.read_as(scratch.values, 0, groups * ALIGN_ROW).await?;
    let mut sums = [0.0; ALIGN_ROW];
    for row in rows.chunks_exact(ALIGN_ROW) {
        for (s, v) in sums.iter_mut().zip(row) {
            *s += f64::from(*v);
        }
    }
    Ok(sums)
}

/// Signed distances \[truncations\] at points (x, y, z \[m\], unused).
///
/// # Errors
/// Engine failures.
pub(crate) async fn query_distances(
    engine: &mut Engine,
    map: &Map,
    scratch: &Scratch,
    points: &[[f32; 4]],
) -> Result<Vec<f32>, EngineError> {
    query(engine, map, scratch, points, 0).await
}

/// 8 floats per point: distance, class (bits; the nearest anchor's or the head's), 0, 0, red, green,
/// blue, 0.
///
/// # Errors
/// Engine failures.
pub(crate) async fn query_surface(
    engine: &mut Engine,
    map: &Map,
    scratch: &Scratch,
    points: &[[f32; 4]],
    by_anchors: bool,
) -> Result<Vec<f32>, EngineError> {
    let flags = FLAG_MAP | if by_anchors { FLAG_ANCHORS } else { 0 };
    let mut values = query(engine, map, scratch, points, flags).await?;
    if map.sample_head.is_some() {
        let classes = sample_head::classes_at(engine, map, scratch, points).await?;
        for (value, class) in values.chunks_exact_mut(8).zip(classes) {
            value[1] = f32::from_bits(class);
        }
    }
    Ok(values)
}

async fn query(
    engine: &mut Engine,
    map: &Map,
    scratch: &Scratch,
    points: &[[f32; 4]],
    flags: u32,
) -> Result<Vec<f32>, EngineError> {
    let floats = if flags & FLAG_MAP == 0 { 1 } else { 8 };
    let mut out = Vec::with_capacity(points.len() * floats);
    for chunk in points.chunks(QUERY_POINTS_MAX) {
        let mut r = Commands::default();
        r.upload(scratch.points, 0, chunk);
        let mut p = map.base;
        p.rays = chunk.len() as u32;
        p.flags = flags;
        p.classes = map.ray_classes();
        p.anchors = map.anchor_slots();
        query_points::Buffers {
            points: scratch.points,
            planes_geometry: map.geometry.values,
            planes_appearance: map.appearance.values,
            planes_semantic: map.semantic.values,
            decoders: map.decoders.values,
            anchors: map.anchors(),
            values: scratch.values,
        }
        .record(&mut r, &p, chunk.len());
        engine.submit(&r)?;
        out.extend(engine.read_as::<f32>(scratch.values, 0, chunk.len() * floats).await?);
    }
    Ok(out)
}
