//! Poses as text: matrices, translations with quaternions, and logs of them.
use super::folder::{invalid, parse_numbers};
use glam::{DQuat, DVec3};
use mte_slam_types::{pose::Pose, sequence::SequenceError};

/// How far from 1 the length of a quaternion may be.
const LENGTH_TOLERANCE: f64 = 0.05;
/// Lines of one pose in a log: what it belongs to, and a matrix.
const LOG_LINES: usize = 5;

/// Returns whether a row-major matrix means that there is no pose: so programs say by numbers that
/// are not finite, or by zeros.
pub(super) fn is_none(matrix: &[f64; 16]) -> bool {
    let rotation = [0, 1, 2, 4, 5, 6, 8, 9, 10].map(|i| matrix[i]);
    matrix.iter().any(|x| !x.is_finite()) || rotation == [0.0; 9]
}

/// Returns the pose of 16 row-major numbers, or of the first 12 of them; `None` where they mean
/// that there is none.
pub(super) fn parse_matrix(
    file: &str,
    frame: Option<u64>,
    text: &str,
) -> Result<Option<Pose>, SequenceError> {
    of_matrix(file, frame, &parse_numbers(file, frame, text)?, "12 or 16 numbers")
}

fn of_matrix(
    file: &str,
    frame: Option<u64>,
    numbers: &[f64],
    expected: &str,
) -> Result<Option<Pose>, SequenceError> {
    let mut matrix = Pose::IDENTITY.to_row_major();
    if !matches!(numbers.len(), 12 | 16) {
        let found = format!("{} numbers", numbers.len());
        return Err(invalid(file, frame, "pose", found, expected));
    }
    matrix[..numbers.len()].copy_from_slice(numbers);
    if is_none(&matrix) {
        return Ok(None);
    }
    match Pose::from_row_major(&matrix) {
        Some(pose) => Ok(Some(pose)),
        None => Err(invalid(
            file,
            frame,
            "pose",
            "a matrix whose upper left 3x3 block is not a rotation",
            "a rigid transform, world_from_camera",
        )),
    }
}

/// Returns the pose of a line: a matrix, or `tx ty tz qx qy qz qw`, with or without a time stamp
/// in front (which is not looked at). `None` where the numbers mean that there is none.
pub(super) fn parse_line(
    file: &str,
    frame: Option<u64>,
    line: &str,
) -> Result<Option<Pose>, SequenceError> {
    let numbers = parse_numbers(file, frame, line)?;
    let &([x, y, z, qx, qy, qz, qw] | [_, x, y, z, qx, qy, qz, qw]) = numbers.as_slice() else {
        let expected = "7 numbers (tx ty tz qx qy qz qw), 12 or 16 numbers (a matrix)";
        return of_matrix(file, frame, &numbers, expected);
    };
    match of_quaternion([x, y, z], [qx, qy, qz, qw]) {
        Ok(pose) => Ok(pose),
        Err(length) => {
            let found = format!("a quaternion of length {length:.3}");
            Err(invalid(file, frame, "pose", found, "a quaternion of length 1"))
        }
    }
}

/// Returns the pose of a translation and a quaternion with the scalar last; `None` where they are
/// not finite or the quaternion is 0, and an error with its length where that is not 1.
pub(super) fn of_quaternion(t: [f64; 3], q: [f64; 4]) -> Result<Option<Pose>, f64> {
    let (t, q) = (DVec3::from_array(t), DQuat::from_array(q));
    if !t.is_finite() || !q.is_finite() || q.to_array() == [0.0; 4] {
        return Ok(None);
    }
    match q.length() {
        length if (length - 1.0).abs() > LENGTH_TOLERANCE => Err(length),
        _ => Ok(Some(Pose::from_quaternion(t, q))),
    }
}

/// Returns the lines that are neither empty nor comments.
pub(super) fn lines(text: &str) -> Vec<&str> {
    text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#')).collect()
}

/// Returns the poses of a log as Open3D and the Redwood data have it, in the order of the file: for
/// each a line of whole numbers and the four rows of a matrix.
pub(super) fn parse_log(file: &str, text: &str) -> Result<Vec<Option<Pose>>, SequenceError> {
    let lines = lines(text);
    if !lines.len().is_multiple_of(LOG_LINES) {
        let found = format!("{} lines", lines.len());
        let expected = "5 for each pose: whole numbers, and the rows of a matrix";
        return Err(invalid(file, None, "poses", found, expected));
    }
    let poses = lines.chunks(LOG_LINES).enumerate();
    poses.map(|(i, five)| parse_matrix(file, Some(i as u64), &five[1..].join(" "))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURNED: &str = "0 -1 0 4  1 0 0 5  0 0 1 6";

    #[test]
    fn matrices_and_quaternions_give_the_same() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let quaternion = format!("4 5 6 0 0 {half} {half}");
        let want = parse_matrix("p", None, &format!("{TURNED} 0 0 0 1")).unwrap().unwrap();
        for text in [TURNED, &quaternion, &format!("1305031453.35 {quaternion}")] {
            let got = parse_line("p", None, text).unwrap().unwrap();
            assert!((got.translation - want.translation).length() < 1e-12);
            assert!(got.compose(&want.inverse()).angle_rad() < 1e-7, "{text}");
        }
        let log = format!(
            "0 0 2\n{}\n0 0 0 1\n1 1 2\n{}\n",
            TURNED.replace("  ", "\n"),
            "0 0 0 0\n".repeat(4)
        );
        let poses = parse_log("p.log", &log).unwrap();
        assert_eq!(poses, [Some(want), None]);
    }

    #[test]
    fn what_means_no_pose_and_what_is_a_mistake() {
        let zeros = ["0"; 16].join(" ");
        for none in [&zeros, &zeros.replacen('0', "nan", 1), "1 2 3 0 0 0 0", "1 2 inf 0 0 0 1"] {
            assert_eq!(parse_line("p", None, none).unwrap(), None, "{none}");
        }
        for (text, part) in [
            ("1 2 3", "3 numbers"),
            ("1 2 3 0 0 0 0.5", "length 0.500"),
            ("2 0 0 0 0 2 0 0 0 0 2 0", "not a rotation"),
            ("1 2 x", "\"x\""),
        ] {
            let e = parse_line("pose.txt", Some(3), text).unwrap_err().to_string();
            assert!(e.contains("pose.txt (frame 3)") && e.contains(part), "{e}");
        }
        let e = parse_log("a.log", "0 0 1\n1 0 0 0").unwrap_err().to_string();
        assert!(e.contains("a.log") && e.contains("2 lines"), "{e}");
    }
}
