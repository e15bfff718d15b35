//! Frames as bytes ([`stream`]), one after the other, decoded only when somebody reads on: that is the
//! back-pressure.
use mte_slam_dataset::stream;
use mte_slam_types::sequence::Sequence;
use std::io::{self, Read};

/// Reads a sequence as bytes.
pub struct FrameReader {
    sequence: Box<dyn Sequence>,
    next: usize,
    frames: usize,
    /// The frame that is being sent.
    bytes: Vec<u8>,
    sent: usize,
}

impl FrameReader {
    /// Frames from `from` on.
    pub fn new(sequence: Box<dyn Sequence>, from: usize) -> Self {
        let frames = sequence.info().frames;
        Self { sequence, next: from, frames, bytes: Vec::new(), sent: 0 }
    }
}

impl Read for FrameReader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.sent == self.bytes.len() {
            if self.next >= self.frames {
                return Ok(0);
            }
            self.bytes.clear();
            self.sent = 0;
            match self.sequence.frame(self.next) {
                Ok(frame) => {
                    stream::write_frame(&frame, &mut self.bytes);
                    self.next += 1;
                }
                Err(e) => {
                    stream::write_failure(e.to_string(), &mut self.bytes);
                    self.next = self.frames;
                }
            }
        }
        let n = out.len().min(self.bytes.len() - self.sent);
        out[..n].copy_from_slice(&self.bytes[self.sent..self.sent + n]);
        self.sent += n;
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
    use mte_slam_types::{
        frame::{Frame, SequenceInfo},
        pose::Pose,
        sequence::SequenceError,
    };
    use std::{cell::Cell, rc::Rc};

    /// Counts the frames that were asked for, and fails from one on.
    struct Counting {
        inner: SyntheticSequence,
        asked: Rc<Cell<usize>>,
        bad_from: usize,
    }

    impl Sequence for Counting {
        fn info(&self) -> &SequenceInfo {
            self.inner.info()
        }
        fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
            self.asked.set(self.asked.get() + 1);
            let index = if index < self.bad_from { index } else { usize::MAX };
            self.inner.frame(index)
        }
        fn truth(&self, index: usize) -> Option<Pose> {
            self.inner.truth(index)
        }
        fn time_s(&self, index: usize) -> f64 {
            self.inner.time_s(index)
        }
    }

    fn reader(bad_from: usize) -> (FrameReader, Rc<Cell<usize>>) {
        let options = SyntheticOptions { frames: 5, ..SyntheticOptions::tiny() };
        let asked = Rc::new(Cell::new(0));
        let inner = SyntheticSequence::new(options);
        let sequence = Counting { inner, asked: asked.clone(), bad_from };
        (FrameReader::new(Box::new(sequence), 2), asked)
    }

    fn header(bytes: &[u8]) -> (serde_json::Value, usize) {
        let n = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        (serde_json::from_slice(&bytes[4..4 + n]).unwrap(), 4 + n)
    }

    #[test]
    fn frames_are_decoded_only_as_they_are_read() {
        let (mut reader, asked) = reader(usize::MAX);
        let mut some = [0; 1000];
        reader.read_exact(&mut some).unwrap();
        assert_eq!(asked.get(), 1);
        let (head, at) = header(&some);
        assert_eq!((head["index"].as_u64(), head["labels"].as_bool()), (Some(2), Some(true)));
        let pixels = 80 * 60;
        let mut rest = vec![0; at + 6 * pixels - 1000];
        reader.read_exact(&mut rest).unwrap();
        assert_eq!(asked.get(), 1, "the next frame is not decoded ahead");
        let mut others = Vec::new();
        reader.read_to_end(&mut others).unwrap();
        assert_eq!(asked.get(), 3);
        assert_eq!(header(&others).0["index"].as_u64(), Some(3));
    }

    #[test]
    fn a_frame_that_cannot_be_read_ends_the_stream_with_the_reason() {
        let (mut reader, _) = reader(3);
        let mut all = Vec::new();
        reader.read_to_end(&mut all).unwrap();
        let (_, at) = header(&all);
        let (last, n) = header(&all[at + 6 * 80 * 60..]);
        assert!(last["error"].as_str().unwrap().contains("frame"), "{last}");
        assert_eq!(at + 6 * 80 * 60 + n, all.len());
    }
}
