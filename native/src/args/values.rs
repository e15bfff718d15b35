//! Values of options, with what is wrong with others.
use glam::{DQuat, DVec3};
use mte_slam_types::pose::Pose;

/// A pose: position in metres and quaternion.
pub fn pose(text: &str) -> Result<Pose, String> {
    let expected = "expected 7 numbers: tx ty tz in metres, qx qy qz qw of length 1";
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()
        .map_err(|_| format!("found something that is no number, {expected}"))?;
    let [x, y, z, qx, qy, qz, qw] = numbers[..] else {
        return Err(format!("found {} numbers, {expected}", numbers.len()));
    };
    let (t, q) = (DVec3::new(x, y, z), DQuat::from_xyzw(qx, qy, qz, qw));
    // As in files of poses: more than rounding is a mistake, such as another order.
    if !t.is_finite() || !(0.99..=1.01).contains(&q.length()) {
        return Err(format!("found a quaternion of length {}, {expected}", q.length()));
    }
    Ok(Pose::from_quaternion(t, q))
}

/// A whole number of at least 1.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n) if n >= 1 => Ok(n),
        _ => Err("found no whole number of at least 1, expected for example 10".to_owned()),
    }
}

/// A width of pictures \[pixels\].
pub fn picture_width(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(n) if (32..=1280).contains(&n) && n % 4 == 0 => Ok(n),
        _ => Err("expected a multiple of 4 from 32 to 1280".to_owned()),
    }
}

/// A length from a millimetre to a metre \[m\].
pub fn positive_metres(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(m) if (0.001..=1.0).contains(&m) => Ok(m),
        _ => Err("expected metres from 0.001 to 1".to_owned()),
    }
}

/// A length from nothing to a metre \[m\]; what is not nothing is at least a millimetre.
pub fn gap_metres(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(m) if m == 0.0 || (0.001..=1.0).contains(&m) => Ok(m),
        _ => Err("expected metres, 0 or from 0.001 to 1".to_owned()),
    }
}

/// An area of nothing or more \[m2\].
pub fn square_metres(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(area) if area >= 0.0 && area.is_finite() => Ok(area),
        _ => Err("expected square metres, 0 or more".to_owned()),
    }
}

/// A direction, brought to length 1.
pub fn direction(text: &str) -> Result<DVec3, String> {
    let expected = "expected 3 numbers that are not all 0, for example 0,0,1";
    let numbers: Vec<f64> = text
        .split(',')
        .map(|n| n.trim().parse())
        .collect::<Result<_, _>>()
        .map_err(|_| format!("found something that is no number, {expected}"))?;
    let [x, y, z] = numbers[..] else {
        return Err(format!("found {} numbers, {expected}", numbers.len()));
    };
    let unit = DVec3::new(x, y, z).try_normalize();
    unit.ok_or_else(|| format!("found a vector without a direction, {expected}"))
}
