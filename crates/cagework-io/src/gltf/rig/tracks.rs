//! Animation tracks of nodes that have moved.

use glam::{DMat3, DQuat, DVec3, Vec3};
use serde_json::Value;

use super::edit::Edit;
use super::nodes::Change;
use super::reshape::ReshapeReport;
use crate::gltf::GltfDocument;
use crate::gltf::pack::push;

/// A translation that moves by less than this, over the node's own, stands still.
const STILL: f64 = 1e-3;

/// What a channel drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Driven {
    Translation(usize),
    Rotation(usize),
    Scale(usize),
    /// Morph weights of a node, or of a mesh.
    Weights(usize),
    MeshWeights(usize),
}

/// What a channel drives, if it is of those that a reshape knows; by `path` and node, or by a pointer
/// (KHR_animation_pointer).
pub(super) fn driven(channel: &Value) -> Option<Driven> {
    let target = &channel["target"];
    if let Some(pointer) = target.pointer("/extensions/KHR_animation_pointer/pointer").and_then(Value::as_str)
    {
        let mut words = pointer.strip_prefix('/')?.split('/');
        let (list, index, what) = (words.next()?, words.next()?.parse().ok()?, words.next()?);
        return match (list, what, words.next()) {
            ("nodes", "translation", None) => Some(Driven::Translation(index)),
            ("nodes", "rotation", None) => Some(Driven::Rotation(index)),
            ("nodes", "scale", None) => Some(Driven::Scale(index)),
            ("nodes", "weights", None) => Some(Driven::Weights(index)),
            ("meshes", "weights", None) => Some(Driven::MeshWeights(index)),
            _ => None,
        };
    }
    let node = target["node"].as_u64()? as usize;
    match target["path"].as_str()? {
        "translation" => Some(Driven::Translation(node)),
        "rotation" => Some(Driven::Rotation(node)),
        "scale" => Some(Driven::Scale(node)),
        "weights" => Some(Driven::Weights(node)),
        _ => None,
    }
}

/// Values of a sampler: its accessor, and whether only every third one is a value, between tangents.
pub(super) struct Output {
    pub(super) accessor: u32,
    pub(super) is_cubic: bool,
    /// Keys.
    pub(super) n_keys: usize,
}

impl Output {
    /// Whether element `k` is the value of a key, and no tangent.
    fn is_value(&self, k: usize) -> bool {
        !self.is_cubic || k % 3 == 1
    }
}

pub(super) fn output(edit: &Edit<'_>, sampler: &Value) -> Option<Output> {
    let count = |key: &str| {
        let accessor = sampler[key].as_u64()?;
        Some((accessor as u32, edit.json["accessors"][accessor as usize]["count"].as_u64()? as usize))
    };
    let ((_, n_keys), (accessor, _)) = (count("input")?, count("output")?);
    Some(Output { accessor, is_cubic: sampler["interpolation"] == "CUBICSPLINE", n_keys })
}

/// Makes a sampler the channel's own if others use it; returns its number, none if there is no such sampler.
pub(super) fn own_sampler(edit: &mut Edit<'_>, animation: usize, channel: usize) -> Option<usize> {
    let of = &mut edit.json["animations"][animation];
    let sampler = of["channels"][channel]["sampler"].as_u64()? as usize;
    let copy = of["samplers"].get(sampler)?.clone();
    let users = of["channels"].as_array()?.iter().filter(|c| c["sampler"] == sampler).count();
    if users < 2 {
        return Some(sampler);
    }
    let accessors = ["input", "output"].map(|key| copy[key].as_u64());
    let number = push(of, "samplers", copy);
    of["channels"][channel]["sampler"] = number.into();
    accessors.into_iter().flatten().for_each(|accessor| edit.use_again(accessor as usize));
    Some(number)
}

/// Values of a translation or rotation track; none if there are not as many as it has keys.
fn values<const N: usize>(document: &GltfDocument, output: &Output) -> Option<Vec<[f32; N]>> {
    let values = document.source().floats::<N>(output.accessor, "a track").ok()?;
    let per_key = if output.is_cubic { 3 } else { 1 };
    (values.len() == per_key * output.n_keys).then_some(values)
}

/// Whether clips move nodes that have changed, by node: otherwise their translations are the lengths of bones.
fn moving(document: &GltfDocument, edit: &Edit<'_>, changes: &[Option<Change>]) -> Vec<bool> {
    let mut moving = vec![false; changes.len()];
    for animation in edit.json["animations"].as_array().into_iter().flatten() {
        for channel in animation["channels"].as_array().into_iter().flatten() {
            let Some(Driven::Translation(node)) = driven(channel) else { continue };
            let Some(change) = changes.get(node).and_then(Option::as_ref) else { continue };
            let sampler = channel["sampler"].as_u64().and_then(|s| animation["samplers"].get(s as usize));
            let Some(output) = sampler.and_then(|sampler| output(edit, sampler)) else { continue };
            let Some(values) = values(document, &output) else { continue };
            let keys = || {
                let keys = values.iter().enumerate().filter(|(k, _)| output.is_value(*k));
                keys.map(|(_, &v)| Vec3::from_array(v).as_dvec3())
            };
            let range =
                keys().fold(DVec3::NEG_INFINITY, DVec3::max) - keys().fold(DVec3::INFINITY, DVec3::min);
            moving[node] |= range.max_element() > STILL * change.from.length();
        }
    }
    moving
}

/// Brings translations, and rotations where bones turn, to nodes that have moved.
pub(super) fn rescale(
    document: &GltfDocument,
    edit: &mut Edit<'_>,
    changes: &[Option<Change>],
    report: &mut ReshapeReport,
) {
    let moving = moving(document, edit, changes);
    let n_animations = edit.json["animations"].as_array().map_or(0, Vec::len);
    for a in 0..n_animations {
        let n_channels = edit.json["animations"][a]["channels"].as_array().map_or(0, Vec::len);
        for c in 0..n_channels {
            let change = |node: usize| changes.get(node).and_then(Option::as_ref);
            let (node, is_rotation) = match driven(&edit.json["animations"][a]["channels"][c]) {
                Some(Driven::Translation(node)) => (node, false),
                Some(Driven::Rotation(node)) => (node, true),
                _ => continue,
            };
            let Some(change) = change(node).filter(|change| !is_rotation || change.turn.is_some()) else {
                continue;
            };
            let Some(sampler) = own_sampler(edit, a, c) else {
                report.tracks_unread += 1;
                continue;
            };
            let found = output(edit, &edit.json["animations"][a]["samplers"][sampler]);
            let written = found.and_then(|output| {
                let accessor = Some(output.accessor as usize);
                if is_rotation {
                    let values = turned(&values(document, &output)?, change);
                    Some(edit.write(accessor, &values, false, false))
                } else {
                    let linear = if moving[node] { change.moving } else { change.still };
                    let values = moved(&values(document, &output)?, change, linear, &output);
                    Some(edit.write(accessor, &values, false, false))
                }
            });
            match written {
                Some(accessor) => {
                    edit.json["animations"][a]["samplers"][sampler]["output"] = accessor.into();
                    report.tracks += 1;
                }
                None => report.tracks_unread += 1,
            }
        }
    }
}

/// `t' + S (t(t) - t)` with `linear` as S; tangents take the linear part only.
fn moved(values: &[[f32; 3]], change: &Change, linear: DMat3, output: &Output) -> Vec<[f32; 3]> {
    let value = |(k, &v): (usize, &[f32; 3])| {
        let v = Vec3::from_array(v).as_dvec3();
        let v = if output.is_value(k) { change.to + linear * (v - change.from) } else { linear * v };
        v.as_vec3().to_array()
    };
    values.iter().enumerate().map(value).collect()
}

fn turned(values: &[[f32; 4]], change: &Change) -> Vec<[f32; 4]> {
    let turn = change.turn.unwrap_or(DQuat::IDENTITY);
    // Tangents are no unit quaternions: the product is linear in them all the same.
    let value = |q: &[f32; 4]| (turn * DQuat::from_array(q.map(f64::from))).as_quat().to_array();
    values.iter().map(value).collect()
}
