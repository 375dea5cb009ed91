//! Copies weights from the worker into wasm memory in chunks, so that the page stays responsive and JavaScript never
//! holds all of them.

use cagework_core::Weights;
use js_sys::{Array, Float32Array, Function, Promise, Uint32Array};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast as _, JsValue};
use wasm_bindgen_futures::JsFuture;

use crate::error::{Answer, ErrorName, Fault};

/// Number of weights that are copied and checked per turn of the event loop. A chunk takes a few milliseconds.
const CHUNK: u32 = 1 << 18;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_name = setTimeout)]
    fn set_timeout(then: &Function, ms: u32);
}

/// Yields to the event loop, so that it handles pending events and frames.
pub(crate) async fn page_turn() {
    let promise = Promise::new(&mut |resolve, _| set_timeout(&resolve, 0));
    // `setTimeout` never rejects the promise.
    let _: Result<JsValue, JsValue> = JsFuture::from(promise).await;
}

/// Fetches the weights of a `BindResult` in chunks and checks them. `rows(start, end)` returns, or promises, the column
/// indices and values of the weights `start` to `end - 1`, counted over all rows.
pub(crate) async fn weights(n_columns: u32, indptr: &[u32], rows: &Function) -> Result<Weights, JsValue> {
    let n = indptr.last().copied().unwrap_or(0);
    let mut weights = Weights::with_room(n_columns, indptr.len(), n as usize);
    let source = rows;
    let mut rows = indptr;
    while let [start, rest @ ..] = rows
        && !rest.is_empty()
    {
        let count = rest.partition_point(|&end| end <= start.saturating_add(CHUNK)).max(1);
        let (ends, end) = (&rest[..count], rest[count - 1]);
        let pointers = std::iter::once(0).chain(ends.iter().map(|&e| e.wrapping_sub(*start))).collect();
        let promised = source.call2(&JsValue::NULL, &(*start).into(), &end.into())?;
        let (indices, data) = arrays(&JsFuture::from(Promise::resolve(&promised)).await?)?;
        weights.append(&Weights::new(n_columns, pointers, indices, data).map_err(Fault::from)?);
        rows = &rows[count..];
        if rows.len() > 1 {
            page_turn().await;
        }
    }
    Ok(weights)
}

fn arrays(pair: &JsValue) -> Answer<(Vec<u32>, Vec<f32>)> {
    let pair = pair.unchecked_ref::<Array>();
    let indices = pair.get(0).dyn_into::<Uint32Array>().ok();
    let data = pair.get(1).dyn_into::<Float32Array>().ok();
    let fault = || Fault::new(ErrorName::Error, "weights must be a Uint32Array and a Float32Array");
    indices.zip(data).map(|(indices, data)| (indices.to_vec(), data.to_vec())).ok_or_else(fault)
}
