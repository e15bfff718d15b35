//! A small but real problem: frames of a box-shaped room with holes in depth and labels, random
//! planes whose signed distance changes its sign, and every intermediate buffer of a pass.
use crate::{TestRandom, f32_words};
use bytemuck::Zeroable;
use glam::DVec3;
use mte_slam_core::{
    commands::{Command, Commands, workgroups_1d},
    config::FieldConfig,
    engine::{Engine, EngineError},
    field::{FieldShape, initial_decoders},
    kernel::Kernel,
    kernels::{
        self,
        shared::{FLAG_GUIDED, FLAG_MAP, FLAG_MASK, FLAG_POSE, RAY_WORDS},
    },
    layout::{BACKWARD_STRIP, FieldParams, RAY_OUT_FLOATS, RAY_STATE_FLOATS},
    map::pose_words,
    shaders::decoders::GEOMETRY,
};
use mte_slam_types::{
    camera::Camera,
    frame::{Bounds, Frame},
    pose::Pose,
};
use pollster::block_on;
use std::collections::BTreeMap;

/// Bits that no kernel writes on purpose: a NaN with a pattern.
pub const POISON: u32 = 0x7fc0_dead;
/// Metres per unit of the depth images.
pub const DEPTH_UNIT_M: f64 = 0.001;
/// Number of frames (and slots).
pub const FRAMES: u32 = 3;
/// Classes of the labels.
pub const CLASSES: u32 = 5;

/// What varies between problems.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Rays of each of the three frames.
    pub rays_per_frame: u32,
    /// Stratified samples.
    pub stratified: u32,
    /// Second-round samples.
    pub surface: u32,
    /// `FLAG_*`.
    pub flags: u32,
    /// Classes, 0 or [`CLASSES`].
    pub classes: u32,
    /// Sharpness of the interval weights.
    pub sharpness: f32,
    /// Lightest interval that carries appearance.
    pub min_weight: f32,
    /// Smallest gradient that is kept.
    pub min_gradient: f32,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            rays_per_frame: 27,
            stratified: 12,
            surface: 4,
            flags: FLAG_GUIDED | FLAG_MAP | FLAG_POSE,
            classes: CLASSES,
            sharpness: 10.0,
            min_weight: 1e-3,
            min_gradient: 2e-4,
        }
    }
}

/// The camera of all frames. An odd number of pixels: the last word of a depth image is half used.
pub fn camera() -> Camera {
    Camera { width: 25, height: 19, fx: 17.0, fy: 18.0, cx: 11.7, cy: 9.2 }
}

/// Cells of 0.25 m and 0.125 m in a box of 1.5 m.
pub fn field_config() -> FieldConfig {
    FieldConfig {
        geometry_coarse_m: 0.25,
        geometry_fine_m: 0.125,
        surface_coarse_m: 0.25,
        surface_fine_m: 0.125,
        truncation_m: 0.12,
        ..FieldConfig::default()
    }
}

/// The map's shape; its edges differ, so that mixed-up axes show.
pub fn shape() -> FieldShape {
    let half = DVec3::new(0.75, 0.5, 0.875);
    FieldShape::new(Bounds { min: -half, max: half }, &field_config())
}

/// Pose of a frame, near the middle of the room.
pub fn pose(frame: u32) -> Pose {
    let mut random = TestRandom(100 + u64::from(frame));
    let mut twist = [0.0; 6];
    for x in &mut twist[..3] {
        *x = f64::from(random.uniform(-0.12, 0.12));
    }
    for x in &mut twist[3..] {
        *x = f64::from(random.uniform(-0.8, 0.8));
    }
    Pose::from_twist(&twist)
}

/// What the camera at `pose` sees of the room: depth with holes and a few depths beyond the map,
/// colours, and the wall as the class with some pixels unlabelled.
pub fn frame(index: u32) -> Frame {
    frame_of(&camera(), index)
}

/// A camera of 13 x 7 tokens of 8 pixels and a rest: more than a workgroup's 64.
pub fn wide_camera() -> Camera {
    Camera { width: 109, height: 59, fx: 62.0, fy: 65.0, cx: 52.3, cy: 30.1 }
}

/// As [`frame`], of another camera.
pub fn frame_of(camera: &Camera, index: u32) -> Frame {
    let pose = pose(index);
    let room = DVec3::new(0.7, 0.45, 0.8);
    let mut random = TestRandom(200 + u64::from(index));
    let (mut color, mut depth, mut labels) = (Vec::new(), Vec::new(), Vec::new());
    for pixel in 0..camera.pixels() as u32 {
        let (u, v) = (f64::from(pixel % camera.width), f64::from(pixel / camera.width));
        let direction = pose.transform_vector(camera.back_project(u, v, 1.0));
        let (mut z, mut wall) = (f64::MAX, 0);
        for k in 0..3 {
            let limit = room[k].copysign(direction[k]);
            let t = (limit - pose.translation[k]) / direction[k];
            if t < z {
                (z, wall) = (t, 2 * k as u8 + u8::from(limit > 0.0));
            }
        }
        let raw = (z / DEPTH_UNIT_M) as u16;
        depth.push(match random.bits() % 16 {
            0..=3 => 0,
            4 => raw * 3 / 2,
            _ => raw,
        });
        labels.push(if wall >= CLASSES as u8 || random.bits().is_multiple_of(8) {
            255
        } else {
            wall
        });
        let mut channel = |base: u8| base.wrapping_mul(40) / 2 + (random.bits() % 60) as u8 + 20;
        color.push([channel(wall), channel(wall + 2), channel(5 - wall)]);
    }
    let number = u64::from(index);
    let labels = Some(labels);
    Frame {
        index: index as usize,
        number,
        time_s: 0.0,
        color,
        depth,
        labels,
        truth: Some(pose),
        features: None,
    }
}

/// Parameters and named buffers of a pass, as words. Names are those of the kernels' bindings.
#[derive(Clone)]
pub struct State {
    /// Parameters of the field kernels.
    pub params: FieldParams,
    /// Buffers by the binding's name.
    pub buffers: BTreeMap<&'static str, Vec<u32>>,
}

fn random_planes(floats: usize, seed: u64) -> Vec<u32> {
    let mut random = TestRandom(seed);
    f32_words((0..floats).map(|_| random.uniform(-0.3, 0.3)))
}

/// The field kernels' parameters of a problem.
pub fn params(o: &Options) -> FieldParams {
    let c = camera();
    let mut p = FieldParams {
        width: c.width,
        height: c.height,
        rays: FRAMES * o.rays_per_frame,
        samples: o.stratified + o.surface,
        fx: c.fx as f32,
        fy: c.fy as f32,
        cx: c.cx as f32,
        cy: c.cy as f32,
        depth_unit: DEPTH_UNIT_M as f32,
        truncation: field_config().truncation_m as f32,
        sharpness: o.sharpness,
        near: 0.02,
        seed: 3,
        iteration: 17,
        flags: o.flags,
        rays_per_frame: o.rays_per_frame,
        stratified: o.stratified,
        surface_samples: o.surface,
        classes: o.classes,
        weight_free: 2.0,
        weight_centre: 60.0,
        weight_tail: 10.0,
        weight_depth: 1.0,
        weight_color: 5.0,
        weight_semantic: 0.5,
        min_weight: o.min_weight,
        decoder_stride: 1,
        contribution_limit: 4_194_304.0,
        inv_sigma_distance: 100.0,
        inv_sigma_intensity: 10.0,
        robust_distance: 0.02,
        robust_intensity: 0.2,
        min_gradient: o.min_gradient,
        ..FieldParams::zeroed()
    };
    shape().fill(&mut p);
    let rays = p.rays as f32;
    p.scale_geometry = 131_072.0 * rays;
    p.scale_appearance = 262_144.0 * rays;
    p.scale_semantic = 1_048_576.0 * rays;
    p
}

/// Random decoders. The first values put unseen space at +0.5; here the distance is to change its
/// sign, so the output bias is small, and biases are not zero, so that their terms are seen.
pub fn decoders(classes: u32) -> Vec<f32> {
    let mut random = TestRandom(31);
    let mut w = initial_decoders(classes, 5);
    w.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = random.uniform(-0.1, 0.1));
    w[GEOMETRY[2].weight_range()].iter_mut().for_each(|x| *x *= 3.0);
    w[GEOMETRY[2].bias] = -0.4;
    w
}

impl State {
    /// Images, poses and parameters; every buffer a kernel overwrites is poisoned, those that
    /// kernels add to or write in parts are zero.
    pub fn new(o: &Options) -> State {
        let p = params(o);
        let (rays, samples) = (p.rays as usize, (p.rays * p.samples) as usize);
        let mut b = BTreeMap::new();
        let (mut poses, mut color, mut depth) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..FRAMES {
            let f = frame(i);
            poses.extend(f32_words(pose_words(&pose(i))));
            let labels = f.labels.unwrap_or_default();
            for (c, label) in f.color.iter().zip(labels) {
                color.push(u32::from_le_bytes([c[0], c[1], c[2], label]));
            }
            for d in f.depth.chunks(2) {
                depth.push(u32::from(d[0]) | d.get(1).map_or(0, |x| u32::from(*x) << 16));
            }
        }
        b.insert("poses", poses);
        // Slots out of order, the first one's pose fixed.
        b.insert("window", vec![2 | 0x8000_0000, 0, 1]);
        b.insert("color_images", color);
        b.insert("depth_images", depth);
        let shape = shape();
        b.insert("planes_geometry", random_planes(shape.geometry_floats(), 11));
        b.insert("planes_appearance", random_planes(shape.surface_floats(), 12));
        b.insert("planes_semantic", random_planes(shape.surface_floats(), 13));
        b.insert("decoders", f32_words(decoders(o.classes)));
        let mut poison = |name, words| b.insert(name, vec![POISON; words]);
        poison("rays", rays * RAY_WORDS);
        poison("depths", samples);
        poison("features", samples * 32);
        poison("distances", samples);
        poison("weights", samples);
        poison("ray_out", rays * RAY_OUT_FLOATS);
        if o.classes > 0 {
            poison("logits_gradient", rays * o.classes as usize);
        }
        poison("distance_gradient", samples);
        poison("position_gradient", samples * 4);
        let mut zero = |name, words| b.insert(name, vec![0; words]);
        zero("gradient", shape.geometry_floats());
        zero("gradient_appearance", shape.surface_floats());
        zero("gradient_semantic", shape.surface_floats());
        zero("status", 4);
        let weights = [1.0, 0.3, 0.5, -0.2, 2.0, 0.6, 1.5, 0.0, 0.75, -0.4];
        b.insert("class_weights", f32_words(weights));
        b.insert("class_rarity", f32_words([0.1, 0.5, 2.0, 0.3, 0.3]));
        let mut zero = |name, words| b.insert(name, vec![0; words]);
        // Neither anchors nor fused features.
        zero("anchors", 4);
        zero("targets", 4);
        // Written in parts, by several kernels.
        zero("ray_state", rays * RAY_STATE_FLOATS);
        if o.classes == 0 {
            zero("logits_gradient", 4);
        }
        State { params: p, buffers: b }
    }

    /// A buffer as floats. Panics on a wrong name.
    pub fn floats(&self, name: &str) -> Vec<f32> {
        self.buffers[name].iter().map(|word| f32::from_bits(*word)).collect()
    }

    /// Copies of a kernel's buffers.
    pub fn inputs(&self, kernel: &Kernel) -> Vec<Vec<u32>> {
        kernel.interface.bindings.iter().map(|binding| self.buffers[binding.name].clone()).collect()
    }

    /// Runs a field kernel and keeps what it wrote.
    pub fn run(&mut self, engine: &mut Engine, kernel: &'static Kernel) {
        let groups = workgroups(kernel, &self.params);
        let outputs =
            run_words(engine, kernel, &words(&self.params), &self.inputs(kernel), groups).unwrap();
        for (binding, data) in kernel.interface.bindings.iter().zip(outputs) {
            self.buffers.insert(binding.name, data);
        }
    }

    /// Geometry to losses, from the rays and depths that are there.
    pub fn forward_from_depths(&mut self, engine: &mut Engine) {
        use kernels::{
            composite::COMPOSITE, decode_rays::DECODE_RAYS, geometry_forward::GEOMETRY_FORWARD,
            mask_rays::MASK_RAYS,
        };
        for kernel in [&GEOMETRY_FORWARD, &COMPOSITE, &DECODE_RAYS] {
            self.run(engine, kernel);
        }
        if self.params.flags & FLAG_MASK != 0 {
            self.run(engine, &MASK_RAYS);
        }
    }

    /// The whole forward pass.
    pub fn forward(&mut self, engine: &mut Engine) {
        self.run(engine, &kernels::sample_rays::SAMPLE_RAYS);
        self.run(engine, &kernels::sample_depths::SAMPLE_DEPTHS);
        self.forward_from_depths(engine);
    }

    /// The backward pass but the decoders. Plane features are overwritten by their gradients.
    pub fn backward(&mut self, engine: &mut Engine) {
        use kernels::{
            composite_backward::COMPOSITE_BACKWARD, geometry_backward::GEOMETRY_BACKWARD,
            pose_gradient::POSE_GRADIENT, scatter_geometry::SCATTER_GEOMETRY,
            scatter_surface::SCATTER_SURFACE,
        };
        self.run(engine, &COMPOSITE_BACKWARD);
        self.run(engine, &GEOMETRY_BACKWARD);
        if self.params.flags & FLAG_POSE != 0 {
            self.run(engine, &POSE_GRADIENT);
        }
        if self.params.flags & FLAG_MAP != 0 {
            self.run(engine, &SCATTER_GEOMETRY);
            self.run(engine, &SCATTER_SURFACE);
        }
    }
}

/// Workgroups that a field kernel needs for a batch, as the device dispatches it.
pub fn workgroups(kernel: &Kernel, p: &FieldParams) -> [u32; 3] {
    let (rays, samples) = (p.rays as usize, (p.rays * p.samples) as usize);
    let invocations = match kernel.interface.name {
        "geometry_forward" => samples,
        "geometry_backward" => samples.div_ceil(BACKWARD_STRIP as usize),
        "scatter_geometry" => rays * 24,
        "scatter_surface" => rays * if p.classes > 0 { 48 } else { 24 },
        "mask_rays" => 1,
        _ => rays,
    };
    workgroups_1d(invocations, kernel.interface.workgroup_size)
}

/// The words of a parameter struct.
pub fn words<P: bytemuck::Pod>(params: &P) -> Vec<u32> {
    bytemuck::cast_slice(core::slice::from_ref(params)).to_vec()
}

/// As [`crate::run_kernel`], with the parameters as words.
pub fn run_words(
    engine: &mut Engine,
    kernel: &'static Kernel,
    params: &[u32],
    buffers: &[Vec<u32>],
    workgroups: [u32; 3],
) -> Result<Vec<Vec<u32>>, EngineError> {
    block_on(run_words_async(engine, kernel, params, buffers, workgroups))
}

/// As [`run_words`], for hosts that must not wait.
pub async fn run_words_async(
    engine: &mut Engine,
    kernel: &'static Kernel,
    params: &[u32],
    buffers: &[Vec<u32>],
    workgroups: [u32; 3],
) -> Result<Vec<Vec<u32>>, EngineError> {
    let mut commands = Commands::new();
    let mut ids = Vec::new();
    for (binding, data) in kernel.interface.bindings.iter().zip(buffers) {
        let id = engine.create_buffer(binding.name, data.len())?;
        commands.upload(id, 0, data);
        ids.push(id);
    }
    let (bindings, params) = (ids.clone(), params.to_vec());
    commands.list.push(Command::Dispatch { kernel, bindings, params, workgroups });
    let mut outcome = engine.submit(&commands).map(|()| Vec::new());
    for (id, data) in ids.iter().zip(buffers) {
        if let Ok(all) = &mut outcome {
            match engine.read(*id, 0, data.len()).await {
                Ok(words) => all.push(words),
                Err(error) => outcome = Err(error),
            }
        }
    }
    ids.iter().for_each(|id| engine.destroy_buffer(*id));
    outcome
}
