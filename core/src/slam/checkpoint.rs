//! The state of a run as named tensors, for files of any kind.
use super::{Observation, PoseEstimate, Slam, SlamError, TrackingStatus};
use crate::{
    camera::Camera,
    classes::ClassTable,
    config::Config,
    device::{Device, Trained},
    engine::Engine,
    field::FieldShape,
    frame::{Bounds, MAX_FEATURE_CHANNELS, SequenceInfo},
    layout::ANCHOR_FLOATS,
    pose::Pose,
    recording::{BufferId, Recording},
    track::odometry::ColourRegistration,
};
use alloc::{
    collections::BTreeMap,
    format,
    string::{String, ToString},
    vec,
    vec::Vec,
};
use serde::{Deserialize, Serialize};

/// Number format of a tensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dtype {
    /// 32-bit float.
    F32,
    /// 32-bit unsigned integer.
    U32,
}

/// A named array.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Dotted name.
    pub name: String,
    /// Number format.
    pub dtype: Dtype,
    /// Dimensions, slowest first.
    pub shape: Vec<usize>,
    /// Values, little endian.
    pub bytes: Vec<u8>,
}

/// The state of a run: enough to render, mesh and evaluate it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Parameters, poses, kept depth images.
    pub tensors: Vec<Tensor>,
    /// `format`, and `state` as JSON: configuration, camera, classes, bounds, statuses.
    pub metadata: BTreeMap<String, String>,
}

const FORMAT: &str = "mte-slam-2";

#[derive(Serialize, Deserialize)]
struct State {
    config: Config,
    name: String,
    camera: Camera,
    depth_unit_m: f64,
    classes: ClassTable,
    bounds: Bounds,
    #[serde(default)]
    feature_channels: usize,
    step: u32,
    times_s: Vec<f64>,
    /// 0 first, 1 tracked, 2 lost.
    statuses: Vec<u8>,
    poses: Vec<[f64; 16]>,
    observed_frames: Vec<usize>,
    #[serde(default = "yes")]
    labelled: bool,
    /// Where the colours lie that the map was trained with.
    #[serde(default)]
    colour_registration: ColourRegistration,
}

/// Maps saved before it was noted had labels, if classes.
fn yes() -> bool {
    true
}

fn tensor<T: bytemuck::Pod>(name: &str, dtype: Dtype, shape: Vec<usize>, values: &[T]) -> Tensor {
    Tensor { name: name.to_string(), dtype, shape, bytes: bytemuck::cast_slice(values).to_vec() }
}

fn wrong(field: &str, found: impl ToString, expected: impl ToString) -> SlamError {
    SlamError::Checkpoint {
        field: field.to_string(),
        found: found.to_string(),
        expected: expected.to_string(),
    }
}

impl Slam {
    /// The state of the run.
    ///
    /// # Errors
    /// [`SlamError::NoMap`], engine failures.
    pub async fn checkpoint(&mut self) -> Result<Checkpoint, SlamError> {
        let mut tensors = Vec::new();
        let device = self.device()?;
        for (name, t) in parameters(device) {
            for (part, buffer) in
                [("values", t.values), ("moment1", t.moment1), ("moment2", t.moment2)]
            {
                let v: Vec<f32> = device.engine.read_as(buffer, 0, t.floats).await?;
                tensors.push(tensor(&format!("{name}.{part}"), Dtype::F32, vec![v.len()], &v));
            }
        }
        for (name, buffer, n) in words(device) {
            let v = device.engine.read(buffer, 0, n).await?;
            tensors.push(tensor(name, Dtype::U32, vec![n], &v));
        }
        let (bounds, step) = (device.shape.bounds, device.step);
        let pixels = self.observations.first().map_or(0, |o| o.depth.len());
        let mut depths = Vec::with_capacity(pixels * self.observations.len());
        for o in &self.observations {
            depths.extend(o.depth.iter().map(|d| u32::from(*d)));
        }
        let shape = vec![self.observations.len(), pixels];
        tensors.push(tensor("observed_depth", Dtype::U32, shape, &depths));
        let state = State {
            config: self.config.clone(),
            name: self.info.name.clone(),
            camera: self.info.camera,
            depth_unit_m: self.info.depth_unit_m,
            classes: self.info.classes.clone(),
            bounds,
            feature_channels: self.info.feature_channels,
            step,
            times_s: self.frames.iter().map(|f| f.time_s).collect(),
            statuses: self.frames.iter().map(|f| f.status as u8).collect(),
            poses: self.frames.iter().map(|f| f.world_from_camera.to_row_major()).collect(),
            observed_frames: self.observations.iter().map(|o| o.frame).collect(),
            labelled: self.labelled(),
            colour_registration: self.registration,
        };
        let json = serde_json::to_string(&state).map_err(|e| wrong("state", e, "JSON"))?;
        let metadata = [("format", FORMAT.to_string()), ("state", json)];
        Ok(Checkpoint {
            tensors,
            metadata: metadata.into_iter().map(|(k, v)| (k.to_string(), v)).collect(),
        })
    }

    /// A system that can render, mesh and be evaluated as the one the checkpoint was made of. It
    /// does not track on: odometry and keyframe images are not part of a checkpoint.
    ///
    /// # Errors
    /// [`SlamError::Checkpoint`] names what does not fit; engine failures.
    pub async fn restore(engine: Engine, checkpoint: &Checkpoint) -> Result<Slam, SlamError> {
        let entry = |key: &str| {
            checkpoint.metadata.get(key).ok_or_else(|| wrong(key, "nothing", "an entry"))
        };
        if entry("format")? != FORMAT {
            return Err(wrong("format", entry("format")?, FORMAT));
        }
        let state: State = serde_json::from_str(entry("state")?)
            .map_err(|e| wrong("state", e, "the state of a run"))?;
        state.config.validate()?;
        let finite =
            |b: &Bounds| b.min.is_finite() && b.max.is_finite() && b.min.cmplt(b.max).all();
        if !finite(&state.bounds) || (state.bounds.max - state.bounds.min).max_element() > 1e3 {
            return Err(wrong("bounds", format!("{:?}", state.bounds), "a box below 1 km"));
        }
        let n = state.poses.len();
        if state.times_s.len() != n || state.statuses.len() != n {
            return Err(wrong("statuses", state.statuses.len(), n));
        }
        let camera = state.camera;
        if camera.width == 0 || camera.height == 0 || camera.pixels() > 1 << 28 {
            return Err(wrong("camera", format!("{camera:?}"), "an image size"));
        }
        let info = SequenceInfo {
            feature_channels: state.feature_channels,
            name: state.name,
            layout: "checkpoint",
            camera,
            depth_unit_m: state.depth_unit_m,
            frames: n,
            classes: state.classes,
            bounds: None,
        };
        if info.classes.len() > 255 {
            return Err(wrong("classes", info.classes.len(), "at most 255"));
        }
        if info.feature_channels > MAX_FEATURE_CHANNELS {
            let expected = format!("at most {MAX_FEATURE_CHANNELS}");
            return Err(wrong("feature_channels", info.feature_channels, expected));
        }
        let shape = FieldShape::new(state.bounds, &state.config.field);
        let classes = info.classes.len() as u32;
        let unit = info.depth_unit_m;
        let channels = info.feature_channels as u32;
        let mut device =
            Device::with_features(engine, &state.config, camera, unit, classes, channels, shape)?;
        device.step = state.step;
        let find = |name: &str| {
            checkpoint
                .tensors
                .iter()
                .find(|t| t.name == name)
                .ok_or_else(|| wrong(name, "nothing", "a tensor"))
        };
        for (name, t) in parameters(&device) {
            for (part, buffer) in
                [("values", t.values), ("moment1", t.moment1), ("moment2", t.moment2)]
            {
                let name = format!("{name}.{part}");
                let found = find(&name)?;
                if found.dtype != Dtype::F32 || found.bytes.len() != t.floats * 4 {
                    let expected = format!("{} bytes of f32", t.floats * 4);
                    return Err(wrong(&name, format!("{} bytes", found.bytes.len()), expected));
                }
                let values: Vec<f32> = bytemuck::pod_collect_to_vec(&found.bytes);
                if values.iter().any(|v| !v.is_finite()) {
                    return Err(wrong(&name, "a value that is not finite", "finite values"));
                }
                let mut r = Recording::default();
                r.upload(buffer, 0, &values);
                device.engine.submit(&r)?;
            }
        }
        let scale = state.colour_registration.scale;
        if !(scale > 0.1 && scale < 10.0) {
            return Err(wrong("colour_registration.scale", scale, "0.1 to 10"));
        }
        for (name, buffer, n) in words(&device) {
            let found = find(name)?;
            if found.dtype != Dtype::U32 || found.bytes.len() != n * 4 {
                let expected = format!("{} bytes of u32", n * 4);
                return Err(wrong(name, format!("{} bytes", found.bytes.len()), expected));
            }
            let values: Vec<u32> = bytemuck::pod_collect_to_vec(&found.bytes);
            let mut r = Recording::default();
            r.upload(buffer, 0, &values);
            device.engine.submit(&r)?;
        }
        let mut slam = Slam::new(device_placeholder(), state.config, &info).await?;
        slam.registration = state.colour_registration;
        slam.restored_labels = state.labelled && classes > 0;
        let depth = find("observed_depth")?;
        let all: Vec<u32> = bytemuck::pod_collect_to_vec(&depth.bytes);
        let step = super::mapping::observation_step(camera.width);
        let pixels = camera.downscaled(step).pixels();
        if all.len() != pixels * state.observed_frames.len() {
            let expected = pixels * state.observed_frames.len();
            return Err(wrong("observed_depth", all.len(), expected));
        }
        for (frame, d) in state.observed_frames.iter().zip(all.chunks_exact(pixels.max(1))) {
            let depth = d.iter().map(|v| *v as u16).collect();
            slam.observations.push(Observation { frame: *frame, depth });
        }
        for i in 0..n {
            let pose = Pose::from_row_major(&state.poses[i])
                .ok_or_else(|| wrong("poses", format!("pose {i} is no rigid transform"), "one"))?;
            slam.frames.push(PoseEstimate {
                frame: i,
                time_s: state.times_s[i],
                world_from_camera: pose,
                status: match state.statuses[i] {
                    0 => TrackingStatus::First,
                    1 => TrackingStatus::Tracked,
                    _ => TrackingStatus::Lost,
                },
            });
        }
        slam.engine = None;
        slam.device = Some(device);
        Ok(slam)
    }
}

/// `Slam::new` wants an engine; a restored system already has its device.
fn device_placeholder() -> Engine {
    Engine::Cpu(crate::engine::CpuEngine::default())
}

fn parameters(device: &Device) -> Vec<(&'static str, Trained)> {
    let mut all = vec![
        ("planes.geometry", device.geometry),
        ("planes.appearance", device.appearance),
        ("planes.semantic", device.semantic),
        ("decoders", device.decoders),
    ];
    all.extend(device.fusion.as_ref().map(|f| ("fusion", f.parameters)));
    all.extend(device.sample_head.as_ref().map(|h| ("sample_head", h.parameters)));
    all
}

/// Buffers of words, which are read and written as they are.
fn words(device: &Device) -> Vec<(&'static str, BufferId, usize)> {
    let Some(s) = &device.suppressor else { return Vec::new() };
    let slots = s.slots() as usize;
    vec![
        ("anchors", s.anchors, slots * ANCHOR_FLOATS),
        ("anchors.votes", s.votes, slots * device.classes as usize),
    ]
}
