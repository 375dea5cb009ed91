//! Names of morph targets in the JSON of a mesh.

use serde_json::{Map, Value};

/// Names of the morph targets of a mesh: in its extras or, as UniVRM writes them, in the extras of its first primitive.
pub(super) fn target_names(mesh: &Value) -> &Value {
    let own = &mesh["extras"]["targetNames"];
    if own.is_array() { own } else { &mesh["primitives"][0]["extras"]["targetNames"] }
}

/// The lists of target names in the extras of the primitives of a mesh.
pub(super) fn name_lists_of_primitives(mesh: &mut Value) -> impl Iterator<Item = &mut Map<String, Value>> {
    let primitives = mesh.get_mut("primitives").and_then(Value::as_array_mut).into_iter().flatten();
    primitives
        .filter_map(|primitive| primitive.get_mut("extras")?.as_object_mut())
        .filter(|extras| extras.contains_key("targetNames"))
}
