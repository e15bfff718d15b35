//! Opening a recording: what the command says, the engine, the frames.
use crate::{
    events::Page,
    failure::Failure,
    feed::{Feed, FeedSource, Stream},
    message::*,
    platform::{clock_s, has_webgpu, next_turn},
    run::OpenRun,
    saved::Kept,
    settings::{EngineChoice, LabelChoice, Settings},
    source::{FilesSource as Folder, HttpSource, ZipSource as Archive},
};
use js_sys::Reflect;
use mte_slam_core::{
    engine::{Engine, GpuOptions},
    slam::LiveMesh,
};
use mte_slam_dataset::{LabelSource, OpenOptions};
use mte_slam_run::{Run, SavedRun};
use mte_slam_synth::{SceneKind, SyntheticOptions, SyntheticSequence};
use mte_slam_types::{pose::Pose, sequence::Source};
use serde::de::DeserializeOwned;
use wasm_bindgen::{JsCast, JsValue};

/// Chunks of the growing mesh that are extracted after a frame; the rest waits for later frames.
const CHUNKS_PER_FRAME_GPU: usize = 160;
const CHUNKS_PER_FRAME_CPU: usize = 48;

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
        match Engine::gpu(GpuOptions::default()).await {
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

async fn open_source(
    page: &Page,
    spec: &JsValue,
    settings: &Settings,
) -> Result<FeedSource, Failure> {
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
            return Ok(FeedSource::Sequence(Box::new(SyntheticSequence::new(SyntheticOptions {
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
            return Ok(FeedSource::Stream(Box::new(Stream::open(&url).await?)));
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
                page.warn(format!(
                    "{url}: the server sends no ranges, so the whole archive was loaded"
                ));
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
    Ok(FeedSource::Sequence(mte_slam_dataset::open(source, options)?))
}

impl OpenRun {
    /// A run from the first frame.
    pub async fn open(
        page: &Page,
        source: &JsValue,
        settings: Settings,
    ) -> Result<OpenRun, Failure> {
        OpenRun::begin(page, source, settings, None).await
    }

    /// A run that continues from a saved state, on the engine that `settings` name.
    pub async fn resume(
        page: &Page,
        source: &JsValue,
        settings: Settings,
        saved: SavedRun<Kept>,
    ) -> Result<OpenRun, Failure> {
        let settings = Settings { engine: settings.engine, ..saved.host.settings.clone() };
        let mut open = OpenRun::begin(page, source, settings, Some(saved)).await?;
        for figures in &open.figures {
            page.emit(&Event::Metrics(open.metrics(figures)));
        }
        open.refresh().await?;
        page.progress("frames", open.run.next_frame() as f64, open.feed.info().frames as f64);
        if open.run.is_finished() {
            open.shown_finished = true;
            open.report_done();
        }
        Ok(open)
    }

    async fn begin(
        page: &Page,
        source: &JsValue,
        settings: Settings,
        saved: Option<SavedRun<Kept>>,
    ) -> Result<OpenRun, Failure> {
        let mut page = page.clone();
        let config = settings.config()?;
        page.progress("opening the recording", 0.0, 1.0);
        next_turn().await;
        let source = open_source(&page, source, &settings).await?;
        let mut feed = Feed::new(source, settings.labels != LabelChoice::None);
        if let Some(saved) = &saved {
            saved.host.check(feed.info())?;
        }
        let info = feed.info().clone();
        page.progress("starting the engine", 0.0, 1.0);
        let (engine, why) = engine(&settings).await?;
        let found = engine.info();
        let description =
            EngineDescription { kind: found.kind.into(), adapter: found.adapter, why: why.clone() };
        let cpu = found.kind == "cpu";
        let (run, figures) = match saved {
            Some(mut saved) => {
                let figures = std::mem::take(&mut saved.host.figures);
                (saved.resume(engine, config, &info, &mut feed, &mut page).await?, figures)
            }
            None => (Run::new(engine, config, &info).await?, Vec::new()),
        };
        let truth: Vec<Option<Pose>> = (0..info.frames).map(|i| feed.truth(i)).collect();
        let known = truth.iter().any(Option::is_some);
        let position = |p: &Option<Pose>| {
            let t = p.map(|p| p.translation.to_array().map(|x| x as f32)).unwrap_or([f32::NAN; 3]);
            t.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>()
        };
        let camera = info.camera;
        page.emit(&Event::Opened(OpenedEvent {
            name: info.name.clone(),
            layout: info.layout.into(),
            frames: info.frames,
            next: run.next_frame(),
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
            config: serde_json::to_value(run.slam().config()).unwrap_or_default(),
        }));
        Ok(OpenRun {
            page,
            feed,
            run,
            live: LiveMesh::new(settings.live_resolution_m),
            settings,
            chunks_per_frame: if cpu { CHUNKS_PER_FRAME_CPU } else { CHUNKS_PER_FRAME_GPU },
            shown_finished: false,
            figures,
            engine: description,
            keep: false,
            saved_s: clock_s(),
            save_pause_s: 0.0,
        })
    }
}
