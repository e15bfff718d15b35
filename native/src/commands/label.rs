//! `mte-slam label`: a network's classes as files.
use crate::{
    args::LabelArgs, errors::usage, input, output::new_folder::NewFolder, screen::Screen,
    segmentation,
};
use anyhow::{Context, Result};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use mte_slam_report::draw::pictures::{class_png, unlabelled_id};
use mte_slam_segment::Segmented;
use mte_slam_types::{classes::UNLABELLED, sequence::Sequence};
use serde_json::json;
use std::time::Instant;

/// Writes label images.
pub fn run(args: &LabelArgs, screen: Screen) -> Result<()> {
    let Some(segmenter) = segmentation::open(&args.selection.segmentation, screen)? else {
        usage!("label: expected --segmenter MODEL");
    };
    let recording = input::open_recording(&args.dataset, &args.selection, screen)?;
    for text in recording.warnings() {
        screen.note(&format!("note: {text}"));
    }
    let mut sequence = Segmented::new(recording, segmenter, 1);
    let info = sequence.info().clone();
    let (w, h) = (info.camera.width, info.camera.height);
    let target = NewFolder::prepare(&args.out)?;
    let every = args.selection.segmentation.segment_every.unwrap_or(1);
    let frames: Vec<usize> = (0..info.frames).step_by(every).collect();
    let mut progress = screen.progress("labelling frames", frames.len());
    let mut pixels = vec![0u64; info.classes.len()];
    let mut labelled = 0u64;
    let begun = Instant::now();
    for (done, &index) in frames.iter().enumerate() {
        let number = sequence.number(index);
        let found = sequence.segmentation(index).with_context(|| info.name.clone())?;
        for &label in found.labels.iter().filter(|l| **l != UNLABELLED) {
            pixels[usize::from(label)] += 1;
            labelled += 1;
        }
        let png = class_png(w, h, &found.labels, &info.classes)?;
        target.write(&format!("semantic_class_{number:06}.png"), &png)?;
        let mut png = Vec::new();
        PngEncoder::new(&mut png).write_image(&found.confidence, w, h, ExtendedColorType::L8)?;
        target.write(&format!("confidence/{number:06}.png"), &png)?;
        progress.set(done as u64 + 1, String::new);
    }
    progress.finish();
    let seconds = begun.elapsed().as_secs_f64();
    let mut classes = serde_json::Map::new();
    for class in &info.classes.classes {
        let entry = json!({ "name": class.name, "color": class.color });
        classes.insert(class.raw_id.to_string(), entry);
    }
    let void = unlabelled_id(&info.classes);
    classes.insert(void.to_string(), json!({ "name": "void", "color": [0, 0, 0] }));
    let json = serde_json::to_string_pretty(&classes)? + "\n";
    target.write("classes.json", json.as_bytes())?;
    target.publish()?;

    let all = (frames.len() * info.camera.pixels()).max(1) as f64;
    let mut shares: Vec<(f64, &str)> = pixels
        .iter()
        .zip(&info.classes.classes)
        .filter(|(n, _)| **n > 0)
        .map(|(n, class)| (100.0 * *n as f64 / all, class.name.as_str()))
        .collect();
    shares.sort_by(|a, b| b.0.total_cmp(&a.0));
    let shown: Vec<String> =
        shares.iter().take(8).map(|(share, name)| format!("{name} {share:.1} %")).collect();
    let out = args.out.display();
    let text = format!(
        "{} frames labelled in {seconds:.1} s ({:.0} ms each, with reading and writing): {:.1} % of the pixels \
         in {} classes ({})\nwritten to {out}; next: mte-slam run {} --labels {out}\n",
        frames.len(),
        1000.0 * seconds / frames.len().max(1) as f64,
        100.0 * labelled as f64 / all,
        shares.len(),
        shown.join(", "),
        args.dataset.display(),
    );
    let json = json!({
        "folder": args.out, "frames": frames.len(), "seconds": seconds,
        "labelled_percent": 100.0 * labelled as f64 / all,
        "classes": shares.iter().map(|(s, n)| json!({"name": n, "percent": s})).collect::<Vec<_>>(),
    });
    screen.result(&text, &format!("{json:#}\n"));
    Ok(())
}
