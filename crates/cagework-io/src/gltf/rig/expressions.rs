//! Expressions of VRM 0 and VRM 1: reads their names, and adds poses as expressions.

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::{Value, json};

use crate::error::WriteError;
use crate::gltf::GltfDocument;
use crate::gltf::pack::push;
use crate::shown::shown;

/// Names of the presets of VRM 1 (VRMC_vrm-1.0, "Expressions") and of VRM 0 (`presetName`).
const PRESETS_1: [&str; 18] = [
    "happy",
    "angry",
    "sad",
    "relaxed",
    "surprised",
    "aa",
    "ih",
    "ou",
    "ee",
    "oh",
    "blink",
    "blinkLeft",
    "blinkRight",
    "lookUp",
    "lookDown",
    "lookLeft",
    "lookRight",
    "neutral",
];
const PRESETS_0: [&str; 17] = [
    "neutral",
    "a",
    "i",
    "u",
    "e",
    "o",
    "blink",
    "joy",
    "angry",
    "sorrow",
    "fun",
    "lookup",
    "lookdown",
    "lookleft",
    "lookright",
    "blink_l",
    "blink_r",
];

/// Counts and names of the VRM data in a glTF.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Vrm {
    /// Version of the specification, such as "0.0" or "1.0".
    pub version: String,
    /// Names of the expressions: presets, then custom ones.
    pub expressions: Vec<String>,
    /// Number of chains of spring bones; in VRM 0, of groups of chains.
    pub springs: usize,
    /// Number of colliders of the spring bones.
    pub colliders: usize,
}

/// The morph target of one mesh that stores a pose.
pub(super) struct PoseTarget {
    pub(super) node: usize,
    pub(super) mesh: usize,
    /// Index of the target in the mesh.
    pub(super) target: usize,
}

/// Reads the VRM data of a document: VRM 1 if the document contains both versions.
pub(crate) fn vrm(document: &GltfDocument) -> Option<Vrm> {
    let extensions = &document.json["extensions"];
    let count = |list: &Value| list.as_array().map_or(0, Vec::len);
    let version = |of: &Value, default: &str| of["specVersion"].as_str().unwrap_or(default).to_owned();
    let expressions = names(&document.json);
    let (of_1, of_0) = (&extensions["VRMC_vrm"], &extensions["VRM"]);
    if of_1.is_object() {
        let springs = &extensions["VRMC_springBone"];
        return Some(Vrm {
            version: version(of_1, "1.0"),
            expressions,
            springs: count(&springs["springs"]),
            colliders: count(&springs["colliders"]),
        });
    }
    let springs = &of_0["secondaryAnimation"];
    let groups = springs["colliderGroups"].as_array().into_iter().flatten();
    of_0.is_object().then(|| Vrm {
        version: version(of_0, "0.0"),
        expressions,
        springs: count(&springs["boneGroups"]),
        colliders: groups.map(|group| count(&group["colliders"])).sum(),
    })
}

fn names(json: &Value) -> Vec<String> {
    let of_1 = &json["extensions"]["VRMC_vrm"]["expressions"];
    let of_1 = ["preset", "custom"].into_iter().filter_map(|kind| of_1[kind].as_object());
    let of_1: Vec<String> = of_1.flat_map(|all| all.keys().cloned()).collect();
    if !of_1.is_empty() {
        return of_1;
    }
    groups(json).filter_map(|group| Some(group["name"].as_str()?.to_owned())).collect()
}

/// Expressions of VRM 0.
fn groups(json: &Value) -> impl Iterator<Item = &Value> {
    let groups = &json["extensions"]["VRM"]["blendShapeMaster"]["blendShapeGroups"];
    groups.as_array().into_iter().flatten()
}

/// Adds an expression for each pose. If the document has an expression with this name that does nothing, as exporters
/// write for presets that are not used, it is filled instead.
///
/// # Errors
/// If the document is not a VRM, or has an expression with this name that does something.
pub(super) fn add(json: &mut Value, poses: &[(&str, Vec<PoseTarget>)]) -> Result<(), WriteError> {
    let is_1 = json.pointer("/extensions/VRMC_vrm").is_some_and(Value::is_object);
    if !is_1 && !json.pointer("/extensions/VRM").is_some_and(Value::is_object) {
        return Err(WriteError::Document("the file has no VRM data, which expressions need".into()));
    }
    // Applications find a preset of VRM 0 by `presetName`, which is compared without case.
    let preset_0 = |name: &str| Some(name.to_lowercase()).filter(|small| PRESETS_0.contains(&small.as_str()));
    let key = |name: &str| preset_0(name).filter(|_| !is_1).unwrap_or_else(|| name.to_owned());
    let mut known: BTreeSet<String> = names(json).iter().map(|name| key(name)).collect();
    if !is_1 {
        known.extend(groups(json).filter_map(|group| preset_0(group["presetName"].as_str()?)));
    }
    for (name, targets) in poses {
        let is_new = known.insert(key(name));
        let of_group = |group: &Value| {
            let preset = group["presetName"].as_str().and_then(preset_0);
            group["name"].as_str().map(key).as_ref() == Some(&key(name)) || preset == Some(key(name))
        };
        let existing = if is_1 { expressions_1(json, name) } else { groups_0(json, of_group) };
        let is_free = !existing.is_empty() && existing.iter().all(|expression| is_idle(expression));
        if !is_new && !is_free {
            return Err(WriteError::Document(format!(
                "the file has an expression '{}' already: give the pose another name",
                shown(name)
            )));
        }
        let (list, binds) = binds(targets, is_1);
        if let Some(existing) = existing.into_iter().next() {
            existing[list] = binds;
        } else if is_1 {
            let kind = if PRESETS_1.contains(name) { "preset" } else { "custom" };
            let of_kind = object(object(&mut json["extensions"]["VRMC_vrm"], "expressions"), kind);
            of_kind[*name] = json!({ "isBinary": false, list: binds });
        } else {
            let preset = preset_0(name).unwrap_or_else(|| "unknown".into());
            let group = json!({
                "name": name, "presetName": preset, list: binds, "materialValues": [], "isBinary": false,
            });
            push(object(&mut json["extensions"]["VRM"], "blendShapeMaster"), "blendShapeGroups", group);
        }
    }
    Ok(())
}

/// The list of morph targets of an expression: its name in VRM 1 or 0, and the targets of a pose at full weight.
fn binds(targets: &[PoseTarget], is_1: bool) -> (&'static str, Value) {
    if is_1 {
        let of_target = |t: &PoseTarget| json!({ "node": t.node, "index": t.target, "weight": 1.0 });
        return ("morphTargetBinds", targets.iter().map(of_target).collect());
    }
    let meshes: BTreeSet<(usize, usize)> = targets.iter().map(|t| (t.mesh, t.target)).collect();
    let of_mesh = |(mesh, target)| json!({ "mesh": mesh, "index": target, "weight": 100.0 });
    ("binds", meshes.into_iter().map(of_mesh).collect())
}

/// The expressions of VRM 1 with this name.
fn expressions_1<'v>(json: &'v mut Value, name: &str) -> Vec<&'v mut Value> {
    let kinds = json.pointer_mut("/extensions/VRMC_vrm/expressions").and_then(Value::as_object_mut);
    let kinds = kinds.into_iter().flat_map(|kinds| kinds.iter_mut());
    let kinds = kinds.filter(|(kind, _)| ["preset", "custom"].contains(&kind.as_str()));
    kinds.filter_map(|(_, all)| all.get_mut(name)).collect()
}

/// The expressions of VRM 0 that `is` selects.
fn groups_0(json: &mut Value, is: impl Fn(&Value) -> bool) -> Vec<&mut Value> {
    let groups = json.pointer_mut("/extensions/VRM/blendShapeMaster/blendShapeGroups");
    let groups = groups.and_then(Value::as_array_mut).into_iter().flatten();
    groups.filter(|group| is(group)).collect()
}

/// Whether an expression has no effect: it is an object without morph targets and changes of materials.
fn is_idle(expression: &Value) -> bool {
    let lists =
        ["morphTargetBinds", "materialColorBinds", "textureTransformBinds", "binds", "materialValues"];
    let is_empty = |list: &Value| list.is_null() || list.as_array().is_some_and(Vec::is_empty);
    expression.is_object() && lists.iter().all(|list| is_empty(&expression[*list]))
}

/// Returns the object under a key. Replaces a value that is not an object by an empty object.
fn object<'v>(of: &'v mut Value, key: &str) -> &'v mut Value {
    if !of[key].is_object() {
        of[key] = json!({});
    }
    &mut of[key]
}
