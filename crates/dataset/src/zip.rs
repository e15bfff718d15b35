//! Recordings in a zip archive, read in place.
use super::folder::{plural, shortened};
use ::zip::{CompressionMethod, ZipArchive, result::ZipError};
use flate2::read::DeflateDecoder;
use mte_slam_types::sequence::{SequenceError, Source, too_short};
use std::{
    cell::RefCell,
    collections::{BTreeMap, btree_map::Entry},
    io::{self, Read, Seek, SeekFrom},
    rc::Rc,
};

/// More files than any recording has.
const MAX_FILES: usize = 2_000_000;

/// The files of an archive. Parts of a large file (a `.sens`) are read as they are asked for: of a
/// stored one directly, of a deflated one by unpacking on from the part before.
pub struct ZipSource<R> {
    name: String,
    /// The files by name, `/`-separated below the root, and their numbers in the archive.
    files: BTreeMap<String, usize>,
    notes: Vec<String>,
    max_file_bytes: u64,
    reader: Shared<R>,
    archive: RefCell<ZipArchive<Shared<R>>>,
    stream: RefCell<Option<Stream<R>>>,
}

/// One seekable reader with many positions.
struct Shared<R> {
    reader: Rc<RefCell<R>>,
    position: u64,
    length: u64,
}

impl<R> Clone for Shared<R> {
    fn clone(&self) -> Self {
        Self { reader: self.reader.clone(), ..*self }
    }
}

impl<R: Read + Seek> Read for Shared<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut reader = self.reader.borrow_mut();
        if reader.stream_position()? != self.position {
            reader.seek(SeekFrom::Start(self.position))?;
        }
        let n = reader.read(out)?;
        self.position += n as u64;
        Ok(n)
    }
}

impl<R: Read + Seek> Seek for Shared<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let target = match to {
            SeekFrom::Start(n) => Some(n),
            SeekFrom::End(n) => self.length.checked_add_signed(n),
            SeekFrom::Current(n) => self.position.checked_add_signed(n),
        };
        self.position = target.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}

/// A deflated file that is being unpacked.
struct Stream<R> {
    file: String,
    decoder: DeflateDecoder<io::Take<Shared<R>>>,
    position: u64,
}

impl<R: Read + Seek> ZipSource<R> {
    /// Opens an archive. `name` is for messages; "room.zip" holds the recording "room". Files that are
    /// read as a whole may have `max_file_bytes` bytes at most.
    ///
    /// # Errors
    /// [`SequenceError::Invalid`] when it is no archive.
    pub fn new(name: &str, mut reader: R, max_file_bytes: u64) -> Result<Self, SequenceError> {
        let failed =
            |e: io::Error| SequenceError::Read { file: name.into(), reason: e.to_string() };
        let length = reader.seek(SeekFrom::End(0)).map_err(failed)?;
        let reader = Shared { reader: Rc::new(RefCell::new(reader)), position: 0, length };
        let archive = ZipArchive::new(reader.clone()).map_err(|e| invalid(name, &e))?;
        if archive.len() > MAX_FILES {
            let reason = format!("more than {MAX_FILES} files: not a recording");
            return Err(SequenceError::Read { file: name.into(), reason });
        }
        let (mut files, mut left_out) = (BTreeMap::new(), BTreeMap::new());
        for (i, stored) in (0..archive.len()).filter_map(|i| Some((i, archive.name_for_index(i)?)))
        {
            if stored.ends_with(['/', '\\']) {
                continue; // a folder
            }
            let why = match plain(stored) {
                Err(why) => why,
                Ok(file) => match files.entry(file) {
                    Entry::Vacant(free) => {
                        free.insert(i);
                        continue;
                    }
                    Entry::Occupied(_) => "named like another but for their slashes",
                },
            };
            left_out.entry(why).or_insert((0, stored)).0 += 1;
        }
        let notes = left_out.into_iter().map(|(why, (n, first))| {
            let files = plural(n, "file");
            format!("{files} of the archive left out, {why}: {}", shortened(first))
        });
        let notes = notes.collect();
        let (archive, stream) = (RefCell::new(archive), RefCell::new(None));
        Ok(Self { name: name.into(), files, notes, max_file_bytes, reader, archive, stream })
    }

    /// Returns the number of a file in the archive.
    fn number(&self, file: &str) -> Result<usize, SequenceError> {
        self.files.get(file).copied().ok_or_else(|| {
            let reason = format!("no such file in {}", self.name);
            SequenceError::Read { file: file.into(), reason }
        })
    }

    /// Returns a decoder of a deflated file, standing at `offset` or before.
    fn stream_to(&self, file: &str, offset: u64, (start, packed): (u64, u64)) -> Stream<R> {
        match self.stream.borrow_mut().take() {
            Some(open) if open.file == file && open.position <= offset => open,
            _ => {
                let reader = Shared { position: start, ..self.reader.clone() };
                let decoder = DeflateDecoder::new(reader.take(packed));
                Stream { file: file.into(), decoder, position: 0 }
            }
        }
    }
}

/// Returns the plain form of a name in an archive, or why it has none. Archives of Windows'
/// PowerShell have `\` where others have `/`, and some of `tar` and `zip` begin with `./`.
fn plain(stored: &str) -> Result<String, &'static str> {
    let name = stored.replace('\\', "/");
    let drive = name.as_bytes().get(1) == Some(&b':') && name.as_bytes()[0].is_ascii_alphabetic();
    if name.starts_with('/') || drive {
        return Err("with absolute paths");
    }
    let parts: Vec<&str> = name.split('/').filter(|part| !matches!(*part, "" | ".")).collect();
    if parts.contains(&"..") {
        return Err("outside its root (..)");
    }
    if parts.is_empty() || name.contains('\0') {
        return Err("without a name that a file can have");
    }
    Ok(parts.join("/"))
}

fn invalid(file: &str, error: &ZipError) -> SequenceError {
    SequenceError::Invalid {
        file: file.into(),
        frame: None,
        field: "archive".into(),
        found: error.to_string(),
        expected: "a zip archive, stored or deflated, without a password".into(),
    }
}

impl<R: Read + Seek> Source for ZipSource<R> {
    fn name(&self) -> &str {
        self.name.strip_suffix(".zip").unwrap_or(&self.name)
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        Ok(self.files.keys().cloned().collect())
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        let failed = |reason: String| SequenceError::Read { file: file.into(), reason };
        let number = self.number(file)?;
        let mut archive = self.archive.borrow_mut();
        let entry = archive.by_index(number).map_err(|e| invalid(file, &e))?;
        let (size, packed) = (entry.size(), entry.compressed_size());
        if size > self.max_file_bytes {
            return Err(failed(format!("{size} bytes, expected at most {}", self.max_file_bytes)));
        }
        // The size is only what the archive claims, so reading stops there, too; and no more is
        // set aside than so few packed bytes can make.
        let mut bytes = Vec::with_capacity(size.min(packed.saturating_mul(1100)) as usize);
        entry.take(size + 1).read_to_end(&mut bytes).map_err(|e| failed(e.to_string()))?;
        if bytes.len() as u64 != size {
            return Err(failed(format!("{} bytes or more, expected {size}", bytes.len())));
        }
        Ok(bytes)
    }

    fn size(&self, file: &str) -> Result<u64, SequenceError> {
        let number = self.number(file)?;
        let mut archive = self.archive.borrow_mut();
        let entry = archive.by_index(number).map_err(|e| invalid(file, &e))?;
        Ok(entry.size())
    }

    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        let failed =
            |e: io::Error| SequenceError::Read { file: file.into(), reason: e.to_string() };
        let (size, method, place) = {
            let number = self.number(file)?;
            let mut archive = self.archive.borrow_mut();
            let entry = archive.by_index(number).map_err(|e| invalid(file, &e))?;
            if entry.encrypted() {
                let reason = "has a password".into();
                return Err(SequenceError::Read { file: file.into(), reason });
            }
            let start = entry.data_start().ok_or_else(|| failed(io::ErrorKind::NotFound.into()))?;
            let place = (start, entry.compressed_size());
            (entry.size(), entry.compression(), place)
        };
        let end = offset.checked_add(bytes as u64);
        if end.is_none_or(|end| end > size) || bytes as u64 > self.max_file_bytes {
            return Err(too_short(file, size, offset, bytes));
        }
        let mut out = Vec::new();
        match method {
            CompressionMethod::Stored => {
                let mut reader = self.reader.clone();
                reader.position = place.0.saturating_add(offset);
                let left = place.1.saturating_sub(offset).min(bytes as u64);
                reader.take(left).read_to_end(&mut out).map_err(failed)?;
            }
            CompressionMethod::Deflated => {
                let mut stream = self.stream_to(file, offset, place);
                let skip = offset - stream.position;
                let mut before = stream.decoder.by_ref().take(skip);
                let skipped = io::copy(&mut before, &mut io::sink()).map_err(failed)?;
                stream.decoder.by_ref().take(bytes as u64).read_to_end(&mut out).map_err(failed)?;
                stream.position += skipped + out.len() as u64;
                self.stream.replace(Some(stream));
            }
            other => {
                return Err(invalid(
                    file,
                    &ZipError::UnsupportedArchive(match other {
                        CompressionMethod::AES => "encrypted",
                        _ => "packed by another method",
                    }),
                ));
            }
        }
        if out.len() != bytes {
            return Err(too_short(file, offset + out.len() as u64, offset, bytes));
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::zip::{ZipWriter, write::SimpleFileOptions};
    use std::io::{Cursor, Write};

    fn archive(method: CompressionMethod, files: &[(&str, &[u8])]) -> Vec<u8> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in files {
            writer
                .start_file(*name, SimpleFileOptions::default().compression_method(method))
                .unwrap();
            writer.write_all(bytes).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn open(bytes: Vec<u8>) -> Result<ZipSource<Cursor<Vec<u8>>>, SequenceError> {
        ZipSource::new("room.zip", Cursor::new(bytes), 1 << 20)
    }

    #[test]
    fn files_and_parts_of_them_are_what_was_packed() {
        let data: Vec<u8> = (0..300_000u32).map(|i| (i.wrapping_mul(i) >> 7) as u8).collect();
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            let files: [(&str, &[u8]); 3] =
                [("a/big.sens", &data), ("../out", b"x"), ("b.txt", b"hi")];
            let source = open(archive(method, &files)).unwrap();
            assert_eq!(source.name(), "room");
            assert_eq!(source.list().unwrap(), ["a/big.sens", "b.txt"]);
            assert_eq!(source.read("b.txt").unwrap(), b"hi");
            assert_eq!(source.size("a/big.sens").unwrap(), 300_000);
            // Forward, on, back, and to the very end, with another file in between.
            for (at, n) in [(5, 10), (100_000, 7000), (0, 3), (299_990, 10), (1, 0)] {
                let part = source.read_range("a/big.sens", at as u64, n).unwrap();
                assert_eq!(part, data[at..at + n], "{at} {n}");
                assert_eq!(source.read_range("b.txt", 1, 1).unwrap(), b"i");
            }
            let e = source.read_range("a/big.sens", 299_991, 10).unwrap_err().to_string();
            assert!(e.contains("a/big.sens") && e.contains("300000 bytes long"), "{e}");
            assert!(source.read_range("a/big.sens", u64::MAX, 10).is_err());
            assert!(source.read("../out").is_err());
        }
    }

    #[test]
    fn names_of_other_programs_are_read_and_those_left_out_are_said() {
        let files: [(&str, &[u8]); 9] = [
            ("scan\\color\\0.png", b"color"),
            ("./scan/depth/0.png", b"depth"),
            ("scan//./traj.txt", b"poses"),
            ("scan/traj.txt", b"others"),
            ("/etc/passwd", b"x"),
            ("C:\\scan\\0.png", b"x"),
            ("..\\0.png", b"x"),
            ("scan/../../0.png", b"x"),
            ("scan\\empty\\", b""),
        ];
        let source = open(archive(CompressionMethod::Stored, &files)).unwrap();
        let names = ["scan/color/0.png", "scan/depth/0.png", "scan/traj.txt"];
        assert_eq!(source.list().unwrap(), names);
        let bytes = names.map(|n| source.read(n).unwrap());
        assert_eq!(bytes.each_ref().map(Vec::as_slice), [&b"color"[..], b"depth", b"poses"]);
        assert_eq!(source.read_range(names[0], 1, 3).unwrap(), b"olo");
        let notes = source.notes().join(";");
        for part in [
            "2 files of the archive left out, with absolute paths: \"/etc/passwd\"",
            "2 files of the archive left out, outside its root (..): \"..\\\\0.png\"",
            "1 file of the archive left out, named like another but for their slashes: \"scan/traj",
        ] {
            assert!(notes.contains(part), "{part} is not in {notes}");
        }
        assert!(open(archive(CompressionMethod::Stored, &files[..3])).unwrap().notes().is_empty());
    }

    #[test]
    fn files_with_a_password_are_listed_and_refused_by_name() {
        let mut bytes = archive(CompressionMethod::Stored, &[("traj.txt", b"0123456789abcdef")]);
        // The flag of encryption, in the file's header and in the directory.
        bytes[6] |= 1;
        let directory = bytes.windows(4).position(|w| w == b"PK\x01\x02").unwrap();
        bytes[directory + 8] |= 1;
        let source = open(bytes).unwrap();
        assert_eq!(source.list().unwrap(), ["traj.txt"]);
        let e = source.read("traj.txt").unwrap_err().to_string();
        assert!(e.contains("traj.txt") && e.to_lowercase().contains("password"), "{e}");
    }

    #[test]
    fn what_is_no_archive_or_too_large_is_said() {
        let e = open(vec![7; 99]).err().unwrap().to_string();
        assert!(e.contains("room.zip") && e.contains("expected a zip archive"), "{e}");
        // A megabyte and more of zeros in a few bytes.
        let packed = archive(CompressionMethod::Deflated, &[("zeros", &vec![0; (1 << 20) + 1])]);
        assert!(packed.len() < 4000);
        let e = open(packed).unwrap().read("zeros").unwrap_err().to_string();
        assert!(e.contains("zeros") && e.contains("at most 1048576"), "{e}");
    }
}
