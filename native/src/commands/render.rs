//! `mte-slam render`.
use crate::{
    args::RenderArgs,
    output::folder::replace_file,
    pipeline::{restore, write_view},
    screen::Screen,
};
use anyhow::{Context, Result, bail};
use pollster::block_on;

/// Render a frame's pose from a checkpoint.
pub fn run(args: &RenderArgs, screen: Screen) -> Result<()> {
    let mut slam = restore(&args.out, &args.engine, screen)?;
    let estimates = slam.trajectory();
    let Some(estimate) = estimates.get(args.frame) else {
        bail!(
            "--frame: found {}, expected one of the {} frames of {}, counted from 0",
            args.frame,
            estimates.len(),
            args.out.display()
        );
    };
    let camera = slam.info().camera;
    let classes = slam.info().classes.clone();
    let view = block_on(slam.render(&estimate.world_from_camera, &camera))
        .with_context(|| format!("rendering frame {}", args.frame))?;
    let mut names = Vec::new();
    write_view(&view, &classes, &mut |kind, bytes| {
        let path = args.out.join(format!("renders/{:06}.{kind}.png", args.frame));
        names.push(path.display().to_string());
        replace_file(&path, bytes)
    })?;
    let json = serde_json::json!({ "frame": args.frame, "files": names });
    screen.result(&format!("{}\n", names.join("\n")), &format!("{json:#}\n"));
    Ok(())
}
