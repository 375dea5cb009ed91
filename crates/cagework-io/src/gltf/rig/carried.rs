//! Things that a figure carries in its hands, such as weapons. They do not stand on the ground.

use std::collections::HashMap;

use cagework_core::disjoint::DisjointSets;
use cagework_core::rig::Rig as RestRig;
use cagework_pose::humanoid::{Bone, Humanoid};

use super::Rig;
use super::rest::rest_rig;

/// Least share of a vertex's weight that hangs on a hand and the joints below it, for a piece that the hand carries.
const LEAST: f32 = 0.999;

impl Rig<'_> {
    /// Whether each vertex belongs to a connected piece that hangs on one hand alone. All are false for models that are
    /// no humanoids, and for those of which nothing else would be left. `[n_vertices]`
    pub(crate) fn carried_in_hands(&self, triangles: &[[u32; 3]]) -> Vec<bool> {
        let none = || vec![false; self.n_vertices];
        let Ok(Some(rest)) = rest_rig(self.document, self.origin) else { return none() };
        let Ok(humanoid) = Humanoid::of_rig(&rest, &[]) else { return none() };
        let (mut carried, mut pieces) = (none(), self.pieces(triangles));
        for hand in [Bone::LeftHand, Bone::RightHand].into_iter().filter_map(|bone| humanoid.joint(bone)) {
            let below = below(&rest, hand);
            let hangs: Vec<bool> = (0..self.n_vertices).map(|v| weight(&rest, &below, v) >= LEAST).collect();
            // Whether each piece, by its root, hangs on the hand as a whole.
            let mut whole = hangs.clone();
            for v in (0..self.n_vertices).filter(|&v| !hangs[v]) {
                whole[pieces.root(v as u32) as usize] = false;
            }
            for (v, carried) in carried.iter_mut().enumerate() {
                *carried |= whole[pieces.root(v as u32) as usize];
            }
        }
        if carried.iter().all(|&carried| carried) { none() } else { carried }
    }

    /// Connected pieces of the model. Vertices at the same position are connected, because files split them at seams.
    fn pieces(&self, triangles: &[[u32; 3]]) -> DisjointSets {
        let mut pieces = DisjointSets::new(self.n_vertices);
        let mut at = HashMap::new();
        for part in self.parts.iter().filter(|part| part.slot.is_some()) {
            for (v, position) in (part.first as u32..).zip(part.rest()) {
                let same = *at.entry(position.to_array().map(f64::to_bits)).or_insert(v);
                pieces.join(v, same);
            }
        }
        for &[a, b, c] in triangles {
            pieces.join(a, b);
            pieces.join(b, c);
        }
        pieces
    }
}

/// Whether each joint is `top` or below it. Parents need not come first. `[n_joints]`
fn below(rest: &RestRig, top: u32) -> Vec<bool> {
    let is_below = |mut joint: u32| {
        // A path visits each joint at most once.
        for _ in 0..rest.joints.len() {
            if joint == top {
                return true;
            }
            let Some(parent) = rest.joints[joint as usize].parent else { return false };
            joint = parent;
        }
        false
    };
    (0..rest.joints.len() as u32).map(is_below).collect()
}

/// Share of a vertex's weight on these joints; 0 without weights.
fn weight(rest: &RestRig, on: &[bool], vertex: usize) -> f32 {
    let [Some(&first), Some(&last)] = [vertex, vertex + 1].map(|v| rest.first.get(v)) else { return 0.0 };
    let own = &rest.influences[first as usize..last as usize];
    let total: f32 = own.iter().map(|(_, weight)| weight).sum();
    let on: f32 = own.iter().filter(|(joint, _)| on[*joint as usize]).map(|(_, weight)| weight).sum();
    if total > 0.0 { on / total } else { 0.0 }
}
