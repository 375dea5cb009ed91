//! Chains of a rigged model.

use cagework_core::nearest::KdTree;
use cagework_core::rig::Rig;
use glam::{DVec3, Vec3};

use super::mirror::MirrorPlane;
use super::tree::JointTree;
use super::{Chain, Skeleton, SkeletonError};

/// Limit on the joints that move vertices. Rigs of figures have up to a few hundred.
pub(super) const MAX_JOINTS: usize = 1024;

/// Side branches whose vertices reach less far than this share of the diagonal (fingers, eyes, hair) merge into their
/// parent.
const SMALL_BRANCH: f64 = 0.13;

/// Two joints with the same parent are a pair if each is this close to the image of the other, as a share of the
/// distance between the joint and its own image.
const MAX_TWIN_ERROR: f64 = 0.1;

/// Cosine between a leg and the spine below which the model is a biped.
const BIPED_COSINE: f64 = -0.4;

/// Vertices of the last joint that are further from it than this share of them point to the tip.
const TIP_QUANTILE: f64 = 0.85;
/// The tip continues the last bone if the cosine between both is larger than this.
const TIP_COSINE: f64 = 0.7;
/// The tip continues the last bone, too, if the vertices reach this share as far back as forward: a shield.
const TWO_SIDED: f64 = 0.8;
/// Tips shorter than this share of the diagonal continue the last bone if the cosine is below [`SHORT_TIP_COSINE`].
const SHORT_TIP: f64 = 0.06;
const SHORT_TIP_COSINE: f64 = 0.5;

/// Joints of a limb closer than this share of the diagonal to the previous joint are left out.
const MIN_BONE: f64 = 0.012;

struct Figure {
    tree: JointTree,
    /// Positions of the vertices, object units.
    points: Vec<DVec3>,
    plane: MirrorPlane,
    /// Whether a chain contains the joint already.
    is_used: Vec<bool>,
}

/// See [`Skeleton::of_rig`].
pub(super) fn of_rig(positions: &[Vec3], rig: &Rig) -> Result<Skeleton, SkeletonError> {
    let weights = weights_of(positions, rig)?;
    let points: Vec<DVec3> = positions.iter().map(|p| p.as_dvec3()).collect();
    let top = top_joints(positions, &weights);
    let mut own = vec![Vec::new(); rig.joints.len()];
    for (joint, v) in top.iter().zip(0..) {
        if let Some(joint) = joint {
            own[*joint].push(v);
        }
    }
    let mut tree = JointTree::new(rig, own);
    let diagonal = f64::from(cagework_core::Bounds::around(positions).unwrap_or_default().diagonal());
    let joints = tree.drop_helpers(diagonal);
    if joints > MAX_JOINTS {
        return Err(SkeletonError::TooManyJoints { joints });
    }
    let main = tree.join(&weights, &points).ok_or(SkeletonError::NoWeights { joints: rig.joints.len() })?;
    for joint in tree.below(main) {
        merge_small_branches(&mut tree, &points, joint, SMALL_BRANCH * diagonal);
    }
    for joint in 0..tree.label.len() {
        if tree.label[joint] == joint && !tree.is_alive[joint] {
            tree.label[joint] = main;
        }
    }
    let plane = MirrorPlane::of(positions, &tree.joints());
    let is_used = vec![false; tree.at.len()];
    let mut figure = Figure { tree, points, plane, is_used };
    let trunk = figure.trunk(main);
    let (mut chains, is_biped) = figure.chains(&trunk, rig);
    plane.pair_up(&mut chains);
    let mut chain_of_joint = vec![0; rig.joints.len()];
    for (k, chain) in (0..).zip(&chains) {
        for &bone in &chain.own_bones {
            chain_of_joint[bone as usize] = k;
        }
    }
    let bone_of: Vec<usize> = top.iter().map(|joint| joint.map_or(main, |j| figure.tree.label[j])).collect();
    let mut skeleton = Skeleton {
        chains,
        chain_of: bone_of.iter().map(|&bone| chain_of_joint[bone]).collect(),
        bone_of: bone_of.iter().map(|&bone| bone as u32).collect(),
        axis: plane.axis,
        offset: plane.offset,
        is_symmetric: plane.is_symmetric,
        is_biped,
        is_rigged: true,
    };
    plane.mark_symmetry(&mut skeleton, positions);
    Ok(skeleton)
}

/// Checks a rig and returns the weights of each of its vertices by joint, ascending, one per joint.
fn weights_of(positions: &[Vec3], rig: &Rig) -> Result<Vec<Vec<(usize, f64)>>, SkeletonError> {
    let n = rig.joints.len();
    let ranges: Vec<_> = rig.first.windows(2).map(|pair| pair[0] as usize..pair[1] as usize).collect();
    if ranges.len() > positions.len() {
        return Err(SkeletonError::Rig("it has more vertices than the model"));
    }
    if rig.joints.iter().any(|joint| !joint.at.is_finite()) {
        return Err(SkeletonError::Rig("the position of a joint is not finite"));
    }
    if has_cycle(rig) {
        return Err(SkeletonError::Rig("the parents of the joints do not form a tree"));
    }
    let weights = |range: std::ops::Range<usize>| {
        let mut weights: Vec<(usize, f64)> = Vec::new();
        for &(joint, weight) in rig.influences.get(range)? {
            let joint = joint as usize;
            if joint >= n || !weight.is_finite() {
                return None;
            }
            match weights.iter_mut().find(|(other, _)| *other == joint) {
                Some((_, sum)) => *sum += f64::from(weight),
                None => weights.push((joint, f64::from(weight))),
            }
        }
        weights.sort_unstable_by_key(|&(joint, _)| joint);
        Some(weights)
    };
    let all: Option<Vec<_>> = ranges.into_iter().map(weights).collect();
    all.ok_or(SkeletonError::Rig("an influence has no joint, or its weight is not finite"))
}

/// Whether a joint is its own ancestor, or its parent does not exist.
fn has_cycle(rig: &Rig) -> bool {
    // 0: not visited; otherwise the number of the walk that visited the joint.
    let mut visited = vec![0_usize; rig.joints.len()];
    for start in 0..rig.joints.len() {
        let mut next = Some(start);
        while let Some(joint) = next {
            match visited.get_mut(joint) {
                None => return true,
                Some(walk) if *walk == start + 1 => return true,
                Some(walk) if *walk > 0 => break,
                Some(walk) => *walk = start + 1,
            }
            next = rig.joints[joint].parent.map(|parent| parent as usize);
        }
    }
    false
}

/// Returns the joint with the largest weight of each vertex. Vertices without weights have the joint of the nearest
/// vertex with weights; `None` if there is none.
fn top_joints(positions: &[Vec3], weights: &[Vec<(usize, f64)>]) -> Vec<Option<usize>> {
    let top = |weights: &Vec<(usize, f64)>| {
        let largest = weights.iter().copied().rev().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (weights.iter().map(|(_, weight)| weight).sum::<f64>() > 1e-6).then_some(largest.0)
    };
    let mut all: Vec<Option<usize>> = weights.iter().map(top).collect();
    all.resize(positions.len(), None);
    if all.contains(&None) {
        let with = (0..all.len() as u32).filter(|&v| all[v as usize].is_some()).collect();
        let tree = KdTree::new(positions, with);
        let nearest =
            |(p, own): (&Vec3, &Option<usize>)| own.or_else(|| all[tree.find(*p, f32::INFINITY)?.0 as usize]);
        all = positions.iter().zip(&all).map(nearest).collect();
    }
    all
}

/// Distance of the furthest vertex at a joint or below it from the joint.
fn reach(tree: &JointTree, points: &[DVec3], joint: usize) -> f64 {
    tree.vertices_below(joint).map(|v| points[v as usize].distance(tree.at[joint])).fold(0.0, f64::max)
}

/// Whether a joint lies on the mirror plane, and is not one of a pair beside it.
fn is_mid(tree: &JointTree, plane: &MirrorPlane, joint: usize) -> bool {
    let at = tree.at[joint];
    let is_twin = |&other: &usize| {
        let distance = plane.image(tree.at[other]).distance(at);
        other != joint && distance < MAX_TWIN_ERROR * at.distance(plane.image(at))
    };
    plane.has(at) && !tree.parent[joint].is_some_and(|parent| tree.children[parent].iter().any(is_twin))
}

/// Merges the children of a joint that reach less far than `limit` into it, unless it has only one child.
fn merge_small_branches(tree: &mut JointTree, points: &[DVec3], joint: usize, limit: f64) {
    if !tree.is_alive[joint] || tree.children[joint].len() < 2 {
        return;
    }
    for child in tree.children[joint].clone() {
        if reach(tree, points, child) < limit {
            tree.absorb(child, joint);
        }
    }
}

impl Figure {
    fn reach(&self, joint: usize) -> f64 {
        reach(&self.tree, &self.points, joint)
    }

    fn is_mid(&self, joint: usize) -> bool {
        is_mid(&self.tree, &self.plane, joint)
    }

    /// Finds the joints of the trunk: the longest path of joints on the mirror plane that goes down from `main`.
    fn trunk(&mut self, main: usize) -> Vec<usize> {
        let mut trunk = self.longest_path(main);
        while let [first, _, _, ..] = trunk[..]
            && self.tree.vertices_of(first).is_empty()
            && self.tree.children[first].len() == 1
        {
            trunk.remove(0);
        }
        // A root that lies beyond the second joint, so that the path runs back (zigzag), merges into that joint.
        while let [first, second, .., last] = trunk[..]
            && trunk.len() > 2
        {
            let tree = &mut self.tree;
            let at = |joint: usize| tree.at[joint];
            if (at(second) - at(first)).dot(at(last) - at(second)) >= 0.0 {
                break;
            }
            tree.parent[second] = tree.parent[first];
            for parent in tree.parent.iter_mut().filter(|parent| **parent == Some(first)) {
                *parent = Some(second);
            }
            tree.parent[first] = Some(second);
            for label in tree.label.iter_mut().filter(|label| **label == first) {
                *label = second;
            }
            tree.is_alive[first] = false;
            tree.link();
            trunk.remove(0);
        }
        trunk
    }

    fn longest_path(&self, main: usize) -> Vec<usize> {
        let tree = &self.tree;
        // For each joint: the next joint of its path, the path's length, and the reach of its last joint.
        let mut best = vec![(None, 0.0, 0.0); tree.at.len()];
        for &joint in tree.below(main).iter().rev() {
            let mut path = (None, 0.0, 0.0);
            if tree.children[joint].is_empty() {
                path.2 = self.reach_of(joint);
            }
            let mut longest = 0.0;
            for &child in tree.children[joint].iter().filter(|&&child| self.is_mid(child)) {
                let length = tree.at[child].distance(tree.at[joint]) + best[child].1;
                if length + best[child].2 > longest {
                    longest = length + best[child].2;
                    path = (Some(child), length, best[child].2);
                }
            }
            best[joint] = path;
        }
        std::iter::successors(Some(main), |&joint| best[joint].0).collect()
    }

    /// Distance of the furthest vertex of a joint from it.
    fn reach_of(&self, joint: usize) -> f64 {
        let of = |v: u32| self.points[v as usize].distance(self.tree.at[joint]);
        self.tree.vertices_of(joint).into_iter().map(of).fold(0.0, f64::max)
    }

    /// Builds all chains, the trunk first. Returns whether the figure is a biped, too.
    fn chains(&mut self, trunk: &[usize], rig: &Rig) -> (Vec<Chain>, bool) {
        let diagonal = self.plane.diagonal;
        let at = |joint: usize| self.tree.at[joint];
        let [hips, last] = [trunk[0], trunk[trunk.len() - 1]];
        let spine = (at(trunk[3.min(trunk.len() - 1)]) - at(hips)).normalize_or_zero();
        let near_hips = trunk.iter().take(2).flat_map(|&joint| &self.tree.children[joint]);
        let mut legs = near_hips.filter(|leg| !trunk.contains(leg) && !self.is_mid(**leg));
        let is_biped = legs.any(|&leg| {
            let (mut sum, mut n) = (DVec3::ZERO, 0.0);
            for v in self.tree.vertices_below(leg) {
                sum += self.points[v as usize] - at(leg);
                n += 1.0;
            }
            n > 0.0 && sum.normalize_or_zero().dot(spine) < BIPED_COSINE
        });
        // The trunk goes on behind the hips as far as their vertices do.
        let own = self.tree.vertices_of(hips);
        let along = own.iter().map(|&v| (self.points[v as usize] - at(hips)).dot(spine));
        let low = along.reduce(f64::min).map_or(-0.03 * diagonal, |low| low.min(-0.01 * diagonal));
        // A trunk of one joint has no direction: use up, or another axis if the mirror plane is horizontal.
        let default = if self.plane.axis == 1 { DVec3::Z } else { DVec3::Y };
        let back = if spine == DVec3::ZERO { default * low } else { spine * low };
        let before = if let [.., before, _] = *trunk { at(before) } else { at(hips) + back };
        let mut joints = vec![at(hips) + back];
        joints.extend(trunk.iter().map(|&joint| at(joint)));
        joints.push(self.tip(last, before));
        let bones = |path: &[usize]| path.iter().map(|&joint| joint as u32).collect::<Vec<u32>>();
        let mut chains = vec![Chain {
            name: "trunk".to_owned(),
            at: joints,
            bones: bones(&[&[hips], trunk].concat()),
            own_bones: bones(trunk),
            parent: None,
            is_midline: true,
            mirror: None,
            is_symmetric: false,
        }];
        for &joint in trunk {
            self.is_used[joint] = true;
        }
        // First joint of each limb, chain and joint from which it branches; the next one is last.
        let mut waiting = self.branches(trunk, 0);
        while let Some((first, parent, branch)) = waiting.pop() {
            let path = self.follow(first);
            for &joint in &path {
                self.is_used[joint] = true;
            }
            let number = chains.len();
            waiting.extend(self.branches(&path, number));
            let before = self.tree.at[branch];
            let mut joints = vec![before];
            joints.extend(path.iter().map(|&joint| self.tree.at[joint]));
            let second = if let [.., second, _] = path[..] { self.tree.at[second] } else { before };
            joints.push(self.tip(path[path.len() - 1], second));
            let keep = apart(&joints, MIN_BONE * diagonal);
            // The bone of a segment is the joint at its start; the first segment belongs to the limb's first joint.
            let bone_before = |&k: &usize| path[k.saturating_sub(2)];
            let at: Vec<DVec3> = keep.iter().map(|&k| joints[k]).collect();
            chains.push(Chain {
                name: rig.joints[first].name.clone(),
                bones: bones(&keep[1..].iter().map(bone_before).collect::<Vec<_>>()),
                own_bones: bones(&path),
                parent: Some(parent),
                is_midline: at.iter().all(|&p| self.plane.has(p)),
                at,
                mirror: None,
                is_symmetric: false,
            });
        }
        (chains, is_biped)
    }

    /// Lists the unused children of the joints of a chain, the first one last: child, chain, joint.
    fn branches(&self, path: &[usize], chain: usize) -> Vec<(usize, usize, usize)> {
        let of = |&joint: &usize| self.tree.children[joint].iter().map(move |&child| (child, chain, joint));
        let mut all: Vec<_> = path.iter().flat_map(of).filter(|branch| !self.is_used[branch.0]).collect();
        all.reverse();
        all
    }

    /// Follows a limb from its first joint: at each joint, the child that reaches furthest.
    fn follow(&self, first: usize) -> Vec<usize> {
        let furthest = |&joint: &usize| {
            let children = self.tree.children[joint].iter().filter(|&&child| !self.is_used[child]);
            children.copied().rev().max_by(|&a, &b| self.reach(a).total_cmp(&self.reach(b)))
        };
        std::iter::successors(Some(first), furthest).collect()
    }

    /// Computes the tip of a chain that ends with a bone from `before` to `joint`.
    fn tip(&self, joint: usize, before: DVec3) -> DVec3 {
        let (diagonal, at) = (self.plane.diagonal, self.tree.at[joint]);
        let bone = (at - before).try_normalize().unwrap_or(DVec3::Y);
        let own: Vec<DVec3> =
            self.tree.vertices_of(joint).into_iter().map(|v| self.points[v as usize] - at).collect();
        if own.len() < 3 {
            return at + 0.02 * diagonal * bone;
        }
        let mut distances: Vec<f64> = own.iter().map(|p| p.length()).collect();
        distances.sort_unstable_by(f64::total_cmp);
        let place = TIP_QUANTILE * (distances.len() - 1) as f64;
        let [low, high] = [place.floor(), place.ceil()].map(|k| distances[k as usize]);
        let limit = low + (high - low) * place.fract();
        let far: DVec3 = own.iter().filter(|p| p.length() >= limit).sum();
        let mut way = far.normalize_or_zero();
        let along = |way: DVec3| own.iter().map(move |p| p.dot(way)).fold(f64::NEG_INFINITY, f64::max);
        let (forward, back) = (along(way), along(-way));
        let cosine = way.dot(bone);
        let is_short = forward < SHORT_TIP * diagonal && cosine < SHORT_TIP_COSINE;
        if cosine > TIP_COSINE || back > TWO_SIDED * forward || is_short {
            way = bone;
        }
        at + way * along(way).max(0.01 * diagonal)
    }
}

/// Indices of the joints that are further than `limit` from the previous one that is kept. The first and the last joint
/// are kept.
fn apart(joints: &[DVec3], limit: f64) -> Vec<usize> {
    let mut keep = vec![0];
    for k in 1..joints.len() {
        let is_last = k + 1 == joints.len();
        let is_far = joints[k].distance(joints[keep[keep.len() - 1]]) > limit;
        if is_last && !is_far && keep.len() > 1 {
            keep.pop();
        }
        if is_far || is_last {
            keep.push(k);
        }
    }
    keep
}
