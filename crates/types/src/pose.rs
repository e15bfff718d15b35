//! Rigid transforms in double precision.
use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A rigid transform; as a camera pose it is `world_from_camera`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Rotation, a proper orthonormal matrix.
    pub rotation: DMat3,
    /// Translation \[m\].
    pub translation: DVec3,
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Pose {
    /// The identity.
    pub const IDENTITY: Pose = Pose { rotation: DMat3::IDENTITY, translation: DVec3::ZERO };

    /// From a row-major 4x4 matrix (the text form of most data sets). `None` unless every number
    /// is finite and the upper 3x3 block is a rotation within 1e-2; it is then orthonormalised.
    pub fn from_row_major(m: &[f64; 16]) -> Option<Pose> {
        if m.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let rotation = DMat3::from_cols(
            DVec3::new(m[0], m[4], m[8]),
            DVec3::new(m[1], m[5], m[9]),
            DVec3::new(m[2], m[6], m[10]),
        );
        let gram = rotation.transpose() * rotation;
        if !gram.abs_diff_eq(DMat3::IDENTITY, 1e-2) || rotation.determinant() < 0.0 {
            return None;
        }
        Some(Pose { rotation, translation: DVec3::new(m[3], m[7], m[11]) }.orthonormalised())
    }

    /// As a row-major 4x4 matrix.
    pub fn to_row_major(&self) -> [f64; 16] {
        let (r, t) = (self.rotation, self.translation);
        [
            r.x_axis.x, r.y_axis.x, r.z_axis.x, t.x, //
            r.x_axis.y, r.y_axis.y, r.z_axis.y, t.y, //
            r.x_axis.z, r.y_axis.z, r.z_axis.z, t.z, //
            0.0, 0.0, 0.0, 1.0,
        ]
    }

    /// From a translation \[m\] and a quaternion, normalised here.
    pub fn from_quaternion(translation: DVec3, q: DQuat) -> Pose {
        Pose { rotation: DMat3::from_quat(q.normalize()), translation }
    }

    /// Returns the rotation as a unit quaternion.
    pub fn quaternion(&self) -> DQuat {
        DQuat::from_mat3(&self.rotation).normalize()
    }

    /// Exponential of a twist (first three: translation part, last three: rotation vector),
    /// with rotation and translation taken separately: T = (exp(w), v), not the coupled SE(3) map.
    pub fn from_twist(twist: &[f64; 6]) -> Pose {
        let w = DVec3::new(twist[3], twist[4], twist[5]);
        let angle = w.length();
        let rotation =
            if angle < 1e-12 { DMat3::IDENTITY } else { DMat3::from_axis_angle(w / angle, angle) };
        Pose { rotation, translation: DVec3::new(twist[0], twist[1], twist[2]) }
    }

    /// Left retraction used by every optimiser here: rotation <- exp(w) rotation,
    /// translation <- translation + v, with `twist` = (v, w).
    pub fn retract(&self, twist: &[f64; 6]) -> Pose {
        let d = Pose::from_twist(twist);
        Pose { rotation: d.rotation * self.rotation, translation: self.translation + d.translation }
            .orthonormalised()
    }

    /// `self` after `other`: maps a point p to self(other(p)).
    pub fn compose(&self, other: &Pose) -> Pose {
        Pose {
            rotation: self.rotation * other.rotation,
            translation: self.rotation * other.translation + self.translation,
        }
    }

    /// Returns the inverse transform.
    pub fn inverse(&self) -> Pose {
        let rotation = self.rotation.transpose();
        Pose { rotation, translation: -(rotation * self.translation) }
    }

    /// Applies to a point.
    pub fn transform_point(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// Applies to a direction.
    pub fn transform_vector(&self, v: DVec3) -> DVec3 {
        self.rotation * v
    }

    /// Returns the rotation angle \[rad\], accurate for small angles.
    pub fn angle_rad(&self) -> f64 {
        let q = self.quaternion();
        let s = DVec3::new(q.x, q.y, q.z).length();
        2.0 * num_traits::Float::atan2(s, q.w.abs())
    }

    /// Returns the same transform with rounding errors of the rotation removed.
    pub fn orthonormalised(&self) -> Pose {
        Pose { rotation: DMat3::from_quat(self.quaternion()), translation: self.translation }
    }

    /// Returns the same camera with y and z reversed: turns OpenGL's axes (y up, z backward) into ours (y
    /// down, z forward), and back.
    pub fn with_flipped_camera(&self) -> Pose {
        let r = self.rotation;
        let rotation = DMat3::from_cols(r.x_axis, -r.y_axis, -r.z_axis);
        Pose { rotation, translation: self.translation }
    }

    /// Returns whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.rotation.is_finite() && self.translation.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_and_row_major_round_trip() {
        let p = Pose::from_twist(&[0.3, -2.0, 1.0, 0.4, -0.2, 1.1]);
        let e = p.compose(&p.inverse());
        assert!(e.translation.length() < 1e-12 && e.angle_rad() < 1e-12);
        let q = Pose::from_row_major(&p.to_row_major()).unwrap();
        assert!((q.translation - p.translation).length() < 1e-12);
        assert!(q.compose(&p.inverse()).angle_rad() < 1e-7);
    }

    #[test]
    fn bad_matrices_are_refused() {
        let mut m = Pose::IDENTITY.to_row_major();
        m[3] = f64::NAN;
        assert!(Pose::from_row_major(&m).is_none());
        m = Pose::IDENTITY.to_row_major();
        m[0] = -1.0;
        assert!(Pose::from_row_major(&m).is_none());
    }
}
