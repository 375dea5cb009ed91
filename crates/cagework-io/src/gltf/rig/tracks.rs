//! Adapts animation tracks of nodes that have moved.

use glam::{DMat3, DQuat, DVec3, Vec3};
use serde_json::Value;

use super::edit::Edit;
use super::report::ReshapeReport;
use crate::gltf::GltfDocument;
use crate::gltf::channels::{ChannelTarget, channel_target};
use crate::gltf::pack::push;

/// A translation track whose range is below this fraction of the node's own translation counts as constant.
const MIN_TRANSLATION_RANGE: f64 = 1e-3;

/// Change of a node's local transform, which its animation tracks must follow.
pub(super) struct NodeChange {
    pub(super) from: DVec3,
    pub(super) to: DVec3,
    /// Linear maps for deviations from `from`: `still` in tracks of constant translation, `moving` in tracks that move
    /// the node. They are equal if no node above moves.
    pub(super) still: DMat3,
    pub(super) moving: DMat3,
    /// Rotation by which rotation keys are multiplied from the left.
    pub(super) turn: Option<DQuat>,
}

/// Output of a sampler. Cubic splines store in-tangent, value and out-tangent per key.
pub(super) struct Output {
    pub(super) accessor: u32,
    pub(super) is_cubic: bool,
    /// Number of keys of the track.
    pub(super) n_keys: usize,
}

impl Output {
    /// Whether element `k` is a value, not a tangent.
    pub(super) fn is_value(&self, k: usize) -> bool {
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

/// Returns the index of the channel's sampler, after duplicating a shared one; `None` if the sampler does not exist.
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

/// Reads the values of a translation or rotation track; `None` if the count does not match the keys.
pub(super) fn values<const N: usize>(document: &GltfDocument, output: &Output) -> Option<Vec<[f32; N]>> {
    let values = document.source().floats::<N>(output.accessor, "a track").ok()?;
    let per_key = if output.is_cubic { 3 } else { 1 };
    (values.len() == per_key * output.n_keys).then_some(values)
}

/// Whether a clip moves each changed node: the range of a translation track exceeds [`MIN_TRANSLATION_RANGE`]. The
/// translation tracks of other nodes are constant. They repeat the length of the node's bone, or place a node at the top
/// of a skeleton.
fn moving(document: &GltfDocument, edit: &Edit<'_>, changes: &[Option<NodeChange>]) -> Vec<bool> {
    let mut moving = vec![false; changes.len()];
    for animation in edit.json["animations"].as_array().into_iter().flatten() {
        for channel in animation["channels"].as_array().into_iter().flatten() {
            let Some(ChannelTarget::Translation(node)) = channel_target(channel) else { continue };
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
            moving[node] |= range.max_element() > MIN_TRANSLATION_RANGE * change.from.length();
        }
    }
    moving
}

/// Adapts translation and rotation tracks to nodes that have changed.
pub(super) fn rescale(
    document: &GltfDocument,
    edit: &mut Edit<'_>,
    changes: &[Option<NodeChange>],
    report: &mut ReshapeReport,
) {
    let moving = moving(document, edit, changes);
    let n_animations = edit.json["animations"].as_array().map_or(0, Vec::len);
    for a in 0..n_animations {
        let n_channels = edit.json["animations"][a]["channels"].as_array().map_or(0, Vec::len);
        for c in 0..n_channels {
            let change = |node: usize| changes.get(node).and_then(Option::as_ref);
            let (node, is_rotation) = match channel_target(&edit.json["animations"][a]["channels"][c]) {
                Some(ChannelTarget::Translation(node)) => (node, false),
                Some(ChannelTarget::Rotation(node)) => (node, true),
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

/// Applies `to + linear (v - from)` to values v, and only `linear` to tangents.
fn moved(values: &[[f32; 3]], change: &NodeChange, linear: DMat3, output: &Output) -> Vec<[f32; 3]> {
    let value = |(k, &v): (usize, &[f32; 3])| {
        let v = Vec3::from_array(v).as_dvec3();
        let v = if output.is_value(k) { change.to + linear * (v - change.from) } else { linear * v };
        v.as_vec3().to_array()
    };
    values.iter().enumerate().map(value).collect()
}

fn turned(values: &[[f32; 4]], change: &NodeChange) -> Vec<[f32; 4]> {
    let turn = change.turn.unwrap_or(DQuat::IDENTITY);
    // Tangents are not unit quaternions, but they transform in the same way, because the product is linear.
    let value = |q: &[f32; 4]| (turn * DQuat::from_array(q.map(f64::from))).as_quat().to_array();
    values.iter().map(value).collect()
}
