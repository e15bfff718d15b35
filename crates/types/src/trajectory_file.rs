//! Trajectories in TUM format: one line per frame, `t x y z qx qy qz qw` of `world_from_camera`,
//! seconds and metres; what `evo` reads.
use crate::pose::Pose;
use alloc::{
    format,
    string::{String, ToString},
};
use core::fmt::Write;
use glam::DQuat;

/// Returns the text of the poses with their time stamps \[s\].
pub fn write_tum(poses: impl Iterator<Item = (f64, Pose)>) -> String {
    let mut text = "# time_s x_m y_m z_m qx qy qz qw (world_from_camera)\n".to_string();
    for (time_s, pose) in poses {
        let (t, q) = (pose.translation, canonical(pose.quaternion()));
        // Digits for 1e-9 m and 1e-12 of a quaternion: reading it back moves no figure.
        let _ = writeln!(
            text,
            "{} {:.9} {:.9} {:.9} {:.12} {:.12} {:.12} {:.12}",
            stamp(time_s),
            t.x,
            t.y,
            t.z,
            q.x,
            q.y,
            q.z,
            q.w
        );
    }
    text
}

/// A time stamp without loss: six decimals, as the data sets print them, if that gives the number
/// back, else the shortest text that does.
pub fn stamp(time_s: f64) -> String {
    let six = format!("{time_s:.6}");
    if six.parse::<f64>() == Ok(time_s) { six } else { format!("{time_s}") }
}

// q and -q are one rotation; w >= 0 makes files comparable.
fn canonical(q: DQuat) -> DQuat {
    if q.w < 0.0 { -q } else { q }
}
