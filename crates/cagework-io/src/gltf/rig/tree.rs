//! The node tree of a document, with the nodes moved by the values of a clip.

use ::gltf::json::scene::{Node, UnitQuaternion};
use glam::{DMat4, DVec3};

use super::clip::{quaternion, vector};
use crate::gltf::channels::ChannelTarget;
use crate::gltf::scene::{Worlds, local};
use crate::gltf::{GltfDocument, GltfError};

/// Nodes of a document.
#[derive(Clone, Debug)]
pub(super) struct NodeTree {
    pub(super) nodes: Vec<Node>,
    /// Nodes, each with its parent; parents come first.
    order: Vec<(u32, Option<u32>)>,
}

/// Local and world transforms of all nodes at one time.
pub(super) struct PosedNodes {
    pub(super) nodes: Vec<Node>,
    pub(super) world: Vec<DMat4>,
}

impl NodeTree {
    pub(super) fn new(document: &GltfDocument) -> Result<Self, GltfError> {
        let nodes = document.root.nodes.clone();
        Ok(Self { nodes, order: Worlds::new(&document.root)?.order })
    }

    /// Parent of each node; `None` for roots. `[n_nodes]`
    pub(super) fn parents(&self) -> Vec<Option<usize>> {
        let mut parents = vec![None; self.nodes.len()];
        for &(node, parent) in &self.order {
            parents[node as usize] = parent.map(|parent| parent as usize);
        }
        parents
    }

    /// The nodes with these values of animated properties. Weights of morph targets are ignored.
    pub(super) fn posed<'v>(
        &self,
        values: impl IntoIterator<Item = &'v (ChannelTarget, Vec<f64>)>,
    ) -> PosedNodes {
        let mut nodes = self.nodes.clone();
        for (driven, value) in values {
            match *driven {
                ChannelTarget::Translation(n) if n < nodes.len() => {
                    nodes[n].translation = Some(vector(value).as_vec3().to_array());
                }
                ChannelTarget::Rotation(n) if n < nodes.len() => {
                    nodes[n].rotation = Some(UnitQuaternion(quaternion(value).as_quat().to_array()));
                }
                ChannelTarget::Scale(n) if n < nodes.len() => {
                    nodes[n].scale = Some(vector(value).as_vec3().to_array());
                }
                _ => {}
            }
        }
        let mut world = vec![DMat4::IDENTITY; nodes.len()];
        for &(node, parent) in &self.order {
            let above = parent.map_or(DMat4::IDENTITY, |p| world[p as usize]);
            world[node as usize] = above * local(&nodes[node as usize]);
        }
        PosedNodes { nodes, world }
    }
}

impl PosedNodes {
    /// Position of a node in world space.
    pub(super) fn position(&self, node: usize) -> DVec3 {
        self.world[node].w_axis.truncate()
    }
}
