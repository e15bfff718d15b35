//! Errors of rendered class images.
use super::{BoundaryMeter, BoundaryReport, MetricsError};
use alloc::{string::String, vec, vec::Vec};
use mte_slam_types::classes::UNLABELLED;
use serde::Serialize;

/// Classes with a smaller share of the true pixels than this count as thin or small \[%\].
pub const SMALL_SHARE_PERCENT: f64 = 0.5;

/// Counts of true against predicted classes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfusionMatrix {
    classes: usize,
    /// Row: true class; column: predicted class, the last column for no or an unknown class.
    counts: Vec<u64>,
    images: usize,
}

/// Figures of a [`ConfusionMatrix`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SemanticReport {
    /// Id of the protocol, to compare by ([`crate::protocol`]).
    pub protocol_id: String,
    /// What the figures mean.
    pub protocol: String,
    /// Number of images.
    pub images: usize,
    /// Pixels with a true class.
    pub pixels: u64,
    /// Mean IoU \[%\] over the classes with a non-empty union: a class that is predicted but
    /// never true counts as 0.
    pub miou_percent: f64,
    /// Number of classes in that mean.
    pub miou_classes: usize,
    /// Mean IoU \[%\] over the classes that occur in the truth.
    pub miou_of_true_classes_percent: f64,
    /// Share of the pixels with the right class \[%\].
    pub pixel_accuracy_percent: f64,
    /// Mean over the true classes of the share of each one's pixels that are right \[%\].
    pub mean_class_accuracy_percent: f64,
    /// Mean IoU \[%\] over the thin and small classes: those that occur in the truth with less
    /// than [`SMALL_SHARE_PERCENT`] of its pixels. `None` when there are none.
    pub small_miou_percent: Option<f64>,
    /// Compact indices of those classes.
    #[serde(skip)]
    pub small_classes: Vec<u8>,
    /// Outlines, where the images' width was known.
    pub boundary: Option<BoundaryReport>,
    /// True pixels of each compact class index.
    #[serde(skip)]
    pub pixels_of_class: Vec<u64>,
    /// Share of the class's true pixels that are right \[%\]; `None` without any.
    #[serde(skip)]
    pub accuracy_percent_of_class: Vec<Option<f64>>,
    /// IoU \[%\] of each compact class index; `None` with an empty union.
    pub iou_percent: Vec<Option<f64>>,
}

/// A [`ConfusionMatrix`] and a [`BoundaryMeter`] over the same images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SemanticMeter {
    confusion: ConfusionMatrix,
    boundary: BoundaryMeter,
}

impl SemanticMeter {
    /// No images yet, of compact classes 0..`classes`.
    pub fn new(classes: usize) -> SemanticMeter {
        let boundary = BoundaryMeter::new(classes);
        SemanticMeter { confusion: ConfusionMatrix::new(classes), boundary }
    }

    /// Adds an image of compact class indices, `width` pixels per row; see [`ConfusionMatrix::add`].
    ///
    /// # Errors
    /// Images of different size, or no whole number of rows.
    pub fn add(
        &mut self,
        width: usize,
        truth: &[u8],
        predicted: &[u8],
    ) -> Result<(), MetricsError> {
        self.boundary.add(width, truth, predicted)?;
        self.confusion.add(truth, predicted)
    }

    /// Returns the matrix so far.
    pub fn confusion(&self) -> &ConfusionMatrix {
        &self.confusion
    }

    /// Returns the figures so far, `None` when no pixel had a true class.
    pub fn report(&self) -> Option<SemanticReport> {
        let report = self.confusion.report()?;
        Some(SemanticReport { boundary: self.boundary.report(), ..report })
    }
}

impl ConfusionMatrix {
    /// Returns an empty matrix of compact classes 0..`classes`.
    pub fn new(classes: usize) -> ConfusionMatrix {
        ConfusionMatrix { classes, counts: vec![0; classes * (classes + 1)], images: 0 }
    }

    /// Adds an image of compact class indices. Pixels whose truth is unlabelled (or no class of
    /// the table) are ignored; a prediction that is unlabelled (or no class) is wrong.
    ///
    /// # Errors
    /// Images of different size.
    pub fn add(&mut self, truth: &[u8], predicted: &[u8]) -> Result<(), MetricsError> {
        if truth.len() != predicted.len() {
            let (found, expected) = (predicted.len(), truth.len());
            return Err(MetricsError::Size { what: "rendered class pixels", found, expected });
        }
        for (&t, &p) in truth.iter().zip(predicted) {
            if t != UNLABELLED && (t as usize) < self.classes {
                let known = p != UNLABELLED && (p as usize) < self.classes;
                let column = if known { p as usize } else { self.classes };
                self.counts[t as usize * (self.classes + 1) + column] += 1;
            }
        }
        self.images += 1;
        Ok(())
    }

    /// Returns the number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }

    /// Pixels of true class `truth` predicted as `predicted`; `classes` stands for no class.
    pub fn count(&self, truth: usize, predicted: usize) -> u64 {
        self.counts[truth * (self.classes + 1) + predicted]
    }

    /// Returns the figures so far, `None` when no pixel had a true class.
    pub fn report(&self) -> Option<SemanticReport> {
        let n = self.classes;
        let pixels: u64 = self.counts.iter().sum();
        if pixels == 0 {
            return None;
        }
        let right: Vec<u64> = (0..n).map(|c| self.count(c, c)).collect();
        let of_truth: Vec<u64> = (0..n).map(|t| (0..=n).map(|p| self.count(t, p)).sum()).collect();
        let of_prediction: Vec<u64> =
            (0..n).map(|p| (0..n).map(|t| self.count(t, p)).sum()).collect();
        let percent = |part: u64, whole: u64| 100.0 * part as f64 / whole as f64;
        let iou: Vec<Option<f64>> = (0..n)
            .map(|c| {
                let union = of_truth[c] + of_prediction[c] - right[c];
                (union > 0).then(|| percent(right[c], union))
            })
            .collect();
        let occurs = |c: &usize| of_truth[*c] > 0;
        let small: Vec<u8> = (0..n)
            .filter(occurs)
            .filter(|&c| percent(of_truth[c], pixels) < SMALL_SHARE_PERCENT)
            .map(|c| c as u8)
            .collect();
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        Some(SemanticReport {
            protocol_id: crate::protocol::MIOU.into(),
            protocol: "mIoU: one confusion matrix over all images, unlabelled truth ignored".into(),
            images: self.images,
            pixels,
            miou_percent: mean(iou.iter().flatten().copied().collect()),
            miou_classes: iou.iter().flatten().count(),
            miou_of_true_classes_percent: mean(
                (0..n).filter(occurs).filter_map(|c| iou[c]).collect(),
            ),
            pixel_accuracy_percent: percent(right.iter().sum(), pixels),
            mean_class_accuracy_percent: mean(
                (0..n).filter(occurs).map(|c| percent(right[c], of_truth[c])).collect(),
            ),
            small_miou_percent: (!small.is_empty())
                .then(|| mean(small.iter().filter_map(|&c| iou[usize::from(c)]).collect())),
            small_classes: small,
            boundary: None,
            accuracy_percent_of_class: (0..n)
                .map(|c| (of_truth[c] > 0).then(|| percent(right[c], of_truth[c])))
                .collect(),
            pixels_of_class: of_truth,
            iou_percent: iou,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_a_small_example() {
        let mut m = ConfusionMatrix::new(4);
        assert!(m.report().is_none());
        let truth = [0, 0, 0, 0, 1, 1, 255, 9];
        let predicted = [0, 0, 1, 255, 1, 2, 0, 0];
        m.add(&truth, &predicted).unwrap();
        assert!(m.add(&truth, &predicted[1..]).is_err());
        let r = m.report().unwrap();
        assert_eq!((r.pixels, r.images, r.miou_classes), (6, 1, 3));
        // Class 0: 2 of 4; class 1: 1 of 3; class 2: 0 of 1; class 3: never seen.
        let third = 100.0 / 3.0;
        assert_eq!(r.iou_percent, [Some(50.0), Some(third), Some(0.0), None]);
        assert!((r.miou_percent - (50.0 + third) / 3.0).abs() < 1e-9);
        assert!((r.miou_of_true_classes_percent - (50.0 + third) / 2.0).abs() < 1e-9);
        assert_eq!(r.pixel_accuracy_percent, 50.0);
        assert_eq!(r.mean_class_accuracy_percent, 50.0);
        assert_eq!(r.pixels_of_class, [4, 2, 0, 0]);
        assert_eq!(r.accuracy_percent_of_class, [Some(50.0), Some(50.0), None, None]);
        assert_eq!((r.small_miou_percent, r.small_classes.len()), (None, 0));
    }

    #[test]
    fn small_classes_are_those_below_half_a_percent() {
        let mut m = SemanticMeter::new(3);
        // 4 of 1000 pixels are class 1, half of them right; 5 are class 2, exactly 0.5 %.
        let mut truth = vec![0u8; 1000];
        truth[..4].fill(1);
        truth[100..105].fill(2);
        let mut predicted = truth.clone();
        predicted[..2].fill(0);
        m.add(100, &truth, &predicted).unwrap();
        let r = m.report().unwrap();
        assert_eq!((r.small_classes, r.small_miou_percent), (vec![1], Some(50.0)));
        assert!(r.boundary.is_some_and(|b| b.iou_percent < 100.0));
    }
}
