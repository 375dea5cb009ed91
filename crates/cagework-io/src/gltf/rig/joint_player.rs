//! Clips as motions of the joints, for figures that follow the clip of another rig.

use cagework_core::rig::JointFrame;
use cagework_core::rotation::nearest_rotation;
use glam::{DMat3, DMat4, DQuat, DVec3};

use super::clip::{Clip, clips};
use super::rest::joint_nodes;
use super::tree::NodeTree;
use crate::gltf::{GltfDocument, GltfError};

/// Plays the clips of a rig without its meshes.
#[derive(Clone, Debug)]
pub struct JointPlayer {
    clips: Vec<Clip>,
    tree: NodeTree,
    /// Node of each joint.
    nodes: Vec<u32>,
    /// Inverses of the nodes' linear maps at rest. `[n_joints]`
    rest: Vec<DMat3>,
    /// Maps the file's world space to that of the model's positions.
    to_model: DMat4,
}

impl JointPlayer {
    /// Creates a player for the joints of [`super::rest_rig`]. `to_model`: rigid map from the world space of the file.
    pub(crate) fn new(document: &GltfDocument, to_model: DMat4) -> Result<Self, GltfError> {
        let (tree, nodes) = (NodeTree::new(document)?, joint_nodes(document));
        let world = tree.posed([]).world;
        let inverse = |&node: &u32| DMat3::from_mat4(world[node as usize]).inverse();
        let rest = nodes.iter().map(inverse).collect();
        Ok(Self { clips: clips(document), tree, nodes, rest, to_model })
    }

    /// Clips of the file.
    #[must_use]
    pub fn clips(&self) -> &[Clip] {
        &self.clips
    }

    /// Evaluates a clip at a time, seconds; `None` is the rest pose. `[n_joints]`, in the order of
    /// [`Model::rest_rig`](crate::Model::rest_rig). Scales are ignored.
    #[must_use]
    pub fn at(&self, clip: Option<usize>, seconds: f32) -> Vec<JointFrame> {
        let clip = clip.and_then(|clip| self.clips.get(clip));
        let values: Vec<_> = clip.into_iter().flat_map(|clip| clip.at(seconds)).collect();
        let world = self.tree.posed(&values).world;
        let axes = DQuat::from_mat3(&DMat3::from_mat4(self.to_model));
        let frame = |(&node, rest): (&u32, &DMat3)| {
            let now = world[node as usize];
            let turn = DMat3::from_mat4(now) * *rest;
            let turn = if turn.is_finite() { nearest_rotation(turn) } else { DMat3::IDENTITY };
            let at: DVec3 = self.to_model.transform_point3(now.w_axis.truncate());
            JointFrame { at, turn: axes * DQuat::from_mat3(&turn) * axes.inverse() }
        };
        self.nodes.iter().zip(&self.rest).map(frame).collect()
    }
}
