//! Contact sheets of the built-in sequence: `synth_sheet OUT.png [room|office] [seed] [frames]
//! [noise]` writes colour, depth and classes of frames spread over the sequence.
use image::{Rgb, RgbImage};
use mte_slam_core::{
    sequence::Sequence,
    synth::{SceneKind, SyntheticOptions, SyntheticSequence},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let out = args.get(1).map_or("synth.png", String::as_str);
    let arg = |i: usize| args.get(i).and_then(|a| a.parse().ok());
    let options = SyntheticOptions {
        scene: if args.get(2).is_some_and(|a| a == "office") {
            SceneKind::Office
        } else {
            SceneKind::Room
        },
        seed: arg(3).unwrap_or(0),
        frames: arg(4).unwrap_or(240) as usize,
        depth_noise: args.get(5).is_some_and(|a| a == "noise"),
        ..SyntheticOptions::default()
    };
    let start = std::time::Instant::now();
    let mut sequence = SyntheticSequence::new(options);
    println!("built in {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    let info = sequence.info().clone();
    let (w, h) = (info.camera.width, info.camera.height);
    let shown = 12.min(info.frames as u32);
    let mut sheet = RgbImage::new(w * 6, h * 6);
    let start = std::time::Instant::now();
    for k in 0..shown {
        let frame = sequence.frame(k as usize * info.frames / shown as usize)?;
        let (x0, y0) = (k % 6 * w, k / 6 * 3 * h);
        for v in 0..h {
            for u in 0..w {
                let i = (v * w + u) as usize;
                let z = f64::from(frame.depth[i]) * info.depth_unit_m;
                let g = if z > 0.0 { (40.0 + 215.0 * (1.0 - z / 5.5).max(0.0)) as u8 } else { 0 };
                let class = frame
                    .labels
                    .as_ref()
                    .map_or([0; 3], |l| info.classes.classes[l[i] as usize].color);
                sheet.put_pixel(x0 + u, y0 + v, Rgb(frame.color[i]));
                sheet.put_pixel(x0 + u, y0 + h + v, Rgb([g; 3]));
                sheet.put_pixel(x0 + u, y0 + 2 * h + v, Rgb(class));
            }
        }
    }
    println!("{:.1} ms a frame", start.elapsed().as_secs_f64() * 1e3 / f64::from(shown));
    sheet.save(out)?;
    Ok(())
}
