//! Opening a recording: what the command says, the engine, the frames.
use crate::{
    events::{breathe, emit, progress, warn},
    failure::Failure,
    feed::{Feed, Stream},
    message::*,
    platform::{clock_s, has_webgpu, next_turn},
    run::Run,
    saved::SavedRun,
    settings::{EngineChoice, LabelChoice, Settings},
    source::{FilesSource as Folder, HttpSource, ZipSource as Archive},
};
use js_sys::Reflect;
use mte_slam_core::{
    engine::{Engine, GpuOptions},
    slam::{LiveMesh, Slam},
};
use mte_slam_dataset::{LabelSource, OpenOptions};
use mte_slam_synth::{SceneKind, SyntheticOptions, SyntheticSequence};
use mte_slam_types::{classes::ClassTable, pose::Pose, sequence::Source};
use serde::de::DeserializeOwned;
use wasm_bindgen::{JsCast, JsValue};

/// Chunks of the growing mesh that are extracted after a frame; the rest waits for later frames.
const CHUNKS_A_FRAME_GPU: usize = 160;
const CHUNKS_A_FRAME_CPU: usize = 48;
pub fn text(object: &JsValue, key: &str) -> Option<String> {
    Reflect::get(object, &key.into()).ok()?.as_string()
}

pub fn parse<T: DeserializeOwned>(value: &JsValue, what: &str) -> Result<T, Failure> {
    serde_wasm_bindgen::from_value(value.clone())
        .map_err(|e| Failure::new(ErrorKind::BadSettings, format!("{what}: {e}")))
}

/// Refuses settings that do not exist: serde does not see the surplus keys of a JavaScript object.
pub fn check_settings(command: &JsValue) -> Result<(), Failure> {
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
    Ok(Feed::Sequence(mte_slam_dataset::open(source, options)?))
}

impl Run {
    /// A run from the first frame.
    pub async fn open(source: &JsValue, settings: Settings) -> Result<Run, Failure> {
        Run::begin(source, settings, None).await
    }

    /// A run that goes on from a saved state, on the engine that `settings` name.
    pub async fn resume(
        source: &JsValue,
        settings: Settings,
        saved: SavedRun,
    ) -> Result<Run, Failure> {
        let Settings { engine, unroll, .. } = settings;
        let settings = Settings { engine, unroll, ..saved.progress.settings.clone() };
        let mut run = Run::begin(source, settings, Some(&saved)).await?;
        let SavedRun { progress: state, checkpoint } = saved;
        drop(checkpoint);
        run.next = state.next;
        run.begun_s = Some(clock_s() - state.seconds);
        run.finished = state.finished;
        run.metrics = state.metrics;
        for figures in &run.metrics {
            emit(&Event::Metrics(figures.clone()));
        }
        run.refresh().await?;
        progress("frames", run.next as f64, run.feed.info().frames as f64);
        if run.finished {
            run.report_done();
        }
        Ok(run)
    }

    async fn begin(
        source: &JsValue,
        settings: Settings,
        saved: Option<&SavedRun>,
    ) -> Result<Run, Failure> {
        let config = settings.config()?;
        progress("opening the recording", 0.0, 1.0);
        next_turn().await;
        let mut feed = open_feed(source, &settings).await?;
        if let Some(saved) = saved {
            saved.progress.check(feed.info())?;
        }
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
        let mut slam = match saved {
            Some(saved) => {
                let checkpoint = &saved.checkpoint;
                let mut resuming = Slam::resume(engine, config, &info, checkpoint).await?;
                let missing: Vec<usize> = resuming.missing().collect();
                for (i, index) in missing.iter().enumerate() {
                    progress("reading keyframes again", i as f64, missing.len() as f64);
                    next_turn().await;
                    let mut frame = feed.frame(*index, &warn).await?;
                    if info.classes.is_empty() {
                        frame.labels = None;
                    }
                    resuming.add(&frame)?;
                }
                resuming.finish()?
            }
            None => Slam::new(engine, config, &info).await?,
        };
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
            next: saved.map_or(0, |s| s.progress.next),
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
            keep: false,
            saved_s: clock_s(),
            save_pause_s: 0.0,
            settled: true,
        })
    }
}
