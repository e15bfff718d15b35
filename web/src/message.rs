//! What goes in and what comes out: [`Command`] and [`Event`], with their TypeScript types.
use crate::settings::Settings;
use serde::{Deserialize, Serialize};
use tsify::Tsify;
use wasm_bindgen::JsValue;

/// What a session is told.
#[derive(Tsify)]
#[serde(tag = "type", rename_all = "camelCase")]
pub enum Command {
    /// Open a recording and make ready; answered by `opened`.
    Open(OpenCommand),
    /// Process frames until told otherwise. The host then calls `step` again and again.
    Start,
    /// Stop after the frame under way.
    Pause,
    /// Process one frame.
    Step,
    /// Render the map; answered by `rendered`.
    SeekView(ViewCommand),
    /// Make a file; answered by `exported`.
    Export(ExportCommand),
    /// Emit `saved` now.
    Save,
    /// Emit path, pose and the whole mesh again, for a view that has lost them.
    Refresh,
    /// Free the device and forget everything.
    Dispose,
}

/// Of [`Command::Open`].
#[derive(Deserialize, Tsify)]
#[serde(rename_all = "camelCase")]
pub struct OpenCommand {
    /// Where frames come from, a [`SourceSpec`]. Kept as it is: files do not go through serde.
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[tsify(type = "SourceSpec")]
    pub source: JsValue,
    /// How they are processed.
    #[serde(default)]
    #[tsify(optional)]
    pub settings: Settings,
    /// Emit `saved` now and then (at most a twentieth of the time goes into it).
    #[serde(default)]
    #[tsify(optional)]
    pub keep: bool,
    /// Bytes of a `saved` event: go on from there. The recording must be the same; of the settings
    /// only `engine` is taken, the rest is as it was.
    #[serde(default, with = "serde_wasm_bindgen::preserve")]
    #[tsify(optional, type = "Uint8Array")]
    pub resume: JsValue,
}

/// Where frames come from.
#[derive(Tsify)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum SourceSpec {
    /// The built-in sequence.
    BuiltIn(BuiltInSource),
    /// Files of a folder.
    Files(FilesSource),
    /// A local archive.
    Zip(ZipSource),
    /// An archive on a server, read by ranges where the server allows.
    ZipUrl(UrlSource),
    /// A folder on a server that lists its files.
    Http(UrlSource),
    /// A stream of `mte-slam serve`.
    Serve(UrlSource),
}

/// Of [`SourceSpec::BuiltIn`].
#[derive(Clone, Deserialize, Tsify)]
#[serde(rename_all = "camelCase", default)]
pub struct BuiltInSource {
    /// `room` or `office`.
    pub scene: String,
    /// Number of frames.
    pub frames: usize,
    /// Width of the images \[pixels\]; the height is three quarters of it.
    pub width: u32,
    /// Noise and holes as of a Kinect.
    pub noise: bool,
}

impl Default for BuiltInSource {
    fn default() -> Self {
        BuiltInSource { scene: "room".into(), frames: 120, width: 160, noise: false }
    }
}

/// Of [`SourceSpec::Files`].
#[derive(Deserialize, Tsify)]
pub struct FilesSource {
    /// The folder's name.
    pub name: String,
    /// Its files with their paths below the folder.
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[tsify(type = "{ path: string; file: File }[]")]
    pub files: JsValue,
}

/// Of [`SourceSpec::Zip`].
#[derive(Deserialize, Tsify)]
pub struct ZipSource {
    /// The archive's name.
    pub name: String,
    /// The archive.
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[tsify(type = "Blob")]
    pub file: JsValue,
}

/// A source on a server.
#[derive(Clone, Deserialize, Tsify)]
pub struct UrlSource {
    /// Absolute address.
    pub url: String,
}

/// Of [`Command::SeekView`].
#[derive(Deserialize, Tsify)]
#[serde(rename_all = "camelCase")]
pub struct ViewCommand {
    /// Frame whose estimated pose is taken; the last one by default.
    #[serde(default)]
    #[tsify(optional)]
    pub frame: Option<usize>,
    /// Or any pose, `world_from_camera`, row-major.
    #[serde(default)]
    #[tsify(optional)]
    pub world_from_camera: Option<[f64; 16]>,
    /// Width of the view \[pixels\].
    #[serde(default)]
    #[tsify(optional)]
    pub width: Option<u32>,
}

/// What can be exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Tsify)]
#[serde(rename_all = "kebab-case")]
pub enum ExportKind {
    /// Mesh with colours and classes.
    Ply,
    /// Mesh with colours.
    Glb,
    /// Mesh with a material a class.
    GlbClasses,
    /// Poses in TUM format.
    Trajectory,
    /// Figures with their protocols.
    Metrics,
    /// The map; `mte-slam mesh` and `render` read it.
    Checkpoint,
}

/// Of [`Command::Export`].
#[derive(Deserialize, Tsify)]
#[serde(rename_all = "camelCase")]
pub struct ExportCommand {
    /// What.
    pub kind: ExportKind,
    /// Edge of a marching cube \[m\]; the configuration's by default.
    #[serde(default)]
    #[tsify(optional)]
    pub resolution_m: Option<f64>,
}

/// What a session says.
#[derive(Serialize, Tsify)]
#[serde(tag = "type", rename_all = "camelCase")]
pub enum Event {
    /// A recording is open and its first frame can be processed.
    Opened(OpenedEvent),
    /// How far some work is.
    Progress(ProgressEvent),
    /// The images of the frame under way.
    Frame(PictureEvent),
    /// A view rendered from the map.
    Rendered(PictureEvent),
    /// Where a frame was seen from.
    Pose(PoseEvent),
    /// Every position so far, after corrections.
    Trajectory(TrajectoryEvent),
    /// Figures after a frame.
    Metrics(MetricsEvent),
    /// Parts of the surface that changed.
    Map(MapEvent),
    /// A frame was not located; the map ignores it.
    Lost(LostEvent),
    /// A file.
    Exported(ExportedEvent),
    /// The state of the run, to go on from.
    Saved(SavedEvent),
    /// Something worth knowing that stops nothing.
    Warning(WarningEvent),
    /// What was asked for could not be done.
    Error(ErrorEvent),
    /// The last frame is mapped and the map refined.
    Done(DoneEvent),
}

/// Of [`Event::Opened`].
#[derive(Serialize, Tsify)]
#[serde(rename_all = "camelCase")]
pub struct OpenedEvent {
    /// The recording's name.
    pub name: String,
    /// How its files are laid out.
    pub layout: String,
    /// Number of frames.
    pub frames: usize,
    /// The frame that comes first: 0, or where a saved run goes on.
    pub next: usize,
    /// Width of the images \[pixels\].
    pub width: u32,
    /// Height of the images \[pixels\].
    pub height: u32,
    /// Focal length over half the height.
    pub focal: f64,
    /// Classes in the order of their index.
    pub classes: Vec<ClassInfo>,
    /// What computes.
    pub engine: EngineDescription,
    /// What was assumed or skipped while reading.
    pub warnings: Vec<String>,
    /// True positions \[m\], 3 a frame, NaN where unknown; empty without truth.
    #[serde(with = "serde_bytes")]
    #[tsify(type = "Uint8Array")]
    pub truth: Vec<u8>,
    /// The complete configuration.
    #[tsify(type = "Record<string, unknown>")]
    pub config: serde_json::Value,
}

/// A class for people.
#[derive(Serialize, Tsify)]
pub struct ClassInfo {
    /// Name.
    pub name: String,
    /// sRGB.
    pub color: [u8; 3],
}

/// What computes.
#[derive(Clone, Serialize, Tsify)]
pub struct EngineDescription {
    /// `gpu` or `cpu`.
    pub kind: String,
    /// Name of the adapter.
    pub adapter: String,
    /// Why it is not the GPU that was preferred.
    pub why: Option<String>,
}

/// Of [`Event::Progress`].
#[derive(Serialize, Tsify)]
pub struct ProgressEvent {
    /// What is under way.
    pub stage: String,
    /// Parts done.
    pub done: f64,
    /// Parts in all.
    pub total: f64,
}

/// Images, RGBA, row-major.
#[derive(Serialize, Tsify)]
pub struct PictureEvent {
    /// Frame.
    pub index: usize,
    /// Width \[pixels\].
    pub width: u32,
    /// Height \[pixels\].
    pub height: u32,
    /// Colour.
    #[serde(with = "serde_bytes")]
    #[tsify(type = "Uint8Array")]
    pub color: Vec<u8>,
    /// Depth in false colours.
    #[serde(with = "serde_bytes")]
    #[tsify(type = "Uint8Array")]
    pub depth: Vec<u8>,
    /// Classes in their colours; empty without classes.
    #[serde(with = "serde_bytes")]
    #[tsify(type = "Uint8Array")]
    pub classes: Vec<u8>,
}

/// Of [`Event::Pose`].
#[derive(Serialize, Tsify)]
#[serde(rename_all = "camelCase")]
pub struct PoseEvent {
    /// Frame.
    pub index: usize,
    /// `first`, `tracked` or `lost`.
    pub status: String,
    /// Row-major.
    pub world_from_camera: [f64; 16],
}

/// Of [`Event::Trajectory`].
#[derive(Serialize, Tsify)]
pub struct TrajectoryEvent {
    /// 3 floats a frame \[m\].
    #[serde(with = "serde_bytes")]
    #[tsify(type = "Uint8Array")]
    pub positions: Vec<u8>,
}

/// Of [`Event::Metrics`].
#[derive(Clone, Debug, Serialize, Tsify)]
#[serde(rename_all = "camelCase")]
pub struct MetricsEvent {
    /// Frame.
    pub index: usize,
    /// Time of tracking \[ms\].
    pub tracking_ms: f64,
    /// Time of mapping \[ms\]; 0 when the frame was not mapped.
    pub mapping_ms: f64,
    /// Time of the frame with reading, meshing and drawing \[ms\].
    pub total_ms: f64,
    /// Absolute trajectory error so far: RMSE of the positions after alignment \[cm\].
    pub ate_cm: Option<f64>,
    /// Losses of the last mapping iteration.
    pub losses: Option<LossFigures>,
    /// Keyframes kept.
    pub keyframes: usize,
    /// Semantic anchors, where the suppressor runs.
    pub anchors: Option<f64>,
    /// Buffers on the device \[bytes\].
    pub device_bytes: f64,
    /// Memory of the WebAssembly module \[bytes\].
    pub wasm_bytes: f64,
}

/// Mean losses, weighted as optimised.
#[derive(Clone, Debug, Serialize, Tsify)]
pub struct LossFigures {
    /// Sum of the others.
    pub total: f64,
    /// Signed distance.
    pub sdf: f64,
    /// Rendered depth.
    pub depth: f64,
    /// Rendered colour.
    pub color: f64,
    /// Cross-entropy.
    pub semantic: f64,
}

/// Of [`Event::Map`].
#[derive(Serialize, Tsify)]
pub struct MapEvent {
    /// Chunks that replace those of the same key.
    pub chunks: Vec<ChunkData>,
    /// Triangles of the whole mesh.
    pub triangles: usize,
    /// Corners of the map's box \[m\]: smallest, largest.
    pub bounds: Option<[f64; 6]>,
}

/// A part of the surface. A vertex has 20 bytes: position (3 x f32, \[m\]), normal (3 x i8) and a
/// free byte, red, green, blue and class (4 x u8, 255 without class).
#[derive(Serialize, Tsify)]
pub struct ChunkData {
    /// Names the chunk.
    pub key: String,
    /// Vertices.
    #[serde(with = "serde_bytes")]
    #[tsify(type = "Uint8Array")]
    pub vertices: Vec<u8>,
    /// Indices of the triangles, u32; empty for a chunk that has vanished.
    #[serde(with = "serde_bytes")]
    #[tsify(type = "Uint8Array")]
    pub indices: Vec<u8>,
}

/// Of [`Event::Lost`].
#[derive(Serialize, Tsify)]
pub struct LostEvent {
    /// Frame.
    pub index: usize,
}

/// Of [`Event::Exported`].
#[derive(Serialize, Tsify)]
pub struct ExportedEvent {
    /// What it is.
    pub kind: ExportKind,
    /// Suggested file name.
    pub name: String,
    /// Media type.
    pub mime: String,
    /// The file.
    #[serde(with = "serde_bytes")]
    #[tsify(type = "Uint8Array")]
    pub bytes: Vec<u8>,
}

/// Of [`Event::Saved`].
#[derive(Serialize, Tsify)]
pub struct SavedEvent {
    /// Frames processed.
    pub frame: usize,
    /// Number of frames.
    pub frames: usize,
    /// For the command `open`; also a checkpoint that `mte-slam mesh` and `render` read. Never as a
    /// whole in the module's memory, which cannot shrink.
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[tsify(type = "Uint8Array")]
    pub bytes: JsValue,
}

/// Of [`Event::Warning`].
#[derive(Serialize, Tsify)]
pub struct WarningEvent {
    /// For people.
    pub message: String,
}

/// What kind of failure, so that a page can say what helps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Tsify)]
#[serde(rename_all = "kebab-case")]
pub enum ErrorKind {
    /// The browser has no WebGPU.
    NoWebgpu,
    /// There is no adapter, or it gives no device.
    Adapter,
    /// The adapter has less than WebGPU's default limits.
    Limits,
    /// The device is gone.
    DeviceLost,
    /// Device or module have no memory left, or the scene is too large for the limits.
    OutOfMemory,
    /// A file is not what it should be.
    BadFile,
    /// The settings make no sense.
    BadSettings,
    /// A server does not answer (any more).
    ServerGone,
    /// A command at a time when it cannot be followed.
    Command,
    /// Anything else.
    Engine,
}

/// Of [`Event::Error`].
#[derive(Clone, Debug, Serialize, Tsify)]
pub struct ErrorEvent {
    /// What kind.
    pub kind: ErrorKind,
    /// What happened, for people.
    pub message: String,
    /// Whether the run can go on from here by `start`.
    pub resumable: bool,
}

/// Of [`Event::Done`].
#[derive(Serialize, Tsify)]
pub struct DoneEvent {
    /// Frames processed.
    pub frames: usize,
    /// Frames that were not located.
    pub lost: usize,
    /// Time from the first frame \[s\].
    pub seconds: f64,
}
