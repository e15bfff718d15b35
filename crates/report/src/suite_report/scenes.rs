//! The report's part by scene: paths, errors over time, times, class maps, meshes.
use super::{
    charts::{self, Bar, COLORS, Path, Series},
    document::{Block, Picture},
    embedded,
    results::{Results, RunResult},
};
use crate::{evaluation, files::replace_file, suite::plan::Plan, trajectory::read_tum};
use anyhow::{Context, Result, bail};
use glam::DVec3;
use mte_slam_metrics::PosePair;
use mte_slam_types::pose::Pose;
use std::{fs, path::PathBuf};

/// Time stamps that differ by less name the same frame \[s\].
const SAME_STAMP_S: f64 = 1e-5;
/// Comparison sheets are put into the page no wider than this \[pixels\].
const SHEET_WIDTH: u32 = 1400;
/// Class maps likewise.
const MAP_WIDTH: u32 = 520;

/// Pictures of every scene that has a finished run; `say` receives what cannot be shown.
pub fn blocks(plan: &Plan, results: &Results, say: &mut dyn FnMut(String)) -> Vec<Block> {
    let mut blocks = Vec::new();
    let suite = &plan.suite;
    for scene in &suite.scenes {
        let mut rows: Vec<Row> = Vec::new();
        for preset in &suite.presets {
            for ablation in &suite.ablations {
                let part = (scene.name.as_str(), preset.as_str(), ablation.name.as_str());
                let runs: Vec<&RunResult> = results.of(part).collect();
                if !runs.is_empty() {
                    rows.push(Row::new(format!("{preset}, {}", ablation.name), runs, say));
                }
            }
        }
        if rows.is_empty() {
            continue;
        }
        if blocks.is_empty() {
            blocks.push(Block::Heading(2, "Scenes".to_owned()));
        }
        blocks.push(Block::Heading(3, scene.name.clone()));
        blocks.push(Block::Text(described(rows[0].runs[0])));
        blocks.push(Block::Figures(scene_pictures(plan, &rows, say)));
    }
    blocks
}

/// What was read, in a line.
fn described(run: &RunResult) -> String {
    let s = &run.sequence;
    let number = |key: &str| s[key].as_u64().unwrap_or(0);
    let text = |key: &str| s[key].as_str().unwrap_or("?").to_owned();
    let classes = match number("classes") {
        0 => "no labels".to_owned(),
        n => format!(
            "{n} classes (labels: {}; scored against: {})",
            text("labels"),
            text("truth_labels")
        ),
    };
    let mut line = format!(
        "{} frames of {}x{} pixels ({}), {classes}.",
        number("frames"),
        number("width_pixels"),
        number("height_pixels"),
        text("layout")
    );
    if let Some(first) = run.warnings.first() {
        line += &format!(" Note: {}.", first.trim_end_matches('.'));
    }
    for (section, reason) in &run.absent {
        line += &format!(" No {section}: {reason}.");
    }
    line
}

/// The runs of one preset and ablation, seed by seed.
struct Row<'a> {
    name: String,
    runs: Vec<&'a RunResult>,
    tracks: Vec<Option<Track>>,
    timings: Vec<Timings>,
}

impl<'a> Row<'a> {
    fn new(name: String, runs: Vec<&'a RunResult>, say: &mut dyn FnMut(String)) -> Row<'a> {
        let mut read = |run: &RunResult| match Track::read(run) {
            Ok(track) => Some(track),
            Err(error) => {
                say(format!("{}: {error:#}", run.name));
                None
            }
        };
        let tracks = runs.iter().map(|run| read(run)).collect();
        let timings = runs.iter().map(|run| Timings::read(run)).collect();
        Row { name, runs, tracks, timings }
    }
}

/// A trajectory, brought onto the truth where there is one.
struct Track {
    /// Camera centres \[m\].
    estimate: Vec<DVec3>,
    /// True ones, of the frames that have one \[m\].
    truth: Vec<DVec3>,
    /// Number of the frame and its error after alignment \[cm\].
    errors: Vec<(f64, f64)>,
    /// Poses as estimated.
    poses: Vec<Pose>,
    /// Mean upward direction of the cameras.
    up: DVec3,
}

impl Track {
    fn read(run: &RunResult) -> Result<Track> {
        let read = |name: &str| -> Result<Vec<(f64, Pose)>> {
            let path = run.folder.join(name);
            let name = path.display().to_string();
            let text =
                fs::read_to_string(&path).with_context(|| format!("{name}: cannot be read"))?;
            read_tum(&name, &text)
        };
        let estimates = read("trajectory.txt")?;
        let has_truth = run.folder.join("trajectory_gt.txt").is_file();
        let truth = if has_truth { read("trajectory_gt.txt")? } else { Vec::new() };
        let mut pairs = Vec::new();
        let mut at = 0;
        // Both files are in the order of the frames.
        for (i, (time_s, estimate)) in estimates.iter().enumerate() {
            let found = truth[at..].iter().position(|(t, _)| (t - time_s).abs() <= SAME_STAMP_S);
            if let Some(k) = found {
                pairs.push((i, PosePair { estimate: *estimate, truth: truth[at + k].1 }));
                at += k + 1;
            }
        }
        let only_pairs: Vec<PosePair> = pairs.iter().map(|(_, pair)| *pair).collect();
        let score = evaluation::trajectory_of_pairs(&only_pairs).ok();
        let aligned = score.map_or(Pose::IDENTITY, |s| s.truth_from_estimate);
        let centre = |p: &Pose| aligned.transform_point(p.translation);
        let errors = pairs
            .iter()
            .map(|(i, p)| {
                let error = centre(&p.estimate).distance(p.truth.translation);
                (*i as f64, 100.0 * error)
            })
            .collect();
        Ok(Track {
            estimate: estimates.iter().map(|(_, p)| centre(p)).collect(),
            truth: truth.iter().map(|(_, p)| p.translation).collect(),
            errors,
            up: estimates.iter().map(|(_, p)| -p.rotation.y_axis).sum(),
            poses: estimates.into_iter().map(|(_, p)| p).collect(),
        })
    }
}

/// Seconds of each frame: tracking, mapping, all.
struct Timings(Vec<[f64; 3]>);

impl Timings {
    fn read(run: &RunResult) -> Timings {
        let text = fs::read_to_string(run.folder.join("timings.csv")).unwrap_or_default();
        let row = |line: &str| -> Option<[f64; 3]> {
            let fields: Vec<f64> =
                line.split(',').skip(1).take(3).map_while(|f| f.parse().ok()).collect();
            fields.try_into().ok()
        };
        Timings(text.lines().skip(1).filter_map(row).collect())
    }

    /// Seconds of the whole run: tracking, mapping, the rest of the frames, all else.
    fn parts(&self, run: &RunResult) -> Vec<f64> {
        let sum = |k: usize| self.0.iter().map(|t| t[k]).sum::<f64>();
        let (tracking, mapping, frames) = (sum(0), sum(1), sum(2));
        let wall = run.figures.get("time.wall_s").map_or(frames, |f| f.value);
        vec![tracking, mapping, (frames - tracking - mapping).max(0.0), (wall - frames).max(0.0)]
    }
}

fn scene_pictures(plan: &Plan, rows: &[Row], say: &mut dyn FnMut(String)) -> Vec<Picture> {
    let mut shown = Vec::new();
    let chart = |caption: String, html: String, file: Option<String>| Picture {
        caption,
        html,
        file,
        wide: false,
    };
    for row in rows {
        let drawn: Vec<(&RunResult, &Track)> = row
            .runs
            .iter()
            .zip(&row.tracks)
            .filter_map(|(run, t)| Some((*run, t.as_ref()?)))
            .collect();
        let Some((first, track)) = drawn.first() else { continue };
        let mut paths = Vec::new();
        if !track.truth.is_empty() {
            let (name, points) = ("truth".to_owned(), track.truth.clone());
            paths.push(Path { name, color: None, points });
        }
        paths.extend(drawn.iter().enumerate().map(|(i, (run, t))| Path {
            name: format!("seed {}", run.seed),
            color: Some(i % COLORS),
            points: t.estimate.clone(),
        }));
        let aligned = if track.errors.is_empty() { "" } else { ", aligned to the truth" };
        shown.push(chart(
            format!("{}: camera paths{aligned}", row.name),
            charts::paths(&paths, track.up),
            file_of(plan, first, "trajectory.svg"),
        ));
        if !track.errors.is_empty() {
            let of = |(i, (run, t)): (usize, &(&RunResult, &Track))| Series {
                name: format!("seed {}", run.seed),
                color: i % COLORS,
                points: t.errors.clone(),
            };
            let series: Vec<Series> = drawn.iter().enumerate().map(of).collect();
            let caption = format!(
                "{}: distance of the camera from its true place, after rigid alignment of the \
                 whole path",
                row.name
            );
            shown.push(chart(caption, charts::lines("frame", "error [cm]", &series), None));
        }
        let frames = &row.timings[0].0;
        let series = |name: &str, color, k: usize| Series {
            name: name.to_owned(),
            color,
            points: frames.iter().enumerate().map(|(i, t)| (i as f64, t[k])).collect(),
        };
        if !frames.is_empty() {
            let all = [series("tracking", 0, 0), series("mapping", 1, 1)];
            let caption = format!("{}: seconds of each frame, seed {}", row.name, first.seed);
            shown.push(chart(caption, charts::lines("frame", "time [s]", &all), None));
        }
    }
    let bars: Vec<Bar> = rows
        .iter()
        .flat_map(|row| {
            let several = rows.len() > 1;
            row.runs.iter().zip(&row.timings).map(move |(run, timings)| Bar {
                name: match several {
                    true => format!("{}, seed {}", row.name, run.seed),
                    false => format!("seed {}", run.seed),
                },
                parts: timings.parts(run),
            })
        })
        .collect();
    let parts = ["tracking", "mapping", "rest of frames", "all else"];
    shown.push(chart(
        "Where the time of each run went; all else: reading images, the last optimisation, views, \
         mesh and evaluation"
            .to_owned(),
        charts::bars("seconds", &parts, &bars),
        None,
    ));
    for row in rows {
        shown.extend(pictures_of(plan, row, say));
    }
    shown
}

/// Class maps and the coloured mesh of a row's first seed.
fn pictures_of(plan: &Plan, row: &Row, say: &mut dyn FnMut(String)) -> Vec<Picture> {
    let run = row.runs[0];
    let mut shown = Vec::new();
    let mut note = |what: &str, error: anyhow::Error| {
        say(format!("{}: no {what}: {error:#}", run.name));
    };
    if let Some(frame) = middle_frame(run) {
        let name = format!("renders/{frame:06}.class_color.png");
        let path = run.folder.join(&name);
        if path.is_file() {
            match embedded::small(&path, MAP_WIDTH) {
                Ok(bytes) => shown.push(Picture {
                    caption: format!(
                        "{}: classes rendered at the estimated pose of frame {frame}, seed {}",
                        row.name, run.seed
                    ),
                    html: embedded::img(&bytes, "class map"),
                    file: file_of(plan, run, &name),
                    wide: false,
                }),
                Err(error) => note("class map", error),
            }
        }
        let name = format!("renders/{frame:06}.sheet.png");
        match embedded::small(&run.folder.join(&name), SHEET_WIDTH) {
            Ok(bytes) => shown.push(Picture {
                caption: format!(
                    "{}: input, map and error at frame {frame}, seed {}",
                    row.name, run.seed
                ),
                html: embedded::img(&bytes, "comparison of input and map"),
                file: file_of(plan, run, &name),
                wide: true,
            }),
            Err(error) => note("comparison", error),
        }
    }
    match mesh_picture(plan, row) {
        Ok(Some((bytes, file))) => shown.push(Picture {
            caption: format!(
                "{}: the mesh, not culled, coloured by its distance to the true one, from outside \
                 (surfaces that face away left out) and from a frame's pose; seed {}",
                row.name, run.seed
            ),
            html: embedded::img(&bytes, "mesh coloured by its error"),
            file: Some(file),
            wide: true,
        }),
        Ok(None) => {}
        Err(error) => note("picture of the mesh", error),
    }
    shown
}

/// Drawn once, and again when the run was made anew; `None` without a mesh or a true one.
fn mesh_picture(plan: &Plan, row: &Row) -> Result<Option<(Vec<u8>, String)>> {
    let run = row.runs[0];
    let mesh = run.folder.join("mesh.ply");
    if !mesh.is_file() || !run.mesh.is_file() {
        return Ok(None);
    }
    let Some(Some(track)) = row.tracks.first() else { return Ok(None) };
    let Some(pose) = track.poses.get(track.poses.len() / 2) else { bail!("found no pose") };
    let name = format!("pictures/{}.mesh_error.png", run.name);
    let path: PathBuf = plan.out.join(&name);
    let changed = |p: &std::path::Path| fs::metadata(p).and_then(|m| m.modified()).ok();
    let bytes = match (changed(&path), changed(&mesh)) {
        (Some(drawn), Some(made)) if drawn > made => {
            fs::read(&path).with_context(|| format!("{name}: cannot be read"))?
        }
        _ => {
            let bytes = embedded::mesh_error(run, pose, track.up)?;
            replace_file(&path, &bytes)?;
            bytes
        }
    };
    Ok(Some((bytes, name)))
}

/// The rendered frame nearest to the middle of the run.
fn middle_frame(run: &RunResult) -> Option<usize> {
    let frames: Vec<usize> = fs::read_dir(run.folder.join("renders"))
        .ok()?
        .filter_map(|e| {
            e.ok()?.file_name().to_string_lossy().strip_suffix(".sheet.png")?.parse().ok()
        })
        .collect();
    let middle = run.sequence["frames"].as_u64().unwrap_or(0) as usize / 2;
    frames.into_iter().min_by_key(|f| (f.abs_diff(middle), *f))
}

fn file_of(plan: &Plan, run: &RunResult, name: &str) -> Option<String> {
    let path = run.folder.join(name);
    let file = path.strip_prefix(&plan.out).ok()?;
    path.is_file().then(|| file.to_string_lossy().replace('\\', "/"))
}
