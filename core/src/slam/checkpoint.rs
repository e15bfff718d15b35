//! The state of a run as named tensors, for files of any kind.
//!
//! Kept are the map with Adam's moments, poses, counters, the odometer's numbers and the small
//! depth images that meshes are culled with. Keyframes' images are not: they are read from the
//! recording again (`resume.rs`), and each frame's hash shows whether it is the same recording.
use super::{
    PoseEstimate, Slam, SlamError, TrackingStatus,
    keyframes::{Observation, observation_step},
};
use crate::{
    camera::Camera,
    classes::ClassTable,
    config::Config,
    frame::{Bounds, MAX_FEATURE_CHANNELS, SequenceInfo},
    hash::Hasher,
    map::{AnchorCounts, Counters},
    pose::Pose,
    track::odometry::{ColorRegistration, OdometerState},
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
    /// 64-bit float.
    F64,
    /// 16-bit unsigned integer.
    U16,
    /// 32-bit unsigned integer.
    U32,
    /// 64-bit unsigned integer.
    U64,
}

impl Dtype {
    /// Bytes of a number.
    pub fn size(self) -> usize {
        match self {
            Dtype::U16 => 2,
            Dtype::F32 | Dtype::U32 => 4,
            Dtype::F64 | Dtype::U64 => 8,
        }
    }
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

/// The state of a run: [`Slam::resume`] continues it, [`Slam::restore`] shows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Parameters, poses, kept depth images.
    pub tensors: Vec<Tensor>,
    /// `format`, `configuration` and `data` (hashes), and `state` as JSON. A host may add entries.
    pub metadata: BTreeMap<String, String>,
}

const FORMAT: &str = "mte-slam-6";

/// What is the same for all frames, as far as it decides what a run computes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SequenceState {
    name: String,
    pub camera: Camera,
    depth_unit_m: f64,
    frames: usize,
    classes: ClassTable,
    feature_channels: usize,
    bounds: Option<Bounds>,
}

impl SequenceState {
    pub fn of(info: &SequenceInfo) -> SequenceState {
        SequenceState {
            name: info.name.clone(),
            camera: info.camera,
            depth_unit_m: info.depth_unit_m,
            frames: info.frames,
            classes: info.classes.clone(),
            feature_channels: info.feature_channels,
            bounds: info.bounds,
        }
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn into_info(self) -> SequenceInfo {
        SequenceInfo {
            name: self.name,
            layout: "checkpoint",
            camera: self.camera,
            depth_unit_m: self.depth_unit_m,
            frames: self.frames,
            classes: self.classes,
            feature_channels: self.feature_channels,
            bounds: self.bounds,
        }
    }
}

#[derive(Clone, Serialize, Deserialize)]
pub(super) struct SavedKeyframe {
    pub frame: usize,
    pub slot: u32,
    pub world_from_camera: Pose,
}

#[derive(Clone, Serialize, Deserialize)]
pub(super) struct State {
    pub config: Config,
    pub sequence: SequenceState,
    /// Box of the map \[m\].
    pub bounds: Bounds,
    pub counters: Counters,
    pub iteration: u32,
    pub mapping_calls: u32,
    pub finished_iterations: u32,
    pub bounds_refused: bool,
    pub class_counts: Vec<f64>,
    pub slots: u32,
    pub used_slots: u32,
    pub free_slots: Vec<u32>,
    pub keyframes: Vec<SavedKeyframe>,
    pub observed_frames: Vec<usize>,
    pub anchor_history: Vec<(usize, AnchorCounts)>,
    pub registrations: Vec<(usize, ColorRegistration)>,
    pub odometer: OdometerState,
}

/// A checkpoint, checked.
pub(super) struct Saved {
    pub state: State,
    pub frames: Vec<PoseEstimate>,
    pub hashes: Vec<u64>,
    pub observations: Vec<Observation>,
}

fn tensor<T: bytemuck::Pod>(name: &str, dtype: Dtype, shape: Vec<usize>, values: &[T]) -> Tensor {
    Tensor { name: name.to_string(), dtype, shape, bytes: bytemuck::cast_slice(values).to_vec() }
}

pub(super) fn wrong(
    field: impl Into<String>,
    found: impl ToString,
    expected: impl ToString,
) -> SlamError {
    SlamError::Checkpoint {
        field: field.into(),
        found: found.to_string(),
        expected: expected.to_string(),
    }
}

/// A hash of a configuration.
fn configuration_hash(json: &str) -> String {
    let mut h = Hasher::default();
    h.bytes(json.as_bytes());
    format!("{:016x}", h.finish())
}

/// The configuration in the text of a state, as it was written: that of an earlier version may lack
/// settings, and written again it would have them. `None` where it does not stand first.
fn recorded_configuration(state: &str) -> Option<&str> {
    let text = state.strip_prefix("{\"config\":")?;
    let mut values = serde_json::Deserializer::from_str(text).into_iter::<serde::de::IgnoredAny>();
    values.next()?.ok()?;
    text.get(..values.byte_offset())
}

/// A hash of a sequence and the frames that were processed.
fn data_hash(sequence: &str, hashes: &[u64]) -> String {
    let mut h = Hasher::default();
    h.bytes(sequence.as_bytes());
    hashes.iter().for_each(|x| h.word(*x));
    format!("{:016x}", h.finish())
}

fn json(value: &impl Serialize) -> Result<String, SlamError> {
    serde_json::to_string(value).map_err(|e| wrong("state", e, "numbers that JSON can hold"))
}

impl Slam {
    /// The state of the run, between frames or calls of [`Slam::finish_step`]. Making one changes
    /// nothing: the run continues as it would have.
    ///
    /// # Errors
    /// [`SlamError::NoMap`] before the first frame, engine failures.
    pub async fn checkpoint(&mut self) -> Result<Checkpoint, SlamError> {
        if self.only_shown {
            return Err(wrong("state", "a map that was restored to be shown", "a run"));
        }
        let used_slots = self.used_slots;
        let (engine, map, _) = self.mapped()?;
        let mut tensors = Vec::new();
        for b in map.state_buffers(used_slots) {
            let words = engine.read(b.buffer, 0, b.words()).await?;
            let dtype = if b.floats { Dtype::F32 } else { Dtype::U32 };
            tensors.push(tensor(&b.name, dtype, b.shape.to_vec(), &words));
        }
        let (bounds, counters, slots) = (map.shape.bounds, map.counters(), map.slots());

        let n = self.frames.len();
        let poses: Vec<[f64; 16]> =
            self.frames.iter().map(|f| f.world_from_camera.to_row_major()).collect();
        tensors.push(tensor("frames.world_from_camera", Dtype::F64, vec![n, 4, 4], &poses));
        let times: Vec<f64> = self.frames.iter().map(|f| f.time_s).collect();
        tensors.push(tensor("frames.time_s", Dtype::F64, vec![n], &times));
        // 0 first, 1 tracked, 2 lost.
        let statuses: Vec<u32> = self.frames.iter().map(|f| f.status as u32).collect();
        tensors.push(tensor("frames.status", Dtype::U32, vec![n], &statuses));
        tensors.push(tensor("frames.hash", Dtype::U64, vec![n], &self.hashes));
        let camera = self.info.camera.downscaled(observation_step(self.info.camera.width));
        let (w, h) = (camera.width as usize, camera.height as usize);
        let mut depths = Vec::with_capacity(w * h * self.observations.len());
        self.observations.iter().for_each(|o| depths.extend_from_slice(&o.depth));
        let shape = vec![self.observations.len(), h, w];
        tensors.push(tensor("observations.depth", Dtype::U16, shape, &depths));

        let state = State {
            config: self.config.clone(),
            sequence: SequenceState::of(&self.info),
            bounds,
            counters,
            iteration: self.iteration,
            mapping_calls: self.mapping_calls,
            finished_iterations: self.finished_iterations,
            bounds_refused: self.bounds_refused,
            class_counts: self.class_counts.0.clone(),
            slots,
            used_slots,
            free_slots: self.free_slots.clone(),
            keyframes: self
                .keyframes
                .iter()
                .map(|k| SavedKeyframe {
                    frame: k.frame,
                    slot: k.slot,
                    world_from_camera: k.world_from_camera,
                })
                .collect(),
            observed_frames: self.observations.iter().map(|o| o.frame).collect(),
            anchor_history: self.anchor_history.clone(),
            registrations: self.registrations.clone(),
            odometer: self.odometer.state(),
        };
        let metadata = [
            ("format", FORMAT.to_string()),
            ("configuration", configuration_hash(&json(&state.config)?)),
            ("data", data_hash(&json(&state.sequence)?, &self.hashes)),
            ("state", json(&state)?),
        ];
        Ok(Checkpoint {
            tensors,
            metadata: metadata.into_iter().map(|(k, v)| (k.to_string(), v)).collect(),
        })
    }
}

impl Checkpoint {
    /// Number of frames that had been processed, if this is a checkpoint at all.
    pub fn frames(&self) -> Option<usize> {
        self.tensors.iter().find(|t| t.name == "frames.status")?.shape.first().copied()
    }

    /// A tensor, which must be of this kind and number of values.
    pub(super) fn values<T: bytemuck::Pod>(
        &self,
        name: &str,
        dtype: Dtype,
        count: usize,
    ) -> Result<Vec<T>, SlamError> {
        let found = self.tensors.iter().find(|t| t.name == name);
        let found = found.ok_or_else(|| wrong(name, "nothing", "a tensor"))?;
        if found.dtype != dtype || Some(found.bytes.len()) != count.checked_mul(dtype.size()) {
            let seen = format!("{} bytes of {:?}", found.bytes.len(), found.dtype);
            return Err(wrong(name, seen, format!("{count} x {} of {dtype:?}", dtype.size())));
        }
        Ok(bytemuck::pod_collect_to_vec(&found.bytes))
    }

    /// Everything but the map's buffers, checked.
    pub(super) fn saved(&self) -> Result<Saved, SlamError> {
        let entry =
            |key: &str| self.metadata.get(key).ok_or_else(|| wrong(key, "nothing", "an entry"));
        if entry("format")? != FORMAT {
            return Err(wrong("format", entry("format")?, FORMAT));
        }
        let state: State = serde_json::from_str(entry("state")?)
            .map_err(|e| wrong("state", e, "the state of a run"))?;
        let n = self.frames().unwrap_or(0);
        let hashes: Vec<u64> = self.values("frames.hash", Dtype::U64, n)?;
        let hash = match recorded_configuration(entry("state")?) {
            Some(text) => configuration_hash(text),
            None => configuration_hash(&json(&state.config)?),
        };
        if *entry("configuration")? != hash {
            return Err(wrong("configuration", entry("configuration")?, hash));
        }
        let hash = data_hash(&json(&state.sequence)?, &hashes);
        if *entry("data")? != hash {
            return Err(wrong("data", entry("data")?, hash));
        }
        state.check(n)?;

        let numbers: Vec<[f64; 16]> =
            self.values("frames.world_from_camera", Dtype::F64, 16 * n).map(|v: Vec<f64>| {
                v.chunks_exact(16).map(|m| core::array::from_fn(|i| m[i])).collect()
            })?;
        let times: Vec<f64> = self.values("frames.time_s", Dtype::F64, n)?;
        let statuses: Vec<u32> = self.values("frames.status", Dtype::U32, n)?;
        let mut frames = Vec::with_capacity(n);
        for i in 0..n {
            let pose = exact_pose(&numbers[i]).ok_or_else(|| {
                wrong("frames.world_from_camera", format!("no rigid transform at {i}"), "one")
            })?;
            frames.push(PoseEstimate {
                frame: i,
                time_s: times[i],
                world_from_camera: pose,
                status: match statuses[i] {
                    0 => TrackingStatus::First,
                    1 => TrackingStatus::Tracked,
                    2 => TrackingStatus::Lost,
                    other => return Err(wrong("frames.status", other, "0, 1 or 2")),
                },
            });
        }
        let camera = state.sequence.camera;
        let small = camera.downscaled(observation_step(camera.width)).pixels();
        let observed = &state.observed_frames;
        let depths: Vec<u16> =
            self.values("observations.depth", Dtype::U16, small.saturating_mul(observed.len()))?;
        let observations = (observed.iter().zip(depths.chunks_exact(small.max(1))))
            .map(|(frame, depth)| Observation { frame: *frame, depth: depth.to_vec() })
            .collect();
        Ok(Saved { state, frames, hashes, observations })
    }
}

/// A pose, to the last bit; `None` where the numbers are no rigid transform.
fn exact_pose(m: &[f64; 16]) -> Option<Pose> {
    let mut pose = Pose::from_row_major(m)?;
    for (i, axis) in
        [&mut pose.rotation.x_axis, &mut pose.rotation.y_axis, &mut pose.rotation.z_axis]
            .into_iter()
            .enumerate()
    {
        *axis = glam::DVec3::new(m[i], m[4 + i], m[8 + i]);
    }
    Some(pose)
}

impl State {
    /// Refuses what no run of `frames` frames leaves: later code relies on it.
    fn check(&self, frames: usize) -> Result<(), SlamError> {
        self.config.validate()?;
        let camera = self.sequence.camera;
        if camera.width == 0 || camera.height == 0 || camera.pixels() > 1 << 28 {
            return Err(wrong("camera", format!("{camera:?}"), "an image size"));
        }
        let finite =
            |b: &Bounds| b.min.is_finite() && b.max.is_finite() && b.min.cmplt(b.max).all();
        if !finite(&self.bounds) || (self.bounds.max - self.bounds.min).max_element() > 1e3 {
            return Err(wrong("bounds", format!("{:?}", self.bounds), "a box below 1 km"));
        }
        if self.sequence.feature_channels > MAX_FEATURE_CHANNELS {
            let expected = format!("at most {MAX_FEATURE_CHANNELS}");
            return Err(wrong("feature_channels", self.sequence.feature_channels, expected));
        }
        let classes = self.sequence.classes.len();
        if classes > 255 {
            return Err(wrong("classes", classes, "at most 255"));
        }
        if ![0, classes].contains(&self.class_counts.len()) {
            return Err(wrong("class_counts", self.class_counts.len(), classes));
        }
        let frames_used =
            (self.keyframes.iter().map(|k| k.frame)).chain(self.observed_frames.iter().copied());
        if let Some(frame) = { frames_used }.find(|f| *f >= frames) {
            return Err(wrong("keyframes", format!("frame {frame}"), format!("below {frames}")));
        }
        if !self.keyframes.iter().all(|k| k.world_from_camera.is_finite()) {
            return Err(wrong("keyframes", "a pose that is not finite", "finite poses"));
        }
        // Every slot but that of views is a keyframe's or free.
        let mut slots: Vec<u32> = self.keyframes.iter().map(|k| k.slot).collect();
        slots.extend(&self.free_slots);
        slots.sort_unstable();
        if self.slots == 0 || !slots.iter().copied().eq(1..self.slots) {
            let expected = format!("each of 1 to {} once", self.slots.saturating_sub(1));
            return Err(wrong("slots", format!("{} of them", slots.len()), expected));
        }
        if self.used_slots > self.slots || self.keyframes.iter().any(|k| k.slot >= self.used_slots)
        {
            return Err(wrong("used_slots", self.used_slots, format!("up to {}", self.slots)));
        }
        let c = &self.counters;
        let counters =
            [c.step, c.fusion_step, self.iteration, self.mapping_calls, self.finished_iterations];
        if let Some(n) = counters.into_iter().find(|n| *n > 1 << 30) {
            return Err(wrong("counters", n, "at most 2^30"));
        }
        for (_, r) in &self.registrations {
            if !(r.scale > 0.1 && r.scale < 10.0) {
                return Err(wrong("registrations", r.scale, "scales from 0.1 to 10"));
            }
        }
        if !self.registrations.is_sorted_by(|a, b| a.0 < b.0) {
            return Err(wrong("registrations", "frames in disorder", "ascending frames"));
        }
        self.odometer
            .check(frames)
            .map_err(|found| wrong("odometer", found, "the state of an odometer"))
    }
}
