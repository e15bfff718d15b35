//! The way out: events to the function that the page gave, and the page as the host of a run.
use crate::{
    message::*,
    picture,
    platform::{clock_s, next_turn},
};
use js_sys::Function;
use mte_slam_run::{Host, Turn};
use serde::Serialize;
use wasm_bindgen::JsValue;

/// Optimisations with fewer iterations pass without progress.
const PROGRESS_FROM: u32 = 30;

/// The program around a session.
#[derive(Clone)]
pub struct Page {
    listener: Function,
}

impl Page {
    /// A page whose function `listener` is called with every event.
    pub fn new(listener: Function) -> Page {
        Page { listener }
    }

    pub fn emit(&self, event: &Event) {
        let serializer = serde_wasm_bindgen::Serializer::new()
            .serialize_maps_as_objects(true)
            .serialize_missing_as_null(true);
        if let Ok(value) = event.serialize(&serializer) {
            let _ = self.listener.call1(&JsValue::NULL, &value);
        }
    }

    pub fn progress(&self, stage: &str, done: f64, total: f64) {
        self.emit(&Event::Progress(ProgressEvent { stage: stage.into(), done, total }));
    }

    pub fn warn(&self, message: String) {
        self.emit(&Event::Warning(WarningEvent { message }));
    }
}

impl Host for Page {
    fn now_s(&self) -> f64 {
        clock_s()
    }

    fn has_event_loop(&self) -> bool {
        true
    }

    fn turn(&mut self) -> Turn<'_> {
        next_turn()
    }

    fn event(&mut self, event: mte_slam_run::Event<'_>) {
        use mte_slam_run::Event as E;
        match event {
            E::Frame { frame, info } => {
                let [color, depth, classes] =
                    picture::of_frame(frame, info.depth_unit_m, &info.classes);
                let (index, width, height) = (frame.index, info.camera.width, info.camera.height);
                let picture = PictureEvent { index, width, height, color, depth, classes };
                self.emit(&Event::Frame(picture));
            }
            E::Optimised { done, total } if total >= PROGRESS_FROM => {
                self.progress("optimising the map", done.into(), total.into());
            }
            E::ReadingAgain { done, total } => {
                self.progress("reading keyframes again", done as f64, total as f64);
            }
            E::Notice(text) => self.warn(text.into()),
            _ => {}
        }
    }
}
