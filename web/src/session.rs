//! One run: commands in, events out.
use crate::{
    feed::{Feed, FeedError, Stream},
    message::*,
    pack, picture,
    platform::{clock_s, has_webgpu, next_turn, wasm_bytes},
    settings::{EngineChoice, LabelChoice, Settings, SettingsError},
    source::{FilesSource as Folder, HttpSource, ZipSource as Archive},
};
use js_sys::{Function, Reflect};
use mte_slam_core::{
    camera::Camera,
    classes::ClassTable,
    dataset::{self, LabelSource, OpenOptions},
    engine::{Engine, EngineError, GpuOptions},
    mesh::{write_glb, write_glb_by_class, write_ply},
    metrics::{PosePair, ate},
    pose::Pose,
    sequence::{SequenceError, Source},
    slam::{FrameReport, LiveMesh, MeshChunk, Slam, SlamError, TrackingStatus},
    synth::{SceneKind, SyntheticOptions, SyntheticSequence},
    trajectory_file::write_tum,
};
use serde::{Serialize, de::DeserializeOwned};
use std::{cell::RefCell, future::Future, pin::Pin};
use wasm_bindgen::{JsCast, prelude::*};

/// Chunks of the growing mesh that are extracted after a frame; the rest waits for later frames.
const CHUNKS_A_FRAME_GPU: usize = 160;
const CHUNKS_A_FRAME_CPU: usize = 48;
/// Optimisations with fewer iterations pass without progress.
const PROGRESS_FROM: u32 = 30;

thread_local! {
    // The core's hook between slices is a plain function, so the way out is kept here.
    static EMIT: RefCell<Option<Function>> = const { RefCell::new(None) };
}

fn emit(event: &Event) {
    let serializer = serde_wasm_bindgen::Serializer::new()
        .serialize_maps_as_objects(true)
        .serialize_missing_as_null(true);
    let function = EMIT.with(|f| f.borrow().clone());
    if let (Some(function), Ok(value)) = (function, event.serialize(&serializer)) {
        let _ = function.call1(&JsValue::NULL, &value);
    }
}

fn progress(stage: &str, done: f64, total: f64) {
    emit(&Event::Progress(ProgressEvent { stage: stage.into(), done, total }));
}

fn warn(message: String) {
    emit(&Event::Warning(WarningEvent { message }));
}

/// Between slices: progress of the long ones, then whatever waits in the event loop.
fn breathe(done: u32, total: u32) -> Pin<Box<dyn Future<Output = ()>>> {
    if total >= PROGRESS_FROM {
        progress("optimising the map", done.into(), total.into());
    }
    next_turn()
}

/// Why a command was not followed.
struct Failure(ErrorEvent);

impl Failure {
    fn new(kind: ErrorKind, message: impl Into<String>) -> Failure {
        Failure(ErrorEvent { kind, message: message.into(), resumable: false })
    }
}

impl From<EngineError> for Failure {
    fn from(e: EngineError) -> Failure {
        let kind = match &e {
            EngineError::NoAdapter { .. } | EngineError::NoDevice { .. } => ErrorKind::Adapter,
            EngineError::LimitsTooSmall { .. } => ErrorKind::Limits,
            EngineError::BufferTooLarge { .. } | EngineError::OutOfMemory { .. } => {
                ErrorKind::OutOfMemory
            }
            EngineError::DeviceLost { .. } => ErrorKind::DeviceLost,
            _ => ErrorKind::Engine,
        };
        Failure::new(kind, e.to_string())
    }
}

impl From<SlamError> for Failure {
    fn from(e: SlamError) -> Failure {
        match e {
            SlamError::Engine(e) => e.into(),
            SlamError::Config(e) => Failure::new(ErrorKind::BadSettings, e.to_string()),
            SlamError::Frame { .. } => Failure::new(ErrorKind::BadFile, e.to_string()),
            SlamError::NoMap => Failure::new(ErrorKind::Command, e.to_string()),
            _ => Failure::new(ErrorKind::Engine, e.to_string()),
        }
    }
}

impl From<SequenceError> for Failure {
    fn from(e: SequenceError) -> Failure {
        Failure::new(ErrorKind::BadFile, e.to_string())
    }
}

impl From<SettingsError> for Failure {
    fn from(e: SettingsError) -> Failure {
        Failure::new(ErrorKind::BadSettings, e.0)
    }
}

impl From<FeedError> for Failure {
    fn from(e: FeedError) -> Failure {
        let mut failure = Failure::new(e.kind, e.message);
        // The map is as it was; the frame can be asked for again.
        failure.0.resumable = true;
        failure
    }
}

/// A recording under way.
struct Run {
    feed: Feed,
    slam: Slam,
    settings: Settings,
    live: LiveMesh,
    chunks_a_frame: usize,
    next: usize,
    begun_s: Option<f64>,
    finished: bool,
    metrics: Vec<serde_json::Value>,
    engine: EngineDescription,
}

/// See the crate. Commands are followed one at a time: the host waits for one before it gives the
/// next.
#[wasm_bindgen]
pub struct Session {
    run: Option<Run>,
}

#[wasm_bindgen]
impl Session {
    /// A session without a recording; `emit` hears its events.
    #[wasm_bindgen(constructor)]
    pub fn new(
        #[wasm_bindgen(unchecked_param_type = "(event: Event) => void")] emit: Function,
    ) -> Session {
        EMIT.with(|f| *f.borrow_mut() = Some(emit));
        Session { run: None }
    }

    /// Follows a command. Failures are emitted as `error`; the result says whether there was none.
    pub async fn handle(
        &mut self,
        #[wasm_bindgen(unchecked_param_type = "Command")] command: JsValue,
    ) -> bool {
        let done = self.follow(&command).await;
        done.map_err(|f| emit(&Event::Error(f.0))).is_ok()
    }

    /// Processes one frame; after the last one the map is refined. Says whether there is more.
    pub async fn step(&mut self) -> bool {
        let Some(run) = self.run.as_mut() else {
            emit(&Event::Error(Failure::new(ErrorKind::Command, "nothing is open").0));
            return false;
        };
        match run.step().await {
            Ok(more) => more,
            Err(f) => {
                emit(&Event::Error(f.0));
                false
            }
        }
    }

    async fn follow(&mut self, command: &JsValue) -> Result<(), Failure> {
        match text(command, "type").as_deref() {
            Some("open") => {
                // Two maps at once could pass the device's memory.
                self.run = None;
                check_settings(command)?;
                let OpenCommand { source, settings } = parse(command, "open")?;
                self.run = Some(Run::open(&source, settings).await?);
                Ok(())
            }
            Some("seekView") => {
                let view = parse(command, "seekView")?;
                self.open_run()?.seek(&view).await
            }
            Some("export") => {
                let export = parse(command, "export")?;
                self.open_run()?.export(&export).await
            }
            Some("step") => {
                self.open_run()?.step().await?;
                Ok(())
            }
            Some("dispose") => {
                self.run = None;
                Ok(())
            }
            // The host's part: it calls `step`, or does not.
            Some("start" | "pause") => self.open_run().map(drop),
            other => Err(Failure::new(
                ErrorKind::Command,
                format!(
                    "command: type: found {other:?}, expected open, start, pause, step, seekView, export or dispose"
                ),
            )),
        }
    }

    fn open_run(&mut self) -> Result<&mut Run, Failure> {
        self.run.as_mut().ok_or_else(|| Failure::new(ErrorKind::Command, "nothing is open"))
    }
}

fn text(object: &JsValue, key: &str) -> Option<String> {
    Reflect::get(object, &key.into()).ok()?.as_string()
}

fn parse<T: DeserializeOwned>(value: &JsValue, what: &str) -> Result<T, Failure> {
    serde_wasm_bindgen::from_value(value.clone())
        .map_err(|e| Failure::new(ErrorKind::BadSettings, format!("{what}: {e}")))
}

/// Refuses settings that do not exist: serde does not see the surplus keys of a JavaScript object.
fn check_settings(command: &JsValue) -> Result<(), Failure> {
    let settings = Reflect::get(command, &"settings".into()).unwrap_or(JsValue::UNDEFINED);
    let Some(object) = settings.dyn_ref::<js_sys::Object>() else { return Ok(()) };
    let known = serde_json::to_value(Settings::default()).unwrap_or_default();
    let surplus = js_sys::Object::keys(object)
        .iter()
        .filter_map(|key| key.as_string())
        .find(|key| known.get(key).is_none());
    match surplus {
        Some(key) => {
            let names: Vec<&String> =
                known.as_object().into_iter().flat_map(|m| m.keys()).collect();
            let message = format!("settings: {key}: no such setting, expected one of {names:?}");
            Err(Failure::new(ErrorKind::BadSettings, message))
        }
        None => Ok(()),
    }
}

/// An engine, and why it is not the one that was preferred.
async fn engine(settings: &Settings) -> Result<(Engine, Option<String>), Failure> {
    if settings.engine == EngineChoice::Cpu {
        return Ok((Engine::cpu(), None));
    }
    let failure = if has_webgpu() {
        let overrides = if settings.unroll { Vec::new() } else { vec![("UNROLL", 0)] };
        match Engine::gpu(GpuOptions { overrides, ..GpuOptions::default() }).await {
            Ok(engine) => return Ok((engine, None)),
            Err(e) => Failure::from(e),
        }
    } else {
        Failure::new(ErrorKind::NoWebgpu, "this browser offers no WebGPU on this page")
    };
    match settings.engine {
        EngineChoice::Auto => Ok((Engine::cpu(), Some(failure.0.message))),
        _ => Err(failure),
    }
}

async fn open_feed(spec: &JsValue, settings: &Settings) -> Result<Feed, Failure> {
    let source: Box<dyn Source> = match text(spec, "kind").as_deref() {
        Some("built-in") => {
            let wanted: BuiltInSource = parse(spec, "source")?;
            let scene = match wanted.scene.as_str() {
                "room" => SceneKind::Room,
                "office" => SceneKind::Office,
                other => {
                    let message = format!("source: scene: found {other}, expected room or office");
                    return Err(Failure::new(ErrorKind::BadSettings, message));
                }
            };
            let frames = wanted.frames.min(settings.frames.unwrap_or(usize::MAX));
            if frames == 0 || !(32..=1280).contains(&wanted.width) {
                let message = format!(
                    "source: found {frames} frames of {} pixels width, expected at least 1 of 32 to 1280",
                    wanted.width
                );
                return Err(Failure::new(ErrorKind::BadSettings, message));
            }
            return Ok(Feed::Sequence(Box::new(SyntheticSequence::new(SyntheticOptions {
                width: wanted.width,
                height: wanted.width / 4 * 3,
                frames,
                scene,
                depth_noise: wanted.noise,
                ..SyntheticOptions::default()
            }))));
        }
        Some("serve") => {
            let UrlSource { url } = parse(spec, "source")?;
            return Ok(Feed::Stream(Box::new(Stream::open(&url).await?)));
        }
        Some("files") => {
            let FilesSource { name, files } = parse(spec, "source")?;
            Box::new(Folder::new(&name, &files)?)
        }
        Some("zip") => {
            let ZipSource { name, file } = parse(spec, "source")?;
            let blob = file
                .dyn_into()
                .map_err(|_| Failure::new(ErrorKind::BadFile, format!("{name}: not a file")))?;
            Box::new(Archive::local(&name, blob)?)
        }
        Some("zip-url") => {
            let UrlSource { url } = parse(spec, "source")?;
            let archive = Archive::remote(&url)?;
            if archive.whole {
                warn(format!("{url}: the server sends no ranges, so the whole archive was loaded"));
            }
            Box::new(archive)
        }
        Some("http") => {
            let UrlSource { url } = parse(spec, "source")?;
            Box::new(HttpSource::open(&url)?)
        }
        other => {
            let message = format!(
                "source: kind: found {other:?}, expected built-in, files, zip, zip-url, http or serve"
            );
            return Err(Failure::new(ErrorKind::BadSettings, message));
        }
    };
    let options = OpenOptions {
        start: settings.start,
        stride: settings.stride,
        frames: settings.frames,
        scale: settings.scale,
        labels: match settings.labels {
            LabelChoice::Dataset => LabelSource::Dataset,
            LabelChoice::None => LabelSource::None,
        },
        ..OpenOptions::default()
    };
    Ok(Feed::Sequence(dataset::open(source, options)?))
}

impl Run {
    async fn open(source: &JsValue, settings: Settings) -> Result<Run, Failure> {
        let config = settings.config()?;
        progress("opening the recording", 0.0, 1.0);
        next_turn().await;
        let feed = open_feed(source, &settings).await?;
        let mut info = feed.info().clone();
        if settings.labels == LabelChoice::None {
            info.classes = ClassTable::default();
        }
        progress("starting the engine", 0.0, 1.0);
        let (engine, why) = engine(&settings).await?;
        let found = engine.info();
        let description =
            EngineDescription { kind: found.kind.into(), adapter: found.adapter, why: why.clone() };
        let cpu = found.kind == "cpu";
        let mut slam = Slam::new(engine, config, &info).await?;
        slam.set_clock(clock_s);
        slam.set_breathe(breathe);
        let truth: Vec<Option<Pose>> = (0..info.frames).map(|i| feed.truth(i)).collect();
        let known = truth.iter().any(Option::is_some);
        let position = |p: &Option<Pose>| {
            let t = p.map(|p| p.translation.to_array().map(|x| x as f32)).unwrap_or([f32::NAN; 3]);
            t.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>()
        };
        let camera = info.camera;
        emit(&Event::Opened(OpenedEvent {
            name: info.name.clone(),
            layout: info.layout.into(),
            frames: info.frames,
            width: camera.width,
            height: camera.height,
            focal: camera.fy / (0.5 * f64::from(camera.height)),
            classes: info
                .classes
                .classes
                .iter()
                .map(|c| ClassInfo { name: c.name.clone(), color: c.color })
                .collect(),
            engine: description.clone(),
            warnings: feed.warnings(),
            truth: if known { truth.iter().flat_map(position).collect() } else { Vec::new() },
            config: serde_json::to_value(slam.config()).unwrap_or_default(),
        }));
        Ok(Run {
            feed,
            live: LiveMesh::new(settings.live_resolution_m),
            slam,
            settings,
            chunks_a_frame: if cpu { CHUNKS_A_FRAME_CPU } else { CHUNKS_A_FRAME_GPU },
            next: 0,
            begun_s: None,
            finished: false,
            metrics: Vec::new(),
            engine: description,
        })
    }

    async fn step(&mut self) -> Result<bool, Failure> {
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

        let report = self.slam.process(&frame).await?;
        drop(frame);
        let status = match report.status {
            TrackingStatus::First => "first",
            TrackingStatus::Tracked => "tracked",
            TrackingStatus::Lost => "lost",
        };
        if report.status == TrackingStatus::Lost {
            emit(&Event::Lost(LostEvent { index }));
        }
        emit(&Event::Pose(PoseEvent {
            index,
            status: status.into(),
            world_from_camera: report.world_from_camera.to_row_major(),
        }));
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
        progress("frames", self.next as f64, frames as f64);
        Ok(true)
    }

    /// After the last frame, once.
    async fn finish(&mut self) -> Result<(), Failure> {
        let frames = self.feed.info().frames;
        if self.finished {
            return Ok(());
        }
        self.slam.finish().await?;
        self.report_trajectory();
        self.live.touch_all();
        loop {
            let chunks = self.slam.update_live_mesh(&mut self.live, self.chunks_a_frame).await?;
            self.report_map(&chunks);
            next_turn().await;
            if self.live.pending() == 0 {
                break;
            }
        }
        self.finished = true;
        let lost = |p: &&mte_slam_core::slam::PoseEstimate| p.status == TrackingStatus::Lost;
        emit(&Event::Done(DoneEvent {
            frames,
            lost: self.slam.trajectory().iter().filter(lost).count(),
            seconds: clock_s() - self.begun_s.unwrap_or_else(clock_s),
        }));
        Ok(())
    }

    fn report_trajectory(&self) {
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
        self.metrics.extend(serde_json::to_value(&event));
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

    async fn seek(&mut self, view: &ViewCommand) -> Result<(), Failure> {
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

    async fn export(&mut self, export: &ExportCommand) -> Result<(), Failure> {
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
