//! Every reader of recordings: the input is a list of edits of a good recording's files, so that
//! the fuzzer need not find the formats first.
//!
//!     cargo +nightly fuzz run recordings        # or, without nightly: cargo fuzz run -s none recordings
#![no_main]

#[path = "../../core/tests/recordings/mod.rs"]
mod recordings;

use libfuzzer_sys::fuzz_target;
use mte_slam_core::{
    dataset::{Layout, MemorySource, OpenOptions, ZipSource, open},
    sequence::Source,
};
use recordings::{archive, recording};
use std::{io::Cursor, sync::OnceLock};

const METHODS: [zip::CompressionMethod; 2] =
    [zip::CompressionMethod::Stored, zip::CompressionMethod::Deflated];

struct Good {
    folders: Vec<MemorySource>,
    archives: Vec<Vec<u8>>,
}

fn good() -> &'static Good {
    static GOOD: OnceLock<Good> = OnceLock::new();
    GOOD.get_or_init(|| {
        let folders: Vec<MemorySource> = Layout::ALL.into_iter().map(recording).collect();
        let packed = [Layout::Sens, Layout::ScanNet].map(recording);
        let archives =
            packed.iter().flat_map(|f| METHODS.map(|method| archive(f, method))).collect();
        Good { folders, archives }
    })
}

/// Eight bytes: what, where (3 bytes), and four bytes to put there.
fn edit(bytes: &mut Vec<u8>, edit: &[u8; 8]) {
    let [what, a, b, c, value @ ..] = *edit;
    let at = u32::from_le_bytes([a, b, c, 0]) as usize % (bytes.len() + 1);
    match what % 6 {
        0 => bytes.truncate(at),
        1 => drop(bytes.splice(at..at, value)),
        2 => bytes.iter_mut().skip(at).take(4).zip(value).for_each(|(b, v)| *b = v),
        3 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b = value[0]),
        4 => {
            let part = bytes[at..bytes.len().min(at + usize::from(value[0]))].to_vec();
            let to = u16::from_le_bytes([value[1], value[2]]) as usize % (bytes.len() + 1);
            bytes.splice(to..to, part);
        }
        _ => drop(bytes.drain(at..bytes.len().min(at + usize::from(value[0])))),
    }
}

fuzz_target!(|data: &[u8]| {
    let Some((&which, rest)) = data.split_first() else { return };
    let good = good();
    let which = usize::from(which) % (good.folders.len() + good.archives.len());
    let edits = rest.chunks_exact(9);
    let source: Box<dyn Source> = match good.folders.get(which) {
        Some(folder) => {
            let mut folder = folder.clone();
            let names: Vec<String> = folder.names().map(String::from).collect();
            for one in edits {
                let name = &names[usize::from(one[0]) % names.len()];
                let mut bytes = folder.remove(name).unwrap_or_default();
                edit(&mut bytes, one[1..].try_into().unwrap_or(&[0; 8]));
                folder.insert(name.clone(), bytes);
            }
            Box::new(folder)
        }
        None => {
            let mut bytes = good.archives[which - good.folders.len()].clone();
            for one in edits {
                edit(&mut bytes, one[1..].try_into().unwrap_or(&[0; 8]));
            }
            match ZipSource::new("room.zip", Cursor::new(bytes), 1 << 26) {
                Ok(source) => Box::new(source),
                Err(_) => return,
            }
        }
    };
    if let Ok(mut sequence) = open(source, OpenOptions::default()) {
        for index in 0..sequence.info().frames.min(4) {
            let _ = sequence.frame(index);
        }
    }
});
