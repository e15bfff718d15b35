//! `mte-slam synth`: a built-in sequence as files, in the layout of NICE-SLAM's Replica render.
use crate::{
    args::{SynthArgs, SynthScene},
    input,
    screen::Screen,
};
use anyhow::Result;
use mte_slam_core::synth::{SceneKind, SyntheticOptions};

/// Write a built-in sequence to a folder.
pub fn run(args: &SynthArgs, screen: Screen) -> Result<()> {
    let options = SyntheticOptions {
        width: args.width,
        height: args.width / 4 * 3,
        frames: args.frames,
        seed: args.seed,
        scene: match args.scene {
            SynthScene::Room => SceneKind::Room,
            SynthScene::Office => SceneKind::Office,
        },
        depth_noise: args.depth_noise,
    };
    let mut progress = screen.progress("writing frames", args.frames);
    let info = input::write_synthetic(&args.dir, options, &mut |done| {
        progress.set(done as u64, String::new);
    })?;
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
