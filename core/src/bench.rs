//! Where an optimisation step spends its time.
use crate::{
    camera::Camera,
    config::{Config, LossConfig},
    device::{Batch, Device, Rates},
    engine::Engine,
    field::FieldShape,
    frame::{Bounds, Frame},
    kernels::shared::{FLAG_GUIDED, FLAG_MAP, FLAG_MASK, FLAG_POSE},
    pose::Pose,
    recording::{Command, Recording},
    slam::SlamError,
};
use alloc::{string::String, string::ToString, vec::Vec};
use glam::{DMat3, DVec3};

/// One kernel's share of an iteration.
#[derive(Clone, Debug)]
pub struct BenchStage {
    /// Kernel.
    pub name: String,
    /// Median time in an iteration, each dispatch waited for \[ms\].
    pub milliseconds: f64,
}

/// Times of one tracking and one mapping iteration.
#[derive(Clone, Debug)]
pub struct BenchReport {
    /// Stages of a `render` tracking iteration.
    pub tracking: Vec<BenchStage>,
    /// A whole tracking iteration, submitted at once \[ms\].
    pub tracking_iteration_ms: f64,
    /// Stages of a mapping iteration.
    pub mapping: Vec<BenchStage>,
    /// A whole mapping iteration, submitted at once \[ms\].
    pub mapping_iteration_ms: f64,
}

/// Classes of the benchmark, as Replica has.
pub const BENCH_CLASSES: u32 = 52;

/// A box seen from inside: its walls are the frame's depth.
fn box_frame(camera: &Camera, half: DVec3, unit_m: f64) -> Frame {
    let mut color = Vec::new();
    let mut depth = Vec::new();
    let mut labels = Vec::new();
    for v in 0..camera.height {
        for u in 0..camera.width {
            let d = camera.back_project(f64::from(u), f64::from(v), 1.0);
            let mut z = f64::INFINITY;
            for k in 0..3 {
                if d[k] != 0.0 {
                    z = z.min(half[k] / num_traits::Float::abs(d[k]));
                }
            }
            let p = d * z;
            let wave = |x: f64| (127.0 + 100.0 * num_traits::Float::sin(x * 9.0)) as u8;
            color.push([wave(p.x), wave(p.y), wave(p.z)]);
            depth.push((z / unit_m) as u16);
            labels.push(((u / 8 + v / 8 * 7) % BENCH_CLASSES) as u8);
        }
    }
    Frame {
        index: 0,
        number: 0,
        time_s: 0.0,
        color,
        depth,
        labels: Some(labels),
        truth: Some(Pose::IDENTITY),
    }
}

fn median(mut v: Vec<f64>) -> f64 {
    v.sort_by(f64::total_cmp);
    v.get(v.len() / 2).copied().unwrap_or(0.0)
}

fn batch<'a>(config: &Config, loss: &'a LossConfig, rays: u32, flags: u32, i: u32) -> Batch<'a> {
    Batch {
        frames: 1,
        rays_per_frame: rays,
        stratified: config.sampling.stratified,
        surface: config.sampling.surface,
        flags,
        loss,
        iteration: i,
        first: 0,
    }
}

/// Measures `repeats` iterations after a warm-up of `trained` mapping iterations: 2000 x 40 for
/// tracking, 4000 x 40 for mapping, on a box of 5.3 x 2.9 x 2.9 m with 52 classes.
///
/// # Errors
/// Engine failures.
pub async fn bench(
    engine: Engine,
    repeats: u32,
    trained: u32,
    clock: fn() -> f64,
) -> Result<BenchReport, SlamError> {
    let mut config = Config::default();
    config.sampling.stratified = 32;
    config.sampling.surface = 8;
    config.mapping.rays = 4000;
    config.tracking.render_rays = 2000;
    let camera = Camera { width: 320, height: 240, fx: 208.0, fy: 208.0, cx: 159.5, cy: 119.5 };
    let unit_m = 1.0 / 6553.5;
    let half = DVec3::new(2.65, 1.45, 1.45);
    let bounds = Bounds { min: -half, max: half };
    let shape = FieldShape::new(bounds, &config.field);
    let mut device = Device::new(engine, &config, camera, unit_m, BENCH_CLASSES, shape)?;
    // Looking along x, the long side.
    let pose =
        Pose { rotation: DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X), translation: DVec3::ZERO };
    let turned = DVec3::new(half.y, half.z, half.x) - 0.05;
    let frame = box_frame(&camera, turned, unit_m);
    let mut r = Recording::default();
    device.upload_frame(&mut r, 1, &frame);
    device.upload_pose(&mut r, 1, &pose);
    device.engine.submit(&r)?;
    let rates =
        Rates { planes: config.mapping.rate_planes, decoders: config.mapping.rate_decoders };
    let map = |device: &mut Device, i: u32| {
        let flags = FLAG_GUIDED | FLAG_MAP;
        let b = batch(&config, &config.loss, config.mapping.rays, flags, i);
        let mut r = Recording::default();
        device.upload_window(&mut r, &[(1, true)]);
        device.record_forward(&mut r, &b);
        device.record_backward(&mut r, &b);
        device.record_step(&mut r, &b, rates);
        r
    };
    let track = |device: &mut Device, i: u32| {
        let flags = FLAG_GUIDED | FLAG_POSE | FLAG_MASK;
        let t = &config.tracking;
        let b = batch(&config, &t.render_loss, t.render_rays, flags, i);
        let mut r = Recording::default();
        device.upload_pose(&mut r, 1, &pose);
        device.upload_window(&mut r, &[(1, false)]);
        device.record_forward(&mut r, &b);
        device.record_backward(&mut r, &b);
        device.record_pose_step(&mut r, &b, 1e-6, 1e-6, i == 0);
        r
    };
    for i in 0..trained.max(1) {
        let r = map(&mut device, i);
        device.engine.submit(&r)?;
    }
    let r = track(&mut device, 0);
    device.engine.submit(&r)?;
    device.engine.synchronise().await?;

    let mut report = BenchReport {
        tracking: Vec::new(),
        tracking_iteration_ms: 0.0,
        mapping: Vec::new(),
        mapping_iteration_ms: 0.0,
    };
    for mapping in [false, true] {
        let mut totals = Vec::new();
        let mut stages: Vec<(&'static str, Vec<f64>)> = Vec::new();
        for i in 0..repeats.max(1) {
            let make = |device: &mut Device, i| {
                if mapping { map(device, i) } else { track(device, i) }
            };
            let whole = make(&mut device, trained + 2 * i);
            let start = clock();
            device.engine.submit(&whole)?;
            device.engine.synchronise().await?;
            totals.push((clock() - start) * 1e3);
            // The same again, waiting after every dispatch.
            let mut times: Vec<(&'static str, f64)> = Vec::new();
            for command in make(&mut device, trained + 2 * i + 1).commands {
                let name = match &command {
                    Command::Dispatch { kernel, .. } => kernel.name,
                    _ => "uploads",
                };
                let one = Recording { commands: alloc::vec![command] };
                let start = clock();
                device.engine.submit(&one)?;
                device.engine.synchronise().await?;
                let ms = (clock() - start) * 1e3;
                match times.iter_mut().find(|t| t.0 == name) {
                    Some(t) => t.1 += ms,
                    None => times.push((name, ms)),
                }
            }
            for (name, ms) in times {
                match stages.iter_mut().find(|s| s.0 == name) {
                    Some(s) => s.1.push(ms),
                    None => stages.push((name, alloc::vec![ms])),
                }
            }
        }
        let stages = stages
            .into_iter()
            .map(|(name, v)| BenchStage { name: name.to_string(), milliseconds: median(v) })
            .collect();
        if mapping {
            (report.mapping, report.mapping_iteration_ms) = (stages, median(totals));
        } else {
            (report.tracking, report.tracking_iteration_ms) = (stages, median(totals));
        }
    }
    Ok(report)
}
