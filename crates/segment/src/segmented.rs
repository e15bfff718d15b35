//! A recording whose labels a network makes.
use crate::{
    error::SegmentError,
    segmenter::{Segmentation, Segmenter},
};
use mte_slam_types::{
    frame::{Frame, SequenceInfo},
    pose::Pose,
    sequence::{Sequence, SequenceError},
};

/// A sequence with the labels, and features if there are any, of a [`Segmenter`] in place of its own.
pub struct Segmented<S> {
    inner: S,
    info: SequenceInfo,
    segmenter: Segmenter,
    every: usize,
    /// The last result, and its frame.
    last: Option<(usize, Segmentation)>,
}

impl<S: Sequence> Segmented<S> {
    /// Labels every `every`-th frame of `inner`; the others have no labels, unless they are asked for by
    /// [`Sequence::labels`].
    pub fn new(inner: S, segmenter: Segmenter, every: usize) -> Segmented<S> {
        let mut info =
            SequenceInfo { classes: segmenter.classes().clone(), ..inner.info().clone() };
        if info.feature_channels == 0 {
            info.feature_channels = segmenter.feature_channels();
        }
        Segmented { inner, info, segmenter, every: every.max(1), last: None }
    }

    /// The network.
    pub fn segmenter(&self) -> &Segmenter {
        &self.segmenter
    }

    /// What the network says of frame `index`, whose image `color` gives when the network must be asked.
    fn segment(
        &mut self,
        index: usize,
        color: impl FnOnce(&mut S) -> Result<Vec<[u8; 3]>, SequenceError>,
    ) -> Result<&Segmentation, SequenceError> {
        let last = match self.last.take() {
            Some(last) if last.0 == index => last,
            _ => {
                let color = color(&mut self.inner)?;
                let (w, h) = (self.info.camera.width as usize, self.info.camera.height as usize);
                let found = self.segmenter.segment(&color, w, h).map_err(|e| of_frame(e, index))?;
                (index, found)
            }
        };
        Ok(&self.last.insert(last).1)
    }

    /// What the network says of frame `index`.
    ///
    /// # Errors
    /// A frame that cannot be read, or on which the network fails.
    pub fn segmentation(&mut self, index: usize) -> Result<&Segmentation, SequenceError> {
        self.segment(index, |inner| Ok(inner.frame(index)?.color))
    }
}

/// The network's failure on a frame.
fn of_frame(error: SegmentError, index: usize) -> SequenceError {
    SequenceError::Invalid {
        file: "segmentation network".into(),
        frame: Some(index as u64),
        field: "labels".into(),
        found: error.to_string(),
        expected: "classes of the image".into(),
    }
}

impl<S: Sequence> Sequence for Segmented<S> {
    fn info(&self) -> &SequenceInfo {
        &self.info
    }

    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
        let mut frame = self.inner.frame(index)?;
        frame.labels = None;
        if index.is_multiple_of(self.every) {
            let found = self.segment(index, |_| Ok(frame.color.clone()))?;
            frame.labels = Some(found.labels.clone());
            frame.features = frame.features.or_else(|| found.features.clone());
        }
        Ok(frame)
    }

    fn labels(&mut self, index: usize) -> Result<Option<Vec<u8>>, SequenceError> {
        self.segmentation(index).map(|found| Some(found.labels.clone()))
    }

    fn truth(&self, index: usize) -> Option<Pose> {
        self.inner.truth(index)
    }

    fn view_from(&mut self, index: usize, world_from_camera: &Pose) -> Option<Frame> {
        // Its labels would be the recording's.
        let frame = self.inner.view_from(index, world_from_camera)?;
        Some(Frame { labels: None, ..frame })
    }

    fn prior(&self, index: usize) -> Option<Pose> {
        self.inner.prior(index)
    }

    fn time_s(&self, index: usize) -> f64 {
        self.inner.time_s(index)
    }

    fn number(&self, index: usize) -> u64 {
        self.inner.number(index)
    }

    fn warnings(&self) -> Vec<String> {
        let mut all = self.inner.warnings();
        all.extend(self.segmenter.warnings().iter().cloned());
        all
    }
}
