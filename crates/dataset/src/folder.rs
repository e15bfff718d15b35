//! The files of a recording by name and by number, and the plain text among them.
use super::names::Names;
use mte_slam_types::sequence::{SequenceError, Source};
use std::collections::{BTreeMap, BTreeSet};

/// Shorthand for [`SequenceError::Invalid`].
pub(super) fn invalid(
    file: &str,
    frame: Option<u64>,
    field: impl Into<String>,
    found: impl Into<String>,
    expected: impl Into<String>,
) -> SequenceError {
    SequenceError::Invalid {
        file: file.into(),
        frame,
        field: field.into(),
        found: found.into(),
        expected: expected.into(),
    }
}

/// More text than any recording has: a million poses of 16 numbers \[bytes\].
const MAX_TEXT_BYTES: usize = 400 << 20;

/// Endings of colour images.
pub(super) const COLOR_ENDS: [&str; 3] = [".jpg", ".png", ".jpeg"];

/// Files beside scenes that belong to all of them.
const SHARED: [&str; 5] = [
    "cam_params.json",
    "intrinsics.json",
    "camera-intrinsics.txt",
    "camera.txt",
    "scannetv2-labels.combined.tsv",
];

/// A source with its list of names, seen from the folder in which the recording lies. Names are
/// compared without case: those that it lists are in lower case, and others find theirs, too.
pub(super) struct Folder {
    source: Box<dyn Source>,
    /// Empty, or the folder of the recording inside the source, with a final `/`, as the source
    /// writes it.
    prefix: String,
    all: Names,
    /// Names below `prefix`, without it, in lower case.
    names: BTreeSet<String>,
}

impl Folder {
    /// Lists the source once.
    pub fn new(source: Box<dyn Source>) -> Result<Self, SequenceError> {
        let all = Names::new(source.list()?);
        let names = all.folded().filter(|n| !n.starts_with("../")).map(String::from).collect();
        Ok(Self { source, prefix: String::new(), all, names })
    }

    /// Returns what people should know of the files, one sentence each.
    pub fn notes(&self) -> Vec<String> {
        self.source.notes().into_iter().chain(self.all.note()).collect()
    }

    /// When every file lies in one sub-folder (an unpacked archive often looks so), but for those
    /// that scenes share, go there. Returns whether it did.
    pub fn descend(&mut self) -> bool {
        let own = || self.names.iter().filter(|n| !SHARED.contains(&n.as_str()));
        let Some((first, (top, _))) = own().next().and_then(|n| Some((n, n.split_once('/')?)))
        else {
            return false;
        };
        let top = format!("{top}/");
        if !own().all(|n| n.starts_with(&top)) {
            return false;
        }
        let longer = self.prefix.len() + top.len();
        let shown = self.all.find(&format!("{}{first}", self.prefix)).map(|n| n[..longer].into());
        self.prefix = shown.unwrap_or_else(|| format!("{}{top}", self.prefix));
        self.names =
            self.names.iter().filter_map(|n| n.strip_prefix(&top)).map(String::from).collect();
        true
    }

    /// Returns the folder's name for messages.
    pub fn name(&self) -> String {
        match self.prefix.strip_suffix('/') {
            Some(inner) => format!("{}/{inner}", self.source.name()),
            None => self.source.name().into(),
        }
    }

    /// Returns the names of the files, sorted, in lower case, relative to the recording's folder.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Returns whether there is such a file, in any case.
    pub fn has(&self, name: &str) -> bool {
        self.real(name).is_some()
    }

    /// Returns a file's name as it is really written, relative to the recording's folder.
    pub fn real(&self, name: &str) -> Option<&str> {
        // What lies above is found by `here_or_above` alone, whatever a list may ask for.
        let inside = name.split('/').all(|part| !matches!(part, "" | "." | ".."));
        let found = self.all.find(&format!("{}{name}", self.prefix)).filter(|_| inside)?;
        found.get(self.prefix.len()..)
    }

    /// `name` here, or one or two folders up where the source lets us see it.
    pub fn here_or_above(&self, name: &str) -> Option<String> {
        if self.has(name) {
            return Some(name.into());
        }
        // Folders of the recording inside the source, the innermost first; then those outside.
        let mut inside: Vec<&str> = self.prefix.split_terminator('/').collect();
        let mut outside = String::new();
        for _ in 0..2 {
            if inside.pop().is_none() {
                outside += "../";
            }
            let folder: String = inside.iter().map(|part| format!("{part}/")).collect();
            let above = format!("{outside}{folder}{name}");
            if let Some(above) = self.all.find(&above) {
                // The '/' in front marks a name relative to the source, not to the recording.
                return Some(format!("/{above}"));
            }
        }
        None
    }

    /// Returns the name that the source knows a file by.
    fn in_source(&self, name: &str) -> Result<String, SequenceError> {
        match (name.strip_prefix('/'), self.real(name)) {
            (Some(of_source), _) => Ok(of_source.into()),
            (None, Some(real)) => Ok(format!("{}{real}", self.prefix)),
            (None, None) => Err(SequenceError::Read {
                file: name.into(),
                reason: format!("no such file in {}", self.name()),
            }),
        }
    }

    /// Returns the bytes of a file.
    pub fn read(&self, name: &str) -> Result<Vec<u8>, SequenceError> {
        self.source.read(&self.in_source(name)?)
    }

    /// Returns the length of a file \[bytes\].
    pub fn size(&self, name: &str) -> Result<u64, SequenceError> {
        self.source.size(&self.in_source(name)?)
    }

    /// Some of the bytes of a file.
    pub fn read_range(
        &self,
        name: &str,
        offset: u64,
        bytes: usize,
    ) -> Result<Vec<u8>, SequenceError> {
        self.source.read_range(&self.in_source(name)?, offset, bytes)
    }

    /// Reads a text file, without a byte order mark.
    pub fn text(&self, name: &str) -> Result<String, SequenceError> {
        let bytes = self.read(name)?;
        if bytes.len() > MAX_TEXT_BYTES {
            let (found, limit) = (format!("{} bytes", bytes.len()), MAX_TEXT_BYTES);
            return Err(invalid(name, None, "text", found, format!("at most {limit} bytes")));
        }
        let text = String::from_utf8(bytes).map_err(|e| {
            let at = e.utf8_error().valid_up_to();
            invalid(name, None, "text", format!("no UTF-8 at byte {at}"), "UTF-8 text")
        })?;
        Ok(match text.strip_prefix('\u{feff}') {
            Some(rest) => rest.into(),
            None => text,
        })
    }

    /// Reads a JSON file. Numbers that are none, which Python writes as `NaN` and `Infinity`, become
    /// texts: what needs a number there says so.
    pub fn json(&self, name: &str) -> Result<serde_json::Value, SequenceError> {
        let text = self.text(name)?;
        let parsed = serde_json::from_str(&text);
        parsed.or_else(|_| serde_json::from_str(&with_quoted_words(&text))).map_err(|e| {
            let found = e.to_string();
            invalid(name.trim_start_matches('/'), None, "JSON", found, "a JSON document")
        })
    }

    /// Returns all files `START number END` for one of the ends, by number. Digits may or may not be
    /// zero-padded; two files with one number are an error.
    pub fn numbered(
        &self,
        start: &str,
        ends: &[&str],
    ) -> Result<BTreeMap<u64, String>, SequenceError> {
        let mut found = BTreeMap::new();
        for name in self.names.iter().filter(|n| n.starts_with(start)) {
            let Some(number) = ends.iter().find_map(|end| number_between(name, start, end)) else {
                continue;
            };
            if let Some(other) = found.insert(number, name.clone()) {
                return Err(invalid(
                    name,
                    Some(number),
                    "frame number",
                    format!("also in {other}"),
                    "one file for each number",
                ));
            }
        }
        Ok(found)
    }

    /// How many files match, for messages.
    pub fn count(&self, start: &str, ends: &[&str]) -> usize {
        self.names
            .iter()
            .filter(|n| ends.iter().any(|e| number_between(n, start, e).is_some()))
            .count()
    }
}

/// Returns the number in `START digits END`.
pub(super) fn number_between(name: &str, start: &str, end: &str) -> Option<u64> {
    let digits = name.strip_prefix(start)?.strip_suffix(end)?;
    digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().ok()).flatten()
}

/// Puts `NaN`, `Infinity` and `-Infinity` into quotes where they stand outside of texts.
fn with_quoted_words(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(['"', 'N', 'I', '-']) {
        out += &rest[..at];
        rest = &rest[at..];
        let end = if let Some(inside) = rest.strip_prefix('"') {
            // To the end of the text; what is escaped does not end it.
            let mut escaped = false;
            let ends = |c: char| {
                let end = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                end
            };
            inside.find(ends).map_or(rest.len(), |n| n + 2)
        } else {
            let word = ["NaN", "Infinity", "-Infinity"].iter().find(|w| rest.starts_with(**w));
            if let Some(word) = word {
                out += &format!("\"{word}\"");
                rest = &rest[word.len()..];
                continue;
            }
            1
        };
        out += &rest[..end];
        rest = &rest[end..];
    }
    out + rest
}

/// Returns all numbers of a text, separated by white space.
pub(super) fn parse_numbers(
    file: &str,
    frame: Option<u64>,
    text: &str,
) -> Result<Vec<f64>, SequenceError> {
    text.split_whitespace()
        .map(|word| {
            word.parse()
                .map_err(|_| invalid(file, frame, "number", shortened(word), "a decimal number"))
        })
        .collect()
}

/// Returns a quoted word, cut to a length that fits a message.
pub(super) fn shortened(word: &str) -> String {
    let short: String = word.chars().take(40).collect();
    format!("{short:?}{}", if short.len() < word.len() { "..." } else { "" })
}

/// Returns the last part of a path.
pub(super) fn base(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// Returns all numbers in a name; digits beyond what a u64 holds are cut off.
pub(super) fn numbers(name: &str) -> Vec<u64> {
    let runs = name.split(|c: char| !c.is_ascii_digit()).filter(|r| !r.is_empty());
    runs.map(|r| r.parse().unwrap_or(u64::MAX)).collect()
}

/// Returns the last number in a file's name.
pub(super) fn last_number(name: &str) -> Option<u64> {
    let stem = base(name);
    numbers(stem.rsplit_once('.').map_or(stem, |(s, _)| s)).last().copied()
}

/// `n thing` or `n things`.
pub(super) fn plural(n: usize, thing: &str) -> String {
    format!("{n} {thing}{}", if n == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MemorySource;

    fn folder(names: &[&str]) -> Folder {
        let mut m = MemorySource::new("m");
        for n in names {
            m.insert(*n, *n);
        }
        Folder::new(Box::new(m)).unwrap()
    }

    #[test]
    fn numbers_sort_as_numbers_and_other_files_are_not_taken() {
        let f = folder(&["a_10.png", "a_9.png", "a_.png", "a_1x.png", "a_+3.png", "vis_a_2.png"]);
        let got: Vec<_> = f.numbered("a_", &[".png"]).unwrap().into_iter().collect();
        assert_eq!(got, [(9, "a_9.png".into()), (10, "a_10.png".into())]);
        assert!(folder(&["a1.png", "a01.png"]).numbered("a", &[".png"]).is_err());
    }

    #[test]
    fn numbers_that_are_none_are_texts_in_json() {
        let json = |text: &str| {
            let mut m = MemorySource::new("m");
            m.insert("a.json", text);
            Folder::new(Box::new(m)).unwrap().json("a.json")
        };
        let text =
            r#"{"NaN": [NaN, -Infinity, Infinity, -1, 2], "a\\": "\"NaN, -Infinity", "I": 1}"#;
        let got = json(text).unwrap();
        assert_eq!(got["NaN"], serde_json::json!(["NaN", "-Infinity", "Infinity", -1, 2]));
        assert_eq!((got["a\\"].as_str(), got["I"].as_i64()), (Some("\"NaN, -Infinity"), Some(1)));
        for bad in ["{\"a", "{\"a\": Nan}", "[-]", "[NaN", "\"\\"] {
            assert!(json(bad).unwrap_err().to_string().contains("a.json: JSON"), "{bad}");
        }
    }

    #[test]
    fn one_common_folder_is_entered_and_the_one_above_is_seen() {
        let mut f = folder(&["x/y/a.txt", "x/y/b/c.txt"]);
        assert!(f.descend() && f.descend() && !f.descend());
        assert_eq!(f.names().collect::<Vec<_>>(), ["a.txt", "b/c.txt"]);
        assert_eq!(f.read("a.txt").unwrap(), b"x/y/a.txt");
        assert_eq!(f.name(), "m/x/y");

        assert_eq!(f.here_or_above("cam.json"), None);
        for above in ["x/cam.json", "cam.json"] {
            let mut f = folder(&["x/y/a.txt", above]);
            f.prefix = "x/y/".into();
            f.names.remove(above);
            let found = f.here_or_above("cam.json").unwrap();
            assert_eq!(f.text(&found).unwrap(), above);
        }

        let f = folder(&["../cam.json", "../../table.tsv", "a"]);
        for name in ["cam.json", "table.tsv"] {
            let above = f.here_or_above(name).unwrap();
            assert!(f.text(&above).unwrap().ends_with(name));
        }
        assert_eq!(f.names().collect::<Vec<_>>(), ["a"]);
        assert!(f.read("../cam.json").is_err() && f.read("../../etc/passwd").is_err());
    }
}
