//! Every kind of bad input gives an error that names the file, what was found and what was
//! expected; and good input is read back as it was written.
use super::{
    features::tests::{npy, ramp, tensors},
    test_support::*,
    *,
};
use mte_slam_types::classes::UNLABELLED;

fn assert_has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
}

/// Returns the error after a change of the tiny recording.
fn after(change: impl FnOnce(&mut MemorySource)) -> String {
    let mut m = replica(3);
    change(&mut m);
    error_of(&m, OpenOptions::default())
}

#[test]
fn what_is_written_is_read_back() {
    let mut s = opened(&replica(3)).unwrap();
    let (want, got) = (info(), s.info().clone());
    assert_eq!((got.camera, got.frames, got.layout), (want.camera, 3, "replica"));
    assert_eq!((got.classes, got.bounds), (want.classes, want.bounds));
    assert!((got.depth_unit_m - want.depth_unit_m).abs() < 1e-18);
    assert_eq!(s.warnings(), Vec::<String>::new());
    for i in 0..3 {
        let (want, got) = (frame(i), s.frame(i).unwrap());
        assert_eq!((got.color, got.depth, got.labels), (want.color, want.depth, want.labels));
        let error = want.truth.unwrap().compose(&got.truth.unwrap().inverse());
        assert!(error.translation.length() < 1e-12 && error.angle_rad() < 1e-7);
        assert_eq!(s.truth(i), got.truth);
    }
    assert!(s.frame(3).is_err());
}

#[test]
fn jpeg_colour_is_close() {
    let mut m = MemorySource::new("tiny");
    let sink = |name: &str, bytes: &[u8]| {
        m.insert(name, bytes);
        Ok(())
    };
    let mut flat = frame(0);
    flat.color.fill([200, 90, 30]);
    let mut writer = ReplicaWriter::new(&info(), ColorFormat::Jpeg, sink);
    writer.write(&flat).unwrap();
    writer.finish().unwrap();
    let got = opened(&m).unwrap().frame(0).unwrap();
    assert!(got.color.iter().all(|c| (0..3).all(|k| c[k].abs_diff([200, 90, 30][k]) < 4)));
}

#[test]
fn the_writer_refuses_what_does_not_fit() {
    let refuse = |_: &str, _: &[u8]| Err(std::io::Error::other("disk full"));
    let mut w = ReplicaWriter::new(&info(), ColorFormat::Png, refuse);
    assert_has(&w.write(&frame(0)).unwrap_err().to_string(), &["frame000000.png", "disk full"]);
    let mut w = ReplicaWriter::new(&info(), ColorFormat::Png, |_: &str, _: &[u8]| Ok(()));
    let mut bad = frame(1);
    bad.depth.pop();
    assert_has(&w.write(&bad).unwrap_err().to_string(), &["frame 1: depth pixels", "383", "384"]);
    let mut bad = frame(1);
    bad.labels.as_mut().unwrap()[0] = 77;
    assert_has(&w.write(&bad).unwrap_err().to_string(), &["class index: found 77"]);
}

#[test]
fn all_layouts_deliver_the_same_in_numeric_order() {
    for layout in Layout::ALL {
        // Twelve frames: lexical order would put 10 before 2.
        let mut s = opened(&renamed(12, layout)).unwrap();
        assert_eq!((s.info().layout, s.info().frames), (layout.name(), 12), "{layout}");
        for i in [0, 2, 10, 11] {
            let (want, got) = (frame(i), s.frame(i).unwrap());
            assert_eq!(got.color, want.color, "{layout} {i}");
            assert_eq!(got.labels, want.labels, "{layout} {i}");
            assert_eq!(got.number, i as u64);
            assert_eq!(got.depth[..200], want.depth[..200], "{layout} {i}");
            // A .sens file has single precision.
            let tolerance = if layout == Layout::Sens { 1e-6 } else { 1e-9 };
            let pose = got.truth.or_else(|| s.prior(i)).unwrap();
            let off = pose.compose(&want.truth.unwrap().inverse());
            assert!(off.translation.length() < tolerance, "{layout} {i}");
            assert!(off.angle_rad() < 1e-6, "{layout} {i}");
        }
        let (got, want) = (s.info().camera, info().camera);
        assert_eq!((got.width, got.height, got.fx), (want.width, want.height, want.fx), "{layout}");
        assert!((got.cx - want.cx).hypot(got.cy - want.cy) < 1e-9, "{layout}");
        let unit = s.info().depth_unit_m / info().depth_unit_m;
        assert!((unit - 1.0).abs() < 1e-6, "{layout}");
        if layout == Layout::Tum {
            assert!((s.time_s(3) - 100.1).abs() < 1e-9);
        }
    }
}

#[test]
fn start_stride_and_frames_select() {
    let pick = |start, stride, frames| {
        let options = OpenOptions { start, stride, frames, ..Default::default() };
        open(Box::new(replica(7)), options)
            .map(|s| (0..s.info().frames).map(|i| s.time_s(i) as usize).collect::<Vec<_>>())
    };
    assert_eq!(pick(1, 3, None).unwrap(), [1, 4]);
    assert_eq!(pick(2, 2, Some(2)).unwrap(), [2, 4]);
    assert_eq!(pick(6, 1, Some(9)).unwrap(), [6]);
    assert_has(&pick(7, 1, None).unwrap_err().to_string(), &["start", "found 7", "less than 7"]);
    assert!(pick(0, 0, None).is_err() && pick(0, 1, Some(0)).is_err());
}

#[test]
fn scale_makes_all_images_smaller_alike() {
    let options = OpenOptions { scale: 0.5, ..Default::default() };
    let mut s = open(Box::new(replica(1)), options).unwrap();
    assert_eq!(s.info().camera, info().camera.downscaled(2));
    let (full, half) = (frame(0), s.frame(0).unwrap());
    let (at, w) = (5 * (W as usize / 2) + 3, W as usize);
    assert_eq!(half.depth[at], full.depth[10 * w + 6]);
    assert_eq!(half.labels.unwrap()[at], full.labels.unwrap()[10 * w + 6]);
    let mean: u32 = [0, 1, w, w + 1].iter().map(|o| u32::from(full.color[10 * w + 6 + o][1])).sum();
    assert_eq!(u32::from(half.color[at][1]), (mean + 2) / 4);
    for (scale, part) in [(0.0, "(0, 1]"), (1.5, "(0, 1]"), (f64::NAN, "(0, 1]"), (0.1, "8x8")] {
        assert_has(&error_of(&replica(1), OpenOptions { scale, ..Default::default() }), &[part]);
    }
}

#[test]
fn colour_of_another_size_is_fitted_to_depth() {
    let mut m = replica(1);
    let mut big = Vec::new();
    let image = image::RgbImage::from_pixel(W * 2, H * 2, image::Rgb([10, 20, 30]));
    image.write_to(&mut std::io::Cursor::new(&mut big), image::ImageFormat::Png).unwrap();
    m.insert("results/frame000000.png", big);
    let got = opened(&m).unwrap().frame(0).unwrap();
    assert_eq!(got.color, vec![[10, 20, 30]; (W * H) as usize]);
}

#[test]
fn missing_files_are_named() {
    for layout in Layout::ALL.into_iter().filter(|l| *l != Layout::Sens) {
        for (kind, at) in [("color", 0), ("depth", 1)] {
            let mut m = renamed(3, layout);
            let images = [["results/frame", "results/depth"], ["rgb/", "depth/"]];
            let others = [["images/", "depth/"], ["color/", "depth/"], [".color.", ".depth."]];
            let is_image = |n: &&str| {
                let kinds = images.iter().chain(&others);
                n.ends_with(".png")
                    && n.contains('1')
                    && kinds.into_iter().any(|k| n.contains(k[at]))
            };
            let name = m.names().find(is_image).unwrap().to_owned();
            m.remove(&name);
            let strict = || OpenOptions { strict: true, ..Default::default() };
            let mut s = opened(&m).unwrap();
            assert_eq!((s.info().frames, s.number(1)), (2, 2), "{layout} {kind}");
            assert_eq!(s.frame(1).unwrap().depth, frame(2).depth, "{layout} {kind}");
            let pose = s.truth(1).or_else(|| s.prior(1)).unwrap();
            let off = pose.translation - frame(2).truth.unwrap().translation;
            assert!(off.length() < 1e-9, "{layout} {kind}");
            // Layouts without lists cannot miss a colour image; its depth is then one too many.
            let lists = matches!(layout, Layout::Tum | Layout::Nerfstudio);
            if lists || kind == "depth" {
                assert!(s.warnings().join(";").contains(" left out"), "{layout} {kind}");
                let e = error_of(&m, strict());
                let named = e.contains(&name) || layout == Layout::Images;
                assert!(named, "{layout} {kind}: {e}");
            }
        }
    }
    // Nothing is left.
    let mut m = renamed(1, Layout::Tum);
    m.remove("rgb/0.png");
    assert_has(&error_of(&m, OpenOptions::default()), &["rgb/0.png", "no such file", "frame 0"]);
    assert_has(&error_of(&MemorySource::new("void"), OpenOptions::default()), &["void", "empty"]);
    // Poses are optional: own recordings have none.
    let mut m = replica(2);
    m.remove("traj.txt");
    let s = opened(&m).unwrap();
    assert_eq!(s.truth(0), None);
    assert_has(&s.warnings().join("; "), &["traj.txt", "no ground-truth poses"]);
    let e = after(|m| drop(m.remove("cam_params.json")));
    assert_has(&e, &["24x16", "1200x680", "no cam_params.json"]);
}

#[test]
fn broken_images_are_named() {
    let cut = |m: &mut MemorySource, file: &str| {
        let bytes = m.get(file).unwrap();
        let half = bytes[..bytes.len() / 2].to_vec();
        m.insert(file, half);
    };
    for file in [
        "results/frame000001.png",
        "results/depth000001.png",
        "semantic_class/semantic_class_000001.png",
    ] {
        assert_has(&after(|m| cut(m, file)), &[file, "frame 1", "PNG"]);
        assert_has(&after(|m| m.insert(file, "hello")), &[file, "frame 1", "5 bytes"]);
        assert_has(&after(|m| m.insert(file, "")), &[file, "empty file"]);
    }
    // Depth of 8 bits, and colour in its place.
    let e = after(|m| {
        let grey = m.get("results/frame000000.png").unwrap().to_vec();
        m.insert("results/depth000000.png", grey);
    });
    assert_has(&e, &["depth000000.png", "8-bit RGB", "16-bit grey"]);
}

fn png_of(w: u32, h: u32, value: u16) -> Vec<u8> {
    let mut bytes = Vec::new();
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(w, h, image::Luma([value]));
    image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    bytes
}

#[test]
fn sizes_that_change_are_named() {
    for (file, what, w) in [
        ("results/frame000002.png", "colour image size", 12),
        ("results/depth000002.png", "depth image size", 12),
        ("semantic_class/semantic_class_000002.png", "label image size", 8),
    ] {
        let e = after(|m| m.insert(file, png_of(w, 8, 0)));
        assert_has(&e, &[file, "frame 2", what, &format!("{w}x8"), "24x16"]);
    }
    let e = after(|m| m.insert("results/frame000000.png", png_of(16, 24, 0)));
    assert_has(&e, &["frame000000.png", "16x24", "proportions"]);
}

#[test]
fn poses_too_few_or_not_finite() {
    let with = |change: fn(Vec<&str>) -> Vec<String>| {
        move |m: &mut MemorySource| {
            let text = String::from_utf8(m.get("traj.txt").unwrap().to_vec()).unwrap();
            let lines = change(text.lines().collect());
            m.insert("traj.txt", lines.join("\n"));
        }
    };
    let e = after(with(|l| l[..2].iter().map(|s| (*s).into()).collect()));
    assert_has(&e, &["traj.txt", "2 lines", "3 lines"]);
    let e = after(with(|l| l.iter().map(|s| s.replacen('e', "x", 1)).collect()));
    assert_has(&e, &["traj.txt", "frame 0", "number"]);
    let e = after(with(|l| vec![l[0].into(), l[1].into(), "1 2 3".into()]));
    assert_has(&e, &["traj.txt", "frame 2", "3 numbers", "16 numbers"]);
    let e = after(with(|l| vec![l[0].into(), l[1].into(), ["2"; 16].join(" ")]));
    assert_has(&e, &["traj.txt", "frame 2", "not a rotation"]);
    let e = after(|m| m.insert("traj.txt", b"1 0 0 \xff".to_vec()));
    assert_has(&e, &["traj.txt", "no UTF-8 at byte 6"]);

    for word in ["-inf", "NaN", "inf"] {
        let mut m = replica(3);
        let text = String::from_utf8(m.get("traj.txt").unwrap().to_vec()).unwrap();
        let mut lines: Vec<String> = text.lines().map(String::from).collect();
        lines[1] = [word; 16].join(" ");
        m.insert("traj.txt", lines.join("\n"));
        let mut s = opened(&m).unwrap();
        assert_eq!((s.truth(1), s.frame(1).unwrap().truth), (None, None));
        assert!(s.truth(2).is_some());
        assert_has(&s.warnings().join("; "), &["1 frame without a ground-truth pose"]);
    }
}

#[test]
fn a_subset_of_the_images_takes_its_poses_by_number() {
    let mut m = replica(5);
    for kind in ["results/frame", "results/depth"] {
        for i in [0, 1, 3] {
            m.remove(&format!("{kind}{i:06}.png"));
        }
    }
    let s = opened(&m).unwrap();
    let off = s.truth(1).unwrap().translation - frame(4).truth.unwrap().translation;
    assert!(s.info().frames == 2 && off.length() < 1e-9);
}

#[test]
fn depth_without_a_measurement_is_fine() {
    let mut m = replica(1);
    m.insert("results/depth000000.png", png_of(W, H, 0));
    assert!(opened(&m).unwrap().frame(0).unwrap().depth.iter().all(|&d| d == 0));
    let mut m = renamed(1, Layout::SevenScenes);
    m.insert("frame-000000.depth.png", png_of(W, H, 65535));
    assert!(opened(&m).unwrap().frame(0).unwrap().depth.iter().all(|&d| d == 0));
}

#[test]
fn labels_from_elsewhere_and_without_a_list() {
    let mut own = MemorySource::new("guesses");
    own.insert("a/1.png", png_of(W, H, 7));
    own.insert("a/2.png", png_of(W, H, 9));
    let with = |own: &MemorySource, recording: &MemorySource| {
        let labels = LabelSource::Folder(Box::new(own.clone()));
        open(Box::new(recording.clone()), OpenOptions { labels, ..Default::default() })
    };
    // The recording's list knows 7 and not 9.
    let mut s = with(&own, &replica(3)).unwrap();
    assert_has(&s.warnings().join(";"), &["1 frame without a label image"]);
    assert_eq!(s.frame(0).unwrap().labels, None);
    assert_eq!(s.frame(1).unwrap().labels.unwrap()[0], 1);
    assert_eq!(s.frame(2).unwrap().labels.unwrap()[0], UNLABELLED);
    for _ in 0..2 {
        let text = s.warnings().join(";");
        assert_has(&text, &["384 label pixels", "not in the class list: 9 (384)"]);
        s.frame(2).unwrap(); // counted once
    }

    let mut listless = replica(3);
    listless.remove("classes.json");
    let s = with(&own, &listless).unwrap();
    let classes = &s.info().classes.classes;
    assert_eq!((classes[0].name.as_str(), classes[1].name.as_str()), ("class 7", "class 9"));
    assert_ne!(classes[0].color, classes[1].color);
    own.insert("a/0.png", png_of(W, H, 255));
    assert_eq!(with(&own, &listless).unwrap().info().classes.len(), 2);

    own.insert("a/other_0.png", png_of(W, H, 7));
    let e = with(&own, &replica(3)).map(drop).unwrap_err().to_string();
    assert_has(&e, &["guesses/a", "<number>.png", "other_<number>.png"]);
    let e = with(&MemorySource::new("none"), &replica(3)).map(drop).unwrap_err().to_string();
    assert_has(&e, &["none", "0 files"]);

    let options = OpenOptions { labels: LabelSource::None, ..Default::default() };
    let mut s = open(Box::new(replica(1)), options).unwrap();
    assert!(s.info().classes.is_empty() && s.frame(0).unwrap().labels.is_none());
}

fn label_file(frame: usize) -> String {
    format!("semantic_class/semantic_class_{frame:06}.png")
}

#[test]
fn labels_of_another_size_are_fitted_by_nearest_pixel() {
    let mut m = replica(3);
    // Twice as large: pixel (2i, 2j) counts, as with depth. Left half bed, right half cup.
    let mut bytes = Vec::new();
    let big = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_fn(W * 2, H * 2, |x, _| {
        image::Luma([if x < W { 7 } else { 300 }])
    });
    big.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    m.insert(label_file(1), bytes);
    m.insert(label_file(2), png_of(W / 2, H / 2, 300));
    let mut s = opened(&m).unwrap();
    let labels = s.frame(1).unwrap().labels.unwrap();
    for (i, label) in labels.iter().enumerate() {
        assert_eq!(*label, if i % (W as usize) < W as usize / 2 { 1 } else { 2 }, "{i}");
    }
    assert_eq!(s.labels(2).unwrap().unwrap(), vec![2; (W * H) as usize]);
    let said = s.warnings();
    assert_has(&said.join(";"), &["2 label images of another size (12x8)", "24x16", "nearest"]);
    assert_eq!(said.len(), 1, "{said:?}");
}

#[test]
fn ids_and_lists_that_do_not_match() {
    // 65535 among others: unlabelled, and said.
    let mut m = replica(3);
    m.insert(label_file(1), png_of(W, H, 65535));
    let mut s = opened(&m).unwrap();
    assert_eq!(s.frame(1).unwrap().labels.unwrap(), vec![UNLABELLED; (W * H) as usize]);
    assert_has(&s.warnings().join(";"), &["384 label pixels", "65535 (384)"]);
    // It may be the unlabelled id, or a class.
    let options = OpenOptions { unlabelled_raw_id: Some(65535), ..Default::default() };
    let mut s = open(Box::new(m.clone()), options).unwrap();
    s.frame(1).unwrap();
    assert!(!s.warnings().join(";").contains("65535"), "{:?}", s.warnings());
    m.insert("classes.json", r#"{"65535": {"name": "sky"}, "7": {"name": "bed"}}"#);
    let mut s = opened(&m).unwrap();
    assert_eq!(s.frame(1).unwrap().labels.unwrap(), vec![1; (W * H) as usize]);

    // The list of another data set, from a file or built in.
    m.insert("classes.json", r#"{"400": {"name": "sky"}, "401": {"name": "sea"}}"#);
    let e = error_of(&m, OpenOptions::default());
    assert_has(&e, &["classes.json", "classes", "none of the ids", "0, 1, 7, 300", "65535"]);
    let mut far = replica(3);
    (0..3).for_each(|i| far.insert(label_file(i), png_of(W, H, 500)));
    let options = OpenOptions { classes: ClassList::built_in("nyu40"), ..Default::default() };
    assert_has(&error_of(&far, options), &["nyu40", "none of the ids", "500"]);
    // One that fits replaces the recording's own.
    let options = OpenOptions { classes: ClassList::built_in("nyu40"), ..Default::default() };
    let s = open(Box::new(replica(3)), options).unwrap();
    assert_eq!(s.info().classes.classes[6].name, "table");
}

#[test]
fn sequences_without_any_label_are_read_with_a_warning() {
    let mut m = replica(3);
    (0..3).for_each(|i| m.insert(label_file(i), png_of(W, H, 255)));
    for listed in [true, false] {
        if !listed {
            m.remove("classes.json");
        }
        let options = OpenOptions { unlabelled_raw_id: Some(255), ..Default::default() };
        let mut s = open(Box::new(m.clone()), options).unwrap();
        assert_eq!(s.info().classes.is_empty(), !listed);
        let labels = s.frame(1).unwrap().labels.unwrap();
        assert!(labels.iter().all(|l| *l == UNLABELLED));
        assert_has(&s.warnings().join(";"), &["no pixel of 1 label image has a class"]);
    }
}

#[test]
fn too_many_classes_are_refused() {
    let list = |n: u32| {
        let one = |i| format!("\"{}\": {{\"name\": \"c{i}\"}}", i + 1);
        format!("{{{}}}", (0..n).map(one).collect::<Vec<_>>().join(","))
    };
    assert_has(&after(|m| m.insert("classes.json", list(256))), &["256", "at most 255"]);
    let mut m = replica(1);
    m.insert("classes.json", list(400));
    let options = OpenOptions { only_present_classes: true, ..Default::default() };
    let s = open(Box::new(m), options).unwrap();
    let ids: Vec<u16> = s.info().classes.classes.iter().map(|c| c.raw_id).collect();
    assert_eq!(ids, [1, 7, 300]); // 1 is what the writer took for void, and is listed here
}

#[test]
fn bounds_that_are_none_are_refused() {
    for text in ["{}", r#"{"bound": [[1, 0], [0, 1], [0, 1]]}"#, r#"{"bound": [[0, 1], [0]]}"#] {
        assert_has(&after(|m| m.insert("bound.json", text)), &["bound.json", "ascending"]);
    }
}

#[test]
fn distorted_tum_images_are_straightened() {
    let mut m = renamed(1, Layout::Tum);
    m.remove("cam_params.json");
    m.insert("camera.txt", "50 50 31.5 23.5  0.05 0 0 0 0");
    m.insert("rgb/0.png", png_of(64, 48, 0x8000));
    m.insert("depth/0.png", png_of(64, 48, 321));
    m.insert("semantic_class/semantic_class_0.png", png_of(64, 48, 7));
    let mut s = opened(&m).unwrap();
    assert_has(&s.warnings().join(";"), &["distortion", "48x32", "64x48"]);
    let (c, f) = (s.info().camera, s.frame(0).unwrap());
    assert_eq!((c.width, c.height, c.cx, c.cy, c.fx), (48, 32, 23.5, 15.5, 50.0));
    assert_eq!((f.color, f.depth), (vec![[128; 3]; c.pixels()], vec![321; c.pixels()]));
    assert_eq!(f.labels.unwrap(), vec![1; c.pixels()]);
    m.insert("camera.txt", "50 50 31.5 23.5  5 5 0 0 0");
    assert_has(&error_of(&m, OpenOptions::default()), &["camera.txt", "lens distortion"]);
}

#[test]
fn feature_maps_are_read_by_frame_number_and_checked() {
    let mut maps = MemorySource::new("dino");
    for i in 0..3 {
        maps.insert(format!("deep/{i:06}.npy"), ramp(5, 2, 3));
    }
    let with = |maps: &MemorySource| OpenOptions {
        features: Some(Box::new(maps.clone())),
        ..Default::default()
    };
    let mut s = open(Box::new(replica(3)), with(&maps)).unwrap();
    assert_eq!(s.info().feature_channels, 5);
    let map = s.frame(2).unwrap().features.unwrap();
    assert_eq!((map.channels, map.height, map.width, map.values[29]), (5, 2, 3, 29.0));

    let spoiled = |spoil: &dyn Fn(&mut MemorySource)| {
        let mut maps = maps.clone();
        spoil(&mut maps);
        error_of(&replica(3), with(&maps))
    };
    let error = spoiled(&|m| m.insert("deep/000001.npy", ramp(4, 2, 3)));
    assert_has(&error, &["000001.npy (frame 1)", "channels", "found 4", "5 as in 000000.npy"]);
    let error = spoiled(&|m| m.insert("deep/000002.npy", npy("<f8", "5, 1, 1", &[0; 40])));
    assert_has(&error, &["000002.npy (frame 2)", "dtype", "found <f8", "float32", "float16"]);
    let error = spoiled(&|m| drop(m.remove("deep/000001.npy")));
    assert_has(&error, &["000001.npy", "no such file in dino", "frame 1"]);
    let error = spoiled(&|m| m.insert("deep/1.npy", ramp(5, 2, 3)));
    assert_has(&error, &["frame number", "one file for each number"]);
    // The formats may be mixed, but not for one frame.
    let packed =
        tensors(r#"{"tokens":{"dtype":"F16","shape":[5,1,1],"data_offsets":[0,10]}}"#, &[0x3c; 10]);
    let mut mixed = maps.clone();
    mixed.insert("deep/000001.safetensors", packed);
    assert_has(&error_of(&replica(3), with(&mixed)), &["frame number", "000001.npy"]);
    mixed.remove("deep/000001.npy");
    let mut s = open(Box::new(replica(3)), with(&mixed)).unwrap();
    assert_eq!(s.frame(1).unwrap().features.unwrap().values, [1.0585938; 5]);
    let empty = with(&MemorySource::new("none"));
    assert_has(&error_of(&replica(3), empty), &["none", "feature maps", "0 files", "000000.npy"]);
}
