//! Foot locking: detects contacts of feet with the ground in the original clips, and corrects legs of the reshaped
//! model by two-bone inverse kinematics, so that feet do not slide during contacts.
//!
//! * **Contacts**: samples at which the ankle is at most [`MAX_HEIGHT`] above its lowest height and slower than
//!   [`MAX_SPEED`]. In an in-place clip, where the character walks without moving forward, the ground moves. Speeds are
//!   therefore relative to the ground's velocity, the median of the ankles' velocities near the ground.
//! * **Targets**: during a contact, the mean position of the ankle relative to the ground. Before and after a contact
//!   the correction fades within [`FADE`] seconds. In a loop, where the last pose equals the first one, contacts and
//!   fades continue across the seam.
//! * **Samples**: at equal time steps, at the keys, and on both sides of the jumps of STEP tracks. If all tracks are STEP,
//!   only at the keys, and the corrected tracks are STEP too.
//! * **Correction**: thigh and shin rotate so that the ankle reaches its target. The foot keeps its direction.

use std::collections::{BTreeMap, BTreeSet};

use ::gltf::json::scene::UnitQuaternion;
use glam::{DMat3, DMat4, DQuat, DVec3};
use serde_json::json;

use super::clip::{Clip, clips, quaternion};
use super::edit::Edit;
use super::nodes::{holders, vrm_bones};
use super::tree::{NodeTree, PosedNodes};
use crate::error::WriteError;
use crate::gltf::GltfDocument;
use crate::gltf::channels::{ChannelTarget, channel_target};
use crate::gltf::pack::push;
use crate::gltf::scene::local;
use crate::surface::rotation;

/// Largest speed of a planted ankle, leg lengths per second. The swinging foot of a walk is about ten times as fast.
const MAX_SPEED: f64 = 0.3;
/// Largest height of a planted ankle above its lowest height in the clip, leg lengths.
const MAX_HEIGHT: f64 = 0.06;
/// Shortest contact, seconds.
const MIN_CONTACT: f64 = 0.08;
/// Longest gap across which two contacts are joined, seconds.
const MAX_GAP: f64 = 0.04;
/// Time in which a correction fades before and after a contact, seconds.
const FADE: f64 = 0.15;
/// Samples per second at equal time steps, in addition to samples at the keys of the clip.
const RATE: f64 = 60.0;
/// Largest number of samples of a clip at equal time steps, and at keys.
const MAX_SAMPLES: usize = 20_000;
/// Largest number of legs whose feet are locked.
const MAX_LEGS: usize = 32;
/// Longest reach of a leg, as a share of its length. Closer to full extension, small corrections bend the knee by large
/// angles.
const MAX_REACH: f64 = 0.9995;
/// Names of joints that end a leg.
const FEET: [&str; 4] = ["foot", "ankle", "paw", "hoof"];
/// Names of joints that end a front leg if they are near the ground at rest.
const HANDS: [&str; 2] = ["hand", "wrist"];
/// Largest height of a joint of [`HANDS`] above the lowest foot, leg lengths. The hands of a standing person are about
/// one leg length above the feet.
const MAX_HAND_HEIGHT: f64 = 0.4;
/// Largest difference between the first and the last pose of a loop, leg lengths.
const MAX_SEAM: f64 = 5e-3;

cagework_core::choice! {
    /// What happens to planted feet in clips.
    Feet {
        /// The rotations of the clip stay unchanged. If the legs have become longer, the feet slide.
        #[default]
        Free = "free",
        /// Thighs and shins rotate so that planted feet stay in place.
        Lock = "lock",
    }
}

/// Contacts of feet with the ground in the clips of a document.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Contacts {
    pub(super) legs: usize,
    pub(super) n: usize,
    /// Mean path of an ankle along the ground during a contact, object units: before and after the correction.
    pub(super) slide: [f64; 2],
}

/// Node indices of thigh, shin and foot.
type Leg = [usize; 3];

/// Nodes of a document, their parents, and its clips.
struct AnimatedNodes {
    tree: NodeTree,
    parents: Vec<Option<usize>>,
    clips: Vec<Clip>,
}

impl AnimatedNodes {
    fn new(document: &GltfDocument) -> Result<Self, WriteError> {
        let tree = NodeTree::new(document)?;
        Ok(Self { parents: tree.parents(), tree, clips: clips(document) })
    }

    fn at(&self, clip: &Clip, seconds: f64) -> PosedNodes {
        self.tree.posed(&clip.at(seconds as f32).collect::<Vec<_>>())
    }
}

fn length(pose: &PosedNodes, [thigh, shin, foot]: Leg) -> f64 {
    pose.position(thigh).distance(pose.position(shin)) + pose.position(shin).distance(pose.position(foot))
}

/// Finds the legs of a document: those that a VRM names, otherwise chains of two joints above a joint named like a
/// foot, or like a hand if it is near the ground.
fn legs(document: &GltfDocument, skeleton: &AnimatedNodes, up: DVec3) -> Vec<Leg> {
    let json = &document.json;
    let bones = vrm_bones(document);
    let bone = |name: &str| bones.iter().find(|(bone, _)| *bone == name).map(|(_, node)| *node);
    let of_side = |side: &str| {
        let [thigh, shin, foot] = ["UpperLeg", "LowerLeg", "Foot"].map(|part| bone(&format!("{side}{part}")));
        Some([thigh?, shin?, foot?])
    };
    let of_vrm: Vec<Leg> = ["left", "right"].into_iter().filter_map(of_side).collect();
    let joints: BTreeSet<usize> = holders(document).into_iter().collect();
    let name = |node: usize| json["nodes"][node]["name"].as_str().unwrap_or_default();
    let is_called = |node: usize, names: &[&str]| {
        let name = name(node).to_lowercase();
        names.iter().any(|end| name.contains(end))
            && !["toe", "ik", "pole"].iter().any(|no| name.contains(no))
    };
    let above = |node: usize| skeleton.parents.get(node).copied().flatten();
    let rest = skeleton.tree.posed([]);
    let by_name = |names: &[&str]| -> Vec<Leg> {
        let chain = |&foot: &usize| {
            let shin = above(foot)?;
            let thigh = above(shin)?;
            // `shin.001` below `shin` is the second half of a bone that twists, not a knee.
            let is_twist = !name(thigh).is_empty() && name(shin).starts_with(name(thigh));
            let is_inner = |node: &usize| joints.contains(node) && !is_called(*node, names);
            (!is_twist && [thigh, shin].iter().all(is_inner)).then_some([thigh, shin, foot])
        };
        joints.iter().filter(|&&node| is_called(node, names)).filter_map(chain).collect()
    };
    let found = if of_vrm.is_empty() {
        let mut feet = by_name(&FEET);
        let height = |leg: &Leg| rest.position(leg[2]).dot(up);
        let low = feet.iter().map(height).fold(f64::INFINITY, f64::min);
        let is_low = |leg: &Leg| height(leg) - low <= MAX_HAND_HEIGHT * length(&rest, *leg);
        feet.extend(by_name(&HANDS).into_iter().filter(is_low));
        feet
    } else {
        of_vrm
    };
    let is_direct = |leg: &Leg| {
        leg.iter().all(|&node| skeleton.tree.nodes.get(node).is_some_and(|node| node.matrix.is_none()))
            && above(leg[2]) == Some(leg[1])
            && above(leg[1]) == Some(leg[0])
    };
    let has_length =
        |leg: &Leg| leg.windows(2).all(|w| rest.position(w[0]).distance(rest.position(w[1])) > 0.0);
    // A joint belongs to at most one leg. If a shin has two feet, use the first one.
    let mut taken = BTreeSet::new();
    let mut is_apart = |leg: &Leg| leg.iter().all(|&node| taken.insert(node));
    let legs = found.into_iter().filter(is_direct).filter(has_length);
    legs.filter(|leg| is_apart(leg)).take(MAX_LEGS).collect()
}

/// Locks planted feet in `after`, the reshaped document of `before`. `up`: up axis of the file.
///
/// # Errors
/// [`WriteError`] if the nodes of a document do not form a tree.
pub(super) fn lock(
    before: &GltfDocument,
    after: GltfDocument,
    up: DVec3,
) -> Result<(GltfDocument, Contacts), WriteError> {
    let (old, new) = (AnimatedNodes::new(before)?, AnimatedNodes::new(&after)?);
    let legs = legs(before, &old, up);
    let mut contacts = Contacts { legs: legs.len(), ..Contacts::default() };
    let mut edit = Edit::new(&after);
    for (number, (clip, new_clip)) in old.clips.iter().zip(&new.clips).enumerate() {
        if clip.seconds <= 0.0 || legs.is_empty() {
            continue;
        }
        let times = if clip.is_stepped() { keys(clip) } else { times(clip) };
        let rest = old.tree.posed([]);
        let lengths: Vec<f64> = legs.iter().map(|&leg| length(&rest, leg)).collect();
        // Keep only the ankles' paths. The poses of all samples can take gigabytes, so they are evaluated again below.
        let paths = |of: &AnimatedNodes, clip: &Clip| -> Vec<Vec<DVec3>> {
            let mut paths = vec![Vec::with_capacity(times.len()); legs.len()];
            for &t in &times {
                let pose = of.at(clip, t);
                paths.iter_mut().zip(&legs).for_each(|(path, leg)| path.push(pose.position(leg[2])));
            }
            paths
        };
        let (old_paths, new_paths) = (paths(&old, clip), paths(&new, new_clip));
        let is_loop = is_loop(&old, clip, &legs, &lengths, up);
        let spans = spans(&times, &old_paths, &lengths, up, is_loop);
        if spans.iter().all(Vec::is_empty) {
            continue;
        }
        let is_moving = ground_velocity(&times, &old_paths, &lengths, up) != DVec3::ZERO;
        let ground = if is_moving { median_velocity(&times, &new_paths, &spans, up) } else { DVec3::ZERO };
        let mut rotations: BTreeMap<usize, Vec<DQuat>> = BTreeMap::new();
        let by: Vec<Vec<DVec3>> = new_paths
            .iter()
            .zip(&spans)
            .map(|(path, spans)| corrections(&times, path, spans, (ground, is_loop), up))
            .collect();
        let mut held_paths = vec![Vec::with_capacity(times.len()); legs.len()];
        for (k, &t) in times.iter().enumerate() {
            let pose = new.at(new_clip, t);
            for ((leg, by), path) in legs.iter().zip(&by).zip(&mut held_paths) {
                let (turned, place) = reach(&pose, &new.parents, *leg, by[k]);
                path.push(place);
                for (node, rotation) in leg.iter().zip(turned) {
                    rotations.entry(*node).or_default().push(rotation);
                }
            }
        }
        for ((path, held), spans) in new_paths.iter().zip(&held_paths).zip(&spans) {
            contacts.n += spans.len() - usize::from(is_loop && is_over_seam(spans, path.len()));
            for &[from, to] in spans {
                for (slide, path) in contacts.slide.iter_mut().zip([path, held]) {
                    *slide +=
                        (from..to).map(|k| flat(step(&times, path, k, ground), up).length()).sum::<f64>();
                }
            }
        }
        let interpolation = if clip.is_stepped() { "STEP" } else { "LINEAR" };
        write(&mut edit, number, (&times, interpolation), &rotations);
    }
    contacts.slide = contacts.slide.map(|slide| slide / contacts.n.max(1) as f64);
    if contacts.n == 0 {
        return Ok((after, contacts));
    }
    Ok((edit.into_document()?, contacts))
}

/// Times of the keys of a clip, seconds, ascending, at most [`MAX_SAMPLES`].
fn keys(clip: &Clip) -> Vec<f64> {
    let seconds = f64::from(clip.seconds);
    let keys = clip.times().into_iter().map(f64::from);
    keys.filter(|t| (0.0..=seconds).contains(t)).take(MAX_SAMPLES).collect()
}

/// Computes the times of samples, seconds, ascending: equally spaced times, the keys of the clip, and both sides of its
/// jumps, at most [`MAX_SAMPLES`] of each kind. Within this limit, there are at least [`RATE`] equally spaced times per
/// second.
pub(super) fn times(clip: &Clip) -> Vec<f64> {
    let seconds = f64::from(clip.seconds);
    let n = ((seconds * RATE).ceil() as usize).clamp(2, MAX_SAMPLES);
    let equal = (0..=n).map(|k| seconds * k as f64 / n as f64);
    let sides = clip.jumps().into_iter().take(MAX_SAMPLES / 2).flat_map(|t| [t.next_down(), t]);
    // Each time, and whether it is a side of a jump.
    let mut all: Vec<(f64, bool)> = equal.chain(keys(clip)).map(|t| (t, false)).collect();
    all.extend(sides.map(|t| (f64::from(t), true)));
    all.retain(|(t, _)| (0.0..=seconds).contains(t));
    all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    // Merge times that differ only by rounding, except the two sides of a jump.
    all.dedup_by(|next, last| {
        let is_same = next.0 == last.0 || next.0 - last.0 < 1e-5 && !(next.1 && last.1);
        if is_same && next.1 {
            *last = *next;
        }
        is_same
    });
    all.into_iter().map(|(t, _)| t).collect()
}

/// Horizontal part of a vector.
fn flat(v: DVec3, up: DVec3) -> DVec3 {
    v - v.dot(up) * up
}

/// Motion from sample `k` to the next one, relative to the ground.
fn step(times: &[f64], path: &[DVec3], k: usize, ground: DVec3) -> DVec3 {
    path[k + 1] - path[k] - ground * (times[k + 1] - times[k])
}

/// Computes the horizontal velocity at each sample: the difference of the neighbouring positions divided by the time
/// between them.
fn velocities(times: &[f64], path: &[DVec3], up: DVec3) -> Vec<DVec3> {
    let last = path.len() - 1;
    let at = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        flat(path[b] - path[a], up) / (times[b] - times[a]).max(1e-6)
    };
    (0..=last).map(at).collect()
}

fn median(mut all: Vec<DVec3>) -> DVec3 {
    if all.is_empty() {
        return DVec3::ZERO;
    }
    let mut at = [0.0; 3];
    for (axis, at) in at.iter_mut().enumerate() {
        all.sort_unstable_by(|a, b| a[axis].total_cmp(&b[axis]));
        *at = all[all.len() / 2][axis];
    }
    DVec3::from_array(at)
}

/// Whether each sample is at most [`MAX_HEIGHT`] above the lowest sample of the path. `length`: leg length.
fn is_low(path: &[DVec3], length: f64, up: DVec3) -> Vec<bool> {
    let low = path.iter().map(|p| p.dot(up)).fold(f64::INFINITY, f64::min);
    path.iter().map(|p| p.dot(up) - low <= MAX_HEIGHT * length).collect()
}

/// Estimates the velocity of the ground in a clip: the per-axis median of the ankles' velocities at low samples
/// ([`is_low`]), or zero if the median is at most [`MAX_SPEED`] for the longest leg.
fn ground_velocity(times: &[f64], paths: &[Vec<DVec3>], lengths: &[f64], up: DVec3) -> DVec3 {
    let low = paths.iter().zip(lengths).flat_map(|(path, &length)| {
        velocities(times, path, up).into_iter().zip(is_low(path, length, up)).filter(|(_, low)| *low)
    });
    let found = median(low.map(|(velocity, _)| velocity).collect());
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    if found.length() > MAX_SPEED * longest { found } else { DVec3::ZERO }
}

/// Estimates the velocity of the ground: the per-axis median of the ankles' velocities during the contacts `spans`.
fn median_velocity(times: &[f64], paths: &[Vec<DVec3>], spans: &[Vec<[usize; 2]>], up: DVec3) -> DVec3 {
    let of = |(path, spans): (&Vec<DVec3>, &Vec<[usize; 2]>)| {
        let all = velocities(times, path, up);
        spans.iter().flat_map(|&[from, to]| all[from..=to].to_vec()).collect::<Vec<_>>()
    };
    median(paths.iter().zip(spans).flat_map(of).collect())
}

/// Finds the contacts of each foot with the ground, as pairs of first and last sample.
fn spans(
    times: &[f64],
    paths: &[Vec<DVec3>],
    lengths: &[f64],
    up: DVec3,
    is_loop: bool,
) -> Vec<Vec<[usize; 2]>> {
    let ground = ground_velocity(times, paths, lengths, up);
    let of_path = |(path, &length): (&Vec<DVec3>, &f64)| {
        let is_slow =
            velocities(times, path, up).into_iter().map(|v| (v - ground).length() <= MAX_SPEED * length);
        let planted: Vec<bool> =
            is_slow.zip(is_low(path, length, up)).map(|(slow, low)| slow && low).collect();
        let mut spans: Vec<[usize; 2]> = Vec::new();
        for k in (0..planted.len()).filter(|&k| planted[k]) {
            match spans.last_mut() {
                Some([_, last]) if k == *last + 1 || times[k] - times[*last] <= MAX_GAP => *last = k,
                _ => spans.push([k, k]),
            }
        }
        let seconds = |[from, to]: [usize; 2]| times[to] - times[from];
        let over_seam = [spans.first(), spans.last()].map(|span| span.map_or(0.0, |&span| seconds(span)));
        let is_long =
            is_loop && is_over_seam(&spans, path.len()) && over_seam.iter().sum::<f64>() >= MIN_CONTACT;
        let last = path.len() - 1;
        spans.retain(|&span| seconds(span) >= MIN_CONTACT || is_long && (span[0] == 0 || span[1] == last));
        spans
    };
    paths.iter().zip(lengths).map(of_path).collect()
}

/// Whether the last pose of the legs in a clip equals the first one, except for a translation along the ground.
fn is_loop(skeleton: &AnimatedNodes, clip: &Clip, legs: &[Leg], lengths: &[f64], up: DVec3) -> bool {
    let [first, last] = [0.0, f64::from(clip.seconds)].map(|t| skeleton.at(clip, t));
    let by = |node: usize| last.position(node) - first.position(node);
    let travel = legs.first().map_or(DVec3::ZERO, |leg| flat(by(leg[0]), up));
    let is_same =
        |(leg, &length): (&Leg, &f64)| leg.iter().all(|&node| by(node).distance(travel) <= MAX_SEAM * length);
    legs.iter().zip(lengths).all(is_same)
}

/// Whether the last contact of a loop of `n` samples continues in the first one.
fn is_over_seam(spans: &[[usize; 2]], n: usize) -> bool {
    matches!(spans, [first, .., last] if first[0] == 0 && last[1] + 1 == n)
}

/// Computes the horizontal correction of an ankle at each sample: during a contact, the vector to the mean position
/// relative to the ground; otherwise the sum of the corrections of the previous and the next contact, each faded out
/// within [`FADE`], or an interpolation between the two if the gap is shorter than two fades. `ground`: velocity of the
/// ground.
fn corrections(
    times: &[f64],
    path: &[DVec3],
    spans: &[[usize; 2]],
    (ground, is_loop): (DVec3, bool),
    up: DVec3,
) -> Vec<DVec3> {
    let mut by = vec![DVec3::ZERO; path.len()];
    let on_ground = |k: usize| path[k] - ground * times[k];
    let last = path.len() - 1;
    let mean = |spans: &[[usize; 2]], travel: DVec3| {
        let all = spans.iter().enumerate().flat_map(|(s, &[from, to])| (from..=to).map(move |k| (s, k)));
        let (sum, n) = all
            .fold((DVec3::ZERO, 0.0), |(sum, n), (s, k)| (sum + on_ground(k) - s as f64 * travel, n + 1.0));
        sum / n
    };
    let mut hold = |[from, to]: [usize; 2], at: DVec3| {
        (from..=to).for_each(|k| by[k] = flat(at - on_ground(k), up));
    };
    spans.iter().for_each(|&span| hold(span, mean(&[span], DVec3::ZERO)));
    if let [first, .., end] = *spans
        && is_loop
        && is_over_seam(spans, path.len())
    {
        let travel = on_ground(last) - on_ground(0);
        let at = mean(&[first, end], travel);
        hold(first, at);
        hold(end, at + travel);
    }
    let smooth = |u: f64| {
        let u = u.clamp(0.0, 1.0);
        u * u * (3.0 - 2.0 * u)
    };
    let mut ends: Vec<(f64, f64, DVec3, DVec3)> =
        spans.iter().map(|&[from, to]| (times[from], times[to], by[from], by[to])).collect();
    if let (true, Some(&first), Some(&end)) = (is_loop, ends.first(), ends.last()) {
        let seconds = times[last] - times[0];
        ends.insert(0, (end.0 - seconds, end.1 - seconds, end.2, end.3));
        ends.push((first.0 + seconds, first.1 + seconds, first.2, first.3));
    }
    for k in 0..path.len() {
        if spans.iter().any(|&[from, to]| (from..=to).contains(&k)) {
            continue;
        }
        let t = times[k];
        let before = ends.iter().rev().find(|end| end.1 <= t);
        let next = ends.iter().find(|end| end.0 >= t);
        let before = before.map(|end| (t - end.1, end.3));
        let next = next.map(|end| (end.0 - t, end.2));
        by[k] = match (before, next) {
            (Some((a, from)), Some((b, to))) if a + b < 2.0 * FADE => {
                from.lerp(to, smooth(a / (a + b).max(1e-9)))
            }
            _ => {
                let share = |end: Option<(f64, DVec3)>| {
                    end.map_or(DVec3::ZERO, |(t, by)| by * (1.0 - smooth(t / FADE)))
                };
                share(before) + share(next)
            }
        };
    }
    by
}

/// The rotation in `space` that is `turn` in world space. A mirrored space reverses its direction. Not finite if the space
/// is singular.
fn turn_within(space: DMat4, turn: DQuat) -> DQuat {
    let space = DMat3::from_mat4(space);
    let turn = rotation(space.inverse() * DMat3::from_quat(turn) * space);
    turn.map_or(DQuat::NAN, |turn| DQuat::from_mat3(&turn))
}

/// Computes the local rotations of a leg whose ankle moves by `by`, and the ankle's position.
fn reach(pose: &PosedNodes, parents: &[Option<usize>], leg: Leg, by: DVec3) -> ([DQuat; 3], DVec3) {
    let own = leg.map(|node| {
        let r = pose.nodes[node].rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r.0.map(f64::from));
        quaternion(&r)
    });
    let [hip, knee, ankle] = leg.map(|node| pose.position(node));
    let (thigh, shin) = ((knee - hip).length(), (ankle - knee).length());
    if by.length() <= 1e-9 * (thigh + shin) || thigh.min(shin) <= 0.0 {
        return (own, ankle);
    }
    let to = ankle + by - hip;
    let most = (MAX_REACH * (thigh + shin)).max((ankle - hip).length());
    let reach = to.length().min(most).max((thigh - shin).abs().max(1e-6 * thigh));
    let along = to.normalize_or((ankle - hip).normalize_or_zero());
    let first = DQuat::from_rotation_arc((ankle - hip).normalize_or(along), along);
    // The knee stays in the plane of the leg.
    let side = first * (knee - hip);
    let side = (side - side.dot(along) * along).normalize_or(along.any_orthonormal_vector());
    let cos = ((thigh * thigh + reach * reach - shin * shin) / (2.0 * thigh * reach)).clamp(-1.0, 1.0);
    let bent = hip + thigh * (cos * along + (1.0 - cos * cos).sqrt() * side);
    let end = hip + reach * along;
    let upper =
        DQuat::from_rotation_arc((first * (knee - hip)).normalize(), (bent - hip).normalize()) * first;
    let lower =
        DQuat::from_rotation_arc((upper * (ankle - knee)).normalize(), (end - bent).normalize()) * upper;
    let above = parents[leg[0]].map_or(DMat4::IDENTITY, |parent| pose.world[parent]);
    let turned = [
        turn_within(above, upper) * own[0],
        turn_within(pose.world[leg[0]], upper.inverse() * lower) * own[1],
        turn_within(pose.world[leg[1]], lower.inverse()) * own[2],
    ];
    if !turned.iter().all(|q| q.is_finite()) {
        return (own, ankle);
    }
    let turned = turned.map(DQuat::normalize);
    let reached = leg.iter().zip(turned).fold(above, |above, (&node, turn)| {
        let mut node = pose.nodes[node].clone();
        node.rotation = Some(UnitQuaternion(turn.as_quat().to_array()));
        above * local(&node)
    });
    (turned, reached.w_axis.truncate())
}

/// Replaces the rotation tracks of a clip.
fn write(
    edit: &mut Edit<'_>,
    clip: usize,
    (times, interpolation): (&[f64], &str),
    rotations: &BTreeMap<usize, Vec<DQuat>>,
) {
    let seconds: Vec<[f32; 1]> = times.iter().map(|&t| [t as f32]).collect();
    let input = edit.write(None, &seconds, false, true);
    for (&node, all) in rotations {
        let mut last = DQuat::IDENTITY;
        let values: Vec<[f32; 4]> = all
            .iter()
            .map(|&q| {
                // `q` and `-q` are the same rotation: take the sign that is nearer to the previous key.
                last = if last.dot(q) < 0.0 { -q } else { q };
                last.as_quat().to_array()
            })
            .collect();
        let output = edit.write(None, &values, false, false);
        let animation = &mut edit.json["animations"][clip];
        let sampler = push(
            animation,
            "samplers",
            json!({ "input": input, "output": output, "interpolation": interpolation }),
        );
        let channels = animation["channels"].as_array_mut();
        let own = channels
            .into_iter()
            .flatten()
            .find(|channel| channel_target(channel) == Some(ChannelTarget::Rotation(node)));
        match own {
            Some(channel) => channel["sampler"] = sampler.into(),
            None => {
                let target = json!({ "node": node, "path": "rotation" });
                push(animation, "channels", json!({ "sampler": sampler, "target": target }));
            }
        }
    }
}
