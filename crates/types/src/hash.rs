//! A quick hash of numbers and images: it shows whether two things are the same, not whether
//! somebody made them look so.
use crate::frame::Frame;

const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0100_0000_01b3;

/// FNV-1a over words of 8 bytes. Each step is a bijection of the state, so that no change within
/// one word goes unnoticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hasher(u64);

impl Default for Hasher {
    fn default() -> Self {
        Hasher(OFFSET)
    }
}

impl Hasher {
    /// Takes a word.
    pub fn word(&mut self, word: u64) {
        // The rotation carries what the multiplication moves up back down.
        self.0 = (self.0 ^ word).wrapping_mul(PRIME).rotate_left(23);
    }

    /// Takes bytes and their number.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.word(bytes.len() as u64);
        let (words, rest) = bytes.as_chunks::<8>();
        words.iter().for_each(|w| self.word(u64::from_le_bytes(*w)));
        if !rest.is_empty() {
            self.word(rest.iter().rev().fold(0, |w, b| w << 8 | u64::from(*b)));
        }
    }

    /// Returns the hash of all that was taken.
    pub fn finish(self) -> u64 {
        self.0
    }
}

impl Frame {
    /// A hash of all that is known of the frame: numbers, images, labels, true pose.
    pub fn content_hash(&self) -> u64 {
        let mut h = Hasher::default();
        h.word(self.index as u64);
        h.word(self.number);
        h.word(self.time_s.to_bits());
        h.bytes(bytemuck::cast_slice(&self.color));
        h.bytes(bytemuck::cast_slice(&self.depth));
        h.word(u64::from(self.labels.is_some()));
        h.bytes(self.labels.as_deref().unwrap_or_default());
        if let Some(map) = &self.features {
            [map.channels, map.height, map.width].into_iter().for_each(|n| h.word(n as u64));
            h.bytes(bytemuck::cast_slice(&map.values));
        }
        for x in self.truth.iter().flat_map(|p| p.to_row_major()) {
            h.word(x.to_bits());
        }
        h.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::{vec, vec::Vec};

    fn of(bytes: &[u8]) -> u64 {
        let mut h = Hasher::default();
        h.bytes(bytes);
        h.finish()
    }

    #[test]
    fn every_bit_and_the_length_count() {
        let bytes: Vec<u8> = (0..29).collect();
        let whole = of(&bytes);
        assert_eq!(whole, of(&bytes));
        for bit in 0..8 * bytes.len() {
            let mut other = bytes.clone();
            other[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(of(&other), whole, "bit {bit}");
        }
        let mut longer = bytes;
        longer.push(0);
        assert_ne!(of(&longer), whole);
        assert_ne!(of(&[]), of(&[0]));
        let frame = |labels| Frame {
            index: 0,
            number: 0,
            time_s: 0.0,
            color: vec![[1, 2, 3]],
            depth: vec![7],
            labels,
            truth: None,
            features: None,
        };
        assert_ne!(frame(None).content_hash(), frame(Some(Vec::new())).content_hash());
    }
}
