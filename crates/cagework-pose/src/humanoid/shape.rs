//! Humanoid bones by the shape of the skeleton: two chains down, two chains to the sides, and a head.

use cagework_core::rig::Rig;
use glam::DVec3;

use super::{Bone, Joints, N_BONES, ancestors};

/// Tolerance of mirror images and of equal heights, as a fraction of the skeleton's size.
const EQUAL: f64 = 0.06;
/// Joints closer than this to the one above are left out: twists and doubled joints. Fraction of the skeleton's size.
const CLOSE: f64 = 0.02;
/// Least length of a limb, as a fraction of the skeleton's size.
const LIMB: f64 = 0.15;
/// A first bone shorter than this share of the next one is a collarbone.
const COLLARBONE: f64 = 0.7;
/// The ankle is the first joint below this share of the leg's height.
const ANKLE: f64 = 0.25;

/// A skeleton as a tree.
struct Tree {
    at: Vec<DVec3>,
    parents: Vec<Option<u32>>,
    children: Vec<Vec<usize>>,
    /// Length of the diagonal of the joints' box, object units.
    size: f64,
}

impl Tree {
    fn of(rig: &Rig) -> Self {
        let at: Vec<DVec3> = rig.joints.iter().map(|joint| joint.at.as_dvec3()).collect();
        let mut children = vec![Vec::new(); at.len()];
        for (k, joint) in rig.joints.iter().enumerate() {
            if let Some(parent) = joint.parent {
                children[parent as usize].push(k);
            }
        }
        let low = at.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = at.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let parents = rig.joints.iter().map(|joint| joint.parent).collect();
        Self { at, parents, children, size: low.distance(high) }
    }

    /// A joint and all joints below it.
    fn below(&self, joint: usize) -> Vec<usize> {
        let mut all = vec![joint];
        let mut next = 0;
        while let Some(&joint) = all.get(next) {
            all.extend(&self.children[joint]);
            next += 1;
        }
        all
    }

    /// The joints from `top` down to `end`, without those that are close to the one above.
    fn path(&self, rig: &Rig, top: usize, end: usize) -> Vec<usize> {
        let mut up: Vec<usize> = Vec::new();
        for joint in ancestors(rig, end) {
            up.push(joint);
            if joint == top {
                break;
            }
        }
        let mut path: Vec<usize> = Vec::new();
        for joint in up.into_iter().rev() {
            let is_close = |last: &usize| self.at[*last].distance(self.at[joint]) < CLOSE * self.size;
            if !path.last().is_some_and(is_close) {
                path.push(joint);
            }
        }
        path
    }

    /// The joint below `top` for which `measure` is largest.
    fn extreme(&self, top: usize, measure: impl Fn(DVec3) -> f64) -> usize {
        let mut best = top;
        for joint in self.below(top) {
            if measure(self.at[joint]) > measure(self.at[best]) {
                best = joint;
            }
        }
        best
    }
}

/// Finds the bones of a skeleton with y up. `None` if it has no two legs, two arms and a head.
pub(super) fn find(rig: &Rig) -> Option<Joints> {
    let tree = Tree::of(rig);
    let close = EQUAL * tree.size;
    let legs = legs(&tree, rig)?;
    let [left, _] = &legs;
    let hips = tree.parents[left[0]]? as usize;
    let across = DVec3 { y: 0.0, ..tree.at[legs[0][0]] - tree.at[legs[1][0]] }.normalize_or_zero();
    let middle = tree.at[legs[0][0]].midpoint(tree.at[legs[1][0]]);
    let aside = |p: DVec3| (p - middle).dot(across);

    // Arms: the pair of mirrored chains above the hips that reaches farthest to the sides.
    let mut arms: Option<(f64, usize, [usize; 2])> = None;
    for joint in tree.below(hips) {
        for (k, &a) in tree.children[joint].iter().enumerate() {
            for &b in &tree.children[joint][k + 1..] {
                let [a, b] = if aside(tree.at[a]) > aside(tree.at[b]) { [a, b] } else { [b, a] };
                let ends = [tree.extreme(a, aside), tree.extreme(b, |p| -aside(p))];
                let [p, q] = ends.map(|end| tree.at[end]);
                let is_mirrored = (aside(p) + aside(q)).abs() < close && (p.y - q.y).abs() < close;
                let is_arm = aside(p) > close && tree.at[a].distance(p) > LIMB * tree.size;
                let is_leg = legs.iter().any(|leg| tree.below(a).contains(&leg[0]));
                if is_mirrored && is_arm && !is_leg && arms.is_none_or(|(reach, ..)| aside(p) > reach) {
                    arms = Some((aside(p), joint, [a, b]));
                }
            }
        }
    }
    let (_, chest, arms) = arms?;

    // Head: along the middle, upwards from where the arms leave.
    let is_middle = |joint: usize| aside(tree.at[joint]).abs() < close;
    let top = |joint: usize| tree.at[tree.extreme(joint, |p| p.y)].y;
    let mut above = Vec::new();
    let mut at = chest;
    while let Some(&next) = tree.children[at]
        .iter()
        .filter(|joint| is_middle(**joint) && !arms.contains(joint))
        .max_by(|a, b| top(**a).total_cmp(&top(**b)))
    {
        above.push(next);
        at = next;
    }
    let (neck, head) = match above.as_slice() {
        [] => return None,
        [head] => (None, *head),
        [neck, head, ..] => (Some(*neck), *head),
    };

    let mut joints: Joints = [None; N_BONES];
    let mut set = |bone: Bone, joint: usize| joints[bone as usize] = Some(joint as u32);
    set(Bone::Hips, hips);
    set(Bone::Head, head);
    if let Some(neck) = neck {
        set(Bone::Neck, neck);
    }
    let spine = tree.path(rig, hips, chest);
    if let [_, spine, ..] = spine.as_slice() {
        set(Bone::Spine, *spine);
        if *spine != chest {
            set(Bone::Chest, chest);
        }
    }
    // Toes point forwards; left is the figure's own left.
    let toes = legs.iter().filter_map(|leg| Some(tree.at[*leg.get(3)?] - tree.at[leg[2]]));
    let forward = DVec3 { y: 0.0, ..toes.sum() };
    let forward = if forward == DVec3::ZERO { DVec3::Z } else { forward };
    let is_left = |p: DVec3| (p - middle).dot(DVec3::Y.cross(forward)) > 0.0;
    for leg in &legs {
        let side = usize::from(!is_left(tree.at[leg[0]]));
        set([Bone::LeftUpperLeg, Bone::RightUpperLeg][side], leg[0]);
        set([Bone::LeftLowerLeg, Bone::RightLowerLeg][side], leg[1]);
        set([Bone::LeftFoot, Bone::RightFoot][side], leg[2]);
        if let Some(toes) = leg.get(3) {
            set([Bone::LeftToes, Bone::RightToes][side], *toes);
        }
    }
    for (top, sign) in arms.into_iter().zip([1.0, -1.0]) {
        let arm = arm(&tree, rig, top, |p| sign * aside(p))?;
        let side = usize::from(!is_left(tree.at[arm[2]]));
        set([Bone::LeftUpperArm, Bone::RightUpperArm][side], arm[0]);
        set([Bone::LeftLowerArm, Bone::RightLowerArm][side], arm[1]);
        set([Bone::LeftHand, Bone::RightHand][side], arm[2]);
        if arm[0] != top {
            set([Bone::LeftShoulder, Bone::RightShoulder][side], top);
        }
    }
    Some(joints)
}

/// Thigh, shin, foot and, if there is one, toe joint of both legs: of all mirrored pairs of chains that reach the
/// ground, the pair that begins highest.
fn legs(tree: &Tree, rig: &Rig) -> Option<[Vec<usize>; 2]> {
    let close = EQUAL * tree.size;
    let ground = tree.at.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let mut best: Option<(f64, [Vec<usize>; 2])> = None;
    for siblings in &tree.children {
        let legs: Vec<Vec<usize>> = siblings.iter().filter_map(|&top| leg(tree, rig, top, ground)).collect();
        for (k, a) in legs.iter().enumerate() {
            for b in &legs[k + 1..] {
                let [p, q] = [tree.at[a[0]], tree.at[b[0]]];
                let is_level = (p.y - q.y).abs() < close && (tree.at[a[2]].y - tree.at[b[2]].y).abs() < close;
                let is_apart = DVec3 { y: 0.0, ..p - q }.length() > 0.5 * CLOSE * tree.size;
                if is_level && is_apart && best.as_ref().is_none_or(|(height, _)| p.y > *height) {
                    best = Some((p.y, [a.clone(), b.clone()]));
                }
            }
        }
    }
    best.map(|(_, legs)| legs)
}

/// Joints of a leg whose chain begins at `top`.
fn leg(tree: &Tree, rig: &Rig, top: usize, ground: f64) -> Option<Vec<usize>> {
    let path = tree.path(rig, top, tree.extreme(top, |p| -p.y));
    let height = tree.at[*path.first()?].y - ground;
    let low = tree.at[*path.last()?].y - ground;
    if height < LIMB * tree.size || low > ANKLE * height {
        return None;
    }
    let ankle = path.iter().position(|joint| tree.at[*joint].y - ground < ANKLE * height)?;
    let above = path.get(..ankle)?;
    let from_middle = |joint: usize| (tree.at[joint].y - ground - 0.5 * height).abs();
    let knee = (1..above.len())
        .min_by(|a, b| from_middle(above[*a]).total_cmp(&from_middle(above[*b])))
        .filter(|knee| from_middle(above[*knee]) < 0.3 * height)?;
    // A chain may begin with a joint of the pelvis at the height of the thigh.
    let thigh = above[..knee].iter().rev().find(|joint| tree.at[**joint].y - ground > 0.85 * height)?;
    let mut leg = vec![*thigh, above[knee], path[ankle]];
    let toe = path.get(ankle + 1).copied().or_else(|| tree.children[path[ankle]].first().copied());
    leg.extend(toe);
    Some(leg)
}

/// Arm, forearm and hand of a chain that begins at `top`. The hand is where fingers branch off. Without fingers it is the
/// third joint, or the fourth if the first bone is short: a collarbone.
fn arm(tree: &Tree, rig: &Rig, top: usize, aside: impl Fn(DVec3) -> f64) -> Option<[usize; 3]> {
    let path = tree.path(rig, top, tree.extreme(top, aside));
    let is_long =
        |joint: &usize| tree.at[tree.extreme(*joint, |p| p.distance(tree.at[*joint]))] != tree.at[*joint];
    let branches = |joint: usize| tree.children[joint].iter().filter(|child| is_long(child)).count() >= 2;
    let fingers = (2..path.len()).find(|&k| branches(path[k]));
    let length = |k: usize| Some(tree.at[*path.get(k)?].distance(tree.at[*path.get(k + 1)?]));
    let is_collarbone = path.len() > 3 && length(0) < length(1).map(|length| COLLARBONE * length);
    let hand = fingers.unwrap_or(if is_collarbone { 3 } else { 2 });
    let [arm, forearm, hand] = path.get(hand.checked_sub(2)?..=hand)? else { return None };
    Some([*arm, *forearm, *hand])
}
