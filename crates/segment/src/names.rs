//! Names of classes where no file has them, by their number.

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
const NYU40: &str = "wall;floor;cabinet;bed;chair;sofa;table;door;window;bookshelf;picture;counter;blinds;desk;\
    shelves;curtain;dresser;pillow;mirror;floor mat;clothes;ceiling;books;refrigerator;television;\
    paper;towel;shower curtain;box;whiteboard;person;nightstand;toilet;sink;lamp;bathtub;bag;\
    otherstructure;otherfurniture;otherprop";

/// Names by number of classes, and the data set they are of: ADE20K, Cityscapes, Pascal VOC, NYU40.
pub(crate) fn by_count(count: usize) -> Option<(&'static str, Vec<Meaning>)> {
    let (set, names) = match count {
        150 => ("ADE20K", ADE20K),
        19 => ("Cityscapes", CITYSCAPES),
        21 => ("Pascal VOC", VOC),
        40 => ("NYU40", NYU40),
        _ => return None,
    };
    Some((set, names.trim().split(';').map(Meaning::of).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_the_numbers_they_are_known_by() {
        for count in [150, 19, 21, 40] {
            assert_eq!(by_count(count).unwrap().1.len(), count);
        }
        assert_eq!(by_count(150).unwrap().1[8], Meaning::Class("windowpane".into()));
        assert_eq!(by_count(150).unwrap().1[149], Meaning::Class("flag".into()));
        assert_eq!(by_count(21).unwrap().1[0], Meaning::None);
        assert_eq!(by_count(7), None);
        assert_eq!(Meaning::of(" "), Meaning::Untrained);
    }
}
