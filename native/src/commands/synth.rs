//! `mte-slam synth`: the built-in sequence as files, in the layout of NICE-SLAM's Replica render.
use crate::{
    args::{SceneChoice, SynthArgs},
    input, novel,
    output::new_folder::NewFolder,
    screen::Screen,
};
use anyhow::{Context, Result};
use mte_slam_core::{
    dataset::{ColorFormat, RecordingWriter, ReplicaWriter},
    mesh::write_ply,
    sequence::Sequence,
    synth::{SceneKind, SyntheticOptions, SyntheticSequence},
};

/// Write the built-in sequence to a folder.
pub fn run(args: &SynthArgs, screen: Screen) -> Result<()> {
    let target = NewFolder::prepare(&args.dir)?;
    let scene = match args.scene {
        SceneChoice::Room => SceneKind::Room,
        SceneChoice::Office => SceneKind::Office,
        SceneChoice::Hall => SceneKind::Hall,
    };
    let (width, height) = (args.width, args.width / 4 * 3);
    let frames = args.frames;
    let options = SyntheticOptions { frames, width, height, scene, ..Default::default() };
    let mut sequence = SyntheticSequence::new(options);
    let info = sequence.info().clone();
    let mut progress = screen.progress("writing frames", args.frames);
    // PNG, so that a run on the files sees exactly what `demo` sees.
    let mut writer =
        ReplicaWriter::new(&info, ColorFormat::Png, |name, bytes| target.write(name, bytes));
    for index in 0..args.frames {
        writer.write(&sequence.frame(index)?)?;
        progress.set(index as u64 + 1, String::new);
    }
    writer.finish()?;
    progress.finish();
    novel::write(&mut sequence, args.novel, &mut |name, bytes| target.write(name, bytes))?;
    let mesh = input::true_mesh(sequence.ground_truth_mesh()).mesh;
    let ply = write_ply(&mesh).context("the true mesh cannot be written")?;
    target.write("mesh.ply", &ply).context("mesh.ply: cannot be written")?;
    target.publish()?;
    let json = serde_json::json!({ "folder": args.dir, "frames": args.frames });
    let text = format!(
        "{} frames of {}x{} written to {dir}; next: mte-slam run {dir}\n",
        args.frames,
        info.camera.width,
        info.camera.height,
        dir = args.dir.display()
    );
    screen.result(&text, &format!("{json:#}\n"));
    Ok(())
}
