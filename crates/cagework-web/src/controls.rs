//! Cages with interior controls from JavaScript's arrays.

use cagework_core::ControlSet;
use cagework_editor::{CageControls, RestCage};
use wasm_bindgen::JsValue;

use crate::arrays::polygon_mesh;
use crate::error::Answer;
use crate::options::taken;

/// A cage from arrays: see [`CageControls`]. Undefined controls are none.
///
/// # Errors
/// When the arrays are no cage, or the controls do not fit into it.
pub(crate) fn control_set(positions: &[f32], corners: &[u32], controls: JsValue) -> Answer<ControlSet> {
    let mesh = polygon_mesh(positions, corners)?;
    Ok(RestCage::new(mesh, from_js(controls)?.unwrap_or_default())?.set?)
}

/// Controls from JavaScript; none for undefined.
pub(crate) fn from_js(controls: JsValue) -> Answer<Option<CageControls>> {
    if controls.is_undefined() { Ok(None) } else { taken(controls).map(Some) }
}
