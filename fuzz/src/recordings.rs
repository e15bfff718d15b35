//! What is done with a recording of any layout.
use crate::bundle::Bundle;
use mte_slam_dataset::{
    Axes, ClassList, FrameOrder, GivenCamera, LabelSource, Layout, OpenOptions,
    inspect::{InspectOptions, inspect},
    open,
};
use mte_slam_types::sequence::Source;

/// Most frames that are decoded of one input.
const FRAMES: usize = 3;

/// Options by the four bytes of an input. `layouts` are those that may be asked for by name.
fn options(bytes: [u8; 4], layouts: &[Layout], bundle: &Bundle) -> OpenOptions {
    let [layout, scale, labels, given] = bytes;
    let folder = || Box::new(bundle.source());
    OpenOptions {
        layout: layouts.get(usize::from(layout).wrapping_sub(1)).copied(),
        scale: [1.0, 0.5, 0.7][usize::from(scale % 3)],
        stride: 1 + usize::from(scale / 3 % 3),
        start: usize::from(scale / 64),
        labels: match labels % 4 {
            0 | 1 => LabelSource::Dataset,
            2 => LabelSource::None,
            _ => LabelSource::Folder(folder()),
        },
        classes: match labels / 4 % 4 {
            0 | 1 => None,
            2 => Some(ClassList::nyu40()),
            _ => Some(ClassList::replica()),
        },
        only_present_classes: labels & 64 != 0,
        unlabelled_raw_id: (labels & 128 != 0).then_some(7),
        camera: (given & 1 != 0).then(|| GivenCamera {
            focal_centre: [30.0, 30.0, 15.5, 11.5],
            distortion: if given & 2 != 0 { [0.1, -0.2, 0.01, 0.02, 0.03] } else { [0.0; 5] },
        }),
        depth_scale: (given & 4 != 0).then_some(1000.0),
        axes: if given & 8 != 0 { Axes::OpenGl } else { Axes::OpenCv },
        order: if given & 32 != 0 { FrameOrder::File } else { FrameOrder::Time },
        strict: given & 128 != 0,
        max_depth_m: (given & 64 != 0).then_some(2.5),
        features: if given & 16 != 0 { Some(folder()) } else { None },
        ..Default::default()
    }
}

/// Opens the recording in `source`, reads what it says of itself and some frames, and inspects it.
pub fn read(source: Box<dyn Source>, bundle: &Bundle, layouts: &[Layout]) {
    let options = options(bundle.options, layouts, bundle);
    let Ok(mut sequence) = open(source, options) else { return };
    let info = sequence.info().clone();
    for i in 0..info.frames.min(FRAMES) {
        let (_truth, _number, time_s) = (sequence.truth(i), sequence.number(i), sequence.time_s(i));
        assert!(!time_s.is_nan());
        let Ok(frame) = sequence.frame(i) else { return };
        let pixels = info.camera.pixels();
        assert_eq!(frame.color.len(), pixels);
        assert_eq!(frame.depth.len(), pixels);
        if let Some(labels) = &frame.labels {
            assert_eq!(labels.len(), pixels);
            let classes = info.classes.len();
            assert!(labels.iter().all(|l| *l == 255 || usize::from(*l) < classes));
        }
        if let Some(map) = &frame.features {
            assert_eq!(map.channels, info.feature_channels);
        }
    }
    if info.camera.pixels() < 1 << 14 {
        let _ = inspect(&mut *sequence, InspectOptions { frames: 2, pairs: 1 }, |_, _| {});
    }
    let _ = sequence.warnings();
}
