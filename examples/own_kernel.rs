//! A kernel of one's own, declared outside of the crates: a shader, its twin in Rust, and one
//! declaration that both and every call share. It runs on the processor, and with the feature `gpu`
//! on a graphics adapter too; the results must agree to a few units of the last place.
//! A program that declares kernels depends on `bytemuck` (with its feature `derive`), too.
//!
//! ```text
//! cargo run --release -p mte-slam-examples --example own_kernel
//! ```
use mte_slam_core::{
    call::Call,
    commands::{Buffer, Commands},
    engine::{Engine, EngineError},
};
use pollster::block_on;

/// Depths of an image as points of the camera frame.
mod back_project {
    use mte_slam_core::{
        kernel,
        kernel::{CpuDispatch, store_f32},
        shaders::{interface, shared_struct},
    };

    shared_struct! {
        /// Parameters of `back_project`.
        pub struct BackProjectParams {
            /// Image width \[pixels\].
            width: u32,
            /// Number of pixels.
            pixels: u32,
            /// Focal length \[pixels\].
            focal: f32,
            /// Metres per unit of the depth image.
            depth_unit: f32,
        }
    }

    interface! {
        /// Back-projects the pixels of a depth image whose principal point is (0, 0).
        pub back_project {
            wgsl: "
                #import shared/dispatch.wgsl
                #bindings

                @compute @workgroup_size(WORKGROUP_SIZE)
                fn main(
                    @builtin(workgroup_id) workgroup: vec3<u32>,
                    @builtin(num_workgroups) workgroups: vec3<u32>,
                    @builtin(local_invocation_index) local: u32,
                ) {
                    let pixel = linear_invocation(workgroup, workgroups, local);
                    if (pixel >= params.pixels) {
                        return;
                    }
                    let z = f32(depths[pixel]) * params.depth_unit;
                    let u = f32(pixel % params.width);
                    let v = f32(pixel / params.width);
                    points[pixel] = vec4f(u / params.focal * z, v / params.focal * z, z, 1.0);
                }",
            workgroup_size: 64,
            params: BackProjectParams,
            bindings: {
                /// Depth of each pixel.
                depths: Read<u32>,
                /// Point of each pixel \[m\], and 1.
                points: ReadWrite<[f32; 4]>,
            }
        }
    }

    kernel! { pub static BACK_PROJECT = self, twin }

    fn twin(dispatch: &CpuDispatch<'_>) {
        let p: BackProjectParams = dispatch.params();
        let Views { depths, points } = dispatch.views();
        dispatch.for_each_invocation(|pixel| {
            if pixel >= p.pixels as usize {
                return;
            }
            let z = depths[pixel] as f32 * p.depth_unit;
            let (u, v) = (pixel as u32 % p.width, pixel as u32 / p.width);
            let point = [u as f32 / p.focal * z, v as f32 / p.focal * z, z, 1.0];
            for (cell, x) in points[pixel * 4..].iter().zip(point) {
                store_f32(cell, x);
            }
        });
    }
}

/// Points of a small depth image, by one engine.
fn points(engine: &mut Engine) -> Result<Vec<[f32; 4]>, EngineError> {
    let (width, pixels) = (20_u32, 300_u32);
    let image: Vec<u32> = (0..pixels).map(|pixel| 1000 + 7 * (pixel % 53)).collect();
    let depths: Buffer<u32> = engine.create("depths", pixels as usize)?;
    let points: Buffer<[f32; 4]> = engine.create("points", 4 * pixels as usize)?;
    let params = back_project::BackProjectParams { width, pixels, focal: 16.0, depth_unit: 0.001 };
    let mut commands = Commands::new();
    commands.upload(depths, 0, &image);
    // Buffers by name: `depths: points` would not compile.
    back_project::Buffers { depths, points }.record(&mut commands, &params, pixels as usize);
    engine.submit(&commands)?;
    block_on(engine.read_as(points, 0, pixels as usize))
}

/// Runs the kernel on the processor, and on a graphics adapter where there is one.
pub fn own_kernel() -> Result<(), EngineError> {
    let expected = points(&mut Engine::cpu())?;
    println!("last point on the processor: {:?}", expected[expected.len() - 1]);
    #[cfg(feature = "gpu")]
    match block_on(Engine::gpu(Default::default())) {
        Ok(mut engine) => {
            let found = points(&mut engine)?;
            for (a, b) in expected.iter().zip(&found) {
                // WGSL grants a division 2.5 units of the last place.
                assert!(
                    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * a.abs()),
                    "{a:?} {b:?}"
                );
            }
            println!("the same on {}", engine.info().adapter);
        }
        Err(error) => println!("no graphics adapter to compare with: {error}"),
    }
    Ok(())
}

#[allow(dead_code, reason = "the tests call what it calls")]
fn main() -> Result<(), EngineError> {
    own_kernel()
}
