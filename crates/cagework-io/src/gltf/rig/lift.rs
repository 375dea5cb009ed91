//! Vertical offsets of clips, with which the lowest point of each clip keeps its original height.
//!
//! The offset is constant during a clip, and is added to the translations of the nodes at the top of the clip's
//! skeletons. It is needed in addition to the lift of the rest shape, because longer legs and scaled travel change the
//! height of the feet in clips.
//!
//! The lowest point is a vertex. If the file's joints take their moves by name from another file (the body), the file
//! may contain only a jacket, or no vertices. Then the lowest joint that carries vertices is used, and its height above
//! the soles is assumed to be that of the rest pose.

use std::collections::BTreeMap;

use cagework_core::skin::skin_vertices;
use glam::{DMat3, DVec3, Vec3};
use serde_json::json;

use super::edit::Edit;
use super::ground::{ClipGround, Ground, MIN_LIFT};
use super::nodes::NamedMoves;
use super::play::Player;
use super::tracks::{output, own_sampler, values};
use super::{Rig, feet};
use crate::error::WriteError;
use crate::gltf::GltfDocument;
use crate::gltf::channels::{ChannelTarget, channel_target};
use crate::gltf::pack::push;
use crate::gltf::scene::Worlds;

/// Largest number of samples of all clips together.
const MAX_SAMPLES: usize = 40_000;
/// Number of directions in which the farthest vertex of each joint is a candidate for the lowest one. Each direction is
/// within 14 degrees of one of them, so the lowest point of a round part of radius r is found at most 0.03 r too high,
/// before and after the deformation.
const DIRECTIONS: usize = 128;

/// Input of [`lift_clips`].
pub(super) struct LiftInput<'a> {
    /// Moves of joints by their names.
    pub(super) named: Option<&'a NamedMoves>,
    /// Heights of a shared skeleton, which replace the heights of the file.
    pub(super) shared: Option<&'a Ground>,
    /// Lift of the rest shape.
    pub(super) lift: f64,
    /// Whether each vertex belongs to something that is carried. `[n_vertices]`
    pub(super) carried: &'a [bool],
    /// Up axis of the file.
    pub(super) up: DVec3,
}

/// The points among which the lowest one is searched.
enum Points {
    /// Skins of the vertices before and after the deformation.
    Vertices(Box<[cagework_core::skin::Skin; 2]>),
    /// Nodes of joints.
    Joints(Vec<usize>),
}

/// In each clip of `after`, the reshaped document of `rig`, moves the animated skeletons vertically by their top nodes
/// ([`tops`]), so that the lowest point of the clip has its original height.
///
/// # Errors
/// [`WriteError`] if the vertices or joints of the document cannot be read.
pub(super) fn lift_clips(
    rig: &Rig<'_>,
    after: GltfDocument,
    given: &LiftInput<'_>,
) -> Result<(GltfDocument, Vec<ClipGround>), WriteError> {
    let before = rig.document;
    let players = [Player::new(before, before, rig.origin)?, Player::new(&after, before, rig.origin)?];
    let height = rig.origin.dot(given.up);
    let top_of = tops(rig, given.named);
    let worlds = Worlds::new(&after.root)?;
    let names = given.named.filter(|named| named.of_nodes.iter().any(Option::is_some));
    let candidates = if names.is_some() { Vec::new() } else { candidates(&players[0], given.carried) };
    let mut edit = Edit::new(&after);
    let mut all = Vec::new();
    let n_samples = MAX_SAMPLES / players[0].clips().len().max(1);
    for (number, clip) in players[0].clips().iter().enumerate() {
        let (name, seconds) = (clip.label(number), clip.seconds);
        let mut tops: Vec<usize> =
            clip.nodes().filter_map(|node| top_of.get(node).copied().flatten()).collect();
        tops.sort_unstable();
        tops.dedup();
        let shared = given.shared.and_then(|ground| ground.clips.iter().find(|own| own.is(&name, seconds)));
        let lows = match shared {
            Some(clip) => Some(clip.lows),
            None => {
                let is_moved = |node: usize| top_of[node].is_some_and(|top| tops.contains(&top));
                let points = points(names, &players, &candidates, &is_moved);
                let times = feet::times(clip);
                let step = times.len().div_ceil(n_samples.max(1));
                let times: Vec<f32> = times.iter().step_by(step).map(|&t| t as f32).collect();
                let lows = points.and_then(|points| lows(&players, (number, &times), &points, given.up));
                lows.map(|[low, now]| [height + low, height + now - given.lift])
            }
        };
        let Some(lows) = lows else {
            all.push(ClipGround { name, seconds, lows: [f64::INFINITY; 2], lift: 0.0 });
            continue;
        };
        let lift = Some(lows[0] - lows[1] - given.lift).filter(|lift| lift.abs() > MIN_LIFT * rig.diagonal);
        if let Some(lift) = lift {
            for &top in &tops {
                let above = rig.worlds.order.iter().find(|(node, _)| *node as usize == top);
                let parent = above.and_then(|(_, parent)| *parent);
                let linear = parent.map_or(DMat3::IDENTITY, |p| DMat3::from_mat4(worlds.world[p as usize]));
                let by = linear.inverse() * (lift * given.up);
                if by.is_finite() {
                    offset(&after, &mut edit, (number, top), by.as_vec3());
                }
            }
        }
        all.push(ClipGround { name, seconds, lows, lift: lift.unwrap_or(0.0) });
    }
    if all.iter().all(|clip| clip.lift == 0.0) {
        return Ok((after, all));
    }
    Ok((edit.into_document()?, all))
}

/// For each node, the node that moves it together with its skeleton: from the root down, the first one that follows the
/// cage and can be animated, because it has no matrix. `[n_nodes]`
fn tops(rig: &Rig<'_>, named: Option<&NamedMoves>) -> Vec<Option<usize>> {
    let nodes = &rig.document.root.nodes;
    let follows = rig.following(named);
    let mut tops = vec![None; nodes.len()];
    for &(node, parent) in &rig.worlds.order {
        let i = node as usize;
        let own = (follows[i] && nodes[i].matrix.is_none()).then_some(i);
        tops[i] = parent.and_then(|parent| tops[parent as usize]).or(own);
    }
    tops
}

/// Finds the vertices that can be the lowest ones of their joint in some pose, with the node of this joint. Ignores
/// vertices that are `carried`.
fn candidates(player: &Player, carried: &[bool]) -> Vec<(u32, Option<u32>)> {
    let skin = &player.skin;
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let directions: Vec<Vec3> = (0..DIRECTIONS)
        .map(|k| {
            let y = 1.0 - (2 * k + 1) as f32 / DIRECTIONS as f32;
            let (sin, cos) = (golden * k as f32).sin_cos();
            let r = (1.0 - y * y).sqrt();
            Vec3::new(r * cos, y, r * sin)
        })
        .collect();
    let mut farthest: BTreeMap<u32, Vec<(f32, u32)>> = BTreeMap::new();
    for (v, &rest) in (0..).zip(&skin.positions) {
        if carried.get(v as usize) == Some(&true) {
            continue;
        }
        let range = |starts: &[u32]| starts[v as usize] as usize..starts[v as usize + 1] as usize;
        let joints = &skin.joints[range(&skin.joint_starts)];
        let Some(&(joint, _)) = joints.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        let own = farthest.entry(joint).or_insert_with(|| vec![(f32::NEG_INFINITY, 0); DIRECTIONS]);
        let ends = skin.deltas[range(&skin.delta_starts)].iter().map(|(_, delta)| rest + *delta);
        for at in std::iter::once(rest).chain(ends) {
            for (direction, best) in directions.iter().zip(own.iter_mut()) {
                let far = direction.dot(at);
                if far > best.0 {
                    *best = (far, v);
                }
            }
        }
    }
    let mut all: Vec<(u32, Option<u32>)> = farthest
        .into_iter()
        .flat_map(|(joint, own)| {
            let node = player.palette[joint as usize].0;
            own.into_iter().filter(|best| best.0 > f32::NEG_INFINITY).map(move |(_, v)| (v, node))
        })
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Returns the points among which the lowest one in a clip is searched; `None` without such points. `is_moved`: whether
/// the clip moves a node.
fn points(
    names: Option<&NamedMoves>,
    players: &[Player; 2],
    candidates: &[(u32, Option<u32>)],
    is_moved: &dyn Fn(usize) -> bool,
) -> Option<Points> {
    if let Some(named) = names {
        let joints =
            (0..named.holds.len()).filter(|&node| named.holds[node] && is_moved(node)).collect::<Vec<_>>();
        return (!joints.is_empty()).then_some(Points::Joints(joints));
    }
    let own = candidates.iter().filter(|(_, node)| node.is_some_and(|node| is_moved(node as usize)));
    let own: Vec<u32> = own.map(|(v, _)| *v).collect();
    let skins = || Box::new([0, 1].map(|k: usize| players[k].skin.of_vertices(&own)));
    let fits = players[0].skin.positions.len() == players[1].skin.positions.len();
    (!own.is_empty() && fits).then(|| Points::Vertices(skins()))
}

/// Computes the lowest heights of the points at times of a clip, before and after the deformation, relative to the
/// model's origin.
fn lows(
    players: &[Player; 2],
    (clip, times): (usize, &[f32]),
    points: &Points,
    up: DVec3,
) -> Option<[f64; 2]> {
    let up = up.as_vec3();
    let at = |k: usize, clip: Option<usize>, seconds: f32| -> f64 {
        let posed = players[k].pose_at(clip, seconds, &[]);
        let low = |all: &mut dyn Iterator<Item = Vec3>| all.map(|p| p.dot(up)).fold(f32::INFINITY, f32::min);
        f64::from(match points {
            Points::Vertices(skins) => {
                low(&mut skin_vertices(&skins[k], &posed.palette, &posed.targets).into_iter())
            }
            Points::Joints(joints) => low(&mut joints.iter().map(|&joint| posed.origins[joint])),
        })
    };
    let lowest = |k: usize| times.iter().map(|&t| at(k, Some(clip), t)).fold(f64::INFINITY, f64::min);
    // Change of the lowest joint's height above the soles. At rest the soles stay on the ground, so this is the change
    // of its height.
    let soles = match points {
        Points::Vertices(_) => 0.0,
        Points::Joints(_) => at(1, None, 0.0) - at(0, None, 0.0),
    };
    let lows = [lowest(0) + soles, lowest(1)];
    lows.iter().all(|low| low.is_finite()).then_some(lows)
}

/// Adds a vector to the translation of a node during a clip.
fn offset(document: &GltfDocument, edit: &mut Edit<'_>, (clip, node): (usize, usize), by: Vec3) {
    let target = ChannelTarget::Translation(node);
    let channels = edit.json["animations"][clip]["channels"].as_array();
    let channel = channels.into_iter().flatten().position(|channel| channel_target(channel) == Some(target));
    if let Some(channel) = channel {
        let Some(sampler) = own_sampler(edit, clip, channel) else { return };
        let Some(output) = output(edit, &edit.json["animations"][clip]["samplers"][sampler]) else { return };
        let Some(mut keys) = values::<3>(document, &output) else { return };
        for (_, value) in keys.iter_mut().enumerate().filter(|(k, _)| output.is_value(*k)) {
            *value = (Vec3::from_array(*value) + by).to_array();
        }
        let written = edit.write(Some(output.accessor as usize), &keys, false, false);
        edit.json["animations"][clip]["samplers"][sampler]["output"] = written.into();
        return;
    }
    let rest = Vec3::from_array(document.root.nodes[node].translation.unwrap_or_default());
    let input = edit.write(None, &[[0.0]], false, true);
    let output = edit.write(None, &[(rest + by).to_array()], false, false);
    let animation = &mut edit.json["animations"][clip];
    let sampler =
        push(animation, "samplers", json!({ "input": input, "output": output, "interpolation": "STEP" }));
    let target = json!({ "node": node, "path": "translation" });
    push(animation, "channels", json!({ "sampler": sampler, "target": target }));
}
