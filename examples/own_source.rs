//! Reads a recording whose files are neither in a folder nor in an archive: any type that gives
//! bytes by name is a source, and every reader works on it.
//!
//! ```text
//! cargo run --release -p mte-slam-examples --example own_source
//! ```
use mte_slam_dataset::{ColorFormat, OpenOptions, RecordingWriter, ReplicaWriter, open};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::sequence::{Sequence, SequenceError, Source};
use std::{collections::HashMap, error::Error};

/// Files in a table, for example rows of a database. Names use `/`.
#[derive(Default)]
pub struct Table {
    rows: HashMap<String, Vec<u8>>,
}

impl Source for Table {
    fn name(&self) -> &str {
        "table"
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        Ok(self.rows.keys().cloned().collect())
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        let missing = || SequenceError::Read { file: file.into(), reason: "no such row".into() };
        self.rows.get(file).cloned().ok_or_else(missing)
    }
}

/// A table that holds the first frames of the built-in room in Replica's layout.
pub fn recorded(frames: usize) -> Result<Table, Box<dyn Error>> {
    let mut room = SyntheticSequence::new(SyntheticOptions { frames, ..SyntheticOptions::tiny() });
    let mut table = Table::default();
    let sink = |file: &str, bytes: &[u8]| {
        table.rows.insert(file.into(), bytes.into());
        Ok(())
    };
    let mut writer = ReplicaWriter::new(room.info(), ColorFormat::Png, sink);
    for index in 0..frames {
        writer.write(&room.frame(index)?)?;
    }
    writer.finish()?;
    Ok(table)
}

#[allow(dead_code, reason = "the tests call what it calls")]
fn main() -> Result<(), Box<dyn Error>> {
    let mut sequence = open(Box::new(recorded(3)?), OpenOptions::default())?;
    let info = sequence.info().clone();
    println!(
        "{}: {} frames of {}x{}",
        info.layout, info.frames, info.camera.width, info.camera.height
    );
    for index in 0..info.frames {
        let frame = sequence.frame(index)?;
        let measured = frame.depth.iter().filter(|d| **d > 0).count();
        println!("frame {index}: depth at {measured} of {} pixels", info.camera.pixels());
    }
    Ok(())
}
