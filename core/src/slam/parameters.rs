//! How many numbers the semantics of a map take.
use super::{Slam, SlamError};
use crate::{
    layout::{CHANNELS, FEATURE},
    map::suppressor,
};
use serde::{Deserialize, Serialize};

/// Numbers that decide a pixel's class, by part; padding is not counted. All zero without classes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParameterCounts {
    /// Features of the semantic planes, both resolutions.
    pub semantic_planes: usize,
    /// Decoder of composited semantic features, 32-32-16.
    pub semantic_decoder: usize,
    /// Class head: on a ray's semantic feature, or the whole perceptron on samples.
    pub class_head: usize,
    /// Feature fusion (0 when off).
    pub fusion: usize,
    /// Vectors of all anchors that there may be (0 when off).
    pub anchors: usize,
    /// Anchors in use.
    pub anchors_in_use: usize,
}

impl ParameterCounts {
    /// All parts together.
    pub fn total(&self) -> usize {
        self.semantic_planes + self.semantic_decoder + self.class_head + self.fusion + self.anchors
    }
}

impl Slam {
    /// Sizes of the parts that make classes.
    ///
    /// # Errors
    /// [`SlamError::NoMap`] before the first frame, engine failures.
    pub async fn parameters(&mut self) -> Result<ParameterCounts, SlamError> {
        let (engine, map, _) = self.mapped()?;
        let classes = map.classes as usize;
        if classes == 0 {
            return Ok(ParameterCounts::default());
        }
        let in_use = suppressor::read_counts(engine, map).await?;
        let inputs = 2 * CHANNELS;
        if let Some(head) = &map.sample_head {
            return Ok(ParameterCounts {
                semantic_planes: map.semantic.floats,
                class_head: head.parameters.floats,
                ..ParameterCounts::default()
            });
        }
        Ok(ParameterCounts {
            semantic_planes: map.semantic.floats,
            semantic_decoder: inputs * inputs + inputs + inputs * FEATURE + FEATURE,
            class_head: classes * (FEATURE + 1),
            fusion: map.fusion.as_ref().map_or(0, |f| f.trained_count()),
            anchors: map.suppressor.as_ref().map_or(0, |s| s.slots() as usize * FEATURE),
            anchors_in_use: in_use.map_or(0, |c| c.alive as usize),
        })
    }
}
