//! Procedural paints. Each is a function of the position on a face in metres, the face's size and
//! the footprint of a sample, below which detail fades out; none depends on the view direction.
use super::math::{fbm, floor, fract, hash, hash2, mix, noise, unit};
use glam::Vec3;

/// The patterns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// Paint with faint mottling.
    Plain,
    /// Rough plaster.
    Stucco,
    /// Wood with its grain along the longer side.
    Wood,
    /// Floor boards.
    Planks,
    /// A motif on a staggered grid with pin stripes.
    Wallpaper,
    /// Bricks and mortar.
    Brick,
    /// A chequerboard of `scale` per metre.
    Checks,
    /// Stripes of `scale` per metre along the second coordinate.
    Stripes,
    /// Zigzag bands.
    Zigzag,
    /// A woven carpet with borders and a medallion.
    Rug,
    /// One of several kinds of painting.
    Painting,
    /// The back of a book.
    Spine,
    /// What a computer shows.
    Screen,
    /// The view out of a window.
    Outside,
    /// A door or cabinet front with `scale` panels.
    Panels,
    /// Cloth.
    Fabric,
    /// A leaf.
    Leaf,
    /// Square tiles of `scale` per metre.
    Tiles,
    /// A board with writing and notes.
    Whiteboard,
    /// A keyboard's keys.
    Keys,
}

/// A paint: a pattern in two colours.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// The pattern.
    pub pattern: Pattern,
    /// Main colour, linear.
    pub a: Vec3,
    /// Second colour, linear.
    pub b: Vec3,
    /// Pattern-dependent frequency, 1 where a pattern has a natural size.
    pub scale: f32,
    /// Seed of its noise.
    pub seed: u32,
    /// Light it gives off itself, as an addition to what falls on it.
    pub glow: f32,
}

/// Fuzzy step from 0 to 1 at `x` = 0, as wide as the footprint.
fn step(x: f32, footprint: f32) -> f32 {
    (x / footprint.max(1e-4) + 0.5).clamp(0.0, 1.0)
}

/// 1 within `half` of 0; fades instead of flickering when thinner than the footprint.
fn line(x: f32, half: f32, footprint: f32) -> f32 {
    let w = footprint.max(1e-4);
    ((half - x.abs()) / w + 0.5).clamp(0.0, 1.0) * (2.0 * half / w).min(1.0)
}

/// Triangle wave of period 1 in [0, 1].
fn wave(x: f32) -> f32 {
    (2.0 * fract(x) - 1.0).abs()
}

fn rainbow(h: u32) -> Vec3 {
    let c = |s: u32| 0.08 + 0.62 * unit(hash(h ^ s));
    Vec3::new(c(0x11), c(0x2222), c(0x33_3333))
}

impl Material {
    /// Diffuse colour (linear) at (s, t) metres from the centre of a face of half size `half`.
    pub fn albedo(&self, s: f32, t: f32, half: [f32; 2], fp: f32) -> Vec3 {
        let (a, b, k, seed) = (self.a, self.b, self.scale, self.seed);
        match self.pattern {
            Pattern::Plain => a * (1.0 + 0.16 * fbm(s, t, 5.0 * k, 4, fp, seed)),
            Pattern::Stucco => {
                let n =
                    0.10 * fbm(s, t, 2.0, 3, fp, seed) + 0.20 * fbm(s, t, 16.0, 3, fp, seed ^ 7);
                a * (1.0 + n)
            }
            Pattern::Wood => {
                let (s, t) = if half[1] > half[0] { (t, s) } else { (s, t) };
                self.grain(s, t, fp, seed)
            }
            Pattern::Planks => {
                let width = 0.14;
                let row = floor(t / width);
                let shifted = s / 1.2 + unit(hash2(row, 3, seed)) * 7.0;
                let board = hash2(row, floor(shifted), seed);
                let tone = 0.72 + 0.56 * unit(board);
                let edge_t = (fract(t / width) - 0.5).abs() * width - 0.5 * width;
                let edge_s = ((fract(shifted) - 0.5).abs() - 0.5) * 1.2;
                let gap = line(edge_t, 0.003, fp).max(line(edge_s, 0.003, fp));
                self.grain(s, t, fp, board) * tone * (1.0 - 0.75 * gap)
            }
            Pattern::Wallpaper => self.wallpaper(s, t, fp),
            Pattern::Brick => {
                let (w, h) = (0.23, 0.075);
                let row = floor(t / h);
                let x = s / w + 0.5 * (row & 1) as f32;
                let brick = hash2(row, floor(x), seed);
                let ds = (0.5 - (fract(x) - 0.5).abs()) * w;
                let dt = (0.5 - (fract(t / h) - 0.5).abs()) * h;
                let wobble = 0.002 * noise(s * 40.0, t * 40.0, seed);
                let inside = step(ds.min(dt) - 0.006 + wobble, fp);
                let tone = 0.65 + 0.7 * unit(brick) + 0.30 * fbm(s, t, 25.0, 3, fp, brick);
                mix(b * (1.0 + 0.2 * fbm(s, t, 30.0, 2, fp, seed)), a * tone, inside)
            }
            Pattern::Checks => {
                let soft = (1.0 - fp * k).clamp(0.0, 1.0);
                let f = |x: f32| (step(wave(x * 0.5 * k) - 0.5, 2.0 * fp * k) - 0.5) * 2.0 * soft;
                let m = 0.5 + 0.5 * f(s + 50.0) * f(t + 50.0);
                mix(a, b, m) * (1.0 + 0.15 * fbm(s, t, 14.0, 3, fp, seed))
            }
            Pattern::Stripes => {
                let band = floor(t * k);
                let pick = unit(hash2(band, 0, seed));
                let base = if pick < 0.45 {
                    a
                } else if pick < 0.8 {
                    b
                } else {
                    0.5 * (a + b)
                };
                base * (1.0 + 0.14 * fbm(s, t, 20.0, 3, fp, seed))
            }
            Pattern::Zigzag => {
                let x = (t + 0.35 * wave(s * k) / k) * k * 1.7;
                let m = step(wave(x) - 0.5, 3.0 * fp * k);
                mix(a, b, m) * (1.0 + 0.14 * fbm(s, t, 22.0, 2, fp, seed))
            }
            Pattern::Rug => self.rug(s, t, half, fp),
            Pattern::Painting => self.painting(s, t, half, fp),
            Pattern::Spine => {
                let (s, t, h) =
                    if half[1] > half[0] { (s, t, half) } else { (t, s, [half[1], half[0]]) };
                let y = t / h[1];
                let bands = line(y - 0.82, 0.03, fp / h[1]).max(line(y + 0.78, 0.05, fp / h[1]));
                let title = noise(s * 90.0 + 9.0, t * 110.0, seed) > 0.05;
                let block =
                    step(0.45 - (y - 0.1).abs(), fp / h[1]) * step(0.6 * h[0] - s.abs(), fp);
                let ink = if title { block * (1.0 - 90.0 * fp).clamp(0.3, 1.0) } else { 0.0 };
                let tone = 1.0 + 0.15 * fbm(s, t, 12.0, 3, fp, seed);
                mix(a * tone, b, bands.max(0.85 * ink))
            }
            Pattern::Screen => self.screen(s, t, half, fp),
            Pattern::Outside => {
                let y = t / half[1];
                let sky =
                    mix(Vec3::new(0.75, 0.83, 0.9), Vec3::new(0.30, 0.50, 0.85), y * 0.6 + 0.4);
                let cloud = fbm(s, t * 1.8, 2.2, 4, fp, seed);
                let sky = mix(sky, Vec3::splat(0.95), 1.6 * cloud);
                let ridge = -0.15 + 0.22 * fbm(s, 0.3, 1.6, 4, fp, seed ^ 5) - t;
                let trees = -0.32 + 0.2 * fbm(s, 0.7, 4.0, 4, fp, seed ^ 9) - t;
                let hill = Vec3::new(0.20, 0.30, 0.26) * (1.0 + 0.3 * fbm(s, t, 9.0, 3, fp, seed));
                let leaf =
                    Vec3::new(0.08, 0.20, 0.05) * (1.0 + 0.7 * fbm(s, t, 14.0, 4, fp, seed ^ 2));
                mix(mix(sky, hill, step(ridge, fp)), leaf, step(trees, fp))
            }
            Pattern::Panels => {
                let base = self.grain(t, s, fp, seed);
                let (w, h) = (half[0], half[1]);
                let y = fract((t / h * 0.5 + 0.5) * k);
                let dy = (0.5 - (y - 0.5).abs()) * 2.0 * h / k;
                let d = dy.min(w - s.abs()) - 0.06;
                let mould = line(d, 0.008, fp) * 0.55 + 0.25 * line(d - 0.03, 0.006, fp);
                let tone = 1.0 - mould + 0.10 * step(d - 0.04, fp);
                base * tone
            }
            Pattern::Fabric => {
                let m = 0.5 + 0.9 * fbm(s, t, 22.0 * k, 4, fp, seed);
                let weave = 1.0 + 0.2 * fbm(s, t * 1.7, 110.0, 2, fp, seed ^ 3);
                let folds = 1.0 + 0.14 * fbm(s, t, 3.0, 2, fp, seed ^ 8);
                mix(a, b, m) * weave * folds
            }
            Pattern::Leaf => {
                let vein = fbm(s * 1.0, t * 6.0, 16.0, 3, fp, seed);
                mix(a, b, 0.5 + 0.8 * vein)
            }
            Pattern::Tiles => {
                let (x, y) = (s * k, t * k);
                let tile = unit(hash2(floor(x), floor(y), seed));
                let d = (0.5 - (fract(x) - 0.5).abs()).min(0.5 - (fract(y) - 0.5).abs()) / k;
                let speck = fbm(s, t, 28.0, 3, fp, seed);
                let body = mix(a, b, tile) * (1.0 + 0.22 * speck);
                body * (1.0 - 0.45 * line(d, 0.006, fp))
            }
            Pattern::Whiteboard => self.whiteboard(s, t, half, fp),
            Pattern::Keys => {
                let (x, y) = (s * 50.0, t * 50.0);
                let key =
                    line(fract(x) - 0.5, 0.38, fp * 50.0) * line(fract(y) - 0.5, 0.38, fp * 50.0);
                let rim = step(half[0].min(9.0) - s.abs() - 0.012, fp)
                    * step(half[1] - t.abs() - 0.012, fp);
                mix(a, b * (0.8 + 0.4 * unit(hash2(floor(x), floor(y), seed))), key * rim)
            }
        }
    }

    /// Wood with its grain along s.
    fn grain(&self, s: f32, t: f32, fp: f32, seed: u32) -> Vec3 {
        let k = self.scale;
        let warp = fbm(s * 0.6, t * 3.0, 2.2 * k, 2, fp, seed);
        let rings = wave(t * 9.0 * k + 1.8 * warp);
        let fine = fbm(s * 0.12, t, 60.0 * k, 3, fp, seed ^ 0xF1);
        mix(self.a, self.b, 0.25 + 0.5 * rings + 0.45 * fine)
    }

    fn wallpaper(&self, s: f32, t: f32, fp: f32) -> Vec3 {
        let seed = self.seed;
        let (w, h) = (0.26 / self.scale, 0.34 / self.scale);
        let row = floor(t / h);
        let x = s / w + 0.5 * (row & 1) as f32;
        // Hand-printed: every motif differs a little, as real prints and their wear do.
        let cell = hash2(row, floor(x), seed);
        let (dx, dy) = ((fract(x) - 0.5) * w, (fract(t / h) - 0.5) * h);
        let petal = dx.abs() * 1.3 + dy.abs() * 0.75 + 0.02 * (wave(dx * 18.0) - wave(dy * 14.0));
        let f = fp * 1.2;
        let ring = line(petal - 0.078, 0.012, f).max(line(petal - 0.035, 0.016, f));
        let dot = line(dx.abs() + dy.abs(), 0.012, f).max(line(petal - 0.12, 0.004, f));
        let ink = ring.max(dot) * (0.55 + 0.45 * unit(cell));
        let pin = 0.25 * line(fract(s / w * 2.0 + 0.5) - 0.5, 0.06, fp * 2.0 / w);
        let paper = 1.0
            + 0.10 * fbm(s, t, 1.3, 3, fp, seed ^ 0x77)
            + 0.12 * fbm(s, t, 30.0, 3, fp, seed ^ 0x99);
        mix(self.a, self.b, ink.max(pin)) * paper
    }

    fn rug(&self, s: f32, t: f32, half: [f32; 2], fp: f32) -> Vec3 {
        let (a, b) = (self.a, self.b);
        let edge = (half[0] - s.abs()).min(half[1] - t.abs());
        let cream = Vec3::new(0.62, 0.54, 0.38);
        let dark = Vec3::new(0.05, 0.06, 0.11);
        let cell = 0.16;
        let (x, y) = (fract(s / cell) - 0.5, fract(t / cell) - 0.5);
        let l1 = (x.abs() + y.abs()) * cell;
        let tone = unit(hash2(floor(s / cell), floor(t / cell), self.seed));
        let mut c = mix(a, dark, step(0.060 - l1, fp));
        c = mix(c, if tone < 0.5 { cream } else { b }, step(0.042 - l1, fp));
        c = mix(c, a, step(0.018 - l1, fp));
        // Medallion.
        let m = s.abs() / half[0] * 1.1 + t.abs() / half[1] * 0.9;
        let teeth = 0.05 * wave((s.abs() - t.abs()) * 9.0);
        let g = fp * 2.0;
        c = mix(c, b, step(0.62 + teeth - m, g));
        c = mix(c, cream, step(0.52 + teeth - m, g));
        c = mix(c, dark, step(0.46 - m, g) * step(wave(s * 8.0) + wave(t * 8.0) - 0.9, 10.0 * fp));
        c = mix(c, a, step(0.22 + teeth - m, g));
        // Borders, outermost last.
        let tooth = 0.02 * wave((s + t) * 14.0);
        c = mix(c, dark, step(0.20 - edge, fp));
        c = mix(
            c,
            cream,
            step(0.16 + tooth - edge, fp) * step(wave((s - t) * 6.0) - 0.3, 8.0 * fp),
        );
        c = mix(c, b, step(0.09 - edge, fp));
        c = mix(c, cream, step(0.025 - edge, fp));
        c * (1.0
            + 0.22 * fbm(s, t, 45.0, 2, fp, self.seed)
            + 0.12 * fbm(s, t, 4.0, 2, fp, self.seed ^ 4))
    }

    fn painting(&self, s: f32, t: f32, half: [f32; 2], fp: f32) -> Vec3 {
        let seed = self.seed;
        let (x, y) = (s / half[0], t / half[1]);
        let (c1, c2, c3) = (rainbow(seed), rainbow(seed ^ 0xABC), rainbow(seed ^ 0xDEF0));
        let mat = step(x.abs().max(y.abs()) - 0.88, fp / half[0]);
        let brush = 1.0 + 0.25 * fbm(s, t * 1.5, 26.0, 3, fp, seed);
        let picture = match seed % 4 {
            // A landscape in layers.
            0 => {
                let mut c = mix(c1 + 0.2, Vec3::new(0.8, 0.75, 0.6), 0.5 - 0.6 * y);
                let sun = Vec3::new(0.95, 0.65, 0.25);
                let (dx, dy) = (s - 0.3 * half[0], t - 0.45 * half[1]);
                c = mix(c, sun, step(0.05 * half[0] - (dx * dx + dy * dy) / half[0], fp));
                for i in 0..4u32 {
                    let level = 0.3 - 0.35 * i as f32;
                    let ridge = level + 0.35 * fbm(x, i as f32, 1.3, 4, fp / half[0], seed ^ i) - y;
                    c = mix(c, rainbow(seed ^ (i + 40)) * 0.8, step(ridge, fp / half[1]));
                }
                c
            }
            // Blocks of colour.
            1 => {
                let (mut lo, mut hi) = ([-1.0f32; 2], [1.0f32; 2]);
                let mut h = hash(seed);
                let mut d = 9f32;
                for level in 0..4 {
                    let axis = (level + (h & 1) as usize) & 1;
                    let cut = lo[axis] + (hi[axis] - lo[axis]) * (0.3 + 0.4 * unit(hash(h)));
                    let p = [x, y][axis];
                    d = d.min((p - cut).abs() * half[axis]);
                    if p < cut {
                        hi[axis] = cut;
                        h = hash(h ^ 0x55);
                    } else {
                        lo[axis] = cut;
                        h = hash(h ^ 0xAA);
                    }
                }
                let fill = if h & 3 == 0 { Vec3::splat(0.8) } else { rainbow(h) };
                mix(fill, Vec3::splat(0.03), line(d, 0.008, fp))
            }
            // Rings.
            2 => {
                let mut c = c1;
                for i in 0..6u32 {
                    let h = hash(seed ^ (i * 977));
                    let (px, py) = (unit(h) * 1.6 - 0.8, unit(hash(h)) * 1.6 - 0.8);
                    let r = 0.12 + 0.4 * unit(hash(h ^ 9));
                    // Distance in half widths, near enough to round for these formats.
                    let q = ((x - px) * (x - px) + (y - py) * (y - py)) / r;
                    c = mix(c, rainbow(h ^ 77), step(r - q, 2.0 * fp / half[0]));
                    c = mix(c, c3, step(0.4 * r - q, 2.0 * fp / half[0]));
                }
                c
            }
            // Poured paint.
            _ => {
                let warp = fbm(x, y, 1.5, 3, fp / half[0], seed);
                let n = fbm(x + 0.8 * warp, y - 0.6 * warp, 2.0, 4, fp / half[0], seed ^ 21);
                let c = mix(c1, c2, 0.5 + 1.4 * n);
                mix(c, c3 + 0.15, step(wave(3.0 * n + warp) - 0.7, 0.15))
            }
        };
        mix(picture * brush, self.a, mat)
    }

    fn screen(&self, s: f32, t: f32, half: [f32; 2], fp: f32) -> Vec3 {
        let seed = self.seed;
        let bezel = step(s.abs() - half[0] + 0.015, fp).max(step(t.abs() - half[1] + 0.015, fp));
        let (x, y) = (s / half[0], t / half[1]);
        let desktop = mix(Vec3::new(0.05, 0.12, 0.3), Vec3::new(0.35, 0.2, 0.4), 0.5 + 0.5 * y)
            * (1.0 + 0.5 * fbm(x, y, 1.5, 3, fp, seed));
        let mut c = desktop;
        // An editor on the left, a chart on the right.
        if x > -0.92 && x < 0.2 && y > -0.85 && y < 0.85 {
            let row = floor(t / 0.016);
            let indent = (hash2(row, 1, seed) % 4) as f32 * 0.018;
            let col = floor(s / 0.011);
            let length = unit(hash2(row, 2, seed)) * half[0] * 0.9;
            let from_left = s + 0.88 * half[0] - indent;
            let word = hash2(row, col / 4, seed);
            let on =
                from_left > 0.0 && from_left < length && !hash2(row, col, seed).is_multiple_of(6);
            let ink = line(fract(t / 0.016) - 0.5, 0.28, fp / 0.016);
            let text = 0.25 + 0.7 * rainbow(word);
            c = mix(Vec3::splat(0.025), text, if on { ink } else { 0.0 });
        } else if x > 0.28 && x < 0.92 && y > -0.7 && y < 0.8 {
            let bar = floor((x - 0.28) * 12.5);
            let top = -0.6 + 1.2 * unit(hash2(bar, 7, seed));
            let grid = 0.3 * line(fract(y * 5.0) - 0.5, 0.04, fp * 5.0 / half[1]);
            c = mix(
                Vec3::splat(0.75 - grid),
                rainbow(seed ^ bar as u32),
                step(top - y, fp / half[1]),
            );
        }
        mix(c, Vec3::splat(0.02), bezel)
    }

    fn whiteboard(&self, s: f32, t: f32, half: [f32; 2], fp: f32) -> Vec3 {
        let seed = self.seed;
        let mut c = self.a * (1.0 + 0.10 * fbm(s, t, 3.0, 3, fp, seed));
        let (i, j) = (floor(s / 0.34), floor(t / 0.3));
        let h = hash2(i, j, seed);
        let (x, y) = ((fract(s / 0.34) - 0.5) * 0.34, (fract(t / 0.3) - 0.5) * 0.3);
        let pen = [Vec3::new(0.02, 0.03, 0.3), Vec3::new(0.5, 0.03, 0.03), Vec3::splat(0.03)];
        let ink = pen[(h >> 8) as usize % 3];
        match h % 4 {
            // A note with writing.
            0 => {
                let paper = step(0.10 - x.abs().max(y.abs()), fp);
                let row = floor(y / 0.022);
                let text = line(fract(y / 0.022) - 0.5, 0.22, fp / 0.022)
                    * step(unit(hash2(row, i, h)) * 0.09 - x, fp);
                c = mix(c, mix(rainbow(h) + 0.3, Vec3::splat(0.05), 0.8 * text), paper);
            }
            // Lines of writing.
            1 => {
                let wiggle = 0.008 * noise(s * 160.0, t * 3.0, h);
                let row = fract((y + wiggle) / 0.045) - 0.5;
                let inside = step(0.14 - x.abs(), fp) * step(0.11 - y.abs(), fp);
                c = mix(c, ink, line(row, 0.10, fp / 0.045) * inside);
            }
            // A sketch: boxes joined by lines.
            2 => {
                let d = (x + 0.07).abs().max(y.abs()) - 0.045;
                let e = (x - 0.08).abs().max((y - 0.05).abs()) - 0.04;
                let joint = line(y - 0.02, 0.004, fp) * step(0.05 - (x - 0.0).abs(), fp);
                c = mix(c, ink, line(d, 0.005, fp).max(line(e, 0.005, fp)).max(joint));
            }
            _ => {
                let n = fbm(s, t, 9.0, 2, fp, h);
                let inside = step(0.12 - x.abs().max(y.abs()), fp);
                c = mix(c, ink, line(n, 0.04, 9.0 * fp) * inside);
            }
        }
        let frame = step(s.abs() - half[0] + 0.025, fp).max(step(t.abs() - half[1] + 0.025, fp));
        mix(c, self.b, frame)
    }
}
