//! Opening a recording, and decoding its frames.
use super::{
    class_list::ClassList,
    decode::Size,
    depth_probe::{self, DepthCode, Known},
    entries::{Entry, fit_cameras},
    features::FeatureFiles,
    folder::{Folder, invalid, plural},
    frame_camera::Fit,
    intrinsics::{Intrinsics, Rectifier, checked},
    labels::{self, LabelOptions, Labels},
    layouts::{Layout, Wanted},
    order::FrameOrder,
    resize::{Resize, same_aspect},
};
use mte_slam_types::{
    classes::{ClassTable, UNLABELLED},
    frame::{Frame, SequenceInfo},
    pose::Pose,
    sequence::{Sequence, SequenceError, Source},
};

/// Smallest side of a scaled image \[pixels\].
const MIN_SIDE: u32 = 8;

/// Where labels come from.
#[derive(Default)]
#[non_exhaustive]
pub enum LabelSource {
    /// No labels.
    None,
    /// The recording's own `semantic_class/` folder, if it has one.
    #[default]
    Dataset,
    /// PNGs of ids made by anyone, named like the colour or depth images or by frame number. Its
    /// own `classes.json` counts before the recording's.
    Folder(Box<dyn Source>),
}

/// A camera given by people, of images of any size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenCamera {
    /// fx, fy, cx, cy \[pixels\]; the centre of the first pixel is (0, 0).
    pub focal_centre: [f64; 4],
    /// k1, k2, p1, p2, k3 of OpenCV's distortion.
    pub distortion: [f64; 5],
}

impl GivenCamera {
    /// From `fx fy cx cy`, or from these and `k1 k2 p1 p2 k3`.
    pub fn from_numbers(numbers: &[f64]) -> Option<GivenCamera> {
        match *numbers {
            [fx, fy, cx, cy] => {
                Some(GivenCamera { focal_centre: [fx, fy, cx, cy], distortion: [0.0; 5] })
            }
            [fx, fy, cx, cy, k1, k2, p1, p2, k3] => Some(GivenCamera {
                focal_centre: [fx, fy, cx, cy],
                distortion: [k1, k2, p1, p2, k3],
            }),
            _ => None,
        }
    }

    /// Returns all nine numbers, as [`GivenCamera::from_numbers`] takes them.
    pub fn numbers(&self) -> Vec<f64> {
        self.focal_centre.iter().chain(&self.distortion).copied().collect()
    }
}

/// Axes of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// x right, y down, z forward, as everywhere here.
    #[default]
    OpenCv,
    /// x right, y up, z backward, as OpenGL, Blender and nerfstudio have it.
    OpenGl,
}

impl Axes {
    /// Names on the command line.
    pub const NAMES: [&str; 2] = ["opencv", "opengl"];

    /// From its name.
    pub fn named(name: &str) -> Option<Axes> {
        match name {
            "opencv" => Some(Axes::OpenCv),
            "opengl" => Some(Axes::OpenGl),
            _ => None,
        }
    }
}

/// What of a recording is read, and how.
pub struct OpenOptions {
    /// The layout, or `None` to recognise it by its files.
    pub layout: Option<Layout>,
    /// The camera of the depth images, instead of any file's.
    pub camera: Option<GivenCamera>,
    /// Units of depth per metre, instead of the layout's.
    pub depth_scale: Option<f64>,
    /// Depth beyond this counts as not measured \[m\]. (65535, and what is found to be a sensor's
    /// code for "nothing", always does.)
    pub max_depth_m: Option<f64>,
    /// How the cameras of the ground-truth poses lie. Layouts with axes of their own (nerfstudio)
    /// are turned before; the default is right for them.
    pub axes: Axes,
    /// In which order listed frames are taken.
    pub order: FrameOrder,
    /// Refuse a recording of which a frame lacks an image, where such frames are otherwise left out
    /// and said.
    pub strict: bool,
    /// First frame, counted from 0 in the recording's order.
    pub start: usize,
    /// One frame in this many is used; at least 1.
    pub stride: usize,
    /// The most frames that are used.
    pub frames: Option<usize>,
    /// Images are made smaller by this factor, in (0, 1]: colour by averaging, depth and labels
    /// by nearest pixel.
    pub scale: f64,
    /// Where labels come from.
    pub labels: LabelSource,
    /// Feature maps of the colour images: `000000.npy` or `000000.safetensors`, ... by frame number,
    /// float32 or float16, channels x height x width, each over the whole image as it is stored.
    pub features: Option<Box<dyn Source>>,
    /// The classes, instead of those of any `classes.json`.
    pub classes: Option<ClassList>,
    /// The raw label id that means "no label". By default the class named `void`, `unlabelled`
    /// or `unlabeled` in `classes.json`, or else 255 unless that is a listed class.
    pub unlabelled_raw_id: Option<u16>,
    /// Drop listed classes that no label image of the frames in use shows (all of them are then
    /// decoded once at opening).
    pub only_present_classes: bool,
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            layout: None,
            camera: None,
            depth_scale: None,
            max_depth_m: None,
            axes: Axes::default(),
            order: FrameOrder::default(),
            strict: false,
            start: 0,
            stride: 1,
            frames: None,
            scale: 1.0,
            labels: LabelSource::default(),
            features: None,
            classes: None,
            unlabelled_raw_id: None,
            only_present_classes: false,
        }
    }
}

/// Opens a recording: lists the files, reads poses, camera and classes, and leaves out
/// the frames whose images are not there. Images are decoded frame by frame later.
///
/// # Errors
/// Any [`SequenceError`]: an unknown layout, missing files, a file that is not what it should be
/// (with what was found and what was expected), or options that make no sense.
pub fn open(
    source: Box<dyn Source>,
    options: OpenOptions,
) -> Result<Box<dyn Sequence>, SequenceError> {
    let mut folder = Folder::new(source)?;
    let wrong = |field: &str, found: String, expected: &str| {
        Err(invalid(&folder.name(), None, field, found, expected))
    };
    if options.stride == 0 {
        return wrong("stride", "0".into(), "at least 1");
    }
    if options.frames == Some(0) {
        return wrong("number of frames", "0".into(), "at least 1");
    }
    if !(options.scale > 0.0 && options.scale <= 1.0) {
        return wrong("scale", options.scale.to_string(), "a number in (0, 1]");
    }
    if let Some(units) = options.depth_scale.filter(|s| !(s.is_finite() && *s > 0.0)) {
        return wrong("depth scale", units.to_string(), "units of depth per metre > 0");
    }
    if let Some(limit) = options.max_depth_m.filter(|m| !(m.is_finite() && *m > 0.0)) {
        return wrong("largest depth", limit.to_string(), "metres > 0");
    }
    let given = match options.camera {
        None => None,
        Some(GivenCamera { focal_centre, distortion }) => {
            let given = Intrinsics::any_size("the camera given", focal_centre);
            Some(checked("the camera given", Intrinsics { distortion, ..given })?)
        }
    };
    let layout = Layout::detect(&mut folder, options.layout, given.is_some())?;
    let wanted = Wanted { camera: given, order: options.order, strict: options.strict };
    let mut all = layout.read(&folder, &wanted)?;
    let mut warnings = folder.notes();
    warnings.append(&mut all.warnings);
    if let Some(units) = options.depth_scale {
        all.depth_unit_m = 1.0 / units;
    }
    if options.axes == Axes::OpenGl {
        for frame in &mut all.frames {
            for pose in [&mut frame.truth, &mut frame.prior] {
                *pose = pose.map(|pose| pose.with_flipped_camera());
            }
        }
    }

    // Messages show names as they are really written.
    for stored in all.frames.iter_mut().flat_map(|f| [&mut f.color, &mut f.depth]) {
        if let Some(real) = folder.real(&stored.file) {
            stored.file = real.into();
        }
    }
    leave_out_missing(&folder, &mut all.frames, options.strict, &mut warnings)?;
    let there = all.frames.len();
    let wanted = options.frames.unwrap_or(usize::MAX);
    let mut frames: Vec<Entry> =
        all.frames.into_iter().skip(options.start).step_by(options.stride).take(wanted).collect();
    let Some(first) = frames.first() else {
        let found = options.start.to_string();
        let expected = format!("less than {there}, the number of frames");
        return Err(invalid(&folder.name(), None, "start", found, expected));
    };

    let depth_size = first.depth.size(&folder, first.number, "depth image")?;
    let color_size = first.color.size(&folder, first.number, "colour image")?;
    let mut camera = all.intrinsics.camera(&first.depth.file, depth_size)?;
    check_aspect(&first.color.file, first.number, color_size, depth_size)?;
    if color_size != depth_size {
        let ((w, h), (to_w, to_h)) = (color_size, depth_size);
        warnings.push(format!("colour of {w}x{h} fitted to the {to_w}x{to_h} of depth"));
    }

    let known = Known {
        unit_m: all.depth_unit_m,
        unit_given: options.depth_scale.is_some(),
        hole: all.invalid_depth,
        max_m: options.max_depth_m,
    };
    let depth_code = depth_probe::probe(&folder, &frames, depth_size, &known, &mut warnings);

    fit_cameras(&mut frames, &all.intrinsics, &camera, depth_size, &mut warnings)?;
    let color_to_depth = Resize::to_size(color_size, depth_size);
    let rectifier = if all.intrinsics.distortion == [0.0; 5] {
        None
    } else {
        let rectifier = Rectifier::new(&all.intrinsics.from, &camera, &all.intrinsics.distortion)?;
        let flat = rectifier.camera();
        warnings.push(format!(
            "lens distortion taken out; {}x{} pixels of {}x{} are left",
            flat.width, flat.height, camera.width, camera.height
        ));
        camera = flat;
        Some(rectifier)
    };
    let resize = Resize::by_scale((camera.width, camera.height), options.scale);
    let (width, height) = resize.size();
    if options.scale < 1.0 && (width < MIN_SIDE || height < MIN_SIDE) {
        let found = format!("{}, which leaves {width}x{height} pixels", options.scale);
        let expected = format!("at least {MIN_SIDE}x{MIN_SIDE}");
        return Err(invalid(&folder.name(), None, "scale", found, expected));
    }
    camera = resize.camera(&camera);

    let classes_wanted = LabelOptions {
        list: options.classes,
        unlabelled: options.unlabelled_raw_id,
        only_present: options.only_present_classes,
    };
    let labels = match options.labels {
        LabelSource::None => None,
        LabelSource::Dataset => {
            warnings.extend(labels::unreadable(&folder));
            Labels::open(&folder, None, &mut frames, depth_size, classes_wanted)?
        }
        LabelSource::Folder(source) => {
            let own = Folder::new(source)?;
            warnings.extend(own.notes());
            Labels::open(&folder, Some(own), &mut frames, depth_size, classes_wanted)?
        }
    };
    let bare = frames.iter().filter(|f| f.label.is_none()).count();
    if labels.is_some() && bare > 0 {
        warnings.push(format!("{} without a label image", plural(bare, "frame")));
    }

    let features = match options.features {
        Some(source) => {
            let own = Folder::new(source)?;
            warnings.extend(own.notes());
            Some(FeatureFiles::open(own, &frames)?)
        }
        None => None,
    };
    if features.is_some() && rectifier.is_some() {
        warnings.push("feature maps are taken as they are, with lens distortion".into());
    }
    if features.is_some() && frames.iter().any(|f| f.fit.is_some()) {
        warnings.push("feature maps are taken as they are, each of its frame's own camera".into());
    }

    let name = folder.name();
    let last = name.trim_end_matches(['/', '\\']).rsplit(['/', '\\']).next().unwrap_or_default();
    let last = last.strip_suffix(".sens").unwrap_or(last);
    let info = SequenceInfo {
        name: last.into(),
        layout: layout.name(),
        camera,
        depth_unit_m: all.depth_unit_m,
        frames: frames.len(),
        feature_channels: features.as_ref().map_or(0, |f| f.channels),
        classes: labels.as_ref().map_or_else(ClassTable::default, |l| l.table.clone()),
        bounds: all.bounds,
    };
    Ok(Box::new(Reader {
        folder,
        info,
        frames,
        depth_size,
        color_size,
        depth_code,
        color_to_depth,
        rectifier,
        resize,
        labels,
        features,
        warnings,
    }))
}

/// Takes out the frames whose images are not there, and says so; an error where it is to be strict,
/// or where no frame is left.
fn leave_out_missing(
    folder: &Folder,
    frames: &mut Vec<Entry>,
    strict: bool,
    warnings: &mut Vec<String>,
) -> Result<(), SequenceError> {
    let there = frames.len();
    let mut first: Option<(String, u64, String)> = None;
    frames.retain(|frame| {
        let (color, depth) = (&frame.color.file, &frame.depth.file);
        let missing = [(color, depth), (depth, color)].into_iter().find(|(f, _)| !folder.has(f));
        if let (Some((file, other)), None) = (missing, &first) {
            first = Some((file.clone(), frame.number, other.clone()));
        }
        missing.is_none()
    });
    let Some((file, number, other)) = first else { return Ok(()) };
    if strict || frames.is_empty() {
        let reason = format!("no such file in {} (frame {number}, beside {other})", folder.name());
        return Err(SequenceError::Read { file, reason });
    }
    let left_out = plural(there - frames.len(), "frame");
    warnings
        .push(format!("{left_out} left out for missing images, the first {file} (frame {number})"));
    Ok(())
}

/// Colour is stretched to the size of depth, which is right only when both show the same.
fn check_aspect(file: &str, frame: u64, color: Size, depth: Size) -> Result<(), SequenceError> {
    if !same_aspect(color, depth) {
        return Err(invalid(
            file,
            Some(frame),
            "colour image size",
            format!("{}x{}", color.0, color.1),
            format!("the proportions of the depth image, {}x{}", depth.0, depth.1),
        ));
    }
    Ok(())
}

struct Reader {
    folder: Folder,
    info: SequenceInfo,
    frames: Vec<Entry>,
    depth_size: Size,
    color_size: Size,
    depth_code: DepthCode,
    color_to_depth: Resize,
    rectifier: Option<Rectifier>,
    resize: Resize,
    labels: Option<Labels>,
    features: Option<FeatureFiles>,
    warnings: Vec<String>,
}

impl Reader {
    /// Returns depth or labels, from the size on disk to the size of the camera.
    fn fit_nearest<T: Copy>(&self, mut image: Vec<T>, fit: Option<Fit>, hole: T) -> Vec<T> {
        if let Some(fit) = fit {
            image = fit.nearest(&image, self.depth_size, hole);
        }
        if let Some(rectifier) = &self.rectifier {
            image = rectifier.nearest(&image);
        }
        if self.resize.is_identity() { image } else { self.resize.nearest(&image) }
    }

    fn fit_color(&self, mut image: Vec<[u8; 3]>, fit: Option<Fit>) -> Vec<[u8; 3]> {
        if !self.color_to_depth.is_identity() {
            image = self.color_to_depth.average(&image);
        }
        if let Some(fit) = fit {
            image = fit.bilinear(&image, self.depth_size);
        }
        if let Some(rectifier) = &self.rectifier {
            image = rectifier.bilinear(&image);
        }
        if self.resize.is_identity() { image } else { self.resize.average(&image) }
    }
}

impl Sequence for Reader {
    fn info(&self) -> &SequenceInfo {
        &self.info
    }

    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
        let entry = self
            .frames
            .get(index)
            .ok_or(SequenceError::OutOfRange { index, frames: self.frames.len() })?
            .clone();
        let frame = entry.number;
        let color = entry.color.color(&self.folder, frame, self.color_size)?;
        let color = self.fit_color(color, entry.fit);
        let mut depth = entry.depth.depth(&self.folder, frame, self.depth_size)?;
        self.depth_code.apply(&mut depth);
        let depth = self.fit_nearest(depth, entry.fit, 0);

        let labels = self.labels(index)?;
        let features = self.features.as_ref().map(|f| f.read(frame)).transpose()?;
        let (number, time_s, truth) = (entry.number, entry.time_s, entry.truth);
        Ok(Frame { index, number, time_s, color, depth, labels, truth, features })
    }

    fn labels(&mut self, index: usize) -> Result<Option<Vec<u8>>, SequenceError> {
        let frames = self.frames.len();
        let entry = self.frames.get(index).ok_or(SequenceError::OutOfRange { index, frames })?;
        let (Some(labels), Some(file)) = (&mut self.labels, &entry.label) else {
            return Ok(None);
        };
        let (fit, number) = (entry.fit, entry.number);
        let image = labels.read(&self.folder, file, number, self.depth_size)?;
        Ok(Some(self.fit_nearest(image, fit, UNLABELLED)))
    }

    fn truth(&self, index: usize) -> Option<Pose> {
        self.frames.get(index)?.truth
    }

    fn prior(&self, index: usize) -> Option<Pose> {
        self.frames.get(index)?.prior
    }

    fn time_s(&self, index: usize) -> f64 {
        self.frames.get(index).map_or(f64::NAN, |f| f.time_s)
    }

    fn number(&self, index: usize) -> u64 {
        self.frames.get(index).map_or(index as u64, |f| f.number)
    }

    fn warnings(&self) -> Vec<String> {
        let met = self.labels.as_ref().map(Labels::warnings).unwrap_or_default();
        self.warnings.iter().cloned().chain(met).collect()
    }
}
