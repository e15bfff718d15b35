//! A tiny recording in every layout, for tests.
use mte_slam_dataset::{
    ColorFormat, Layout, MemorySource, RecordingWriter, ReplicaWriter, SensWriter, TumWriter,
};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    frame::{Frame, SequenceInfo},
    sequence::Sequence,
};
use std::io::{Cursor, Write};

const FRAMES: usize = 3;

fn room() -> (SequenceInfo, Vec<Frame>) {
    let options = SyntheticOptions { frames: FRAMES, width: 32, height: 24, ..Default::default() };
    let mut room = SyntheticSequence::new(options);
    (room.info().clone(), (0..FRAMES).map(|i| room.frame(i).unwrap()).collect())
}

/// Returns the files of one layout.
pub fn recording(layout: Layout) -> MemorySource {
    let (info, frames) = room();
    let mut files = MemorySource::new("room");
    let mut packed = Vec::new();
    let sink = |name: &str, bytes: &[u8]| {
        files.insert(name, bytes);
        Ok(())
    };
    let color = ColorFormat::Jpeg;
    match layout {
        Layout::Tum => all(TumWriter::new(&info, color, sink), &frames),
        Layout::Sens => {
            all(SensWriter::new(&info, color, "room.sens", &mut packed, sink), &frames);
            files.insert("room.sens", packed);
        }
        _ => all(ReplicaWriter::new(&info, color, sink), &frames),
    }
    if matches!(layout, Layout::ReplicaNice | Layout::Tum | Layout::Sens) {
        return files;
    }
    let mut other = MemorySource::new("room");
    let move_file = |to: &mut MemorySource, from: &str, name: String| {
        to.insert(name, files.get(from).unwrap());
    };
    let mut listed = Vec::new();
    for (i, frame) in frames.iter().enumerate() {
        let pose = frame.truth.unwrap();
        let line = pose.to_row_major().map(|x| x.to_string()).join(" ");
        let (color, depth) = match layout {
            Layout::ReplicaVmap => (format!("rgb/rgb_{i}.jpg"), format!("depth/depth_{i}.png")),
            Layout::SevenScenes => {
                other.insert(format!("frame-{i:06}.pose.txt"), line);
                (format!("frame-{i:06}.color.jpg"), format!("frame-{i:06}.depth.png"))
            }
            Layout::ScanNet => {
                other.insert(format!("pose/{i}.txt"), line);
                (format!("color/{i}.jpg"), format!("depth/{i}.png"))
            }
            Layout::Stray => (format!("rgb/{i:06}.jpg"), format!("depth/{i:06}.png")),
            Layout::Polycam => {
                let c = info.camera;
                let mut json =
                    serde_json::json!({ "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy });
                for (k, x) in pose.to_row_major()[..12].iter().enumerate() {
                    json[format!("t_{}{}", k / 4, k % 4)] = (*x).into();
                }
                other.insert(format!("keyframes/cameras/{i}.json"), json.to_string());
                (format!("keyframes/images/{i}.jpg"), format!("keyframes/depth/{i}.png"))
            }
            _ => (format!("images/{i}.jpg"), format!("depth/{i}.png")),
        };
        let turned = pose.with_flipped_camera().to_row_major();
        listed.push(serde_json::json!({
            "file_path": color, "depth_file_path": depth,
            "transform_matrix": turned.chunks(4).collect::<Vec<_>>(),
        }));
        move_file(&mut other, &format!("results/frame{i:06}.jpg"), color);
        move_file(&mut other, &format!("results/depth{i:06}.png"), depth);
        let labels = if layout == Layout::ScanNet { "label-filt" } else { "semantic_class" };
        let label = format!("semantic_class/semantic_class_{i:06}.png");
        move_file(&mut other, &label, format!("{labels}/{i}.png"));
    }
    let c = info.camera;
    match layout {
        Layout::Polycam => {}
        Layout::Stray => {
            let camera = format!("{}, 0, {}\n0, {}, {}\n0, 0, 1\n", c.fx, c.cx, c.fy, c.cy);
            other.insert("camera_matrix.csv", camera);
            let mut table = String::from("timestamp, frame, x, y, z, qx, qy, qz, qw\n");
            for (i, frame) in frames.iter().enumerate() {
                let pose = frame.truth.unwrap();
                let (t, q) = (pose.translation, pose.quaternion());
                let numbers = [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(|x| x.to_string());
                table += &format!("{}, {i:06}, {}\n", frame.time_s, numbers.join(", "));
            }
            other.insert("odometry.csv", table);
        }
        Layout::ScanNet => {
            let depth = format!("{} 0 {} 0 0 {} {} 0 0 0 1 0 0 0 0 1", c.fx, c.cx, c.fy, c.cy);
            other.insert("intrinsic/intrinsic_depth.txt", depth);
            let rows: String = (0..60).map(|i| format!("{i}\tx\t{}\n", i % 41)).collect();
            other.insert("scannetv2-labels.combined.tsv", format!("id\tname\tnyu40id\n{rows}"));
        }
        Layout::Nerfstudio => {
            let json = serde_json::json!({
                "w": c.width, "h": c.height, "fl_x": c.fx, "fl_y": c.fy, "cx": c.cx, "cy": c.cy,
                "frames": listed,
            });
            other.insert("transforms.json", json.to_string());
        }
        Layout::Images => {
            let json = serde_json::json!({ "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy });
            other.insert("intrinsics.json", json.to_string());
            move_file(&mut other, "traj.txt", "poses.txt".into());
        }
        _ => {
            for file in ["traj.txt", "cam_params.json", "classes.json", "bound.json"] {
                move_file(&mut other, file, file.into());
            }
        }
    }
    other
}

fn all(mut writer: impl RecordingWriter, frames: &[Frame]) {
    frames.iter().for_each(|f| writer.write(f).unwrap());
    assert_eq!(writer.finish().unwrap(), frames.len());
}

/// Returns the files in a zip archive, below one folder.
pub fn archive(files: &MemorySource, method: zip::CompressionMethod) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    for name in files.names() {
        archive.start_file(format!("room/{name}"), options).unwrap();
        archive.write_all(files.get(name).unwrap()).unwrap();
    }
    archive.finish().unwrap().into_inner()
}
