//! The joints of a rig as one tree, with the vertices of each joint.

use std::collections::BTreeMap;

use cagework_core::rig::Rig;
use glam::DVec3;

/// A root without vertices is kept if its largest child is at most this far from it, as a share of the diagonal: hips
/// without skin.
const HIPS_DISTANCE: f64 = 0.15;

/// Smallest sum of shared weights that joins a subtree to a bone.
const MIN_SHARE: f64 = 1e-3;

/// The joints that move vertices.
#[derive(Debug)]
pub(super) struct JointTree {
    /// Position of each joint, object units. `[n_joints]`
    pub(super) at: Vec<DVec3>,
    pub(super) parent: Vec<Option<usize>>,
    /// Children of each joint that are in use, ascending.
    pub(super) children: Vec<Vec<usize>>,
    /// Whether the joint is in use: it moves vertices itself or through its children, and is not merged.
    pub(super) is_alive: Vec<bool>,
    /// Vertices with their largest weight at each joint, ascending.
    pub(super) own: Vec<Vec<u32>>,
    /// Joint into which each joint was merged.
    pub(super) label: Vec<usize>,
}

impl JointTree {
    /// Creates the tree. `own`: vertices of each joint. The parents must not form a cycle.
    pub(super) fn new(rig: &Rig, own: Vec<Vec<u32>>) -> Self {
        let n = rig.joints.len();
        let mut tree = Self {
            at: rig.joints.iter().map(|joint| joint.at.as_dvec3()).collect(),
            parent: rig.joints.iter().map(|joint| joint.parent.map(|p| p as usize)).collect(),
            children: Vec::new(),
            is_alive: vec![true; n],
            own,
            label: (0..n).collect(),
        };
        tree.link();
        tree
    }

    /// Lists the children of all joints.
    pub(super) fn link(&mut self) {
        self.children = vec![Vec::new(); self.at.len()];
        for joint in (0..self.at.len()).filter(|&joint| self.is_alive[joint]) {
            if let Some(parent) = self.parent[joint] {
                self.children[parent].push(joint);
            }
        }
    }

    /// Positions of the joints that are in use.
    pub(super) fn joints(&self) -> Vec<DVec3> {
        (0..self.at.len()).filter(|&joint| self.is_alive[joint]).map(|joint| self.at[joint]).collect()
    }

    fn roots(&self) -> Vec<usize> {
        (0..self.at.len()).filter(|&joint| self.is_alive[joint] && self.parent[joint].is_none()).collect()
    }

    /// Lists a joint and all joints below it, parents first.
    pub(super) fn below(&self, joint: usize) -> Vec<usize> {
        let mut all = vec![joint];
        let mut done = 0;
        while let Some(&joint) = all.get(done) {
            all.extend(&self.children[joint]);
            done += 1;
        }
        all
    }

    /// Vertices of a joint and of the joints below it.
    pub(super) fn vertices_below(&self, joint: usize) -> impl Iterator<Item = u32> {
        self.below(joint).into_iter().flat_map(|joint| self.own[joint].iter().copied())
    }

    /// Number of vertices of a joint and of the joints below it.
    fn size(&self, joint: usize) -> usize {
        self.below(joint).iter().map(|&joint| self.own[joint].len()).sum()
    }

    /// Vertices of a joint and of the joints that were merged into it.
    pub(super) fn vertices_of(&self, joint: usize) -> Vec<u32> {
        let merged = (0..self.label.len()).filter(|&other| self.label[other] == joint);
        merged.flat_map(|other| self.own[other].iter().copied()).collect()
    }

    /// Drops the joints without vertices at them or below them (targets of inverse kinematics), and roots without
    /// vertices. Returns the number of joints that are left.
    pub(super) fn drop_helpers(&mut self, diagonal: f64) -> usize {
        let mut sizes: Vec<usize> = self.own.iter().map(Vec::len).collect();
        let order: Vec<usize> = self.roots().iter().flat_map(|&root| self.below(root)).collect();
        for &joint in order.iter().rev() {
            if let Some(parent) = self.parent[joint] {
                sizes[parent] += sizes[joint];
            }
            self.is_alive[joint] = sizes[joint] > 0;
        }
        self.link();
        let mut roots = self.roots();
        while let Some(root) = roots.pop() {
            let children = &self.children[root];
            let Some(&largest) = children.iter().rev().max_by_key(|&&child| sizes[child]) else { continue };
            let is_near = self.at[largest].distance(self.at[root]) < HIPS_DISTANCE * diagonal;
            if !self.own[root].is_empty() || children.len() > 1 && is_near {
                continue;
            }
            self.is_alive[root] = false;
            for &child in children {
                self.parent[child] = None;
                roots.push(child);
            }
        }
        self.link();
        self.is_alive.iter().filter(|&&is_alive| is_alive).count()
    }

    /// Joins all subtrees into one tree and returns its root; `None` if no joint is in use.
    ///
    /// In rigs with inverse kinematics, feet hang on control joints. Such a subtree joins the bone with which it shares
    /// most weights or, without shared weights, the bone of the nearest vertex. The main tree grows by one subtree at a
    /// time, because a subtree may join bones of another one. `weights`: weights of each vertex by joint; `points`:
    /// positions of the vertices.
    pub(super) fn join(&mut self, weights: &[Vec<(usize, f64)>], points: &[DVec3]) -> Option<usize> {
        let mut rest = self.roots();
        rest.sort_by_key(|&root| std::cmp::Reverse(self.size(root)));
        if rest.is_empty() {
            return None;
        }
        let main = rest.remove(0);
        let mut root_of = vec![None; self.at.len()];
        for &root in &rest {
            for joint in self.below(root) {
                root_of[joint] = Some(root);
            }
        }
        let shares = shared_weights(weights, &root_of);
        let centre = |root: usize| {
            let sum: DVec3 = self.vertices_below(root).map(|v| points[v as usize]).sum();
            sum / self.size(root).max(1) as f64
        };
        // Centre of each subtree, and the nearest vertex of the main tree with its joint.
        let mut nearest: BTreeMap<usize, (DVec3, f64, usize)> =
            rest.iter().map(|&root| (root, (centre(root), f64::INFINITY, main))).collect();
        let mut is_inside = vec![false; self.at.len()];
        let mut added = main;
        loop {
            for joint in self.below(added) {
                is_inside[joint] = true;
                for (centre, best, of) in nearest.values_mut() {
                    for &v in &self.own[joint] {
                        let distance = points[v as usize].distance(*centre);
                        if distance < *best {
                            (*best, *of) = (distance, joint);
                        }
                    }
                }
            }
            let mut best: Option<(f64, usize, usize)> = None;
            for &root in &rest {
                let of_root = shares.range((root, 0)..=(root, usize::MAX));
                let shared = of_root.filter(|((_, joint), share)| is_inside[*joint] && **share > MIN_SHARE);
                let shared = shared.map(|((_, joint), share)| (*share, *joint));
                let most = shared.reduce(|best, next| if next.0 > best.0 { next } else { best });
                let (value, joint) = most.unwrap_or_else(|| {
                    let (centre, _, joint) = nearest[&root];
                    (MIN_SHARE / (1.0 + self.at[joint].distance(centre)), joint)
                });
                if best.is_none_or(|(other, ..)| value > other) {
                    best = Some((value, root, joint));
                }
            }
            let Some((_, root, joint)) = best else { break };
            self.parent[root] = Some(joint);
            rest.retain(|&other| other != root);
            nearest.remove(&root);
            added = root;
        }
        self.link();
        Some(main)
    }

    /// Merges the joint and all joints below it into `into`, its parent.
    pub(super) fn absorb(&mut self, joint: usize, into: usize) {
        for joint in self.below(joint) {
            self.is_alive[joint] = false;
        }
        self.children[into].retain(|&child| child != joint);
        // Labels of joints that were merged earlier follow.
        let is_dead = |label: usize| !self.is_alive[label];
        let below = self.below(joint);
        for label in self.label.iter_mut().filter(|label| is_dead(**label) && below.contains(label)) {
            *label = into;
        }
    }
}

/// Computes `sum_v min(w_va, sum_{j below r} w_vj)` for each subtree r and each joint a outside of it. `root_of`: root
/// of the subtree of each joint, `None` for the main tree.
fn shared_weights(weights: &[Vec<(usize, f64)>], root_of: &[Option<usize>]) -> BTreeMap<(usize, usize), f64> {
    let mut shares = BTreeMap::new();
    for weights in weights {
        let mut of_roots: BTreeMap<usize, f64> = BTreeMap::new();
        for &(joint, weight) in weights {
            if let Some(root) = root_of[joint] {
                *of_roots.entry(root).or_default() += weight;
            }
        }
        for (&root, &sum) in &of_roots {
            for &(joint, weight) in weights.iter().filter(|(joint, _)| root_of[*joint] != Some(root)) {
                *shares.entry((root, joint)).or_default() += weight.min(sum);
            }
        }
    }
    shares
}
