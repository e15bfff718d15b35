//! `mte-slam convert`: a recording in another layout.
use crate::{
    args::{ColorChoice, ConvertArgs, TargetLayout},
    input,
    output::new_folder::NewFolder,
    screen::Screen,
};
use anyhow::{Context, Result};
use mte_slam_dataset::{ColorFormat, RecordingWriter, ReplicaWriter, SensWriter, TumWriter};
use mte_slam_types::sequence::Sequence;
use std::io::BufWriter;

/// Writes a recording in another layout.
pub fn run(args: &ConvertArgs, screen: Screen) -> Result<()> {
    let mut sequence = input::open(&args.dataset, &args.selection, screen)?;
    for text in sequence.warnings() {
        screen.note(&format!("note: {text}"));
    }
    let target = NewFolder::prepare(&args.out)?;
    let info = sequence.info().clone();
    let color = match args.color_format {
        ColorChoice::Jpg => ColorFormat::Jpeg,
        ColorChoice::Png => ColorFormat::Png,
    };
    let sink = |name: &str, bytes: &[u8]| target.write(name, bytes);
    match args.to {
        TargetLayout::Replica => {
            let mut writer = ReplicaWriter::new(&info, color, sink);
            copy(sequence.as_mut(), &mut writer, screen)?;
            writer.finish()?;
        }
        TargetLayout::Tum => {
            let mut writer = TumWriter::new(&info, color, sink);
            copy(sequence.as_mut(), &mut writer, screen)?;
            let too_deep = writer.too_deep();
            writer.finish()?;
            if too_deep > 0 {
                screen.note(&format!(
                    "note: {too_deep} pixels are deeper than the 13.1 m that the layout can say: \
                     written as holes"
                ));
            }
        }
        TargetLayout::Sens => {
            let file = format!("{}.sens", input::folder_name(&args.dataset));
            let stream = target.create(&file).with_context(|| format!("{file}: cannot be made"))?;
            let stream = BufWriter::new(stream);
            let mut writer = SensWriter::new(&info, color, &file, stream, sink);
            copy(sequence.as_mut(), &mut writer, screen)?;
            writer.finish()?;
        }
    }
    target.publish()?;
    let text = format!(
        "{} frames of {}x{} ({}) written to {}\n",
        info.frames,
        info.camera.width,
        info.camera.height,
        info.layout,
        args.out.display()
    );
    let json = serde_json::json!({
        "folder": args.out, "frames": info.frames, "from": info.layout,
    });
    screen.result(&text, &format!("{json:#}\n"));
    Ok(())
}

fn copy(
    sequence: &mut dyn Sequence,
    writer: &mut impl RecordingWriter,
    screen: Screen,
) -> Result<()> {
    let frames = sequence.info().frames;
    let mut progress = screen.progress("converting frames", frames);
    for index in 0..frames {
        writer.write(&sequence.frame(index)?)?;
        progress.set(index as u64 + 1, String::new);
    }
    progress.finish();
    Ok(())
}
