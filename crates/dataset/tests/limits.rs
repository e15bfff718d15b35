//! Small files that ask for much: each is refused with its reason, or read, in bounded memory. On
//! Linux the test runs itself again with little address space, so that what is only set aside, and
//! never touched, counts as well.
mod recordings;

use flate2::{Compress, Compression, FlushCompress};
use mte_slam_core::{
    config::Config,
    engine::Engine,
    slam::{Checkpoint, Slam},
};
use mte_slam_dataset::{Layout, MemorySource, OpenOptions, ZipSource, open};
use mte_slam_mesh::read_ply;
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    frame::SequenceInfo,
    sequence::{Sequence, SequenceError, Source},
};
use pollster::block_on;
use recordings::recording;
use std::{fmt::Display, io::Cursor};
use zip::CompressionMethod;

/// What the limits promise is 1 GiB; a picture may have 64 million pixels. The program and its
/// threads take some themselves.
const ADDRESS_SPACE_KIB: u32 = (1 << 20) + (256 << 10);
/// Bytes that the packed bombs hold: more than there may be.
const BOMB_BYTES: usize = 2 << 30;
const INNER: &str = "MTE_SLAM_IN_LITTLE_MEMORY";

#[test]
fn files_that_ask_for_much_are_refused_in_bounded_memory() {
    if std::env::var_os(INNER).is_some() || !cfg!(target_os = "linux") {
        images();
        packed_recordings();
        archives();
        feature_maps();
        meshes();
        checkpoints();
        numbers_in_texts();
        return;
    }
    let name = "files_that_ask_for_much_are_refused_in_bounded_memory";
    let done = std::process::Command::new("sh")
        .args(["-c", &format!("ulimit -v {ADDRESS_SPACE_KIB} && exec \"$0\" \"$@\"")])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", name, "--nocapture", "--test-threads=1"])
        .env(INNER, "1")
        .env("MALLOC_ARENA_MAX", "1")
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (text(&done.stdout), text(&done.stderr));
    assert!(done.status.success() && out.contains("1 passed"), "{}: {out}{err}", done.status);
}

/// The result must be an error that says all the parts.
fn refused<T, E: Display>(what: &str, result: Result<T, E>, parts: &[&str]) {
    let Err(error) = result else { panic!("{what}: no error") };
    let error = error.to_string();
    assert!(error.len() < 600, "{what}: a message of {} bytes", error.len());
    for part in parts {
        assert!(error.contains(part), "{what}: no {part} in: {error}");
    }
}

/// Opens a recording and reads its first frame.
fn read_with(files: &MemorySource, options: OpenOptions) -> Result<(), SequenceError> {
    open(Box::new(files.clone()), options)?.frame(0).map(drop)
}

fn read(files: &MemorySource) -> Result<(), SequenceError> {
    read_with(files, OpenOptions::default())
}

/// Raw deflate of `n` zeros, made of one part again and again.
fn deflated_zeros(n: usize) -> Vec<u8> {
    const PART: usize = 32 << 20;
    let mut packed = Vec::with_capacity(1 << 20);
    Compress::new(Compression::best(), false)
        .compress_vec(&vec![0; PART], &mut packed, FlushCompress::Full)
        .unwrap();
    let mut out = packed.repeat(n / PART);
    out.extend([3, 0]); // a last, empty block
    out
}

/// The same as a zlib stream, whose checksum is wrong; nobody should get that far.
fn zlib_zeros(n: usize) -> Vec<u8> {
    [&[0x78, 0xda][..], &deflated_zeros(n), &[0; 4]].concat()
}

fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = flate2::Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// Returns a PNG of one IHDR, the chunks given, one IDAT.
fn png(size: (u32, u32), bits: u8, color: u8, more: &[(&[u8; 4], &[u8])], data: &[u8]) -> Vec<u8> {
    let header =
        [&size.0.to_be_bytes()[..], &size.1.to_be_bytes(), &[bits, color, 0, 0, 0]].concat();
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    let all = [(b"IHDR", header.as_slice())].into_iter().chain(more.iter().copied());
    for (name, bytes) in all.chain([(b"IDAT", data), (b"IEND", &[][..])]) {
        out.extend((bytes.len() as u32).to_be_bytes());
        let from = out.len();
        out.extend(name);
        out.extend(bytes);
        let crc = crc32(&out[from..]);
        out.extend(crc.to_be_bytes());
    }
    out
}

fn images() {
    let whole = recording(Layout::ReplicaNice);
    let with = |name: &str, bytes: Vec<u8>| {
        let mut files = whole.clone();
        files.insert(name, bytes);
        read(&files)
    };
    let (color, depth) = ("results/frame000000.jpg", "results/depth000000.png");
    let label = "semantic_class/semantic_class_000000.png";
    for (name, bits, kind) in [(color, 8, 2), (depth, 16, 0), (label, 8, 0)] {
        let huge = |w, h| png((w, h), bits, kind, &[], &zlib_zeros(1 << 25));
        refused(name, with(name, huge(60_000, 60_000)), &[name, "found 60000x60000"]);
        refused(name, with(name, huge(1, 1 << 24)), &[name, "found 1x16777216"]);
        refused(name, with(name, huge(16_000, 12_000)), &[name, "at most 67108864 pixels"]);
    }
    // A JPEG whose header says 65500 x 65500.
    let mut jpeg = whole.get(color).unwrap().to_vec();
    let at = jpeg.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    jpeg[at + 5..at + 9].copy_from_slice(&[0xff, 0xdc, 0xff, 0xdc]);
    refused("jpeg", with(color, jpeg), &[color, "65500x65500"]);
    // Small pictures with much beside: a colour profile, a text, more data than pixels.
    let bomb = zlib_zeros(BOMB_BYTES);
    let profile = [b"x\0\0".as_slice(), &bomb].concat();
    let rows = zlib_zeros(1 << 25);
    for (chunk, bytes) in [(b"iCCP", &profile), (b"zTXt", &profile)] {
        // Whether it is refused is up to the decoder; that it takes no memory is not.
        let _ = with(color, png((32, 24), 8, 2, &[(chunk, bytes)], &rows));
        let _ = with(depth, png((32, 24), 16, 0, &[(chunk, bytes)], &rows));
    }
    let _ = with(color, png((32, 24), 8, 2, &[], &bomb));
    let _ = with(depth, png((32, 24), 16, 0, &[], &bomb));
    // The largest there may be, with the most bytes per pixel, is read: red, green, blue and alpha of
    // 16 bits, fitted to the depth image.
    let largest = png((9216, 6912), 16, 6, &[], &zlib_zeros(512 << 20));
    assert!(largest.len() < 1 << 20, "{}", largest.len());
    with(color, largest).unwrap();
}

fn packed_recordings() {
    let whole = recording(Layout::Sens);
    let packed = whole.get("room.sens").unwrap();
    let name_bytes = u64::from_le_bytes(packed[4..12].try_into().unwrap()) as usize;
    let count = 12 + name_bytes + 4 * 64 + 2 * 4 + 4 * 4 + 4;
    let first = count + 8;
    let with = |bytes: Vec<u8>| {
        let mut files = whole.clone();
        files.insert("room.sens", bytes);
        read(&files)
    };
    for (at, value, part) in [
        (4, u64::MAX, "name of the sensor"),
        (4, 1 << 40, "name of the sensor"),
        (count, u64::MAX, "number of frames"),
        (count, 1 << 20, "frame header"),
        (first + 80, 1 << 60, "colour image"),
        (first + 88, u64::MAX - 7, "depth image"),
    ] {
        let mut bytes = packed.to_vec();
        bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
        refused(part, with(bytes), &["room.sens", part]);
    }
    // A depth image that unpacks to gigabytes.
    let length = |at: usize| u64::from_le_bytes(packed[at..at + 8].try_into().unwrap()) as usize;
    let (color, depth) = (length(first + 80), length(first + 88));
    let from = first + 96 + color;
    let bomb = zlib_zeros(BOMB_BYTES);
    let mut bytes = packed[..from].to_vec();
    bytes[first + 88..first + 96].copy_from_slice(&(bomb.len() as u64).to_le_bytes());
    bytes.extend(&bomb);
    bytes.extend(&packed[from + depth..]);
    refused("bomb", with(bytes), &["room.sens (frame 0)", "depth image", "found more"]);
}

/// A zip archive of one deflated file that claims to have `size` bytes, and of `count` files.
fn archive(name: &str, packed: &[u8], size: u32, count: u16) -> Vec<u8> {
    let sizes =
        [0u32.to_le_bytes(), (packed.len() as u32).to_le_bytes(), size.to_le_bytes()].concat();
    let common = [&[20, 0, 0, 0, 8, 0, 0, 0, 0, 0][..], &sizes, &(name.len() as u16).to_le_bytes()];
    let mut out =
        [b"PK\x03\x04", common.concat().as_slice(), &[0; 2], name.as_bytes(), packed].concat();
    let at = out.len() as u32;
    let entry =
        [b"PK\x01\x02\x14\0".as_slice(), &common.concat(), &[0; 16], name.as_bytes()].concat();
    out.extend(&entry);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend([count.to_le_bytes(), count.to_le_bytes()].concat());
    out.extend([(entry.len() as u32).to_le_bytes(), at.to_le_bytes()].concat());
    out.extend([0, 0]);
    out
}

fn archives() {
    const LIMIT: u64 = 1 << 28;
    let opened = |bytes: Vec<u8>| ZipSource::new("room.zip", Cursor::new(bytes), LIMIT);
    let usual = recordings::archive(&recording(Layout::ScanNet), CompressionMethod::Deflated);
    open(Box::new(opened(usual).unwrap()), OpenOptions::default()).unwrap().frame(0).unwrap();
    let bomb = deflated_zeros(BOMB_BYTES);
    // The size that it claims is kept to, or is too much.
    let source = opened(archive("a.txt", &bomb, 100, 1)).unwrap();
    refused("more than claimed", source.read("a.txt"), &["a.txt", "expected 100"]);
    let source = opened(archive("a.txt", &bomb, u32::MAX - 1, 1)).unwrap();
    refused("much claimed", source.read("a.txt"), &["a.txt", "at most 268435456"]);
    let part = source.read_range("a.txt", 0, LIMIT as usize + 1);
    refused("much asked for", part, &["a.txt", "were expected"]);
    // Far into it, and beyond what there is.
    assert_eq!(source.read_range("a.txt", 1 << 30, 3).unwrap(), [0; 3]);
    let past = source.read_range("a.txt", u64::from(u32::MAX) - 9, 3);
    refused("past the end", past, &["a.txt"]);
    // Few bytes that claim much, and files that are not there.
    let source = opened(archive("a.txt", &deflated_zeros(1 << 25), LIMIT as u32, 1)).unwrap();
    refused("less than claimed", source.read("a.txt"), &["a.txt", "cannot be read"]);
    refused("files", opened(archive("a.txt", &[3, 0], 0, 65_534)), &["room.zip"]);
}

fn feature_maps() {
    let with = |name: &str, bytes: Vec<u8>| {
        let mut maps = MemorySource::new("maps");
        for i in 0..3 {
            maps.insert(name.replace('#', &i.to_string()), bytes.clone());
        }
        let features: Option<Box<dyn Source>> = Some(Box::new(maps));
        read_with(&recording(Layout::Images), OpenOptions { features, ..Default::default() })
    };
    for (shape, part) in [
        ("4096, 4096, 4096", "found 0, expected 274877906944"),
        ("18446744073709551615, 2, 2", "none of them over 4096"),
        ("1, 1, 4294967297", "none of them over 4096"),
    ] {
        let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}");
        let npy =
            [b"\x93NUMPY\x01\0", &(text.len() as u16).to_le_bytes()[..], text.as_bytes()].concat();
        refused(shape, with("#.npy", npy), &["0.npy (frame 0)", part]);
        let shape = shape.replace(' ', "");
        let text = format!(
            r#"{{"features":{{"dtype":"F32","shape":[{shape}],"data_offsets":[0,274877906944]}}}}"#
        );
        let tensors = [&(text.len() as u64).to_le_bytes()[..], text.as_bytes()].concat();
        refused(&shape, with("#.safetensors", tensors), &["0.safetensors (frame 0)", "cut off"]);
    }
    let long = b"\x93NUMPY\x03\0\xff\xff\xff\xff".to_vec();
    refused("npy", with("#.npy", long), &["NumPy header", "65535"]);
    let long = (1u64 << 62).to_le_bytes().to_vec();
    refused("safetensors", with("#.safetensors", long), &["header", "at most"]);
}

fn meshes() {
    let file = |body: &str| format!("ply\nformat binary_little_endian 1.0\n{body}end_header\n");
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    for count in ["4294967296", "4294967295", "18446744073709551615"] {
        let vertices = file(&format!("element vertex {count}\n{xyz}")) + &"\0".repeat(1000);
        refused(count, read_ply(vertices.as_bytes()), &["element `vertex`", count]);
        let other = file(&format!("element vertex 0\n{xyz}element x {count}\nproperty char c\n"));
        refused(count, read_ply(other.as_bytes()), &["element `x`", count]);
    }
    let face = "element face 1\nproperty list uint int vertex_indices\n";
    let mut faces = file(&format!("element vertex 0\n{xyz}{face}")).into_bytes();
    faces.extend([0xff; 4]);
    refused("list", read_ply(&faces), &["face", "a list of 4294967295"]);
}

fn checkpoints() {
    let file = |header: &str| {
        [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &[0; 8]].concat()
    };
    let tensor = |shape: &str, offsets: &str| {
        file(&format!(r#"{{"a":{{"dtype":"F64","shape":[{shape}],"data_offsets":[{offsets}]}}}}"#))
    };
    for (bytes, part) in [
        (u64::MAX.to_le_bytes().to_vec(), "header"),
        ((1u64 << 27).to_le_bytes().to_vec(), "header"),
        (tensor("1", "0,18446744073709551615"), "cut off"),
        (tensor("1", "18446744073709551607,18446744073709551615"), "cut off"),
        (tensor("4294967296,4294967296", "0,8"), "found 8 bytes"),
        (tensor("2305843009213693952", "0,8"), "found 8 bytes"),
        (tensor("1", "8,0"), "cut off"),
        (file(&"[".repeat(1 << 20)), "JSON"),
    ] {
        refused(part, Checkpoint::from_bytes(&bytes), &[part]);
    }
}

fn numbers_in_texts() {
    let images = recording(Layout::Images);
    let with = |name: &str, text: &str| {
        let mut files = images.clone();
        files.insert(name, text);
        files
    };
    for size in ["4294967295", "18446744073709551615", "1e300", "-1"] {
        let camera = format!(r#"{{"w": {size}, "h": 24, "fx": 9, "fy": 9, "cx": 16, "cy": 12}}"#);
        refused(size, read(&with("intrinsics.json", &camera)), &["intrinsics.json"]);
    }
    let many = "0 ".repeat(1 << 20);
    refused("poses", read(&with("poses.txt", &many)), &["poses.txt"]);
    // A map larger than any engine holds is refused before it is made.
    let mut room = SyntheticSequence::new(SyntheticOptions::tiny());
    let frame = room.frame(0).unwrap();
    let tiny_unit = r#"{"fx": 30, "fy": 30, "cx": 16, "cy": 12, "depth_scale": 1e-9}"#;
    let too_large = ["planes", "the limit is", "coarser grid"].as_slice();
    for (files, parts) in [
        (with("bound.json", r#"{"bound": [[-1e9, 1e9], [-1e9, 1e9], [-1e9, 1e9]]}"#), too_large),
        (with("bound.json", r#"{"bound": [[0, 1e300], [0, 1e300], [0, 1e300]]}"#), too_large),
        (with("intrinsics.json", tiny_unit), &[]),
    ] {
        let sequence = open(Box::new(files), OpenOptions::default()).unwrap();
        let (bounds, depth_unit_m) = (sequence.info().bounds, sequence.info().depth_unit_m);
        let info = SequenceInfo { bounds, depth_unit_m, ..room.info().clone() };
        let mut slam = block_on(Slam::new(Engine::cpu(), Config::default(), &info)).unwrap();
        refused("map", block_on(slam.process(&frame)), parts);
    }
}
