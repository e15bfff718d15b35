//! `mte-slam render`.
use crate::{
    args::RenderArgs,
    engine,
    output::{checkpoint, folder::replace_file, trajectory::read_tum},
    pipeline::write_view,
    screen::Screen,
};
use anyhow::{Context, Result, bail};
use mte_slam_core::slam::Slam;
use pollster::block_on;

/// Render a frame's pose from a checkpoint.
pub fn run(args: &RenderArgs, screen: Screen) -> Result<()> {
    let path = args.out.join("trajectory.txt");
    let name = path.display().to_string();
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("{name}: cannot be read; expected the output folder of a run"))?;
    let poses = read_tum(&name, &text)?;
    let Some((_, pose)) = poses.get(args.frame) else {
        bail!("--frame: found {}, expected 0 to {} ({name})", args.frame, poses.len() as i64 - 1);
    };
    let saved = checkpoint::read_file(&args.out.join("checkpoint.safetensors"))?;
    let described = checkpoint::described(&saved)?;
    let chosen = engine::start(&args.engine)?;
    screen.note(&format!("{}: {}", described.name, chosen.note));
    let mut slam = block_on(Slam::restore(chosen.engine, &saved))
        .with_context(|| format!("{}: the map cannot be restored", args.out.display()))?;
    let view = block_on(slam.render(pose, &described.camera))
        .with_context(|| format!("rendering frame {}", args.frame))?;
    let mut names = Vec::new();
    write_view(&view, &described.classes, &mut |kind, bytes| {
        let path = args.out.join(format!("renders/{:06}.{kind}.png", args.frame));
        names.push(path.display().to_string());
        replace_file(&path, bytes)
    })?;
    let json = serde_json::json!({ "frame": args.frame, "files": names });
    screen.result(&format!("{}\n", names.join("\n")), &format!("{json:#}\n"));
    Ok(())
}
