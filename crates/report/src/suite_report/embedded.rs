//! Pictures of a report: files made small and put into the page, and meshes in the colours of their
//! error.
use super::{document::escape, results::RunResult};
use crate::draw::{colormap::turbo, pictures::Canvas};
use anyhow::{Context, Result, bail};
use glam::{DMat3, DVec3};
use image::{DynamicImage, ImageFormat, imageops::FilterType};
use mte_slam_mesh::{Mesh, rasterise, read_ply};
use mte_slam_metrics::distances_to_surface;
use mte_slam_types::{camera::Camera, pose::Pose};
use std::{fs, io::Cursor, path::Path};

/// Error at the top of the scale \[m\].
const MOST_M: f64 = 0.05;
/// Factor by which pictures of meshes are drawn larger, then averaged.
const OVERSAMPLING: u32 = 2;
/// As the comparison sheets have it.
const PAPER: [u8; 3] = [24, 26, 30];
const INK: [u8; 3] = [235, 235, 235];

/// An `img` element that holds a picture's bytes.
pub fn img(bytes: &[u8], alternative: &str) -> String {
    let kind = if bytes.starts_with(&[0xff, 0xd8]) { "jpeg" } else { "png" };
    format!(
        "<img alt=\"{}\" src=\"data:image/{kind};base64,{}\">",
        escape(alternative),
        base64(bytes)
    )
}

/// A picture file, at most `width` pixels wide and small ones enlarged pixel by pixel to about that,
/// as PNG or, where that is much smaller, JPEG.
pub fn small(path: &Path, width: u32) -> Result<Vec<u8>> {
    let name = path.display();
    let image = image::open(path).with_context(|| format!("{name}: not a whole picture"))?;
    let image = DynamicImage::ImageRgb8(image.into_rgb8());
    let image = if image.width() > width {
        let height = (image.height() * width).div_ceil(image.width()).max(1);
        image.resize_exact(width, height, FilterType::Triangle)
    } else {
        let zoom = (width / image.width().max(1)).max(1);
        image.resize_exact(image.width() * zoom, image.height() * zoom, FilterType::Nearest)
    };
    let encode = |format: ImageFormat| -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        image
            .write_to(&mut Cursor::new(&mut bytes), format)
            .with_context(|| format!("{name}: cannot be made smaller"))?;
        Ok(bytes)
    };
    let (png, jpeg) = (encode(ImageFormat::Png)?, encode(ImageFormat::Jpeg)?);
    // JPEG blurs flat colours, which PNG packs well: it must be worth it.
    Ok(if jpeg.len() * 2 < png.len() { jpeg } else { png })
}

/// A run's mesh in the colours of its distance to the true mesh, from outside (surfaces that face
/// away left out) and from the pose of a frame, as PNG.
pub fn mesh_error(run: &RunResult, pose: &Pose, up: DVec3) -> Result<Vec<u8>> {
    let ours = read_mesh(&run.folder.join("mesh.ply"))?;
    let truth = read_mesh(&run.mesh)?;
    let error = distances_to_surface(&ours.positions, &truth, 4.0 * MOST_M);
    let (w, h) = (560u32, 420u32);
    let overview = overview_camera(&ours, pose.translation, up, w * OVERSAMPLING, h * OVERSAMPLING);
    let inside = Camera {
        width: w * OVERSAMPLING,
        height: h * OVERSAMPLING,
        fx: 0.6 * f64::from(w * OVERSAMPLING),
        fy: 0.6 * f64::from(w * OVERSAMPLING),
        cx: 0.5 * f64::from(w * OVERSAMPLING - 1),
        cy: 0.5 * f64::from(h * OVERSAMPLING - 1),
    };
    let eye = overview.1.translation;
    let faces = |t: usize| {
        let [a, b, c] = ours.corners(t);
        (b - a).cross(c - a).dot(eye - a) > 0.0
    };
    let all = ours.triangles.iter().enumerate();
    let facing = Mesh {
        positions: ours.positions.clone(),
        triangles: all.filter(|(t, _)| faces(*t)).map(|(_, corners)| *corners).collect(),
        ..Mesh::default()
    };
    let left = shaded(&facing, &error, &overview.0, &overview.1);
    let right = shaded(&ours, &error, &inside, pose);
    let (gap, bar) = (8usize, 34usize);
    let (w, h) = (w as usize, h as usize);
    let mut canvas = Canvas::new(2 * w + gap, h + bar, PAPER);
    canvas.image(0, 0, w, 1, &left);
    canvas.image(w + gap, 0, w, 1, &right);
    scale(&mut canvas, h + 8);
    canvas.png()
}

/// The colours' meaning.
fn scale(canvas: &mut Canvas, y: usize) {
    let (x, width) = (150, 400);
    canvas.text(8, y + 2, 1, INK, "distance to truth");
    for i in 0..width {
        canvas.fill(x + i, y, 1, 12, turbo(i as f64 / width as f64));
    }
    for i in 0..=5 {
        let at = x + i * width / 5;
        canvas.text(at.saturating_sub(4), y + 16, 1, INK, &format!("{i}"));
    }
    canvas.text(x + width + 16, y + 2, 1, INK, "cm and more");
}

fn read_mesh(path: &Path) -> Result<Mesh> {
    let name = path.display();
    let bytes = fs::read(path).with_context(|| format!("{name}: cannot be read"))?;
    let mesh = read_ply(&bytes).with_context(|| format!("{name}: not a mesh"))?;
    if mesh.triangles.is_empty() {
        bail!("{name}: found no faces, expected a mesh");
    }
    Ok(mesh)
}

/// A camera outside that sees the whole mesh from above and aside.
fn overview_camera(
    mesh: &Mesh,
    inside: DVec3,
    up: DVec3,
    width: u32,
    height: u32,
) -> (Camera, Pose) {
    let finite = mesh.positions.iter().map(|p| DVec3::from_array(p.map(f64::from)));
    let (mut low, mut high) = (inside, inside);
    for p in finite.filter(|p| p.is_finite()) {
        (low, high) = (low.min(p), high.max(p));
    }
    let centre = 0.5 * (low + high);
    let radius = (0.5 * (high - low).length()).max(0.01);
    let up = up.try_normalize().unwrap_or(DVec3::Z);
    let (side, front) = up.any_orthonormal_pair();
    let direction = (up * 1.25 + side * 0.55 + front * 0.75).normalize();
    let eye = centre + direction * (4.0 * radius);
    let z = -direction;
    let x = z.cross(up).normalize();
    let pose = Pose { rotation: DMat3::from_cols(x, z.cross(x), z), translation: eye };
    // As large as the corners of its box allow.
    let camera_from_world = pose.inverse();
    let (mut most_u, mut most_v) = (1e-9f64, 1e-9f64);
    for i in 0..8 {
        let pick = |bit: u32, low: f64, high: f64| if i >> bit & 1 == 1 { high } else { low };
        let corner =
            DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
        let p = camera_from_world.transform_point(corner);
        most_u = most_u.max((p.x / p.z).abs());
        most_v = most_v.max((p.y / p.z).abs());
    }
    let focal = (0.49 * f64::from(width) / most_u).min(0.49 * f64::from(height) / most_v);
    let camera = Camera {
        width,
        height,
        fx: focal,
        fy: focal,
        cx: 0.5 * f64::from(width - 1),
        cy: 0.5 * f64::from(height - 1),
    };
    (camera, pose)
}

/// The mesh as a camera sees it, coloured by the error of its vertices and lit from the camera;
/// averaged down by [`OVERSAMPLING`].
fn shaded(mesh: &Mesh, error_m: &[f32], camera: &Camera, pose: &Pose) -> Vec<[u8; 3]> {
    let raster = rasterise(mesh, camera, pose);
    let (width, height) = (camera.width as usize, camera.height as usize);
    let color = |i: usize| -> [f64; 3] {
        let t = raster.triangle[i] as usize;
        let Some(corners) = mesh.triangles.get(t) else {
            return PAPER.map(f64::from);
        };
        let depth = f64::from(raster.depth_m[i]);
        let p = camera.back_project((i % width) as f64, (i / width) as f64, depth);
        let p = pose.transform_point(p);
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(c - a);
        let area = normal.length_squared().max(1e-30);
        let wb = (p - a).cross(c - a).dot(normal) / area;
        let wc = (b - a).cross(p - a).dot(normal) / area;
        let weights = [1.0 - wb - wc, wb, wc];
        let of = |k: usize| f64::from(error_m[corners[k] as usize]);
        let e: f64 = (0..3).map(|k| weights[k].clamp(0.0, 1.0) * of(k)).sum();
        let to_eye = (pose.translation - p).normalize_or_zero();
        let lit = 0.6 + 0.4 * (normal.dot(to_eye) / area.sqrt()).abs();
        // The ends of the map are nearly black: its middle part shows more.
        turbo(0.06 + 0.88 * e / MOST_M).map(|c| f64::from(c) * lit)
    };
    let step = OVERSAMPLING as usize;
    let (w, h) = (width / step, height / step);
    let mean = |i: usize| {
        let mut sum = [0.0; 3];
        for v in 0..step {
            for u in 0..step {
                let c = color((i / w * step + v) * width + i % w * step + u);
                (0..3).for_each(|k| sum[k] += c[k]);
            }
        }
        sum.map(|s| (s / (step * step) as f64).round() as u8)
    };
    (0..w * h).map(mean).collect()
}

/// Bytes as text (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn a_mesh_is_coloured_by_its_error() {
        // A square 1 m before the camera, 0 off on its left and 5 cm off on its right.
        let mesh = Mesh {
            positions: vec![[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]],
            triangles: vec![[0, 2, 1], [0, 3, 2]],
            ..Mesh::default()
        };
        let camera = Camera { width: 64, height: 48, fx: 40.0, fy: 40.0, cx: 31.5, cy: 23.5 };
        let image = shaded(&mesh, &[0.0, 0.05, 0.05, 0.0], &camera, &Pose::IDENTITY);
        assert_eq!(image.len(), 32 * 24);
        let (left, right) = (image[12 * 32 + 1], image[12 * 32 + 30]);
        assert!(left[2] > left[0] && right[0] > right[2], "{left:?} {right:?}");
    }
}
