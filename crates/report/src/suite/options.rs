//! Options of a run that hold paths.
use std::path::Path;
use toml::{Table, Value};

/// Keys whose values are files or folders, and the words that may stand there instead.
const PATHS: [(&str, &[&str]); 5] = [
    ("mesh", &[]),
    ("labels", &["none", "dataset"]),
    ("truth_labels", &["none", "dataset"]),
    ("features", &[]),
    ("classes", &["nyu40", "replica"]),
];

/// The path that an option holds, if it is one that holds a path.
pub fn path_of<'a>(key: &str, value: &'a Value) -> Option<&'a Path> {
    let (_, words) = PATHS.iter().find(|(name, _)| *name == key)?;
    let text = value.as_str()?;
    (!words.contains(&text)).then_some(Path::new(text))
}

/// Relative paths among the options start from `folder` from now on.
pub fn resolve_paths(options: &mut Table, folder: &Path) {
    for (key, value) in options.iter_mut() {
        if let Some(path) = path_of(key, value) {
            *value = Value::String(folder.join(path).display().to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_start_from_the_folder_given() {
        let mut options =
            options_of("mesh = 'a/b.ply'\nlabels = 'none'\nfeatures = '/abs'\nframes = 1");
        resolve_paths(&mut options, Path::new("/root"));
        assert_eq!(options["mesh"].as_str(), Some("/root/a/b.ply"));
        assert_eq!(
            (options["labels"].as_str(), options["features"].as_str()),
            (Some("none"), Some("/abs"))
        );
    }

    fn options_of(text: &str) -> Table {
        text.parse().unwrap()
    }
}
