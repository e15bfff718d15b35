//! What the browser provides: a clock, its event loop, and whether it has WebGPU.
use js_sys::{Function, Promise, Reflect};
use std::{future::Future, pin::Pin};
use wasm_bindgen::{JsCast, prelude::*};
use wasm_bindgen_futures::JsFuture;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    fn performance_now() -> f64;
    #[wasm_bindgen(js_name = setTimeout)]
    fn set_timeout(callback: &Function, milliseconds: i32) -> JsValue;
}

/// Seconds since the worker started.
pub fn clock_s() -> f64 {
    performance_now() / 1000.0
}

/// Ready after the messages that already wait were handled. By a message, not by a timer: nested
/// timers take 4 ms each.
pub fn next_turn() -> Pin<Box<dyn Future<Output = ()>>> {
    Box::pin(async {
        let Ok(channel) = web_sys::MessageChannel::new() else { return sleep(0).await };
        let (here, there) = (channel.port1(), channel.port2());
        let turn = Promise::new(&mut |resolve, _| {
            here.set_onmessage(Some(&resolve));
            if there.post_message(&JsValue::NULL).is_err() {
                let _ = resolve.call0(&JsValue::NULL);
            }
        });
        // The promise is never rejected.
        let _ = JsFuture::from(turn).await;
        here.close();
    })
}

/// Ready after some time.
pub async fn sleep(milliseconds: i32) {
    let timer = Promise::new(&mut |resolve, _| drop(set_timeout(&resolve, milliseconds)));
    let _ = JsFuture::from(timer).await;
}

/// Whether this browser offers WebGPU here.
pub fn has_webgpu() -> bool {
    let get = |object: &JsValue, key: &str| Reflect::get(object, &key.into()).ok();
    get(&js_sys::global(), "navigator")
        .and_then(|navigator| get(&navigator, "gpu"))
        .is_some_and(|gpu| gpu.is_object())
}

/// Size of the module's memory \[bytes\].
pub fn wasm_bytes() -> f64 {
    let memory = wasm_bindgen::memory();
    let buffer = Reflect::get(&memory, &"buffer".into()).unwrap_or(JsValue::UNDEFINED);
    buffer.dyn_into::<js_sys::ArrayBuffer>().map_or(0.0, |b| f64::from(b.byte_length()))
}
