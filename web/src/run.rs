//! A recording under way: what a run does with its frames becomes events.
use crate::{
    events::Page,
    failure::Failure,
    feed::Feed,
    message::*,
    pack, picture,
    platform::{clock_s, next_turn, wasm_bytes},
    saved::{Kept, PageFigures},
    settings::Settings,
};
use js_sys::Uint8Array;
use mte_slam_core::slam::{
    FrameReport, LiveMesh, MeshChunk, PoseEstimate, SlamError, TrackingStatus,
};
use mte_slam_metrics::{PosePair, ate};
use mte_slam_run::{Run, Step};
use mte_slam_types::{camera::Camera, pose::Pose};

/// Shortest time between two states \[s\].
const PAUSE_S: f64 = 5.0;
/// At most one part in this many of the time goes into making states.
const SHARE: f64 = 20.0;

/// A recording under way.
pub struct OpenRun {
    pub page: Page,
    pub feed: Feed,
    pub run: Run,
    pub settings: Settings,
    pub live: LiveMesh,
    pub chunks_per_frame: usize,
    /// Whether the mesh of the finished map has been shown.
    pub shown_finished: bool,
    pub figures: Vec<PageFigures>,
    pub engine: EngineDescription,
    /// Whether states are saved now and then.
    pub keep: bool,
    /// When one was saved last, and how long to wait for the next. \[s\]
    pub saved_s: f64,
    pub save_pause_s: f64,
}

impl OpenRun {
    /// Takes a frame, or comes to the end; then emits a state, if it is time for one. Returns
    /// whether there is more.
    pub async fn step_and_save(&mut self) -> Result<bool, Failure> {
        let was_finished = self.shown_finished;
        let more = self.step().await?;
        if self.save_is_due() || (self.keep && self.shown_finished && !was_finished) {
            self.save().await?;
        }
        Ok(more)
    }

    /// Whether it is time for another state.
    fn save_is_due(&self) -> bool {
        self.keep && clock_s() - self.saved_s >= self.save_pause_s
    }

    /// Emits the state of the run, unless there is nothing that opening again would not bring.
    pub async fn save(&mut self) -> Result<(), Failure> {
        let begun_s = clock_s();
        let info = self.feed.info();
        let frames = info.frames;
        let kept = Kept {
            name: info.name.clone(),
            frames,
            camera: info.camera,
            settings: self.settings.clone(),
            figures: self.figures.clone(),
        };
        let Some(checkpoint) = self.run.checkpoint(&kept, &self.page).await? else {
            return Ok(());
        };
        let parts = checkpoint.parts();
        let bytes = Uint8Array::new_with_length(parts.iter().map(|p| p.len() as u32).sum());
        let mut at = 0;
        for part in &parts {
            let end = at + part.len() as u32;
            bytes.subarray(at, end).copy_from(part);
            at = end;
        }
        let frame = self.run.next_frame();
        self.page.emit(&Event::Saved(SavedEvent { frame, frames, bytes: bytes.into() }));
        self.saved_s = clock_s();
        self.save_pause_s = PAUSE_S.max(SHARE * (self.saved_s - begun_s));
        Ok(())
    }

    pub async fn step(&mut self) -> Result<bool, Failure> {
        let start_s = clock_s();
        loop {
            match self.run.step(&mut self.feed, &mut self.page).await? {
                Step::Frame(report) => {
                    self.show_frame(&report, start_s).await?;
                    return Ok(true);
                }
                Step::Part { .. } => {}
                Step::Done => {
                    self.show_finished().await?;
                    return Ok(false);
                }
            }
        }
    }

    /// Emits what has become of the frame that was processed last.
    async fn show_frame(&mut self, report: &FrameReport, start_s: f64) -> Result<(), Failure> {
        let next = self.run.next_frame();
        let index = next - 1;
        if report.status == TrackingStatus::Lost {
            self.page.emit(&Event::Lost(LostEvent { index }));
        }
        self.report_pose(index, report.status, &report.world_from_camera);
        self.report_trajectory();
        if report.losses.is_some() || self.live.pending() > 0 {
            next_turn().await;
            self.update_mesh().await?;
        }
        let every = self.settings.render_every;
        if every > 0 && index.is_multiple_of(every) && report.status != TrackingStatus::Lost {
            next_turn().await;
            self.render(index, &report.world_from_camera, self.settings.render_width).await?;
        }
        let figures = PageFigures {
            index,
            total_ms: (clock_s() - start_s) * 1000.0,
            ate_cm: self.ate_cm(),
            device_bytes: self.run.slam().memory_bytes() as f64,
            wasm_bytes: wasm_bytes(),
        };
        self.page.emit(&Event::Metrics(self.metrics(&figures)));
        self.figures.push(figures);
        self.page.progress("frames", next as f64, self.feed.info().frames as f64);
        Ok(())
    }

    /// After the last frame, once.
    async fn show_finished(&mut self) -> Result<(), Failure> {
        if !self.shown_finished {
            self.report_trajectory();
            self.rebuild_mesh().await?;
            self.shown_finished = true;
            self.report_done();
        }
        Ok(())
    }

    /// Emits path, pose and the whole mesh.
    pub async fn refresh(&mut self) -> Result<(), Failure> {
        let Some(last) = self.run.slam().trajectory().last().copied() else { return Ok(()) };
        self.report_trajectory();
        self.report_pose(last.frame, last.status, &last.world_from_camera);
        self.page.progress("building the mesh", 0.0, 1.0);
        self.rebuild_mesh().await
    }

    /// Extracts the whole mesh again.
    pub async fn rebuild_mesh(&mut self) -> Result<(), Failure> {
        self.live.touch_all();
        loop {
            self.update_mesh().await?;
            next_turn().await;
            if self.live.pending() == 0 {
                return Ok(());
            }
        }
    }

    /// Emits some of the chunks that have changed.
    async fn update_mesh(&mut self) -> Result<(), Failure> {
        let slam = self.run.slam_mut();
        let chunks = slam.update_live_mesh(&mut self.live, self.chunks_per_frame).await?;
        self.report_map(&chunks);
        Ok(())
    }

    pub fn report_done(&self) {
        let lost = |p: &&PoseEstimate| p.status == TrackingStatus::Lost;
        self.page.emit(&Event::Done(DoneEvent {
            frames: self.feed.info().frames,
            lost: self.run.slam().trajectory().iter().filter(lost).count(),
            seconds: self.run.elapsed_s(&self.page),
        }));
    }

    pub fn report_pose(&self, index: usize, status: TrackingStatus, pose: &Pose) {
        self.page.emit(&Event::Pose(PoseEvent {
            index,
            status: status.name().into(),
            world_from_camera: pose.to_row_major(),
        }));
    }

    pub fn report_trajectory(&self) {
        let position =
            |p: &PoseEstimate| p.world_from_camera.translation.to_array().map(|x| x as f32);
        let floats = self.run.slam().trajectory().iter().flat_map(position).collect::<Vec<f32>>();
        let positions = bytemuck::cast_slice(&floats).to_vec();
        self.page.emit(&Event::Trajectory(TrajectoryEvent { positions }));
    }

    fn report_map(&self, chunks: &[MeshChunk]) {
        let bounds = self.run.slam().bounds().map(|b| {
            let ([a, b, c], [d, e, f]) = (b.min.to_array(), b.max.to_array());
            [a, b, c, d, e, f]
        });
        self.page.emit(&Event::Map(MapEvent {
            chunks: chunks.iter().map(pack::chunk).collect(),
            triangles: self.live.triangles(),
            bounds,
        }));
    }

    /// Estimated and true poses, where truth is known.
    pub fn pose_pairs(&self) -> Vec<PosePair> {
        let pair = |p: &PoseEstimate| {
            let truth = self.feed.truth(p.frame)?;
            Some(PosePair { estimate: p.world_from_camera, truth })
        };
        self.run.slam().trajectory().iter().filter_map(pair).collect()
    }

    /// Absolute trajectory error so far, where truth is known. \[cm\]
    fn ate_cm(&self) -> Option<f64> {
        ate(&self.pose_pairs()).ok().map(|report| report.aligned_cm.rmse)
    }

    /// The figures of a frame: the run's and the page's.
    pub fn metrics(&self, figures: &PageFigures) -> MetricsEvent {
        let log = self.run.log().frames.get(figures.index);
        MetricsEvent {
            index: figures.index,
            tracking_ms: log.map_or(0.0, |l| l.tracking_s * 1000.0),
            mapping_ms: log.map_or(0.0, |l| l.mapping_s * 1000.0),
            total_ms: figures.total_ms,
            ate_cm: figures.ate_cm,
            losses: log.and_then(|l| l.losses).map(|l| LossFigures {
                total: l.total,
                sdf: l.sdf,
                depth: l.depth,
                color: l.color,
                semantic: l.semantic,
            }),
            keyframes: log.map_or(0, |l| l.keyframes),
            anchors: log.and_then(|l| l.anchors).map(f64::from),
            device_bytes: figures.device_bytes,
            wasm_bytes: figures.wasm_bytes,
        }
    }

    /// Renders the map from a pose, in a picture of `width` pixels.
    async fn render(&mut self, index: usize, pose: &Pose, width: u32) -> Result<(), Failure> {
        let slam = self.run.slam_mut();
        let camera = scaled(&slam.info().camera, width);
        let view = slam.render(pose, &camera).await?;
        let [color, depth, classes] = picture::of_view(&view, &slam.info().classes);
        let (width, height) = (camera.width, camera.height);
        let picture = PictureEvent { index, width, height, color, depth, classes };
        self.page.emit(&Event::Rendered(picture));
        Ok(())
    }

    pub async fn seek(&mut self, view: &ViewCommand) -> Result<(), Failure> {
        let poses = self.run.slam().trajectory();
        let last = poses.len().saturating_sub(1);
        let index = view.frame.unwrap_or(last).min(last);
        let pose = match (&view.world_from_camera, poses.get(index)) {
            (Some(m), _) => Pose::from_row_major(m).ok_or_else(|| {
                Failure::new(ErrorKind::Command, "worldFromCamera: expected a rigid transform")
            })?,
            (None, Some(p)) => p.world_from_camera,
            (None, None) => return Err(SlamError::NoMap.into()),
        };
        let width = view.width.unwrap_or(self.settings.render_width).clamp(8, 1280);
        self.render(index, &pose, width).await
    }
}

/// The camera of a picture of another size of the same view.
fn scaled(camera: &Camera, width: u32) -> Camera {
    let s = f64::from(width.min(camera.width)) / f64::from(camera.width);
    let centre = |c: f64| (c + 0.5) * s - 0.5;
    Camera {
        width: width.min(camera.width),
        height: ((f64::from(camera.height) * s).round() as u32).max(1),
        fx: camera.fx * s,
        fy: camera.fy * s,
        cx: centre(camera.cx),
        cy: centre(camera.cy),
    }
}
