//! A [`Source`] that holds its files in memory.
use mte_slam_types::sequence::{SequenceError, Source, too_short};
use std::collections::BTreeMap;

/// Files by name, for tests, for unpacked archives and for files dropped on a page.
#[derive(Clone, Debug, Default)]
pub struct MemorySource {
    name: String,
    files: BTreeMap<String, Vec<u8>>,
}

impl MemorySource {
    /// Returns an empty source with a name for messages.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), files: BTreeMap::new() }
    }

    /// Adds or replaces a file; the name is `/`-separated.
    pub fn insert(&mut self, file: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        self.files.insert(file.into(), bytes.into());
    }

    /// Takes a file out.
    pub fn remove(&mut self, file: &str) -> Option<Vec<u8>> {
        self.files.remove(file)
    }

    /// Returns the bytes of a file.
    pub fn get(&self, file: &str) -> Option<&[u8]> {
        self.files.get(file).map(Vec::as_slice)
    }

    /// Returns the names, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }
}

impl Source for MemorySource {
    fn name(&self) -> &str {
        &self.name
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        Ok(self.files.keys().cloned().collect())
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        self.files.get(file).cloned().ok_or_else(|| SequenceError::Read {
            file: file.into(),
            reason: format!("no such file in {}", self.name),
        })
    }

    fn size(&self, file: &str) -> Result<u64, SequenceError> {
        match self.files.get(file) {
            Some(bytes) => Ok(bytes.len() as u64),
            None => self.read(file).map(|b| b.len() as u64),
        }
    }

    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        let Some(whole) = self.files.get(file) else { return self.read(file) };
        let first = usize::try_from(offset).ok();
        first
            .and_then(|first| whole.get(first..first.checked_add(bytes)?))
            .map(<[u8]>::to_vec)
            .ok_or_else(|| too_short(file, whole.len() as u64, offset, bytes))
    }
}
