//! Segments raw images, for comparison with other runtimes: `segment_images MODEL WIDTH HEIGHT THREADS FILE...`, where
//! a file holds width x height pixels of three bytes, writes FILE.labels (a byte per pixel) and says how
//! long each took.
use mte_slam_segment::{MAX_MODEL_BYTES, ModelFiles, Segmenter, SegmenterOptions};
use std::{error::Error, fs, path::Path, time::Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, width, height, threads, files @ ..] = arguments.as_slice() else {
        return Err("expected MODEL WIDTH HEIGHT THREADS FILE...".into());
    };
    let (width, height): (usize, usize) = (width.parse()?, height.parse()?);
    let files_of_model = ModelFiles::open(Path::new(model), MAX_MODEL_BYTES)?;
    let options = SegmenterOptions { threads: Some(threads.parse()?), ..Default::default() };
    let mut segmenter = Segmenter::load(files_of_model, &options)?;
    println!("{}", segmenter.summary());
    for warning in segmenter.warnings() {
        println!("note: {warning}");
    }
    for file in files {
        let bytes = fs::read(file)?;
        let image: Vec<[u8; 3]> = bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        let begun = Instant::now();
        let found = segmenter.segment(&image, width, height)?;
        println!("{file}: {:.1} ms", begun.elapsed().as_secs_f64() * 1000.0);
        fs::write(format!("{file}.labels"), &found.labels)?;
    }
    Ok(())
}
