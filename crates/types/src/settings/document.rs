//! What settings mean, in words. Only documents ask for it, through a trait of their own, so that
//! a program without documents, such as a browser's module, does not carry the texts.
use alloc::{
    collections::BTreeMap,
    format,
    string::{String, ToString},
    vec::Vec,
};

/// A type whose settings have texts.
pub trait Documented {
    /// Adds the texts of what lies below `path`.
    fn document(path: &str, list: &mut Documentation);
}

macro_rules! without_text {
    ($($type:ty),+) => {$(
        impl Documented for $type {
            fn document(_: &str, _: &mut Documentation) {}
        }
    )+};
}
without_text!(bool, u32, f64);

impl<const N: usize> Documented for [u32; N] {
    fn document(_: &str, _: &mut Documentation) {}
}

/// The texts of the settings of a section.
#[derive(Clone, Debug, Default)]
pub struct Documentation {
    sections: BTreeMap<String, String>,
    settings: BTreeMap<String, String>,
    choices: BTreeMap<String, Vec<(String, String)>>,
}

/// The texts of a section and all below it.
pub fn documentation<S: Documented>() -> Documentation {
    let mut list = Documentation::default();
    S::document("", &mut list);
    list
}

fn text(lines: &[&str]) -> String {
    let lines: Vec<&str> = lines.iter().map(|line| line.trim()).collect();
    lines.join(" ").trim().replace("\\[", "[").replace("\\]", "]")
}

impl Documentation {
    /// Adds a section's text.
    pub fn section(&mut self, path: &str, lines: &[&str]) {
        self.sections.insert(path.to_string(), text(lines));
    }

    /// Adds a setting's text and returns its path.
    pub fn setting(&mut self, section: &str, name: &str, lines: &[&str]) -> String {
        let path = if section.is_empty() { name.to_string() } else { format!("{section}.{name}") };
        self.settings.insert(path.clone(), text(lines));
        path
    }

    /// Adds the text of a choice of the setting at `path`.
    pub fn choice(&mut self, path: &str, name: &str, lines: &[&str]) {
        self.choices.entry(path.to_string()).or_default().push((name.to_string(), text(lines)));
    }

    /// What the section at `path` is about; the empty path is the whole.
    pub fn of_section(&self, path: &str) -> Option<&str> {
        self.sections.get(path).map(String::as_str)
    }

    /// What the setting at `path` means.
    pub fn of_setting(&self, path: &str) -> Option<&str> {
        self.settings.get(path).map(String::as_str)
    }

    /// Names and texts of the choices of the setting at `path`, in the order of declaration.
    pub fn of_choices(&self, path: &str) -> &[(String, String)] {
        self.choices.get(path).map_or(&[], Vec::as_slice)
    }
}
