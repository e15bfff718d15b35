//! The way out: events to the host's function.
use crate::{message::*, platform::next_turn};
use js_sys::Function;
use serde::Serialize;
use std::{cell::RefCell, future::Future, pin::Pin};
use wasm_bindgen::JsValue;

/// Optimisations with fewer iterations pass without progress.
const PROGRESS_FROM: u32 = 30;

thread_local! {
    // The core's hook between slices is a plain function, so the way out is kept here.
    static EMIT: RefCell<Option<Function>> = const { RefCell::new(None) };
}

pub fn emit(event: &Event) {
    let serializer = serde_wasm_bindgen::Serializer::new()
        .serialize_maps_as_objects(true)
        .serialize_missing_as_null(true);
    let function = EMIT.with(|f| f.borrow().clone());
    if let (Some(function), Ok(value)) = (function, event.serialize(&serializer)) {
        let _ = function.call1(&JsValue::NULL, &value);
    }
}

pub fn progress(stage: &str, done: f64, total: f64) {
    emit(&Event::Progress(ProgressEvent { stage: stage.into(), done, total }));
}

pub fn warn(message: String) {
    emit(&Event::Warning(WarningEvent { message }));
}

/// From now on `function` hears the events.
pub fn listen(function: Function) {
    EMIT.with(|f| *f.borrow_mut() = Some(function));
}

/// Between slices: progress of the long ones, then whatever waits in the event loop.
pub fn breathe(done: u32, total: u32) -> Pin<Box<dyn Future<Output = ()>>> {
    if total >= PROGRESS_FROM {
        progress("optimising the map", done.into(), total.into());
    }
    next_turn()
}
