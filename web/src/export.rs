//! Files of a run.
use crate::{failure::Failure, message::*, run::OpenRun};
use mte_slam_core::slam::{PoseEstimate, TrackingStatus};
use mte_slam_mesh::{write_glb, write_glb_by_class, write_ply};
use mte_slam_metrics::ate;
use mte_slam_types::trajectory_file::write_tum;

impl OpenRun {
    pub async fn export(&mut self, export: &ExportCommand) -> Result<(), Failure> {
        let slam = self.run.slam_mut();
        let name = slam.info().name.clone();
        let failed = |e: &dyn std::fmt::Display| Failure::new(ErrorKind::Engine, e.to_string());
        let (suffix, mime, bytes) = match export.kind {
            ExportKind::Ply | ExportKind::Glb | ExportKind::GlbClasses => {
                let resolution = export.resolution_m.unwrap_or(slam.config().mesh.resolution_m);
                let page = &self.page;
                let mut report = |part: f64| page.progress("extracting the mesh", part, 1.0);
                let mesh = slam.extract_mesh(resolution, &mut report).await?;
                let classes = &slam.info().classes;
                let glb = "model/gltf-binary";
                match export.kind {
                    ExportKind::Ply => (
                        ".ply",
                        "application/octet-stream",
                        write_ply(&mesh).map_err(|e| failed(&e))?,
                    ),
                    ExportKind::Glb => (".glb", glb, write_glb(&mesh).map_err(|e| failed(&e))?),
                    _ => {
                        let bytes = write_glb_by_class(&mesh, classes).map_err(|e| failed(&e))?;
                        ("-classes.glb", glb, bytes)
                    }
                }
            }
            ExportKind::Trajectory => {
                let poses = slam.trajectory();
                let text = write_tum(poses.iter().map(|p| (p.time_s, p.world_from_camera)));
                ("-trajectory.txt", "text/plain", text.into_bytes())
            }
            ExportKind::Metrics => {
                ("-metrics.json", "application/json", self.metrics_json().into_bytes())
            }
            ExportKind::Checkpoint => {
                let saved = slam.checkpoint().await?;
                ("-checkpoint.safetensors", "application/octet-stream", saved.to_bytes())
            }
        };
        self.page.emit(&Event::Exported(ExportedEvent {
            kind: export.kind,
            name: format!("{name}{suffix}"),
            mime: mime.into(),
            bytes,
        }));
        Ok(())
    }

    fn metrics_json(&self) -> String {
        let slam = self.run.slam();
        let info = slam.info();
        let poses = slam.trajectory();
        let lost = |p: &PoseEstimate| (p.status == TrackingStatus::Lost).then_some(p.frame);
        let lost: Vec<usize> = poses.iter().filter_map(lost).collect();
        let frames: Vec<MetricsEvent> = self.figures.iter().map(|f| self.metrics(f)).collect();
        let value = serde_json::json!({
            "program": format!("mte-slam-web {}", env!("CARGO_PKG_VERSION")),
            "sequence": { "name": info.name, "layout": info.layout, "frames": info.frames,
                "width_pixels": info.camera.width, "height_pixels": info.camera.height },
            "engine": { "kind": self.engine.kind, "adapter": self.engine.adapter },
            "settings": self.settings,
            "configuration": slam.config(),
            "frames_processed": poses.len(),
            "lost_frames": lost,
            "trajectory": ate(&self.pose_pairs()).ok(),
            "frames": frames,
        });
        format!("{value:#}\n")
    }
}
