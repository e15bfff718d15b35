//! An office: desks with screens to the north and west, a whiteboard and a couch to the south,
//! shelves and the door to the east, a meeting table in the middle.
use crate::{
    builder::{Builder, pitch, shell},
    classes::Kind,
    furniture::*,
    shape::Primitive,
    texture::Pattern,
    trajectory::Waypoint,
};
use alloc::{vec, vec::Vec};
use glam::Vec3;

/// A desk with screens, a keyboard and what lies about.
fn workplace(b: &mut Builder, top: u16, metal: u16, screens: usize) {
    table(b, top, metal, [1.5, 0.72, 0.735]);
    match screens {
        2 => {
            monitor(b, [-0.30, 0.16, 0.735], 0.54, 12.0);
            monitor(b, [0.30, 0.16, 0.735], 0.54, -12.0);
        }
        _ => monitor(b, [0.0, 0.16, 0.735], 0.62, 5.0),
    }
    let keys = b.paint(Pattern::Keys, [42, 42, 46], [200, 200, 200], 1.0);
    b.begin();
    b.block(Kind::monitor, keys, [-0.23, -0.24, 0.7351], [0.21, -0.10, 0.752]);
    let color = b.rng.pick(&[[180, 60, 50], [50, 100, 160], [80, 140, 80]]);
    cup(b, [0.52, -0.14, 0.735], color);
    book_stack(b, [-0.56, -0.10, 0.735], 4);
}

/// Builds it; returns the shell and the camera's way points.
pub fn build(b: &mut Builder) -> (Primitive, Vec<Waypoint>) {
    let size = [5.4, 4.4, 2.7];
    let (x, y, h) = (2.7, 2.2, 2.7);
    let tone = b.rng.pick(&[[196, 200, 196], [204, 198, 186], [190, 196, 206]]);
    let plaster = b.paint(Pattern::Stucco, tone, tone, 1.0);
    let accent = b.paint(Pattern::Wallpaper, [112, 140, 150], [80, 108, 122], 0.8);
    let panels = b.paint(Pattern::Planks, [150, 118, 84], [182, 150, 112], 1.0);
    let brick = b.paint(Pattern::Brick, [186, 182, 174], [150, 146, 138], 1.0);
    let carpet = b.paint(Pattern::Tiles, [84, 92, 104], [110, 112, 116], 2.0);
    let tiles = b.paint(Pattern::Tiles, [208, 208, 202], [220, 220, 216], 1.667);
    let shell = shell(size, [accent, panels, brick, plaster], carpet, tiles);
    let beech = b.paint(Pattern::Wood, [186, 150, 104], [212, 180, 136], 1.0);
    let grey = b.paint(Pattern::Plain, [110, 114, 120], [110, 114, 120], 3.0);
    let black = b.paint(Pattern::Plain, [38, 38, 42], [38, 38, 42], 3.0);
    let white = b.paint(Pattern::Wood, [214, 212, 206], [200, 198, 190], 2.0);
    let blue = b.paint(Pattern::Fabric, [50, 66, 98], [88, 104, 140], 1.2);
    let green = b.paint(Pattern::Fabric, [70, 96, 70], [110, 134, 100], 1.2);

    for (at, power) in [([-1.2, 0.3, 0.0], 1.5), ([1.3, 0.0, 0.0], 1.5)] {
        b.place(at, 0.0);
        pendant(b, h, 0.26, Vec3::new(1.0, 0.96, 0.88) * power);
    }

    // North: two workplaces under the window.
    b.place([0.0, y, 0.0], 0.0);
    skirting(b, [-x + 0.017, x - 0.017], grey);
    window(b, [0.1, 1.68], [1.9, 1.0], Vec3::new(0.92, 0.98, 1.05) * 5.0);
    let blind = b.paint(Pattern::Fabric, [196, 186, 160], [170, 158, 130], 0.8);
    curtain(b, [-1.36, -0.92], [1.02, 2.36], blind);
    curtain(b, [1.12, 1.56], [1.02, 2.36], blind);
    picture(b, [-1.95, 1.62], [0.62, 0.82]);
    picture(b, [2.10, 1.60], [0.60, 0.80]);
    b.place([-0.72, y - 0.42, 0.0], 0.0);
    workplace(b, beech, grey, 2);
    b.place([1.05, y - 0.42, 0.0], 0.0);
    workplace(b, beech, grey, 1);
    b.place([-0.68, 1.18, 0.0], 190.0);
    office_chair(b, blue, black);
    b.place([1.10, 1.12, 0.0], 160.0);
    office_chair(b, green, black);
    b.place([0.0; 3], 0.0);
    plant(b, [-2.35, 1.85, 0.0], 1.2, 26);

    // West: a long cabinet with plants and lamp, a notice board.
    b.place([-x, 0.0, 0.0], 90.0);
    skirting(b, [-y + 0.017, y - 0.017], grey);
    let board = b.paint(Pattern::Whiteboard, [188, 150, 104], [120, 90, 60], 1.0);
    b.begin();
    b.block(Kind::picture, board, [-0.75, -0.025, 1.15], [0.75, -0.001, 2.1]);
    b.place([-x + 0.23, 0.1, 0.0], 90.0);
    let front = b.paint(Pattern::Panels, [150, 152, 150], [172, 174, 172], 2.0);
    cabinet(b, beech, front, [1.9, 0.42, 0.78], 4);
    table_lamp(b, [-0.72, 0.02, 0.78], [60, 90, 140]);
    plant(b, [0.70, 0.0, 0.78], 0.5, 14);
    vase(b, [0.30, 0.02, 0.78], 1.0, [150, 70, 90]);
    bouquet(b, [0.30, 0.02, 1.02], 0.24, 8, [250, 210, 90]);
    book_stack(b, [-0.25, 0.0, 0.78], 5);

    // East: bookcases and the door.
    b.place([x, 0.0, 0.0], -90.0);
    skirting(b, [-y + 0.017, 0.85], grey);
    let leaf = b.paint(Pattern::Panels, [140, 60, 48], [160, 80, 62], 2.0);
    door(b, 1.45, leaf, white);
    picture(b, [0.62, 1.55], [0.42, 0.58]);
    b.place([x - 0.17, 0.75, 0.0], -90.0);
    bookcase(b, white, [1.70, 0.32, 1.95], 5);

    // South: whiteboard over a couch, a floor lamp.
    b.place([0.0, -y, 0.0], 180.0);
    skirting(b, [-x + 0.017, x - 0.017], grey);
    let board = b.paint(Pattern::Whiteboard, [226, 228, 230], [130, 132, 136], 1.0);
    b.begin();
    b.block(Kind::picture, board, [-1.3, -0.025, 0.98], [0.5, -0.001, 1.98]);
    picture(b, [1.55, 1.55], [0.66, 0.50]);
    b.place([1.30, -y + 0.46, 0.0], 180.0);
    let cushions = [
        b.paint(Pattern::Stripes, [200, 90, 40], [236, 220, 180], 20.0),
        b.paint(Pattern::Zigzag, [60, 110, 140], [230, 230, 220], 12.0),
    ];
    let cover = b.paint(Pattern::Fabric, [92, 84, 80], [140, 128, 118], 1.0);
    sofa(b, cover, 1.55, &cushions);
    b.place([-1.95, -y + 0.32, 0.0], 0.0);
    floor_lamp(b);
    b.place([-0.85, -y + 0.24, 0.0], 180.0);
    let front = b.paint(Pattern::Panels, [186, 150, 104], [200, 168, 122], 2.0);
    cabinet(b, beech, front, [1.2, 0.44, 0.72], 3);
    monitor(b, [-0.1, 0.04, 0.72], 0.5, 8.0);
    cup(b, [0.42, -0.06, 0.72], [190, 70, 60]);
    plant(b, [0.46, 0.08, 0.72], 0.3, 10);

    // Middle: a meeting table on a rug.
    b.place([0.0; 3], 0.0);
    let rug = b.paint(Pattern::Rug, [52, 70, 104], [150, 110, 50], 1.0);
    b.begin();
    b.block(Kind::rug, rug, [-1.25, -1.15, 0.0], [1.35, 0.62, 0.012]);
    b.place([0.05, -0.25, 0.012], -8.0);
    table(b, white, black, [1.30, 0.80, 0.72]);
    let laptop = b.paint(Pattern::Keys, [120, 122, 126], [40, 40, 44], 1.0);
    b.begin();
    b.block(Kind::monitor, laptop, [-0.42, -0.18, 0.7201], [-0.10, 0.04, 0.736]);
    let screen = b.paint(Pattern::Screen, BLACK, BLACK, 1.0);
    b.set_glow(screen, 0.45);
    b.tilted(Kind::monitor, screen, [-0.26, 0.09, 0.84], [0.16, 0.006, 0.105], pitch(-18.0));
    cup(b, [0.30, -0.20, 0.72], [60, 120, 170]);
    cup(b, [0.44, 0.12, 0.72], [200, 140, 50]);
    book_stack(b, [0.12, 0.18, 0.72], 3);
    for (at, degrees) in [
        ([-0.35, -0.95, 0.012], 174.0),
        ([0.45, -0.92, 0.012], 195.0),
        ([0.98, -0.30, 0.012], 262.0),
    ] {
        b.place(at, degrees);
        chair(b, beech, blue);
    }

    let way = vec![
        ([1.05, -0.25, 1.46], [-1.60, 1.10, 0.85]),
        ([0.80, -0.72, 1.40], [-0.60, 1.80, 0.90]),
        ([0.15, -0.95, 1.44], [0.50, 1.95, 0.95]),
        ([-0.60, -0.85, 1.50], [1.60, 1.60, 0.90]),
        ([-1.10, -0.35, 1.46], [2.30, 0.60, 0.95]),
        ([-1.15, 0.25, 1.40], [2.20, -0.90, 0.85]),
        ([-0.70, 0.55, 1.42], [1.30, -1.90, 0.80]),
        ([0.00, 0.62, 1.48], [-0.10, -2.00, 0.95]),
        ([0.65, 0.50, 1.46], [-1.50, -1.50, 0.85]),
        ([1.05, 0.15, 1.42], [-2.30, 0.00, 0.85]),
    ];
    (shell, way)
}
