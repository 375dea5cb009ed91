//! Results of the worker, read by JavaScript one array at a time.

use cagework_core::Weights;
use cagework_core::report::BindReport;
use js_sys::{Array, Float32Array, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::views::{object, optional};
use crate::weights::{BoundArrays, Offsets};

/// Weights as compressed sparse rows, and the frames that the columns after the controls refer to.
#[wasm_bindgen]
pub struct BindResult {
    pub(super) weights: Weights,
    pub(super) offsets: Offsets,
    pub(super) report: Option<BindReport>,
}

#[wasm_bindgen]
impl BindResult {
    /// Row pointers of the sparse rows. `[n_vertices + 1]`
    #[wasm_bindgen(getter)]
    pub fn indptr(&self) -> Vec<u32> {
        self.weights.indptr().to_vec()
    }

    /// Number of non-zero weights.
    #[wasm_bindgen(getter)]
    pub fn count(&self) -> usize {
        self.weights.data().len()
    }

    /// Column indices and values of the non-zero weights `start` to `end - 1`, so that the page can read them in parts.
    #[wasm_bindgen(unchecked_return_type = "[Uint32Array, Float32Array]")]
    pub fn rows(&self, start: usize, end: usize) -> JsValue {
        let (indices, data) = (self.weights.indices().get(start..end), self.weights.data().get(start..end));
        let indices = Uint32Array::from(indices.unwrap_or_default());
        Array::of2(&indices, &Float32Array::from(data.unwrap_or_default())).into()
    }

    /// Copies all arrays of the weights, and frees this object.
    #[wasm_bindgen(js_name = intoArrays, unchecked_return_type = "BoundArrays")]
    pub fn into_arrays(self) -> JsValue {
        object(&BoundArrays::of(&self.weights, self.offsets))
    }

    /// Local coordinate frames that carry the part of each position that the weights of the controls do not reproduce,
    /// and the points outside the cage. In the weights, the columns of the frames follow the columns of the controls.
    #[wasm_bindgen(getter, unchecked_return_type = "Offsets")]
    pub fn offsets(&self) -> JsValue {
        object(&self.offsets)
    }

    /// Report of the bind; undefined for closed-form coordinates, slices and lattices.
    #[wasm_bindgen(getter, unchecked_return_type = "BindReport | undefined")]
    pub fn report(&self) -> JsValue {
        optional(self.report.as_ref())
    }
}
