//! A network, ready to be used.
use crate::{
    config::{InputSize, MAX_SIDE, Preprocessing, SizeRule},
    error::{SegmentError, invalid},
    files::ModelFiles,
    names::{Labels, Meaning, by_count},
    network::{Network, Tensor},
    output::{Classes, Features, Order, Understood, understand},
    resize::{Turn, resized},
    scores::{ClassProbability, Classified, LIKELIEST, Scores, Target},
};
use mte_slam_types::{
    classes::{Class, ClassTable, UNLABELLED, class_color},
    frame::{FeatureMap, MAX_FEATURE_CHANNELS},
    groups::Groups,
};

/// How a network is used.
#[derive(Clone, Debug, Default)]
pub struct SegmenterOptions {
    /// Size of its input, instead of what its files say.
    pub size: Option<InputSize>,
    /// Pixels whose likeliest class is less likely than this (0 to 1) stay unlabelled.
    pub min_confidence: f32,
    /// Merges classes: probabilities of a group add up.
    pub groups: Option<Groups>,
    /// What brings the images upright, for networks know upright rooms.
    pub turn: Turn,
    /// Threads \[default: one per core\].
    pub threads: Option<usize>,
}

/// What a network says of an image, row-major, of the image's size.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// Compact indices of [`Segmenter::classes`], or [`UNLABELLED`].
    pub labels: Vec<u8>,
    /// Probability of the likeliest class, in 1/255.
    pub confidence: Vec<u8>,
    /// The likeliest classes, descending.
    pub likeliest: Vec<[ClassProbability; LIKELIEST]>,
    /// Features of the image, where the network has such an output.
    pub features: Option<FeatureMap>,
}

/// A segmentation network.
pub struct Segmenter {
    network: Network,
    preprocessing: Preprocessing,
    understood: Understood,
    probabilities: bool,
    targets: Vec<Target>,
    table: ClassTable,
    feature_channels: usize,
    turn: Turn,
    least: f32,
    summary: String,
    warnings: Vec<String>,
}

impl Segmenter {
    /// Loads a network, and runs it once on a grey image to see what it answers.
    ///
    /// # Errors
    /// [`SegmentError`] when it cannot be loaded or run, or its input or outputs are not those of a
    /// segmentation network.
    pub fn load(files: ModelFiles, options: &SegmenterOptions) -> Result<Segmenter, SegmentError> {
        let name = files.name;
        if !(0.0..=1.0).contains(&options.min_confidence) {
            return Err(invalid(&name, "least confidence", options.min_confidence, "0 to 1"));
        }
        let mut preprocessing = match &files.preprocessor {
            Some(text) => Preprocessing::parse(&name, text)?,
            None => Preprocessing::default(),
        };
        let labels = match &files.config {
            Some(text) => Labels::parse(&name, text)?,
            None => Labels::default(),
        };
        let network = Network::load(&name, files.onnx, options.threads)?;
        let mut warnings = network.warnings.clone();
        size_of_input(&name, &network, &mut preprocessing, options.size)?;

        let size = preprocessing.input_size([640, 480]);
        let grey = vec![[128u8; 3]; size[0] * size[1]];
        let outputs = network.run(&network.input_of(&grey, size, &preprocessing))?;
        let shown: Vec<_> = outputs.iter().map(Tensor::output).collect();
        let [w, h] = size;
        let understood = understand(&name, &shown, [h, w], labels.meanings.len())?;
        let feature_channels = match understood.features {
            None => 0,
            Some(Features::Grid { output, order: Order::ChannelsFirst }) => shown[output].shape[1],
            Some(Features::Grid { output, .. }) => shown[output].shape[3],
            Some(Features::Tokens { output, .. }) => shown[output].shape[2],
        };
        if feature_channels > MAX_FEATURE_CHANNELS {
            let most = format!("at most {MAX_FEATURE_CHANNELS}");
            return Err(invalid(&name, "channels of the features", feature_channels, most));
        }
        let scores = scores_of(&outputs, understood.classes);
        let count = match (&scores, labels.meanings.len()) {
            (Some(scores), _) => scores.classes,
            // A map says nothing of classes that it does not show.
            (None, 0) => usize::from(UNLABELLED),
            (None, named) => named,
        };
        let probabilities = scores.is_some_and(|s| s.probabilities || s.look_like_probabilities());
        let (labels, from) = named(&name, labels, count, &mut warnings)?;
        let (table, targets) = table_of(&name, &labels, options.groups.as_ref())?;
        let summary = summary(&network, &preprocessing, size, &shown, understood, &table, from);
        let network = network.only(&needed(understood));
        let understood = renumbered(understood);
        Ok(Segmenter {
            network,
            preprocessing,
            understood,
            probabilities,
            targets,
            table,
            feature_channels,
            turn: options.turn,
            least: options.min_confidence,
            summary,
            warnings,
        })
    }

    /// The classes that it tells apart, or their groups.
    pub fn classes(&self) -> &ClassTable {
        &self.table
    }

    /// Channels of the features; 0 without.
    pub fn feature_channels(&self) -> usize {
        self.feature_channels
    }

    /// The model's file.
    pub fn name(&self) -> &str {
        &self.network.name
    }

    /// What was understood of input and output, in a line.
    pub fn summary(&self) -> &str {
        &self.summary
    }

    /// What was assumed, and what may be wrong.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Segments an sRGB image of `width` x `height` pixels, row-major.
    ///
    /// # Errors
    /// [`SegmentError`] for an image of another size than said, and when the network fails.
    pub fn segment(
        &mut self,
        color: &[[u8; 3]],
        width: usize,
        height: usize,
    ) -> Result<Segmentation, SegmentError> {
        let name = &self.network.name;
        if color.len() != width * height || color.is_empty() {
            let expected = format!("{width} x {height}, and at least one");
            return Err(invalid(name, "pixels of the image", color.len(), expected));
        }
        let size = [width, height];
        let upright = self.turn.turned(color, size);
        let turned = self.turn.size(size);
        let input_size = self.preprocessing.input_size(turned);
        let input = resized(&upright, turned, input_size, self.preprocessing.filter);
        let outputs =
            self.network.run(&self.network.input_of(&input, input_size, &self.preprocessing))?;
        let changed = |what: &str| SegmentError::Run {
            model: name.clone(),
            reason: format!("{what} are not those of the first run"),
        };
        let classified = match self.understood.classes {
            Classes::Map { output } => {
                let (grid, map) = outputs[output].map().ok_or_else(|| changed("its classes"))?;
                Classified::of_map(map, grid, turned, &self.targets)
            }
            classes => {
                let scores = scores_of(&outputs, classes).ok_or_else(|| changed("its scores"))?;
                if scores.classes != self.targets.len() {
                    return Err(changed("its classes"));
                }
                let probabilities = scores.probabilities || self.probabilities;
                Scores { probabilities, ..scores }.classify(turned, &self.targets, self.least)
            }
        };
        let features = match self.understood.features {
            None => None,
            Some(features) => {
                let found = features_of(&outputs, features, input_size)
                    .ok_or_else(|| changed("its features"))?;
                Some(turned_back(found, self.turn))
            }
        };
        let back = self.turn.inverse();
        Ok(Segmentation {
            labels: back.turned(&classified.labels, turned),
            confidence: back.turned(&classified.confidence, turned),
            likeliest: back.turned(&classified.likeliest, turned),
            features,
        })
    }
}

/// Brings together what the options, the files and the network say of the input's size.
fn size_of_input(
    name: &str,
    network: &Network,
    preprocessing: &mut Preprocessing,
    given: Option<InputSize>,
) -> Result<(), SegmentError> {
    let fixed = network.fixed_size;
    if let Some(size) = given {
        if [size.width, size.height].iter().any(|x| !(8..=MAX_SIDE).contains(x)) {
            let found = format!("{} x {}", size.width, size.height);
            return Err(invalid(
                name,
                "size of the input",
                found,
                format!("8 to {MAX_SIDE} pixels"),
            ));
        }
        preprocessing.size = SizeRule::Exact(size);
    }
    if let Some(fixed) = fixed {
        if given.is_some_and(|size| size != fixed) {
            let expected =
                format!("{} x {}, which the network asks for", fixed.width, fixed.height);
            return Err(invalid(name, "size of the input", format!("{given:?}"), expected));
        }
        preprocessing.size = SizeRule::Exact(fixed);
    }
    Ok(())
}

/// What the `count` classes mean, and who says so.
fn named(
    name: &str,
    labels: Labels,
    count: usize,
    warnings: &mut Vec<String>,
) -> Result<(Labels, &'static str), SegmentError> {
    let found = labels.meanings.len();
    if found > count {
        let (found, expected) = (format!("{found} names"), format!("{count}, as its output has"));
        return Err(invalid(name, "id2label of config.json", found, expected));
    }
    if found > 0 {
        let mut labels = labels;
        labels.meanings.resize(count, Meaning::Untrained);
        return Ok((labels, "config.json"));
    }
    if let Some((set, labels)) = by_count(count) {
        warnings.push(format!(
            "{name}: no names of the classes: there are {count}, so those of {set} are taken; a \
             config.json beside the model can name them"
        ));
        return Ok((labels, set));
    }
    warnings.push(format!(
        "{name}: no names of its {count} classes: expected a config.json beside it, {{\"id2label\": \
         {{\"0\": \"wall\"}}}}"
    ));
    let meanings = (0..count).map(|i| Meaning::Class(format!("class {i}"))).collect();
    Ok((Labels { meanings, ..Labels::default() }, "numbers"))
}

/// The table of classes, and what becomes of each class of the network.
fn table_of(
    name: &str,
    labels: &Labels,
    groups: Option<&Groups>,
) -> Result<(ClassTable, Vec<Target>), SegmentError> {
    let mut classes = Vec::new();
    let mut targets = Vec::new();
    for (i, meaning) in labels.meanings.iter().enumerate() {
        targets.push(match meaning {
            Meaning::None => Target::None,
            Meaning::Untrained => Target::Skip,
            Meaning::Class(text) => {
                let raw_id = labels.raw_ids.get(i).copied().unwrap_or(i as u16);
                let color = labels.colors.get(i).copied().unwrap_or_else(|| class_color(raw_id));
                classes.push(Class { raw_id, name: text.clone(), color });
                Target::Class((classes.len() - 1).min(usize::from(UNLABELLED)) as u8)
            }
        });
    }
    let most = usize::from(UNLABELLED);
    if classes.is_empty() || classes.len() > most {
        return Err(invalid(name, "classes", classes.len(), format!("1 to {most}")));
    }
    let mut ids: Vec<u16> = classes.iter().map(|c| c.raw_id).collect();
    ids.sort_unstable();
    if let Some(twice) = ids.windows(2).find(|w| w[0] == w[1]) {
        return Err(invalid(
            name,
            "raw_ids of config.json",
            format!("{} twice", twice[0]),
            "each once",
        ));
    }
    // In the order of their ids, as lists of data sets are.
    let mut order: Vec<usize> = (0..classes.len()).collect();
    order.sort_by_key(|&i| classes[i].raw_id);
    let mut places = vec![0u8; classes.len()];
    order.iter().enumerate().for_each(|(place, &i)| places[i] = place as u8);
    for target in &mut targets {
        if let Target::Class(c) = target {
            *c = places[usize::from(*c)];
        }
    }
    let table = ClassTable { classes: order.iter().map(|&i| classes[i].clone()).collect() };
    let Some(groups) = groups else { return Ok((table, targets)) };
    let (merged, map) = groups.merge(&table);
    if merged.is_empty() {
        let expected = "groups that hold some of the network's classes";
        return Err(invalid(groups.name(), "groups", "none of the network's classes", expected));
    }
    let target = |t: Target| match t {
        Target::Class(c) => match map[usize::from(c)] {
            // It is something, but of no group.
            UNLABELLED => Target::None,
            group => Target::Class(group),
        },
        same => same,
    };
    Ok((merged, targets.into_iter().map(target).collect()))
}

fn summary(
    network: &Network,
    preprocessing: &Preprocessing,
    [w, h]: [usize; 2],
    outputs: &[crate::output::Output],
    understood: Understood,
    table: &ClassTable,
    names: &str,
) -> String {
    let output = match understood.classes {
        Classes::Scores { output, order } => {
            let kind =
                if order == Order::ChannelsFirst { "scores" } else { "scores, channels last" };
            format!("{} {:?} ({kind})", outputs[output].name, outputs[output].shape)
        }
        Classes::Map { output } => {
            format!("{} {:?} (a map of classes)", outputs[output].name, outputs[output].shape)
        }
        Classes::Queries { classes, masks } => format!(
            "{} {:?} and {} {:?} (queries and their masks)",
            outputs[classes].name,
            outputs[classes].shape,
            outputs[masks].name,
            outputs[masks].shape
        ),
    };
    let features = match understood.features {
        None => String::new(),
        Some(Features::Grid { output, .. } | Features::Tokens { output, .. }) => {
            format!(", {} {:?} (features)", outputs[output].name, outputs[output].shape)
        }
    };
    format!(
        "input {} {w} x {h} for 640 x 480, mean {:?}, deviation {:?} ({}); output {output}{features}; {} \
         classes (names: {names})",
        network.input_name,
        preprocessing.mean,
        preprocessing.deviation,
        preprocessing.source,
        table.len()
    )
}

/// The outputs that are used, in the order in which they are asked for from now on.
fn needed(understood: Understood) -> Vec<usize> {
    let mut all = match understood.classes {
        Classes::Scores { output, .. } | Classes::Map { output } => vec![output],
        Classes::Queries { classes, masks } => vec![classes, masks],
    };
    match understood.features {
        Some(Features::Grid { output, .. } | Features::Tokens { output, .. }) => all.push(output),
        None => {}
    }
    all
}

/// The same where only the needed outputs are left.
fn renumbered(mut understood: Understood) -> Understood {
    let used = match &mut understood.classes {
        Classes::Scores { output, .. } | Classes::Map { output } => {
            *output = 0;
            1
        }
        Classes::Queries { classes, masks } => {
            (*classes, *masks) = (0, 1);
            2
        }
    };
    match &mut understood.features {
        Some(Features::Grid { output, .. } | Features::Tokens { output, .. }) => *output = used,
        None => {}
    }
    understood
}

fn scores_of(outputs: &[Tensor], classes: Classes) -> Option<Scores> {
    match classes {
        Classes::Map { .. } => None,
        Classes::Scores { output, order } => {
            let (values, shape) = outputs[output].floats()?;
            let &[1, a, b, c] = shape else { return None };
            let [n, rows, columns] =
                if order == Order::ChannelsFirst { [a, b, c] } else { [c, a, b] };
            let values = match order {
                Order::ChannelsLast => values.to_vec(),
                Order::ChannelsFirst => transposed(values, n, rows * columns),
            };
            Some(Scores { columns, rows, classes: n, values, probabilities: false })
        }
        Classes::Queries { classes, masks } => {
            let (of_queries, shape) = outputs[classes].floats()?;
            let &[1, queries, with_none] = shape else { return None };
            let (masks, shape) = outputs[masks].floats()?;
            let &[1, n, rows, columns] = shape else { return None };
            (n == queries && with_none > 1).then(|| {
                let classes = with_none - 1;
                let mut values = vec![0.0f32; rows * columns * classes];
                for q in 0..queries {
                    let scores = &of_queries[q * with_none..][..with_none];
                    let most = scores.iter().copied().fold(f32::MIN, f32::max);
                    let sum: f32 = scores.iter().map(|s| (s - most).exp()).sum();
                    let shares: Vec<f32> =
                        scores[..classes].iter().map(|s| (s - most).exp() / sum).collect();
                    let mask = &masks[q * rows * columns..][..rows * columns];
                    for (m, cell) in mask.iter().zip(values.chunks_exact_mut(classes)) {
                        let inside = 1.0 / (1.0 + (-m).exp());
                        cell.iter_mut().zip(&shares).for_each(|(v, s)| *v += inside * s);
                    }
                }
                Scores { columns, rows, classes, values, probabilities: true }
            })
        }
    }
}

/// From channels first to channels last.
fn transposed(values: &[f32], channels: usize, cells: usize) -> Vec<f32> {
    let mut out = vec![0.0; values.len()];
    for c in 0..channels {
        for (i, v) in values[c * cells..][..cells].iter().enumerate() {
            out[i * channels + c] = *v;
        }
    }
    out
}

fn features_of(outputs: &[Tensor], features: Features, [w, h]: [usize; 2]) -> Option<FeatureMap> {
    match features {
        Features::Grid { output, order } => {
            let (values, shape) = outputs[output].floats()?;
            let &[1, a, b, c] = shape else { return None };
            Some(match order {
                Order::ChannelsFirst => {
                    FeatureMap { channels: a, height: b, width: c, values: values.to_vec() }
                }
                Order::ChannelsLast => FeatureMap {
                    channels: c,
                    height: a,
                    width: b,
                    values: transposed(values, a * b, c),
                },
            })
        }
        Features::Tokens { output, skipped, rows, columns } => {
            let (values, shape) = outputs[output].floats()?;
            let &[1, count, channels] = shape else { return None };
            // Another image may be of another shape: the patches are as large as they were.
            let patches = count.checked_sub(skipped)?;
            let [rows, columns] = if patches == rows * columns {
                [rows, columns]
            } else {
                [8, 14, 16, 32]
                    .into_iter()
                    .map(|p| [h / p, w / p])
                    .find(|[r, c]| r * c == patches)?
            };
            let values = transposed(&values[skipped * channels..], patches, channels);
            Some(FeatureMap { channels, height: rows, width: columns, values })
        }
    }
}

/// Features of an upright image, turned back to the image as it was taken.
fn turned_back(features: FeatureMap, turn: Turn) -> FeatureMap {
    let size = [features.width, features.height];
    let back = turn.inverse();
    let plane = features.width * features.height;
    let values =
        features.values.chunks_exact(plane.max(1)).flat_map(|p| back.turned(p, size)).collect();
    let [width, height] = back.size(size);
    FeatureMap { width, height, values, ..features }
}
