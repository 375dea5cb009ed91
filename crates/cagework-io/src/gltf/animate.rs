//! Morph targets of exported poses, and the animation that plays them.

use std::collections::HashSet;

use glam::{DMat4, Vec3};
use serde_json::{Value, json};

use super::channels::{ChannelTarget, channel_target};
use super::pack::{Pack, push};
use super::target_names::name_lists_of_primitives;
use crate::timeline::Timeline;

/// A pose of the model: its name and vertex positions.
#[derive(Clone, Copy)]
pub(crate) struct Pose<'a> {
    pub(crate) name: &'a str,
    pub(crate) positions: &'a [Vec3],
}

/// Mesh and node that show an instance in an exported document.
pub(crate) struct MeshPlacement {
    pub(super) mesh: usize,
    pub(super) node: usize,
    /// Node of the instance in the original document; `None` in a file without nodes.
    pub(super) original: Option<usize>,
    /// Whether the mesh was moved to a new root node.
    pub(super) detached: bool,
    /// Transform from world space, relative to the origin, to mesh space.
    pub(super) mesh_from_world: DMat4,
}

/// Removes the weights, names and animation channels of the original morph targets.
pub(crate) fn forget_morphs(json: &mut Value, places: &[MeshPlacement]) {
    for place in places {
        for node in [Some(place.node), place.original].into_iter().flatten() {
            if let Some(node) = json["nodes"][node].as_object_mut() {
                node.shift_remove("weights");
            }
        }
        let mesh = &mut json["meshes"][place.mesh];
        name_lists_of_primitives(mesh).for_each(|extras| drop(extras.shift_remove("targetNames")));
        let Some(mesh) = mesh.as_object_mut() else { continue };
        mesh.shift_remove("weights");
        if let Some(extras) = mesh.get_mut("extras").and_then(Value::as_object_mut) {
            extras.shift_remove("targetNames");
        }
    }
    let Some(animations) = json.get_mut("animations").and_then(Value::as_array_mut) else { return };
    let nodes: HashSet<usize> = places.iter().filter_map(|p| p.original).collect();
    let meshes: HashSet<usize> = places.iter().map(|p| p.mesh).collect();
    for animation in &mut *animations {
        let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) else { continue };
        channels.retain(|channel| match channel_target(channel) {
            Some(ChannelTarget::Weights(node)) => !nodes.contains(&node),
            Some(ChannelTarget::MeshWeights(mesh)) => !meshes.contains(&mesh),
            _ => true,
        });
    }
    animations.retain(|animation| animation["channels"].as_array().is_none_or(|c| !c.is_empty()));
    if animations.is_empty()
        && let Value::Object(object) = json
    {
        object.shift_remove("animations");
    }
}

/// The animation that plays an export's poses as morph targets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseClip<'a> {
    pub(crate) name: &'a str,
    pub(crate) timeline: &'a Timeline,
    /// Whether the document's own animations are dropped.
    pub(crate) is_alone: bool,
}

impl<'a> PoseClip<'a> {
    /// A clip with the name of the timeline, added to the animations of the document.
    pub(crate) fn of(timeline: &'a Timeline) -> Self {
        Self { name: timeline.name(), timeline, is_alone: false }
    }
}

/// Names the morph targets after the poses, and adds an animation that plays them.
pub(crate) fn play_poses(
    json: &mut Value,
    pack: &mut Pack<'_>,
    places: &[MeshPlacement],
    poses: &[Pose<'_>],
    PoseClip { name, timeline, is_alone }: PoseClip<'_>,
) {
    let names: Vec<&str> = poses.iter().map(|p| p.name).collect();
    for place in places {
        let mesh = &mut json["meshes"][place.mesh];
        mesh["weights"] = json!(vec![0.0; poses.len()]);
        if !mesh["extras"].is_object() {
            mesh["extras"] = json!({});
        }
        mesh["extras"]["targetNames"] = json!(names);
    }
    if is_alone {
        json["animations"] = json!([]);
    }
    let input = pack.push_floats(json, &timeline.times(), 1, false, true);
    let output = pack.push_floats(json, &timeline.weights(&[]), 1, false, false);
    let channels: Vec<Value> = places
        .iter()
        .map(|place| json!({ "sampler": 0, "target": { "node": place.node, "path": "weights" } }))
        .collect();
    let sampler =
        json!({ "input": input, "output": output, "interpolation": timeline.interpolation().in_gltf() });
    push(json, "animations", json!({ "name": name, "samplers": [sampler], "channels": channels }));
}
