//! ScanNet's packed recordings (`.sens`, version 4). Only the frames' headers are read at opening;
//! images are read one by one later, so that memory does not grow with the file.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    wanted::Wanted,
};
use crate::{
    decode::Origin,
    entries::{Entries, Entry},
    folder::{Folder, invalid},
    intrinsics::Intrinsics,
    pose_text,
    stored::{Coding, Part, Stored},
};
use mte_slam_types::{pose::Pose, sequence::SequenceError};

/// Bytes before a frame's images: pose, two time stamps, two lengths.
const FRAME_HEADER: usize = 16 * 4 + 4 * 8;
/// Longest name of a sensor that is believed \[bytes\].
const MAX_NAME: u64 = 4096;
/// Longest image \[bytes\].
const MAX_IMAGE_BYTES: u64 = 256 << 20;
/// More frames than any recording has (9 hours at 30 Hz).
const MAX_FRAMES: u64 = 1 << 20;

pub(super) struct Sens;

impl LayoutFiles for Sens {
    fn name(&self) -> &'static str {
        "sens"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "ScanNet, packed",
            color: "in the file, streamed",
            depth: "in the file, in its unit",
            poses: "in the file",
            labels: "`label-filt/0.png` beside it",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        vec![("<name>.sens", files_of(folder).len())]
    }

    fn read(&self, folder: &Folder, _wanted: &Wanted) -> Result<Entries, SequenceError> {
        read(folder)
    }
}

/// Returns the `.sens` files of a folder.
fn files_of(folder: &Folder) -> Vec<&str> {
    let packed = folder.names().filter(|n| n.ends_with(".sens") && !n.contains('/'));
    packed.filter_map(|n| folder.real(n)).collect()
}

/// Reads a file piece by piece.
struct Cursor<'a> {
    folder: &'a Folder,
    file: &'a str,
    size: u64,
    at: u64,
    frame: Option<u64>,
}

impl Cursor<'_> {
    fn error(&self, field: &str, found: impl ToString, expected: impl ToString) -> SequenceError {
        invalid(self.file, self.frame, field, found.to_string(), expected.to_string())
    }

    /// The next `bytes` bytes, which are few.
    fn take(&mut self, bytes: usize, field: &str) -> Result<Vec<u8>, SequenceError> {
        self.room(bytes as u64, field)?;
        let taken = self.folder.read_range(self.file, self.at, bytes)?;
        self.at += bytes as u64;
        Ok(taken)
    }

    fn room(&self, bytes: u64, field: &str) -> Result<(), SequenceError> {
        let left = self.size - self.at;
        if bytes > left {
            let expected = format!("{bytes} bytes from {} on (a cut-off download?)", self.at);
            return Err(self.error(field, format!("{left} bytes until the end"), expected));
        }
        Ok(())
    }
}

/// Numbers from little-endian bytes, whose length was checked.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn next<const N: usize>(&mut self) -> [u8; N] {
        let mut out = [0; N];
        let n = N.min(self.0.len());
        out[..n].copy_from_slice(&self.0[..n]);
        self.0 = &self.0[n..];
        out
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.next())
    }

    fn i32(&mut self) -> i32 {
        i32::from_le_bytes(self.next())
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.next())
    }

    fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.next())
    }

    fn matrix(&mut self) -> [f64; 16] {
        core::array::from_fn(|_| f64::from(self.f32()))
    }
}

/// Reads everything but the images.
fn read(folder: &Folder) -> Result<Entries, SequenceError> {
    let files = files_of(folder);
    let &[file] = files.as_slice() else {
        let expected = "one .sens file in the folder; give the path of the one that is meant";
        let found = files.iter().take(4).copied().collect::<Vec<_>>().join(", ");
        return Err(invalid(&folder.name(), None, "recordings", found, expected));
    };
    let mut warnings = Vec::new();
    let size = folder.size(file)?;
    let mut cursor = Cursor { folder, file, size, at: 0, frame: None };
    let start = cursor.take(12, "header")?;
    let mut fields = Fields(&start);
    let version = fields.u32();
    if version != 4 {
        return Err(cursor.error("version", version, "4, the only one that is in use"));
    }
    let name_bytes = fields.u64();
    if name_bytes > MAX_NAME {
        let found = format!("a length of {name_bytes}");
        return Err(cursor.error("name of the sensor", found, format!("at most {MAX_NAME}")));
    }
    cursor.take(name_bytes as usize, "name of the sensor")?;
    let header = cursor.take(4 * 64 + 2 * 4 + 4 * 4 + 4 + 8, "header")?;
    let mut fields = Fields(&header);
    let [color_camera, color_pose, depth_camera, depth_pose] =
        core::array::from_fn(|_| fields.matrix());
    let color_coding = match fields.i32() {
        0 => Coding::RawColor,
        1 | 2 => Coding::Image,
        other => {
            let expected = "0 (raw), 1 (png) or 2 (jpeg)";
            return Err(cursor.error("compression of colour", other, expected));
        }
    };
    let depth_coding = match fields.i32() {
        0 => Coding::RawDepth,
        1 => Coding::ZlibDepth,
        2 => {
            let expected = "0 (raw) or 1 (zlib): occi needs Occipital's library, which is not \
                            free; ScanNet's own files have zlib";
            return Err(cursor.error("compression of depth", "2 (occi)", expected));
        }
        other => {
            let expected = "0 (raw) or 1 (zlib)";
            return Err(cursor.error("compression of depth", other, expected));
        }
    };
    let color_size = (fields.u32(), fields.u32());
    let depth_size = (fields.u32(), fields.u32());
    for (what, size) in [("colour image", color_size), ("depth image", depth_size)] {
        Origin { file, frame: 0, what }.check_size(size, None)?;
    }
    let depth_shift = f64::from(fields.f32());
    if !(depth_shift.is_finite() && depth_shift > 0.0) {
        return Err(cursor.error("depth shift", depth_shift, "units of depth per metre > 0"));
    }
    let count = fields.u64();
    if count == 0 || count > MAX_FRAMES {
        return Err(cursor.error("number of frames", count, format!("1 to {MAX_FRAMES}")));
    }
    if !(is_identity(&color_pose) && is_identity(&depth_pose)) {
        warnings.push(format!(
            "{file}: colour and depth camera are not in one place (the extrinsics are no \
             identities): taken as if they were"
        ));
    }

    // A header of 96 bytes each bounds the count by the file's size, whatever it says.
    let most = (size / FRAME_HEADER as u64 + 1).min(count) as usize;
    let mut frames: Vec<Entry> = Vec::with_capacity(most);
    let mut stamped = true;
    for number in 0..count {
        cursor.frame = Some(number);
        let header = cursor.take(FRAME_HEADER, "frame header")?;
        let mut fields = Fields(&header);
        let matrix = fields.matrix();
        let (time_us, _depth_time) = (fields.u64(), fields.u64());
        let lengths = [fields.u64(), fields.u64()];
        let truth = match pose_text::is_none(&matrix) {
            true => None,
            false => Some(Pose::from_row_major(&matrix).ok_or_else(|| {
                let found = "a matrix whose upper left 3x3 block is not a rotation";
                cursor.error("pose", found, "a rigid transform, world_from_camera")
            })?),
        };
        let mut part = |bytes: u64, coding, size, field| -> Result<Stored, SequenceError> {
            cursor.room(bytes, field)?;
            let offset = cursor.at;
            cursor.at += bytes;
            if bytes > MAX_IMAGE_BYTES {
                let expected = format!("at most {MAX_IMAGE_BYTES} bytes");
                return Err(cursor.error(field, format!("{bytes} bytes"), expected));
            }
            let part = Part { offset, bytes: bytes as usize, coding, size };
            Ok(Stored { file: file.into(), part: Some(part) })
        };
        let color = part(lengths[0], color_coding, color_size, "colour image")?;
        let depth = part(lengths[1], depth_coding, depth_size, "depth image")?;
        let time_s = time_us as f64 * 1e-6;
        stamped &= frames.last().is_none_or(|last: &Entry| last.time_s < time_s);
        frames.push(Entry::stamped(number, time_s, color, depth, truth));
    }
    if !stamped {
        warnings.push(format!("{file}: time stamps do not rise: frames are counted instead"));
        for frame in &mut frames {
            frame.time_s = frame.number as f64;
        }
    }

    let [fx, fy, cx, cy] = [0, 5, 2, 6].map(|i| depth_camera[i]);
    let from = format!("{file} (depth intrinsics)");
    if !(fx > 0.0 && fy > 0.0 && [fx, fy, cx, cy].iter().all(|x| x.is_finite())) {
        let found = format!("fx fy cx cy = {fx} {fy} {cx} {cy}");
        return Err(invalid(file, None, "depth intrinsics", found, "finite, fx and fy > 0"));
    }
    let mut intrinsics = Intrinsics::fixed(&from, depth_size, [fx, fy, cx, cy]);
    intrinsics.depth_scale = Some(depth_shift);
    intrinsics.note_color([0, 5, 2, 6].map(|i| color_camera[i]), color_size, &mut warnings);
    Ok(Entries {
        frames,
        intrinsics,
        depth_unit_m: 1.0 / depth_shift,
        invalid_depth: None,
        bounds: None,
        warnings,
    })
}

/// Returns whether a matrix is the identity, or not given (all zero).
fn is_identity(m: &[f64; 16]) -> bool {
    let near = |scale: f64| {
        m.iter().enumerate().all(|(i, x)| {
            let expected = if i % 5 == 0 { scale } else { 0.0 };
            (x - expected).abs() < 1e-4
        })
    };
    near(1.0) || near(0.0)
}
