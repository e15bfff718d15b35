//! A recording under way: frames in, events out.
use crate::{
    events::{emit, progress, warn},
    failure::Failure,
    feed::Feed,
    message::*,
    pack, picture,
    platform::{clock_s, next_turn, wasm_bytes},
    settings::Settings,
};
use mte_slam_core::slam::{FrameReport, LiveMesh, MeshChunk, Slam, SlamError, TrackingStatus};
use mte_slam_metrics::{PosePair, ate};
use mte_slam_types::{camera::Camera, pose::Pose};

/// A recording under way.
pub struct Run {
    pub feed: Feed,
    pub slam: Slam,
    pub settings: Settings,
    pub live: LiveMesh,
    pub chunks_a_frame: usize,
    /// The frame that comes next.
    pub next: usize,
    /// When the first frame began, or would have for a run that was resumed.
    pub begun_s: Option<f64>,
    pub finished: bool,
    pub metrics: Vec<MetricsEvent>,
    pub engine: EngineDescription,
    /// Whether states are saved now and then.
    pub keep: bool,
    /// When one was saved last, and how long to wait for the next. \[s\]
    pub saved_s: f64,
    pub save_pause_s: f64,
    /// False from a frame that failed half way on: such a state must not be saved.
    pub settled: bool,
}

impl Run {
    /// Time since the first frame \[s\].
    pub fn seconds(&self) -> f64 {
        clock_s() - self.begun_s.unwrap_or_else(clock_s)
    }

    /// One frame, or the end; then a state, if it is time for one. Says whether there is more.
    pub async fn step_and_save(&mut self) -> Result<bool, Failure> {
        let was_finished = self.finished;
        let more = self.step().await?;
        if self.save_is_due() || (self.keep && self.finished && !was_finished) {
            self.save().await?;
        }
        Ok(more)
    }

    pub async fn step(&mut self) -> Result<bool, Failure> {
        let frames = self.feed.info().frames;
        if self.next >= frames {
            self.finish().await?;
            return Ok(false);
        }
        let start_s = clock_s();
        self.begun_s.get_or_insert(start_s);
        let index = self.next;
        let mut frame = self.feed.frame(index, &warn).await?;
        let info = self.slam.info().clone();
        if info.classes.is_empty() {
            frame.labels = None;
        }
        let [color, depth, classes] = picture::of_frame(&frame, info.depth_unit_m, &info.classes);
        let (width, height) = (info.camera.width, info.camera.height);
        emit(&Event::Frame(PictureEvent { index, width, height, color, depth, classes }));
        next_turn().await;

        self.settled = false;
        let report = self.slam.process(&frame).await?;
        drop(frame);
        if report.status == TrackingStatus::Lost {
            emit(&Event::Lost(LostEvent { index }));
        }
        self.report_pose(index, report.status, &report.world_from_camera);
        self.report_trajectory();
        if report.losses.is_some() || self.live.pending() > 0 {
            next_turn().await;
            let chunks = self.slam.update_live_mesh(&mut self.live, self.chunks_a_frame).await?;
            self.report_map(&chunks);
        }
        let every = self.settings.render_every;
        if every > 0 && index.is_multiple_of(every) && report.status != TrackingStatus::Lost {
            next_turn().await;
            self.render(index, &report.world_from_camera, self.settings.render_width).await?;
        }
        self.report_metrics(index, &report, start_s);
        self.next += 1;
        self.settled = true;
        progress("frames", self.next as f64, frames as f64);
        Ok(true)
    }

    /// After the last frame, once.
    async fn finish(&mut self) -> Result<(), Failure> {
        if self.finished {
            return Ok(());
        }
        self.settled = false;
        self.slam.finish().await?;
        self.report_trajectory();
        self.rebuild_mesh().await?;
        self.finished = true;
        self.settled = true;
        self.report_done();
        Ok(())
    }

    /// Emits path, pose and the whole mesh.
    pub async fn refresh(&mut self) -> Result<(), Failure> {
        let Some(last) = self.slam.trajectory().last().copied() else { return Ok(()) };
        self.report_trajectory();
        self.report_pose(last.frame, last.status, &last.world_from_camera);
        progress("building the mesh", 0.0, 1.0);
        self.rebuild_mesh().await
    }

    /// Extracts the whole mesh again.
    pub async fn rebuild_mesh(&mut self) -> Result<(), Failure> {
        self.live.touch_all();
        loop {
            let chunks = self.slam.update_live_mesh(&mut self.live, self.chunks_a_frame).await?;
            self.report_map(&chunks);
            next_turn().await;
            if self.live.pending() == 0 {
                return Ok(());
            }
        }
    }

    pub fn report_done(&self) {
        let lost = |p: &&mte_slam_core::slam::PoseEstimate| p.status == TrackingStatus::Lost;
        emit(&Event::Done(DoneEvent {
            frames: self.feed.info().frames,
            lost: self.slam.trajectory().iter().filter(lost).count(),
            seconds: self.seconds(),
        }));
    }

    pub fn report_pose(&self, index: usize, status: TrackingStatus, pose: &Pose) {
        let status = match status {
            TrackingStatus::First => "first",
            TrackingStatus::Tracked => "tracked",
            TrackingStatus::Lost => "lost",
        };
        emit(&Event::Pose(PoseEvent {
            index,
            status: status.into(),
            world_from_camera: pose.to_row_major(),
        }));
    }

    pub fn report_trajectory(&self) {
        let position = |p: &mte_slam_core::slam::PoseEstimate| {
            p.world_from_camera.translation.to_array().map(|x| x as f32)
        };
        let floats = self.slam.trajectory().iter().flat_map(position).collect::<Vec<f32>>();
        let positions = bytemuck::cast_slice(&floats).to_vec();
        emit(&Event::Trajectory(TrajectoryEvent { positions }));
    }

    fn report_map(&self, chunks: &[MeshChunk]) {
        let bounds = self.slam.bounds().map(|b| {
            let ([a, b, c], [d, e, f]) = (b.min.to_array(), b.max.to_array());
            [a, b, c, d, e, f]
        });
        emit(&Event::Map(MapEvent {
            chunks: chunks.iter().map(pack::chunk).collect(),
            triangles: self.live.triangles(),
            bounds,
        }));
    }

    /// Absolute trajectory error so far, where truth is known. \[cm\]
    fn ate_cm(&self) -> Option<f64> {
        let pairs: Vec<PosePair> = self
            .slam
            .trajectory()
            .iter()
            .filter_map(|p| {
                let truth = self.feed.truth(p.frame)?;
                Some(PosePair { estimate: p.world_from_camera, truth })
            })
            .collect();
        ate(&pairs).ok().map(|report| report.aligned_cm.rmse)
    }

    fn report_metrics(&mut self, index: usize, report: &FrameReport, start_s: f64) {
        let event = MetricsEvent {
            index,
            tracking_ms: report.tracking_s * 1000.0,
            mapping_ms: if report.losses.is_some() { report.mapping_s * 1000.0 } else { 0.0 },
            total_ms: (clock_s() - start_s) * 1000.0,
            ate_cm: self.ate_cm(),
            losses: report.losses.map(|l| LossFigures {
                total: l.total,
                sdf: l.sdf,
                depth: l.depth,
                color: l.color,
                semantic: l.semantic,
            }),
            keyframes: self.slam.keyframes().len(),
            anchors: self.slam.anchor_history().last().map(|(_, counts)| f64::from(counts.alive)),
            device_bytes: self.slam.memory_bytes() as f64,
            wasm_bytes: wasm_bytes(),
        };
        self.metrics.push(event.clone());
        emit(&Event::Metrics(event));
    }

    /// Renders the map from a pose, in a picture of `width` pixels.
    async fn render(&mut self, index: usize, pose: &Pose, width: u32) -> Result<(), Failure> {
        let camera = scaled(&self.slam.info().camera, width);
        let view = self.slam.render(pose, &camera).await?;
        let [color, depth, classes] = picture::of_view(&view, &self.slam.info().classes);
        let (width, height) = (camera.width, camera.height);
        emit(&Event::Rendered(PictureEvent { index, width, height, color, depth, classes }));
        Ok(())
    }

    pub async fn seek(&mut self, view: &ViewCommand) -> Result<(), Failure> {
        let poses = self.slam.trajectory();
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
