//! Which classes there are: from a file, or one of the lists that the field's data sets use.
use super::folder::{invalid, shortened};
use mte_slam_types::{
    classes::{Class, ClassTable, class_color},
    sequence::SequenceError,
};
use std::collections::BTreeMap;

/// Ids, names and colours of classes, and the id that is none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClassList {
    /// Where it comes from, for messages: a file, or `nyu40`.
    pub name: String,
    /// The classes, by id.
    pub table: ClassTable,
    /// The ids that mean "no label"; where empty 255 does, unless it is a class.
    pub unlabelled: Vec<u16>,
}

/// The id that means "no label" when a list names none.
pub(super) const DEFAULT_UNLABELLED: u16 = 255;

impl ClassList {
    /// The lists that need no file, by name.
    pub const BUILT_IN: [&str; 2] = ["nyu40", "replica"];

    /// Returns a built-in list, `None` for any other name.
    pub fn built_in(name: &str) -> Option<ClassList> {
        match name {
            "nyu40" => Some(ClassList::nyu40()),
            "replica" => Some(ClassList::replica()),
            _ => None,
        }
    }

    /// Returns the 40 classes of NYU Depth v2 in ScanNet's label images (`label-filt` mapped to `nyu40id`)
    /// with ScanNet's colours; 0 is unlabelled.
    pub fn nyu40() -> ClassList {
        let table = ClassTable::nyu40();
        ClassList { name: "nyu40".into(), table, unlabelled: vec![0] }
    }

    /// Replica's 101 classes, with the ids of its `info_semantic.json`, as in the semantic renders
    /// of Semantic-NeRF and vMAP; 0 is unlabelled. Replica fixes no colours.
    pub fn replica() -> ClassList {
        let class = |(i, name): (usize, &&str)| {
            let raw_id = i as u16 + 1;
            Class { raw_id, name: (*name).into(), color: class_color(raw_id) }
        };
        let table = ClassTable { classes: REPLICA.iter().enumerate().map(class).collect() };
        ClassList { name: "replica".into(), table, unlabelled: vec![0] }
    }

    /// Parses the list in `text`, the contents of `file`:
    /// `{"7": {"name": "bed", "color": [86, 117, 191]}}`, colours optional. Classes
    /// named `void`, `unlabelled` or `unlabeled` are none, but ids that mean "no label".
    ///
    /// # Errors
    /// [`SequenceError::Invalid`] names the entry that is wrong.
    pub fn parse(file: &str, text: &str) -> Result<ClassList, SequenceError> {
        let error = |field: String, found: String, expected: &str| {
            invalid(file, None, field, found, expected)
        };
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let json: serde_json::Value = serde_json::from_str(text)
            .map_err(|e| error("JSON".into(), e.to_string(), "a JSON document"))?;
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
        let is_void = |c: &Class| {
            let name = c.name.to_lowercase();
            ["void", "unlabelled", "unlabeled"].contains(&name.as_str())
        };
        let (void, classes): (Vec<_>, Vec<_>) = classes.into_values().partition(is_void);
        let unlabelled = void.iter().map(|c| c.raw_id).collect();
        Ok(ClassList { name: file.into(), table: ClassTable { classes }, unlabelled })
    }

    /// The list of ids that have no names.
    pub(super) fn unnamed(ids: impl IntoIterator<Item = u16>) -> ClassList {
        let class = |id| Class { raw_id: id, name: format!("class {id}"), color: class_color(id) };
        let table = ClassTable { classes: ids.into_iter().map(class).collect() };
        ClassList { name: "the label images".into(), table, unlabelled: Vec::new() }
    }

    /// Takes `id` for one that means "no label".
    pub(super) fn set_unlabelled(&mut self, id: u16) {
        self.unlabelled.push(id);
        self.table.classes.retain(|c| c.raw_id != id);
    }

    /// Returns the ids that mean "no label".
    pub(super) fn unlabelled_ids(&self) -> Vec<u16> {
        let free = self.table.classes.iter().all(|c| c.raw_id != DEFAULT_UNLABELLED);
        match self.unlabelled.as_slice() {
            [] if free => vec![DEFAULT_UNLABELLED],
            ids => ids.to_vec(),
        }
    }
}

/// Names of the ids 1 to 101.
#[rustfmt::skip]
const REPLICA: [&str; 101] = [
    "backpack", "base-cabinet", "basket", "bathtub", "beam", "beanbag", "bed", "bench", "bike",
    "bin", "blanket", "blinds", "book", "bottle", "box", "bowl", "camera", "cabinet", "candle",
    "chair", "chopping-board", "clock", "cloth", "clothing", "coaster", "comforter",
    "computer-keyboard", "cup", "cushion", "curtain", "ceiling", "cooktop", "countertop", "desk",
    "desk-organizer", "desktop-computer", "door", "exercise-ball", "faucet", "floor", "handbag",
    "hair-dryer", "handrail", "indoor-plant", "knife-block", "kitchen-utensil", "lamp", "laptop",
    "major-appliance", "mat", "microwave", "monitor", "mouse", "nightstand", "pan", "panel",
    "paper-towel", "phone", "picture", "pillar", "pillow", "pipe", "plant-stand", "plate", "pot",
    "rack", "refrigerator", "remote-control", "scarf", "sculpture", "shelf", "shoe",
    "shower-stall", "sink", "small-appliance", "sofa", "stair", "stool", "switch", "table",
    "table-runner", "tablet", "tissue-paper", "toilet", "toothbrush", "towel", "tv-screen",
    "tv-stand", "umbrella", "utensil-holder", "vase", "vent", "wall", "wall-cabinet", "wall-plug",
    "wardrobe", "window", "rug", "logo", "bag", "set-of-clothing",
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn listed(text: &str) -> Result<ClassList, SequenceError> {
        ClassList::parse("classes.json", text)
    }

    #[test]
    fn class_lists_are_in_numeric_order_and_void_is_no_class() {
        let text = r#"{"10": {"name": "bin", "color": [1, 2, 3]}, "9": {"name": "bed"},
            "0": {"name": "Void"}}"#;
        let mut list = listed(text).unwrap();
        let ids: Vec<u16> = list.table.classes.iter().map(|c| c.raw_id).collect();
        assert_eq!((ids, list.unlabelled_ids()), (vec![9, 10], vec![0]));
        assert_eq!(list.table.classes[1].color, [1, 2, 3]);
        list.set_unlabelled(9);
        assert_eq!((list.table.len(), list.unlabelled_ids()), (1, vec![0, 9]));
        assert!(listed(r#"{"255": {"name": "wall"}}"#).unwrap().unlabelled_ids().is_empty());
        assert_eq!(listed(r#"{"1": {"name": "wall"}}"#).unwrap().unlabelled_ids(), [255]);
        for (text, part) in [
            ("[]", "no object"),
            ("{", "JSON"),
            (r#"{"a": {"name": "x"}}"#, "class id"),
            (r#"{"70000": {"name": "x"}}"#, "class id"),
            (r#"{"7": {}}"#, "class 7: name"),
            (r#"{"7": {"name": "x", "color": [1, 2, 300]}}"#, "class 7: color"),
            (r#"{"7": {"name": "x"}, "07": {"name": "y"}}"#, "7 twice"),
        ] {
            let e = listed(text).unwrap_err().to_string();
            assert!(e.contains(part) && e.contains("classes.json"), "{text}: {e}");
        }
    }

    #[test]
    fn built_in_lists_have_the_ids_of_their_data_sets() {
        let named = |list: &ClassList, id: u16| {
            list.table.classes.iter().find(|c| c.raw_id == id).map(|c| c.name.clone()).unwrap()
        };
        for (name, count, known) in [
            (
                "nyu40",
                40,
                [(1, "wall"), (22, "ceiling"), (39, "otherfurniture"), (40, "otherprop")],
            ),
            ("replica", 101, [(1, "backpack"), (40, "floor"), (93, "wall"), (97, "window")]),
        ] {
            let list = ClassList::built_in(name).unwrap();
            assert_eq!((list.table.len(), list.unlabelled_ids()), (count, vec![0]), "{name}");
            for (id, expected) in known {
                assert_eq!(named(&list, id), expected, "{name} {id}");
            }
            let names: BTreeSet<_> = list.table.classes.iter().map(|c| &c.name).collect();
            let colors: BTreeSet<_> = list.table.classes.iter().map(|c| c.color).collect();
            assert_eq!((names.len(), colors.len()), (count, count), "{name}");
        }
        assert_eq!(ClassList::nyu40().table.classes[35].color, [227, 119, 194]);
        assert_eq!(ClassList::built_in("coco"), None);
    }
}
