//! The members of a glTF document that geometry needs, as typed values.

use std::sync::Arc;

use ::gltf::json::Root;
use serde::Deserialize as _;
use serde_json::{Map, Value, json};

use super::GltfError;
use crate::shown::shown;

/// Names of compression extensions, which need a decoder. Both meshopt names denote the same stream format.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Members of the document that geometry does not need. They are not parsed, so that errors in them have no effect.
const OPTIONAL_MEMBERS: [&str; 8] =
    ["animations", "cameras", "extras", "images", "materials", "samplers", "textures", "extensions"];

/// Parses the members that geometry needs.
pub(super) fn typed(json: &Value) -> Result<Root, GltfError> {
    let Value::Object(object) = json else {
        return Err(GltfError::Json("the JSON is not an object".into()));
    };
    let is_geometry = |key: &str, value: &Value| !OPTIONAL_MEMBERS.contains(&key) && !value.is_null();
    let of_geometry = object.iter().filter(|(key, value)| is_geometry(key, value));
    let mut geometry: Map<String, Value> =
        of_geometry.map(|(key, value)| (key.clone(), strict(value))).collect();
    geometry.insert("asset".into(), json!({ "version": "2.0" }));
    // `nodes` of a scene is optional in glTF but required by the crate `gltf`.
    for scene in geometry.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| json!([]));
        }
    }
    let whole = Value::Object(geometry);
    Root::deserialize(&whole).map_err(|_| {
        let lists =
            whole.as_object().into_iter().flatten().filter_map(|(key, list)| Some((key, list.as_array()?)));
        let mut items =
            lists.flat_map(|(key, list)| list.iter().enumerate().map(move |(k, item)| (key, k, item)));
        let at = items.find(|(key, _, item)| {
            serde_json::from_value::<Root>(json!({ "asset": whole["asset"], *key: [item] })).is_err()
        });
        let place = at.map_or("the document".into(), |(key, k, _)| format!("item {k} of '{}'", shown(key)));
        GltfError::Json(format!("{place} has a missing value or a value of the wrong type"))
    })
}

/// Copy of a value that the crate `gltf` can parse: without `null` members, without names, which can be long, and
/// without `extensions` and `extras`, whose values can have any type.
fn strict(value: &Value) -> Value {
    let is_read =
        |key: &str, value: &Value| !matches!(key, "name" | "extras" | "extensions") && !value.is_null();
    match value {
        Value::Array(items) => items.iter().map(strict).collect(),
        Value::Object(object) => {
            let read = object.iter().filter(|(key, value)| is_read(key, value));
            Value::Object(read.map(|(key, value)| (key.clone(), strict(value))).collect())
        }
        value => value.clone(),
    }
}

/// Bytes of a buffer view; `None` if it extends beyond the buffer.
pub(super) fn view_bytes<'a>(root: &Root, buffers: &'a [Arc<Vec<u8>>], view: u64) -> Option<&'a [u8]> {
    let view = root.buffer_views.get(usize::try_from(view).ok()?)?;
    let start = usize::try_from(view.byte_offset.map_or(0, |o| o.0)).ok()?;
    let end = start.checked_add(usize::try_from(view.byte_length.0).ok()?)?;
    buffers.get(view.buffer.value())?.get(start..end)
}
