//! One skeleton for several files of a rig: joints with the same name get the same displacement.

use std::collections::{BTreeMap, BTreeSet};

use ::gltf::json::mesh::Semantic;
use glam::DVec3;
use serde_json::Value;

use super::Rig;
use super::ground::Ground;
use super::nodes::{Deformation, NamedMoves, NodeMove, holders};
use crate::gltf::GltfDocument;
use crate::gltf::geometry::attribute;
use crate::gltf::scene::name_of;
use crate::gltf::skin::each_influence;

/// Two skeletons are equally large if the ratio of their sizes differs from 1 by at most this.
const MAX_SAME_SCALE: f64 = 0.01;

/// Displacements of joints by their names, for files that share a rig.
///
/// Names are compared without a namespace (`mixamorig:Hips` and `Hips` are equal).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skeleton {
    /// Joints that carry vertices in one of the files.
    holds: BTreeSet<String>,
    /// For each joint of the body, the file whose deformation all files share: world position at rest, and move.
    moves: BTreeMap<String, (DVec3, NodeMove)>,
    /// Lowest points of the body or of all files, which determine how far every file is lifted. Displacements in
    /// `moves` include this lift.
    pub(super) ground: Option<Ground>,
}

impl Skeleton {
    /// Whether the skeleton contains displacements of joints. Files without triangles need them.
    #[must_use]
    pub fn has_moves(&self) -> bool {
        !self.moves.is_empty()
    }

    /// Lowest points that determine how far every file is lifted.
    #[must_use]
    pub fn ground(&self) -> Option<&Ground> {
        self.ground.as_ref()
    }

    /// Replaces the lowest points, for example by those of all files together.
    #[must_use]
    pub fn with_ground(self, ground: Ground) -> Self {
        Self { ground: Some(ground), ..self }
    }

    /// Adds the joints that carry vertices in another skeleton.
    pub fn add(&mut self, other: Self) {
        self.holds.extend(other.holds);
    }

    pub(super) fn holds(&self, name: &str) -> bool {
        self.holds.contains(bare(name))
    }
}

/// Name without a namespace. Some programs remove the colon from `mixamorig:Hips`, so the prefix `mixamorig` is removed,
/// too.
pub(super) fn bare(name: &str) -> &str {
    let name = name.rsplit(':').next().unwrap_or(name);
    name.strip_prefix("mixamorig").filter(|rest| !rest.is_empty()).unwrap_or(name)
}

/// The joints that carry vertices. Skins that cannot be read contribute none.
pub(crate) fn joints_with_vertices(document: &GltfDocument) -> Skeleton {
    let mut skeleton = Skeleton::default();
    for instance in document.instances.iter().chain(&document.elsewhere) {
        let Some(skin) = instance.skin.map(|skin| &document.root.skins[skin as usize]) else { continue };
        let mut holds = vec![false; skin.joints.len()];
        for primitive in &document.root.meshes[instance.mesh as usize].primitives {
            let count = attribute(primitive, Semantic::Positions)
                .and_then(|accessor| document.source().count(accessor).ok())
                .unwrap_or(0);
            let _ = each_influence(document.source(), primitive, count as usize, |_, joint, _| {
                holds.get_mut(joint as usize).into_iter().for_each(|holds| *holds = true);
            });
        }
        let holding = skin.joints.iter().zip(holds).filter(|(_, holds)| *holds);
        let name = |joint: usize| name_of(&document.json, "nodes", joint as u32, "node");
        skeleton.holds.extend(holding.map(|(joint, _)| bare(&name(joint.value())).to_owned()));
    }
    skeleton
}

impl Rig<'_> {
    /// Computes how the joints move in a deformation that contains the lift of `ground`.
    pub(super) fn skeleton(
        &self,
        given: &Deformation<'_>,
        ground: Option<Ground>,
        json: &mut Value,
    ) -> Skeleton {
        let moved = self.moved(given, json);
        let mut skeleton = Skeleton { ground, ..joints_with_vertices(self.document) };
        // Of several nodes with the same name, the first one defines the moves: list joints first.
        let follows = self.follows.iter().map(|&(node, _)| node as usize);
        for node in holders(self.document).into_iter().chain(follows) {
            let from = self.worlds.world[node].w_axis.truncate();
            let name = bare(&self.node_name(node as u32)).to_owned();
            skeleton.moves.entry(name).or_insert((from, moved.moves[node]));
        }
        skeleton
    }

    /// Looks up the moves of this document's nodes by their names. Displacements are scaled by the ratio of the sizes
    /// of the two skeletons, measured over their common joints.
    pub(super) fn named(&self, skeleton: &Skeleton) -> NamedMoves {
        let names: Vec<String> =
            (0..self.held.len() as u32).map(|node| bare(&self.node_name(node)).to_owned()).collect();
        let mut found: BTreeMap<&str, usize> = BTreeMap::new();
        let follows = self.follows.iter().map(|&(node, _)| node as usize);
        // A joint of the body that no clip of this file moves can still be the parent of one that a clip moves.
        let others = (0..names.len()).filter(|&node| self.document.root.nodes[node].skin.is_none());
        for node in holders(self.document).into_iter().chain(follows).chain(others) {
            if skeleton.moves.contains_key(&names[node]) {
                found.entry(&names[node]).or_insert(node);
            }
        }
        let own = |node: usize| self.worlds.world[node].w_axis.truncate();
        let size = |points: &[DVec3]| {
            let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
            let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
            (high - low).length()
        };
        let sizes = [
            size(&found.values().map(|&node| own(node)).collect::<Vec<_>>()),
            size(&found.keys().map(|&name| skeleton.moves[name].0).collect::<Vec<_>>()),
        ];
        let scale = Some(sizes[0] / sizes[1])
            .filter(|scale| scale.is_finite() && *scale > 0.0 && (scale - 1.0).abs() > MAX_SAME_SCALE)
            .unwrap_or(1.0);
        let mut of_nodes = vec![None; names.len()];
        for (name, node) in found {
            let (_, body) = skeleton.moves[name];
            of_nodes[node] = Some(NodeMove { by: scale * body.by, ..body });
        }
        let holds = names.iter().map(|name| skeleton.holds(name)).collect();
        NamedMoves { of_nodes, holds }
    }

    fn node_name(&self, node: u32) -> String {
        name_of(&self.document.json, "nodes", node, "node")
    }
}

#[cfg(test)]
mod tests {
    use super::bare;

    #[test]
    fn namespaces_are_ignored() {
        for name in ["Hips", "mixamorig:Hips", "mixamorigHips", "a:b:Hips"] {
            assert_eq!(bare(name), "Hips");
        }
        assert_eq!(bare("mixamorig"), "mixamorig");
    }
}
