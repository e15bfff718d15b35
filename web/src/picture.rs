//! Images as RGBA for a page.
use mte_slam_core::slam::View;
use mte_slam_types::{
    classes::{ClassTable, UNLABELLED},
    frame::Frame,
};

/// Depth at which false colours end \[m\].
const FAR_M: f32 = 6.0;

/// Colour with full opacity.
pub fn color(color: &[[u8; 3]]) -> Vec<u8> {
    color.iter().flat_map(|c| [c[0], c[1], c[2], 255]).collect()
}

/// Depth \[m\] in false colours, near bright; transparent where there is none.
pub fn depth(depth_m: impl Iterator<Item = f32>) -> Vec<u8> {
    depth_m
        .flat_map(|d| if d > 0.0 { false_color(1.0 - (d / FAR_M).min(1.0)) } else { [0; 4] })
        .collect()
}

/// Classes in their colours; transparent without a class.
pub fn classes(classes: &[u8], table: &ClassTable) -> Vec<u8> {
    let color = |class: &u8| match table.classes.get(usize::from(*class)) {
        Some(c) if *class != UNLABELLED => [c.color[0], c.color[1], c.color[2], 255],
        _ => [0; 4],
    };
    classes.iter().flat_map(color).collect()
}

/// The three pictures of a frame.
pub fn of_frame(frame: &Frame, depth_unit_m: f64, table: &ClassTable) -> [Vec<u8>; 3] {
    let unit = depth_unit_m as f32;
    [
        color(&frame.color),
        depth(frame.depth.iter().map(|d| f32::from(*d) * unit)),
        frame.labels.as_ref().map_or_else(Vec::new, |l| classes(l, table)),
    ]
}

/// The three pictures of a view.
pub fn of_view(view: &View, table: &ClassTable) -> [Vec<u8>; 3] {
    let labels = if table.is_empty() { Vec::new() } else { classes(&view.class, table) };
    [color(&view.color), depth(view.depth_m.iter().copied()), labels]
}

/// 0 dark blue, over teal and yellow, to 1 nearly white: even steps of lightness.
fn false_color(t: f32) -> [u8; 4] {
    const STOPS: [[f32; 3]; 5] = [
        [24.0, 28.0, 74.0],
        [28.0, 92.0, 132.0],
        [46.0, 158.0, 132.0],
        [176.0, 206.0, 92.0],
        [253.0, 243.0, 191.0],
    ];
    let at = t.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let i = (at as usize).min(STOPS.len() - 2);
    let part = at - i as f32;
    let mix = |k: usize| (STOPS[i][k] + (STOPS[i + 1][k] - STOPS[i][k]) * part).round() as u8;
    [mix(0), mix(1), mix(2), 255]
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_types::classes::Class;

    #[test]
    fn nothing_is_transparent_and_near_is_brighter_than_far() {
        let rgba = depth([0.0, f32::NAN, 0.5, 5.0, 100.0].into_iter());
        let sum = |i: usize| rgba[4 * i..4 * i + 3].iter().map(|x| u32::from(*x)).sum::<u32>();
        assert_eq!((rgba[3], rgba[7], rgba[11]), (0, 0, 255));
        assert!(sum(2) > sum(3) && sum(3) > sum(4));
    }

    #[test]
    fn classes_have_their_colours() {
        let class = Class { raw_id: 7, name: "bed".into(), color: [1, 2, 3] };
        let table = ClassTable { classes: vec![class] };
        assert_eq!(classes(&[0, UNLABELLED, 9], &table), [1, 2, 3, 255, 0, 0, 0, 0, 0, 0, 0, 0]);
    }
}
