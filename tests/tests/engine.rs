//! What both engines promise: order, zeroed buffers, large dispatches, typed errors.
use mte_slam_core::{
    commands::{BufferId, Commands, workgroups_1d},
    engine::{Engine, EngineError, GpuEngine, GpuOptions, MAX_BUFFER_BYTES, list_adapters},
    kernel::{CpuDispatch, Kernel, add_i32, load_u32, store_u32},
    shaders::{interface::Interface, shared_struct, structs::StructLayout},
};
use mte_slam_tests::{TestRandom, gpu_engine, gpu_engine_with};
use pollster::block_on;

/// A kernel that is declared outside of the crates.
mod affine {
    use super::{TestParams, affine_twin};
    use mte_slam_core::{kernel, shaders::interface};

    interface! {
        /// values\[i\] = values\[i\] * factors\[i % 4\] + source\[0\], and counts the invocations.
        pub affine {
            wgsl: "#import shared/dispatch.wgsl
                #bindings
                @compute @workgroup_size(WORKGROUP_SIZE)
                fn main(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>,
                    @builtin(local_invocation_index) l: u32) {
                    let i = linear_invocation(w, n, l);
                    if (i < params.count) {
                        values[i] = values[i] * params.factors[i % 4u] + source[0];
                        atomicAdd(&counter[0], 1);
                    }
                }",
            workgroup_size: 64,
            params: TestParams,
            bindings: {
                /// What is added.
                source: Read<u32>,
                /// What is changed.
                values: ReadWrite<u32>,
                /// Number of invocations that changed something.
                counter: Atomic<i32>,
            }
        }
    }
    kernel! { pub static AFFINE = self, affine_twin }
}
use affine::{AFFINE, Views};

shared_struct! {
    /// Parameters of the test kernels.
    pub struct TestParams {
        /// A factor by component.
        factors: [u32; 4],
        /// Words of `values`.
        count: u32,
    }
}

fn affine_twin(dispatch: &CpuDispatch<'_>) {
    let p: TestParams = dispatch.params();
    let Views { source, values, counter } = dispatch.views();
    dispatch.for_each_invocation(|i| {
        if i < p.count as usize {
            let value = load_u32(&values[i]).wrapping_mul(p.factors[i % 4]);
            store_u32(&values[i], value.wrapping_add(source[0]));
            add_i32(&counter[0], 1);
        }
    });
}

/// A kernel without bindings.
const fn bare(name: &'static str, wgsl: &'static str) -> Interface {
    const NONE: StructLayout = StructLayout { name: "None", fields: &[], size: 0 };
    Interface { name, wgsl, workgroup_size: 1, bindings: &[], params: &NONE }
}

/// A kernel whose shader is not valid.
static BROKEN: Kernel = Kernel {
    interface: &bare(
        "broken",
        "#bindings\n@compute @workgroup_size(1) fn main() { let x: f32 = 1u; }",
    ),
    twin: |_| {},
};

/// A kernel whose shader has an unknown constant.
static UNKNOWN: Kernel =
    Kernel { interface: &bare("unknown", "#bindings\nconst A = ${NOPE};"), twin: |_| {} };

/// Runs a test on the CPU engine and, where there is one, on the GPU engine.
fn on_both(test: impl Fn(&mut Engine)) {
    test(&mut Engine::cpu());
    if let Some(mut engine) = gpu_engine() {
        test(&mut engine);
    }
}

fn read(engine: &mut Engine, buffer: BufferId, offset: usize, words: usize) -> Vec<u32> {
    block_on(engine.read(buffer, offset, words)).unwrap()
}

fn times(factor: u32, count: usize) -> TestParams {
    TestParams { factors: [factor, factor, factor, factor + 1], count: count as u32 }
}

#[test]
fn buffers_begin_zeroed_and_report_their_size() {
    on_both(|engine| {
        let a = engine.create_buffer("a", 1001).unwrap();
        let empty = engine.create_buffer("empty", 0).unwrap();
        assert_eq!(read(engine, a, 0, 1001), vec![0; 1001]);
        assert_eq!(read(engine, empty, 0, 0), Vec::<u32>::new());
        assert!(engine.allocated_bytes() >= 4004);
        engine.destroy_buffer(a);
        engine.destroy_buffer(a);
        engine.destroy_buffer(empty);
        assert_eq!(engine.allocated_bytes(), 0);
        assert!(engine.max_buffer_words() <= (MAX_BUFFER_BYTES / 4) as usize);
        assert!(!engine.info().adapter.is_empty());
    });
}

#[test]
fn commands_take_effect_in_order() {
    on_both(|engine| {
        let n = 8;
        let source = engine.create_buffer("source", 1).unwrap();
        let values = engine.create_buffer("values", n).unwrap();
        let copied = engine.create_buffer("copied", n).unwrap();
        let counter = engine.create_buffer("counter", 1).unwrap();
        let bound = [source, values, counter];
        let mut commands = Commands::new();
        commands.upload(values, 0, &[1u32, 2, 3, 4, 5, 6, 7, 8]);
        commands.upload(source, 0, &[100u32]);
        commands.dispatch_1d(&AFFINE, &times(2, n), &bound, n);
        // These must not overtake the dispatch.
        commands.upload(source, 0, &[1000u32]);
        commands.copy(values, 0, copied, 2, 4);
        commands.clear(values, 0, 2);
        commands.dispatch_1d(&AFFINE, &times(1, n), &bound, n);
        commands.dispatch_1d(&AFFINE, &times(1, n), &bound, n);
        commands.upload(values, 7, &[-1i32]);
        engine.submit(&commands).unwrap();
        assert_eq!(read(engine, copied, 0, n), [0, 0, 102, 104, 106, 112, 0, 0]);
        let expected = [2000, 2000, 2106, (112 * 2 + 1000) * 2 + 1000, 2110, 2112, 2114, u32::MAX];
        assert_eq!(read(engine, values, 0, n), expected);
        assert_eq!(read(engine, values, 3, 2), expected[3..5]);
        assert_eq!(block_on(engine.read_as::<i32>(values, 7, 1)).unwrap(), [-1]);
        assert_eq!(read(engine, counter, 0, 1), [24]);
        block_on(engine.synchronise()).unwrap();
    });
}

#[test]
fn long_lists_keep_their_order_and_parameters() {
    on_both(|engine| {
        let source = engine.create_buffer("source", 1).unwrap();
        let values = engine.create_buffer("values", 4).unwrap();
        let counter = engine.create_buffer("counter", 1).unwrap();
        let (mut commands, mut random) = (Commands::new(), TestRandom(3));
        let mut expected = [0u32; 4];
        for i in 0..500u32 {
            let factors = [random.bits(), random.bits(), random.bits(), random.bits()];
            if i % 50 == 7 {
                commands.upload(source, 0, &[i]);
            }
            let added = if i < 7 { 0 } else { (i - 7) / 50 * 50 + 7 };
            let params = TestParams { factors, count: 4 };
            commands.dispatch_1d(&AFFINE, &params, &[source, values, counter], 4);
            for (value, factor) in expected.iter_mut().zip(factors) {
                *value = value.wrapping_mul(factor).wrapping_add(added);
            }
        }
        // Twice: the cached pipelines and bind groups serve the second run.
        for runs in 1..=2 {
            if runs == 2 {
                engine
                    .submit(&{
                        let mut clear = Commands::new();
                        clear.clear(values, 0, 4);
                        clear.clear(source, 0, 1);
                        clear
                    })
                    .unwrap();
            }
            engine.submit(&commands).unwrap();
            assert_eq!(read(engine, values, 0, 4), expected);
            assert_eq!(read(engine, counter, 0, 1), [2000 * runs]);
        }
    });
}

#[test]
fn more_workgroups_than_one_dimension_holds() {
    on_both(|engine| {
        let n = 65_535 * 64 + 1000;
        assert!(workgroups_1d(n, 64)[1] > 1);
        let source = engine.create_buffer("source", 1).unwrap();
        let values = engine.create_buffer("values", n).unwrap();
        let counter = engine.create_buffer("counter", 1).unwrap();
        let mut commands = Commands::new();
        commands.upload(source, 0, &[3u32]);
        commands.dispatch_1d(&AFFINE, &times(1, n), &[source, values, counter], n);
        engine.submit(&commands).unwrap();
        assert_eq!(read(engine, counter, 0, 1), [n as u32]);
        assert!(read(engine, values, 0, n).iter().all(|value| *value == 3));
    });
}

#[test]
fn mistakes_are_refused_before_anything_runs() {
    on_both(|engine| {
        let a = engine.create_buffer("a", 8).unwrap();
        let b = engine.create_buffer("b", 8).unwrap();
        let c = engine.create_buffer("c", 8).unwrap();
        let gone = engine.create_buffer("gone", 8).unwrap();
        engine.destroy_buffer(gone);
        let params = times(1, 8);
        let mut refuse = |record: &dyn Fn(&mut Commands)| {
            let mut commands = Commands::new();
            commands.upload(a, 0, &[7u32]);
            record(&mut commands);
            let error = engine.submit(&commands).unwrap_err();
            assert_eq!(read(engine, a, 0, 1), [0], "{error} came too late");
            error
        };
        let error = refuse(&|r| r.upload(b, 7, &[1u32, 2]));
        assert_eq!(error.to_string(), "upload of 2 words at 7 leaves buffer b of 8 words");
        let out = |error| matches!(error, EngineError::OutOfRange { .. });
        assert!(out(refuse(&|r| r.clear(b, 9, 1))));
        assert!(out(refuse(&|r| r.clear(b, usize::MAX, 2))));
        assert!(out(refuse(&|r| r.copy(a, 0, b, 5, 4))));
        assert!(out(refuse(&|r| r.copy(a, 5, b, 0, 4))));
        let error = refuse(&|r| r.copy(a, 0, a, 4, 4));
        assert!(matches!(error, EngineError::CopyWithinBuffer { buffer: "a" }));
        let error = refuse(&|r| r.dispatch_1d(&AFFINE, &params, &[a, b], 8));
        assert!(matches!(error, EngineError::BindingCount { expected: 3, found: 2, .. }));
        let error = refuse(&|r| r.dispatch_1d(&AFFINE, &params, &[a, b, a], 8));
        assert_eq!(
            error.to_string(),
            "kernel affine: buffer a is bound both as source and as counter"
        );
        let error = refuse(&|r| r.dispatch_1d(&AFFINE, &1u32, &[a, b, c], 8));
        assert!(matches!(error, EngineError::ParamsSize { expected: 20, found: 4, .. }));
        let error = refuse(&|r| r.dispatch_1d(&AFFINE, &params, &[a, gone, c], 8));
        assert!(matches!(error, EngineError::UnknownBuffer { id, .. } if id == gone));
        let error = refuse(&|r| r.dispatch(&AFFINE, &params, &[a, b, c], [65_536, 1, 1]));
        assert!(matches!(error, EngineError::TooManyWorkgroups { .. }));
        let error = block_on(engine.read(b, 4, 5)).unwrap_err();
        assert!(matches!(error, EngineError::OutOfRange { operation: "read", .. }));
        assert!(block_on(engine.read_as::<u64>(b, 0, usize::MAX)).is_err());
        // Nothing is recorded for no work, and the engine is still usable.
        let mut commands = Commands::new();
        commands.dispatch(&AFFINE, &params, &[a, b, c], [4, 0, 1]);
        assert!(commands.list.is_empty());
        commands.upload(a, 0, &[7u32]);
        engine.submit(&commands).unwrap();
        assert_eq!(read(engine, a, 0, 1), [7]);
    });
}

#[test]
fn too_large_buffers_are_refused_with_numbers() {
    on_both(|engine| {
        let most = engine.max_buffer_words();
        for words in [most + 1, usize::MAX] {
            let error = engine.create_buffer("huge", words).unwrap_err();
            assert!(matches!(error, EngineError::BufferTooLarge { name: "huge", .. }), "{error}");
            assert!(error.to_string().contains(&(4 * most).to_string()), "{error}");
        }
        let largest = engine.create_buffer("largest", most).unwrap();
        engine.destroy_buffer(largest);
    });
}

#[test]
fn broken_shaders_are_typed_errors_and_the_engine_survives() {
    let Some(mut engine) = gpu_engine() else { return };
    let mut commands = Commands::new();
    commands.dispatch(&BROKEN, &(), &[], [1, 1, 1]);
    let error = engine.submit(&commands).unwrap_err();
    assert!(matches!(&error, EngineError::Validation { message } if message.contains("broken")));
    let mut commands = Commands::new();
    commands.dispatch(&UNKNOWN, &(), &[], [1, 1, 1]);
    let error = engine.submit(&commands).unwrap_err();
    assert!(error.to_string().contains("unknown.wgsl line 2: unknown name NOPE"), "{error}");
    if let Engine::Gpu(engine) = &mut engine {
        let error = block_on(engine.precompile(&[&AFFINE, &BROKEN])).unwrap_err();
        assert!(error.to_string().contains("kernel broken"), "{error}");
        block_on(engine.precompile(&[&AFFINE])).unwrap();
    }
    let a = engine.create_buffer("a", 4).unwrap();
    assert_eq!(read(&mut engine, a, 0, 4), [0; 4]);
}

#[test]
fn a_wrong_adapter_name_lists_the_adapters() {
    let options = GpuOptions { adapter_name: Some("no such card".into()), ..Default::default() };
    let Err(error) = block_on(GpuEngine::new(options)) else { panic!("found no such card") };
    let EngineError::NoAdapter { wanted, found } = &error else { panic!("{error}") };
    assert_eq!(wanted.as_deref(), Some("no such card"));
    let adapters = block_on(list_adapters());
    assert_eq!(found.len(), adapters.len());
    // A part of a listed name finds that adapter.
    if let Some(adapter) = adapters.iter().find(|adapter| adapter.missing.is_empty()) {
        let name = adapter.name[..adapter.name.len() / 2].to_uppercase();
        let options = GpuOptions { adapter_name: Some(name), ..Default::default() };
        assert!(gpu_engine_with(options).is_some());
    }
}
