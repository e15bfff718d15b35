//! A run from its checkpoint: to be shown, or to be continued.
use super::{
    MapKeyframe, Slam, SlamError,
    checkpoint::{Checkpoint, Dtype, Saved, SequenceState, wrong},
    class_counts::ClassCounts,
};
use crate::{
    commands::Commands,
    config::Config,
    engine::Engine,
    field::FieldShape,
    frame::{Frame, SequenceInfo},
    map::{FrameFormat, Map, Scratch, color_words},
    track::odometry::{ColorRegistration, Rebuild, since},
};
use alloc::{collections::BTreeSet, format, string::String, vec::Vec};
use serde::Serialize;
use serde_json::Value;

impl Slam {
    /// A system that can render, mesh and be evaluated as the one the checkpoint was made of. It
    /// takes no more frames: [`Slam::resume`] makes one that does.
    ///
    /// # Errors
    /// [`SlamError::Checkpoint`] names what does not fit; engine failures.
    pub async fn restore(engine: Engine, checkpoint: &Checkpoint) -> Result<Slam, SlamError> {
        let saved = checkpoint.saved()?;
        let (config, info) = (saved.state.config.clone(), saved.state.sequence.clone().into_info());
        let mut slam = build(engine, config, &info, checkpoint, &saved)?;
        take_frames(&mut slam, saved);
        slam.only_shown = true;
        Ok(slam)
    }

    /// Continues from a checkpoint, on a new engine: give [`Resuming::add`] the frames that
    /// [`Resuming::missing`] names, then process frame [`Slam::next_frame`]. On an engine like the
    /// first one the run ends with the same bytes as if it had never been interrupted.
    ///
    /// # Errors
    /// [`SlamError::Checkpoint`] names what does not fit: another format, configuration or
    /// sequence, numbers that cannot be; engine failures.
    pub async fn resume(
        engine: Engine,
        config: Config,
        info: &SequenceInfo,
        checkpoint: &Checkpoint,
    ) -> Result<Resuming, SlamError> {
        let saved = checkpoint.saved()?;
        same("configuration", &saved.state.config, &config)?;
        // Its name is for people only.
        let named = SequenceState::of(&SequenceInfo {
            name: saved.state.sequence.name().into(),
            ..info.clone()
        });
        same("sequence", &saved.state.sequence, &named)?;
        let slam = build(engine, config, info, checkpoint, &saved)?;
        let pose_state = slam.saved_words(checkpoint, "slots.pose_state")?;
        let odometer = Rebuild::new(slam.config.odometry.clone(), saved.state.odometer.clone());
        let mut missing: BTreeSet<usize> = slam.keyframes.iter().map(|k| k.frame).collect();
        missing.extend(saved.state.odometer.frames());
        Ok(Resuming { slam, saved, odometer, missing, pose_state })
    }

    /// Index of the frame that comes next.
    pub fn next_frame(&self) -> usize {
        self.frames.len()
    }

    fn saved_words(&self, checkpoint: &Checkpoint, name: &str) -> Result<Vec<u32>, SlamError> {
        let Some(map) = &self.map else { return Ok(Vec::new()) };
        let buffers = map.state_buffers(self.used_slots);
        let Some(b) = buffers.iter().find(|b| b.name == name) else { return Ok(Vec::new()) };
        checkpoint.values(name, if b.floats { Dtype::F32 } else { Dtype::U32 }, b.words())
    }
}

/// A run on its way back; see [`Slam::resume`].
pub struct Resuming {
    slam: Slam,
    saved: Saved,
    odometer: Rebuild,
    missing: BTreeSet<usize>,
    pose_state: Vec<u32>,
}

impl Resuming {
    /// Frames that are still needed (keyframes, and the last frame that was located), ascending.
    pub fn missing(&self) -> impl Iterator<Item = usize> + '_ {
        self.missing.iter().copied()
    }

    /// Takes a frame that is missing. The frame must be the one of the first time, bit for bit.
    ///
    /// # Errors
    /// [`SlamError::Checkpoint`] for another frame; engine failures.
    pub fn add(&mut self, frame: &Frame) -> Result<(), SlamError> {
        let Resuming { slam, saved, odometer, missing, .. } = self;
        slam.check(frame)?;
        if !missing.contains(&frame.index) {
            let next = missing.first().map_or("no more frames".into(), |f| format!("frame {f}"));
            return Err(wrong("frames", format!("frame {}", frame.index), next));
        }
        let hash = frame.content_hash();
        if saved.hashes.get(frame.index) != Some(&hash) {
            return Err(wrong(
                format!("data: frame {}", frame.index),
                "other images, labels, pose or time than the run was made with",
                "the same recording, read in the same way",
            ));
        }
        let (camera, unit) = (slam.info.camera, slam.info.depth_unit_m);
        let registrations = &saved.state.registrations;
        odometer.add(frame, &camera, unit, registrations)?;
        let slots: Vec<u32> =
            slam.keyframes.iter().filter(|k| k.frame == frame.index).map(|k| k.slot).collect();
        if let (Some(map), false) = (&slam.map, slots.is_empty()) {
            // As it was stored first, and then resampled with each change.
            let (first, later) = since(registrations, frame.index, true);
            let stored = first.registered(frame, &camera);
            let mut colors = None;
            let mut before = first;
            for (_, found) in later {
                let image = colors.unwrap_or_else(|| color_words(&stored));
                let change = ColorRegistration { scale: found.scale / before.scale };
                colors = Some(change.resampled(&image, &camera));
                before = *found;
            }
            let mut r = Commands::default();
            for slot in slots {
                map.frames.upload_frame(&mut r, slot, &stored);
                if let Some(image) = &colors {
                    map.frames.upload_color(&mut r, slot, image);
                }
            }
            slam.engine.submit(&r)?;
        }
        missing.remove(&frame.index);
        Ok(())
    }

    /// The run, as it was.
    ///
    /// # Errors
    /// [`SlamError::Checkpoint`] while frames are missing; engine failures.
    pub fn finish(self) -> Result<Slam, SlamError> {
        let Resuming { mut slam, saved, odometer, missing, pose_state } = self;
        if let Some(frame) = missing.first() {
            return Err(wrong("frames", format!("frame {frame} is missing"), "all that are named"));
        }
        // Storing images has cleared it.
        if let Some(map) = &slam.map {
            let buffers = map.state_buffers(slam.used_slots);
            if let Some(b) = buffers.iter().find(|b| b.name == "slots.pose_state") {
                let mut r = Commands::default();
                r.upload(b.buffer, 0, &pose_state);
                slam.engine.submit(&r)?;
            }
        }
        let state = &saved.state;
        let registration = state.registrations.last().map_or_else(Default::default, |r| r.1);
        let Some(odometer) = odometer.finish(registration) else {
            return Err(wrong("odometer", "frames that are missing", "all that are named"));
        };
        slam.odometer = odometer;
        take_frames(&mut slam, saved);
        Ok(slam)
    }
}

/// The system with its map, without frames and odometer.
fn build(
    mut engine: Engine,
    config: Config,
    info: &SequenceInfo,
    checkpoint: &Checkpoint,
    saved: &Saved,
) -> Result<Slam, SlamError> {
    let state = &saved.state;
    let max = engine.max_buffer_words();
    let shape = FieldShape::restored(state.bounds, &config.field, max).ok_or_else(|| {
        wrong("bounds", format!("{:?}", state.bounds), "a map that the engine can hold")
    })?;
    let mut map = Map::new(&mut engine, &config, &FrameFormat::from(info), shape)?;
    let scratch = Scratch::new(&mut engine, &config, &map)?;
    if map.slots() != state.slots {
        return Err(wrong("slots", state.slots, format!("{}, as this engine has", map.slots())));
    }
    map.set_counters(&state.counters);
    for b in map.state_buffers(state.used_slots) {
        let dtype = if b.floats { Dtype::F32 } else { Dtype::U32 };
        let words: Vec<u32> = checkpoint.values(&b.name, dtype, b.words())?;
        if b.finite && words.iter().any(|w| !f32::from_bits(*w).is_finite()) {
            return Err(wrong(b.name, "a value that is not finite", "finite values"));
        }
        let mut r = Commands::default();
        r.upload(b.buffer, 0, &words);
        engine.submit(&r)?;
    }
    let mut slam = Slam::on_engine(engine, config, info)?;
    (slam.map, slam.scratch) = (Some(map), Some(scratch));
    slam.iteration = state.iteration;
    slam.mapping_calls = state.mapping_calls;
    slam.finished_iterations = state.finished_iterations;
    slam.bounds_refused = state.bounds_refused;
    slam.class_counts = ClassCounts(state.class_counts.clone());
    slam.free_slots.clone_from(&state.free_slots);
    slam.used_slots = state.used_slots;
    slam.anchor_history.clone_from(&state.anchor_history);
    slam.registrations.clone_from(&state.registrations);
    slam.registration = state.registrations.last().map_or_else(Default::default, |r| r.1);
    slam.keyframes = state
        .keyframes
        .iter()
        .map(|k| MapKeyframe {
            frame: k.frame,
            slot: k.slot,
            world_from_camera: k.world_from_camera,
        })
        .collect();
    Ok(slam)
}

fn take_frames(slam: &mut Slam, saved: Saved) {
    slam.frames = saved.frames;
    slam.hashes = saved.hashes;
    slam.observations = saved.observations;
}

/// Refuses a value that differs from the saved one, naming the first part that does.
fn same<T: Serialize>(what: &str, saved: &T, now: &T) -> Result<(), SlamError> {
    let value = |t: &T| serde_json::to_value(t).map_err(|e| wrong(what, e, "JSON"));
    match first_difference(what.into(), &value(saved)?, &value(now)?) {
        None => Ok(()),
        // From the point of view of who resumes: what the run has is expected, what is asked for is found.
        Some((field, saved, now)) => {
            Err(wrong(field, now, format!("{saved}, as the run was made")))
        }
    }
}

fn first_difference(path: String, a: &Value, b: &Value) -> Option<(String, String, String)> {
    if let (Value::Object(x), Value::Object(y)) = (a, b) {
        return x.keys().chain(y.keys()).find_map(|key| {
            let part = |m: &serde_json::Map<String, Value>| m.get(key).cloned().unwrap_or_default();
            first_difference(format!("{path}.{key}"), &part(x), &part(y))
        });
    }
    let shown = |v: &Value| {
        let text = format!("{v}");
        if text.chars().count() > 80 {
            text.chars().take(77).chain("...".chars()).collect()
        } else {
            text
        }
    };
    (a != b).then(|| (path, shown(a), shown(b)))
}
