//! Trajectories in TUM format: one line per frame, `t x y z qx qy qz qw` of `world_from_camera`,
//! seconds and metres; what `evo` reads.
use anyhow::{Context, Result, bail};
use glam::{DQuat, DVec3};
use mte_slam_types::pose::Pose;
pub use mte_slam_types::trajectory_file::write_tum;

/// Reads such a file; `name` is for messages.
pub fn read_tum(name: &str, text: &str) -> Result<Vec<(f64, Pose)>> {
    let mut poses = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let numbers: Vec<f64> = line
            .split_whitespace()
            .map(str::parse)
            .collect::<Result<_, _>>()
            .ok()
            .filter(|n: &Vec<f64>| n.iter().all(|x| x.is_finite()))
            .with_context(|| {
                let found: String = line.chars().take(80).collect();
                format!("{name} line {}: found `{found}`, expected 8 finite numbers", i + 1)
            })?;
        let [t, x, y, z, qx, qy, qz, qw] = numbers[..] else {
            bail!(
                "{name} line {}: found {} numbers, expected 8: t x y z qx qy qz qw",
                i + 1,
                numbers.len()
            );
        };
        let q = DQuat::from_xyzw(qx, qy, qz, qw);
        if (q.length() - 1.0).abs() > 1e-2 {
            bail!(
                "{name} line {}: found a quaternion of length {:.3}, expected 1",
                i + 1,
                q.length()
            );
        }
        poses.push((t, Pose::from_quaternion(DVec3::new(x, y, z), q)));
    }
    Ok(poses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip_keeps_stamps_and_poses() {
        let stamps = [0.0, 12.0, 1341841278.8427, 0.1234567891, 1341841278.8427003];
        let pose = Pose::from_twist(&[0.3, -2.0, 1.0, 0.4, -0.2, 3.1]);
        let text = write_tum(stamps.iter().map(|&t| (t, pose)));
        assert!(text.contains("\n1341841278.842700 0.3"), "{text}");
        let read = read_tum("t", &text).unwrap();
        assert_eq!(read.iter().map(|r| r.0).collect::<Vec<_>>(), stamps);
        for (_, p) in read {
            let e = p.compose(&pose.inverse());
            assert!(e.translation.length() < 1e-8 && e.angle_rad() < 1e-10);
        }
    }

    #[test]
    fn bad_lines_are_named() {
        for (text, part) in [
            ("0 1 2 3 0 0 0", "found 7 numbers"),
            ("0 1 2 nan 0 0 0 1", "line 1"),
            ("0 1 2 3 0 0 0 2", "quaternion of length 2"),
            ("# x\n0 1 2 3 0 0 zero 1", "line 2"),
        ] {
            let error = read_tum("trajectory.txt", text).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("trajectory.txt"), "{error}");
        }
    }
}
