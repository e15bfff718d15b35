//! Classes of many names merged into few groups, so that two lists of classes (a network's and a data set's)
//! can be compared.
use crate::{
    classes::{Class, ClassTable, UNLABELLED, class_color},
    frame::{Frame, SequenceInfo},
    pose::Pose,
    sequence::{Sequence, SequenceError},
};
use alloc::{
    collections::{BTreeMap, BTreeSet},
    format,
    string::{String, ToString},
    vec::Vec,
};

/// Which group a class belongs to, by its name. A name that stands nowhere belongs to none: such
/// pixels count as unlabelled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Groups {
    /// Where they come from, for messages.
    name: String,
    group_of: BTreeMap<String, String>,
}

/// The built-in grouping: names of ADE20K, NYU40, Replica, COCO and the built-in scenes.
const INDOOR: &str = include_str!("groups/indoor.json");

impl Groups {
    /// The built-in grouping of indoor classes.
    pub fn indoor() -> Groups {
        // Parsed by a test, too.
        Groups::parse("indoor", INDOOR)
            .unwrap_or(Groups { name: "indoor".into(), group_of: BTreeMap::new() })
    }

    /// Parses `text`, the contents of `file`: `{"armchair": "chair", "stool": "chair"}`.
    ///
    /// # Errors
    /// [`SequenceError::Invalid`] for anything but a JSON object of texts.
    pub fn parse(file: &str, text: &str) -> Result<Groups, SequenceError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let listed: BTreeMap<String, String> =
            serde_json::from_str(text).map_err(|e| SequenceError::Invalid {
                file: file.into(),
                frame: None,
                field: "groups".into(),
                found: e.to_string(),
                expected: r#"a JSON object of class names and groups, {"armchair": "chair"}"#
                    .into(),
            })?;
        let group_of = listed.into_iter().map(|(name, group)| (key(&name), group)).collect();
        Ok(Groups { name: file.into(), group_of })
    }

    /// Where the groups come from.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The group of a class: that of its name, in any case, with `-`, `_` and blanks alike. A list of
    /// names, as ADE20K's ("door;double door"), belongs to the group of the first that has one.
    pub fn group_of(&self, name: &str) -> Option<&str> {
        let mut names = core::iter::once(name).chain(name.split([';', ',']));
        names.find_map(|name| self.group_of.get(&key(name))).map(String::as_str)
    }

    /// Merges a table: the groups that occur in it, whose raw ids are their places among all groups, so that
    /// tables merged alike meet by raw id; and, from the old compact indices, the new ones
    /// ([`UNLABELLED`] where a class has no group).
    pub fn merge(&self, table: &ClassTable) -> (ClassTable, Vec<u8>) {
        let all: BTreeSet<&str> = self.group_of.values().map(String::as_str).collect();
        let places: BTreeMap<&str, u16> =
            all.into_iter().enumerate().map(|(i, group)| (group, i as u16)).collect();
        let found: Vec<Option<&str>> =
            table.classes.iter().map(|class| self.group_of(&class.name)).collect();
        let present: BTreeSet<&str> = found.iter().flatten().copied().collect();
        let classes: Vec<Class> = present
            .iter()
            .map(|&group| {
                let raw_id = places.get(group).copied().unwrap_or_default();
                Class { raw_id, name: group.to_string(), color: class_color(raw_id) }
            })
            .collect();
        let index = |group: &str| present.iter().position(|&g| g == group).map(|i| i as u8);
        let map = found.into_iter().map(|g| g.and_then(index).unwrap_or(UNLABELLED)).collect();
        (ClassTable { classes }, map)
    }
}

fn key(name: &str) -> String {
    let plain = |c: char| if matches!(c, '-' | '_') { ' ' } else { c };
    name.trim().chars().map(plain).flat_map(char::to_lowercase).collect()
}

/// A sequence whose classes are merged.
pub struct Grouped<S> {
    inner: S,
    info: SequenceInfo,
    map: Vec<u8>,
    left_out: Vec<String>,
    groups: String,
}

impl<S: Sequence> Grouped<S> {
    /// Merges the classes of `inner`.
    pub fn new(inner: S, groups: &Groups) -> Grouped<S> {
        let before = &inner.info().classes;
        let (classes, map) = groups.merge(before);
        let left_out = before
            .classes
            .iter()
            .zip(&map)
            .filter(|(_, to)| **to == UNLABELLED)
            .map(|(class, _)| class.name.clone())
            .collect();
        let info = SequenceInfo { classes, ..inner.info().clone() };
        Grouped { inner, info, map, left_out, groups: groups.name.clone() }
    }

    fn merged(&self, labels: Vec<u8>) -> Vec<u8> {
        let to = |c: u8| self.map.get(usize::from(c)).copied().unwrap_or(UNLABELLED);
        labels.into_iter().map(to).collect()
    }
}

impl<S: Sequence> Sequence for Grouped<S> {
    fn info(&self) -> &SequenceInfo {
        &self.info
    }

    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
        let mut frame = self.inner.frame(index)?;
        frame.labels = frame.labels.map(|labels| self.merged(labels));
        Ok(frame)
    }

    fn labels(&mut self, index: usize) -> Result<Option<Vec<u8>>, SequenceError> {
        let labels = self.inner.labels(index)?;
        Ok(labels.map(|labels| self.merged(labels)))
    }

    fn truth(&self, index: usize) -> Option<Pose> {
        self.inner.truth(index)
    }

    fn view_from(&mut self, index: usize, world_from_camera: &Pose) -> Option<Frame> {
        let mut frame = self.inner.view_from(index, world_from_camera)?;
        frame.labels = frame.labels.map(|labels| self.merged(labels));
        Some(frame)
    }

    fn prior(&self, index: usize) -> Option<Pose> {
        self.inner.prior(index)
    }

    fn time_s(&self, index: usize) -> f64 {
        self.inner.time_s(index)
    }

    fn number(&self, index: usize) -> u64 {
        self.inner.number(index)
    }

    fn warnings(&self) -> Vec<String> {
        let mut all = self.inner.warnings();
        if !self.left_out.is_empty() {
            let shown = self.left_out[..self.left_out.len().min(6)].join(", ");
            let n = self.left_out.len();
            all.push(format!(
                "{n} classes have no group in {}, and their labels are left out: {shown}{}",
                self.groups,
                if n > 6 { ", ..." } else { "" }
            ));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(names: &[&str]) -> ClassTable {
        let class = |(i, name): (usize, &&str)| Class {
            raw_id: 10 * i as u16,
            name: (*name).to_string(),
            color: [0; 3],
        };
        ClassTable { classes: names.iter().enumerate().map(class).collect() }
    }

    #[test]
    fn tables_that_are_merged_alike_meet_by_raw_id() {
        let text =
            r#"{"armchair": "chair", "Stool": "chair", "wall": "wall", "tv-screen": "screen"}"#;
        let groups = Groups::parse("g", text).unwrap();
        let (a, map) = groups.merge(&table(&["wall", "stool", "cloud", "armchair"]));
        assert_eq!(map, [1, 0, UNLABELLED, 0]);
        let (b, map) = groups.merge(&table(&["screen;TV_screen", "WALL"]));
        assert_eq!(map, [0, 1]);
        let id = |t: &ClassTable, name: &str| {
            t.classes.iter().find(|c| c.name == name).map(|c| c.raw_id).unwrap()
        };
        assert_eq!(id(&a, "wall"), id(&b, "wall"));
        assert_ne!(id(&a, "chair"), id(&b, "screen"));
        for text in ["[]", "{", r#"{"a": 1}"#] {
            let error = Groups::parse("g.json", text).unwrap_err().to_string();
            assert!(error.contains("g.json") && error.contains("groups"), "{error}");
        }
    }

    #[test]
    fn the_built_in_grouping_knows_the_usual_lists() {
        let groups = Groups::indoor();
        for (a, b) in [
            ("armchair", "chair"),
            ("windowpane", "window"),
            ("wall-cabinet", "cabinet"),
            ("coffee table", "desk"),
            ("carpet", "rug"),
        ] {
            assert!(groups.group_of(a).is_some(), "{a}");
            assert_eq!(groups.group_of(a), groups.group_of(b), "{a}, {b}");
        }
        assert_eq!(groups.group_of("sky"), None);
        let kinds: BTreeSet<&str> = groups.group_of.values().map(String::as_str).collect();
        assert!((15..60).contains(&kinds.len()), "{kinds:?}");
    }
}
