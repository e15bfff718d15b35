//! Several named files in one input: four bytes of options, then for each file the length of its
//! name (u8), the name, its length (u32, little endian) and its bytes. Every input can be read so.
use mte_slam_dataset::MemorySource;

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    pub name: Vec<u8>,
    pub bytes: Vec<u8>,
}

/// The parts of an input.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bundle {
    pub options: [u8; 4],
    pub files: Vec<File>,
}

/// The next `n` bytes, or what is left.
fn take<'a>(data: &mut &'a [u8], n: usize) -> &'a [u8] {
    let (taken, rest) = data.split_at(n.min(data.len()));
    *data = rest;
    taken
}

impl Bundle {
    pub fn parse(mut data: &[u8]) -> Bundle {
        let mut bundle = Bundle::default();
        for (to, from) in bundle.options.iter_mut().zip(take(&mut data, 4)) {
            *to = *from;
        }
        while let Some((&n, rest)) = data.split_first() {
            data = rest;
            let name = take(&mut data, n.into()).to_vec();
            let mut length = [0; 4];
            let found = take(&mut data, 4);
            length[..found.len()].copy_from_slice(found);
            let bytes = take(&mut data, u32::from_le_bytes(length) as usize).to_vec();
            bundle.files.push(File { name, bytes });
        }
        bundle
    }

    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = self.options.to_vec();
        for file in &self.files {
            out.push(file.name.len() as u8);
            out.extend(&file.name);
            out.extend((file.bytes.len() as u32).to_le_bytes());
            out.extend(&file.bytes);
        }
        out
    }

    pub fn of(source: &MemorySource, options: [u8; 4]) -> Bundle {
        let file = |name: &str| File {
            name: name.into(),
            bytes: source.get(name).unwrap_or_default().to_vec(),
        };
        Bundle { options, files: source.names().map(file).collect() }
    }

    /// The files that have a name in UTF-8.
    pub fn source(&self) -> MemorySource {
        let mut source = MemorySource::new("recording");
        for file in &self.files {
            if let Ok(name) = std::str::from_utf8(&file.name) {
                source.insert(name, file.bytes.clone());
            }
        }
        source
    }
}

/// Room that a mutation may add to a file \[bytes\].
const ROOM: usize = 64;

/// Changes one part of an input by `mutate_bytes` (buffer, length in use -> new length), which is
/// libFuzzer's. Changes of the raw input would mostly shift the files into each other.
pub fn mutate(
    data: &mut [u8],
    size: usize,
    max_size: usize,
    seed: u32,
    mutate_bytes: impl Fn(&mut [u8], usize) -> usize,
) -> usize {
    let mut bundle = Bundle::parse(&data[..size]);
    let mut state = u64::from(seed) << 1 | 1;
    let mut below = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n.max(1)
    };
    let n = bundle.files.len();
    if n == 0 || below(64) == 0 {
        return mutate_bytes(&mut data[..max_size], size);
    }
    let (which, other) = (below(n), below(n));
    match below(32) {
        0 => {
            let mut options = bundle.options;
            mutate_bytes(&mut options, 4);
            bundle.options = options;
        }
        1 => {
            let name = &mut bundle.files[which].name;
            let mut room = [name.as_slice(), &[0; 8]].concat();
            let length = mutate_bytes(&mut room, name.len()).min(255);
            room.truncate(length);
            *name = room;
        }
        2 => drop(bundle.files.remove(which)),
        // The file under another name, or another file under this name.
        3 => {
            let mut copy = bundle.files[which].clone();
            copy.name.push(b'0');
            copy.name.truncate(255);
            bundle.files.push(copy);
        }
        4 => bundle.files[which].bytes = bundle.files[other].bytes.clone(),
        _ => {
            let bytes = &mut bundle.files[which].bytes;
            let length = bytes.len();
            bytes.resize(length + ROOM, 0);
            let length = mutate_bytes(bytes, length);
            bytes.truncate(length);
        }
    }
    let out = bundle.to_bytes();
    let length = out.len().min(max_size);
    data[..length].copy_from_slice(&out[..length]);
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_input_is_a_bundle_and_bundles_come_back() {
        let file = |name: &str, n: u8| File { name: name.into(), bytes: (0..n).collect() };
        let bundle = Bundle { options: [1, 2, 3, 4], files: vec![file("a/b", 9), file("", 0)] };
        let bytes = bundle.to_bytes();
        assert_eq!(Bundle::parse(&bytes), bundle);
        for cut in 0..bytes.len() {
            let _ = Bundle::parse(&bytes[..cut]);
        }
        let mut data = bytes.clone();
        data.resize(4096, 0);
        let mut size = bytes.len();
        for seed in 0..2000 {
            size = mutate(&mut data, size, 4096, seed, |bytes, n| {
                bytes[n.min(bytes.len() - 1)] ^= seed as u8;
                n.max(1)
            });
            assert!(size <= 4096);
        }
    }
}
