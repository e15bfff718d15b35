//! Inputs and results of all cases, and the poses of a short run, as bytes: what one world found,
//! for another to compare with.
use crate::{
    body::{self, Outcome},
    case::Case,
    cases::cases,
};
use mte_slam_core::{
    engine::{Engine, EngineError},
    kernels,
    slam::SlamError,
};
use mte_slam_types::pose::Pose;
use pollster::block_on;

/// See the module.
pub struct Recorded {
    /// For each kernel, in the order of [`kernels::all`]: its cases and their results.
    pub kernels: Vec<(Vec<Case>, Vec<Outcome>)>,
    /// Poses of [`body::short_run`].
    pub poses: Vec<Pose>,
}

const MAGIC: u32 = 0x4d54_4531;

impl Recorded {
    /// Computes everything on the CPU engine.
    ///
    /// # Panics
    /// When the CPU engine fails: there is nothing to compare with then.
    pub fn make() -> Recorded {
        let kernels = kernels::all().iter().map(|kernel| {
            let cases = cases(kernel.interface.name);
            let mut engine = Engine::cpu();
            let run = |case: &Case| block_on(body::run_case(&mut engine, case));
            let results: Result<Vec<_>, EngineError> = cases.iter().map(run).collect();
            (cases, results.expect("the CPU engine runs every case"))
        });
        let kernels = kernels.collect();
        let poses: Result<_, SlamError> = block_on(body::short_run(Engine::cpu()));
        Recorded { kernels, poses: poses.expect("the CPU engine runs the sequence") }
    }

    /// As bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut words = vec![MAGIC];
        let put = |words: &mut Vec<u32>, list: &[u32]| {
            words.push(list.len() as u32);
            words.extend_from_slice(list);
        };
        for (cases, results) in &self.kernels {
            words.push(cases.len() as u32);
            for (case, result) in cases.iter().zip(results) {
                put(&mut words, &case.params);
                case.buffers.iter().for_each(|b| put(&mut words, b));
                result.iter().for_each(|b| put(&mut words, b));
            }
        }
        words.push(self.poses.len() as u32);
        for pose in &self.poses {
            words.extend(pose.to_row_major().iter().flat_map(|x| {
                let bits = x.to_bits();
                [bits as u32, (bits >> 32) as u32]
            }));
        }
        bytemuck::cast_slice(&words).to_vec()
    }

    /// From bytes of this program's own version; `None` when anything does not fit.
    pub fn from_bytes(bytes: &[u8]) -> Option<Recorded> {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(bytes);
        let mut rest = words.as_slice();
        let mut take = |n: usize| {
            let (head, tail) = rest.split_at_checked(n)?;
            rest = tail;
            Some(head)
        };
        if take(1)? != [MAGIC] {
            return None;
        }
        let mut all = Vec::new();
        for kernel in kernels::all() {
            // Names, tolerances and sizes are this program's; inputs and results are the other's.
            let mut cases = cases(kernel.interface.name);
            if take(1)?[0] as usize != cases.len() {
                return None;
            }
            let mut results = Vec::new();
            for case in &mut cases {
                let n = take(1)?[0] as usize;
                case.params = take(n)?.to_vec();
                for buffer in &mut case.buffers {
                    let n = take(1)?[0] as usize;
                    *buffer = take(n)?.to_vec();
                }
                let mut result = Vec::new();
                for _ in kernel.interface.bindings {
                    let n = take(1)?[0] as usize;
                    result.push(take(n)?.to_vec());
                }
                results.push(result);
            }
            all.push((cases, results));
        }
        let mut poses = Vec::new();
        for _ in 0..take(1)?[0] {
            let w = take(32)?;
            let number =
                |i: usize| f64::from_bits(u64::from(w[2 * i]) | u64::from(w[2 * i + 1]) << 32);
            poses.push(Pose::from_row_major(&core::array::from_fn(number))?);
        }
        Some(Recorded { kernels: all, poses })
    }
}
