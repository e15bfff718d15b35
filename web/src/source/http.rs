//! A folder on a server that says what is in it: by `files.json` (a list of names) or by the
//! listing pages that most servers make.
use super::{MAX_FILE_BYTES, files::reason, last_part, listing};
use js_sys::Uint8Array;
use mte_slam_types::sequence::{SequenceError, Source, too_short};
use std::collections::BTreeSet;
use wasm_bindgen::JsValue;
use web_sys::{XmlHttpRequest, XmlHttpRequestResponseType};

/// A recording has few folders; a server's root may have any number.
const MAX_FOLDERS: usize = 64;
/// More files than any recording has.
const MAX_FILES: usize = 500_000;

/// See the module.
pub struct HttpSource {
    name: String,
    /// With a final `/`.
    base: String,
    files: Vec<String>,
}

/// A server's answer.
pub(super) struct Answer {
    pub status: u16,
    pub body: Vec<u8>,
    pub request: XmlHttpRequest,
}

impl Answer {
    /// The length of the whole, from the answer to a range: `Content-Range: bytes 0-0/1234`.
    pub fn whole_length(&self) -> Option<u64> {
        let range = self.request.get_response_header("Content-Range").ok().flatten()?;
        range.rsplit('/').next()?.parse().ok()
    }
}

/// Asks and waits; `range` is in bytes, the last one included.
pub(super) fn ask(method: &str, url: &str, range: Option<(u64, u64)>) -> Result<Answer, String> {
    let failed = |e: JsValue| reason(&e);
    let request = XmlHttpRequest::new().map_err(failed)?;
    request.open_with_async(method, url, false).map_err(failed)?;
    request.set_response_type(XmlHttpRequestResponseType::Arraybuffer);
    if let Some((first, last)) = range {
        request.set_request_header("Range", &format!("bytes={first}-{last}")).map_err(failed)?;
    }
    request.send().map_err(|e| format!("the server does not answer ({})", reason(&e)))?;
    let status = request.status().map_err(failed)?;
    let response = request.response().map_err(failed)?;
    let body = if response.is_null() || response.is_undefined() {
        Vec::new()
    } else {
        let bytes = Uint8Array::new(&response);
        if u64::from(bytes.length()) > MAX_FILE_BYTES {
            return Err(format!("{} bytes, expected at most {MAX_FILE_BYTES}", bytes.length()));
        }
        bytes.to_vec()
    };
    Ok(Answer { status, body, request })
}

impl HttpSource {
    /// Lists the folder.
    ///
    /// # Errors
    /// The server does not answer, or does not list its files.
    pub fn open(url: &str) -> Result<Self, SequenceError> {
        let failed = |file: &str, reason: String| SequenceError::Read { file: file.into(), reason };
        let base =
            format!("{}/", url.split(['?', '#']).next().unwrap_or(url).trim_end_matches('/'));
        let mut source = Self { name: last_part(url), base, files: Vec::new() };
        let index = format!("{}files.json", source.base);
        let answer = ask("GET", &index, None).map_err(|e| failed(&index, e))?;
        if answer.status == 200
            && let Ok(names) = serde_json::from_slice::<Vec<String>>(&answer.body)
        {
            source.files = names.into_iter().filter(|n| listing::is_inside(n)).collect();
            return Ok(source);
        }
        let mut waiting = vec![String::new()];
        let mut known = BTreeSet::new();
        while let Some(folder) = waiting.pop() {
            let url = format!("{}{}", source.base, listing::encoded(&folder));
            let answer = ask("GET", &url, None).map_err(|e| failed(&url, e))?;
            if answer.status != 200 {
                let reason =
                    format!("the server answers {}, expected a folder's listing", answer.status);
                return Err(failed(&url, reason));
            }
            for name in listing::names(&String::from_utf8_lossy(&answer.body)) {
                let below = format!("{folder}{name}");
                if name.ends_with('/') {
                    if known.insert(below.clone()) {
                        waiting.push(below);
                    }
                } else {
                    source.files.push(below);
                }
            }
            if known.len() > MAX_FOLDERS || source.files.len() > MAX_FILES {
                let reason = format!(
                    "more than {MAX_FOLDERS} folders or {MAX_FILES} files: not a recording's folder"
                );
                return Err(failed(&source.base, reason));
            }
        }
        if source.files.is_empty() {
            let reason = "neither files.json nor links to files are there".into();
            return Err(failed(&source.base, reason));
        }
        source.files.sort_unstable();
        source.files.dedup();
        Ok(source)
    }
}

impl Source for HttpSource {
    fn name(&self) -> &str {
        &self.name
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        Ok(self.files.clone())
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        let failed = |reason: String| SequenceError::Read { file: file.into(), reason };
        let url = format!("{}{}", self.base, listing::encoded(file));
        let answer = ask("GET", &url, None).map_err(failed)?;
        match answer.status {
            200 => Ok(answer.body),
            status => Err(failed(format!("the server answers {status}, expected 200"))),
        }
    }

    fn size(&self, file: &str) -> Result<u64, SequenceError> {
        let answer = self.range(file, 0, 0)?;
        answer.whole_length().ok_or_else(|| SequenceError::Read {
            file: file.into(),
            reason: "the server sends ranges but hides the length (Content-Range)".into(),
        })
    }

    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let answer = self.range(file, offset, offset.saturating_add(bytes as u64 - 1))?;
        if answer.body.len() != bytes {
            return Err(too_short(file, offset + answer.body.len() as u64, offset, bytes));
        }
        Ok(answer.body)
    }
}

impl HttpSource {
    /// Bytes `first..=last`. Without ranges each part would cost the whole file, so that is an
    /// error.
    fn range(&self, file: &str, first: u64, last: u64) -> Result<Answer, SequenceError> {
        let failed = |reason: String| SequenceError::Read { file: file.into(), reason };
        let url = format!("{}{}", self.base, listing::encoded(file));
        let answer = ask("GET", &url, Some((first, last))).map_err(failed)?;
        match answer.status {
            206 => Ok(answer),
            200 => Err(failed("the server sends no ranges, which so large a file needs".into())),
            status => Err(failed(format!("the server answers {status}, expected 206"))),
        }
    }
}
