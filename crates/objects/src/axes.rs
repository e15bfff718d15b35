//! The axes of a room: up, and the horizontal direction that its walls keep.
use crate::error::{ObjectsError, invalid};
use glam::DVec3;
use mte_slam_mesh::Mesh;
use mte_slam_types::pose::Pose;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Surfaces whose normal is this close to horizontal stand upright (sine of 11.5 degrees).
const UPRIGHT: f64 = 0.2;
/// Bins of the histogram over a quarter turn: a quarter of a degree each.
const BINS: usize = 360;
/// Bins to each side that belong to a peak: 1.5 degrees.
const PEAK_BINS: usize = 6;
/// Angle within which a surface is along the axes \[rad\]: 5 degrees.
const ALONG_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Right-handed axes of a room. `x` and `y` are horizontal and along its walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomAxes {
    /// First horizontal direction (unit vector in the world).
    pub x: DVec3,
    /// Second horizontal direction (unit vector in the world).
    pub y: DVec3,
    /// Up (unit vector in the world).
    pub up: DVec3,
    /// Turn of `x` about `up` from the reference \[degrees\], in (-45, 45]. The reference is the
    /// world's x axis, or its y axis where `up` is within 37 degrees of x, brought into the
    /// horizontal plane.
    pub yaw_deg: f64,
    /// Share of the upright surface that yaw was found from whose normals are within 5 degrees of
    /// an axis. Directions without any order give 0.11; near that, yaw means little. 0 where
    /// there was no upright surface, and yaw is 0 for want of any.
    pub aligned_share: f64,
}

impl RoomAxes {
    /// Returns axes with this turn about up.
    ///
    /// # Errors
    /// `up` is not of length 1, or the angle is not finite.
    pub fn from_yaw(up: DVec3, yaw_rad: f64) -> Result<RoomAxes, ObjectsError> {
        if !yaw_rad.is_finite() {
            return Err(invalid("yaw", format!("{yaw_rad} rad"), "a finite angle"));
        }
        let (up, x0, y0) = reference(up)?;
        let (sin, cos) = (libm::sin(yaw_rad), libm::cos(yaw_rad));
        let x = (cos * x0 + sin * y0).normalize();
        let y = up.cross(x);
        Ok(RoomAxes { x, y, up, yaw_deg: yaw_rad.to_degrees(), aligned_share: 0.0 })
    }

    /// Finds yaw: the angle, of a quarter turn, that the most upright surface keeps. Triangles for
    /// which `counts` does not hold are left out.
    ///
    /// # Errors
    /// A mesh that fails [`Mesh::check`], or an `up` that is not of length 1.
    pub fn find(
        mesh: &Mesh,
        up: DVec3,
        counts: impl Fn(usize) -> bool,
    ) -> Result<RoomAxes, ObjectsError> {
        mesh.check()?;
        let (up, x0, y0) = reference(up)?;
        let mut upright: Vec<(f64, f64)> = Vec::new();
        for t in (0..mesh.triangles.len()).filter(|&t| counts(t)) {
            let Some((normal, area)) = normal_and_area(mesh, t) else { continue };
            if normal.dot(up).abs() < UPRIGHT {
                let angle = libm::atan2(normal.dot(y0), normal.dot(x0));
                upright.push((angle.rem_euclid(FRAC_PI_2), area));
            }
        }
        let (yaw, aligned_share) = peak(&upright);
        Ok(RoomAxes { aligned_share, ..RoomAxes::from_yaw(up, yaw)? })
    }

    /// Returns a point of the world in room coordinates \[m\].
    pub fn to_room(&self, p: DVec3) -> DVec3 {
        DVec3::new(p.dot(self.x), p.dot(self.y), p.dot(self.up))
    }

    /// Returns a point in room coordinates in the world \[m\].
    pub fn to_world(&self, p: DVec3) -> DVec3 {
        p.x * self.x + p.y * self.y + p.z * self.up
    }
}

/// Returns up of the cameras: the mean direction opposite to their y axes, or `None` where they
/// point everywhere or there are none. People hold cameras about level, so [`level_up`] does the rest.
pub fn cameras_up<'a>(world_from_camera: impl Iterator<Item = &'a Pose>) -> Option<DVec3> {
    let (mut sum, mut poses) = (DVec3::ZERO, 0.0);
    for pose in world_from_camera {
        sum -= pose.rotation.y_axis;
        poses += 1.0;
    }
    // Below this the directions cancel, and what is left says nothing.
    (sum.is_finite() && sum.length() > 0.2 * poses).then(|| sum.normalize())
}

/// Returns up as the level surfaces near it have it (floor, ceiling, table tops), from a unit vector
/// that is wrong by 25 degrees at most. Where there is no such surface, the vector comes back.
///
/// # Errors
/// A mesh that fails [`Mesh::check`], or a vector that is not of length 1.
pub fn level_up(mesh: &Mesh, near: DVec3) -> Result<DVec3, ObjectsError> {
    mesh.check()?;
    let mut up = unit(near)?;
    let normals: Vec<(DVec3, f64)> =
        (0..mesh.triangles.len()).filter_map(|t| normal_and_area(mesh, t)).collect();
    for within_deg in [25.0f64, 15.0, 10.0, 6.0, 4.0, 3.0, 3.0, 3.0] {
        let least = libm::cos(within_deg.to_radians());
        let mut sum = DVec3::ZERO;
        for (normal, area) in &normals {
            let along = normal.dot(up);
            if along.abs() >= least {
                sum += *normal * area.copysign(along);
            }
        }
        up = sum.try_normalize().unwrap_or(up);
    }
    Ok(up)
}

fn unit(up: DVec3) -> Result<DVec3, ObjectsError> {
    // A range, so that NaN fails.
    if !(0.999..=1.001).contains(&up.length()) {
        return Err(invalid("up", format!("{up}"), "a vector of length 1"));
    }
    Ok(up.normalize())
}

/// Up, and the horizontal axes at yaw 0.
fn reference(up: DVec3) -> Result<(DVec3, DVec3, DVec3), ObjectsError> {
    let up = unit(up)?;
    // Not the axis farthest from up: where up is nearly an axis, noise would choose among two.
    let axis = if up.x.abs() < 0.8 { DVec3::X } else { DVec3::Y };
    let x = (axis - axis.dot(up) * up).normalize();
    Ok((up, x, up.cross(x)))
}

fn normal_and_area(mesh: &Mesh, t: usize) -> Option<(DVec3, f64)> {
    let [a, b, c] = mesh.corners(t);
    let twice = (b - a).cross(c - a);
    let normal = twice.try_normalize()?;
    Some((normal, 0.5 * twice.length()))
}

/// The angle with the most area around it, in (-pi/4, pi/4], and the share of area within 5 degrees.
fn peak(upright: &[(f64, f64)]) -> (f64, f64) {
    let total: f64 = upright.iter().map(|(_, area)| area).sum();
    if total <= 0.0 {
        return (0.0, 0.0);
    }
    let mut bins = vec![0.0; BINS];
    for (angle, area) in upright {
        bins[((angle / FRAC_PI_2 * BINS as f64) as usize).min(BINS - 1)] += area;
    }
    let around = |i: usize| -> f64 {
        (0..=2 * PEAK_BINS).map(|k| bins[(i + BINS - PEAK_BINS + k) % BINS]).sum()
    };
    let mut best = (0, around(0));
    for i in 1..BINS {
        let sum = around(i);
        if sum > best.1 {
            best = (i, sum);
        }
    }
    let mut yaw = (best.0 as f64 + 0.5) / BINS as f64 * FRAC_PI_2;
    // Distance to yaw on the circle of a quarter turn.
    let off = |angle: f64, yaw: f64| (angle - yaw + FRAC_PI_4).rem_euclid(FRAC_PI_2) - FRAC_PI_4;
    for _ in 0..5 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (angle, area) in upright {
            let d = off(*angle, yaw);
            if d.abs() < 0.5 * ALONG_RAD {
                sum += area * d;
                weight += area;
            }
        }
        if weight > 0.0 {
            yaw += sum / weight;
        }
    }
    let along = upright.iter().filter(|(angle, _)| off(*angle, yaw).abs() <= ALONG_RAD);
    let share = along.map(|(_, area)| area).sum::<f64>() / total;
    let yaw = yaw.rem_euclid(FRAC_PI_2);
    (if yaw > FRAC_PI_4 { yaw - FRAC_PI_2 } else { yaw }, share)
}
