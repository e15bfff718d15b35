//! The test bodies for a page, see `www/test/consistency.mjs`.
use crate::{
    body::{self, TRAJECTORY_TOLERANCE_M, check_cases, largest_gap_m},
    recorded::Recorded,
};
use mte_slam_core::{
    engine::{Engine, GpuOptions},
    kernels,
};
use wasm_bindgen::prelude::*;

/// Results of the native CPU engine, to compare with.
#[wasm_bindgen]
pub struct Reference(Recorded);

async fn engine(kind: &str) -> Result<Engine, JsError> {
    match kind {
        "cpu" => Ok(Engine::cpu()),
        _ => Ok(Engine::gpu(GpuOptions::default()).await?),
    }
}

#[wasm_bindgen]
impl Reference {
    /// Reads the bytes that the example `kernel_outputs` wrote.
    ///
    /// # Errors
    /// They are of another version.
    #[wasm_bindgen(constructor)]
    pub fn new(bytes: &[u8]) -> Result<Reference, JsError> {
        console_error_panic_hook::set_once();
        let recorded = Recorded::from_bytes(bytes);
        Ok(Reference(recorded.ok_or_else(|| JsError::new("not a file of this version"))?))
    }

    /// Names of the kernels.
    pub fn kernels(&self) -> Vec<String> {
        kernels::all().iter().map(|kernel| kernel.interface.name.into()).collect()
    }

    /// Number of cases of a kernel. (That every kernel has one is a native test's business.)
    pub fn cases(&self, kernel: usize) -> usize {
        self.0.kernels[kernel].0.len()
    }

    /// Runs every case of a kernel on `cpu` or `gpu`; an empty text, or the first difference.
    ///
    /// # Errors
    /// There is no such engine here.
    pub async fn check(&self, kind: &str, kernel: usize) -> Result<String, JsError> {
        let (cases, expected) = &self.0.kernels[kernel];
        let checked = check_cases(&mut engine(kind).await?, cases, expected).await;
        Ok(checked.err().unwrap_or_default())
    }

    /// Spoils an expected value of a kernel by a thousandth, to see that it is noticed.
    pub fn spoil(&mut self, kernel: usize) {
        let (cases, expected) = &mut self.0.kernels[kernel];
        let changed = (0..expected[0].len()).find(|i| expected[0][*i] != cases[0].buffers[*i]);
        if let Some(i) = changed {
            let size = |w: &u32| f32::from_bits(*w).abs();
            let finite = |w: &&mut u32| f32::from_bits(**w).is_finite();
            let words = expected[0][i].iter_mut().filter(finite);
            if let Some(word) = words.max_by(|a, b| size(a).total_cmp(&size(b))) {
                *word = (f32::from_bits(*word) * 1.01).to_bits();
            }
        }
    }

    /// Runs the short sequence; the largest distance to the reference's positions \[m\].
    ///
    /// # Errors
    /// There is no such engine here, or the run fails.
    pub async fn run(&self, kind: &str) -> Result<f64, JsError> {
        let poses = body::short_run(engine(kind).await?).await?;
        Ok(largest_gap_m(&self.0.poses, &poses))
    }

    /// How large that may be \[m\]: nothing at all between CPU engines.
    pub fn tolerance_m(&self, kind: &str) -> f64 {
        if kind == "cpu" { 0.0 } else { TRAJECTORY_TOLERANCE_M }
    }
}
