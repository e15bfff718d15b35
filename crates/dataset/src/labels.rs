//! Label images: which file belongs to which frame, which classes there are, raw ids to indices.
use super::{
    class_list::{ClassList, DEFAULT_UNLABELLED},
    decode::{self, Origin, Size},
    entries::Entry,
    folder::{Folder, invalid, number_between, plural},
    names::folded,
    resize::{Resize, same_aspect},
    scannet_ids::{self, RawIds},
};
use mte_slam_types::{
    classes::{ClassTable, UNLABELLED},
    sequence::SequenceError,
};
use std::collections::{BTreeMap, BTreeSet};

const CLASSES_FILE: &str = "classes.json";
/// Where label images lie beside the frames. Those of the second hold ScanNet's raw ids.
const FOLDERS: [&str; 2] = ["semantic_class/", "label-filt/"];
/// How the folder of ScanNet's raw ids is called, wherever it lies.
const RAW_FOLDER: &str = "label-filt";
/// The raw id of pixels that nobody labelled in ScanNet.
const RAW_UNLABELLED: u16 = 0;
/// In the look-up table: an id that is not in the class list.
const UNKNOWN: u16 = 256;
/// This many label images decide at opening whether the class list is theirs.
const CHECKED_IMAGES: usize = 8;

/// The label images of a recording.
pub(super) struct Labels {
    /// Where they lie, when not beside the frames.
    own: Option<Folder>,
    pub table: ClassTable,
    /// ScanNet's raw ids are translated first.
    raw: Option<RawIds>,
    /// Raw id -> compact index, [`UNLABELLED`] or [`UNKNOWN`].
    index: Vec<u16>,
    met: Met,
}

/// What reading met, each frame counted once.
#[derive(Default)]
struct Met {
    frames: BTreeSet<u64>,
    /// Pixels with ids that are not in the class list, by id.
    unknown: BTreeMap<u16, u64>,
    /// Pixels with a class.
    labelled: u64,
    /// Images of another size, and the size of the last one.
    resized: usize,
    size: Size,
    expected: Size,
}

/// What the caller wants of the class list.
pub(super) struct LabelOptions {
    pub list: Option<ClassList>,
    pub unlabelled: Option<u16>,
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
        wanted: LabelOptions,
    ) -> Result<Option<Self>, SequenceError> {
        let mut is_raw = false;
        match &mut own {
            None => {
                let mut below = None;
                for folder in FOLDERS {
                    if below.is_none() && assign(recording, folder, frames)? > 0 {
                        below = Some(folder);
                    }
                }
                let Some(below) = below else { return Ok(None) };
                is_raw = below.trim_end_matches('/') == RAW_FOLDER;
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
                let name = folder.name();
                let last = name.trim_end_matches(['/', '\\']).rsplit(['/', '\\']).next();
                is_raw |= last.is_some_and(|last| folded(last).ends_with(RAW_FOLDER));
            }
        }
        let images = own.as_ref().unwrap_or(recording);
        let raw = match is_raw {
            true => scannet_ids::read(images)?.or(scannet_ids::read(recording)?),
            false => None,
        };
        let listed = match (wanted.list, &own) {
            (Some(list), _) => Some(list),
            (None, _) if raw.is_some() => Some(ClassList::nyu40()),
            (None, Some(folder)) if folder.has(CLASSES_FILE) => {
                Some(ClassList::parse(CLASSES_FILE, &folder.text(CLASSES_FILE)?)?)
            }
            (None, _) if recording.has(CLASSES_FILE) => {
                Some(ClassList::parse(CLASSES_FILE, &recording.text(CLASSES_FILE)?)?)
            }
            (None, _) => None,
        };
        let mut list = match listed {
            Some(mut list) => {
                if let Some(id) = wanted.unlabelled {
                    list.set_unlabelled(id);
                }
                if wanted.only_present {
                    let present = scan(images, frames, size, raw.as_ref())?;
                    list.table.classes.retain(|c| present.contains(&c.raw_id));
                } else {
                    check_list(&list, images, frames, size, raw.as_ref())?;
                }
                list
            }
            None => {
                let mut list = ClassList::unnamed(scan(images, frames, size, None)?);
                let default = if is_raw { RAW_UNLABELLED } else { DEFAULT_UNLABELLED };
                list.set_unlabelled(wanted.unlabelled.unwrap_or(default));
                list
            }
        };
        let unlabelled = list.unlabelled_ids();
        let classes = std::mem::take(&mut list.table.classes);
        if classes.len() > usize::from(UNLABELLED) {
            let found = classes.len().to_string();
            let expected = format!("at most {UNLABELLED}, the void class not counted");
            return Err(invalid(&list.name, None, "number of classes", found, expected));
        }
        let mut index = vec![UNKNOWN; 1 << 16];
        for (i, class) in classes.iter().enumerate() {
            index[usize::from(class.raw_id)] = i as u16;
        }
        for id in unlabelled {
            index[usize::from(id)] = UNLABELLED.into();
        }
        let met = Met { expected: size, ..Met::default() };
        Ok(Some(Labels { own, table: ClassTable { classes }, raw, index, met }))
    }

    /// Returns the compact indices of one frame, in the size of its depth image.
    pub fn read(
        &mut self,
        recording: &Folder,
        file: &str,
        frame: u64,
        size: Size,
    ) -> Result<Vec<u8>, SequenceError> {
        let folder = self.own.as_ref().unwrap_or(recording);
        let (raw, stored) = decode(folder, file, frame, size, self.raw.as_ref())?;
        let first = self.met.frames.insert(frame);
        if first && stored != size {
            self.met.resized += 1;
            self.met.size = stored;
        }
        let mut out = Vec::with_capacity(raw.len());
        for id in raw {
            out.push(match self.index[usize::from(id)] {
                UNKNOWN => {
                    if first {
                        *self.met.unknown.entry(id).or_default() += 1;
                    }
                    UNLABELLED
                }
                index => index as u8,
            });
        }
        if first {
            self.met.labelled += out.iter().filter(|c| **c != UNLABELLED).count() as u64;
        }
        Ok(out)
    }

    /// What was met, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let met = &self.met;
        let mut all = Vec::new();
        let pixels: u64 = met.unknown.values().sum();
        if pixels > 0 {
            // The most frequent first: a wrong list shows by them.
            let mut ids: Vec<_> = met.unknown.iter().collect();
            ids.sort_by_key(|(id, n)| (std::cmp::Reverse(**n), **id));
            let more = if ids.len() > 8 { ", ..." } else { "" };
            let ids: Vec<String> =
                ids.iter().take(8).map(|(id, n)| format!("{id} ({n})")).collect();
            all.push(format!(
                "{pixels} label pixels taken as unlabelled: not in the class list: {}{more}",
                ids.join(", ")
            ));
        }
        if met.resized > 0 {
            let ((w, h), (to_w, to_h)) = (met.size, met.expected);
            let images = plural(met.resized, "label image");
            all.push(format!(
                "{images} of another size ({w}x{h}) fitted to {to_w}x{to_h} by nearest pixel"
            ));
        }
        if !met.frames.is_empty() && met.labelled == 0 {
            let images = plural(met.frames.len(), "label image");
            all.push(format!("no pixel of {images} has a class: geometry and colour only"));
        }
        all
    }
}

/// Says which files beside the frames look like label images and are none.
pub(super) fn unreadable(folder: &Folder) -> Option<String> {
    let is_jpeg = |n: &&str| n.ends_with(".jpg") || n.ends_with(".jpeg");
    FOLDERS.into_iter().find_map(|below| {
        let n = folder.names().filter(|n| n.starts_with(below)).filter(is_jpeg).count();
        let images = plural(n, "JPEG image");
        (n > 0).then(|| {
            format!("{images} in {below} left out: labels are PNGs, for JPEG changes the ids")
        })
    })
}

/// Returns the ids of a label image in `size`, and its own size.
fn decode(
    folder: &Folder,
    file: &str,
    frame: u64,
    size: Size,
    raw: Option<&RawIds>,
) -> Result<(Vec<u16>, Size), SequenceError> {
    let origin = Origin { file, frame, what: "label image" };
    let (mut ids, stored) = decode::labels(&folder.read(file)?, origin)?;
    if let Some(raw) = raw {
        ids.iter_mut().for_each(|id| *id = raw.nyu40(*id));
    }
    if stored == size {
        return Ok((ids, stored));
    }
    if !same_aspect(stored, size) {
        return Err(invalid(
            file,
            Some(frame),
            "label image size",
            format!("{}x{}", stored.0, stored.1),
            format!("{}x{} as the depth image, or its proportions", size.0, size.1),
        ));
    }
    Ok((Resize::to_size(stored, size).nearest(&ids), stored))
}

/// Refuses a list that knows none of the ids in some of the images: it is another data set's.
fn check_list(
    list: &ClassList,
    folder: &Folder,
    frames: &[Entry],
    size: Size,
    raw: Option<&RawIds>,
) -> Result<(), SequenceError> {
    let labelled: Vec<&Entry> = frames.iter().filter(|f| f.label.is_some()).collect();
    let known: BTreeSet<u16> = list.table.classes.iter().map(|c| c.raw_id).collect();
    let unlabelled = list.unlabelled_ids();
    let mut unknown = BTreeSet::new();
    for frame in labelled.iter().step_by(labelled.len().div_ceil(CHECKED_IMAGES).max(1)) {
        let Some(file) = &frame.label else { continue };
        for id in decode(folder, file, frame.number, size, raw)?.0 {
            if known.contains(&id) {
                return Ok(());
            }
            if !unlabelled.contains(&id) {
                unknown.insert(id);
            }
        }
    }
    if unknown.is_empty() {
        return Ok(()); // nothing is labelled there
    }
    let shown: Vec<String> = unknown.iter().take(8).map(u16::to_string).collect();
    let more = if unknown.len() > 8 { ", ..." } else { "" };
    let found = format!("none of the ids in the label images ({}{more})", shown.join(", "));
    Err(invalid(&list.name, None, "classes", found, "the list that belongs to the label images"))
}

/// Returns all raw ids of all label images.
fn scan(
    folder: &Folder,
    frames: &[Entry],
    size: Size,
    raw: Option<&RawIds>,
) -> Result<BTreeSet<u16>, SequenceError> {
    let mut present = vec![false; 1 << 16];
    for frame in frames {
        let Some(file) = &frame.label else { continue };
        for id in decode(folder, file, frame.number, size, raw)?.0 {
            present[usize::from(id)] = true;
        }
    }
    Ok((0..=u16::MAX).filter(|&id| present[usize::from(id)]).collect())
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
        // The name of a file that holds all images says nothing of one.
        let whole = [&frame.color, &frame.depth].into_iter().filter(|s| s.part.is_none());
        let same = whole.filter_map(|s| by_stem.get(stem(&folded(&s.file)))).next();
        frame.label = same.and_then(|n| folder.real(n)).map(String::from);
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
        let label = family.get(&frame.number).and_then(|n| folder.real(n));
        frame.label = label.map(String::from);
        found += usize::from(frame.label.is_some());
    }
    Ok(found)
}

/// Returns a file's name without folder, extension and one trailing word: `a/frame-01.color.png` and
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

    #[test]
    fn stems_drop_folder_extension_and_word() {
        assert_eq!(stem("a/frame-01.color.png"), "frame-01");
        assert_eq!(stem("rgb/1341.25.png"), "1341.25");
        assert_eq!(stem("plain"), "plain");
    }
}
