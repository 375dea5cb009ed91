//! Writes a document with the skeleton of another one.

use std::collections::{BTreeMap, HashSet};

use glam::DMat4;
use serde_json::{Value, json};

use super::GltfDocument;
use super::pack::{Pack, U16, VERTICES, push};
use super::patch::embed_images;
use super::scene::Worlds;
use crate::error::WriteError;

/// Largest number of joints of a vertex: one attribute set, which every viewer reads.
const MAX_INFLUENCES: usize = 4;

/// Writes `document` with a copy of the skeleton of `body` and the given joint weights, `[n_vertices][n_joints]`.
///
/// The copy has the joints and the nodes above them, with their names and transforms. The rest pose is the bind pose.
pub(crate) fn write_skinned(
    document: &GltfDocument,
    body: &GltfDocument,
    (joints, weights): (&[u32], &[f32]),
) -> Result<Vec<u8>, WriteError> {
    let mut json = document.json.clone();
    let mut pack = Pack::of(document);
    embed_images(document, &mut json, &mut pack);
    let worlds = Worlds::new(&body.root)?;
    let copies = copy_nodes(body, &worlds, joints, &mut json);
    let n = joints.len();
    let mut seen = HashSet::new();
    for (number, instance) in document.instances.iter().enumerate() {
        let Some(node) = instance.node else {
            return Err(WriteError::Document("its meshes have no nodes: export the clothes again".into()));
        };
        let mut mesh = instance.mesh as usize;
        if !seen.insert(mesh) {
            let copy = json["meshes"][mesh].clone();
            mesh = push(&mut json, "meshes", copy);
        }
        json["nodes"][node as usize]["mesh"] = mesh.into();
        // Viewers ignore the transform of a node with a skin, so the inverse bind matrices contain it.
        let binds = joints.iter().flat_map(|&joint| {
            let bind = worlds.world[joint as usize].inverse() * instance.world;
            (if bind.is_finite() { bind } else { DMat4::IDENTITY }).as_mat4().to_cols_array()
        });
        let binds = pack.push_floats(&mut json, &binds.collect::<Vec<f32>>(), 16, false, false);
        let nodes: Vec<usize> = joints.iter().map(|joint| copies[joint]).collect();
        let skin = push(&mut json, "skins", json!({ "joints": nodes, "inverseBindMatrices": binds }));
        json["nodes"][node as usize]["skin"] = skin.into();
        for slot in document.slots.iter().filter(|slot| slot.instance as usize == number) {
            let rows = weights[slot.start as usize * n..].chunks(n).take(slot.count as usize);
            let rows: Vec<_> = rows.map(largest).collect();
            let bytes: Vec<u8> = rows.iter().flatten().flat_map(|(joint, _)| joint.to_le_bytes()).collect();
            let view = pack.push_view(&mut json, bytes, Some(VERTICES));
            let accessor =
                json!({ "bufferView": view, "componentType": U16, "count": rows.len(), "type": "VEC4" });
            let accessor = push(&mut json, "accessors", accessor);
            let shares: Vec<f32> = rows.iter().flatten().map(|&(_, weight)| weight).collect();
            let shares = pack.push_floats(&mut json, &shares, MAX_INFLUENCES, true, false);
            let attributes = &mut json["meshes"][mesh]["primitives"][slot.primitive as usize]["attributes"];
            attributes["JOINTS_0"] = accessor.into();
            attributes["WEIGHTS_0"] = shares.into();
        }
    }
    pack.finish(json)
}

/// The largest weights of a vertex with their joints, divided by their sum. Joint 0 has the weights that are zero.
fn largest(row: &[f32]) -> [(u16, f32); MAX_INFLUENCES] {
    let mut all: Vec<(u16, f32)> =
        (0..=u16::MAX).zip(row.iter().copied()).filter(|&(_, weight)| weight > 0.0).collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all.truncate(MAX_INFLUENCES);
    let sum: f32 = all.iter().map(|(_, weight)| weight).sum();
    std::array::from_fn(|k| match all.get(k) {
        Some(&(joint, weight)) => (joint, weight / sum),
        None if sum == 0.0 && k == 0 => (0, 1.0),
        None => (0, 0.0),
    })
}

/// Appends copies of the joints of `body` and of the nodes above them to `json`, and shows them in its scene. Returns
/// the number of each copy.
fn copy_nodes(
    body: &GltfDocument,
    worlds: &Worlds,
    joints: &[u32],
    json: &mut Value,
) -> BTreeMap<u32, usize> {
    let mut is_kept = vec![false; body.root.nodes.len()];
    joints.iter().for_each(|&joint| is_kept[joint as usize] = true);
    // Parents come first in `order`.
    for &(node, parent) in worlds.order.iter().rev() {
        if let Some(parent) = parent.filter(|_| is_kept[node as usize]) {
            is_kept[parent as usize] = true;
        }
    }
    let mut copies = BTreeMap::new();
    for &(node, parent) in worlds.order.iter().filter(|(node, _)| is_kept[*node as usize]) {
        let original = &body.json["nodes"][node as usize];
        let members = ["name", "matrix", "translation", "rotation", "scale"].into_iter();
        let kept = members.filter_map(|key| Some((key.to_owned(), original.get(key)?.clone())));
        let copy = push(json, "nodes", Value::Object(kept.collect()));
        copies.insert(node, copy);
        match parent.map(|parent| copies[&parent]) {
            Some(parent) => {
                push(&mut json["nodes"][parent], "children", copy.into());
            }
            None => {
                let scene = json["scene"].as_u64().unwrap_or(0) as usize;
                if json["scenes"].get(scene).is_some() {
                    push(&mut json["scenes"][scene], "nodes", copy.into());
                }
            }
        }
    }
    copies
}
