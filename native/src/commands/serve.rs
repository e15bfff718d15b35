//! `mte-slam serve`.
use crate::{
    args::ServeArgs,
    input,
    screen::Screen,
    server::{Listening, Page, Service},
};
use anyhow::Result;
use mte_slam_dataset::stream::StreamInfo;

/// Serves the page and a recording until the process ends.
pub fn run(args: &ServeArgs, screen: Screen) -> Result<()> {
    let sequence = input::open(&args.dataset, &args.selection, screen)?;
    let info = sequence.info().clone();
    let description = StreamInfo::of(sequence.as_ref()).to_json()?;
    drop(sequence);
    let page = Page::find(args.page.as_deref());
    if !page.found() {
        screen.note(
            "note: no built page found; ./scripts/build-web.sh makes one. The frames are served.",
        );
    }
    let listening = Listening::bind(args.address, args.port)?;
    let url = format!("http://{}/", listening.address);
    if !listening.address.ip().is_loopback() {
        screen.note(&format!(
            "note: everyone who reaches {} can read this recording",
            listening.address
        ));
    }
    let (dataset, selection) = (args.dataset.clone(), args.selection.clone());
    let quiet = Screen { quiet: true, ..screen };
    let service = Service {
        page,
        info: description,
        frames: info.frames,
        open: Box::new(move || input::open(&dataset, &selection, quiet)),
    };
    screen.result(
        &format!(
            "{}: {} frames of {}x{}, {} classes, at {url} (Ctrl-C ends)\n",
            info.name,
            info.frames,
            info.camera.width,
            info.camera.height,
            info.classes.len()
        ),
        &format!("{}\n", serde_json::json!({ "url": url, "frames": info.frames })),
    );
    listening.run(service)
}
