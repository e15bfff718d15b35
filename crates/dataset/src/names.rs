//! The names of a source's files: which of them count, and compared without case.
use std::collections::{BTreeMap, BTreeSet};

/// What archives of macOS hold beside the files themselves.
const MAC_FOLDER: &str = "__macosx";

/// All files of a source by name. Cameras write `.JPG`, unpackers `Color/`: names are compared
/// without case (of ASCII letters), and files are read by the names that the source gives them.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// In lower case, and as in the source.
    folded: BTreeMap<String, String>,
    /// As in the source.
    exact: BTreeSet<String>,
    /// Names that differ from one in `folded` by case alone.
    doubles: Vec<String>,
    /// How many files are hidden.
    hidden: usize,
}

impl Names {
    /// Takes the names that count. Hidden files are left out, as every program does: macOS puts
    /// `._000000.jpg` beside `000000.jpg`, which is no image.
    pub fn new(listed: Vec<String>) -> Names {
        let all = listed.len();
        let plain: Vec<String> = listed.into_iter().filter(|n| !is_hidden(n)).collect();
        let hidden = all - plain.len();
        let mut names = Names { exact: plain.into_iter().collect(), hidden, ..Names::default() };
        // Names in lower case come first, so that of two they are the ones that count.
        let by_case = |n: &&String| n.bytes().any(|b| b.is_ascii_uppercase());
        let (upper, lower): (Vec<&String>, Vec<&String>) = names.exact.iter().partition(by_case);
        for name in lower.into_iter().chain(upper) {
            match names.folded.get(&folded(name)) {
                None => drop(names.folded.insert(folded(name), name.clone())),
                Some(_) => names.doubles.push(name.clone()),
            }
        }
        names
    }

    /// Returns all names in lower case, sorted.
    pub fn folded(&self) -> impl Iterator<Item = &str> {
        self.folded.keys().map(String::as_str)
    }

    /// Returns the source's name of a file: of one called exactly so, or else in any case.
    pub fn find(&self, name: &str) -> Option<&str> {
        match self.exact.get(name) {
            Some(exact) => Some(exact),
            None => self.folded.get(&folded(name)).map(String::as_str),
        }
    }

    /// Says which names cannot be told apart from others, or that all are hidden.
    pub fn note(&self) -> Option<String> {
        if self.exact.is_empty() && self.hidden > 0 {
            return Some(format!("{} hidden files do not count", self.hidden));
        }
        let first = self.doubles.first()?;
        let other = self.folded.get(&folded(first))?;
        let n = self.doubles.len();
        let files = if n == 1 { "1 file differs".into() } else { format!("{n} files differ") };
        Some(format!(
            "{files} from another by upper and lower case alone and left out unless a list names \
             it exactly: {first} (beside {other})"
        ))
    }
}

/// Returns a name in lower case. It keeps its length, so that parts of it stay where they are.
pub(super) fn folded(name: &str) -> String {
    name.to_ascii_lowercase()
}

fn is_hidden(name: &str) -> bool {
    name.split('/').any(|part| {
        part != ".." && (part.starts_with('.') || part.eq_ignore_ascii_case(MAC_FOLDER))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(listed: &[&str]) -> Names {
        Names::new(listed.iter().map(|n| (*n).to_string()).collect())
    }

    #[test]
    fn hidden_files_do_not_count() {
        let n = names(&[
            "color/._0.jpg",
            "color/0.jpg",
            "color/.DS_Store",
            ".git/0.png",
            "__MACOSX/color/0.jpg",
            "../cam_params.json",
            "../.cam_params.json",
        ]);
        assert_eq!(n.folded().collect::<Vec<_>>(), ["../cam_params.json", "color/0.jpg"]);
        assert_eq!((n.find("color/._0.jpg"), n.note()), (None, None));
        assert_eq!(names(&[".room/a", ".room/b"]).note().unwrap(), "2 hidden files do not count");
    }

    #[test]
    fn case_is_not_compared_unless_it_is_all_that_differs() {
        let n = names(&["Color/0.JPG", "a.png", "A.png", "A.PNG"]);
        assert_eq!(n.folded().collect::<Vec<_>>(), ["a.png", "color/0.jpg"]);
        assert_eq!(n.find("color/0.jpg"), Some("Color/0.JPG"));
        assert_eq!(n.find("COLOR/0.jpg"), Some("Color/0.JPG"));
        let found = ["a.png", "A.png", "A.PNG", "a.PNG"].map(|name| n.find(name));
        assert_eq!(found, [Some("a.png"), Some("A.png"), Some("A.PNG"), Some("a.png")]);
        let note = n.note().unwrap();
        assert!(note.contains("2 files differ") && note.contains("A.PNG (beside a.png)"), "{note}");
        assert_eq!(names(&["a", "B"]).note(), None);
    }
}
