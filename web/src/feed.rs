//! Where a session's frames come from: a sequence that is read frame by frame, or a stream of
//! decoded frames from `mte-slam serve`, which the browser takes as fast as they are used.
use crate::{message::ErrorKind, platform::sleep, source::last_part};
use js_sys::{Reflect, Uint8Array};
use mte_slam_run::{Event, Host, Input};
use mte_slam_types::{
    camera::Camera,
    classes::ClassTable,
    frame::{Bounds, Frame, SequenceInfo},
    pose::Pose,
    sequence::Sequence,
};
use serde::Deserialize;
use wasm_bindgen::{JsCast, JsValue};
use wasm_bindgen_futures::JsFuture;
use web_sys::{ReadableStreamDefaultReader, Response, WorkerGlobalScope};

/// Attempts before a server counts as gone.
const ATTEMPTS: u32 = 4;

/// Why there is no frame.
#[derive(Debug)]
pub struct FeedError {
    pub kind: ErrorKind,
    pub message: String,
}

/// Frames in order, with or without their labels.
pub struct Feed {
    source: FeedSource,
    /// Without classes where labels are not wanted.
    info: SequenceInfo,
}

/// How frames are had.
pub enum FeedSource {
    /// Read by index.
    Sequence(Box<dyn Sequence>),
    /// Received in order.
    Stream(Box<Stream>),
}

impl Feed {
    pub fn new(source: FeedSource, labels: bool) -> Feed {
        let mut info = match &source {
            FeedSource::Sequence(s) => s.info().clone(),
            FeedSource::Stream(s) => s.info.clone(),
        };
        if !labels {
            info.classes = ClassTable::default();
        }
        Feed { source, info }
    }

    pub fn info(&self) -> &SequenceInfo {
        &self.info
    }

    pub fn truth(&self, index: usize) -> Option<Pose> {
        match &self.source {
            FeedSource::Sequence(s) => s.truth(index),
            FeedSource::Stream(s) => s.truth.get(index).copied().flatten(),
        }
    }

    pub fn warnings(&self) -> Vec<String> {
        match &self.source {
            FeedSource::Sequence(s) => s.warnings(),
            FeedSource::Stream(s) => s.warnings.clone(),
        }
    }
}

impl Input for Feed {
    type Error = FeedError;

    async fn read_frame(
        &mut self,
        index: usize,
        host: &mut dyn Host,
    ) -> Result<Option<Frame>, FeedError> {
        if index >= self.info.frames {
            return Ok(None);
        }
        let mut frame = match &mut self.source {
            FeedSource::Sequence(s) => s
                .frame(index)
                .map_err(|e| FeedError { kind: ErrorKind::BadFile, message: e.to_string() })?,
            FeedSource::Stream(s) => s.frame(index, host).await?,
        };
        if self.info.classes.is_empty() {
            frame.labels = None;
        }
        Ok(Some(frame))
    }
}

/// What `mte-slam serve` says of a recording, at `api/info`.
#[derive(Deserialize)]
struct Info {
    name: String,
    camera: Camera,
    depth_unit_m: f64,
    frames: usize,
    classes: ClassTable,
    bounds: Option<Bounds>,
    warnings: Vec<String>,
    truth: Vec<Option<[f64; 16]>>,
}

/// Before the images of a frame.
#[derive(Deserialize)]
struct Header {
    index: usize,
    number: u64,
    time_s: f64,
    labels: bool,
}

/// A stream of frames.
pub struct Stream {
    info: SequenceInfo,
    warnings: Vec<String>,
    truth: Vec<Option<Pose>>,
    base: String,
    open: Option<Connection>,
}

struct Connection {
    reader: ReadableStreamDefaultReader,
    waiting: Vec<u8>,
    /// Index of the frame that comes next.
    next: usize,
}

fn gone(message: String) -> FeedError {
    FeedError { kind: ErrorKind::ServerGone, message }
}

fn bad(message: String) -> FeedError {
    FeedError { kind: ErrorKind::BadFile, message }
}

async fn fetch(url: &str) -> Result<Response, FeedError> {
    let failed = |e: JsValue| gone(format!("{url}: {}", crate::source::reason(&e)));
    let scope: WorkerGlobalScope =
        js_sys::global().dyn_into().map_err(|_| gone("not in a worker".into()))?;
    let response: Response =
        JsFuture::from(scope.fetch_with_str(url)).await.map_err(failed)?.unchecked_into();
    if !response.ok() {
        return Err(gone(format!("{url}: the server answers {}", response.status())));
    }
    Ok(response)
}

impl Stream {
    /// Asks a server what it has.
    pub async fn open(url: &str) -> Result<Stream, FeedError> {
        let base = format!("{}/", url.trim_end_matches('/'));
        let address = format!("{base}api/info");
        let response = fetch(&address).await?;
        let failed = |e: JsValue| gone(format!("{address}: {}", crate::source::reason(&e)));
        let text = JsFuture::from(response.text().map_err(failed)?).await.map_err(failed)?;
        let info: Info =
            serde_json::from_str(&text.as_string().unwrap_or_default()).map_err(|e| {
                bad(format!("{address}: found {e}, expected a server of `mte-slam serve`"))
            })?;
        let pixels = info.camera.pixels();
        if pixels == 0 || pixels > 1 << 26 || info.classes.len() > 255 {
            return Err(bad(format!("{address}: found {:?}, expected a camera", info.camera)));
        }
        let pose = |p: &Option<[f64; 16]>| p.as_ref().and_then(Pose::from_row_major);
        Ok(Stream {
            truth: info.truth.iter().map(pose).collect(),
            warnings: info.warnings,
            info: SequenceInfo {
                feature_channels: 0,
                name: if info.name.is_empty() { last_part(url) } else { info.name },
                layout: "stream",
                camera: info.camera,
                depth_unit_m: info.depth_unit_m,
                frames: info.frames,
                classes: info.classes,
                bounds: info.bounds,
            },
            base,
            open: None,
        })
    }

    async fn frame(&mut self, index: usize, host: &mut dyn Host) -> Result<Frame, FeedError> {
        let mut attempt = 0;
        loop {
            match self.attempt(index).await {
                Err(e) if e.kind == ErrorKind::ServerGone && attempt < ATTEMPTS => {
                    self.open = None;
                    attempt += 1;
                    let text = format!("{}; trying again ({attempt} of {ATTEMPTS})", e.message);
                    host.event(Event::Notice(&text));
                    sleep(250 << attempt).await;
                }
                other => return other,
            }
        }
    }

    async fn attempt(&mut self, index: usize) -> Result<Frame, FeedError> {
        let mut connection = match self.open.take() {
            Some(connection) if connection.next == index => connection,
            _ => Connection::new(&self.base, index).await?,
        };
        let pixels = self.info.camera.pixels();
        let length = connection.take(4).await?;
        let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize;
        if length > 1 << 16 {
            return Err(bad(format!("frame {index}: found a header of {length} bytes")));
        }
        let text = connection.take(length).await?;
        // A server that cannot read a frame says so in place of it.
        if let Ok(problem) = serde_json::from_slice::<Problem>(&text) {
            return Err(bad(problem.error));
        }
        let header: Header = serde_json::from_slice(&text)
            .map_err(|e| bad(format!("frame {index}: found {e}, expected a frame's header")))?;
        if header.index != index {
            return Err(bad(format!("found frame {}, expected {index}", header.index)));
        }
        let color = connection.take(3 * pixels).await?;
        let depth = connection.take(2 * pixels).await?;
        let labels = if header.labels { Some(connection.take(pixels).await?) } else { None };
        connection.next = index + 1;
        self.open = Some(connection);
        Ok(Frame {
            features: None,
            index,
            number: header.number,
            time_s: header.time_s,
            color: color.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            depth: depth.chunks_exact(2).map(|d| u16::from_le_bytes([d[0], d[1]])).collect(),
            labels,
            truth: self.truth.get(index).copied().flatten(),
        })
    }
}

#[derive(Deserialize)]
struct Problem {
    error: String,
}

impl Connection {
    async fn new(base: &str, from: usize) -> Result<Connection, FeedError> {
        let response = fetch(&format!("{base}api/stream?from={from}")).await?;
        let body = response.body().ok_or_else(|| gone("the server sends nothing".into()))?;
        let reader = body.get_reader().unchecked_into();
        Ok(Connection { reader, waiting: Vec::new(), next: from })
    }

    /// The next `n` bytes.
    async fn take(&mut self, n: usize) -> Result<Vec<u8>, FeedError> {
        while self.waiting.len() < n {
            let failed =
                |e: JsValue| gone(format!("the stream broke off: {}", crate::source::reason(&e)));
            let part = JsFuture::from(self.reader.read()).await.map_err(failed)?;
            let get = |key: &str| Reflect::get(&part, &key.into()).unwrap_or(JsValue::UNDEFINED);
            if get("done").is_truthy() {
                return Err(gone("the stream ended early".into()));
            }
            let bytes: Uint8Array = get("value").unchecked_into();
            let at = self.waiting.len();
            self.waiting.resize(at + bytes.length() as usize, 0);
            bytes.copy_to(&mut self.waiting[at..]);
        }
        let rest = self.waiting.split_off(n);
        Ok(std::mem::replace(&mut self.waiting, rest))
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        // The server may stop reading files for us.
        let _ = self.reader.cancel();
    }
}
