//! Trajectory error of the odometry alone on the development sequences.
//!
//! `odometry DATA_FOLDER [key=value ...]`, where a key is a path into [`OdometryConfig`] such as
//! `references=2` or `align.max_points=20000`, or `only=room-11`, `frames=40`, `out=FOLDER`.
use glam::{DMat3, DQuat, DVec3};
use mte_slam_core::{
    camera::Camera,
    frame::Frame,
    pose::Pose,
    track::odometry::{Odometer, OdometryConfig, RgbdPyramid},
};
use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

struct Recording {
    camera: Camera,
    unit_m: f64,
    frames: Vec<(String, String, Pose)>,
    invalid: u16,
    step: u32,
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().filter_map(|t| t.parse().ok()).collect()
}

fn open(folder: &Path) -> Option<Recording> {
    let name = |n: &str| folder.join(n).to_string_lossy().into_owned();
    let read = |n: &str| fs::read_to_string(folder.join(n)).ok();
    if let Some(text) = read("traj.txt") {
        let camera = Camera {
            width: 320,
            height: 240,
            fx: 208.5160596545929,
            fy: 208.5160596545929,
            cx: 159.5,
            cy: 119.5,
        };
        let frames = text
            .lines()
            .enumerate()
            .filter_map(|(i, l)| {
                let m: [f64; 16] = numbers(l).try_into().ok()?;
                Some((
                    name(&format!("results/frame{i:06}.jpg")),
                    name(&format!("results/depth{i:06}.png")),
                    Pose::from_row_major(&m)?,
                ))
            })
            .collect();
        return Some(Recording { camera, unit_m: 1.0 / 6553.5, frames, invalid: 0, step: 1 });
    }
    if let Some(text) = read("groundtruth.txt") {
        let camera = Camera { width: 640, height: 480, fx: 535.4, fy: 539.2, cx: 320.1, cy: 247.6 };
        let list = |t: String| {
            t.lines()
                .filter(|l| !l.starts_with('#'))
                .map(|l| l.split_whitespace().map(String::from).collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let (rgb, depth) = (list(read("rgb.txt")?), list(read("depth.txt")?));
        let truth = list(text);
        let frames = rgb
            .iter()
            .zip(&depth)
            .zip(&truth)
            .filter(|((c, d), t)| c[0] == d[0] && c[0] == t[0])
            .map(|((c, d), t)| {
                let x: Vec<f64> = t.iter().map(|s| s.parse().unwrap_or(f64::NAN)).collect();
                let pose = Pose::from_quaternion(
                    DVec3::new(x[1], x[2], x[3]),
                    DQuat::from_xyzw(x[4], x[5], x[6], x[7]),
                );
                (name(&c[1]), name(&d[1]), pose)
            })
            .collect();
        return Some(Recording { camera, unit_m: 1.0 / 5000.0, frames, invalid: 0, step: 2 });
    }
    let camera = Camera { width: 640, height: 480, fx: 585.0, fy: 585.0, cx: 320.0, cy: 240.0 };
    let mut frames = Vec::new();
    while let Some(text) = read(&format!("frame-{:06}.pose.txt", frames.len())) {
        let i = frames.len();
        let m: [f64; 16] = numbers(&text).try_into().ok()?;
        frames.push((
            name(&format!("frame-{i:06}.color.jpg")),
            name(&format!("frame-{i:06}.depth.png")),
            Pose::from_row_major(&m)?,
        ));
    }
    Some(Recording { camera, unit_m: 1e-3, frames, invalid: 65535, step: 2 })
}

fn load(r: &Recording, i: usize) -> Frame {
    let (color, depth, truth) = &r.frames[i];
    let color = image::open(color).expect(color).to_rgb8();
    let depth = image::open(depth).expect(depth).to_luma16();
    let (w, h) = (color.width() / r.step, color.height() / r.step);
    let s = r.step;
    let mut frame = Frame {
        index: i,
        number: i as u64,
        time_s: i as f64,
        color: Vec::new(),
        depth: Vec::new(),
        labels: None,
        truth: Some(*truth),
    };
    for v in 0..h {
        for u in 0..w {
            let mut c = [0u32; 3];
            let mut z = [0u16; 4];
            for k in 0..s * s {
                let (x, y) = (u * s + k % s, v * s + k / s);
                for j in 0..3 {
                    c[j] += u32::from(color.get_pixel(x, y)[j]);
                }
                let d = depth.get_pixel(x, y)[0];
                z[k as usize] = if d == r.invalid { 0 } else { d };
            }
            frame.color.push(c.map(|x| ((x + s * s / 2) / (s * s)) as u8));
            // Nearest neighbour: the top left of the middle four.
            let mut d = z[0];
            if s == 2 {
                let mut valid: Vec<u16> = z.iter().copied().filter(|&d| d > 0).collect();
                valid.sort_unstable();
                d = if valid.is_empty() { 0 } else { valid[valid.len() / 2] };
            }
            frame.depth.push(d);
        }
    }
    frame
}

/// RMSE and maximum of translation after the best SE(3) alignment (Horn) \[m\].
fn ate(estimate: &[DVec3], truth: &[DVec3]) -> (f64, f64) {
    let n = estimate.len() as f64;
    let ce = estimate.iter().sum::<DVec3>() / n;
    let ct = truth.iter().sum::<DVec3>() / n;
    let mut s = [[0.0; 3]; 3];
    for (e, t) in estimate.iter().zip(truth) {
        let (e, t) = ((*e - ce).to_array(), (*t - ct).to_array());
        for i in 0..3 {
            for j in 0..3 {
                s[i][j] += e[i] * t[j];
            }
        }
    }
    let m = [
        [s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
        [s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
        [s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
        [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]],
    ];
    // Largest eigenvector by power iteration on a shifted matrix.
    let shift: f64 = m.iter().flatten().map(|x| x.abs()).sum();
    let mut q = [1.0, 0.01, 0.02, 0.03];
    for _ in 0..20000 {
        let mut p = [0.0; 4];
        for i in 0..4 {
            p[i] = shift * q[i] + (0..4).map(|j| m[i][j] * q[j]).sum::<f64>();
        }
        let l = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        q = p.map(|x| x / l);
    }
    let r = DMat3::from_quat(DQuat::from_xyzw(q[1], q[2], q[3], q[0]).normalize());
    let errors: Vec<f64> =
        estimate.iter().zip(truth).map(|(e, t)| (r * (*e - ce) - (*t - ct)).length()).collect();
    let rmse = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    (rmse, errors.iter().copied().fold(0.0, f64::max))
}

fn main() {
    let mut args = std::env::args().skip(1);
    let Some(data) = args.next() else {
        eprintln!("usage: odometry DATA_FOLDER [key=value ...]");
        return;
    };
    let mut config = serde_json::to_value(OdometryConfig::default()).expect("config");
    let (mut only, mut most, mut verbose, mut out) = (String::new(), usize::MAX, false, None);
    for arg in args {
        let (key, value) = arg.split_once('=').expect("key=value");
        match key {
            "only" => only = value.into(),
            "frames" => most = value.parse().expect("frames"),
            "verbose" => verbose = value == "1",
            "out" => out = Some(PathBuf::from(value)),
            _ => {
                let mut at = &mut config;
                for part in key.split('.') {
                    at = at.get_mut(part).unwrap_or_else(|| panic!("no setting {key}"));
                }
                *at = serde_json::from_str(value).expect("a JSON value");
            }
        }
    }
    let config: OdometryConfig = serde_json::from_value(config).expect("config");
    println!(
        "| sequence | frames | ATE cm | online cm | max cm | ms/frame | pyramid ms | lost | recovered | keyframes |"
    );
    for name in ["kitchen-7scenes", "room-11", "office-12", "cabinet-tum"] {
        if !only.is_empty() && !name.contains(&only) {
            continue;
        }
        let Some(recording) = open(&Path::new(&data).join(name)) else { continue };
        let camera = recording.camera.downscaled(recording.step);
        let mut odometer = Odometer::new(config.clone());
        let (mut online, mut truth) = (Vec::new(), Vec::new());
        let (mut seconds, mut prepare, mut lost, mut recovered) = (0.0, 0.0, 0, 0);
        let count = recording.frames.len().min(most);
        for i in 0..count {
            let frame = load(&recording, i);
            let first = (i == 0).then_some(recording.frames[0].2);
            let t = Instant::now();
            let pyramid = RgbdPyramid::new(&frame, &camera, recording.unit_m, &config.pyramid)
                .expect("frame");
            prepare += t.elapsed().as_secs_f64();
            let result = odometer.track(pyramid, first).expect("track");
            seconds += t.elapsed().as_secs_f64();
            lost += usize::from(result.lost);
            recovered += usize::from(result.recovered);
            online.push(result.world_from_camera.translation);
            truth.push(recording.frames[i].2.translation);
            if verbose {
                let q = result.quality;
                let e = recording.frames[i].2.inverse().compose(&result.world_from_camera);
                let step = i.checked_sub(1).map_or(0.0, |j| {
                    (recording.frames[i].2.translation - recording.frames[j].2.translation).length()
                });
                let own = i.checked_sub(1).map_or(0.0, |j| (online[i] - online[j]).length());
                println!(
                    "{i:4} step {:.2} {:.2} cm err {:6.2} cm {:5.2} deg  inl {:.2} ovl {:.2} g {:.2} mm p {:.4} cond {:.1e} refs {} {} {}",
                    100.0 * step,
                    100.0 * own,
                    100.0 * e.translation.length(),
                    e.angle_rad().to_degrees(),
                    q.inlier_ratio,
                    q.overlap,
                    1e3 * q.geometric_rmse_m,
                    q.photometric_rmse,
                    q.conditioning,
                    q.references,
                    if result.keyframe.is_some() { "K" } else { "" },
                    result.reason.map_or(String::new(), |r| format!("{r:?}")),
                );
            }
        }
        if let Some(out) = &out {
            // A line a frame: estimate, then truth, both `world_from_camera`, 3x4 row by row.
            let mut text = String::new();
            for ((_, estimate, _), (_, _, truth)) in
                odometer.trajectory().iter().zip(&recording.frames)
            {
                let numbers = [estimate, truth].map(|p| p.to_row_major());
                for x in numbers.iter().flat_map(|n| &n[..12]) {
                    let _ = write!(text, "{x} ");
                }
                text.push('\n');
            }
            fs::write(out.join(format!("{name}.txt")), text).expect("out");
        }
        let last: Vec<DVec3> = odometer.trajectory().iter().map(|t| t.1.translation).collect();
        if verbose {
            println!("colour registration {:?}", odometer.colour_registration());
        }
        let (rmse, max) = ate(&last, &truth);
        let (rmse_online, _) = ate(&online, &truth);
        println!(
            "| {name} | {count} | {:.3} | {:.3} | {:.3} | {:.1} | {:.1} | {lost} | {recovered} | {} |",
            100.0 * rmse,
            100.0 * rmse_online,
            100.0 * max,
            1e3 * seconds / count as f64,
            1e3 * prepare / count as f64,
            odometer.keyframes().len()
        );
    }
}
