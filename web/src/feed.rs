//! Where a session's frames come from: a sequence that is read frame by frame, or a stream of
//! decoded frames from `mte-slam serve`, which the browser takes as fast as they are used.
use crate::{message::ErrorKind, platform::sleep, source::last_part};
use js_sys::{Reflect, Uint8Array};
use mte_slam_dataset::stream::{FrameDecoder, StreamError, StreamInfo};
use mte_slam_run::{Event, Host, Input};
use mte_slam_types::{
    classes::ClassTable,
    frame::{Frame, SequenceInfo},
    pose::Pose,
    sequence::Sequence,
};
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
    decoder: FrameDecoder,
    /// Index of the frame that comes next.
    next: usize,
}

fn gone(message: String) -> FeedError {
    FeedError { kind: ErrorKind::ServerGone, message }
}

fn bad(message: String) -> FeedError {
    FeedError { kind: ErrorKind::BadFile, message }
}

impl From<StreamError> for FeedError {
    fn from(error: StreamError) -> FeedError {
        match error {
            StreamError::Truncated { .. } => gone(error.to_string()),
            _ => bad(error.to_string()),
        }
    }
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
        let mut info = StreamInfo::from_json(text.as_string().unwrap_or_default().as_bytes())
            .map_err(|e| bad(format!("{address}: {e}")))?;
        if info.name.is_empty() {
            info.name = last_part(url);
        }
        Ok(Stream {
            truth: info.true_poses(),
            info: info.sequence_info(),
            warnings: info.warnings,
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
            _ => Connection::new(&self.base, index, self.info.camera.pixels()).await?,
        };
        let mut frame = connection.frame().await?;
        if frame.index != index {
            return Err(bad(format!("found frame {}, expected {index}", frame.index)));
        }
        frame.truth = self.truth.get(index).copied().flatten();
        connection.next = index + 1;
        self.open = Some(connection);
        Ok(frame)
    }
}

impl Connection {
    async fn new(base: &str, from: usize, pixels: usize) -> Result<Connection, FeedError> {
        let response = fetch(&format!("{base}api/stream?from={from}")).await?;
        let body = response.body().ok_or_else(|| gone("the server sends nothing".into()))?;
        let reader = body.get_reader().unchecked_into();
        Ok(Connection { reader, decoder: FrameDecoder::new(pixels), next: from })
    }

    /// The next frame.
    async fn frame(&mut self) -> Result<Frame, FeedError> {
        loop {
            if let Some(frame) = self.decoder.next_frame()? {
                return Ok(frame);
            }
            let failed =
                |e: JsValue| gone(format!("the stream broke off: {}", crate::source::reason(&e)));
            let part = JsFuture::from(self.reader.read()).await.map_err(failed)?;
            let get = |key: &str| Reflect::get(&part, &key.into()).unwrap_or(JsValue::UNDEFINED);
            if get("done").is_truthy() {
                self.decoder.finish()?;
                return Err(gone("the stream ended early".into()));
            }
            let bytes: Uint8Array = get("value").unchecked_into();
            self.decoder.push(&bytes.to_vec());
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        // The server may stop reading files for us.
        let _ = self.reader.cancel();
    }
}
