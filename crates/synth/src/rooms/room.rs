//! A living room: sofa and pictures to the west, window and desk to the north, bookcase and door
//! to the east, sideboard to the south, a dining table on a rug in the middle.
use crate::{
    builder::{Builder, shell},
    classes::Kind,
    furniture::*,
    shape::Primitive,
    texture::Pattern,
    trajectory::Waypoint,
};
use alloc::{vec, vec::Vec};
use glam::{Mat3, Vec3};

/// Builds it; returns the shell and the camera's way points.
pub fn build(b: &mut Builder) -> (Primitive, Vec<Waypoint>) {
    let size = [5.0, 4.5, 2.6];
    let (x, y, h) = (2.5, 2.25, 2.6);
    let paper = b.rng.pick(&[
        ([206, 196, 170], [166, 150, 118]),
        ([190, 202, 196], [142, 164, 156]),
        ([210, 190, 186], [172, 142, 140]),
        ([192, 198, 210], [140, 152, 178]),
    ]);
    let wallpaper = b.paint(Pattern::Wallpaper, paper.0, paper.1, 1.0);
    let brick = b.paint(Pattern::Brick, [160, 94, 72], [182, 174, 160], 1.0);
    let plaster = b.paint(Pattern::Stucco, paper.0.map(|c| c - 14), paper.1, 1.0);
    let planks = b.paint(Pattern::Planks, [128, 88, 54], [172, 128, 84], 1.0);
    let ceiling = b.paint(Pattern::Stucco, [214, 210, 200], [214, 210, 200], 1.0);
    let shell = shell(size, [wallpaper, brick, plaster, wallpaper], planks, ceiling);
    let oak = b.paint(Pattern::Wood, [150, 104, 62], [192, 148, 98], 1.0);
    let walnut = b.paint(Pattern::Wood, [78, 50, 34], [122, 82, 54], 1.2);
    let white = b.paint(Pattern::Wood, [216, 212, 202], [198, 194, 182], 2.0);

    b.place([0.0; 3], 0.0);
    for i in [-1.45f32, 0.05, 1.55] {
        b.begin();
        b.block(
            Kind::ceiling,
            walnut,
            [i - 0.07, -y + 1e-3, h - 0.13],
            [i + 0.07, y - 1e-3, h - 1e-3],
        );
    }
    b.place([0.8, 0.0, 0.0], 0.0);
    pendant(b, h, 0.34, Vec3::new(1.0, 0.88, 0.70) * 2.1);

    // West: sofa, three pictures, a floor lamp, a plant.
    b.place([-x, 0.0, 0.0], 90.0);
    skirting(b, [-y, y], white);
    let tall = b.rng.range(0.62, 0.72);
    picture(b, [-0.75, 1.55], [0.52, tall]);
    picture(b, [0.05, 1.62], [0.74, 0.54]);
    picture(b, [0.82, 1.52], [0.46, 0.60]);
    b.place([-x + 0.46, 0.05, 0.0], 90.0);
    let cloth = b.rng.pick(&[[96, 110, 130], [120, 86, 80], [98, 116, 92], [140, 128, 104]]);
    let cover = b.paint(Pattern::Fabric, cloth, cloth.map(|c| c + 50), 1.0);
    let cushions = [
        b.paint(Pattern::Zigzag, [205, 150, 50], [240, 225, 190], 12.0),
        b.paint(Pattern::Checks, [170, 50, 50], [225, 205, 180], 14.0),
        b.paint(Pattern::Stripes, [50, 110, 120], [225, 220, 200], 22.0),
    ];
    sofa(b, cover, 2.05, &cushions);
    b.place([-2.12, -1.55, 0.0], 0.0);
    floor_lamp(b);
    b.place([0.0; 3], 0.0);
    plant(b, [-2.08, 1.72, 0.0], 1.15, 24);

    // North: window with curtains over a low cabinet; a desk.
    b.place([0.0, y, 0.0], 0.0);
    skirting(b, [-x + 0.017, x - 0.017], white);
    window(b, [-0.62, 1.52], [1.35, 1.15], Vec3::new(0.90, 0.97, 1.06) * 5.4);
    let drape = b.paint(Pattern::Fabric, [150, 70, 62], [196, 128, 104], 0.7);
    curtain(b, [-1.66, -1.30], [0.62, 2.28], drape);
    curtain(b, [0.06, 0.42], [0.62, 2.28], drape);
    let rod = b.paint(Pattern::Plain, [120, 90, 50], [120, 90, 50], 4.0);
    b.begin();
    b.leaning_cone(
        Kind::curtain,
        rod,
        [-0.62, -0.1, 2.30],
        [0.014, 0.014],
        2.4,
        Mat3::from_cols(Vec3::Z, Vec3::Y, -Vec3::X),
    );
    picture(b, [1.52, 1.62], [0.84, 0.60]);
    b.place([-0.62, y - 0.20, 0.0], 0.0);
    let front = b.paint(Pattern::Panels, [176, 168, 146], [198, 190, 168], 1.0);
    cabinet(b, oak, front, [1.5, 0.36, 0.56], 3);
    vase(b, [-0.42, -0.03, 0.56], 1.0, [52, 84, 140]);
    bouquet(b, [-0.42, -0.03, 0.80], 0.24, 9, [226, 120, 130]);
    book_stack(b, [0.12, -0.02, 0.56], 4);
    plant(b, [0.52, 0.0, 0.56], 0.42, 14);
    b.place([1.52, y - 0.36, 0.0], 0.0);
    table(b, oak, walnut, [1.35, 0.64, 0.74]);
    monitor(b, [0.05, 0.10, 0.74], 0.58, 4.0);
    let keys = b.paint(Pattern::Keys, [40, 40, 44], [190, 190, 190], 1.0);
    b.begin();
    b.block(Kind::monitor, keys, [-0.20, -0.22, 0.7401], [0.24, -0.08, 0.758]);
    cup(b, [0.44, -0.12, 0.74], [50, 110, 170]);
    table_lamp(b, [-0.52, 0.14, 0.74], [60, 120, 110]);
    book_stack(b, [0.52, 0.14, 0.74], 3);
    let red = b.paint(Pattern::Fabric, [150, 48, 44], [190, 90, 70], 1.0);
    b.place([1.46, 1.36, 0.0], 172.0);
    chair(b, walnut, red);

    // East: bookcase, door, a picture between.
    b.place([x, 0.0, 0.0], -90.0);
    skirting(b, [-y + 0.017, 0.95], white);
    let leaf = b.paint(Pattern::Panels, [168, 120, 76], [196, 152, 104], 3.0);
    door(b, 1.50, leaf, white);
    picture(b, [0.72, 1.52], [0.40, 0.52]);
    b.place([x - 0.16, 0.55, 0.0], -90.0);
    bookcase(b, walnut, [1.75, 0.30, 2.02], 5);

    // South: sideboard with vase, lamp and cups, pictures, a chair.
    b.place([0.0, -y, 0.0], 180.0);
    skirting(b, [-x + 0.017, x - 0.017], white);
    picture(b, [-0.62, 1.56], [0.60, 0.78]);
    picture(b, [0.28, 1.60], [0.86, 0.62]);
    picture(b, [1.32, 1.52], [0.50, 0.50]);
    b.place([-0.05, -y + 0.23, 0.0], 180.0);
    let teal = b.paint(Pattern::Panels, [70, 116, 116], [92, 140, 136], 1.0);
    cabinet(b, oak, teal, [1.75, 0.44, 0.84], 4);
    vase(b, [-0.62, 0.02, 0.84], 1.15, [170, 80, 48]);
    bouquet(b, [-0.62, 0.02, 1.10], 0.28, 10, [240, 200, 80]);
    table_lamp(b, [0.66, 0.04, 0.84], [140, 60, 70]);
    book_stack(b, [0.28, -0.02, 0.84], 5);
    cup(b, [0.02, -0.10, 0.84], [190, 70, 50]);
    cup(b, [-0.16, -0.04, 0.84], [80, 130, 80]);
    b.place([-1.42, -1.78, 0.0], 145.0);
    chair(b, oak, red);

    // Middle: rug, table with things, chairs.
    b.place([0.0; 3], 0.0);
    let rug = b.paint(Pattern::Rug, [132, 38, 38], [40, 62, 98], 1.0);
    b.begin();
    b.block(Kind::rug, rug, [-1.35, -0.98, 0.0], [1.45, 0.98, 0.012]);
    b.place([0.05, 0.0, 0.012], 6.0);
    table(b, walnut, walnut, [1.25, 0.80, 0.72]);
    let cloth = b.paint(Pattern::Checks, [190, 60, 54], [232, 226, 212], 9.0);
    b.block(Kind::table, cloth, [-0.22, -0.4, 0.7201], [0.22, 0.4, 0.7235]);
    vase(b, [0.02, 0.05, 0.7235], 0.7, [96, 60, 120]);
    bouquet(b, [0.02, 0.05, 0.91], 0.16, 7, [250, 250, 245]);
    cup(b, [0.40, -0.16, 0.72], [220, 170, 60]);
    cup(b, [-0.36, 0.20, 0.72], [60, 60, 140]);
    book_stack(b, [-0.44, -0.15, 0.72], 3);
    for (at, degrees) in [
        ([-0.32, 0.66, 0.012], 8.0),
        ([0.40, 0.70, 0.012], -6.0),
        ([-0.30, -0.68, 0.012], 176.0),
        ([0.42, -0.60, 0.012], 190.0),
    ] {
        b.place(at, degrees);
        chair(b, oak, red);
    }

    let way = vec![
        ([1.00, -0.10, 1.42], [-1.80, 0.10, 0.80]),
        ([0.85, -0.62, 1.36], [-1.70, 1.10, 0.90]),
        ([0.25, -0.95, 1.40], [-0.70, 2.00, 0.95]),
        ([-0.45, -0.95, 1.48], [0.90, 2.00, 0.90]),
        ([-1.00, -0.45, 1.44], [2.10, 1.05, 0.85]),
        ([-1.05, 0.20, 1.36], [2.20, -0.50, 0.90]),
        ([-0.75, 0.80, 1.40], [1.20, -1.60, 0.85]),
        ([-0.05, 1.02, 1.46], [-0.10, -2.10, 0.80]),
        ([0.62, 0.78, 1.44], [-1.30, -1.90, 0.75]),
        ([1.00, 0.35, 1.40], [-1.95, -0.90, 0.80]),
    ];
    (shell, way)
}
