//! Damaged recordings of every layout, thousands of them: each is read or refused, never a panic,
//! and memory stays bounded. The damage is random but the same each time;
//! `MTE_SLAM_DAMAGE_CASES=100000` tries that many a layout.
mod recordings;

use mte_slam_dataset::{LabelSource, Layout, OpenOptions, ZipSource, open};
use mte_slam_types::sequence::Source;
use recordings::{archive, recording};
use std::io::Cursor;

const CASES: usize = 500;
/// A picture may have 64 million pixels: colour, its copy, and depth \[bytes\].
#[cfg(target_os = "linux")]
const MAX_PEAK_BYTES: u64 = 1 << 30;

/// A small generator, so that the same damage is done each time.
struct Pcg(u64);

impl Pcg {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % n.max(1)
    }

    fn damage(&mut self, bytes: &mut Vec<u8>) {
        let at = self.below(bytes.len());
        match self.below(8) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at, self.below(256) as u8),
            2 => bytes.extend_from_slice(b"-9e999 \xfe {"),
            // Lengths, sizes and counts become huge, or nothing.
            3 | 4 => {
                let value = [0xff, 0x7f, 0x00, b'9'][self.below(4)];
                let n = [1, 2, 4, 8][self.below(4)];
                bytes.iter_mut().skip(at).take(n).for_each(|b| *b = value);
            }
            5 => {
                let part = bytes[at..bytes.len().min(at + 64)].to_vec();
                let to = self.below(bytes.len());
                bytes.splice(to..to, part);
            }
            _ => {
                for _ in 0..=self.below(4) {
                    let at = self.below(bytes.len());
                    if let Some(b) = bytes.get_mut(at) {
                        *b ^= 1 << self.below(8);
                    }
                }
            }
        }
    }
}

fn cases() -> usize {
    std::env::var("MTE_SLAM_DAMAGE_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(CASES)
}

/// Opens and reads everything; whether that worked.
fn read(source: Box<dyn Source>, scale: f64, labels: LabelSource) -> bool {
    let options = OpenOptions { scale, labels, ..Default::default() };
    open(source, options)
        .and_then(|mut s| (0..s.info().frames.min(8)).try_for_each(|i| s.frame(i).map(drop)))
        .is_ok()
}

#[test]
fn damaged_files_of_every_layout() {
    let mut rng = Pcg(2024);
    for layout in Layout::ALL {
        let whole = recording(layout);
        assert!(read(Box::new(whole.clone()), 1.0, LabelSource::Dataset), "{layout}");
        let names: Vec<String> = whole.names().map(String::from).collect();
        let (mut good, mut bad) = (0, 0);
        for _ in 0..cases() {
            let mut m = whole.clone();
            for _ in 0..=rng.below(2) {
                let name = &names[rng.below(names.len())];
                let Some(mut bytes) = m.remove(name) else { continue };
                if rng.below(12) > 0 {
                    rng.damage(&mut bytes);
                    m.insert(name.clone(), bytes);
                }
            }
            let scale = [1.0, 0.5, 0.7][rng.below(3)];
            match read(Box::new(m), scale, LabelSource::Dataset) {
                true => good += 1,
                false => bad += 1,
            }
        }
        assert!(good > 0 && bad * 5 > cases(), "{layout}: {good} read, {bad} refused");
    }
    check_memory();
}

#[test]
fn damaged_archives() {
    let mut rng = Pcg(7);
    for (layout, method) in [
        (Layout::Sens, zip::CompressionMethod::Deflated),
        (Layout::Sens, zip::CompressionMethod::Stored),
        (Layout::ScanNet, zip::CompressionMethod::Deflated),
    ] {
        let whole = archive(&recording(layout), method);
        let opened = |bytes: Vec<u8>| ZipSource::new("room.zip", Cursor::new(bytes), 1 << 26);
        let source = opened(whole.clone()).unwrap();
        assert!(read(Box::new(source), 1.0, LabelSource::Dataset), "{layout}");
        let mut refused = 0;
        for _ in 0..cases() {
            let mut bytes = whole.clone();
            for _ in 0..=rng.below(3) {
                rng.damage(&mut bytes);
            }
            let ok =
                opened(bytes).is_ok_and(|source| read(Box::new(source), 1.0, LabelSource::Dataset));
            refused += usize::from(!ok);
        }
        assert!(refused * 3 > cases(), "{layout}: {refused} refused");
    }
    check_memory();
}

#[test]
fn packed_recordings_that_end_early_or_claim_too_much() {
    let files = recording(Layout::Sens);
    let whole = files.get("room.sens").unwrap().to_vec();
    let error = |bytes: Vec<u8>| {
        let mut m = files.clone();
        m.insert("room.sens", bytes);
        let options = OpenOptions { labels: LabelSource::None, ..Default::default() };
        let opened = open(Box::new(m), options);
        opened.and_then(|mut s| s.frame(0).map(drop)).err().map(|e| e.to_string())
    };
    // The last 8 bytes are the number of records of an inertial sensor, which nobody reads.
    for end in (0..whole.len() - 8).step_by(7) {
        let e = error(whole[..end].to_vec()).expect("an error");
        assert!(e.contains("room.sens"), "{end}: {e}");
    }
    let name = 8;
    let header = 4 + 8 + name;
    let codecs = header + 4 * 64;
    let count = codecs + 2 * 4 + 4 * 4 + 4;
    let first = count + 8;
    for (at, value, part) in [
        (0, &3u32.to_le_bytes()[..], "version: found 3"),
        (4, &u64::MAX.to_le_bytes(), "name of the sensor"),
        (codecs, &9i32.to_le_bytes(), "compression of colour: found 9"),
        (codecs, &(-1i32).to_le_bytes(), "compression of colour: found -1"),
        (codecs + 4, &2i32.to_le_bytes(), "occi"),
        (codecs + 8, &65000u32.to_le_bytes(), "colour image size"),
        (codecs + 8, &48u32.to_le_bytes(), "colour image size"),
        (codecs + 16, &0u32.to_le_bytes(), "depth image size"),
        (codecs + 16, &64u32.to_le_bytes(), "proportions of the depth image, 64x24"),
        (codecs + 24, &0f32.to_le_bytes(), "depth shift"),
        (codecs + 24, &f32::NAN.to_le_bytes(), "depth shift"),
        (count, &0u64.to_le_bytes(), "number of frames: found 0"),
        (count, &4u64.to_le_bytes(), "(frame 3): frame header"),
        (count, &u64::MAX.to_le_bytes(), "number of frames"),
        (first, &9f32.to_le_bytes(), "not a rotation"),
        (first + 64 + 16, &u64::MAX.to_le_bytes(), "colour image"),
        (first + 64 + 24, &u64::MAX.to_le_bytes(), "depth image"),
        (first + 64 + 24, &3u64.to_le_bytes(), "room.sens (frame"),
    ] {
        let mut bytes = whole.clone();
        bytes[at..at + value.len()].copy_from_slice(value);
        let e = error(bytes).unwrap_or_else(|| panic!("no error: {at} {part}"));
        assert!(e.contains("room.sens") && e.contains(part), "{at} {part}: {e}");
    }
}

fn check_memory() {
    #[cfg(target_os = "linux")]
    {
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap();
        let kib: u64 = line.trim().strip_suffix("kB").unwrap().trim().parse().unwrap();
        assert!(kib << 10 < MAX_PEAK_BYTES, "{} MiB at the peak", kib >> 10);
    }
}
