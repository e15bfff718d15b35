//! `config.json` and `preprocessor_config.json`, as Hugging Face has them.
use crate::{
    error::{SegmentError, invalid},
    names::{Labels, Meaning},
    resize::Filter,
};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// More classes than any network has.
const MAX_CLASSES: usize = 4096;
/// Longest side of a network's input \[pixels\].
pub(crate) const MAX_SIDE: usize = 4096;

/// Width and height of a network's input \[pixels\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputSize {
    /// Width.
    pub width: usize,
    /// Height.
    pub height: usize,
}

/// How an image's size becomes the input's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SizeRule {
    Exact(InputSize),
    /// The shortest side, with the image's aspect, the longest at most this.
    Shortest(usize, usize),
    /// The longest side, with the image's aspect.
    Longest(usize),
    /// The image's own.
    Own,
}

/// How an image becomes the network's input.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Preprocessing {
    pub size: SizeRule,
    /// Sides are multiples of this, unless the size is exact.
    pub multiple: usize,
    pub filter: Filter,
    /// Factor on 0 to 255, before mean and deviation.
    pub rescale: f32,
    pub mean: [f32; 3],
    pub deviation: [f32; 3],
    /// Where this comes from.
    pub source: &'static str,
}

impl Default for Preprocessing {
    /// What most networks take: ImageNet's mean and deviation, the longest side 384.
    fn default() -> Self {
        Preprocessing {
            size: SizeRule::Longest(384),
            multiple: 32,
            filter: Filter::Bilinear,
            rescale: 1.0 / 255.0,
            mean: [0.485, 0.456, 0.406],
            deviation: [0.229, 0.224, 0.225],
            source: "defaults",
        }
    }
}

#[derive(Deserialize)]
struct PreprocessorFile {
    do_resize: Option<bool>,
    size: Option<Value>,
    resample: Option<u32>,
    do_rescale: Option<bool>,
    rescale_factor: Option<f32>,
    do_normalize: Option<bool>,
    image_mean: Option<Vec<f32>>,
    image_std: Option<Vec<f32>>,
    size_divisor: Option<usize>,
    pad_size_divisor: Option<usize>,
}

impl Preprocessing {
    /// Reads `preprocessor_config.json`.
    pub fn parse(file: &str, text: &str) -> Result<Preprocessing, SegmentError> {
        let name = format!("{file} (preprocessor_config.json)");
        let read: PreprocessorFile = serde_json::from_str(text)
            .map_err(|e| invalid(&name, "JSON", e, "an image processor"))?;
        let mut out = Preprocessing { source: "preprocessor_config.json", ..Self::default() };
        let side = |value: &Value, field: &str| match value.as_u64() {
            Some(n) if (1..=MAX_SIDE as u64).contains(&n) => Ok(n as usize),
            _ => Err(invalid(&name, field, value, format!("a whole number from 1 to {MAX_SIDE}"))),
        };
        if read.do_resize == Some(false) {
            out.size = SizeRule::Own;
        } else if let Some(size) = &read.size {
            let get =
                |key: &str| size.get(key).map(|v| side(v, &format!("size.{key}"))).transpose();
            let (w, h) = (get("width")?, get("height")?);
            let (short, long) = (get("shortest_edge")?, get("longest_edge")?);
            out.size = match (w, h, short, long) {
                (Some(width), Some(height), _, _) => SizeRule::Exact(InputSize { width, height }),
                (_, _, Some(short), long) => SizeRule::Shortest(short, long.unwrap_or(MAX_SIDE)),
                (_, _, None, Some(long)) => SizeRule::Longest(long),
                _ if size.is_number() => {
                    let n = side(size, "size")?;
                    SizeRule::Exact(InputSize { width: n, height: n })
                }
                _ => {
                    let expected = "width and height, shortest_edge, longest_edge, or a number";
                    return Err(invalid(&name, "size", size, expected));
                }
            };
        }
        if let Some(multiple) = read.size_divisor.or(read.pad_size_divisor).filter(|&m| m > 0) {
            if multiple > 512 {
                return Err(invalid(&name, "size_divisor", multiple, "at most 512"));
            }
            out.multiple = multiple;
        }
        out.filter = match read.resample {
            Some(0) => Filter::Nearest,
            Some(3) => Filter::Bicubic,
            _ => Filter::Bilinear,
        };
        out.rescale = match (read.do_rescale, read.rescale_factor) {
            (Some(false), _) => 1.0,
            (_, Some(factor)) => factor,
            (_, None) => 1.0 / 255.0,
        };
        let three =
            |values: Option<Vec<f32>>, field: &str, default: [f32; 3], least: f32| match values {
                None => Ok(default),
                Some(v) => match <[f32; 3]>::try_from(v.as_slice()) {
                    Ok(v) if v.iter().all(|x| x.is_finite() && *x >= least) => Ok(v),
                    _ => Err(invalid(&name, field, format!("{v:?}"), "three finite numbers")),
                },
            };
        if read.do_normalize == Some(false) {
            (out.mean, out.deviation) = ([0.0; 3], [1.0; 3]);
        } else {
            out.mean = three(read.image_mean, "image_mean", out.mean, f32::MIN)?;
            out.deviation = three(read.image_std, "image_std", out.deviation, 1e-6)?;
        }
        if !out.rescale.is_finite() {
            return Err(invalid(&name, "rescale_factor", out.rescale, "a finite number"));
        }
        Ok(out)
    }

    /// The input's size for an image of `image` (width, height).
    pub fn input_size(&self, image: [usize; 2]) -> [usize; 2] {
        let [w, h] = image.map(|x| x.max(1) as f64);
        let scaled = |s: f64| {
            [w, h].map(|x| {
                let steps = (x * s / self.multiple as f64).round().max(1.0) as usize;
                (steps * self.multiple).min(MAX_SIDE / self.multiple * self.multiple)
            })
        };
        match self.size {
            SizeRule::Exact(size) => [size.width, size.height],
            SizeRule::Shortest(short, long) => {
                scaled((short as f64 / w.min(h)).min(long as f64 / w.max(h)))
            }
            SizeRule::Longest(long) => scaled(long as f64 / w.max(h)),
            SizeRule::Own => scaled(1.0),
        }
    }
}

#[derive(Deserialize)]
struct ConfigFile {
    id2label: Option<BTreeMap<String, String>>,
    #[serde(default)]
    raw_ids: Vec<u16>,
    #[serde(default)]
    colors: Vec<[u8; 3]>,
}

impl Labels {
    /// Reads `config.json`; no names where it has none, or only placeholders (`LABEL_0`).
    pub fn parse(file: &str, text: &str) -> Result<Labels, SegmentError> {
        let name = format!("{file} (config.json)");
        let read: ConfigFile = serde_json::from_str(text)
            .map_err(|e| invalid(&name, "JSON", e, "id2label: {\"0\": \"wall\"}"))?;
        let mut meanings = Vec::new();
        let listed = read.id2label.unwrap_or_default();
        if !listed.iter().all(|(id, label)| *label == format!("LABEL_{id}")) {
            for (id, label) in &listed {
                let id: usize = id.parse().ok().filter(|&i| i < MAX_CLASSES).ok_or_else(|| {
                    invalid(&name, "id2label", id, format!("indices from 0 to {MAX_CLASSES}"))
                })?;
                if meanings.len() <= id {
                    meanings.resize(id + 1, Meaning::Untrained);
                }
                meanings[id] = Meaning::of(label);
            }
        }
        for (field, found) in [("raw_ids", read.raw_ids.len()), ("colors", read.colors.len())] {
            if found != 0 && found != meanings.len() {
                return Err(invalid(&name, field, format!("{found} entries"), meanings.len()));
            }
        }
        Ok(Labels { meanings, raw_ids: read.raw_ids, colors: read.colors })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_say_a_size_is_read() {
        let size = |text: &str, image| {
            Preprocessing::parse("m", text).map(|p| p.input_size(image)).map_err(|e| e.to_string())
        };
        assert_eq!(size(r#"{"size": {"width": 512, "height": 384}}"#, [640, 480]), Ok([512, 384]));
        assert_eq!(size(r#"{"size": 512}"#, [640, 480]), Ok([512, 512]));
        assert_eq!(size(r#"{"size": {"shortest_edge": 384}}"#, [640, 480]), Ok([512, 384]));
        assert_eq!(
            size(r#"{"size": {"shortest_edge": 384, "longest_edge": 400}}"#, [640, 480]),
            Ok([416, 288])
        );
        assert_eq!(
            size(r#"{"size": {"longest_edge": 256}, "size_divisor": 16}"#, [480, 640]),
            Ok([192, 256])
        );
        assert_eq!(size(r#"{"do_resize": false}"#, [330, 250]), Ok([320, 256]));
        assert_eq!(size("{}", [640, 480]), Ok([384, 288]));
        for (text, part) in [
            ("[", "JSON"),
            (r#"{"size": {"width": 0, "height": 4}}"#, "size.width"),
            (r#"{"size": "big"}"#, "size"),
            (r#"{"size": 1e9}"#, "size"),
            (r#"{"image_mean": [1, 2]}"#, "image_mean"),
            (r#"{"image_std": [1, 2, 0]}"#, "image_std"),
            (r#"{"size_divisor": 100000}"#, "size_divisor"),
        ] {
            let error = size(text, [4, 4]).unwrap_err();
            assert!(error.contains(part) && error.contains("m (pre"), "{text}: {error}");
        }
    }

    #[test]
    fn names_are_read_and_placeholders_are_none() {
        let labels = |text: &str| Labels::parse("m", text).map_err(|e| e.to_string());
        let read = labels(
            r#"{"id2label": {"0": "", "1": "wall", "2": "Background"}, "raw_ids": [9, 3, 4]}"#,
        );
        let read = read.unwrap();
        assert_eq!(
            read.meanings,
            [Meaning::Untrained, Meaning::Class("wall".into()), Meaning::None]
        );
        assert_eq!(read.raw_ids, [9, 3, 4]);
        assert!(
            labels(r#"{"id2label": {"0": "LABEL_0", "1": "LABEL_1"}}"#)
                .unwrap()
                .meanings
                .is_empty()
        );
        assert!(labels("{}").unwrap().meanings.is_empty());
        assert!(labels(r#"{"id2label": {"x": "wall"}}"#).unwrap_err().contains("id2label"));
        assert!(
            labels(r#"{"id2label": {"0": "wall"}, "colors": [[1,2,3],[1,2,3]]}"#)
                .unwrap_err()
                .contains("colors")
        );
    }
}
