//! Test support: engines, and the comparison of a kernel's shader with its Rust twin.
#![forbid(unsafe_code)]

pub mod anchors;
pub mod body;
#[cfg(target_arch = "wasm32")]
pub mod browser;
pub mod case;
pub mod cases;
pub mod fixture;
pub mod recorded;
pub mod rig;
pub mod samples;
pub mod tokens;

use bytemuck::Pod;
use mte_slam_core::{
    commands::Commands,
    engine::{Engine, EngineError, GpuOptions},
    kernel::Kernel,
    layout::NO_DISTANCE,
};
use pollster::block_on;

/// A GPU engine, or None with a printed line where there is no adapter. With the environment
/// variable `MTE_SLAM_REQUIRE_GPU=1` a missing adapter is a failure; `MTE_SLAM_NO_GPU=1` looks for
/// none, for a quick look at the CPU engine alone.
pub fn gpu_engine() -> Option<Engine> {
    gpu_engine_with(GpuOptions::default())
}

/// As [`gpu_engine`], with options.
pub fn gpu_engine_with(options: GpuOptions) -> Option<Engine> {
    if std::env::var("MTE_SLAM_NO_GPU").is_ok_and(|value| value == "1") {
        println!("skipped: MTE_SLAM_NO_GPU=1");
        return None;
    }
    match block_on(Engine::gpu(options)) {
        Ok(engine) => Some(engine),
        Err(error) => {
            let required = std::env::var("MTE_SLAM_REQUIRE_GPU").is_ok_and(|value| value == "1");
            assert!(!required, "MTE_SLAM_REQUIRE_GPU=1: {error}");
            println!("skipped: {error}");
            None
        }
    }
}

/// How the words of a binding are compared.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Compare {
    /// As f32: |a - b| <= absolute + relative * max(|a|, |b|); NaN equals NaN.
    F32 {
        /// Allowed difference whatever the size.
        absolute: f32,
        /// Allowed difference in parts of the larger one.
        relative: f32,
    },
    /// As i32: |a - b| <= quanta.
    I32 {
        /// Allowed difference.
        quanta: u32,
    },
    /// Equal bits.
    U32,
    /// Rows of f32, with `bits` the columns that hold integers. A difference may be `relative`
    /// times the column's largest magnitude: rounding errors of sums go with their terms, not
    /// with what is left after they cancel. Every float must be finite.
    Columns {
        /// Words a row.
        row: usize,
        /// Columns of equal bits.
        bits: &'static [usize],
        /// Allowed difference in parts of the column's largest value.
        relative: f32,
    },
}

/// How two engines' results may differ: one entry a binding, in binding order.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance(pub Vec<Compare>);

/// Two engines' results differ, or a run failed.
#[derive(Clone, Debug)]
pub enum Mismatch {
    /// The engine refused or failed.
    Engine(EngineError),
    /// The harness was given a wrong number of buffers or tolerances.
    Count {
        /// Bindings of the kernel.
        expected: usize,
        /// Buffers.
        buffers: usize,
        /// Entries of the tolerance.
        tolerances: usize,
    },
    /// The first word that differs.
    Word {
        /// The kernel's name.
        kernel: &'static str,
        /// The binding's name.
        binding: &'static str,
        /// Index of the word.
        index: usize,
        /// The expected and the found value, as the binding's type.
        expected: String,
        /// See `expected`.
        found: String,
        /// Words of this binding that differ.
        count: usize,
    },
}

impl From<EngineError> for Mismatch {
    fn from(error: EngineError) -> Self {
        Mismatch::Engine(error)
    }
}

/// Runs a kernel once from the given buffers and returns all buffers afterwards.
pub fn run_kernel<P: Pod>(
    engine: &mut Engine,
    kernel: &'static Kernel,
    params: &P,
    buffers: &[Vec<u32>],
    workgroups: [u32; 3],
) -> Result<Vec<Vec<u32>>, EngineError> {
    let mut commands = Commands::new();
    let mut ids = Vec::new();
    for (i, words) in buffers.iter().enumerate() {
        let name = kernel.interface.bindings.get(i).map_or("surplus", |binding| binding.name);
        let id = engine.create_buffer(name, words.len())?;
        commands.upload(id, 0, words);
        ids.push(id);
    }
    commands.dispatch(kernel, params, &ids, workgroups);
    let outcome = engine.submit(&commands).and_then(|()| {
        ids.iter()
            .zip(buffers)
            .map(|(id, words)| block_on(engine.read(*id, 0, words.len())))
            .collect()
    });
    ids.iter().for_each(|id| engine.destroy_buffer(*id));
    outcome
}

/// Runs a kernel on the CPU and on the GPU engine from identical buffers and compares every
/// buffer. Without an adapter this prints a line and is satisfied.
pub fn compare_kernel<P: Pod>(
    kernel: &'static Kernel,
    params: &P,
    buffers: &[Vec<u32>],
    workgroups: [u32; 3],
    tolerance: &Tolerance,
) -> Result<(), Mismatch> {
    let expected = run_kernel(&mut Engine::cpu(), kernel, params, buffers, workgroups)?;
    let Some(mut gpu) = gpu_engine() else { return Ok(()) };
    let found = run_kernel(&mut gpu, kernel, params, buffers, workgroups)?;
    compare_outputs(kernel, &expected, &found, tolerance)
}

/// Compares two engines' buffers.
pub fn compare_outputs(
    kernel: &Kernel,
    expected: &[Vec<u32>],
    found: &[Vec<u32>],
    tolerance: &Tolerance,
) -> Result<(), Mismatch> {
    let bindings = kernel.interface.bindings.len();
    if [expected.len(), found.len(), tolerance.0.len()].iter().any(|n| *n != bindings) {
        let tolerances = tolerance.0.len();
        return Err(Mismatch::Count { expected: bindings, buffers: found.len(), tolerances });
    }
    for (i, compare) in tolerance.0.iter().enumerate() {
        let pairs = || expected[i].iter().zip(&found[i]).enumerate();
        let largest = column_maxima(*compare, &expected[i]);
        let differs = |index: usize, (a, b): (&u32, &u32)| match *compare {
            Compare::Columns { row, bits, .. } if bits.contains(&(index % row)) => a != b,
            Compare::Columns { row, relative, .. } => {
                let (a, b) = (f32::from_bits(*a), f32::from_bits(*b));
                let close = (a - b).abs() <= relative * largest[index % row];
                !(close && a.is_finite() && b.is_finite())
            }
            _ => !within(*compare, *a, *b),
        };
        let first = pairs().find(|(index, pair)| differs(*index, *pair));
        let count = pairs().filter(|(index, pair)| differs(*index, *pair)).count();
        if let Some((index, (a, b))) = first {
            return Err(Mismatch::Word {
                kernel: kernel.interface.name,
                binding: kernel.interface.bindings[i].name,
                index,
                expected: show(*compare, *a),
                found: show(*compare, *b),
                count,
            });
        }
    }
    Ok(())
}

/// Largest magnitude of each column, of what is finite and stands for a value (no anchor is
/// [`NO_DISTANCE`] away).
fn column_maxima(compare: Compare, words: &[u32]) -> Vec<f32> {
    let Compare::Columns { row, .. } = compare else { return Vec::new() };
    let mut largest = vec![0.0_f32; row];
    for (i, word) in words.iter().enumerate() {
        let x = f32::from_bits(*word).abs();
        if x < NO_DISTANCE {
            largest[i % row] = largest[i % row].max(x);
        }
    }
    largest
}

fn within(compare: Compare, a: u32, b: u32) -> bool {
    match compare {
        _ if a == b => true,
        // Columns need their maxima; see `compare_outputs`.
        Compare::U32 | Compare::Columns { .. } => false,
        Compare::I32 { quanta } => (a as i32).abs_diff(b as i32) <= quanta,
        Compare::F32 { absolute, relative } => {
            let (a, b) = (f32::from_bits(a), f32::from_bits(b));
            let allowed = absolute + relative * a.abs().max(b.abs());
            (a - b).abs() <= allowed && allowed.is_finite() || a.is_nan() && b.is_nan()
        }
    }
}

fn show(compare: Compare, word: u32) -> String {
    match compare {
        Compare::U32 => format!("{word:#010x}"),
        Compare::I32 { .. } => format!("{}", word as i32),
        Compare::F32 { .. } | Compare::Columns { .. } => format!("{:e}", f32::from_bits(word)),
    }
}

/// The bits of floats.
pub fn f32_words(values: impl IntoIterator<Item = f32>) -> Vec<u32> {
    values.into_iter().map(f32::to_bits).collect()
}

/// The bits of signed integers.
pub fn i32_words(values: impl IntoIterator<Item = i32>) -> Vec<u32> {
    values.into_iter().map(|value| value as u32).collect()
}

/// A small deterministic generator for test data (SplitMix64).
pub struct TestRandom(pub u64);

impl TestRandom {
    /// 32 random bits.
    pub fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 32) as u32
    }

    /// Uniform in \[low, high).
    pub fn uniform(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.bits() >> 8) as f32 / (1 << 24) as f32
    }
}

/// The README's example must compile.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
