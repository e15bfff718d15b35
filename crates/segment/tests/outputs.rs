//! Every kind of output, with known answers; and files that are none of them.
mod onnx;

use mte_slam_segment::{
    InputSize, MAX_MODEL_BYTES, ModelFiles, SegmentError, Segmentation, Segmenter,
    SegmenterOptions, Turn,
};
use mte_slam_types::{classes::UNLABELLED, groups::Groups};
use onnx::{Attribute, COLORS, Graph, NAMES, PLAIN, floats, node, value};

fn files(onnx: Vec<u8>) -> ModelFiles {
    ModelFiles {
        name: "m.onnx".into(),
        onnx,
        config: Some(NAMES.into()),
        preprocessor: Some(PLAIN.into()),
    }
}

fn load(graph: &Graph) -> Result<Segmenter, SegmentError> {
    Segmenter::load(files(graph.model()), &SegmenterOptions::default())
}

/// Compact indices of the network's classes: in the order of their ids.
const PLACES: [u8; 4] = [1, 0, 2, 3];
const W: usize = 16;
const H: usize = 12;

/// Cells of 4 x 4 pixels in near colours, and their classes pixel by pixel.
fn image() -> (Vec<[u8; 3]>, Vec<u8>) {
    let class = |i: usize| ((i % W / 4) * 3 + i / W / 4) % 4;
    let pixel = |i: usize| COLORS[class(i)].map(|x| x - (i % 7) as u8);
    ((0..W * H).map(pixel).collect(), (0..W * H).map(|i| PLACES[class(i)]).collect())
}

fn segment(segmenter: &mut Segmenter) -> Segmentation {
    segmenter.segment(&image().0, W, H).unwrap()
}

/// The format lets a convolution's kernel be as large as its weights say.
#[test]
fn a_kernel_without_a_shape_has_that_of_its_weights() {
    let mut graph = Graph::colors(1);
    graph.nodes[0] = node("Conv", &["image", "w", "b"], "logits", &[]);
    assert_eq!(segment(&mut load(&graph).unwrap()).labels, image().1);
}

/// The shared model with a known answer, where it is at hand.
#[test]
fn the_tiny_model_names_the_nearest_of_its_colors() {
    let folder =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/models/tiny");
    let Ok(files) = ModelFiles::open(&folder, MAX_MODEL_BYTES) else { return };
    let mut segmenter = Segmenter::load(files, &SegmenterOptions::default()).unwrap();
    let names: Vec<&str> = segmenter.classes().classes.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["wall", "floor", "chair", "plant"]);
    let found = segmenter.segment(&vec![[30, 160, 40]; 64 * 64], 64, 64).unwrap();
    assert!(found.labels.iter().all(|l| *l == found.labels[0] && *l < 4));
}

/// All ways to say the same give the same classes.
#[test]
fn every_kind_of_output_gives_the_same_map() {
    let argmax = |keep| {
        node(
            "ArgMax",
            &["logits"],
            "map",
            &[Attribute::Int("axis", 1), Attribute::Int("keepdims", keep)],
        )
    };
    let kinds = [
        ("scores", Graph::colors(1)),
        (
            "channels last",
            Graph::colors(1).then(
                node("Transpose", &["logits"], "last", &[Attribute::Ints("perm", &[0, 2, 3, 1])]),
                value("last", 1, &["1", "r", "c", "4"]),
            ),
        ),
        (
            "probabilities",
            Graph::colors(1).then(
                node("Softmax", &["logits"], "p", &[Attribute::Int("axis", 1)]),
                value("p", 1, &["1", "4", "r", "c"]),
            ),
        ),
        ("a map", Graph::colors(1).then(argmax(0), value("map", 7, &["1", "r", "c"]))),
        (
            "a map with a channel",
            Graph::colors(1).then(argmax(1), value("map", 7, &["1", "1", "r", "c"])),
        ),
    ];
    let expected = image().1;
    let mut confidences = Vec::new();
    for (name, graph) in kinds {
        let mut segmenter = load(&graph).unwrap();
        let found = segment(&mut segmenter);
        assert_eq!(found.labels, expected, "{name}: {}", segmenter.summary());
        assert!(found.features.is_none(), "{name}");
        let ids: Vec<u16> = segmenter.classes().classes.iter().map(|c| c.raw_id).collect();
        assert_eq!(ids, [3, 7, 9, 20]);
        confidences.push(found.confidence);
    }
    // Probabilities are not made into probabilities again, and a map is certain.
    assert_eq!(confidences[0], confidences[1]);
    assert!(confidences[0].iter().zip(&confidences[2]).all(|(a, b)| a.abs_diff(*b) <= 1));
    assert!(confidences[0].iter().any(|c| *c < 255) && confidences[3].iter().all(|c| *c == 255));
}

#[test]
fn scores_of_cells_are_brought_to_the_pixels() {
    let mut segmenter = load(&Graph::colors(4)).unwrap();
    assert!(segmenter.summary().contains("[1, 4, 120, 160]"), "{}", segmenter.summary());
    let (found, expected) = (segment(&mut segmenter), image().1);
    // The centres of cells; between them the borders are soft.
    for i in (0..W * H).filter(|i| matches!(i % 4, 1 | 2) && matches!(i / W % 4, 1 | 2)) {
        assert_eq!(found.labels[i], expected[i], "{i}");
    }
    assert!(found.labels.iter().zip(&expected).filter(|(a, b)| a == b).count() * 10 > 9 * W * H);
}

#[test]
fn queries_and_masks_are_added_up() {
    // Six queries: the four colours, one that is no object, and one that halves between two.
    let mut classes = vec![-9.0f32; 6 * 5];
    for q in 0..4 {
        classes[q * 5 + q] = 9.0;
    }
    classes[4 * 5 + 4] = 9.0;
    (classes[5 * 5], classes[5 * 5 + 1]) = (1.0, 1.0);
    let mut graph = Graph::colors(1);
    let mut pick = vec![0.0f32; 6 * 4];
    (0..4).for_each(|q| pick[q * 4 + q] = 40.0);
    graph.constants.extend([
        floats("classes", &[1, 6, 5], &classes),
        floats("pick", &[6, 4, 1, 1], &pick),
        floats("shift", &[6], &[-20.0, -20.0, -20.0, -20.0, 30.0, -30.0]),
    ]);
    graph.nodes.push(node("Softmax", &["logits"], "p", &[Attribute::Int("axis", 1)]));
    graph.nodes.push(node("Identity", &["classes"], "class_queries_logits", &[]));
    graph.nodes.push(node(
        "Conv",
        &["p", "pick", "shift"],
        "masks_queries_logits",
        &[Attribute::Ints("kernel_shape", &[1, 1])],
    ));
    graph.outputs = vec![
        value("masks_queries_logits", 1, &["1", "6", "r", "c"]),
        value("class_queries_logits", 1, &["1", "6", "5"]),
    ];
    let mut segmenter = load(&graph).unwrap();
    assert!(segmenter.summary().contains("queries"), "{}", segmenter.summary());
    assert_eq!(segment(&mut segmenter).labels, image().1);
}

#[test]
fn a_second_output_gives_features() {
    let graph = Graph::colors(1).and(
        node(
            "AveragePool",
            &["logits"],
            "features",
            &[Attribute::Ints("kernel_shape", &[4, 4]), Attribute::Ints("strides", &[4, 4])],
        ),
        value("features", 1, &["1", "4", "r4", "c4"]),
    );
    let mut segmenter = load(&graph).unwrap();
    assert_eq!(segmenter.feature_channels(), 4);
    let found = segment(&mut segmenter);
    let features = found.features.unwrap();
    assert_eq!((features.channels, features.height, features.width), (4, 3, 4));
    // The largest channel of a cell is its class.
    for cell in 0..12 {
        let at = |c: usize| features.values[c * 12 + cell];
        let best = (0..4).max_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap();
        assert_eq!(PLACES[best], found.labels[cell / 4 * 4 * W + cell % 4 * 4]);
    }
}

#[test]
fn inputs_of_bytes_with_channels_last_and_of_one_size_are_served() {
    let mut graph = Graph::colors(1);
    graph.nodes.splice(
        0..0,
        [
            node("Cast", &["bytes"], "f", &[Attribute::Int("to", 1)]),
            node("Mul", &["f", "k"], "g", &[]),
            node("Transpose", &["g"], "image", &[Attribute::Ints("perm", &[0, 3, 1, 2])]),
        ],
    );
    graph.constants.push(floats("k", &[1], &[1.0 / 255.0]));
    graph.input = value("bytes", 2, &["1", "24", "32", "3"]);
    let mut segmenter = load(&graph).unwrap();
    assert!(segmenter.summary().contains("32 x 24"), "{}", segmenter.summary());
    let found = segment(&mut segmenter);
    let same = found.labels.iter().zip(&image().1).filter(|(a, b)| a == b).count();
    assert!(same * 100 > 85 * W * H, "{same}");
    let options =
        SegmenterOptions { size: Some(InputSize { width: 64, height: 48 }), ..Default::default() };
    let error = Segmenter::load(files(graph.model()), &options).err().unwrap().to_string();
    assert!(error.contains("32 x 24"), "{error}");
}

#[test]
fn what_is_turned_comes_back_as_it_was() {
    for turn in [Turn::Right, Turn::Half, Turn::Left] {
        let options = SegmenterOptions { turn, ..Default::default() };
        let mut segmenter = Segmenter::load(files(Graph::colors(1).model()), &options).unwrap();
        assert_eq!(segment(&mut segmenter).labels, image().1, "{turn:?}");
    }
}

#[test]
fn groups_merge_and_the_doubtful_stays_unlabelled() {
    let groups =
        Groups::parse("g", r#"{"red": "warm", "light": "warm", "green": "cold"}"#).unwrap();
    let options =
        SegmenterOptions { groups: Some(groups), min_confidence: 0.5, ..Default::default() };
    let mut segmenter = Segmenter::load(files(Graph::colors(1).model()), &options).unwrap();
    let names: Vec<&str> = segmenter.classes().classes.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["cold", "warm"]);
    let found = segment(&mut segmenter);
    for (label, class) in found.labels.iter().zip(image().1) {
        // green, red, blue, light
        assert_eq!(*label, [0, 1, UNLABELLED, 1][usize::from(class)]);
    }
    // Halfway between two colours.
    let between = vec![[120u8, 120, 40]; 16];
    let options = SegmenterOptions { min_confidence: 0.9, ..Default::default() };
    let mut segmenter = Segmenter::load(files(Graph::colors(1).model()), &options).unwrap();
    assert_eq!(segmenter.segment(&between, 4, 4).unwrap().labels, [UNLABELLED; 16]);
}

#[test]
fn damaged_and_strange_files_are_errors() {
    let whole = Graph::colors(1).model();
    let mut refused = 0;
    for cut in 0..whole.len() {
        refused += usize::from(
            Segmenter::load(files(whole[..cut].to_vec()), &SegmenterOptions::default()).is_err(),
        );
    }
    // The last bytes are sizes that the file can do without.
    assert!(refused + 80 > whole.len(), "{refused} of {}", whole.len());
    for i in 0..whole.len() {
        for bit in [0, 3, 7] {
            let mut bad = whole.clone();
            bad[i] ^= 1 << bit;
            if let Ok(mut segmenter) = Segmenter::load(files(bad), &SegmenterOptions::default()) {
                let _ = segmenter.segment(&image().0, W, H);
            }
        }
    }
    let error = |graph: &Graph| load(graph).err().unwrap().to_string();
    let mean = Graph::colors(1).then(
        node("GlobalAveragePool", &["logits"], "mean", &[]),
        value("mean", 1, &["1", "4", "1", "1"]),
    );
    let text = error(&mean);
    assert!(text.contains("mean [1, 4, 1, 1]") && text.contains("MaskFormer"), "{text}");
    let mut unknown = Graph::colors(1);
    unknown.nodes[0] = node("Frobnicate", &["image", "w", "b"], "logits", &[]);
    assert!(error(&unknown).contains("Frobnicate"), "{}", error(&unknown));
    let mut two = Graph::colors(1);
    two.input = value("image", 1, &["1", "5", "h", "w"]);
    assert!(error(&two).contains("image [1, 5, h, w]"), "{}", error(&two));
    let names =
        ModelFiles { config: Some(r#"{"id2label": {"9": "x"}}"#.into()), ..files(whole.clone()) };
    let text = Segmenter::load(names, &SegmenterOptions::default()).err().unwrap().to_string();
    assert!(text.contains("expected"), "{text}");
    let mut segmenter = load(&Graph::colors(1)).unwrap();
    assert!(segmenter.segment(&[[0; 3]; 5], 2, 3).unwrap_err().to_string().contains("2 x 3"));
}

#[test]
fn without_files_beside_it_a_network_is_taken_as_usual() {
    let bare =
        ModelFiles { name: "m".into(), onnx: Graph::colors(4).model(), ..ModelFiles::default() };
    let segmenter = Segmenter::load(bare, &SegmenterOptions::default()).unwrap();
    assert!(segmenter.summary().contains("384 x 288") && segmenter.summary().contains("0.485"));
    assert!(
        segmenter.warnings()[0].contains("no names of its 4 classes"),
        "{:?}",
        segmenter.warnings()
    );
    assert_eq!(segmenter.classes().classes[2].name, "class 2");
}

#[test]
fn a_folder_is_searched_and_a_large_file_refused_with_numbers() {
    let folder = std::env::temp_dir().join(format!("mte-slam-segment-{}", std::process::id()));
    let inner = folder.join("onnx");
    std::fs::create_dir_all(&inner).unwrap();
    std::fs::write(inner.join("model.onnx"), Graph::colors(1).model()).unwrap();
    std::fs::write(folder.join("config.json"), NAMES).unwrap();
    let found = ModelFiles::open(&folder, MAX_MODEL_BYTES).unwrap();
    assert_eq!((found.config.as_deref(), found.preprocessor), (Some(NAMES), None));
    let error = ModelFiles::open(&folder, 100).unwrap_err();
    assert!(matches!(error, SegmentError::TooLarge { limit: 100, .. }), "{error}");
    std::fs::remove_file(inner.join("model.onnx")).unwrap();
    let error = ModelFiles::open(&folder, 100).unwrap_err().to_string();
    assert!(error.contains("no .onnx file") && error.contains("model.onnx"), "{error}");
    for name in ["a.onnx", "b.onnx"] {
        std::fs::write(folder.join(name), "x").unwrap();
    }
    assert!(ModelFiles::open(&folder, 100).unwrap_err().to_string().contains("2 .onnx files"));
    assert!(ModelFiles::open(&folder.join("none"), 1).unwrap_err().to_string().contains("no such"));
    std::fs::remove_dir_all(&folder).unwrap();
}
