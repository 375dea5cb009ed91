//! The browser's clock, and progress reports to JavaScript.

use std::cell::RefCell;
use std::ops::ControlFlow;

use cagework_core::{Progress, ProgressEvent};
use js_sys::Function;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::views::object;

#[wasm_bindgen]
extern "C" {
    /// Milliseconds since the page or worker started.
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    pub(crate) fn now_ms() -> f64;
}

thread_local! {
    /// The JavaScript callback. It is thread-local because [`Progress`] must be `Sync` and `Function` is not. One
    /// callback is enough: each worker runs one job at a time on one thread.
    static LISTENER: RefCell<Option<Function>> = const { RefCell::new(None) };
}

/// Reports progress to a JavaScript function; cancels the job when the function returns false.
pub(crate) struct Listener(());

impl Listener {
    pub(crate) fn new(function: Function) -> Self {
        LISTENER.set(Some(function));
        Self(())
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        LISTENER.set(None);
    }
}

impl Progress for Listener {
    fn report(&self, event: ProgressEvent) -> ControlFlow<()> {
        let Some(listener) = LISTENER.with_borrow(Clone::clone) else { return ControlFlow::Continue(()) };
        match listener.call1(&JsValue::NULL, &object(&event)) {
            Ok(answer) if answer == JsValue::FALSE => ControlFlow::Break(()),
            Ok(_) => ControlFlow::Continue(()),
            // The callback threw: cancel the job.
            Err(_) => ControlFlow::Break(()),
        }
    }

    fn now_ms(&self) -> f64 {
        now_ms()
    }
}
