//! `mte-slam render`.
use crate::{
    args::RenderArgs,
    output::{folder::replace_file, trajectory::read_tum},
    restore::restore,
    screen::Screen,
    views::{shown_classes, write_view},
};
use anyhow::{Context, Result, bail};
use mte_slam_types::pose::Pose;
use pollster::block_on;

/// Renders a map from a checkpoint.
pub fn run(args: &RenderArgs, screen: Screen) -> Result<()> {
    // What can be wrong with a file of poses comes before anything slow.
    let mut views = chosen_poses(args)?;
    let mut slam = restore(&args.out, &args.engine, screen)?;
    if let Some(frame) = args.from.frame {
        let estimates = slam.trajectory();
        let Some(estimate) = estimates.get(frame) else {
            bail!(
                "--frame: found {frame}, expected one of the {} frames of {}, counted from 0",
                estimates.len(),
                args.out.display()
            );
        };
        views.push((format!("renders/{frame:06}"), estimate.world_from_camera));
    }
    let camera = slam.info().camera;
    let classes = shown_classes(&slam);
    let mut names = Vec::new();
    let mut progress = screen.progress("rendering", views.len());
    for (i, (stem, pose)) in views.iter().enumerate() {
        let view = block_on(slam.render(pose, &camera)).with_context(|| format!("view {stem}"))?;
        write_view(&view, &classes, &mut |kind, bytes| {
            let path = args.out.join(format!("{stem}.{kind}.png"));
            names.push(path.display().to_string());
            replace_file(&path, bytes)
        })?;
        progress.set(i as u64 + 1, String::new);
    }
    progress.finish();
    let mut json = serde_json::json!({ "files": names });
    if let Some(frame) = args.from.frame {
        json["frame"] = frame.into();
    }
    screen.result(&format!("{}\n", names.join("\n")), &format!("{json:#}\n"));
    Ok(())
}

/// Names of the pictures, below OUT, and poses of `--pose` or `--path`.
fn chosen_poses(args: &RenderArgs) -> Result<Vec<(String, Pose)>> {
    if let Some(pose) = args.from.pose {
        return Ok(vec![("views/pose".to_owned(), pose)]);
    }
    let Some(path) = &args.from.path else { return Ok(Vec::new()) };
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    let poses = read_tum(&name, &text)?;
    if poses.is_empty() {
        bail!("{name}: found no poses, expected lines of t tx ty tz qx qy qz qw");
    }
    let named = |(i, (_, pose)): (usize, &(f64, Pose))| (format!("views/{i:06}"), *pose);
    Ok(poses.iter().enumerate().map(named).collect())
}
