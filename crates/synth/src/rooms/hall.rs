//! A hall of 10 x 9 x 8 m: high windows to the north and south, a gallery on columns to the west,
//! tables, sofas and bookcases below. The camera flies, or it would see little of what is high up.
use crate::{
    builder::{Builder, shell},
    classes::Kind,
    furniture::*,
    shape::Primitive,
    texture::Pattern,
    trajectory::Waypoint,
};
use alloc::{vec, vec::Vec};
use glam::Vec3;

/// Builds it; returns the shell and the camera's way points.
pub fn build(b: &mut Builder) -> (Primitive, Vec<Waypoint>) {
    let (x, y, h) = (5.0, 4.5, 8.0);
    let paper = b.rng.pick(&[
        ([206, 196, 170], [166, 150, 118]),
        ([190, 202, 196], [142, 164, 156]),
        ([210, 190, 186], [172, 142, 140]),
    ]);
    let wallpaper = b.paint(Pattern::Wallpaper, paper.0, paper.1, 0.8);
    let brick = b.paint(Pattern::Brick, [160, 94, 72], [182, 174, 160], 1.0);
    let plaster = b.paint(Pattern::Stucco, paper.0.map(|c| c - 14), paper.1, 1.0);
    let planks = b.paint(Pattern::Planks, [128, 88, 54], [172, 128, 84], 0.8);
    let ceiling = b.paint(Pattern::Panels, [214, 210, 200], [196, 190, 176], 1.0);
    let shell =
        shell([2.0 * x, 2.0 * y, h], [wallpaper, brick, plaster, wallpaper], planks, ceiling);
    let oak = b.paint(Pattern::Wood, [150, 104, 62], [192, 148, 98], 1.0);
    let walnut = b.paint(Pattern::Wood, [78, 50, 34], [122, 82, 54], 1.2);
    let white = b.paint(Pattern::Wood, [216, 212, 202], [198, 194, 182], 2.0);
    let red = b.paint(Pattern::Fabric, [150, 48, 44], [190, 90, 70], 1.0);

    // Beams under the ceiling, and two lamps on long cords.
    b.place([0.0; 3], 0.0);
    for at in [-3.3f32, 0.05, 3.4] {
        let (low, high) = (at - 0.12, at + 0.12);
        b.begin();
        b.block(Kind::ceiling, walnut, [low, -y + 1e-3, h - 0.3], [high, y - 1e-3, h - 1e-3]);
    }
    for (at, drop) in [([-1.6, 0.4, 0.0], 3.2), ([2.2, -0.5, 0.0], 2.6)] {
        b.place(at, 0.0);
        pendant(b, h, drop, Vec3::new(1.0, 0.88, 0.70) * 7.0);
    }

    // West: a gallery on columns, with a railing, bookcases and a sofa on it and beneath.
    b.place([0.0; 3], 0.0);
    b.begin();
    b.block(Kind::floor, oak, [-x + 1e-3, -y + 1e-3, 3.4], [-x + 2.2, y - 1e-3, 3.6]);
    let marble = b.paint(Pattern::Stucco, [222, 216, 206], [190, 180, 170], 2.0);
    for along in [-3.0f32, -1.0, 1.0, 3.0] {
        b.begin();
        b.cone(Kind::wall, marble, [-x + 2.0, along, 0.0], [0.19, 0.15], 3.3999);
    }
    b.begin();
    b.block(Kind::wall, walnut, [-x + 2.1, -y + 1e-3, 4.5], [-x + 2.16, y - 1e-3, 4.58]);
    for i in 0..30 {
        let along = -4.35 + 0.3 * i as f32;
        let (low, high) = ([-x + 2.11, along, 3.6001], [-x + 2.15, along + 0.04, 4.4999]);
        b.block(Kind::wall, white, low, high);
    }
    for (along, floor) in [(-3.0, 3.6), (-0.9, 3.6), (1.2, 0.0), (3.2, 3.6)] {
        b.place([-x + 0.16, along, floor], 90.0);
        bookcase(b, walnut, [1.75, 0.30, 2.02], 5);
    }
    let cloth = b.paint(Pattern::Fabric, [96, 110, 130], [146, 160, 180], 1.0);
    let cushions = [
        b.paint(Pattern::Zigzag, [205, 150, 50], [240, 225, 190], 12.0),
        b.paint(Pattern::Checks, [170, 50, 50], [225, 205, 180], 14.0),
    ];
    b.place([-x + 0.5, -1.6, 0.0], 90.0);
    sofa(b, cloth, 2.05, &cushions);

    // North and south: high windows, pictures below, a door.
    for (turn, side) in [(0.0, y), (180.0, -y)] {
        b.place([0.0, side, 0.0], turn);
        skirting(b, [-x + 0.017, x - 0.017], white);
        for at in [-1.2, 1.4, 3.8] {
            window(b, [at, 5.2], [1.5, 2.6], Vec3::new(0.90, 0.97, 1.06) * 16.0);
            picture(b, [at, 2.2], [1.1, 0.9]);
        }
    }
    b.place([0.0, -y, 0.0], 180.0);
    let leaf = b.paint(Pattern::Panels, [168, 120, 76], [196, 152, 104], 3.0);
    door(b, 0.1, leaf, white);

    // East: pictures high and low, a cabinet with vases.
    b.place([x, 0.0, 0.0], -90.0);
    skirting(b, [-y + 0.017, y - 0.017], white);
    for (at, z) in [(-3.0, 1.9), (-0.6, 2.3), (2.2, 1.8), (-1.8, 4.6), (1.2, 4.9), (0.0, 6.6)] {
        picture(b, [at, z], [1.3, 1.0]);
    }
    b.place([x - 0.24, -0.8, 0.0], -90.0);
    let teal = b.paint(Pattern::Panels, [70, 116, 116], [92, 140, 136], 1.0);
    cabinet(b, oak, teal, [2.4, 0.44, 0.84], 5);
    vase(b, [-0.8, 0.02, 0.84], 1.6, [170, 80, 48]);
    bouquet(b, [-0.8, 0.02, 1.24], 0.4, 12, [240, 200, 80]);
    table_lamp(b, [0.7, 0.04, 0.84], [140, 60, 70]);
    b.place([0.0; 3], 0.0);
    for (at, k) in [([4.3, 3.8, 0.0], 2.2), ([4.3, -3.8, 0.0], 1.8), ([-4.2, 3.9, 0.0], 1.6)] {
        plant(b, at, k, 26);
    }

    // Middle: two long tables on rugs, with chairs.
    let rug = b.paint(Pattern::Rug, [132, 38, 38], [40, 62, 98], 0.7);
    for side in [-1.0f32, 1.0] {
        b.place([1.0, 1.7 * side, 0.0], 0.0);
        b.begin();
        b.block(Kind::rug, rug, [-2.0, -1.2, 0.0], [2.0, 1.2, 0.012]);
        b.place([1.0, 1.7 * side, 0.012], 3.0 * side);
        table(b, walnut, oak, [2.8, 0.95, 0.74]);
        vase(b, [0.1, 0.0, 0.74], 1.0, [96, 60, 120]);
        monitor(b, [-0.8, 0.2, 0.74], 0.58, 8.0);
        book_stack(b, [0.8, 0.1, 0.74], 5);
        cup(b, [0.4, -0.25, 0.74], [220, 170, 60]);
        for i in 0..4 {
            let at = 0.1 + 0.68 * (i as f32 - 1.0);
            b.place([at + 0.3, 1.7 * side + 0.8, 0.012], 4.0 * i as f32 - 6.0);
            chair(b, oak, red);
            b.place([at + 0.3, 1.7 * side - 0.8, 0.012], 178.0 - 5.0 * i as f32);
            chair(b, oak, red);
        }
    }

    let way = vec![
        ([3.2, 0.1, 1.6], [-3.0, 0.4, 1.0]),
        ([2.6, -3.4, 1.7], [-1.0, 3.0, 1.2]),
        ([-1.6, -3.2, 1.6], [3.4, -1.0, 1.2]),
        ([-2.2, 0.2, 1.7], [1.4, 0.0, 0.6]),
        ([-1.6, 3.0, 1.6], [-4.6, -1.5, 1.4]),
        ([2.4, 3.4, 1.9], [0.0, -3.8, 2.0]),
        ([3.6, 0.4, 3.2], [-4.2, 0.0, 3.4]),
        ([2.0, -2.6, 4.6], [-4.0, 2.4, 4.4]),
        ([-0.6, -1.8, 5.0], [-1.0, 4.2, 5.0]),
        ([-1.2, 1.6, 5.2], [4.6, -1.4, 4.8]),
        ([1.4, 2.6, 4.6], [1.2, -4.2, 5.4]),
        ([2.6, 0.4, 5.0], [-1.0, -0.6, 7.8]),
        ([0.2, -1.0, 5.2], [3.6, 1.0, 7.4]),
        ([0.6, 1.8, 4.4], [0.9, -0.4, 0.4]),
    ];
    (shell, way)
}
