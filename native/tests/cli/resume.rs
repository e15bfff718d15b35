//! Runs that are killed at any moment, and gone on with, end with the same files. The length:
//! `MTE_SLAM_KILLS=20 cargo test -p mte-slam --test cli -- resume --nocapture` prints what happened.
use crate::{program::*, python};
use serde_json::Value;
use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

/// [`TINY`], long enough at its end to be killed there.
fn start(out: &str, every: &str, extra: &[&str]) -> Vec<String> {
    let longer =
        ["--set", "mapping.final_iterations=40", "--set", "mapping.semantic_iterations=200"];
    let rest = ["--checkpoint-every", every, "--out", out];
    let all = ["run", "room", "-q"].iter().chain(&TINY).chain(&longer).chain(&rest).chain(extra);
    all.map(|a| (*a).to_owned()).collect()
}

/// Starts the program and kills it after a time. Whether it had not ended by itself.
fn kill(folder: &Path, arguments: &[String], after: Duration) -> bool {
    let mut child = command(folder, arguments).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(after);
    let running = child.try_wait().unwrap().is_none();
    // SIGKILL on Unix, TerminateProcess on Windows: nothing of ours runs after it.
    child.kill().unwrap();
    child.wait().unwrap();
    running
}

/// The files of an output folder. Times, and the memory that was used, are not repeatable.
fn files(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut folders = vec![out.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(out).unwrap().to_string_lossy().into_owned();
            let mut bytes = fs::read(&path).unwrap();
            if name == "metrics.json" {
                let mut json: Value = serde_json::from_slice(&bytes).unwrap();
                json.as_object_mut().unwrap().remove("time").unwrap();
                json["memory"]["peak_host_bytes"] = Value::Null;
                bytes = json.to_string().into_bytes();
            }
            if name == "timings.csv" {
                let text = String::from_utf8(bytes).unwrap();
                let ends = text.lines().map(|l| {
                    let fields: Vec<&str> = l.split(',').collect();
                    format!("{},{}\n", fields[0], fields[4])
                });
                bytes = ends.collect::<String>().into_bytes();
            }
            all.insert(name, bytes);
        }
    }
    all
}

fn same(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) {
    assert!(a.keys().eq(b.keys()), "{:?} {:?}", a.keys(), b.keys());
    for (name, bytes) in a {
        assert!(*bytes == b[name], "{name} differs");
    }
}

fn recording() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &["synth", "room", "--frames", "10", "--width", "64"]);
    folder
}

/// SplitMix64 in parts of one.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn killed_at_random_moments_it_ends_with_the_same_files() {
    let folder = recording();
    let folder = folder.path();
    // Figures of the mesh take longer than the run; the test below compares them.
    fs::remove_file(folder.join("room/mesh.ply")).unwrap();
    let begin = Instant::now();
    succeed(folder, &start("whole", "0", &[]));
    let whole_s = begin.elapsed().as_secs_f64();
    let expected = files(&folder.join("whole"));
    assert!(expected.contains_key("trajectory.txt") && expected.contains_key("mesh.ply"));

    let kills = std::env::var("MTE_SLAM_KILLS").map_or(4, |n| n.parse::<usize>().unwrap());
    let mut state = 20;
    let (mut killed, mut runs, mut went_on) = (0, 0, 0);
    // At least one kill must leave something to go on from, however the machine's times fall.
    while killed < kills || went_on == 0 {
        assert!(runs < 20 + kills, "no kill came after a checkpoint");
        let out = format!("killed-{runs}");
        runs += 1;
        // Runs differ in how often they save; each is killed up to four times, then left alone.
        let every = ["1", "3", "1", "100"][runs % 4];
        let again = start(&out, every, &["--resume"]);
        for _ in 0..4 {
            let after = Duration::from_secs_f64(random(&mut state) * whole_s);
            if (killed >= kills && went_on > 0) || !kill(folder, &again, after) {
                break;
            }
            killed += 1;
            let saved = folder.join(&out).join(".resume/checkpoint.safetensors").is_file();
            went_on += usize::from(saved);
            println!("killed after {:.2} s, saved: {saved}", after.as_secs_f64());
        }
        let left = folder.join(&out).join(".resume/command.json");
        if left.is_file() {
            // In few words: all else is noted there.
            succeed(folder, &["run", "-q", "--resume", &out]);
        } else {
            succeed(folder, &again);
        }
        same(&files(&folder.join(&out)), &expected);
    }
    python_reads(&folder.join("whole"));
    println!(
        "{killed} kills in {runs} runs of {whole_s:.1} s, {went_on} with a checkpoint: same files"
    );
}

/// The format that a checkpoint says it has, such as `mte-slam-6`.
fn format_of(checkpoint: &[u8]) -> String {
    let (_, metadata) = safetensors::SafeTensors::read_metadata(checkpoint).unwrap();
    metadata.metadata().as_ref().unwrap()["format"].clone()
}

/// The example for Python reads the format of today and shows the run's path.
fn python_reads(out: &Path) {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/read_checkpoint.py");
    let checkpoint = out.join("checkpoint.safetensors");
    let expected = format!("FORMAT = \"{}\"\n", format_of(&fs::read(&checkpoint).unwrap()));
    let script = fs::read_to_string(&example).unwrap();
    assert!(script.contains(&expected), "{} needs {expected}", example.display());
    let Some(python) = python::with(&["numpy", "safetensors"]) else { return };
    let path = out.with_extension("path.txt");
    let output = Command::new(python).arg(example).arg(checkpoint).arg(&path).output().unwrap();
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(shown.contains("10 frames, 0 lost") && shown.contains("planes.semantic"), "{shown}");
    let numbers = |text: String| -> Vec<Vec<f64>> {
        let lines = text.lines().filter(|l| !l.starts_with('#')).map(str::to_owned);
        lines.map(|l| l.split(' ').take(4).map(|n| n.parse().unwrap()).collect()).collect()
    };
    let ours = numbers(fs::read_to_string(out.join("trajectory.txt")).unwrap());
    let theirs = numbers(fs::read_to_string(path).unwrap());
    assert_eq!(ours.len(), theirs.len());
    for (a, b) in ours.iter().flatten().zip(theirs.iter().flatten()) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

/// Leaves an interrupted run in `out`: one that was stopped after its first frame that is saved.
fn interrupted(folder: &Path, out: &str) {
    let saved = folder.join(out).join(".resume/checkpoint.safetensors");
    let mut child = command(folder, &start(out, "2", &[])).spawn().unwrap();
    let begin = Instant::now();
    while !saved.is_file() {
        assert!(begin.elapsed() < Duration::from_secs(120), "no checkpoint");
        assert!(child.try_wait().unwrap().is_none(), "ended without a checkpoint");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn what_does_not_fit_is_refused() {
    let folder = recording();
    let folder = folder.path();
    let resume = |extra: &[&str]| start("out", "2", &[&["--resume"][..], extra].concat());
    let short = ["run", "--resume", "out"];
    refused(folder, &short, 2, &["no interrupted run", "out"]);
    refused(folder, &["run", "--resume", "--out", "x"], 2, &["DATASET"]);
    interrupted(folder, "out");

    let other = resume(&["--set", "mapping.rays=401"]);
    refused(folder, &other, 1, &["configuration.mapping.rays", "found 401", "expected 400"]);
    refused(
        folder,
        &resume(&["--stride", "2"]),
        2,
        &["stride", "found a run with 1", "expected 2"],
    );
    // Another recording under the same name.
    fs::rename(folder.join("room"), folder.join("kept")).unwrap();
    succeed(folder, &["synth", "room", "--frames", "10", "--width", "64"]);
    let first = first_color(&folder.join("room"));
    let image = image::open(&first).unwrap().to_rgb8();
    let mut changed = image.clone();
    changed.get_pixel_mut(3, 3).0[0] ^= 0x80;
    changed.save(&first).unwrap();
    refused(folder, &short, 1, &["data: frame 0", "same recording"]);
    fs::remove_dir_all(folder.join("room")).unwrap();
    fs::rename(folder.join("kept"), folder.join("room")).unwrap();

    let path = folder.join("out/.resume/checkpoint.safetensors");
    let bytes = fs::read(&path).unwrap();
    let text = String::from_utf8_lossy(&bytes[..200]).into_owned();
    assert!(text.contains("__metadata__"), "{text}");
    fs::write(&path, &bytes[..bytes.len() - 1000]).unwrap();
    refused(folder, &short, 1, &["checkpoint.safetensors", "cut off", "without --resume"]);
    let mut flipped = bytes.clone();
    let at = flipped.len() - 77;
    flipped[at] ^= 4;
    fs::write(&path, &flipped).unwrap();
    refused(folder, &short, 1, &["checksum", "damaged"]);
    let mut version = bytes.clone();
    let at = find(&version, format_of(&bytes).as_bytes());
    version[at] = b'M';
    fs::write(&path, &version).unwrap();
    refused(folder, &short, 1, &["checkpoint.safetensors"]);

    // Nothing of all that has spoiled the run.
    fs::write(&path, &bytes).unwrap();
    succeed(folder, &short);
    assert!(!folder.join("out/.resume").exists());
    let finished = files(&folder.join("out"));
    succeed(folder, &start("whole", "0", &[]));
    same(&finished, &files(&folder.join("whole")));

    // A second start does nothing; one of another kind is refused; without --resume it is replaced.
    let begin = fs::metadata(folder.join("out/metrics.json")).unwrap().modified().unwrap();
    succeed(folder, &resume(&[]));
    let end = fs::metadata(folder.join("out/metrics.json")).unwrap().modified().unwrap();
    assert_eq!(begin, end, "nothing was written");
    refused(folder, &resume(&["--seed", "9"]), 2, &["finished run of another kind"]);
    refused(folder, &short, 2, &["no interrupted run", "finished"]);
}

fn first_color(room: &Path) -> std::path::PathBuf {
    let mut all: Vec<_> = fs::read_dir(room.join("results"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.file_name().unwrap().to_string_lossy().starts_with("frame"))
        .collect();
    all.sort();
    all.swap_remove(0)
}

fn find(bytes: &[u8], part: &[u8]) -> usize {
    bytes.windows(part.len()).position(|w| w == part).expect("part of the file")
}
