//! Which frames a run takes.
use super::{Slam, SlamError};
use crate::frame::Frame;
use alloc::{format, string::String, vec::Vec};

impl Slam {
    /// The hash of a frame that the run can take next.
    pub(super) fn admit(&self, frame: &Frame) -> Result<u64, SlamError> {
        self.check(frame)?;
        if self.only_shown {
            let found = "one that was restored to be shown".into();
            return Err(unfit(frame, "map", found, "a run, new or resumed".into()));
        }
        Ok(frame.content_hash())
    }

    /// Refuses a frame whose images do not fit the sequence.
    pub(super) fn check(&self, frame: &Frame) -> Result<(), SlamError> {
        let pixels = self.info.camera.pixels();
        let found = [
            ("colour image", frame.color.len()),
            ("depth image", frame.depth.len()),
            ("label image", frame.labels.as_ref().map_or(pixels, Vec::len)),
        ];
        for (field, n) in found {
            if n != pixels {
                let expected = format!("{pixels} pixels");
                return Err(unfit(frame, field, format!("{n} pixels"), expected));
            }
        }
        let channels = frame.features.as_ref().map_or(0, |f| f.channels);
        if channels != self.info.feature_channels {
            let expected = format!("{} channels", self.info.feature_channels);
            return Err(unfit(frame, "feature map", format!("{channels} channels"), expected));
        }
        if let Some(f) = &frame.features
            && (f.values.len() != f.channels * f.height * f.width || f.values.is_empty())
        {
            let expected = format!("{} x {} x {}", f.channels, f.height, f.width);
            return Err(unfit(
                frame,
                "feature map",
                format!("{} values", f.values.len()),
                expected,
            ));
        }
        if frame.truth.is_some_and(|p| !p.is_finite()) {
            let found = "a number that is not finite".into();
            return Err(unfit(frame, "true pose", found, "finite numbers, or no pose".into()));
        }
        Ok(())
    }
}

fn unfit(frame: &Frame, field: &'static str, found: String, expected: String) -> SlamError {
    SlamError::Frame { frame: frame.index, field, found, expected }
}
