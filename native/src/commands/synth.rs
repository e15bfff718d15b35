//! `mte-slam synth`: the built-in sequence as files, in the layout of NICE-SLAM's Replica render.
use crate::{
    args::{SceneChoice, SynthArgs},
    screen::Screen,
    synthetic,
};
use anyhow::Result;
use mte_slam_synth::{SceneKind, SyntheticOptions};

/// Writes the built-in sequence to a folder.
pub fn run(args: &SynthArgs, screen: Screen) -> Result<()> {
    let scene = match args.scene {
        SceneChoice::Room => SceneKind::Room,
        SceneChoice::Office => SceneKind::Office,
        SceneChoice::Hall => SceneKind::Hall,
    };
    let (width, height) = (args.width, args.width / 4 * 3);
    let frames = args.frames;
    let options = SyntheticOptions { frames, width, height, scene, ..Default::default() };
    let mut progress = screen.progress("writing frames", args.frames);
    let written = |done: usize| progress.set(done as u64, String::new);
    let info = synthetic::write(&args.dir, options, args.novel, written)?;
    progress.finish();
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
