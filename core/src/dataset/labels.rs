//! Label images: which file belongs to which frame, which classes there are, raw ids to indices.
use super::{
    decode::{self, Origin, Size},
    entries::Entry,
    folder::{Folder, invalid, number_between, plural, shortened},
};
use crate::{
    classes::{Class, ClassTable, UNLABELLED},
    sequence::SequenceError,
};
use std::collections::{BTreeMap, BTreeSet};

const CLASSES_FILE: &str = "classes.json";
/// The raw id without meaning when the class list names none.
const DEFAULT_VOID: u16 = 255;
/// In the look-up table: an id that is not in the class list.
const UNKNOWN: u16 = 256;

/// The label images of a recording.
pub(super) struct Labels {
    /// Where they lie, when not beside the frames.
    own: Option<Folder>,
    pub table: ClassTable,
    /// Raw id -> compact index, [`UNLABELLED`] or [`UNKNOWN`].
    index: Vec<u16>,
    /// Pixels met with ids that are not in the class list, by id.
    unknown: BTreeMap<u16, u64>,
}

/// What the caller wants of the class list.
pub(super) struct Wanted {
    pub void: Option<u16>,
    pub only_present: bool,
}

impl Labels {
    /// Finds the label images of `frames`, beside them or in a folder of their own, and builds
    /// the class table. `None` when there are none beside the frames.
    pub fn open(
        recording: &Folder,
        mut own: Option<Folder>,
        frames: &mut [Entry],
        size: Size,
        wanted: Wanted,
    ) -> Result<Option<Self>, SequenceError> {
        match &mut own {
            None => {
                if assign(recording, "semantic_class/", frames)? == 0 {
                    return Ok(None);
                }
            }
            Some(folder) => {
                let name = folder.name();
                while assign(folder, "", frames)? == 0 {
                    if !folder.descend() {
                        let files = plural(folder.names().count(), "file");
                        let expected = "PNGs named like the frames or by their numbers";
                        return Err(invalid(&name, None, "label images", files, expected));
                    }
                }
            }
        }
        let listed = match &own {
            Some(folder) if folder.has(CLASSES_FILE) => Some(folder),
            _ => recording.has(CLASSES_FILE).then_some(recording),
        };
        let (mut classes, void) = match listed {
            Some(folder) => class_list(folder, wanted.void)?,
            None => (Vec::new(), wanted.void.or(Some(DEFAULT_VOID))),
        };
        if listed.is_none() || wanted.only_present {
            let present = scan(own.as_ref().unwrap_or(recording), frames, size)?;
            if listed.is_some() {
                classes.retain(|c| present.contains(&c.raw_id));
            } else {
                let named = present.iter().filter(|id| Some(**id) != void);
                classes = named.map(|&id| unnamed_class(id)).collect();
            }
        }
        if classes.len() > usize::from(UNLABELLED) {
            let file = if listed.is_some() { CLASSES_FILE } else { "the label images" };
            let found = classes.len().to_string();
            let expected = format!("at most {UNLABELLED}, the void class not counted");
            return Err(invalid(file, None, "number of classes", found, expected));
        }
        let mut index = vec![UNKNOWN; 1 << 16];
        for (i, class) in classes.iter().enumerate() {
            index[usize::from(class.raw_id)] = i as u16;
        }
        if let Some(void) = void {
            index[usize::from(void)] = UNLABELLED.into();
        }
        let table = ClassTable { classes };
        Ok(Some(Labels { own, table, index, unknown: BTreeMap::new() }))
    }

    /// The compact indices of one frame, in the label image's own size.
    pub fn read(
        &mut self,
        recording: &Folder,
        file: &str,
        frame: u64,
        size: Size,
    ) -> Result<Vec<u8>, SequenceError> {
        let raw = decode(self.own.as_ref().unwrap_or(recording), file, frame, size)?;
        let mut out = Vec::with_capacity(raw.len());
        for id in raw {
            out.push(match self.index[usize::from(id)] {
                UNKNOWN => {
                    *self.unknown.entry(id).or_default() += 1;
                    UNLABELLED
                }
                index => index as u8,
            });
        }
        Ok(out)
    }

    /// One sentence about unknown ids, if there were any.
    pub fn warning(&self) -> Option<String> {
        let pixels: u64 = self.unknown.values().sum();
        let ids: Vec<String> = self.unknown.keys().take(8).map(u16::to_string).collect();
        let more = if self.unknown.len() > 8 { ", ..." } else { "" };
        (pixels > 0).then(|| {
            let ids = ids.join(", ");
            format!("{pixels} label pixels taken as unlabelled: not in the class list: {ids}{more}")
        })
    }
}

fn decode(folder: &Folder, file: &str, frame: u64, size: Size) -> Result<Vec<u16>, SequenceError> {
    let origin = Origin { file, frame, what: "label image" };
    decode::labels(&folder.read(file)?, origin, Some(size))
}

/// All raw ids of all label images.
fn scan(folder: &Folder, frames: &[Entry], size: Size) -> Result<BTreeSet<u16>, SequenceError> {
    let mut present = vec![false; 1 << 16];
    for frame in frames {
        let Some(file) = &frame.label else { continue };
        for id in decode(folder, file, frame.number, size)? {
            present[usize::from(id)] = true;
        }
    }
    Ok((0..=u16::MAX).filter(|&id| present[usize::from(id)]).collect())
}

/// `{"7": {"name": "bed", "color": [86, 117, 191]}}` (colour optional): the classes by id, and
/// the id that means "no label".
fn class_list(
    folder: &Folder,
    wanted_void: Option<u16>,
) -> Result<(Vec<Class>, Option<u16>), SequenceError> {
    let error = |field: String, found: String, expected: &str| {
        invalid(CLASSES_FILE, None, field, found, expected)
    };
    let json = folder.json(CLASSES_FILE)?;
    let listed = json.as_object().ok_or_else(|| {
        error("classes".into(), "no object".into(), r#"{"id": {"name": .., "color": ..}}"#)
    })?;
    let mut classes = BTreeMap::new();
    for (key, value) in listed {
        let id: u16 = key.parse().map_err(|_| {
            error("class id".into(), shortened(key), "a whole number from 0 to 65535")
        })?;
        let name = value.get("name").and_then(|n| n.as_str()).ok_or_else(|| {
            error(format!("class {id}: name"), shortened(&value.to_string()), "a text")
        })?;
        let color = match value.get("color") {
            None => class_color(id),
            Some(color) => serde_json::from_value(color.clone()).map_err(|_| {
                let found = shortened(&color.to_string());
                error(format!("class {id}: color"), found, "three numbers from 0 to 255")
            })?,
        };
        if classes.insert(id, Class { raw_id: id, name: name.into(), color }).is_some() {
            return Err(error("class id".into(), format!("{id} twice"), "each id once"));
        }
    }
    let is_void = |c: &&Class| {
        let name = c.name.to_lowercase();
        ["void", "unlabelled", "unlabeled"].contains(&name.as_str())
    };
    let void = wanted_void
        .or_else(|| classes.values().find(is_void).map(|c| c.raw_id))
        .or_else(|| (!classes.contains_key(&DEFAULT_VOID)).then_some(DEFAULT_VOID));
    if let Some(void) = void {
        classes.remove(&void);
    }
    Ok((classes.into_values().collect(), void))
}

fn unnamed_class(id: u16) -> Class {
    Class { raw_id: id, name: format!("class {id}"), color: class_color(id) }
}

/// A colour for a class without one: hues a golden ratio apart, in three brightnesses.
pub fn class_color(id: u16) -> [u8; 3] {
    let hue = f64::from(id) * 0.618_033_988_749_895 % 1.0 * 6.0;
    let value = [240.0, 200.0, 160.0][usize::from(id % 3)];
    let channel = |shift: f64| {
        let k = (shift + hue) % 6.0;
        let fall = k.min(4.0 - k).clamp(0.0, 1.0);
        (value * (1.0 - 0.7 * fall)) as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

/// Label files for frames: by the stem of the colour or depth file's name, else by number.
/// Returns how many frames found theirs.
fn assign(folder: &Folder, below: &str, frames: &mut [Entry]) -> Result<usize, SequenceError> {
    let mut by_stem: BTreeMap<&str, &str> = BTreeMap::new();
    let mut families: BTreeMap<&str, BTreeMap<u64, &str>> = BTreeMap::new();
    for name in folder.names() {
        let Some(base) = name.strip_prefix(below).filter(|b| b.ends_with(".png")) else { continue };
        // Deeper folders are not meant; vis_* are coloured pictures of labels, not labels.
        if base.contains('/') || base.starts_with("vis_") {
            continue;
        }
        let stem = stem(base);
        let start = stem.trim_end_matches(|c: char| c.is_ascii_digit());
        if let Some(number) = number_between(stem, start, "") {
            families.entry(start).or_default().insert(number, name);
        }
        by_stem.insert(stem, name);
    }
    let mut found = 0;
    for frame in frames.iter_mut() {
        let same = by_stem.get(stem(&frame.color)).or_else(|| by_stem.get(stem(&frame.depth)));
        frame.label = same.map(|n| (*n).into());
        found += usize::from(same.is_some());
    }
    if found > 0 || families.is_empty() {
        return Ok(found);
    }
    let only = if families.len() == 1 { families.values().next() } else { None };
    let Some(family) = families.get("semantic_class_").or(only) else {
        let names: Vec<String> =
            families.keys().take(4).map(|f| format!("{f}<number>.png")).collect();
        return Err(invalid(
            &format!("{}/{below}", folder.name()),
            None,
            "label images",
            names.join(", "),
            "one kind of file name, or semantic_class_<number>.png",
        ));
    };
    for frame in frames.iter_mut() {
        frame.label = family.get(&frame.number).map(|n| (*n).into());
        found += usize::from(frame.label.is_some());
    }
    Ok(found)
}

/// A file's name without folder, extension and one trailing word: `a/frame-01.color.png` and
/// `frame-01.label.png` both give `frame-01`; a time stamp keeps its decimals.
fn stem(name: &str) -> &str {
    let base = name.rsplit('/').next().unwrap_or(name);
    let base = base.rsplit_once('.').map_or(base, |(s, _)| s);
    match base.rsplit_once('.') {
        Some((s, word)) if !word.bytes().all(|b| b.is_ascii_digit()) => s,
        _ => base,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::MemorySource;

    fn listed(text: &str, void: Option<u16>) -> Result<(Vec<Class>, Option<u16>), SequenceError> {
        let mut m = MemorySource::new("m");
        m.insert(CLASSES_FILE, text);
        class_list(&Folder::new(Box::new(m)).unwrap(), void)
    }

    #[test]
    fn class_lists_are_in_numeric_order_and_void_is_no_class() {
        let text = r#"{"10": {"name": "bin", "color": [1, 2, 3]}, "9": {"name": "bed"},
            "0": {"name": "Void"}}"#;
        let (classes, void) = listed(text, None).unwrap();
        let ids: Vec<u16> = classes.iter().map(|c| c.raw_id).collect();
        assert_eq!((ids, void), (vec![9, 10], Some(0)));
        assert_eq!(classes[1].color, [1, 2, 3]);
        assert_eq!(listed(text, Some(9)).unwrap().0.len(), 2);
        assert_eq!(listed(r#"{"255": {"name": "wall"}}"#, None).unwrap().1, None);
        for (text, part) in [
            ("[]", "no object"),
            (r#"{"a": {"name": "x"}}"#, "class id"),
            (r#"{"70000": {"name": "x"}}"#, "class id"),
            (r#"{"7": {}}"#, "class 7: name"),
            (r#"{"7": {"name": "x", "color": [1, 2, 300]}}"#, "class 7: color"),
            (r#"{"7": {"name": "x"}, "07": {"name": "y"}}"#, "7 twice"),
        ] {
            let e = listed(text, None).unwrap_err().to_string();
            assert!(e.contains(part) && e.contains("classes.json"), "{text}: {e}");
        }
    }

    #[test]
    fn stems_and_colours() {
        assert_eq!(stem("a/frame-01.color.png"), "frame-01");
        assert_eq!(stem("rgb/1341.25.png"), "1341.25");
        assert_eq!(stem("plain"), "plain");
        let colors: BTreeSet<[u8; 3]> = (0..255).map(class_color).collect();
        assert!(colors.len() > 250, "{}", colors.len());
    }
}
