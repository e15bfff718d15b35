//! Where a recording's camera comes from, and lens distortion.
use super::{
    decode::Size,
    folder::{Folder, base, invalid, parse_numbers},
    names::folded,
    resize::{Resize, same_aspect},
};
use mte_slam_types::{camera::Camera, sequence::SequenceError};

/// Brown-Conrady distortion (k1, k2, p1, p2, k3), as OpenCV orders it.
pub(super) type Distortion = [f64; 5];

/// A camera as a file (or a default) gives it; the size may be left to the images.
#[derive(Clone, Debug)]
pub(super) struct Intrinsics {
    /// The file, or what the default is, for messages.
    pub from: String,
    pub size: Option<Size>,
    /// fx, fy, cx, cy \[pixels\].
    pub focal_centre: [f64; 4],
    pub distortion: Distortion,
    /// Units of depth per metre, when the file says so.
    pub depth_scale: Option<f64>,
    /// Whether it is also the camera of images of the same proportions in another size, as where
    /// the file is about colour and depth is smaller.
    pub scales: bool,
}

/// Pixels by which colour may lie beside depth before it is said.
const MAX_SHIFT_PIXELS: f64 = 1.0;

impl Intrinsics {
    /// Returns a default without distortion, valid for one size.
    pub fn fixed(from: &str, size: Size, focal_centre: [f64; 4]) -> Self {
        Self { size: Some(size), ..Self::any_size(from, focal_centre) }
    }

    /// Without distortion, of images of any size.
    pub fn any_size(from: &str, focal_centre: [f64; 4]) -> Self {
        Self {
            from: from.into(),
            size: None,
            focal_centre,
            distortion: [0.0; 5],
            depth_scale: None,
            scales: false,
        }
    }

    /// Compares the colour camera's numbers with these, the depth camera's. Colour is only
    /// stretched to the size of depth, so a difference is worth a warning.
    pub fn note_color(&self, color: [f64; 4], color_size: Size, warnings: &mut Vec<String>) {
        let Some(size) = self.size else { return };
        let [fx, fy, cx, cy] = color;
        let sides = [size.0, size.1, color_size.0, color_size.1];
        let sensible = fx > 0.0 && fy > 0.0 && color.iter().all(|x| x.is_finite());
        if !sensible || sides.contains(&0) {
            return;
        }
        let color = Camera { width: color_size.0, height: color_size.1, fx, fy, cx, cy };
        let fitted = Resize::to_size(color_size, size).camera(&color);
        let [fx, fy, cx, cy] = self.focal_centre;
        let depth = Camera { width: size.0, height: size.1, fx, fy, cx, cy };
        // A far point on each corner's ray of the depth camera, in both images.
        let (right, bottom) = (f64::from(size.0 - 1), f64::from(size.1 - 1));
        let shift = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)]
            .into_iter()
            .filter_map(|(u, v)| {
                let other = fitted.project(depth.back_project(u, v, 1.0))?;
                Some((other.x - u).hypot(other.y - v))
            })
            .fold(0.0, f64::max);
        if shift > MAX_SHIFT_PIXELS {
            warnings.push(format!(
                "by their intrinsics colour, stretched to the size of depth, lies up to \
                 {shift:.1} pixels beside it"
            ));
        }
    }

    /// The camera of images of the given size, or an error when it belongs to another size.
    pub fn camera(&self, depth_file: &str, size: Size) -> Result<Camera, SequenceError> {
        let [fx, fy, cx, cy] = self.focal_centre;
        if let Some((width, height)) = self.size.filter(|s| *s != size && self.scales) {
            if !same_aspect((width, height), size) {
                return Err(invalid(
                    depth_file,
                    None,
                    "depth image size",
                    format!("{}x{}", size.0, size.1),
                    format!("the proportions of {width}x{height}, the camera of {}", self.from),
                ));
            }
            let camera = Camera { width, height, fx, fy, cx, cy };
            return Ok(Resize::to_size((width, height), size).camera(&camera));
        }
        if let Some((w, h)) = self.size.filter(|s| *s != size) {
            return Err(invalid(
                depth_file,
                None,
                "depth image size",
                format!("{}x{}", size.0, size.1),
                format!("{w}x{h}, the size of the camera of {}", self.from),
            ));
        }
        Ok(Camera { width: size.0, height: size.1, fx, fy, cx, cy })
    }
}

/// The camera of a plain folder of images.
pub(super) const IMAGES_CAMERA: &str = "intrinsics.json";

/// Files with a camera; of several in one folder the first counts.
const FILES: [&str; 4] = ["cam_params.json", IMAGES_CAMERA, "camera-intrinsics.txt", "camera.txt"];

/// Reads the file with the camera: of the recording's folder, or else of the folders up to two up
/// that the source lets us see.
pub(super) fn read(folder: &Folder) -> Result<Option<Intrinsics>, SequenceError> {
    let here = FILES.into_iter().find(|f| folder.has(f)).map(String::from);
    let above = || FILES.into_iter().find_map(|f| folder.here_or_above(f));
    let Some(file) = here.or_else(above) else { return Ok(None) };
    let found = match folded(base(&file)).as_str() {
        "camera-intrinsics.txt" => from_matrix(folder, &file)?,
        "camera.txt" => from_line(folder, &file)?,
        IMAGES_CAMERA => Intrinsics { scales: true, ..from_json(folder, &file)? },
        _ => from_json(folder, &file)?,
    };
    Ok(Some(Intrinsics { from: file.trim_start_matches('/').into(), ..found }))
}

/// `{"camera": {"w", "h", "fx", "fy", "cx", "cy", "scale"}}`, plus `k1 k2 p1 p2 k3` if wanted.
fn from_json(folder: &Folder, file: &str) -> Result<Intrinsics, SequenceError> {
    let json = folder.json(file)?;
    let shown = file.trim_start_matches('/');
    let camera = json.get("camera").unwrap_or(&json);
    let number = |key: &str| -> Result<Option<f64>, SequenceError> {
        match camera.get(key) {
            None => Ok(None),
            Some(value) => value.as_f64().map(Some).ok_or_else(|| {
                invalid(shown, None, format!("camera.{key}"), value.to_string(), "a number")
            }),
        }
    };
    let needed = |key: &str| {
        number(key)?.ok_or_else(|| {
            invalid(shown, None, format!("camera.{key}"), "nothing", "a number of pixels")
        })
    };
    let side = |key: &str| -> Result<Option<u32>, SequenceError> {
        match number(key)? {
            Some(n) if n.fract() != 0.0 || !(1.0..=65535.0).contains(&n) => {
                let field = format!("camera.{key}");
                Err(invalid(shown, None, field, n.to_string(), "a number of pixels"))
            }
            n => Ok(n.map(|n| n as u32)),
        }
    };
    let mut distortion = [0.0; 5];
    for (value, key) in distortion.iter_mut().zip(["k1", "k2", "p1", "p2", "k3"]) {
        *value = number(key)?.unwrap_or(0.0);
    }
    let depth_scale = match number("scale")? {
        None => number("depth_scale")?,
        given => given,
    };
    if let Some(s) = depth_scale.filter(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(invalid(shown, None, "camera.scale", s.to_string(), "units per metre > 0"));
    }
    let size = match (side("w")?, side("h")?) {
        (Some(w), Some(h)) => Some((w, h)),
        _ => None,
    };
    let focal_centre = [needed("fx")?, needed("fy")?, needed("cx")?, needed("cy")?];
    let camera = Intrinsics::any_size(shown, focal_centre);
    checked(shown, Intrinsics { size, distortion, depth_scale, ..camera })
}

/// Reads a 3x3 or 4x4 matrix.
pub(super) fn from_matrix(folder: &Folder, file: &str) -> Result<Intrinsics, SequenceError> {
    let text = folder.text(file)?;
    let file = file.trim_start_matches('/');
    let numbers = parse_numbers(file, None, &text)?;
    let focal_centre = match *numbers.as_slice() {
        [fx, _, cx, _, fy, cy, _, _, _] => [fx, fy, cx, cy],
        [fx, _, cx, _, _, fy, cy, _, ..] if numbers.len() == 16 => [fx, fy, cx, cy],
        _ => {
            let expected = "the 9 numbers of a 3x3 matrix, or the 16 of a 4x4 one";
            return Err(count_error(file, numbers.len(), expected));
        }
    };
    checked(file, Intrinsics::any_size(file, focal_centre))
}

/// `fx fy cx cy` or `fx fy cx cy k1 k2 p1 p2 k3`, with `#` comments.
fn from_line(folder: &Folder, file: &str) -> Result<Intrinsics, SequenceError> {
    let expected = "fx fy cx cy, or fx fy cx cy k1 k2 p1 p2 k3";
    let text = folder.text(file)?;
    let file = file.trim_start_matches('/');
    let plain: Vec<&str> = text.lines().map(|l| l.split('#').next().unwrap_or("")).collect();
    let numbers = parse_numbers(file, None, &plain.join("\n"))?;
    let (focal_centre, distortion) = match *numbers.as_slice() {
        [fx, fy, cx, cy] => ([fx, fy, cx, cy], [0.0; 5]),
        [fx, fy, cx, cy, k1, k2, p1, p2, k3] => ([fx, fy, cx, cy], [k1, k2, p1, p2, k3]),
        _ => return Err(count_error(file, numbers.len(), expected)),
    };
    checked(file, Intrinsics { distortion, ..Intrinsics::any_size(file, focal_centre) })
}

fn count_error(file: &str, found: usize, expected: &str) -> SequenceError {
    invalid(file, None, "camera", format!("{found} numbers"), expected)
}

pub(super) fn checked(file: &str, i: Intrinsics) -> Result<Intrinsics, SequenceError> {
    let [fx, fy, ..] = i.focal_centre;
    let finite = i.focal_centre.iter().chain(&i.distortion).all(|x| x.is_finite());
    if !finite || fx <= 0.0 || fy <= 0.0 {
        let found = format!("{:?} {:?}", i.focal_centre, i.distortion);
        return Err(invalid(file, None, "camera", found, "finite numbers, fx and fy > 0"));
    }
    Ok(i)
}

/// Takes lens distortion out of images, and cuts them to the part that is covered all over.
#[derive(Debug)]
pub(super) struct Rectifier {
    from: Size,
    camera: Camera,
    /// Where each pixel of the result lies in the distorted image, row-major.
    map: Vec<[f32; 2]>,
}

impl Rectifier {
    /// Prepares the map; the result has the same focal lengths, cut by the same multiple of 8
    /// pixels left and right, and top and bottom.
    pub fn new(from: &str, raw: &Camera, k: &Distortion) -> Result<Self, SequenceError> {
        let inside = |x: u32, y: u32| {
            let [u, v] = distort(raw, k, f64::from(x), f64::from(y));
            u >= 0.0 && v >= 0.0 && u <= f64::from(raw.width - 1) && v <= f64::from(raw.height - 1)
        };
        let (mut mx, mut my) = (0, 0);
        loop {
            if mx * 4 > raw.width || my * 4 > raw.height || raw.width < 16 || raw.height < 16 {
                return Err(invalid(
                    from,
                    None,
                    "lens distortion",
                    format!("{k:?}"),
                    "one that leaves at least half of the image",
                ));
            }
            let (right, bottom) = (raw.width - 1 - mx, raw.height - 1 - my);
            let sides_fit = (my..=bottom).all(|y| inside(mx, y) && inside(right, y));
            let ends_fit = (mx..=right).all(|x| inside(x, my) && inside(x, bottom));
            match (sides_fit, ends_fit) {
                (true, true) => break,
                // The corners belong to both; cutting one side at a time keeps more.
                (false, true) => mx += 8,
                (true, false) => my += 8,
                (false, false) => (mx, my) = (mx + 8, my + 8),
            }
        }
        let camera = Camera {
            width: raw.width - 2 * mx,
            height: raw.height - 2 * my,
            cx: raw.cx - f64::from(mx),
            cy: raw.cy - f64::from(my),
            ..*raw
        };
        let mut map = Vec::with_capacity(camera.pixels());
        for y in 0..camera.height {
            for x in 0..camera.width {
                let [u, v] = distort(raw, k, f64::from(x + mx), f64::from(y + my));
                // Inside by the check of the border; the clamp keeps look-ups safe regardless.
                let u = if u.is_finite() { u.clamp(0.0, f64::from(raw.width - 1)) } else { 0.0 };
                let v = if v.is_finite() { v.clamp(0.0, f64::from(raw.height - 1)) } else { 0.0 };
                map.push([u as f32, v as f32]);
            }
        }
        Ok(Self { from: (raw.width, raw.height), camera, map })
    }

    /// Returns the camera of the result.
    pub fn camera(&self) -> Camera {
        self.camera
    }

    /// Nearest pixel, for depth and labels.
    pub fn nearest<T: Copy>(&self, image: &[T]) -> Vec<T> {
        let width = self.from.0 as usize;
        self.map
            .iter()
            .map(|[u, v]| image[v.round() as usize * width + u.round() as usize])
            .collect()
    }

    /// Bilinear, for colour.
    pub fn bilinear(&self, image: &[[u8; 3]]) -> Vec<[u8; 3]> {
        let (width, height) = (self.from.0 as usize, self.from.1 as usize);
        self.map
            .iter()
            .map(|[u, v]| {
                let (x0, y0) = (*u as usize, *v as usize);
                let (x1, y1) = ((x0 + 1).min(width - 1), (y0 + 1).min(height - 1));
                let (a, b) = (u - x0 as f32, v - y0 as f32);
                let at = |x: usize, y: usize| image[y * width + x];
                let (p, q, r, s) = (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1));
                core::array::from_fn(|c| {
                    let top = f32::from(p[c]) * (1.0 - a) + f32::from(q[c]) * a;
                    let bottom = f32::from(r[c]) * (1.0 - a) + f32::from(s[c]) * a;
                    (top * (1.0 - b) + bottom * b + 0.5) as u8
                })
            })
            .collect()
    }
}

/// Where the lens puts the point that an ideal camera sees at pixel (u, v).
fn distort(c: &Camera, k: &Distortion, u: f64, v: f64) -> [f64; 2] {
    let [k1, k2, p1, p2, k3] = *k;
    let (x, y) = ((u - c.cx) / c.fx, (v - c.cy) / c.fy);
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    [c.fx * xd + c.cx, c.fy * yd + c.cy]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MemorySource;

    fn one_file(name: &str, text: &str) -> Folder {
        let mut m = MemorySource::new("m");
        m.insert(name, text);
        Folder::new(Box::new(m)).unwrap()
    }

    #[test]
    fn the_three_files_and_their_errors() {
        let json = r#"{"camera":{"w":4,"h":3,"fx":5,"fy":6,"cx":1.5,"cy":1,"scale":1000}}"#;
        let i = read(&one_file("../cam_params.json", json)).unwrap().unwrap();
        assert_eq!((i.size, i.focal_centre), (Some((4, 3)), [5.0, 6.0, 1.5, 1.0]));
        assert_eq!(i.depth_scale, Some(1000.0));
        assert!(i.camera("d.png", (8, 6)).unwrap_err().to_string().contains("8x6"));
        let i = read(&one_file("camera-intrinsics.txt", "5 0 1\n0 6 2\n0 0 1")).unwrap().unwrap();
        assert_eq!(i.focal_centre, [5.0, 6.0, 1.0, 2.0]);
        let text = "5 0 1 0 0 6 2 0 0 0 1 0 0 0 0 1";
        let i = read(&one_file("camera-intrinsics.txt", text)).unwrap().unwrap();
        assert_eq!(i.focal_centre, [5.0, 6.0, 1.0, 2.0]);
        let json = r#"{"w":8,"h":6,"fx":10,"fy":12,"cx":3.5,"cy":2.5,"depth_scale":500}"#;
        let i = read(&one_file("intrinsics.json", json)).unwrap().unwrap();
        assert_eq!(i.depth_scale, Some(500.0));
        let half = i.camera("d.png", (4, 3)).unwrap();
        assert_eq!((half.fx, half.fy, half.cx, half.cy), (5.0, 6.0, 1.5, 1.0));
        assert!(i.camera("d.png", (4, 4)).unwrap_err().to_string().contains("proportions"));
        let i = read(&one_file("camera.txt", "# mine\n5 6 1 2 .1 .2 .3 .4 .5")).unwrap().unwrap();
        assert_eq!(i.distortion, [0.1, 0.2, 0.3, 0.4, 0.5]);
        for (name, text, part) in [
            ("camera.txt", "1 2 3", "3 numbers"),
            ("camera.txt", "0 2 3 4", "fx and fy > 0"),
            ("camera.txt", "5 six 3 4", "\"six\""),
            ("camera-intrinsics.txt", "5 0 1 0 6 2", "6 numbers"),
            ("intrinsics.json", r#"{"fx":5,"fy":5,"cx":1,"cy":1,"depth_scale":0}"#, "camera.scale"),
            ("cam_params.json", "{", "JSON"),
            ("cam_params.json", r#"{"camera":{"fx":"5"}}"#, "camera.fx"),
            ("cam_params.json", r#"{"camera":{"fx":5,"fy":5,"cx":1}}"#, "camera.cy"),
            ("cam_params.json", r#"{"camera":{"w":-4,"fx":5}}"#, "camera.w"),
        ] {
            let e = read(&one_file(name, text)).unwrap_err().to_string();
            assert!(e.contains(part) && e.contains(name), "{name} {text}: {e}");
        }
    }

    #[test]
    fn undistorting_straightens_what_the_lens_bent() {
        let raw = Camera { width: 640, height: 480, fx: 517.3, fy: 516.5, cx: 318.6, cy: 255.3 };
        let k = [0.2624, -0.9531, -0.0054, 0.0026, 1.1633];
        let r = Rectifier::new("fr1", &raw, &k).unwrap();
        let c = r.camera();
        assert!(c.width.is_multiple_of(16) && c.width > 560 && c.height > 400, "{c:?}");
        // A picture of the ideal image position, as the lens would deliver it: look-ups through
        // the map must give the ideal coordinates of each pixel back.
        let mut bent = vec![[0u8; 3]; 640 * 480];
        for (i, p) in bent.iter_mut().enumerate() {
            let (u, v) = ((i % 640) as f64, (i / 640) as f64);
            let (mut x, mut y) = (u, v);
            for _ in 0..20 {
                let [du, dv] = distort(&raw, &k, x, y);
                (x, y) = (x + u - du, y + v - dv);
            }
            *p = [(x / 3.0) as u8, (y / 2.0) as u8, 0];
        }
        let flat = r.bilinear(&bent);
        let (mx, my) = (raw.cx - c.cx, raw.cy - c.cy);
        for (x, y) in [(0, 0), (10, 200), (300, 20), (c.width - 1, c.height - 1)] {
            let got = flat[(y * c.width + x) as usize];
            let want = [(f64::from(x) + mx) / 3.0, (f64::from(y) + my) / 2.0];
            for a in 0..2 {
                assert!((f64::from(got[a]) - want[a]).abs() < 1.6, "{x} {y} {got:?} {want:?}");
            }
        }
        assert!(Rectifier::new("silly", &raw, &[9.0, 9.0, 0.0, 0.0, 9.0]).is_err());
    }
}
