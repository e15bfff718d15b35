//! Recordings in a zip archive, read in place.
use ::zip::{CompressionMethod, ZipArchive, result::ZipError};
use flate2::read::DeflateDecoder;
use mte_slam_types::sequence::{SequenceError, Source, too_short};
use std::{
    cell::RefCell,
    io::{self, Read, Seek, SeekFrom},
    rc::Rc,
};

/// More files than any recording has.
const MAX_FILES: usize = 2_000_000;

/// The files of an archive. Parts of a large file (a `.sens`) are read as they are asked for: of a
/// stored one directly, of a deflated one by unpacking on from the part before.
pub struct ZipSource<R> {
    name: String,
    names: Vec<String>,
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
        let names = archive
            .file_names()
            .filter(|n| !n.ends_with('/') && is_inside(n))
            // What macOS adds beside every file.
            .filter(|n| !n.starts_with("__MACOSX/"))
            .map(String::from)
            .collect();
        let (archive, stream) = (RefCell::new(archive), RefCell::new(None));
        Ok(Self { name: name.into(), names, max_file_bytes, reader, archive, stream })
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

/// Returns whether a name stays below its folder.
fn is_inside(name: &str) -> bool {
    !name.contains(['\\', '\0']) && name.split('/').all(|p| !matches!(p, "" | "." | ".."))
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
        Ok(self.names.clone())
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        let failed = |reason: String| SequenceError::Read { file: file.into(), reason };
        let mut archive = self.archive.borrow_mut();
        let entry = archive.by_name(file).map_err(|e| invalid(file, &e))?;
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
        let mut archive = self.archive.borrow_mut();
        let entry = archive.by_name(file).map_err(|e| invalid(file, &e))?;
        Ok(entry.size())
    }

    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        let failed =
            |e: io::Error| SequenceError::Read { file: file.into(), reason: e.to_string() };
        let (size, method, place) = {
            let mut archive = self.archive.borrow_mut();
            let entry = archive.by_name(file).map_err(|e| invalid(file, &e))?;
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
            let files: [(&str, &[u8]); 4] =
                [("a/big.sens", &data), ("../out", b"x"), ("__MACOSX/a", b"x"), ("b.txt", b"hi")];
            let source = open(archive(method, &files)).unwrap();
            assert_eq!(source.name(), "room");
            let mut names = source.list().unwrap();
            names.sort();
            assert_eq!(names, ["a/big.sens", "b.txt"]);
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
            assert!(source.read("../out").is_ok() || !names.contains(&"../out".into()));
        }
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
