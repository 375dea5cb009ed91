//! Morph targets and animations of an export.

use std::collections::HashSet;

use serde_json::{Value, json};

use super::pack::{Pack, push};
use super::patch::{Place, Pose};

/// Seconds from one pose to the next.
pub(super) const SECONDS_PER_POSE: f32 = 1.0;

/// Removes all that drove the original's morph targets: weights, their names, their animation.
pub(crate) fn forget_morphs(json: &mut Value, places: &[Place]) {
    for place in places {
        for node in [Some(place.node), place.original].into_iter().flatten() {
            if let Some(node) = json["nodes"][node].as_object_mut() {
                node.shift_remove("weights");
            }
        }
        let Some(mesh) = json["meshes"][place.mesh].as_object_mut() else { continue };
        mesh.shift_remove("weights");
        if let Some(extras) = mesh.get_mut("extras").and_then(Value::as_object_mut) {
            extras.shift_remove("targetNames");
        }
    }
    let Some(animations) = json.get_mut("animations").and_then(Value::as_array_mut) else { return };
    let ours: HashSet<u64> = places.iter().filter_map(|p| Some(p.original? as u64)).collect();
    for animation in &mut *animations {
        let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) else { continue };
        channels.retain(|channel| {
            let target = &channel["target"];
            let node = target["node"].as_u64();
            target["path"] != "weights" || !node.is_some_and(|n| ours.contains(&n))
        });
    }
    animations.retain(|animation| animation["channels"].as_array().is_none_or(|c| !c.is_empty()));
    if animations.is_empty()
        && let Value::Object(object) = json
    {
        object.shift_remove("animations");
    }
}

/// When poses are shown.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Played<'a> {
    /// Rest, each in turn, rest; beside the animations that there are.
    InTurn,
    /// Each at its time, seconds; beside the animations that there are.
    At(&'a [f32]),
    /// The frames of a clip, which lasts so many seconds, instead of all animations that there are.
    Frames { clip: &'a str, seconds: f32 },
}

/// Names the targets and plays them.
pub(crate) fn play_poses(
    json: &mut Value,
    pack: &mut Pack<'_>,
    places: &[Place],
    poses: &[Pose<'_>],
    played: Played<'_>,
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
    let every = |n: usize, step: f32| (0..n).map(|k| k as f32 * step).collect::<Vec<f32>>();
    // Times of keys, and how many are before the first pose.
    let (name, times, before) = match played {
        Played::InTurn => ("poses", every(poses.len() + 2, SECONDS_PER_POSE), 1),
        Played::At(times) => ("poses", times.to_vec(), 0),
        Played::Frames { clip, seconds } => {
            json["animations"] = json!([]);
            (clip, every(poses.len(), seconds / (poses.len().max(2) - 1) as f32), 0)
        }
    };
    let weights: Vec<f32> = (0..times.len())
        .flat_map(|key| (0..poses.len()).map(move |pose| if key == pose + before { 1.0 } else { 0.0 }))
        .collect();
    let input = pack.push_floats(json, &times, 1, false, true);
    let output = pack.push_floats(json, &weights, 1, false, false);
    let channels: Vec<Value> = places
        .iter()
        .map(|place| json!({ "sampler": 0, "target": { "node": place.node, "path": "weights" } }))
        .collect();
    let sampler = json!({ "input": input, "output": output, "interpolation": "LINEAR" });
    push(json, "animations", json!({ "name": name, "samplers": [sampler], "channels": channels }));
}
