//! Files of a run.
use crate::{
    events::{emit, progress},
    failure::Failure,
    message::*,
    run::Run,
};
use mte_slam_core::slam::TrackingStatus;
use mte_slam_mesh::{write_glb, write_glb_by_class, write_ply};
use mte_slam_metrics::{PosePair, ate};
use mte_slam_types::trajectory_file::write_tum;

impl Run {
    pub async fn export(&mut self, export: &ExportCommand) -> Result<(), Failure> {
        let name = self.slam.info().name.clone();
        let failed = |e: &dyn std::fmt::Display| Failure::new(ErrorKind::Engine, e.to_string());
        let (suffix, mime, bytes) = match export.kind {
            ExportKind::Ply | ExportKind::Glb | ExportKind::GlbClasses => {
                let resolution =
                    export.resolution_m.unwrap_or(self.slam.config().mesh.resolution_m);
                let mut report = |part: f64| progress("extracting the mesh", part, 1.0);
                let mesh = self.slam.extract_mesh(resolution, &mut report).await?;
                let classes = &self.slam.info().classes;
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
                let poses = self.slam.trajectory();
                let text = write_tum(poses.iter().map(|p| (p.time_s, p.world_from_camera)));
                ("-trajectory.txt", "text/plain", text.into_bytes())
            }
            ExportKind::Metrics => {
                ("-metrics.json", "application/json", self.metrics_json().into_bytes())
            }
            ExportKind::Checkpoint => {
                let saved = self.slam.checkpoint().await?;
                ("-checkpoint.safetensors", "application/octet-stream", saved.to_bytes())
            }
        };
        emit(&Event::Exported(ExportedEvent {
            kind: export.kind,
            name: format!("{name}{suffix}"),
            mime: mime.into(),
            bytes,
        }));
        Ok(())
    }

    fn metrics_json(&self) -> String {
        let info = self.slam.info();
        let poses = self.slam.trajectory();
        let pairs: Vec<PosePair> = poses
            .iter()
            .filter_map(|p| {
                let truth = self.feed.truth(p.frame)?;
                Some(PosePair { estimate: p.world_from_camera, truth })
            })
            .collect();
        let lost: Vec<usize> =
            poses.iter().filter(|p| p.status == TrackingStatus::Lost).map(|p| p.frame).collect();
        let value = serde_json::json!({
            "program": format!("mte-slam-web {}", env!("CARGO_PKG_VERSION")),
            "sequence": { "name": info.name, "layout": info.layout, "frames": info.frames,
                "width_pixels": info.camera.width, "height_pixels": info.camera.height },
            "engine": { "kind": self.engine.kind, "adapter": self.engine.adapter },
            "settings": self.settings,
            "configuration": self.slam.config(),
            "frames_processed": poses.len(),
            "lost_frames": lost,
            "trajectory": ate(&pairs).ok(),
            "frames": self.metrics,
        });
        format!("{value:#}\n")
    }
}
