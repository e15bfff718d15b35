//! Writes views of rooms with their labels as arrays, for the training of a segmentation network.
//!
//! `training_views OUT SCENES VIEWS WIDTHxHEIGHT [pairs]`: SCENES is a range of seeds of varied
//! rooms as `0..400`, `room` or `office`. For each scene, VIEWS views evenly spread along its
//! camera's path; with `pairs` each is followed by its next frame. The same arguments write the
//! same bytes.
//!
//! Per scene NAME, in NumPy's format: `NAME.color.npy` (views, height, width, 3) sRGB,
//! `NAME.label.npy` (views, height, width) compact classes, `NAME.depth.npy` (views, height,
//! width) in units of `classes.json`'s `depth_unit_m`, `NAME.pose.npy` (views, 4, 4) camera to world,
//! `NAME.camera.npy` (4) fx, fy, cx, cy. `classes.json` names the classes and says whether views come
//! in pairs.
use mte_slam_synth::{
    SceneKind, SyntheticOptions, SyntheticSequence, VariedOptions, VariedSequence,
};
use mte_slam_types::sequence::Sequence;
use std::{error::Error, fs, path::Path, process::ExitCode};

const USAGE: &str =
    "usage: training_views OUT (FIRST..END | room | office) VIEWS WIDTHxHEIGHT [pairs]";
/// Frames of a built-in scene that views are spread over: about one round of its camera's path.
const BUILT_IN_FRAMES: usize = 290;

/// What to render: rooms of these seeds, or a built-in scene.
enum Scenes {
    Varied(std::ops::Range<u64>),
    BuiltIn(SceneKind),
}

struct Arguments {
    out: String,
    scenes: Scenes,
    views: usize,
    size: [u32; 2],
    pairs: bool,
}

fn parse(arguments: &[String]) -> Option<Arguments> {
    let (out, scenes, views, size, pairs) = match arguments {
        [out, scenes, views, size] => (out, scenes, views, size, false),
        [out, scenes, views, size, last] if last == "pairs" => (out, scenes, views, size, true),
        _ => return None,
    };
    let scenes = match scenes.as_str() {
        "room" => Scenes::BuiltIn(SceneKind::Room),
        "office" => Scenes::BuiltIn(SceneKind::Office),
        range => {
            let (first, end) = range.split_once("..")?;
            let seeds = first.parse().ok()?..end.parse().ok()?;
            (!seeds.is_empty()).then_some(Scenes::Varied(seeds))?
        }
    };
    let (width, height) = size.split_once('x')?;
    let size = [width.parse().ok()?, height.parse().ok()?];
    let views = views.parse().ok().filter(|v| (1..=1000).contains(v))?;
    let in_range = size.iter().all(|s| (8..=4096).contains(s));
    in_range.then(|| Arguments { out: out.clone(), scenes, views, size, pairs })
}

/// Writes an array in NumPy's format, version 1.0.
fn save(file: &Path, kind: &str, shape: &[usize], data: &[u8]) -> std::io::Result<()> {
    let sizes: String = shape.iter().map(|n| format!("{n},")).collect();
    let dict = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({sizes}), }}");
    // The header ends with a line feed at a multiple of 64 bytes.
    let length = (10 + dict.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{dict:<width$}\n", width = length - 1).bytes());
    bytes.extend(data);
    fs::write(file, bytes)
}

fn write_scene(
    out: &Path,
    name: &str,
    scene: &mut dyn Sequence,
    arguments: &Arguments,
) -> Result<(), Box<dyn Error>> {
    let frames = scene.info().frames;
    let mut indices = Vec::new();
    for view in 0..arguments.views {
        let first = view * frames / arguments.views;
        indices.push(first);
        if arguments.pairs {
            indices.push((first + 1) % frames);
        }
    }
    let (mut color, mut label, mut depth, mut pose) = (vec![], vec![], vec![], vec![]);
    for &index in &indices {
        let frame = scene.frame(index)?;
        color.extend(frame.color.as_flattened());
        label.extend(frame.labels.iter().flatten());
        depth.extend(frame.depth.iter().flat_map(|d| d.to_le_bytes()));
        let matrix = frame.truth.ok_or("a frame without a pose")?.to_row_major();
        pose.extend(matrix.iter().flat_map(|v| v.to_le_bytes()));
    }
    let camera = scene.info().camera;
    let (n, h, w) = (indices.len(), camera.height as usize, camera.width as usize);
    let file = |part: &str| out.join(format!("{name}.{part}.npy"));
    save(&file("color"), "|u1", &[n, h, w, 3], &color)?;
    save(&file("label"), "|u1", &[n, h, w], &label)?;
    save(&file("depth"), "<u2", &[n, h, w], &depth)?;
    save(&file("pose"), "<f8", &[n, 4, 4], &pose)?;
    let intrinsics = [camera.fx, camera.fy, camera.cx, camera.cy].map(f64::to_le_bytes);
    save(&file("camera"), "<f8", &[4], intrinsics.as_flattened())?;
    Ok(())
}

fn write_classes(out: &Path, scene: &dyn Sequence, pairs: bool) -> std::io::Result<()> {
    let info = scene.info();
    let list =
        |f: &dyn Fn(usize) -> String| (0..info.classes.len()).map(f).collect::<Vec<_>>().join(", ");
    let names = list(&|i| format!("\"{}\"", info.classes.classes[i].name));
    let raw = list(&|i| info.classes.classes[i].raw_id.to_string());
    let colors = list(&|i| format!("{:?}", info.classes.classes[i].color));
    let unit = info.depth_unit_m;
    let text = format!(
        "{{\"names\": [{names}], \"raw_ids\": [{raw}], \"colors\": [{colors}], \"depth_unit_m\": {unit}, \"pairs\": {pairs}}}\n"
    );
    fs::write(out.join("classes.json"), text)
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let out = Path::new(&arguments.out);
    fs::create_dir_all(out)?;
    let [width, height] = arguments.size;
    match &arguments.scenes {
        Scenes::BuiltIn(kind) => {
            let options = SyntheticOptions {
                width,
                height,
                scene: *kind,
                frames: BUILT_IN_FRAMES,
                ..SyntheticOptions::default()
            };
            let mut scene = SyntheticSequence::new(options);
            write_classes(out, &scene, arguments.pairs)?;
            write_scene(out, kind.name(), &mut scene, arguments)?;
        }
        Scenes::Varied(seeds) => {
            for seed in seeds.clone() {
                let mut scene = VariedSequence::new(VariedOptions { width, height, seed });
                if seed == seeds.start {
                    write_classes(out, &scene, arguments.pairs)?;
                }
                write_scene(out, &format!("varied-{seed:06}"), &mut scene, arguments)?;
            }
        }
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(arguments) = parse(&arguments) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{}: {e}", arguments.out);
            ExitCode::FAILURE
        }
    }
}
