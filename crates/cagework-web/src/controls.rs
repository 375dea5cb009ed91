//! Conversion of cages with interior controls from JavaScript arrays.

use cagework_core::ControlSet;
use cagework_editor::{CageControls, RestCage};
use wasm_bindgen::JsValue;

use crate::arrays::polygon_mesh;
use crate::error::Answer;
use crate::options::decode;

/// Builds a cage and its interior controls from arrays; see [`CageControls`]. `controls` may be undefined.
///
/// # Errors
/// If the arrays are not a valid cage, or a control does not fit into the cage.
pub(crate) fn control_set(positions: &[f32], corners: &[u32], controls: JsValue) -> Answer<ControlSet> {
    let mesh = polygon_mesh(positions, corners)?;
    Ok(RestCage::new(mesh, from_js(controls)?.unwrap_or_default())?.set?)
}

/// Reads subdivision and interior controls from a JavaScript value; `None` if it is undefined.
pub(crate) fn from_js(controls: JsValue) -> Answer<Option<CageControls>> {
    if controls.is_undefined() { Ok(None) } else { decode(controls).map(Some) }
}
