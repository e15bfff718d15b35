//! Furniture, each piece relative to the builder's placement: x to the right, y to the back
//! (towards the wall), z up, the origin on the floor under the middle unless said otherwise.
use super::{
    builder::{Builder, bulb, pitch, yaw},
    classes::Kind,
    light::Light,
    texture::Pattern,
};
use glam::{Mat3, Vec3};

pub const BLACK: [u8; 3] = [30, 30, 34];
const STEEL: [u8; 3] = [150, 154, 160];

/// Cloth and paper covers of books.
const COVERS: [[u8; 3]; 14] = [
    [122, 44, 40],
    [158, 72, 48],
    [186, 128, 60],
    [206, 184, 132],
    [92, 104, 58],
    [52, 84, 64],
    [60, 104, 112],
    [48, 68, 104],
    [82, 110, 146],
    [96, 64, 96],
    [66, 52, 46],
    [190, 186, 176],
    [46, 48, 54],
    [170, 92, 96],
];

/// Returns a colour close to `color`.
fn tint(b: &mut Builder, color: [u8; 3]) -> [u8; 3] {
    color.map(|c| (f32::from(c) * b.rng.range(0.85, 1.2)) as u8)
}

/// A table with four legs.
pub fn table(b: &mut Builder, top: u16, legs: u16, size: [f32; 3]) {
    b.begin();
    let [x, y, h] = [0.5 * size[0], 0.5 * size[1], size[2]];
    b.block(Kind::table, top, [-x, -y, h - 0.035], [x, y, h]);
    b.block(
        Kind::table,
        legs,
        [-x + 0.07, -y + 0.05, h - 0.11],
        [x - 0.07, -y + 0.075, h - 0.0351],
    );
    b.block(Kind::table, legs, [-x + 0.07, y - 0.075, h - 0.11], [x - 0.07, y - 0.05, h - 0.0351]);
    for (i, j) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        b.cone(
            Kind::table,
            legs,
            [i * (x - 0.06), j * (y - 0.06), 0.0],
            [0.024, 0.034],
            h - 0.0351,
        );
    }
}

/// A wooden chair, its back at +y.
pub fn chair(b: &mut Builder, wood: u16, seat: u16) {
    b.begin();
    b.block(Kind::chair, seat, [-0.21, -0.21, 0.435], [0.21, 0.21, 0.475]);
    for (x, y, h) in
        [(-0.19, -0.19, 0.4349), (0.19, -0.19, 0.4349), (-0.19, 0.19, 0.92), (0.19, 0.19, 0.92)]
    {
        b.block(Kind::chair, wood, [x - 0.018, y - 0.018, 0.0], [x + 0.018, y + 0.018, h]);
    }
    for z in [0.56, 0.69, 0.82] {
        b.block(Kind::chair, wood, [-0.1719, 0.178, z], [0.1719, 0.2, z + 0.075]);
    }
    b.block(Kind::chair, wood, [-0.1719, -0.198, 0.2], [0.1719, -0.182, 0.23]);
}

/// A desk chair on castors, its back at +y.
pub fn office_chair(b: &mut Builder, cloth: u16, metal: u16) {
    b.begin();
    for i in 0..5 {
        let turn = yaw(72.0 * i as f32 + 20.0);
        let c = turn * Vec3::new(0.14, 0.0, 0.09);
        b.tilted(Kind::chair, metal, c.to_array(), [0.14, 0.02, 0.016], turn);
        let w = turn * Vec3::new(0.27, 0.0, 0.036);
        b.ellipsoid(Kind::chair, metal, w.to_array(), [0.035; 3], Mat3::IDENTITY);
    }
    b.cone(Kind::chair, metal, [0.0, 0.0, 0.08], [0.03, 0.025], 0.34);
    b.block(Kind::chair, cloth, [-0.24, -0.24, 0.42], [0.24, 0.22, 0.49]);
    b.tilted(Kind::chair, cloth, [0.0, 0.25, 0.78], [0.22, 0.03, 0.22], pitch(-8.0));
    b.block(Kind::chair, metal, [-0.03, 0.222, 0.44], [0.03, 0.25, 0.62]);
    for x in [-0.27, 0.27] {
        b.block(Kind::chair, metal, [x - 0.02, -0.12, 0.64], [x + 0.02, 0.14, 0.665]);
        b.block(Kind::chair, metal, [x - 0.012, -0.02, 0.45], [x + 0.012, 0.02, 0.6399]);
    }
}

/// A sofa against a wall at y = 0.44, `width` wide, with cushions.
pub fn sofa(b: &mut Builder, cloth: u16, width: f32, cushions: &[u16]) {
    b.begin();
    let w = 0.5 * width;
    let dark = b.paint(Pattern::Wood, [60, 40, 28], [90, 62, 40], 1.5);
    b.block(Kind::sofa, cloth, [-w, -0.42, 0.09], [w, 0.42, 0.28]);
    b.tilted(Kind::sofa, cloth, [0.0, 0.33, 0.50], [w - 0.005, 0.10, 0.30], pitch(-9.0));
    for s in [-1.0f32, 1.0] {
        b.block(
            Kind::sofa,
            cloth,
            [s * w - 0.09 - s * 0.088, -0.43, 0.2],
            [s * w + 0.09 - s * 0.088, 0.41, 0.6],
        );
        for y in [-0.36, 0.36] {
            b.cone(Kind::sofa, dark, [s * (w - 0.08), y, 0.0], [0.02, 0.03], 0.0899);
        }
    }
    let seats = if width > 1.7 { 3 } else { 2 };
    let each = (2.0 * w - 0.37) / seats as f32;
    for i in 0..seats {
        let x = -w + 0.185 + each * i as f32;
        b.block(Kind::sofa, cloth, [x + 0.006, -0.44, 0.2801], [x + each - 0.006, 0.2, 0.43]);
    }
    for (i, &paint) in cushions.iter().enumerate() {
        let part = if cushions.len() > 1 { i as f32 / (cushions.len() - 1) as f32 } else { 0.2 };
        let x = (w - 0.42) * (2.0 * part - 1.0) + b.rng.range(-0.04, 0.04);
        let roll = b.rng.range(-18.0, 18.0);
        let turn = yaw(roll) * pitch(-24.0);
        b.begin();
        b.ellipsoid(Kind::cushion, paint, [x, 0.10, 0.62], [0.235, 0.10, 0.215], turn);
    }
}

/// A row of books standing from `x` to `end` at depth `y`..., on a board at `z`.
pub fn books(b: &mut Builder, range: [f32; 2], front: f32, z: f32, tall: f32) {
    let inks = [[215, 200, 150], [235, 235, 235], [25, 25, 25], [200, 160, 60]];
    let mut x = range[0];
    loop {
        let w = b.rng.range(0.022, 0.058);
        if x + w > range[1] {
            return;
        }
        let h = tall * b.rng.range(0.72, 1.0);
        let depth = b.rng.range(0.14, 0.19);
        let inset = b.rng.range(0.0, 0.025);
        let cover = b.rng.pick(&COVERS);
        let ink = b.rng.pick(&inks);
        let cover = tint(b, cover);
        let paint = b.paint(Pattern::Spine, cover, ink, 1.0);
        b.begin();
        b.block(
            Kind::book,
            paint,
            [x, front + inset, z],
            [x + w - 0.002, front + inset + depth, z + h],
        );
        x += w;
        if b.rng.next().is_multiple_of(9) {
            x += b.rng.range(0.04, 0.12);
        }
    }
}

/// Books lying on each other.
pub fn book_stack(b: &mut Builder, at: [f32; 3], count: usize) {
    let mut z = at[2];
    for _ in 0..count {
        let h = b.rng.range(0.02, 0.045);
        let cover = b.rng.pick(&COVERS);
        let cover = tint(b, cover);
        let paint = b.paint(Pattern::Spine, cover, [235, 225, 200], 1.0);
        let turn = yaw(b.rng.range(-25.0, 25.0));
        let half = [b.rng.range(0.10, 0.13), b.rng.range(0.075, 0.095), 0.5 * h];
        b.begin();
        b.tilted(Kind::book, paint, [at[0], at[1], z + 0.5 * h], half, turn);
        z += h + 0.0005;
    }
}

/// A bookcase against a wall at y = depth / 2.
pub fn bookcase(b: &mut Builder, wood: u16, size: [f32; 3], boards: usize) {
    let [x, d, h] = [0.5 * size[0], 0.5 * size[1], size[2]];
    let back = b.paint(Pattern::Wood, [110, 80, 52], [138, 104, 70], 1.0);
    let case = b.begin();
    b.block(Kind::shelf, back, [-x, d - 0.012, 0.0], [x, d, h]);
    for s in [-1.0f32, 1.0] {
        b.block(
            Kind::shelf,
            wood,
            [s * x - 0.012 - s * 0.012, -d, 0.0],
            [s * x + 0.012 - s * 0.012, d - 0.0121, h],
        );
    }
    let pitch_z = (h - 0.1) / boards as f32;
    for i in 0..=boards {
        let z = 0.05 + pitch_z * i as f32;
        b.go_on(case);
        b.block(
            Kind::shelf,
            wood,
            [-x + 0.0241, -d + 0.004, z - 0.012],
            [x - 0.0241, d - 0.0121, z + 0.012],
        );
        if i < boards {
            let room = (pitch_z - 0.05).min(0.31);
            let end = if i % 2 == 0 { x - 0.03 } else { x * b.rng.range(0.2, 0.6) };
            books(b, [-x + 0.028, end], -d + 0.02, z + 0.0125, room);
            if i % 2 == 1 {
                let free = 0.5 * (end + x);
                if i == 1 {
                    vase(b, [free, 0.0, z + 0.0125], 0.6, [60, 110, 160]);
                } else {
                    book_stack(b, [free, -0.02, z + 0.0125], 3);
                }
            }
        }
    }
}

/// A low cabinet with doors, against a wall at y = depth / 2.
pub fn cabinet(b: &mut Builder, wood: u16, front: u16, size: [f32; 3], doors: usize) {
    b.begin();
    let [x, d, h] = [0.5 * size[0], 0.5 * size[1], size[2]];
    let knob = b.paint(Pattern::Plain, STEEL, STEEL, 4.0);
    b.block(Kind::cabinet, wood, [-x + 0.03, -d + 0.04, 0.0], [x - 0.03, d, 0.0799]);
    b.block(Kind::cabinet, wood, [-x, -d + 0.02, 0.08], [x, d, h - 0.0301]);
    b.block(Kind::cabinet, wood, [-x - 0.015, -d, h - 0.03], [x + 0.015, d, h]);
    let w = 2.0 * x / doors as f32;
    for i in 0..doors {
        let left = -x + w * i as f32;
        b.block(
            Kind::cabinet,
            front,
            [left + 0.006, -d, 0.09],
            [left + w - 0.006, -d + 0.0199, h - 0.04],
        );
        let side = if i % 2 == 0 { left + w - 0.05 } else { left + 0.05 };
        b.ellipsoid(
            Kind::cabinet,
            knob,
            [side, -d - 0.012, h * 0.62],
            [0.014, 0.016, 0.014],
            Mat3::IDENTITY,
        );
    }
}

/// A lamp on the floor.
pub fn floor_lamp(b: &mut Builder) {
    b.begin();
    let metal = b.paint(Pattern::Plain, BLACK, BLACK, 3.0);
    let shade = b.glowing([250, 225, 180], 1.1);
    b.cone(Kind::lamp, metal, [0.0; 3], [0.15, 0.13], 0.025);
    b.cone(Kind::lamp, metal, [0.0, 0.0, 0.0251], [0.013, 0.013], 1.38);
    b.cone(Kind::lamp, shade, [0.0, 0.0, 1.36], [0.22, 0.14], 0.28);
}

/// A lamp for a table top at `at`.
pub fn table_lamp(b: &mut Builder, at: [f32; 3], body: [u8; 3]) {
    b.begin();
    let [x, y, z] = at;
    let ceramic = b.paint(Pattern::Zigzag, body, [235, 230, 220], 26.0);
    let shade = b.glowing([248, 232, 200], 0.9);
    b.cone(Kind::lamp, ceramic, [x, y, z], [0.05, 0.08], 0.09);
    b.cone(Kind::lamp, ceramic, [x, y, z + 0.09], [0.08, 0.03], 0.11);
    b.cone(Kind::lamp, ceramic, [x, y, z + 0.2], [0.012, 0.012], 0.05);
    b.cone(Kind::lamp, shade, [x, y, z + 0.24], [0.14, 0.09], 0.17);
}

/// A lamp that hangs from a ceiling at `height`, and the light it gives.
pub fn pendant(b: &mut Builder, height: f32, drop: f32, power: Vec3) {
    b.begin();
    let metal = b.paint(Pattern::Plain, BLACK, BLACK, 3.0);
    let shade = b.paint(Pattern::Stripes, [235, 190, 120], [200, 120, 60], 28.0);
    b.set_glow(shade, 0.8);
    b.cone(Kind::lamp, metal, [0.0, 0.0, height - 0.03], [0.05, 0.06], 0.0299);
    b.cone(Kind::lamp, metal, [0.0, 0.0, height - drop], [0.008, 0.008], drop - 0.0301);
    b.cone(Kind::lamp, shade, [0.0, 0.0, height - drop - 0.16], [0.24, 0.10], 0.17);
    let centre = b.world([0.0, 0.0, height - drop - 0.1]);
    b.lights.push(bulb(centre, 0.40, power));
}

/// A vase.
pub fn vase(b: &mut Builder, at: [f32; 3], k: f32, color: [u8; 3]) {
    b.begin();
    let [x, y, z] = at;
    let glaze = b.paint(Pattern::Zigzag, color, [225, 215, 190], 20.0 / k);
    b.cone(Kind::vase, glaze, [x, y, z], [0.05 * k, 0.10 * k], 0.12 * k);
    b.cone(Kind::vase, glaze, [x, y, z + 0.12 * k], [0.10 * k, 0.045 * k], 0.12 * k);
    b.cone(Kind::vase, glaze, [x, y, z + 0.24 * k], [0.045 * k, 0.06 * k], 0.06 * k);
}

/// Flowers or twigs from a point upwards.
pub fn bouquet(b: &mut Builder, at: [f32; 3], reach: f32, count: usize, bloom: [u8; 3]) {
    b.begin();
    let stem = b.paint(Pattern::Leaf, [50, 95, 40], [90, 130, 60], 1.0);
    let petal = b.paint(Pattern::Leaf, bloom, [250, 235, 210], 1.0);
    for i in 0..count {
        let turn =
            yaw(i as f32 * 137.5 + b.rng.range(-20.0, 20.0)) * pitch(b.rng.range(10.0, 38.0));
        let c = Vec3::from(at) + turn * Vec3::new(0.0, 0.0, 0.5 * reach);
        b.leaning_cone(Kind::plant, stem, c.to_array(), [0.004, 0.004], reach, turn);
        let tip = Vec3::from(at) + turn * Vec3::new(0.0, 0.0, reach + 0.01);
        b.ellipsoid(Kind::plant, petal, tip.to_array(), [0.032, 0.032, 0.02], turn);
    }
}

/// A potted plant with broad leaves.
pub fn plant(b: &mut Builder, at: [f32; 3], k: f32, leaves: usize) {
    b.begin();
    let [x, y, z] = at;
    let clay = b.paint(Pattern::Zigzag, [170, 90, 60], [190, 120, 85], 14.0 / k);
    let soil = b.paint(Pattern::Stucco, [60, 45, 35], [60, 45, 35], 1.0);
    let green = [
        b.paint(Pattern::Leaf, [40, 90, 45], [105, 150, 75], 1.0),
        b.paint(Pattern::Leaf, [60, 110, 50], [140, 170, 80], 1.0),
        b.paint(Pattern::Leaf, [30, 75, 50], [85, 125, 85], 1.0),
    ];
    b.cone(Kind::plant, clay, [x, y, z], [0.13 * k, 0.18 * k], 0.30 * k);
    b.cone(Kind::plant, soil, [x, y, z + 0.3001 * k], [0.165 * k, 0.165 * k], 0.004);
    for i in 0..leaves {
        let paint = b.rng.pick(&green);
        let level = i as f32 / leaves as f32;
        let turn = yaw(i as f32 * 137.5) * pitch(72.0 - 55.0 * level + b.rng.range(-8.0, 8.0));
        let root = Vec3::new(x, y, z + (0.34 + 0.38 * level) * k);
        let length = (0.30 - 0.10 * level) * k;
        let c = root + turn * Vec3::new(0.0, 0.0, length);
        b.ellipsoid(Kind::plant, paint, c.to_array(), [0.085 * k, 0.014 * k, length * 0.8], turn);
        let s = root + turn * Vec3::new(0.0, 0.0, 0.3 * length);
        b.leaning_cone(
            Kind::plant,
            paint,
            s.to_array(),
            [0.006 * k, 0.006 * k],
            length * 0.9,
            turn,
        );
    }
    b.cone(Kind::plant, green[2], [x, y, z + 0.30 * k], [0.016 * k, 0.01 * k], 0.42 * k);
}

/// A cup with a handle.
pub fn cup(b: &mut Builder, at: [f32; 3], color: [u8; 3]) {
    b.begin();
    let [x, y, z] = at;
    let glaze = b.paint(Pattern::Stripes, color, [240, 235, 225], 45.0);
    let coffee = b.paint(Pattern::Plain, [70, 42, 25], [70, 42, 25], 9.0);
    b.cone(Kind::cup, glaze, [x, y, z], [0.034, 0.044], 0.095).material[5] = coffee;
    b.block(Kind::cup, glaze, [x + 0.038, y - 0.007, z + 0.025], [x + 0.072, y + 0.007, z + 0.036]);
    b.block(
        Kind::cup,
        glaze,
        [x + 0.061, y - 0.007, z + 0.0361],
        [x + 0.072, y + 0.007, z + 0.072],
    );
    b.block(
        Kind::cup,
        glaze,
        [x + 0.038, y - 0.007, z + 0.0721],
        [x + 0.072, y + 0.007, z + 0.083],
    );
}

/// A framed painting on a wall at y = 0, centred at (x, z).
pub fn picture(b: &mut Builder, centre: [f32; 2], size: [f32; 2]) {
    b.begin();
    let [x, z] = centre;
    let [w, h] = [0.5 * size[0], 0.5 * size[1]];
    let dark = b.rng.pick(&[[40, 32, 28], [120, 84, 48], [196, 168, 110], [225, 222, 214]]);
    let frame = b.paint(Pattern::Wood, dark, dark.map(|c| c / 2 + 30), 3.0);
    let art = b.paint(Pattern::Painting, [232, 226, 210], [232, 226, 210], 1.0);
    let f = 0.028;
    b.block(Kind::picture, frame, [x - w, -0.03, z - h], [x + w, -0.002, z - h + f]);
    b.block(Kind::picture, frame, [x - w, -0.03, z + h - f], [x + w, -0.002, z + h]);
    b.block(
        Kind::picture,
        frame,
        [x - w, -0.03, z - h + f + 1e-4],
        [x - w + f, -0.002, z + h - f - 1e-4],
    );
    b.block(
        Kind::picture,
        frame,
        [x + w - f, -0.03, z - h + f + 1e-4],
        [x + w, -0.002, z + h - f - 1e-4],
    );
    b.block(Kind::picture, art, [x - w + f, -0.015, z - h + f], [x + w - f, -0.0021, z + h - f]);
}

/// A screen on a stand, on a top at `at`, `width` wide.
pub fn monitor(b: &mut Builder, at: [f32; 3], width: f32, degrees: f32) {
    b.begin();
    let black = b.paint(Pattern::Plain, BLACK, BLACK, 3.0);
    let screen = b.paint(Pattern::Screen, BLACK, BLACK, 1.0);
    b.set_glow(screen, 0.45);
    let turn = yaw(degrees);
    let h = 0.29 * width;
    let [x, y, z] = at;
    let from = |c: Vec3| (Vec3::new(x, y, z) + turn * c).to_array();
    b.tilted(Kind::monitor, black, from(Vec3::new(0.0, 0.02, 0.008)), [0.13, 0.09, 0.008], turn);
    b.tilted(
        Kind::monitor,
        black,
        from(Vec3::new(0.0, 0.05, 0.016 + 0.08)),
        [0.025, 0.012, 0.08],
        turn,
    );
    let panel = from(Vec3::new(0.0, 0.02, 0.11 + h));
    b.tilted(Kind::monitor, black, panel, [0.5 * width, 0.017, h], turn).material[2] = screen;
}

/// A window in a wall at y = 0 with a sill, and the daylight it lets in.
pub fn window(b: &mut Builder, centre: [f32; 2], size: [f32; 2], power: Vec3) {
    b.begin();
    let [x, z] = centre;
    let [w, h] = [0.5 * size[0], 0.5 * size[1]];
    let white = b.paint(Pattern::Wood, [222, 220, 212], [205, 202, 192], 2.0);
    let view = b.paint(Pattern::Outside, [200; 3], [200; 3], 1.0);
    b.set_glow(view, 0.75);
    b.block(Kind::window, view, [x - w, -0.012, z - h], [x + w, -0.0005, z + h]);
    let f = 0.045;
    for s in [-1.0f32, 0.0, 1.0] {
        let c = x + s * (w + 0.5 * f);
        b.block(Kind::window, white, [c - 0.5 * f, -0.05, z - h], [c + 0.5 * f, -0.001, z + h]);
    }
    for s in [-1.0f32, 1.0] {
        let c = z + s * (h + 0.5 * f);
        b.block(
            Kind::window,
            white,
            [x - w - f, -0.055, c - 0.5 * f + 1e-4],
            [x + w + f, -0.001, c + 0.5 * f - 1e-4],
        );
    }
    let bar = z + 0.35 * h;
    b.block(
        Kind::window,
        white,
        [x - w + 1e-4, -0.04, bar - 0.015],
        [x + w - 1e-4, -0.0011, bar + 0.015],
    );
    b.block(
        Kind::window,
        white,
        [x - w - 0.1, -0.17, z - h - f - 0.03],
        [x + w + 0.1, -0.0012, z - h - f],
    );
    let mut points = alloc::vec::Vec::new();
    for i in 0..3 {
        for j in 0..3 {
            let (p, q) = ((i as f32 - 1.0) * 0.62 * w, (j as f32 - 1.0) * 0.62 * h);
            points.push(b.world([x + p, -0.07, z + q]));
        }
    }
    let facing = b.world_direction(-Vec3::Y);
    b.lights.push(Light { points, facing, power });
}

/// A curtain as a row of folds in front of a wall at y = 0.
pub fn curtain(b: &mut Builder, range: [f32; 2], z: [f32; 2], cloth: u16) {
    b.begin();
    let folds = ((range[1] - range[0]) / 0.075) as usize;
    let step = (range[1] - range[0]) / folds as f32;
    for i in 0..folds {
        let x = range[0] + step * (i as f32 + 0.5);
        let y = if i % 2 == 0 { -0.10 } else { -0.115 };
        let r = 0.5 * step + 0.006;
        b.cone(Kind::curtain, cloth, [x, y, z[0]], [r, r * 0.9], z[1] - z[0]);
    }
}

/// A door in a wall at y = 0, centred at x.
pub fn door(b: &mut Builder, x: f32, leaf: u16, frame: u16) {
    b.begin();
    let w = 0.43;
    b.block(Kind::door, leaf, [x - w, -0.03, 0.006], [x + w, -0.001, 2.02]);
    for s in [-1.0f32, 1.0] {
        let c = x + s * (w + 0.04);
        b.block(Kind::door, frame, [c - 0.04, -0.05, 0.0], [c + 0.04, -0.0011, 2.1]);
    }
    b.block(Kind::door, frame, [x - w + 1e-4, -0.05, 2.0201], [x + w - 1e-4, -0.0012, 2.1]);
    let steel = b.paint(Pattern::Plain, STEEL, STEEL, 4.0);
    b.block(Kind::door, steel, [x + w - 0.09, -0.036, 0.95], [x + w - 0.05, -0.0301, 1.15]);
    b.block(Kind::door, steel, [x + w - 0.18, -0.075, 1.06], [x + w - 0.06, -0.055, 1.085]);
    b.block(Kind::door, steel, [x + w - 0.08, -0.0549, 1.063], [x + w - 0.06, -0.0361, 1.082]);
}

/// A skirting board along a wall at y = 0 from `range[0]` to `range[1]`.
pub fn skirting(b: &mut Builder, range: [f32; 2], paint: u16) {
    b.begin();
    b.block(Kind::wall, paint, [range[0], -0.016, 0.0], [range[1], -0.0005, 0.085]);
}
