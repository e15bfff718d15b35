//! Browser bindings of MTE-SLAM: a [`Session`] takes commands and emits events, both plain
//! objects that can be posted between threads. It belongs into a dedicated worker.
//!
//! Sources are read synchronously (a worker may do that), so the same readers serve the browser and
//! the command line; the optimisation is cut into slices, between which the worker's own messages
//! are handled.
#![forbid(unsafe_code)]

mod events;
mod export;
mod failure;
mod feed;
pub mod message;
mod open;
mod pack;
pub mod picture;
mod platform;
mod run;
mod saved;
mod session;
pub mod settings;
pub mod source;

pub use session::Session;

use wasm_bindgen::prelude::*;

/// Version of this package.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// Names of the presets.
#[wasm_bindgen(unchecked_return_type = "Preset[]")]
pub fn presets() -> Vec<String> {
    mte_slam_core::config::Config::PRESETS.map(Into::into).into()
}

/// The configuration that settings give, for pages that show what can be changed.
///
/// # Errors
/// As a text: the setting that cannot be used.
#[wasm_bindgen(js_name = configuration, unchecked_return_type = "Record<string, unknown>")]
pub fn configuration(
    #[wasm_bindgen(unchecked_param_type = "Settings")] settings: JsValue,
) -> Result<JsValue, JsValue> {
    let settings: settings::Settings = serde_wasm_bindgen::from_value(settings)?;
    let config = settings.config().map_err(|e| JsValue::from(e.0))?;
    let serializer = serde_wasm_bindgen::Serializer::json_compatible();
    Ok(serde::Serialize::serialize(&config, &serializer)?)
}

/// Panics become readable messages in the console.
#[wasm_bindgen(start)]
pub fn start() {
    console_error_panic_hook::set_once();
}
