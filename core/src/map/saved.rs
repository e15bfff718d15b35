//! The state of a map as checkpoints keep it: the buffers that a pass reads before anything writes
//! them, and the counters beside them.
use super::{parameters::ParameterTensor, state::Map};
use crate::{
    commands::BufferId,
    kernels::pose_step::POSE_STATE_FLOATS,
    layout::{ANCHOR_FLOATS, CHANNELS},
};
use alloc::{format, string::String, vec, vec::Vec};
use serde::{Deserialize, Serialize};

/// A buffer, or as much of its beginning as is state.
#[derive(Clone, Debug)]
pub(crate) struct StateBuffer {
    /// Dotted name.
    pub name: String,
    pub buffer: BufferId,
    /// Rows and columns; 4 bytes each.
    pub shape: [usize; 2],
    /// Floats, or words of any meaning.
    pub floats: bool,
    /// Parameters: every number must be finite.
    pub finite: bool,
}

impl StateBuffer {
    /// Number of 4-byte words.
    pub fn words(&self) -> usize {
        self.shape[0] * self.shape[1]
    }
}

/// Numbers that the host keeps beside the buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Counters {
    /// Steps of Adam.
    pub step: u32,
    /// Steps of the fusion.
    pub fusion_step: u32,
    /// Bits of the origin of the fusion's encoded positions: that of the first, smaller map.
    pub fusion_origin: [u32; 4],
}

impl Map {
    /// The buffers that are state. Slots from `used_slots` on have never held a frame.
    pub(crate) fn state_buffers(&self, used_slots: u32) -> Vec<StateBuffer> {
        let mut all = Vec::new();
        let mut parameters = |name: &str, t: &ParameterTensor, columns: usize| {
            for (part, buffer) in [
                ("values", t.values.id()),
                ("moment1", t.moment1.id()),
                ("moment2", t.moment2.id()),
            ] {
                all.push(StateBuffer {
                    name: format!("{name}.{part}"),
                    buffer,
                    shape: [t.floats / columns, columns],
                    floats: true,
                    finite: true,
                });
            }
        };
        parameters("planes.geometry", &self.geometry, CHANNELS);
        parameters("planes.appearance", &self.appearance, CHANNELS);
        parameters("planes.semantic", &self.semantic, CHANNELS);
        parameters("decoders", &self.decoders, 1);
        if let Some(f) = &self.fusion {
            parameters("fusion", &f.parameters, 1);
        }
        if let Some(h) = &self.sample_head {
            parameters("sample_head", &h.parameters, 1);
        }
        let slots = used_slots.min(self.slots()) as usize;
        let classes = self.classes as usize;
        let mut others = vec![
            ("status", self.status.id(), [1, 4], false),
            ("class_weights", self.class_weights.id(), [classes, 2], true),
            ("class_rarity", self.class_rarity.id(), [1, classes], true),
            ("token_class_weights", self.token_class_weights.id(), [1, classes], true),
            ("slots.pose_state", self.frames.pose_state.id(), [slots, POSE_STATE_FLOATS], true),
        ];
        if let Some(f) = &self.fusion {
            others.push((
                "slots.targets",
                self.frames.targets.id(),
                [slots, f.grid.target_floats()],
                true,
            ));
        }
        if let Some(s) = &self.suppressor {
            let n = s.slots() as usize;
            others.push(("anchors", s.anchors.id(), [n, ANCHOR_FLOATS], false));
            others.push(("anchors.votes", s.votes.id(), [n, classes], true));
            others.push(("anchors.counts", s.counts.id(), [1, 4], false));
            others.push(("anchors.support", s.support.id(), [classes, 2], false));
        }
        all.extend(others.into_iter().map(|(name, buffer, shape, floats)| StateBuffer {
            name: name.into(),
            buffer,
            shape,
            floats,
            finite: false,
        }));
        all
    }

    /// The counters.
    pub(crate) fn counters(&self) -> Counters {
        let (fusion_step, origin) = self.fusion.as_ref().map_or((0, [0.0; 4]), |f| f.progress());
        Counters { step: self.step, fusion_step, fusion_origin: origin.map(f32::to_bits) }
    }

    /// Sets the counters.
    pub(crate) fn set_counters(&mut self, c: &Counters) {
        self.step = c.step;
        if let Some(f) = &mut self.fusion {
            f.set_progress(c.fusion_step, c.fusion_origin.map(f32::from_bits));
        }
    }
}
