//! What classes are called, and their names where no file has them, by their number.
use mte_slam_types::classes::ClassTable;

/// What is known of a network's classes, by their index in its output.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Labels {
    pub meanings: Vec<Meaning>,
    /// Ids of the classes in label images, where they are not the indices.
    pub raw_ids: Vec<u16>,
    pub colors: Vec<[u8; 3]>,
}

/// What the class at an index of a network's output means.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// A class of this name.
    Class(String),
    /// "Nothing of these", such as VOC's background: such pixels stay unlabelled.
    None,
    /// Never trained: left out of the comparison.
    Untrained,
}

impl Meaning {
    /// By a name of `id2label`.
    pub fn of(name: &str) -> Meaning {
        match name.trim() {
            "" | "N/A" | "n/a" => Meaning::Untrained,
            name => match name.to_lowercase().as_str() {
                "background" | "void" | "unlabelled" | "unlabeled" | "ignore" => Meaning::None,
                _ => Meaning::Class(name.to_owned()),
            },
        }
    }
}

const ADE20K: &str = include_str!("names/ade20k.txt");
const CITYSCAPES: &str = "road;sidewalk;building;wall;fence;pole;traffic light;traffic sign;vegetation;terrain;\
    sky;person;rider;car;truck;bus;train;motorcycle;bicycle";
const VOC: &str = "background;aeroplane;bicycle;bird;boat;bottle;bus;car;cat;chair;cow;dining table;dog;\
    horse;motorbike;person;potted plant;sheep;sofa;train;tv monitor";
/// Names by number of classes, and the data set they are of: ADE20K, Cityscapes, Pascal VOC, NYU40.
pub(crate) fn by_count(count: usize) -> Option<(&'static str, Labels)> {
    let named = |names: &str| Labels {
        meanings: names.trim().split(';').map(Meaning::of).collect(),
        ..Labels::default()
    };
    match count {
        150 => Some(("ADE20K", named(ADE20K))),
        19 => Some(("Cityscapes", named(CITYSCAPES))),
        21 => Some(("Pascal VOC", named(VOC))),
        40 => {
            let classes = ClassTable::nyu40().classes;
            let labels = Labels {
                meanings: classes.iter().map(|c| Meaning::of(&c.name)).collect(),
                raw_ids: classes.iter().map(|c| c.raw_id).collect(),
                colors: classes.iter().map(|c| c.color).collect(),
            };
            Some(("NYU40", labels))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_the_numbers_they_are_known_by() {
        for count in [150, 19, 21, 40] {
            assert_eq!(by_count(count).unwrap().1.meanings.len(), count);
        }
        assert_eq!(by_count(150).unwrap().1.meanings[8], Meaning::Class("windowpane".into()));
        assert_eq!(by_count(150).unwrap().1.meanings[149], Meaning::Class("flag".into()));
        assert_eq!(by_count(21).unwrap().1.meanings[0], Meaning::None);
        assert_eq!(by_count(7), None);
        // As ScanNet's label images have them, so that both can be compared.
        assert_eq!(by_count(40).unwrap().1.raw_ids, (1..=40).collect::<Vec<u16>>());
        assert_eq!(Meaning::of(" "), Meaning::Untrained);
    }
}
