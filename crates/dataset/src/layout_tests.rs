//! What is particular to ScanNet, packed recordings, nerfstudio and plain folders.
use super::{test_support::*, *};
use mte_slam_types::{
    classes::UNLABELLED,
    pose::Pose,
    sequence::{SequenceError, Source},
};

const TRANSFORMS: &str = "transforms.json";

fn assert_has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
}

/// A text file with something replaced.
fn replace(m: &mut MemorySource, file: &str, from: &str, to: &str) {
    let text = String::from_utf8(m.get(file).unwrap().to_vec()).unwrap();
    assert!(text.contains(from), "{from} is not in {text}");
    m.insert(file, text.replacen(from, to, 1));
}

fn png_of(w: u32, h: u32, value: u16) -> Vec<u8> {
    let mut bytes = Vec::new();
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(w, h, image::Luma([value]));
    image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    bytes
}

/// Files that may only be read in parts of a bounded length.
struct InParts {
    files: MemorySource,
    longest: usize,
}

impl Source for InParts {
    fn name(&self) -> &str {
        self.files.name()
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        self.files.list()
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        assert!(!file.ends_with(".sens"), "{file} is read as a whole");
        self.files.read(file)
    }

    fn size(&self, file: &str) -> Result<u64, SequenceError> {
        self.files.size(file)
    }

    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        assert!(bytes <= self.longest, "{bytes} bytes of {file} at once");
        self.files.read_range(file, offset, bytes)
    }
}

#[test]
fn packed_recordings_are_read_in_parts() {
    let files = sens(12);
    let size = files.get("tiny.sens").unwrap().len();
    let source = InParts { files, longest: size / 6 };
    let mut s = open(Box::new(source), OpenOptions::default()).unwrap();
    for i in [0, 11, 5] {
        let got = s.frame(i).unwrap();
        assert_eq!((got.color, got.depth), (frame(i).color, frame(i).depth));
    }
    let mut m = sens(2);
    let other = m.get("tiny.sens").unwrap().to_vec();
    m.insert("other.sens", other);
    assert_has(&error_of(&m, OpenOptions::default()), &["other.sens, tiny.sens", "one .sens file"]);
}

/// Exported ScanNet with raw ids: 0, 7 and 300 are classes of the tiny recording.
fn scannet() -> MemorySource {
    let mut m = renamed(3, Layout::ScanNet);
    for i in 0..3 {
        let labels = m.remove(&format!("semantic_class/semantic_class_{i}.png")).unwrap();
        m.insert(format!("label-filt/{i}.png"), labels);
    }
    m.remove("classes.json");
    m
}

const TABLE: &str = "scannetv2-labels.combined.tsv";

#[test]
fn raw_ids_are_translated_by_the_table_wherever_it_lies() {
    let table = "id\tcategory\tnyu40id\n0\tx\t\n7\tbed\t4\n300\tcup\t40\n";
    for place in [TABLE.to_string(), format!("../{TABLE}"), format!("../../{TABLE}")] {
        let mut m = scannet();
        m.insert(place.clone(), table);
        let mut s = opened(&m).unwrap();
        assert_eq!(s.info().classes.len(), 40, "{place}");
        let labels = s.frame(1).unwrap().labels.unwrap();
        for (got, want) in labels.iter().zip(frame(1).labels.unwrap()) {
            // "floor" is 0, which has no class in the table.
            assert_eq!(*got, [UNLABELLED, 3, 39].get(usize::from(want)).copied().unwrap_or(255));
        }
        // The same labels from elsewhere, by the name of their folder.
        let mut elsewhere = MemorySource::new("scene0000_00_2d-label-filt");
        for i in 0..3 {
            let file = format!("label-filt/{i}.png");
            elsewhere.insert(file.clone(), m.remove(&file).unwrap());
        }
        let labels = LabelSource::Folder(Box::new(elsewhere));
        let mut s = open(Box::new(m), OpenOptions { labels, ..Default::default() }).unwrap();
        assert_eq!(s.frame(1).unwrap().labels.unwrap()[5], 3, "{place}");
    }
    // Without the table the raw ids are classes, and 0 is none.
    let s = opened(&scannet()).unwrap();
    let ids: Vec<u16> = s.info().classes.classes.iter().map(|c| c.raw_id).collect();
    assert_eq!(ids, [1, 7, 300]);
    for (text, parts) in [
        ("", &["columns", "named id"][..]),
        ("id\tname\n1\tx\n", &["columns", "named nyu40id"]),
        ("id\tnyu40id\n70000\t1\n", &["line 2", "0 to 65535"]),
        ("id\tnyu40id\n5\t1\n6\t41\n", &["line 3", "0 to 40"]),
        ("id\tnyu40id\nx\t1\n", &["line 2", "an id"]),
    ] {
        let mut m = scannet();
        m.insert(TABLE, text);
        let e = error_of(&m, OpenOptions::default());
        assert_has(&e, &[TABLE]);
        assert_has(&e, parts);
    }
}

#[test]
fn exported_cameras_and_lost_poses() {
    let mut m = scannet();
    m.remove("cam_params.json");
    m.insert("pose/1.txt", ["-inf"; 16].join(" "));
    m.remove("pose/2.txt");
    let usual = error_of(&m, OpenOptions::default());
    assert_has(&usual, &["24x16", "640x480", "there is no intrinsic/intrinsic_depth.txt"]);
    m.insert("intrinsic/intrinsic_depth.txt", "20 0 11.5 0 0 21 7.25 0 0 0 1 0 0 0 0 1");
    m.insert("intrinsic/intrinsic_color.txt", "20 0 11.5 0 0 21 7.25 0 0 0 1 0 0 0 0 1");
    let s = opened(&m).unwrap();
    assert_eq!(s.info().camera, info().camera);
    assert_eq!(
        [s.truth(0).is_some(), s.truth(1).is_some(), s.truth(2).is_some()],
        [true, false, false]
    );
    assert_has(&s.warnings().join(";"), &["2 frames without a ground-truth pose"]);
    assert!(!s.warnings().join(";").contains("beside it"));
    // A colour camera three pixels to the right.
    m.insert("intrinsic/intrinsic_color.txt", "20 0 14.5 0 0 21 7.25 0 0 0 1 0 0 0 0 1");
    assert_has(&opened(&m).unwrap().warnings().join(";"), &["up to 3.0 pixels beside it"]);
    m.insert("intrinsic/intrinsic_depth.txt", "20 0 11.5");
    assert_has(&error_of(&m, OpenOptions::default()), &["intrinsic_depth.txt", "3 numbers", "4x4"]);
}

#[test]
fn transforms_are_read_as_they_are_meant() {
    let m = renamed(3, Layout::Nerfstudio);
    let s = opened(&m).unwrap();
    assert_has(&s.warnings().join(";"), &["another order"]);
    let changed = |from: &str, to: &str| {
        let mut m = m.clone();
        replace(&mut m, TRANSFORMS, from, to);
        m
    };
    let strict = || OpenOptions { strict: true, ..Default::default() };
    let error = |from: &str, to: &str| error_of(&changed(from, to), strict());
    assert_has(&error("OPENCV", "OPENCV_FISHEYE"), &["camera_model", "OPENCV_FISHEYE", "PINHOLE"]);
    assert_has(&error("\"fl_x\"", "\"fl\""), &["fl_x", "nothing", "camera_angle_x"]);
    assert_has(&error("\"w\":24", "\"w\":24.5"), &["w: found 24.5"]);
    assert_has(
        &error("images/1.png", "images/../../1.png"),
        &["images/../../1.png", "no such file"],
    );
    assert_has(&error("images/1.png", "/etc/hostname"), &["no such file"]);
    assert_has(&error("\"frames\"", "\"frame\""), &["frames", "a list of frames"]);
    assert_has(&error("{", "{\"k4\": 0.1, "), &["k4"]);
    assert_has(&error("integer_depth_scale\":", "integer_depth_scale\":-"), &["metres per unit"]);
    // Python writes what is no number so.
    assert_has(&error("\"fl_x\":20.0", "\"fl_x\":NaN"), &["fl_x", "found \"NaN\"", "a number"]);
    assert_has(&error("\"cx\":12.0", "\"cx\":-Infinity"), &["cx", "\"-Infinity\""]);
    // Depth of one frame is missing, and the pose of another.
    let mut m = changed("depth_file_path", "depth_file");
    replace(&mut m, TRANSFORMS, "transform_matrix", "transform");
    let s = opened(&m).unwrap();
    assert_eq!(s.info().frames, 2);
    assert_has(&s.warnings().join(";"), &["1 frame without depth left out"]);
    assert_has(&error_of(&m, strict()), &["(frame 0): depth: found nothing"]);
    // A field of view in place of a focal length, in other files.
    let angle = 2.0 * (12.0f64 / 20.0).atan();
    let m = changed("\"fl_x\":20.0", &format!("\"camera_angle_x\":{angle}"));
    assert!((opened(&m).unwrap().info().camera.fx - 20.0).abs() < 1e-9);
}

#[test]
fn plain_folders_are_paired_by_number_or_by_order() {
    let m = renamed(3, Layout::Images);
    let mut other = m.clone();
    for i in 0..3 {
        let depth = other.remove(&format!("depth/view{i}.png")).unwrap();
        other.insert(format!("depth/{}.png", 100 + i), depth);
    }
    let mut s = opened(&other).unwrap();
    assert_has(&s.warnings().join(";"), &["paired by their order"]);
    assert_eq!(s.frame(2).unwrap().depth, frame(2).depth);
    other.remove("depth/102.png");
    assert_has(&error_of(&other, OpenOptions::default()), &["3 colour and 2 depth images"]);
    let mut fewer = m.clone();
    fewer.remove("depth/view1.png");
    let s = opened(&fewer).unwrap();
    assert_eq!((s.info().frames, s.number(1)), (2, 2));
    assert_has(&s.warnings().join(";"), &["1 image without its partner"]);
    let strict = OpenOptions { strict: true, ..Default::default() };
    assert_has(&error_of(&fewer, strict), &["1 image without its partner", "for each number"]);
    // The pose is that of its number, though there are fewer frames than lines.
    let off = s.truth(1).unwrap().translation - frame(2).truth.unwrap().translation;
    assert!(off.length() < 1e-9);
}

#[test]
fn a_camera_a_unit_and_axes_may_be_given() {
    let mut m = renamed(2, Layout::Images);
    m.remove("intrinsics.json");
    assert_has(&error_of(&m, OpenOptions::default()), &["images needs", "intrinsics.json"]);
    let camera = GivenCamera::from_numbers(&[30.0, 31.0, 11.0, 7.0]);
    let options = || OpenOptions { camera, ..Default::default() };
    let s = open(Box::new(m.clone()), options()).unwrap();
    let c = s.info().camera;
    assert_eq!((c.fx, c.fy, c.cx, c.cy), (30.0, 31.0, 11.0, 7.0));
    assert_eq!(s.info().depth_unit_m, 1e-3);
    let with = OpenOptions { depth_scale: Some(4000.0), axes: Axes::OpenGl, ..options() };
    let s = open(Box::new(m.clone()), with).unwrap();
    assert_eq!(s.info().depth_unit_m, 1.0 / 4000.0);
    let expected: Pose = frame(1).truth.unwrap().with_flipped_camera();
    assert!((s.truth(1).unwrap().translation - expected.translation).length() < 1e-9);
    assert!(s.truth(1).unwrap().compose(&expected.inverse()).angle_rad() < 1e-7);
    for depth_scale in [0.0, -1.0, f64::NAN] {
        let with = OpenOptions { depth_scale: Some(depth_scale), ..options() };
        assert_has(&error_of(&m, with), &["depth scale", "> 0"]);
    }
    let camera = GivenCamera::from_numbers(&[0.0, 31.0, 11.0, 7.0]);
    let e = error_of(&m, OpenOptions { camera, ..Default::default() });
    assert_has(&e, &["the camera given", "fx and fy > 0"]);
    assert_eq!(GivenCamera::from_numbers(&[1.0; 5]), None);
    // It replaces what a file says, too, and that file's unit of depth stays.
    let s = open(Box::new(replica(2)), options()).unwrap();
    assert_eq!(s.info().camera.fx, 30.0);
    assert!((s.info().depth_unit_m * 5000.0 - 1.0).abs() < 1e-12);
}

#[test]
fn images_of_too_many_pixels_are_refused() {
    let mut m = replica(1);
    // 16000 x 16000 is within the limit of each side.
    let mut png = png_of(1, 1, 0);
    png[16..24].copy_from_slice(&[0, 0, 62, 128, 0, 0, 62, 128]);
    let crc = !png[12..29].iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1)))
    });
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    m.insert("results/depth000000.png", png);
    let e = error_of(&m, OpenOptions::default());
    assert_has(&e, &["depth000000.png", "16000x16000", &MAX_PIXELS.to_string()]);
}

/// The same files under other names.
fn under_names(m: &MemorySource, name: impl Fn(&str) -> String) -> MemorySource {
    let mut out = MemorySource::new(m.name());
    m.names().for_each(|n| out.insert(name(n), m.get(n).unwrap()));
    out
}

#[test]
fn hidden_files_are_no_part_of_any_layout() {
    for layout in Layout::ALL {
        let plain = renamed(12, layout);
        // What macOS puts into archives, beside the files and in a folder at the top.
        let mut mac = under_names(&plain, |n| format!("scan/{n}"));
        for name in plain.names() {
            let (folder, base) = name.rsplit_once('/').map_or(("", name), |(f, b)| (f, b));
            mac.insert(format!("scan/{folder}/._{base}").replace("//", "/"), "Mac OS X");
            mac.insert(format!("__MACOSX/scan/{name}"), "Mac OS X");
            mac.insert(format!("scan/{folder}/.DS_Store").replace("//", "/"), "Mac OS X");
        }
        let (mut a, mut b) = (opened(&plain).unwrap(), opened(&mac).unwrap());
        assert_eq!(a.warnings(), b.warnings(), "{layout}");
        for i in 0..12 {
            let (want, got) = (a.frame(i).unwrap(), b.frame(i).unwrap());
            assert_eq!((want.color, want.depth), (got.color, got.depth), "{layout} {i}");
            assert_eq!((want.labels, want.truth), (got.labels, got.truth), "{layout} {i}");
        }
    }
    // Folders of labels and of feature maps, too.
    let mut labels = MemorySource::new("labels");
    (0..3).for_each(|i| labels.insert(format!("._{i}.png"), "Mac OS X"));
    let labels = LabelSource::Folder(Box::new(labels));
    let e = error_of(&replica(3), OpenOptions { labels, ..Default::default() });
    assert_has(&e, &["label images", "0 files"]);
}

#[test]
fn names_are_read_in_any_case() {
    let shout = |n: &str| format!("Scan/{}", n.to_ascii_uppercase());
    for layout in Layout::ALL {
        let plain = renamed(12, layout);
        let (mut a, mut b) =
            (opened(&plain).unwrap(), opened(&under_names(&plain, shout)).unwrap());
        assert_eq!((a.warnings(), b.info().name.as_str()), (b.warnings(), "Scan"), "{layout}");
        for i in 0..12 {
            let (want, got) = (a.frame(i).unwrap(), b.frame(i).unwrap());
            assert_eq!((want.color, want.depth), (got.color, got.depth), "{layout} {i}");
            assert_eq!((want.labels, want.truth), (got.labels, got.truth), "{layout} {i}");
        }
    }
    // Errors show the names as they are.
    let mut m = under_names(&replica(3), shout);
    m.insert("Scan/RESULTS/DEPTH000001.PNG", "hello");
    assert_has(&error_of(&m, OpenOptions::default()), &["RESULTS/DEPTH000001.PNG (frame 1)"]);
}

#[test]
fn names_that_differ_in_case_alone_are_kept_apart_or_said() {
    let mut m = renamed(2, Layout::Tum);
    // A list can name either.
    m.insert("rgb/A.png", png_of(W, H, 0x5050));
    m.insert("rgb/a.png", png_of(W, H, 0x9090));
    m.insert("rgb.txt", "100.0 rgb/A.png\n100.0333 rgb/a.png\n");
    let mut s = opened(&m).unwrap();
    let shade = |s: &mut dyn mte_slam_types::sequence::Sequence, i| s.frame(i).unwrap().color[0][0];
    assert_eq!([shade(s.as_mut(), 0), shade(s.as_mut(), 1)], [0x50, 0x90]);
    assert_has(&s.warnings().join(";"), &["rgb/A.png (beside rgb/a.png)"]);
    // Where names are searched for, the lower case counts.
    let mut m = renamed(2, Layout::Images);
    m.insert("rgb/VIEW1.png", png_of(W, H, 0x5050));
    let mut s = opened(&m).unwrap();
    assert_eq!(s.frame(1).unwrap().color, frame(1).color);
    assert_has(&s.warnings().join(";"), &["1 file differs", "rgb/VIEW1.png"]);
}

#[test]
fn what_a_source_leaves_out_is_said() {
    struct Partial(MemorySource);
    impl Source for Partial {
        fn name(&self) -> &str {
            self.0.name()
        }
        fn list(&self) -> Result<Vec<String>, SequenceError> {
            self.0.list()
        }
        fn notes(&self) -> Vec<String> {
            vec!["3 files left out".into()]
        }
        fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
            self.0.read(file)
        }
    }
    let s = open(Box::new(Partial(replica(1))), OpenOptions::default()).unwrap();
    assert_eq!(s.warnings(), ["3 files left out"]);
    let nothing = Partial(MemorySource::new("none"));
    let e = open(Box::new(nothing), OpenOptions::default()).err().unwrap().to_string();
    assert_has(&e, &["the folder is empty", "3 files left out"]);
}

/// Moves the camera of `transforms.json` into its frames, changed for each by its number.
fn cameras_per_frame(m: &mut MemorySource, change: impl Fn(u64, &mut serde_json::Value)) {
    let mut json: serde_json::Value = serde_json::from_slice(m.get(TRANSFORMS).unwrap()).unwrap();
    for key in ["fl_x", "fl_y", "cx", "cy", "w", "h"] {
        let value = json.as_object_mut().unwrap().remove(key).unwrap();
        for frame in json["frames"].as_array_mut().unwrap() {
            frame[key] = value.clone();
        }
    }
    for frame in json["frames"].as_array_mut().unwrap() {
        let name = frame["file_path"].as_str().unwrap();
        let number = name.trim_matches(|c: char| !c.is_ascii_digit()).parse().unwrap();
        change(number, frame);
    }
    m.insert(TRANSFORMS, json.to_string());
}

#[test]
fn frames_may_have_cameras_of_their_own() {
    // By less than half a pixel nothing changes but the camera, which is the median.
    let mut m = renamed(3, Layout::Nerfstudio);
    cameras_per_frame(&mut m, |i, f| f["cx"] = (12.0 + 0.1 * i as f64).into());
    let mut s = opened(&m).unwrap();
    assert!((s.info().camera.cx - 11.6).abs() < 1e-9);
    assert_has(&s.warnings().join(";"), &["differ from their median by up to 0.10 pixels"]);
    for i in 0..3 {
        let (got, want) = (s.frame(i).unwrap(), frame(i));
        assert_eq!((got.color, got.depth, got.labels), (want.color, want.depth, want.labels));
    }
    // The last frame's camera looks three pixels further left.
    let mut m = renamed(3, Layout::Nerfstudio);
    cameras_per_frame(&mut m, |i, f| f["cx"] = if i == 2 { 15.0 } else { 12.0 }.into());
    let mut s = opened(&m).unwrap();
    assert_eq!(s.info().camera, info().camera);
    assert_has(&s.warnings().join(";"), &["up to 3.00 pixels: 1 frame brought into"]);
    assert_eq!(s.frame(1).unwrap().depth, frame(1).depth);
    let (got, want, w) = (s.frame(2).unwrap(), frame(2), W as usize);
    for (i, (x, y)) in (0..want.depth.len()).map(|i| (i, (i % w, i / w))) {
        let labels = (got.labels.as_ref().unwrap()[i], want.labels.as_ref().unwrap());
        if x + 3 < w {
            let at = y * w + x + 3;
            assert_eq!((got.depth[i], got.color[i]), (want.depth[at], want.color[at]), "{x} {y}");
            assert_eq!(labels.0, labels.1[at]);
        } else {
            assert_eq!((got.depth[i], labels.0), (0, UNLABELLED), "{x} {y}");
        }
    }
    // A camera that is given is that of all frames.
    let camera = GivenCamera::from_numbers(&[30.0, 31.0, 11.0, 7.0]);
    let mut s = open(Box::new(m), OpenOptions { camera, ..Default::default() }).unwrap();
    assert_eq!((s.info().camera.cx, s.frame(2).unwrap().depth), (11.0, frame(2).depth));
    assert!(!s.warnings().join(";").contains("median"));
    // Size and distortion belong to all.
    for (key, value, parts) in [
        ("w", 25.0, &["(frame 1)", "w and h", "found 25x16", "24x16"][..]),
        ("k1", 0.5, &["(frame 1)", "k1 k2 p1 p2 k3", "[0.5, 0.0"]),
        ("fl_x", -4.0, &["transforms.json", "fx and fy > 0"]),
    ] {
        let mut m = renamed(3, Layout::Nerfstudio);
        // Listed from the last to the first.
        cameras_per_frame(&mut m, |i, f| {
            if i == 1 {
                f[key] = value.into();
            }
        });
        assert_has(&error_of(&m, OpenOptions::default()), parts);
    }
}

#[test]
fn no_default_camera_is_claimed_beside_a_given_one() {
    use Layout::{ReplicaNice, ReplicaVmap, ScanNet, SevenScenes, Tum};
    for layout in [ReplicaNice, ReplicaVmap, ScanNet, SevenScenes, Tum] {
        let mut m = renamed(2, layout);
        m.remove("cam_params.json");
        let camera = GivenCamera::from_numbers(&[30.0, 31.0, 11.0, 7.0]);
        let s = open(Box::new(m), OpenOptions { camera, ..Default::default() }).unwrap();
        assert_eq!(s.info().camera.fx, 30.0, "{layout}");
        // The tiny recording is large in some units.
        let said = s.warnings().into_iter().filter(|w| !w.starts_with("half of the depth"));
        assert_eq!(said.collect::<Vec<_>>(), Vec::<String>::new(), "{layout}");
    }
}

#[test]
fn saturated_and_far_depth_is_a_hole_in_every_layout() {
    for layout in Layout::ALL.into_iter().filter(|l| *l != Layout::Sens) {
        let mut m = renamed(2, layout);
        let mut bytes = Vec::new();
        let image = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(W, H, |x, y| {
            image::Luma([[10_000, 65535, 20_000][((x + y) % 3) as usize]])
        });
        image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
        let name = m.names().find(|n| n.contains("depth") && n.contains("1.")).map(String::from);
        let name = name.unwrap_or_else(|| "frame-000001.depth.png".into());
        m.insert(name, bytes);
        let depth = |max_depth_m| {
            let options = OpenOptions { max_depth_m, ..Default::default() };
            open(Box::new(m.clone()), options).unwrap().frame(1).unwrap().depth
        };
        assert_eq!(depth(None)[..3], [10_000, 0, 20_000], "{layout}");
        // 2 m and 4 m.
        assert_eq!(depth(Some(3.5))[..3], [10_000, 0, 0], "{layout}");
        if layout != Layout::SevenScenes {
            assert_has(&opened(&m).unwrap().warnings().join(";"), &["depth of 65535"]);
        }
    }
    for max_depth_m in [0.0, -1.0, f64::NAN] {
        let options = OpenOptions { max_depth_m: Some(max_depth_m), ..Default::default() };
        assert_has(&error_of(&replica(1), options), &["largest depth", "metres > 0"]);
    }
}

#[test]
fn poses_that_are_none_are_left_out_and_counted() {
    for (at, number) in [("[[", "NaN"), ("[[", "Infinity")] {
        let mut m = renamed(3, Layout::Nerfstudio);
        let text = String::from_utf8(m.get(TRANSFORMS).unwrap().to_vec()).unwrap();
        let (before, after) = text.rsplit_once(at).unwrap();
        let (_, after) = after.split_once(',').unwrap();
        m.insert(TRANSFORMS, format!("{before}{at}{number},{after}"));
        let s = opened(&m).unwrap();
        assert_eq!((s.truth(0), s.truth(1).is_some()), (None, true), "{number}");
        assert_has(&s.warnings().join(";"), &["1 frame without a ground-truth pose"]);
    }
    let mut m = renamed(3, Layout::ScanNet);
    m.insert("pose/1.txt", ["0"; 16].join(" "));
    let s = opened(&m).unwrap();
    assert_eq!((s.truth(1), s.truth(2).is_some()), (None, true));
    let mut m = sens(2);
    let mut bytes = m.get("tiny.sens").unwrap().to_vec();
    let name = u64::from_le_bytes(bytes[4..12].try_into().unwrap()) as usize;
    let first = 12 + name + 4 * 64 + 2 * 4 + 4 * 4 + 4 + 8;
    bytes[first..first + 64].fill(0);
    m.insert("tiny.sens", bytes);
    let s = opened(&m).unwrap();
    assert_eq!((s.truth(0), s.truth(1).is_some()), (None, true));
}

#[test]
fn poses_of_other_programs_beside_plain_images() {
    let plain = renamed(3, Layout::Images);
    let lines = String::from_utf8(plain.get("poses.txt").unwrap().to_vec()).unwrap();
    let numbers: Vec<Vec<&str>> = lines.lines().map(|l| l.split_whitespace().collect()).collect();
    let log = |poses: &[Vec<&str>]| -> String {
        let one = |(i, n): (usize, &Vec<&str>)| {
            let rows: Vec<String> = n.chunks(4).map(|row| row.join(" ")).collect();
            format!("{i} {i} {}\n{}\n", i + 1, rows.join("\n"))
        };
        poses.iter().enumerate().map(one).collect()
    };
    let rows: String = numbers.iter().map(|n| n[..12].join(" ") + "\n").collect();
    let quaternions: String = (0..3)
        .map(|i| {
            let pose = frame(i).truth.unwrap();
            let (t, q) = (pose.translation, pose.quaternion());
            format!("{} {} {} {} {} {} {}\n", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
        })
        .collect();
    let with = |file: &str, text: String| {
        let mut m = plain.clone();
        m.remove("poses.txt");
        m.insert(file, text);
        opened(&m).unwrap()
    };
    for (file, text) in
        [("trajectory.log", log(&numbers)), ("pose.txt", rows), ("pose.txt", quaternions)]
    {
        let s = with(file, text);
        for i in 0..3 {
            let off = s.truth(i).unwrap().compose(&frame(i).truth.unwrap().inverse());
            assert!(off.translation.length() < 1e-9 && off.angle_rad() < 1e-6, "{file} {i}");
        }
        assert_eq!(s.warnings(), Vec::<String>::new(), "{file}");
    }
    let s = with("trajectory.log", log(&numbers[..2]));
    assert_eq!(s.truth(0), None);
    let parts = ["not taken as ground truth: trajectory.log", "2 poses", "3, one for each"];
    assert_has(&s.warnings().join(";"), &parts);
    let s = with("pose.txt", "of the lamp".into());
    assert_has(&s.warnings().join(";"), &["not taken as ground truth: pose.txt", "1 line"]);
}

#[test]
fn labels_as_jpeg_are_said() {
    let mut m = replica(3);
    for i in 0..3 {
        let label = m.remove(&format!("semantic_class/semantic_class_{i:06}.png")).unwrap();
        m.insert(format!("semantic_class/semantic_class_{i:06}.jpg"), label);
    }
    let mut s = opened(&m).unwrap();
    assert_eq!(s.frame(0).unwrap().labels, None);
    assert_has(&s.warnings().join(";"), &["3 JPEG images in semantic_class/", "PNG"]);
}

#[test]
fn cameras_may_lie_above_the_recording() {
    let camera = |m: &mut MemorySource| m.remove("intrinsics.json").unwrap();
    for above in ["../intrinsics.json", "../../intrinsics.json"] {
        let mut m = renamed(2, Layout::Images);
        let bytes = camera(&mut m);
        m.insert(above, bytes);
        assert_eq!(opened(&m).unwrap().info().camera, info().camera, "{above}");
    }
    // In an archive with one folder of images.
    let mut m = renamed(2, Layout::Images);
    let bytes = camera(&mut m);
    let mut m = under_names(&m, |n| format!("scans/kitchen/{n}"));
    m.insert("scans/intrinsics.json", bytes);
    let s = opened(&m).unwrap();
    assert_eq!((s.info().camera, s.info().name.as_str()), (info().camera, "kitchen"));
    let mut m = renamed(2, Layout::Tum);
    m.remove("cam_params.json");
    m.insert("../camera.txt", "20 21 11.5 7.25");
    assert_eq!(opened(&m).unwrap().info().camera, info().camera);
    m.insert("../camera.txt", "20 21 11.5");
    assert_has(&error_of(&m, OpenOptions::default()), &["../camera.txt", "3 numbers"]);
}
