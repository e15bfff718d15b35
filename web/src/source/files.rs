//! Files that the user gave: dropped, picked, or of a picked folder.
use super::MAX_FILE_BYTES;
use js_sys::{Reflect, Uint8Array};
use mte_slam_types::sequence::{SequenceError, Source, too_short};
use std::collections::BTreeMap;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{Blob, FileReaderSync};

/// Files by their paths below a folder. Only the files that are asked for are read.
pub struct FilesSource {
    name: String,
    files: BTreeMap<String, Blob>,
}

impl FilesSource {
    /// From an array of `{ path, file }`.
    ///
    /// # Errors
    /// Says what of the array is not as it should be.
    pub fn new(name: &str, files: &JsValue) -> Result<Self, SequenceError> {
        let failed =
            |reason: &str| SequenceError::Read { file: name.into(), reason: reason.into() };
        let array: &js_sys::Array =
            files.dyn_ref().ok_or_else(|| failed("expected a list of files"))?;
        let mut found = BTreeMap::new();
        for entry in array.iter() {
            let get = |key: &str| Reflect::get(&entry, &key.into()).ok();
            let path = get("path").and_then(|p| p.as_string());
            let file = get("file").and_then(|f| f.dyn_into::<Blob>().ok());
            match (path, file) {
                (Some(path), Some(file)) => drop(found.insert(path, file)),
                _ => return Err(failed("expected { path, file } in the list of files")),
            }
        }
        Ok(Self { name: name.into(), files: found })
    }
}

impl Source for FilesSource {
    fn name(&self) -> &str {
        &self.name
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        Ok(self.files.keys().cloned().collect())
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        let failed = |reason: String| SequenceError::Read { file: file.into(), reason };
        let blob = self.files.get(file).ok_or_else(|| failed("no such file".into()))?;
        if blob.size() > MAX_FILE_BYTES as f64 {
            let reason = format!("{} bytes, expected at most {MAX_FILE_BYTES}", blob.size());
            return Err(failed(reason));
        }
        read_blob(blob).map_err(failed)
    }

    fn size(&self, file: &str) -> Result<u64, SequenceError> {
        let blob = self.files.get(file).ok_or_else(|| SequenceError::Read {
            file: file.into(),
            reason: "no such file".into(),
        })?;
        Ok(blob.size() as u64)
    }

    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        let failed = |reason: String| SequenceError::Read { file: file.into(), reason };
        let size = self.size(file)?;
        let end = offset.checked_add(bytes as u64).filter(|end| *end <= size);
        let end = end.ok_or_else(|| too_short(file, size, offset, bytes))?;
        let part = self.files[file].slice_with_f64_and_f64(offset as f64, end as f64);
        read_blob(&part.map_err(|e| failed(reason(&e)))?).map_err(failed)
    }
}

/// All bytes of a blob, or the browser's reason.
pub(super) fn read_blob(blob: &Blob) -> Result<Vec<u8>, String> {
    let reader = FileReaderSync::new().map_err(|e| reason(&e))?;
    let buffer = reader.read_as_array_buffer(blob).map_err(|e| reason(&e))?;
    Ok(Uint8Array::new(&buffer).to_vec())
}

/// The message of a JavaScript exception.
pub(crate) fn reason(error: &JsValue) -> String {
    let message = Reflect::get(error, &"message".into()).ok().and_then(|m| m.as_string());
    message.or_else(|| error.as_string()).unwrap_or_else(|| format!("{error:?}"))
}
