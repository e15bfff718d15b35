//! Rooms drawn from a seed: size, paints, light and furniture differ from room to room. They are
//! for training and for tests with layouts that no built-in scene has.
use super::plan::{Plan, Wall, chance, shade};
use crate::{
    builder::{Builder, pitch, shell},
    classes::Kind,
    furniture::*,
    shape::Primitive,
    texture::Pattern,
};
use glam::{Mat3, Vec3};

/// A furnished room without a camera.
pub struct Room {
    /// Its walls, floor and ceiling.
    pub shell: Primitive,
    /// Light from everywhere, relative to a white surface.
    pub ambient: f32,
}

/// Paints that several pieces of a room share.
struct Paints {
    woods: [u16; 3],
    metal: u16,
    cloths: [u16; 3],
    pale: u16,
}

const WOODS: [[u8; 3]; 7] = [
    [150, 104, 62],
    [78, 50, 34],
    [186, 150, 104],
    [128, 88, 54],
    [104, 62, 40],
    [214, 208, 198],
    [96, 92, 90],
];

/// Returns a colour around a brightness, grey to fairly saturated.
fn color(b: &mut Builder, low: f32, high: f32) -> [u8; 3] {
    let bright = b.rng.range(low, high);
    let strong = b.rng.range(0.0, 0.65);
    [0; 3].map(|_: u8| (bright * (1.0 - strong * b.rng.range(0.0, 1.0))) as u8)
}

fn wood(b: &mut Builder) -> u16 {
    let tone = b.rng.pick(&WOODS);
    let tone = shade(b, tone, 0.85, 1.15);
    let scale = b.rng.range(0.8, 1.6);
    b.paint(Pattern::Wood, tone, tone.map(|c| c.saturating_add(40)), scale)
}

fn cloth(b: &mut Builder) -> u16 {
    let tone = color(b, 70.0, 190.0);
    let second = shade(b, tone, 1.2, 1.5);
    let scale = b.rng.range(0.7, 1.3);
    b.paint(Pattern::Fabric, tone, second, scale)
}

fn wall_paint(b: &mut Builder) -> u16 {
    let tone = color(b, 120.0, 225.0);
    match b.rng.next() % 8 {
        0..=2 => {
            let (dark, scale) = (shade(b, tone, 0.68, 0.9), b.rng.range(0.7, 1.2));
            b.paint(Pattern::Wallpaper, tone, dark, scale)
        }
        3 | 4 => b.paint(Pattern::Stucco, tone, tone, 1.0),
        5 => b.paint(Pattern::Plain, tone, tone, 1.0),
        6 => {
            let stone = b.rng.pick(&[[160, 94, 72], [186, 182, 174], [120, 110, 104]]);
            let stone = shade(b, stone, 0.85, 1.15);
            let mortar = color(b, 130.0, 190.0);
            b.paint(Pattern::Brick, stone, mortar, 1.0)
        }
        _ => {
            let tone = b.rng.pick(&WOODS);
            b.paint(Pattern::Planks, tone, tone.map(|c| c.saturating_add(34)), 1.0)
        }
    }
}

fn floor_paint(b: &mut Builder) -> u16 {
    let tone = color(b, 70.0, 200.0);
    let other = shade(b, tone, 0.75, 1.3);
    let scale = b.rng.range(1.0, 2.6);
    match b.rng.next() % 8 {
        0..=3 => {
            let tone = b.rng.pick(&WOODS[..5]);
            let tone = shade(b, tone, 0.85, 1.2);
            b.paint(Pattern::Planks, tone, tone.map(|c| c.saturating_add(44)), 0.4 * scale)
        }
        4 | 5 => b.paint(Pattern::Tiles, tone, other, scale),
        6 => b.paint(Pattern::Fabric, tone, other, 1.0),
        _ => b.paint(Pattern::Checks, tone, other, scale),
    }
}

fn ceiling_paint(b: &mut Builder) -> u16 {
    let bright = b.rng.range(185.0, 228.0);
    let tone = [bright, bright * b.rng.range(0.95, 1.0), bright * b.rng.range(0.88, 1.0)];
    let tone = tone.map(|c| c as u8);
    let pattern = b.rng.pick(&[Pattern::Stucco, Pattern::Stucco, Pattern::Tiles, Pattern::Panels]);
    let scale = b.rng.range(1.0, 2.0);
    b.paint(pattern, tone, tone.map(|c| c - 14), scale)
}

/// Paint of cabinet fronts and doors.
fn front_paint(b: &mut Builder, panels: f32) -> u16 {
    let tone = if chance(b, 0.5) { color(b, 60.0, 200.0) } else { b.rng.pick(&WOODS) };
    b.paint(Pattern::Panels, tone, tone.map(|c| c.saturating_add(22)), panels)
}

/// Small things on a top of half size `x`, `y` at height `z`, from left to right.
fn clutter(b: &mut Builder, [x, y]: [f32; 2], z: f32, crowded: f32) {
    let mut at = -x + 0.16;
    while at < x - 0.14 {
        if !chance(b, crowded) {
            at += 0.25;
            continue;
        }
        let depth = b.rng.range(-1.0, 1.0) * (y - 0.14).max(0.02);
        let tone = color(b, 60.0, 220.0);
        match b.rng.next() % 9 {
            0 | 1 => cup(b, [at, depth, z], tone),
            2 | 3 => {
                let count = 1 + b.rng.next() as usize % 5;
                book_stack(b, [at, depth, z], count);
            }
            4 | 5 => {
                let k = b.rng.range(0.6, 1.3);
                vase(b, [at, depth, z], k, tone);
                if chance(b, 0.7) {
                    let (reach, bloom) = (b.rng.range(0.16, 0.32), color(b, 150.0, 250.0));
                    let count = 6 + b.rng.next() as usize % 6;
                    bouquet(b, [at, depth, z + 0.24 * k], reach, count, bloom);
                }
            }
            6 => {
                let k = b.rng.range(0.28, 0.55);
                plant(b, [at, depth, z], k, 12);
            }
            7 => table_lamp(b, [at, depth, z], tone),
            _ => {
                if at + 0.5 < x {
                    at += 0.22;
                    let (width, turn) = (b.rng.range(0.4, 0.6), b.rng.range(-15.0, 15.0));
                    monitor(b, [at, 0.0, z], width, turn);
                    at += 0.12;
                }
            }
        }
        at += b.rng.range(0.2, 0.45);
    }
}

/// A keyboard or an open portable computer in front of what else is on a desk.
fn keyboard(b: &mut Builder, x: f32, z: f32) {
    let tone = b.rng.pick(&[[42, 42, 46], [120, 122, 126], [200, 200, 204]]);
    let keys = b.paint(Pattern::Keys, tone, tone.map(|c| 255 - c), 1.0);
    b.block(Kind::monitor, keys, [x - 0.22, -0.24, z + 1e-4], [x + 0.22, -0.1, z + 0.017]);
}

fn laptop(b: &mut Builder, [x, y]: [f32; 2], z: f32) {
    let keys = b.paint(Pattern::Keys, [120, 122, 126], [40, 40, 44], 1.0);
    b.block(Kind::monitor, keys, [x - 0.16, y - 0.15, z + 1e-4], [x + 0.16, y + 0.07, z + 0.016]);
    let screen = b.paint(Pattern::Screen, BLACK, BLACK, 1.0);
    b.set_glow(screen, 0.45);
    let turn = pitch(b.rng.range(-24.0, -12.0));
    b.tilted(Kind::monitor, screen, [x, y + 0.12, z + 0.12], [0.16, 0.006, 0.105], turn);
}

/// A desk with screens, and a chair before it.
fn desk(b: &mut Builder, paints: &Paints, [w, d, h]: [f32; 3]) {
    let (top, legs) = (b.rng.pick(&paints.woods), b.rng.pick(&paints.woods));
    let (origin, degrees) = b.placement();
    let legs = if chance(b, 0.5) { legs } else { paints.metal };
    table(b, top, legs, [w, d, h]);
    let screens = b.rng.next() % 4;
    if screens == 0 {
        laptop(b, [0.0, -0.02], h);
    } else if screens == 3 && w > 1.3 {
        for side in [-1.0f32, 1.0] {
            monitor(b, [0.3 * side, 0.5 * d - 0.2, h], 0.54, -12.0 * side);
        }
        keyboard(b, 0.0, h);
    } else {
        let (width, turn) = (b.rng.range(0.48, 0.66), b.rng.range(-12.0, 12.0));
        monitor(b, [0.0, 0.5 * d - 0.22, h], width, turn);
        keyboard(b, 0.0, h);
    }
    let tone = color(b, 80.0, 220.0);
    let side = if chance(b, 0.5) { -1.0 } else { 1.0 };
    cup(b, [side * (0.5 * w - 0.2), -0.12, h], tone);
    if chance(b, 0.6) {
        book_stack(b, [-side * (0.5 * w - 0.16), 0.0, h], 3);
    } else {
        table_lamp(b, [-side * (0.5 * w - 0.16), 0.1, h], tone);
    }
    let (aside, turned) = (b.rng.range(-0.2, 0.2), b.rng.range(-35.0, 35.0));
    let at = b.world([aside, -0.5 * d - 0.22, 0.0]);
    b.place(at.to_array(), degrees + 180.0 + turned);
    seat(b, paints, 0.6);
    b.place(origin.to_array(), degrees);
}

fn seat(b: &mut Builder, paints: &Paints, on_castors: f32) {
    let cover = b.rng.pick(&paints.cloths);
    let frame = b.rng.pick(&paints.woods);
    if chance(b, on_castors) {
        office_chair(b, cover, paints.metal);
    } else {
        chair(b, frame, cover);
    }
}

fn couch(b: &mut Builder, paints: &Paints, width: f32) {
    let cover = b.rng.pick(&paints.cloths);
    let mut cushions = [0; 3];
    let count = b.rng.next() as usize % 4;
    for paint in &mut cushions[..count] {
        let pattern = b.rng.pick(&[Pattern::Zigzag, Pattern::Checks, Pattern::Stripes]);
        let (tone, second) = (color(b, 60.0, 210.0), color(b, 180.0, 245.0));
        let scale = b.rng.range(10.0, 22.0);
        *paint = b.paint(pattern, tone, second, scale);
    }
    sofa(b, cover, width, &cushions[..count]);
}

/// A window, mostly with curtains; daylight in `tint`.
fn daylight(b: &mut Builder, plan: &mut Plan, wall: Wall, tint: Vec3) {
    let size = [b.rng.range(0.9, 2.0), b.rng.range(0.9, 1.4)];
    let z = (b.rng.range(1.45, 1.7)).min(plan.height - 0.5 * size[1] - 0.25);
    let (low, high) = (z - 0.5 * size[1] - 0.08, z + 0.5 * size[1] + 0.08);
    let Some(x) = plan.hang(b, wall, size[0] + 1.0, [low, high]) else { return };
    let strength = b.rng.range(3.0, 7.5);
    window(b, [x, z], size, tint * strength);
    if chance(b, 0.75) {
        let drape = cloth(b);
        let foot = if chance(b, 0.4) { 0.03 } else { low - b.rng.range(0.05, 0.3) };
        for side in [-1.0f32, 1.0] {
            let inner = x + side * (0.5 * size[0] + b.rng.range(-0.1, 0.04));
            let outer = x + side * (0.5 * size[0] + b.rng.range(0.3, 0.46));
            let range = [inner.min(outer), inner.max(outer)];
            curtain(b, range, [foot, high + 0.06], drape);
            plan.cover(wall, range, [foot, high]);
        }
        if chance(b, 0.6) {
            let rod = b.paint(Pattern::Plain, [120, 90, 50], [120, 90, 50], 4.0);
            let across = Mat3::from_cols(Vec3::Z, Vec3::Y, -Vec3::X);
            let centre = [x, -0.1, high + 0.08];
            b.leaning_cone(Kind::curtain, rod, centre, [0.014; 2], size[0] + 1.05, across);
        }
    }
}

/// A picture or a board with writing.
fn decorate(b: &mut Builder, plan: &mut Plan, wall: Wall) {
    if chance(b, 0.15) {
        let size = [b.rng.range(1.0, 1.9), b.rng.range(0.8, 1.1)];
        let low = b.rng.range(0.95, 1.15);
        let Some(x) = plan.hang(b, wall, size[0] + 0.06, [low, low + size[1]]) else { return };
        let tone = b.rng.pick(&[[226, 228, 230], [188, 150, 104], [60, 90, 70]]);
        let board = b.paint(Pattern::Whiteboard, tone, tone.map(|c| c / 2 + 20), 1.0);
        let half = 0.5 * size[0];
        b.block(Kind::picture, board, [x - half, -0.025, low], [x + half, -0.001, low + size[1]]);
        return;
    }
    let size = [b.rng.range(0.36, 1.0), b.rng.range(0.36, 0.9)];
    let z = b.rng.range(1.35, 1.75);
    let range = [z - 0.5 * size[1] - 0.04, z + 0.5 * size[1] + 0.04];
    if let Some(x) = plan.hang(b, wall, size[0] + 0.08, range) {
        picture(b, [x, z], size);
    }
}

/// One piece of furniture along a wall, if there is a free place for it.
fn furnish(b: &mut Builder, plan: &mut Plan, wall: Wall, paints: &Paints) {
    match b.rng.next() % 12 {
        0 | 1 => {
            let width = b.rng.range(1.3, 2.2);
            if plan.stand(b, wall, [width + 0.05, 0.95, 0.85], 0.46).is_some() {
                couch(b, paints, width);
            }
        }
        2..=4 => {
            let (w, d) = (b.rng.range(0.7, 1.9), b.rng.range(0.28, 0.36));
            let boards = 2 + b.rng.next() as usize % 4;
            let h = 0.1 + boards as f32 * b.rng.range(0.34, 0.4);
            if plan.stand(b, wall, [w + 0.04, d + 0.04, h + 0.02], 0.5 * d + 0.01).is_some() {
                let board = b.rng.pick(&paints.woods);
                let board = if chance(b, 0.25) { paints.pale } else { board };
                bookcase(b, board, [w, d, h], boards);
            }
        }
        5..=7 => {
            let (w, d) = (b.rng.range(0.7, 2.0), b.rng.range(0.36, 0.5));
            let tall = chance(b, 0.15);
            let h = if tall { b.rng.range(1.5, 2.0) } else { b.rng.range(0.5, 0.95) };
            if plan.stand(b, wall, [w + 0.08, d + 0.04, h], 0.5 * d + 0.01).is_some() {
                let doors = ((w / b.rng.range(0.4, 0.6)) as usize).max(1);
                let (body, panels) = (b.rng.pick(&paints.woods), b.rng.range(1.0, 2.4) as i32);
                let front = front_paint(b, panels as f32);
                cabinet(b, body, front, [w, d, h], doors);
                if !tall {
                    clutter(b, [0.5 * w, 0.5 * d], h, 0.75);
                }
            }
        }
        8 | 9 => {
            let size = [b.rng.range(1.1, 1.6), b.rng.range(0.6, 0.76), b.rng.range(0.71, 0.76)];
            let place = [size[0] + 0.1, size[1] + 0.6, size[2]];
            if plan.stand(b, wall, place, 0.5 * size[1] + 0.06).is_some() {
                desk(b, paints, size);
            }
        }
        10 => {
            if plan.stand(b, wall, [0.5, 0.55, 0.9], 0.3).is_some() {
                let (origin, degrees) = b.placement();
                let turned = b.rng.range(-40.0, 40.0);
                b.place(origin.to_array(), degrees + turned);
                seat(b, paints, 0.15);
            }
        }
        _ => {
            let size = [b.rng.range(0.45, 0.8), b.rng.range(0.4, 0.5), b.rng.range(0.45, 0.75)];
            let place = [size[0] + 0.05, size[1] + 0.05, size[2]];
            if plan.stand(b, wall, place, 0.5 * size[1] + 0.04).is_some() {
                let top = b.rng.pick(&paints.woods);
                table(b, top, top, size);
                clutter(b, [0.5 * size[0], 0.5 * size[1]], size[2], 0.9);
            }
        }
    }
}

/// What stands away from the walls: a table with chairs, a low table, an armchair.
fn fill_middle(b: &mut Builder, plan: &mut Plan, paints: &Paints) {
    let kind = b.rng.next() % 6;
    let (size, around) = match kind {
        0..=3 => ([b.rng.range(0.9, 1.9), b.rng.range(0.75, 1.0), b.rng.range(0.7, 0.76)], 1.1),
        4 => ([b.rng.range(0.7, 1.2), b.rng.range(0.5, 0.8), b.rng.range(0.36, 0.46)], 0.3),
        _ => ([b.rng.range(0.95, 1.5), 0.95, 0.8], 0.1),
    };
    let quarter = b.rng.next() % 4;
    let Some(at) = plan.middle(b, [size[0] + around, size[1] + around], quarter % 2 == 1) else {
        return;
    };
    let degrees = 90.0 * quarter as f32 + b.rng.range(-9.0, 9.0);
    let mut lift = 0.0;
    if chance(b, 0.7) {
        let pattern = if chance(b, 0.75) { Pattern::Rug } else { Pattern::Fabric };
        let (tone, second) = (color(b, 60.0, 190.0), color(b, 60.0, 190.0));
        let rug = b.paint(pattern, tone, second, 1.0);
        let half = [0.5 * size[0] + b.rng.range(0.2, 0.8), 0.5 * size[1] + b.rng.range(0.2, 0.6)];
        b.place([at[0], at[1], 0.0], degrees);
        b.block(Kind::rug, rug, [-half[0], -half[1], 0.0], [half[0], half[1], 0.012]);
        lift = 0.012;
    }
    b.place([at[0], at[1], lift], degrees);
    if kind == 5 {
        couch(b, paints, size[0]);
        return;
    }
    let (top, legs) = (b.rng.pick(&paints.woods), b.rng.pick(&paints.woods));
    table(b, top, legs, size);
    if chance(b, 0.3) {
        let (tone, second) = (color(b, 90.0, 220.0), color(b, 170.0, 240.0));
        let runner = b.paint(Pattern::Checks, tone, second, 9.0);
        let (x, y, z) = (0.18 * size[0], 0.5 * size[1], size[2]);
        b.block(Kind::table, runner, [-x, -y, z + 1e-4], [x, y, z + 3e-3]);
    }
    if chance(b, 0.25) {
        laptop(b, [-0.2, -0.1], size[2]);
    } else {
        clutter(b, [0.5 * size[0], 0.5 * size[1]], size[2] + 3e-3, 0.8);
    }
    if kind < 4 {
        let per_side = if size[0] > 1.5 { 3 } else { 2 };
        for side in [0.0f32, 180.0] {
            for i in 0..per_side {
                if chance(b, 0.2) {
                    continue;
                }
                let along = size[0] / per_side as f32 * (i as f32 - 0.5 * (per_side - 1) as f32);
                b.place([at[0], at[1], lift], degrees + side);
                let away = 0.5 * size[1] + b.rng.range(0.12, 0.34);
                let (aside, turned) = (b.rng.range(-0.05, 0.05), b.rng.range(-14.0, 14.0));
                let p = b.world([along + aside, away, 0.0]);
                b.place(p.to_array(), degrees + side + turned);
                seat(b, paints, 0.1);
            }
        }
    }
}

/// Draws a room.
pub fn build(b: &mut Builder) -> Room {
    let size = [b.rng.range(3.7, 6.4), b.rng.range(3.3, 5.4), b.rng.range(2.35, 3.0)];
    let (x, y, h) = (0.5 * size[0], 0.5 * size[1], size[2]);
    let main = wall_paint(b);
    let mut walls = [main; 4];
    for wall in &mut walls {
        if chance(b, 0.4) {
            *wall = wall_paint(b);
        }
    }
    let (floor, ceiling) = (floor_paint(b), ceiling_paint(b));
    let shell = shell(size, walls, floor, ceiling);
    let dark = color(b, 30.0, 130.0);
    let paints = Paints {
        woods: [wood(b), wood(b), wood(b)],
        metal: b.paint(Pattern::Plain, dark, dark, 3.0),
        cloths: [cloth(b), cloth(b), cloth(b)],
        pale: b.paint(Pattern::Wood, [216, 212, 202], [198, 194, 182], 2.0),
    };

    b.place([0.0; 3], 0.0);
    if chance(b, 0.35) {
        let beam = b.rng.pick(&paints.woods);
        let (half, tall) = (b.rng.range(0.05, 0.1), b.rng.range(0.08, 0.18));
        for i in -1i32..=1 {
            let at = 0.62 * x * i as f32;
            let (low, high) = (at - half, at + half);
            let (y, z) = (y - 1e-3, [h - tall, h - 1e-3]);
            b.block(Kind::ceiling, beam, [low, -y, z[0]], [high, y, z[1]]);
        }
    }
    for _ in 0..1 + b.rng.next() % 2 {
        let at = [b.rng.range(-0.5, 0.5) * x, b.rng.range(-0.5, 0.5) * y, 0.0];
        b.place(at, 0.0);
        let warm = Vec3::new(1.0, b.rng.range(0.84, 0.98), b.rng.range(0.64, 0.94));
        let (drop, power) = (b.rng.range(0.2, 0.45), b.rng.range(1.0, 2.4));
        pendant(b, h, drop, warm * power);
    }

    let mut plan = Plan::new([x, y], h);
    let tint = Vec3::new(b.rng.range(0.86, 1.05), 0.96, b.rng.range(0.82, 1.1));
    let first = b.rng.next() as usize;
    for i in 0..1 + b.rng.next() as usize % 2 {
        let wall = plan.wall(first + i);
        let leaf = front_paint(b, 3.0);
        let frame = if chance(b, 0.6) { paints.pale } else { b.rng.pick(&paints.woods) };
        // Nothing stands in a door's way.
        if let Some(at) = plan.stand(b, wall, [1.05, 0.8, 2.12], 0.0) {
            b.place(wall.origin, wall.degrees);
            door(b, at, leaf, frame);
        }
    }
    for i in 0..1 + b.rng.next() as usize % 3 {
        let wall = plan.wall(first + 1 + i);
        daylight(b, &mut plan, wall, tint);
    }
    if chance(b, 0.7) {
        fill_middle(b, &mut plan, &paints);
    }
    let board = if chance(b, 0.6) { paints.pale } else { b.rng.pick(&paints.woods) };
    for i in 0..4 {
        let wall = plan.wall(first + i);
        b.place(wall.origin, wall.degrees);
        skirting(b, [-wall.half + 0.017, wall.half - 0.017], board);
        for _ in 0..3 + b.rng.next() % 3 {
            furnish(b, &mut plan, wall, &paints);
        }
        for _ in 0..2 + b.rng.next() % 4 {
            decorate(b, &mut plan, wall);
        }
        if chance(b, 0.45) && plan.stand(b, wall, [0.5, 0.5, 1.7], 0.27).is_some() {
            floor_lamp(b);
        }
        if chance(b, 0.55) && plan.stand(b, wall, [0.6, 0.6, 1.3], 0.34).is_some() {
            let (k, leaves) = (b.rng.range(0.8, 1.4), 16 + b.rng.next() as usize % 12);
            plant(b, [0.0; 3], k, leaves);
        }
    }
    for _ in 0..1 + b.rng.next() % 2 {
        fill_middle(b, &mut plan, &paints);
    }
    Room { shell, ambient: b.rng.range(0.38, 0.6) }
}
