//! Maps the built-in room and writes its mesh.
//!
//! ```text
//! cargo run --release -p mte-slam-examples --example map_a_room [room.glb]
//! ```
use mte_slam_core::{config::Config, engine::Engine};
use mte_slam_run::Run;
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::sequence::Sequence;
use std::error::Error;

/// Maps the room; returns the mesh as the bytes of a GLB file.
pub fn map_a_room() -> Result<Vec<u8>, Box<dyn Error>> {
    pollster::block_on(async {
        let mut room = SyntheticSequence::new(SyntheticOptions::tiny());
        let config = Config::preset("tiny").unwrap_or_default();
        let mut run = Run::new(Engine::cpu(), config, room.info()).await?;
        run.to_end(&mut room, &mut ()).await?;
        let mesh = run.slam_mut().extract_mesh(0.05, &mut |_| ()).await?;
        Ok(mte_slam_mesh::write_glb(&mesh)?)
    })
}

#[allow(dead_code, reason = "the tests call what it calls")]
fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "room.glb".into());
    std::fs::write(&path, map_a_room()?)?;
    println!("{path} opens in any 3D viewer");
    Ok(())
}
