//! Tiny recordings for tests.
use super::*;
use glam::DVec3;
use mte_slam_types::{
    camera::Camera,
    classes::{Class, ClassTable, UNLABELLED},
    frame::{Bounds, Frame, SequenceInfo},
    pose::Pose,
    sequence::{Sequence, SequenceError},
};

pub const W: u32 = 24;
pub const H: u32 = 16;

/// Three classes with ids that are neither contiguous nor below 256.
pub fn info() -> SequenceInfo {
    let class =
        |raw_id, name: &str| Class { raw_id, name: name.into(), color: [9, 8, raw_id as u8] };
    SequenceInfo {
        feature_channels: 0,
        name: "tiny".into(),
        layout: "replica",
        camera: Camera { width: W, height: H, fx: 20.0, fy: 21.0, cx: 11.5, cy: 7.25 },
        depth_unit_m: 1.0 / 5000.0,
        frames: 3,
        classes: ClassTable {
            classes: vec![class(0, "floor"), class(7, "bed"), class(300, "cup")],
        },
        bounds: Some(Bounds { min: DVec3::new(-1.0, -2.0, 0.0), max: DVec3::new(1.5, 2.0, 3.0) }),
    }
}

pub fn frame(i: usize) -> Frame {
    let n = W * H;
    Frame {
        features: None,
        index: i,
        number: i as u64,
        time_s: i as f64,
        color: (0..n).map(|p| [(p * 3) as u8, (p / W * 9) as u8, (i * 20) as u8]).collect(),
        depth: (0..n).map(|p| (p * 150 + i as u32) as u16).collect(),
        labels: Some((0..n).map(|p| [0, 1, 2, UNLABELLED][(p / 5 % 4) as usize]).collect()),
        truth: Some(Pose::from_twist(&[0.1 * i as f64, -1.0, 0.5, 0.2, 0.1 * i as f64, -0.3])),
    }
}

/// Returns frames 0..n as files, colour as PNG.
pub fn replica(n: usize) -> MemorySource {
    let mut m = MemorySource::new("tiny");
    let sink = |name: &str, bytes: &[u8]| {
        m.insert(name, bytes);
        Ok(())
    };
    let mut writer = ReplicaWriter::new(&info(), ColorFormat::Png, sink);
    for i in 0..n {
        writer.write(&frame(i)).unwrap();
    }
    assert_eq!(writer.finish().unwrap(), n);
    m
}

/// Returns the same images under the names of another layout; with two-digit frame numbers not padded.
pub fn renamed(n: usize, layout: Layout) -> MemorySource {
    if layout == Layout::Sens {
        return sens(n);
    }
    let from = replica(n);
    let mut to = MemorySource::new("tiny");
    let poses = String::from_utf8(from.get("traj.txt").unwrap().to_vec()).unwrap();
    let mut nerf_frames = Vec::new();
    let (mut rgb_list, mut depth_list, mut truth) = (String::new(), String::new(), String::new());
    let mut odometry = String::from("timestamp, frame, x, y, z, qx, qy, qz, qw\n");
    for (i, line) in poses.lines().enumerate() {
        let color = from.get(&format!("results/frame{i:06}.png")).unwrap();
        let depth = from.get(&format!("results/depth{i:06}.png")).unwrap();
        let label = from.get(&format!("semantic_class/semantic_class_{i:06}.png")).unwrap();
        let (c, d) = match layout {
            Layout::ReplicaNice => {
                (format!("results/frame{i:06}.png"), format!("results/depth{i:06}.png"))
            }
            Layout::ReplicaVmap => (format!("rgb/rgb_{i}.png"), format!("depth/depth_{i}.png")),
            Layout::Tum => (format!("rgb/{i}.png"), format!("depth/{i}.png")),
            Layout::SevenScenes => {
                to.insert(format!("frame-{i:06}.pose.txt"), line.replace(' ', "\n"));
                (format!("frame-{i:06}.color.png"), format!("frame-{i:06}.depth.png"))
            }
            Layout::ScanNet => {
                to.insert(format!("pose/{i}.txt"), line);
                (format!("color/{i}.png"), format!("depth/{i}.png"))
            }
            Layout::Stray => (format!("rgb/{i:06}.png"), format!("depth/{i:06}.png")),
            Layout::Polycam => {
                let (c, turned) = (info().camera, frame(i).truth.unwrap().with_flipped_camera());
                let mut json = serde_json::json!({
                    "fx": c.fx, "fy": c.fy, "cx": c.cx + 0.5, "cy": c.cy + 0.5,
                });
                for (k, x) in turned.to_row_major()[..12].iter().enumerate() {
                    json[format!("t_{}{}", k / 4, k % 4)] = (*x).into();
                }
                to.insert(format!("keyframes/cameras/{i}.json"), json.to_string());
                (format!("keyframes/images/{i}.png"), format!("keyframes/depth/{i}.png"))
            }
            Layout::Images => (format!("rgb/view{i}.png"), format!("depth/view{i}.png")),
            Layout::Nerfstudio => {
                let turned = frame(i).truth.unwrap().with_flipped_camera().to_row_major();
                let rows: Vec<&[f64]> = turned.chunks(4).collect();
                let (c, d) = (format!("images/{i}.png"), format!("depth/{i}.png"));
                let one = serde_json::json!({
                    "file_path": c, "depth_file_path": d, "transform_matrix": rows,
                });
                // Listed from the last to the first.
                nerf_frames.insert(0, one);
                (c, d)
            }
            Layout::Sens => unreachable!("made above"),
        };
        let time = 100.0 + i as f64 / 30.0;
        rgb_list += &format!("{time:.4} {c}\n");
        depth_list += &format!("{:.4} {d}\n", time + 0.004);
        let pose = frame(i).truth.unwrap();
        let (t, q) = (pose.translation, pose.quaternion());
        let tq = [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(|x| x.to_string()).join(" ");
        truth += &format!("{:.4} {tq}\n", time - 0.003);
        odometry += &format!("{time:.4}, {i:06}, {}\n", tq.replace(' ', ", "));
        to.insert(c, color);
        to.insert(d, depth);
        to.insert(format!("semantic_class/semantic_class_{i}.png"), label);
    }
    match layout {
        Layout::Tum => {
            to.insert("rgb.txt", format!("# colour\n{rgb_list}"));
            to.insert("depth.txt", format!("# depth\r\n{depth_list}"));
            to.insert("groundtruth.txt", truth);
        }
        Layout::SevenScenes | Layout::ScanNet | Layout::Sens | Layout::Polycam => {}
        Layout::Stray => {
            to.insert("odometry.csv", odometry);
            to.insert("camera_matrix.csv", "20, 0, 11.5\n0, 21, 7.25\n0, 0, 1\n");
        }
        Layout::ReplicaNice | Layout::ReplicaVmap => to.insert("traj.txt", poses),
        Layout::Images => {
            to.insert("poses.txt", poses);
            let c = info().camera;
            let json = serde_json::json!({
                "w": c.width, "h": c.height, "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy,
                "depth_scale": 5000,
            });
            to.insert("intrinsics.json", json.to_string());
        }
        Layout::Nerfstudio => {
            let c = info().camera;
            let json = serde_json::json!({
                "camera_model": "OPENCV", "w": c.width, "h": c.height, "fl_x": c.fx, "fl_y": c.fy,
                "cx": c.cx + 0.5, "cy": c.cy + 0.5, "integer_depth_scale": 1.0 / 5000.0,
                "frames": nerf_frames,
            });
            to.insert("transforms.json", json.to_string());
        }
    }
    if matches!(layout, Layout::Images | Layout::Nerfstudio) {
        for file in ["classes.json", "bound.json"] {
            to.insert(file, from.get(file).unwrap());
        }
        return to;
    }
    for file in ["cam_params.json", "classes.json", "bound.json"] {
        to.insert(file, from.get(file).unwrap());
    }
    to
}

/// Returns the same packed, with labels beside it.
pub fn sens(n: usize) -> MemorySource {
    let (mut m, mut packed) = (MemorySource::new("tiny"), Vec::new());
    let info = SequenceInfo { frames: n, ..info() };
    let sink = |name: &str, bytes: &[u8]| {
        m.insert(name, bytes);
        Ok(())
    };
    let mut writer = SensWriter::new(&info, ColorFormat::Png, "tiny.sens", &mut packed, sink);
    for i in 0..n {
        writer.write(&frame(i)).unwrap();
    }
    assert_eq!(writer.finish().unwrap(), n);
    m.insert("tiny.sens", packed);
    m
}

/// Opens with default options.
pub fn opened(m: &MemorySource) -> Result<Box<dyn Sequence>, SequenceError> {
    open(Box::new(m.clone()), OpenOptions::default())
}

/// Returns the error of opening or of reading the frames, as text.
pub fn error_of(m: &MemorySource, options: OpenOptions) -> String {
    let mut sequence = match open(Box::new(m.clone()), options) {
        Ok(sequence) => sequence,
        Err(e) => return e.to_string(),
    };
    for i in 0..sequence.info().frames {
        if let Err(e) = sequence.frame(i) {
            return e.to_string();
        }
    }
    panic!("no error");
}
