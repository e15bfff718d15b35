//! Where frames come from.
use crate::host::Host;
use mte_slam_types::{
    frame::Frame,
    sequence::{Sequence, SequenceError},
};
use std::{convert::Infallible, future::Future};

/// Frames in order. Every [`Sequence`] is one; [`Live`] makes one of a closure.
pub trait Input {
    /// Why there is no frame.
    type Error;

    /// Waits for frame `index`, counted from 0; `None` after the last one. A run asks for one
    /// after the other. Only a run that is resumed asks first for some that came before, in
    /// ascending order.
    fn read_frame(
        &mut self,
        index: usize,
        host: &mut dyn Host,
    ) -> impl Future<Output = Result<Option<Frame>, Self::Error>>;
}

impl<S: Sequence + ?Sized> Input for S {
    type Error = SequenceError;

    async fn read_frame(
        &mut self,
        index: usize,
        _: &mut dyn Host,
    ) -> Result<Option<Frame>, SequenceError> {
        if index < self.info().frames { Sequence::frame(self, index).map(Some) } else { Ok(None) }
    }
}

/// Frames of a closure, such as a camera's: the next one, or `None` at the end. How many will come
/// need not be known: [`SequenceInfo::frames`] may be 0. What is past cannot be read again, so
/// such a run is resumed with another input, of frames that were kept.
///
/// [`SequenceInfo::frames`]: mte_slam_types::frame::SequenceInfo::frames
pub struct Live<F> {
    next: F,
}

impl<F: FnMut() -> Option<Frame>> Live<F> {
    /// Takes a frame per call of `next`; [`Frame::index`] is counted here. Its images must have the
    /// size of the camera that [`Run::new`](crate::Run::new) was given.
    pub fn new(next: F) -> Live<F> {
        Live { next }
    }
}

impl<F: FnMut() -> Option<Frame>> Input for Live<F> {
    type Error = Infallible;

    async fn read_frame(
        &mut self,
        index: usize,
        _: &mut dyn Host,
    ) -> Result<Option<Frame>, Infallible> {
        Ok((self.next)().map(|frame| Frame { index, ..frame }))
    }
}
