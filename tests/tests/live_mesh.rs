//! The mesh that follows a growing map, chunk by chunk, against the mesh of the whole.
use mte_slam_core::{
    config::Config,
    engine::Engine,
    slam::{LiveMesh, MeshChunk, Slam},
};
use mte_slam_mesh::Mesh;
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::sequence::Sequence;
use pollster::block_on;
use std::collections::BTreeMap;

const RESOLUTION_M: f64 = 0.08;

fn small_config() -> Config {
    let mut config = Config::default();
    config.mapping.every = 2;
    config.mapping.rays = 400;
    config.mapping.first_iterations = 60;
    config.mapping.iterations = 4;
    config.mapping.final_iterations = 4;
    config.sampling.stratified = 16;
    config.tracking.align_pixels = 512;
    config.mesh.min_component_triangles = 1;
    config
}

#[test]
fn chunks_make_up_the_mesh_of_the_whole() {
    let options = SyntheticOptions { width: 64, height: 48, frames: 5, ..SyntheticOptions::tiny() };
    let mut sequence = SyntheticSequence::new(options);
    let info = sequence.info().clone();
    let mut slam = block_on(Slam::new(Engine::cpu(), small_config(), &info)).unwrap();
    let mut live = LiveMesh::new(RESOLUTION_M);
    assert!(block_on(slam.update_live_mesh(&mut live, 10)).is_err(), "there is no map yet");
    let mut shown: BTreeMap<[i32; 3], Mesh> = BTreeMap::new();
    let update = |slam: &mut Slam, live: &mut LiveMesh, shown: &mut BTreeMap<_, _>| {
        let chunks = block_on(slam.update_live_mesh(live, 20)).unwrap();
        assert!(chunks.len() <= 20);
        for MeshChunk { key, mesh } in chunks {
            mesh.check().unwrap();
            if mesh.triangles.is_empty() {
                shown.remove(&key);
            } else {
                shown.insert(key, mesh);
            }
        }
    };
    for index in 0..info.frames {
        slam_frame(&mut slam, &mut sequence, index);
        update(&mut slam, &mut live, &mut shown);
    }
    assert!(!shown.is_empty(), "nothing is shown while the map grows");
    block_on(slam.finish()).unwrap();
    live.touch_all();
    loop {
        update(&mut slam, &mut live, &mut shown);
        if live.pending() == 0 {
            break;
        }
    }
    assert!(block_on(slam.update_live_mesh(&mut live, 20)).unwrap().is_empty(), "nothing changed");
    let total: usize = shown.values().map(|m| m.triangles.len()).sum();
    assert_eq!(total, live.triangles());

    let chunk_m = RESOLUTION_M * 16.0;
    for (key, mesh) in &shown {
        assert!(
            mesh.colors.len() == mesh.positions.len() && mesh.classes.len() == mesh.colors.len()
        );
        for p in &mesh.positions {
            for k in 0..3 {
                let at = f64::from(p[k]) / chunk_m - f64::from(key[k]);
                assert!((-1e-5..=1.0 + 1e-5).contains(&at), "{p:?} outside of chunk {key:?}");
            }
        }
    }
    // The grids differ (one starts at the bounds' corner, the other at the origin), the surface
    // does not.
    let whole = block_on(slam.extract_mesh(RESOLUTION_M, &mut |_| {})).unwrap();
    let area: f64 = shown.values().map(Mesh::area).sum();
    let ratio = area / whole.area();
    assert!((0.85..1.15).contains(&ratio), "{area} m2 live, {} m2 whole", whole.area());
}

fn slam_frame(slam: &mut Slam, sequence: &mut SyntheticSequence, index: usize) {
    block_on(slam.process(&sequence.frame(index).unwrap())).unwrap();
}
