//! Archives: local ones are read in pieces, those on a server by ranges where it allows.
use super::{MAX_FILE_BYTES, files::read_blob, http::ask, last_part};
use mte_slam_types::sequence::{SequenceError, Source};
use std::io::{self, Read, Seek, SeekFrom};
use web_sys::Blob;

/// Read at once: small reads of a central directory become few requests.
const PIECE_BYTES: u64 = 256 << 10;

/// Bytes first..end of an archive.
type Fetch = Box<dyn Fn(u64, u64) -> Result<Vec<u8>, String>>;

/// Seekable bytes behind a function, with the last piece kept.
struct Pieces {
    fetch: Fetch,
    length: u64,
    position: u64,
    piece: Vec<u8>,
    piece_start: u64,
}

impl Pieces {
    fn new(length: u64, fetch: Fetch) -> Self {
        Self { fetch, length, position: 0, piece: Vec::new(), piece_start: 0 }
    }
}

impl Read for Pieces {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.position >= self.length || out.is_empty() {
            return Ok(0);
        }
        let held = self.piece_start..self.piece_start + self.piece.len() as u64;
        if !held.contains(&self.position) {
            let end = (self.position + PIECE_BYTES).min(self.length);
            self.piece = (self.fetch)(self.position, end).map_err(io::Error::other)?;
            self.piece_start = self.position;
            if self.piece.is_empty() {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
        }
        let from = (self.position - self.piece_start) as usize;
        let n = out.len().min(self.piece.len() - from);
        out[..n].copy_from_slice(&self.piece[from..from + n]);
        self.position += n as u64;
        Ok(n)
    }
}

impl Seek for Pieces {
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

/// The files of an archive.
pub struct ZipSource {
    archive: mte_slam_dataset::ZipSource<Pieces>,
    /// Whether a server sent the whole archive because it knows no ranges.
    pub whole: bool,
}

impl ZipSource {
    /// A local archive.
    ///
    /// # Errors
    /// It is no archive.
    pub fn local(name: &str, blob: Blob) -> Result<Self, SequenceError> {
        let length = blob.size() as u64;
        let fetch = move |first: u64, end: u64| {
            let part = blob.slice_with_f64_and_f64(first as f64, end as f64);
            read_blob(&part.map_err(|e| super::files::reason(&e))?)
        };
        Self::new(name, Pieces::new(length, Box::new(fetch)), false)
    }

    /// An archive on a server.
    ///
    /// # Errors
    /// The server does not answer, or it is no archive.
    pub fn remote(url: &str) -> Result<Self, SequenceError> {
        let failed = |reason: String| SequenceError::Read { file: url.into(), reason };
        let probe = ask("GET", url, Some((0, 0))).map_err(failed)?;
        let name = last_part(url);
        match probe.status {
            206 => {
                let length = probe.whole_length().ok_or_else(|| {
                    failed("the server sends ranges but hides the length (Content-Range)".into())
                })?;
                let address = url.to_owned();
                let fetch = move |first: u64, end: u64| {
                    let answer = ask("GET", &address, Some((first, end - 1)))?;
                    match answer.status {
                        206 => Ok(answer.body),
                        other => Err(format!("the server answers {other}, expected 206")),
                    }
                };
                Self::new(&name, Pieces::new(length, Box::new(fetch)), false)
            }
            200 => {
                let bytes = probe.body;
                let length = bytes.len() as u64;
                let fetch =
                    move |first: u64, end: u64| Ok(bytes[first as usize..end as usize].to_vec());
                Self::new(&name, Pieces::new(length, Box::new(fetch)), true)
            }
            other => Err(failed(format!("the server answers {other}, expected an archive"))),
        }
    }

    fn new(name: &str, pieces: Pieces, whole: bool) -> Result<Self, SequenceError> {
        Ok(Self { archive: mte_slam_dataset::ZipSource::new(name, pieces, MAX_FILE_BYTES)?, whole })
    }
}

impl Source for ZipSource {
    fn name(&self) -> &str {
        self.archive.name()
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        self.archive.list()
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        self.archive.read(file)
    }

    fn size(&self, file: &str) -> Result<u64, SequenceError> {
        self.archive.size(file)
    }

    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        self.archive.read_range(file, offset, bytes)
    }

    fn notes(&self) -> Vec<String> {
        self.archive.notes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_read_like_the_whole() {
        let data: Vec<u8> = (0..700_000u32).map(|i| (i % 251) as u8).collect();
        let copy = data.clone();
        let fetch = move |first: u64, end: u64| Ok(copy[first as usize..end as usize].to_vec());
        let mut pieces = Pieces::new(data.len() as u64, Box::new(fetch));
        let mut all = Vec::new();
        pieces.read_to_end(&mut all).unwrap();
        assert_eq!(all, data);
        pieces.seek(SeekFrom::End(-3)).unwrap();
        let mut tail = Vec::new();
        pieces.read_to_end(&mut tail).unwrap();
        assert_eq!(tail, data[data.len() - 3..]);
        assert!(pieces.seek(SeekFrom::Current(-700_001)).is_err());
    }

    #[test]
    fn what_is_no_archive_is_said() {
        let pieces = Pieces::new(9, Box::new(|a, b| Ok(vec![7; (b - a) as usize])));
        let error = ZipSource::new("x.zip", pieces, false).err().unwrap().to_string();
        assert!(error.contains("x.zip") && error.contains("expected a zip archive"), "{error}");
    }
}
