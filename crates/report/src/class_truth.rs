//! The labels that classes are scored against, which need not be those that the map learnt from:
//! an imperfect segmenter's labels go in, and the question is whether the map is better than they.
use anyhow::{Result, bail};
use mte_slam_types::{
    classes::{Class, ClassTable, UNLABELLED},
    frame::{Frame, SequenceInfo},
    sequence::Sequence,
};

/// True labels, and the classes that both they and the map can name.
pub struct ClassTruth {
    /// `dataset`, a folder, `none`.
    pub name: String,
    /// Classes of the scores: those of the truth and of the map, by raw id.
    pub table: ClassTable,
    source: Source,
    /// From the compact indices of the map, and of the truth, to those of `table`.
    from_map: Vec<u8>,
    from_truth: Vec<u8>,
    warnings: Vec<String>,
}

enum Source {
    None(&'static str),
    /// The labels that the map learnt from.
    Input,
    Own(Box<dyn Sequence>),
}

impl ClassTruth {
    /// Nothing is scored, and why.
    pub fn none(reason: &'static str, input: &SequenceInfo) -> ClassTruth {
        ClassTruth { source: Source::None(reason), ..ClassTruth::of_input("none", input) }
    }

    /// The labels that the map learns from, called `name`.
    pub fn of_input(name: &str, input: &SequenceInfo) -> ClassTruth {
        let same: Vec<u8> = (0..input.classes.len()).map(|i| i as u8).collect();
        ClassTruth {
            name: name.to_owned(),
            table: input.classes.clone(),
            source: Source::Input,
            from_map: same.clone(),
            from_truth: same,
            warnings: Vec::new(),
        }
    }

    /// Labels of their own, whose frames are those of the input.
    pub fn of_sequence(
        name: &str,
        truth: Box<dyn Sequence>,
        input: &SequenceInfo,
    ) -> Result<ClassTruth> {
        let (of_truth, of_map) = (&truth.info().classes, &input.classes);
        let mut classes: Vec<Class> = of_truth.classes.clone();
        let mut renamed = Vec::new();
        for class in &of_map.classes {
            match of_truth.classes.iter().find(|c| c.raw_id == class.raw_id) {
                None => classes.push(class.clone()),
                Some(c) if c.name != class.name => {
                    renamed.push(format!("{} is {} and {}", c.raw_id, class.name, c.name));
                }
                Some(_) => {}
            }
        }
        classes.sort_by_key(|c| c.raw_id);
        if classes.len() > usize::from(UNLABELLED) {
            bail!(
                "{name}: classes of the true labels and of the map together: found {}, expected \
                 at most {UNLABELLED}",
                classes.len()
            );
        }
        let mut warnings = Vec::new();
        if !renamed.is_empty() {
            let (n, shown) = (renamed.len(), renamed[..renamed.len().min(4)].join(", "));
            warnings.push(format!(
                "{n} ids have another name in the labels and in the true labels, and are taken \
                 for the same class: {shown}"
            ));
        }
        let table = ClassTable { classes };
        let index = table.index_of_raw();
        let to_table = |t: &ClassTable| -> Vec<u8> {
            t.classes.iter().map(|c| index.get(&c.raw_id).copied().unwrap_or(UNLABELLED)).collect()
        };
        let (from_map, from_truth) = (to_table(of_map), to_table(of_truth));
        let (name, source) = (name.to_owned(), Source::Own(truth));
        Ok(ClassTruth { name, table, source, from_map, from_truth, warnings })
    }

    /// True labels of a frame, in the classes of `table`.
    pub fn of_frame(&mut self, frame: &Frame) -> Result<Option<Vec<u8>>> {
        let labels = match &mut self.source {
            Source::None(_) => None,
            Source::Input => frame.labels.clone(),
            Source::Own(sequence) => sequence.labels(frame.index)?,
        };
        Ok(labels.map(|l| mapped(&l, &self.from_truth)))
    }

    /// Whether any of the `frames` has a true label.
    pub fn has_labels(&mut self, input: &mut dyn Sequence, frames: &[usize]) -> Result<bool> {
        for &index in frames {
            let labels = match &mut self.source {
                Source::None(_) => return Ok(false),
                Source::Input => input.labels(index)?,
                Source::Own(sequence) => sequence.labels(index)?,
            };
            if labels.is_some_and(|l| l.iter().any(|c| *c != UNLABELLED)) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Classes of the map's, or of its labels, in those of `table`.
    pub fn of_map(&self, classes: &[u8]) -> Vec<u8> {
        mapped(classes, &self.from_map)
    }

    /// Whether the truth is not what the map learnt from.
    pub fn is_own(&self) -> bool {
        matches!(self.source, Source::Own(_))
    }

    /// Why nothing is scored, if so.
    pub fn reason(&self) -> Option<&'static str> {
        match self.source {
            Source::None(reason) => Some(reason),
            _ => None,
        }
    }

    /// What was assumed, and what reading the true labels met.
    pub fn warnings(&self) -> Vec<String> {
        let mut all = self.warnings.clone();
        if let Source::Own(sequence) = &self.source {
            let about_labels = |w: &String| w.contains("label");
            let met = sequence.warnings().into_iter().filter(about_labels);
            all.extend(met.map(|w| format!("true labels: {w}")));
        }
        all
    }
}

fn mapped(classes: &[u8], to: &[u8]) -> Vec<u8> {
    classes.iter().map(|&c| to.get(usize::from(c)).copied().unwrap_or(UNLABELLED)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_synth::{SyntheticOptions, SyntheticSequence};

    fn class(raw_id: u16, name: &str) -> Class {
        Class { raw_id, name: name.to_owned(), color: [0; 3] }
    }

    #[test]
    fn classes_meet_by_raw_id() {
        let options =
            SyntheticOptions { frames: 1, width: 32, height: 24, ..SyntheticOptions::default() };
        let truth = SyntheticSequence::new(options);
        let true_classes = truth.info().classes.classes.clone();
        let mut input = truth.info().clone();
        // The map knows a class that the truth does not, and the truth's third under another name.
        let (third, second) = (true_classes[2].raw_id, true_classes[1].clone());
        input.classes.classes = vec![class(third, "other name"), class(60_000, "new"), second];
        let mut t = ClassTruth::of_sequence("t", Box::new(truth), &input).unwrap();
        assert_eq!(t.table.len(), true_classes.len() + 1);
        let place = |t: &ClassTruth, id: u16| t.table.index_of_raw()[&id];
        let expected = [place(&t, third), place(&t, 60_000), place(&t, true_classes[1].raw_id)];
        assert_eq!(t.of_map(&[0, 1, 2, 3, UNLABELLED])[..3], expected);
        assert_eq!(t.of_map(&[3, UNLABELLED]), [UNLABELLED; 2]);
        assert!(t.warnings()[0].contains("other name"), "{:?}", t.warnings());
        let options =
            SyntheticOptions { frames: 1, width: 32, height: 24, ..SyntheticOptions::default() };
        let frame = SyntheticSequence::new(options).frame(0).unwrap();
        let labels = t.of_frame(&frame).unwrap().unwrap();
        for (a, b) in labels.iter().zip(frame.labels.as_ref().unwrap()) {
            let raw = true_classes.get(usize::from(*b)).map(|c| c.raw_id);
            assert_eq!(t.table.classes.get(usize::from(*a)).map(|c| c.raw_id), raw);
        }
    }
}
