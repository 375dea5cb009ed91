//! Plain objects that JavaScript receives; border.rs generates their TypeScript declarations.

use cagework_editor::DocumentView;
use serde::Serialize;
use wasm_bindgen::JsValue;

/// Document and bind state that panels show.
#[derive(Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct View {
    #[serde(flatten)]
    pub(crate) document: DocumentView,
    /// Whether the models are bound to the current cage.
    pub(crate) bound: bool,
    /// Whether weights on a lattice around the cage are available.
    pub(crate) lattice: bool,
    /// Number of splats outside the cage; 0 before the lattice is available.
    pub(crate) floaters: usize,
}

/// Converts a value to a plain JavaScript object. `None` becomes null. A whole number of 2^53 or more, which JavaScript
/// cannot represent, makes the object undefined.
pub(crate) fn object(value: &impl Serialize) -> JsValue {
    value.serialize(&serde_wasm_bindgen::Serializer::json_compatible()).unwrap_or(JsValue::UNDEFINED)
}

/// Like [`object`], but `None` becomes undefined.
pub(crate) fn optional(value: Option<impl Serialize>) -> JsValue {
    value.map_or(JsValue::UNDEFINED, |value| object(&value))
}
