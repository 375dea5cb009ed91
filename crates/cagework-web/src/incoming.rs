//! Copies weights from the worker's arrays into wasm memory in chunks, so that the page stays responsive.

use cagework_core::Weights;
use js_sys::{Float32Array, Promise, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::JsFuture;

use crate::error::Answer;

/// Number of weights that are copied and checked per turn of the event loop. A chunk takes a few milliseconds.
const CHUNK: u32 = 1 << 18;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_name = setTimeout)]
    fn set_timeout(then: &js_sys::Function, ms: u32);
}

/// Yields to the event loop, so that it handles pending events and frames.
pub(crate) async fn page_turn() {
    let promise = Promise::new(&mut |resolve, _| set_timeout(&resolve, 0));
    // `setTimeout` never rejects the promise.
    let _: Result<JsValue, JsValue> = JsFuture::from(promise).await;
}

/// Checked weights from the arrays of a `Bound`.
pub(crate) async fn weights(
    n_columns: u32,
    indptr: &[u32],
    indices: &Uint32Array,
    data: &Float32Array,
) -> Answer<Weights> {
    let n = indices.length().min(data.length());
    let mut weights = Weights::with_room(n_columns, indptr.len(), n as usize);
    let mut rows = indptr;
    while let [start, rest @ ..] = rows
        && !rest.is_empty()
    {
        let count = rest.partition_point(|&end| end <= start.saturating_add(CHUNK)).max(1);
        let (ends, end) = (&rest[..count], rest[count - 1]);
        let pointers = std::iter::once(0).chain(ends.iter().map(|&e| e.wrapping_sub(*start))).collect();
        let (indices, data) = (indices.subarray(*start, end).to_vec(), data.subarray(*start, end).to_vec());
        weights.append(&Weights::new(n_columns, pointers, indices, data)?);
        rows = &rows[count..];
        if rows.len() > 1 {
            page_turn().await;
        }
    }
    Ok(weights)
}
