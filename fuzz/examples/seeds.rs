//! Writes a few small valid inputs of every target: `cargo run --example seeds -- CORPUS`.
use mte_slam_core::config::Config;
use mte_slam_dataset::{Layout, MemorySource};
use mte_slam_fuzz::{bundle::Bundle, state::Run};
use mte_slam_mesh::{Mesh, write_ply};
use mte_slam_types::{pose::Pose, trajectory_file::write_tum};
use recordings::{archive, recording};
use std::{fs, io, path::PathBuf};

#[path = "../../crates/dataset/tests/recordings/mod.rs"]
mod recordings;

/// Only what belongs to the first two frames, so that inputs stay small.
fn two_frames(layout: Layout) -> MemorySource {
    let mut files = recording(layout);
    let names: Vec<String> = files.names().map(String::from).collect();
    let third = |n: &&String| n.contains('2') && !n.ends_with(".json") && !n.ends_with(".sens");
    for name in names.iter().filter(third) {
        files.remove(name);
    }
    files
}

fn main() -> io::Result<()> {
    let root: PathBuf = std::env::args().nth(1).unwrap_or_else(|| "corpus".into()).into();
    let mut total = 0;
    let mut seed = |target: &str, name: &str, bytes: &[u8]| {
        total += bytes.len();
        fs::create_dir_all(root.join(target))?;
        fs::write(root.join(target).join(name), bytes)
    };
    for layout in Layout::ALL {
        let target = match layout {
            Layout::Tum | Layout::Nerfstudio => "lists",
            Layout::Sens => "sens",
            _ => "folders",
        };
        let bundle = Bundle::of(&two_frames(layout), [0; 4]);
        seed(target, layout.name(), &bundle.to_bytes())?;
    }
    let packed = Bundle::of(&two_frames(Layout::Sens), [0; 4]);
    // With a camera given, a folder of labels and half the size.
    let options = Bundle { options: [0, 1, 3, 3], ..packed };
    seed("sens", "options", &options.to_bytes())?;
    let small = two_frames(Layout::ScanNet);
    seed("archive", "stored", &archive(&small, zip::CompressionMethod::Stored))?;
    seed("archive", "deflated", &archive(&small, zip::CompressionMethod::Deflated))?;

    let room = recording(Layout::ReplicaNice);
    for (name, file) in [
        ("color", "results/frame000000.jpg"),
        ("depth", "results/depth000000.png"),
        ("labels", "semantic_class/semantic_class_000000.png"),
    ] {
        seed("images", name, room.get(file).expect("a file of the recording"))?;
    }
    for (name, dtype, values) in [("f4", "<f4", 4), ("f2", "<f2", 2)] {
        let text =
            format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': (2, 3, 4), }}\n");
        let length = (text.len() as u16).to_le_bytes();
        let npy = [&b"\0\x93NUMPY\x01\0"[..], &length, text.as_bytes(), &vec![0; 24 * values]];
        seed("features", &format!("npy_{name}"), &npy.concat())?;
        let dtype = if values == 4 { "F32" } else { "F16" };
        let text = format!(
            r#"{{"features":{{"dtype":"{dtype}","shape":[2,3,4],"data_offsets":[0,{}]}}}}"#,
            24 * values
        );
        let length = (text.len() as u64).to_le_bytes();
        let tensors = [&b"\x01"[..], &length, text.as_bytes(), &vec![0; 24 * values]];
        seed("features", &format!("safetensors_{name}"), &tensors.concat())?;
    }
    let text = |which: u8, text: &str| [&[which], text.as_bytes()].concat();
    let classes = String::from_utf8_lossy(room.get("classes.json").expect("classes")).into_owned();
    let classes = classes.chars().take(200).collect::<String>();
    let (closed, _) = classes.rsplit_once("},").unwrap_or((&classes, ""));
    seed("texts", "classes", &text(0, &format!("{closed}}}}}")))?;
    let pose = Pose::from_twist(&[0.3, -2.0, 1.0, 0.4, -0.2, 3.1]);
    let poses = [(0.5, pose), (1341841278.8427, pose)];
    seed("texts", "trajectory", &text(1, &write_tum(poses.into_iter())))?;
    let config = toml::to_string(&Config::default()).map_err(io::Error::other)?;
    seed("texts", "config", &text(2, &format!("{config}\n[run]\npreset = \"tum\"\n")))?;
    seed("texts", "set", &text(3, "seed=7\ntracking.tracker=render\nmapping.rays=99\n"))?;

    let mesh = Mesh {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 3],
        colors: vec![[1, 2, 3]; 3],
        classes: vec![0, 1, 255],
        triangles: vec![[0, 1, 2]],
    };
    seed("mesh", "binary", &write_ply(&mesh).map_err(io::Error::other)?)?;
    let ascii = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty float y\n\
        property float z\nproperty float red\nproperty float green\nproperty float blue\n\
        element face 1\nproperty list uchar uint vertex_index\nend_header\n\
        0 0 0 1 0.5 0\n1 0 0 0 0 0\n1 1 0 0 0 0\n3 0 1 2\n";
    seed("mesh", "ascii", ascii.as_bytes())?;

    let run = Run::new();
    seed("resume", "run", &run.bundle().to_bytes())?;
    seed("checkpoint", "run", &run.small_file())?;
    println!("{total} bytes of seeds in {}", root.display());
    Ok(())
}
