//! Appends cage poses as morph targets.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashSet};

use glam::{DMat3, DVec3};
use serde_json::{Value, json};

use super::edit::Edit;
use super::expressions::PoseTarget;
use super::shape::SurfaceGradients;
use super::tracks::{output, own_sampler};
use super::{Rig, key_of};
use crate::error::WriteError;
use crate::gltf::channels::{ChannelTarget, channel_target};
use crate::gltf::pack::push;
use crate::gltf::target_names::{name_lists_of_primitives, target_names};
use crate::timeline::Timeline;

/// A pose that becomes a morph target.
pub(crate) struct PoseDisplacements<'a> {
    pub(crate) name: &'a str,
    /// Default weight of the target.
    pub(crate) default: f32,
    /// Returns the displacements of all points, world space as in the file. `[n_points]`
    pub(crate) by: Box<dyn Fn() -> Cow<'a, [DVec3]> + 'a>,
}

/// Appends one morph target per pose to every mesh, and an animation that plays them if there is a timeline. `rigid`:
/// nodes whose meshes stay rigid, and whether each point is outside the cage. Returns the targets of each pose.
pub(super) fn append<'p>(
    rig: &Rig<'_>,
    edit: &mut Edit<'_>,
    triangles: &[[u32; 3]],
    (poses, timeline): (&[PoseDisplacements<'p>], Option<&Timeline>),
    rigid: (&[u32], &[bool]),
) -> Result<Vec<(&'p str, Vec<PoseTarget>)>, WriteError> {
    if poses.is_empty() {
        return Ok(Vec::new());
    }
    // Number of targets of each mesh. All primitives of a mesh must have the same number of targets.
    let mut meshes: BTreeMap<usize, usize> = BTreeMap::new();
    for part in &rig.parts {
        let most = meshes.entry(edit.mesh_of(&part.instance)).or_insert(0);
        *most = part.targets.len().max(*most);
    }
    for part in &rig.parts {
        let mesh = edit.mesh_of(&part.instance);
        let number = part.primitive as usize;
        for _ in part.targets.len()..meshes[&mesh] {
            let nothing = edit.write(None, &vec![[0.0; 3]; part.local.len()], true, true);
            push(
                &mut edit.json["meshes"][mesh]["primitives"][number],
                "targets",
                json!({ "POSITION": nothing }),
            );
        }
    }
    // Process poses one at a time: gradients need more memory than the output.
    let moved = poses
        .iter()
        .map(|pose| append_target(rig, edit, triangles, &held(rig, rigid, &(pose.by)())))
        .collect::<Result<Vec<_>, _>>()?;
    let names: Vec<&str> = poses.iter().map(|pose| pose.name).collect();
    let defaults: Vec<f32> = poses.iter().map(|pose| pose.default).collect();
    for (&mesh, &n_before) in &meshes {
        append_names(&mut edit.json["meshes"][mesh], n_before, &names);
    }
    pad_weights(rig, edit, &meshes, &defaults);
    if let Some(timeline) = timeline {
        play(rig, edit, &meshes, timeline);
    }
    let nodes: BTreeSet<usize> =
        rig.document.instances.iter().filter_map(|instance| Some(instance.node? as usize)).collect();
    let targets = |(k, moved): (usize, &BTreeSet<usize>)| {
        let target = |&node: &usize| {
            let mesh = edit.json["nodes"][node]["mesh"].as_u64()? as usize;
            moved.contains(&mesh).then(|| PoseTarget { node, mesh, target: meshes[&mesh] + k })
        };
        (poses[k].name, nodes.iter().filter_map(target).collect())
    };
    Ok(moved.iter().enumerate().map(targets).collect())
}

/// Appends one morph target to every part, for the displacements `by` of all points. Returns the meshes that it moves.
fn append_target(
    rig: &Rig<'_>,
    edit: &mut Edit<'_>,
    triangles: &[[u32; 3]],
    by: &[DVec3],
) -> Result<BTreeSet<usize>, WriteError> {
    let mut moved = BTreeSet::new();
    let turned = SurfaceGradients::new(triangles, by);
    for part in &rig.parts {
        let mesh = edit.mesh_of(&part.instance);
        let number = part.primitive as usize;
        let shape = rig.shape(part, &turned, &part.frame)?;
        let inverse = |v: usize| DMat3::from_mat4(part.frame.world(v)).inverse();
        let positions: Vec<[f32; 3]> = (0..part.local.len())
            .map(|v| {
                let delta = inverse(v) * by[part.first + v];
                if delta.is_finite() { delta.as_vec3().to_array() } else { [0.0; 3] }
            })
            .collect();
        if positions.iter().flatten().any(|&x| x != 0.0) {
            moved.insert(mesh);
        }
        let mut target = json!({ "POSITION": edit.write(None, &positions, true, true) });
        let before = rig.normals(part)?;
        if let (Some(shape), Some(before)) = (shape.and_then(|shape| shape.normals), before) {
            let deltas: Vec<[f32; 3]> = shape
                .iter()
                .zip(before)
                .map(|(a, b): (&DVec3, DVec3)| (*a - b).as_vec3().to_array())
                .collect();
            target["NORMAL"] = edit.write(None, &deltas, true, true).into();
        }
        push(&mut edit.json["meshes"][mesh]["primitives"][number], "targets", target);
    }
    Ok(moved)
}

/// Appends the names of targets to those of the first `n_before` targets of a mesh.
fn append_names(mesh: &mut Value, n_before: usize, names: &[&str]) {
    let mut all: Vec<Value> = target_names(mesh).as_array().cloned().unwrap_or_default();
    all.extend((all.len()..n_before).map(|k| json!(format!("target {k}"))));
    all.truncate(n_before);
    all.extend(names.iter().map(|&name| json!(name)));
    for extras in name_lists_of_primitives(mesh) {
        extras.insert("targetNames".into(), all.clone().into());
    }
    let extras = &mut mesh["extras"];
    if !extras.is_object() {
        *extras = json!({});
    }
    extras["targetNames"] = all.into();
}

/// Appends the default weights of the new targets to the weights of meshes and nodes, and to the tracks of clips.
/// `meshes`: number of older targets of each mesh.
fn pad_weights(rig: &Rig<'_>, edit: &mut Edit<'_>, meshes: &BTreeMap<usize, usize>, defaults: &[f32]) {
    for (&mesh, &n_before) in meshes {
        pad(&mut edit.json["meshes"][mesh]["weights"], n_before, defaults);
    }
    let targets_of = |json: &Value, node: usize| {
        let mesh = json["nodes"][node]["mesh"].as_u64()? as usize;
        meshes.get(&mesh).copied()
    };
    for node in 0..rig.document.root.nodes.len() {
        let Some(n_before) = targets_of(&edit.json, node) else { continue };
        let weights = &mut edit.json["nodes"][node]["weights"];
        if weights.is_array() {
            pad(weights, n_before, defaults);
        } else if let Some(node) = edit.json["nodes"][node].as_object_mut() {
            // Remove the null member that indexing the JSON has created.
            node.shift_remove("weights");
        }
    }
    for a in 0..edit.json["animations"].as_array().map_or(0, Vec::len) {
        for c in 0..edit.json["animations"][a]["channels"].as_array().map_or(0, Vec::len) {
            let n_before = match channel_target(&edit.json["animations"][a]["channels"][c]) {
                Some(ChannelTarget::Weights(node)) => targets_of(&edit.json, node),
                Some(ChannelTarget::MeshWeights(mesh)) => meshes.get(&mesh).copied(),
                _ => None,
            };
            let Some(n_before) = n_before.filter(|&n| n > 0) else { continue };
            let Some(sampler) = own_sampler(edit, a, c) else { continue };
            let sampler_json = &edit.json["animations"][a]["samplers"][sampler];
            let Some(output) = output(edit, sampler_json) else { continue };
            let Ok(values) = rig.document.source().floats::<1>(output.accessor, "weights") else { continue };
            let padded: Vec<[f32; 1]> = values
                .chunks(n_before)
                .enumerate()
                .flat_map(|(k, of_key)| {
                    // Tangents of a constant weight are zero.
                    let share = if output.is_value(k) { 1.0 } else { 0.0 };
                    of_key.iter().copied().chain(defaults.iter().map(move |&default| [share * default]))
                })
                .collect();
            let accessor = edit.write(None, &padded, false, false);
            edit.json["animations"][a]["samplers"][sampler]["output"] = accessor.into();
        }
    }
}

/// Returns the displacements of all points in a pose, with the meshes of rigid nodes moved rigidly. Ends of morph targets
/// move with the rest shape, so that their deltas are unchanged. `by`: displacements of all points, or of the vertices.
pub(super) fn held(rig: &Rig<'_>, (rigid, is_outside): (&[u32], &[bool]), by: &[DVec3]) -> Vec<DVec3> {
    let (mut all, motions) = (by.to_vec(), rig.motions(rigid, by, is_outside));
    all.resize(rig.n_vertices + rig.extras.len(), DVec3::ZERO);
    for part in &rig.parts {
        if let Some(motion) = part.instance.node.and_then(|node| motions.get(&node)) {
            let own = part.rest().into_iter().zip(&mut all[part.first..]);
            own.for_each(|(at, by)| *by = motion.by(at));
        }
        for target in &part.targets {
            for first in target.ends.iter().flatten() {
                for (k, &v) in target.moved.iter().enumerate() {
                    all[first + k] = all[part.first + v as usize];
                }
            }
        }
    }
    all
}

/// Appends the default weights of the morph targets of the poses.
fn pad(weights: &mut Value, n_before: usize, defaults: &[f32]) {
    let mut all = weights.as_array().cloned().unwrap_or_default();
    all.resize(n_before, json!(0.0));
    all.extend(defaults.iter().map(|&default| json!(default)));
    *weights = all.into();
}

/// Adds an animation of the poses. Existing targets stay at their defaults.
fn play(rig: &Rig<'_>, edit: &mut Edit<'_>, meshes: &BTreeMap<usize, usize>, timeline: &Timeline) {
    let times: Vec<[f32; 1]> = timeline.times().into_iter().map(|time| [time]).collect();
    let input = edit.write(None, &times, false, true);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let shapes: HashSet<_> = rig.parts.iter().map(|part| key_of(&part.instance)).collect();
    for instance in rig.document.instances.iter().chain(&rig.document.elsewhere) {
        let Some(&n_before) = meshes.get(&edit.mesh_of(instance)) else { continue };
        let Some(node) = instance.node.filter(|_| shapes.contains(&key_of(instance))) else { continue };
        let defaults = rig.document.default_weights(instance);
        let default = |k: usize| defaults.and_then(|w| w.get(k)).copied().unwrap_or(0.0);
        let before: Vec<f32> = (0..n_before).map(default).collect();
        let weights: Vec<[f32; 1]> = timeline.weights(&before).into_iter().map(|weight| [weight]).collect();
        let output = edit.write(None, &weights, false, false);
        channels.push(json!({ "sampler": samplers.len(), "target": { "node": node, "path": "weights" } }));
        let interpolation = timeline.interpolation().in_gltf();
        samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
    }
    push(
        &mut edit.json,
        "animations",
        json!({ "name": timeline.name(), "samplers": samplers, "channels": channels }),
    );
}
