//! One skeleton for several files of a rig: joints with the same name get the same displacement.

use std::collections::{BTreeMap, BTreeSet};

use ::gltf::json::mesh::Semantic;
use cagework_core::rotation::nearest_rotation;
use glam::{DMat3, DVec3};
use serde_json::Value;

use super::Rig;
use super::ground::Ground;
use super::nodes::{Deformation, NamedMoves, NodeMove, holders};
use crate::gltf::GltfDocument;
use crate::gltf::geometry::attribute;
use crate::gltf::scene::Worlds;
use crate::gltf::skin::each_influence;

/// Two skeletons are equally large if the ratio of their sizes differs from 1 by at most this.
const MAX_SAME_SCALE: f64 = 0.01;

/// Two frames are equal if the components of their unit axes differ by at most this: files store rotations in f32.
const MAX_SAME_FRAME: f64 = 1e-6;

/// Largest distance of the unit vectors along a bone in two files, about 10 degrees: files of one rig differ less.
const MAX_SAME_BONE: f64 = 0.17;

/// Displacements of joints by their names, for files that share a rig.
///
/// Names are compared without a namespace (`mixamorig:Hips` and `Hips` are equal). Nodes without a name are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skeleton {
    /// Joints that carry vertices in one of the files.
    holds: BTreeSet<String>,
    /// Joints of the body, the file whose deformation all files share, by name.
    moves: BTreeMap<String, BodyJoint>,
    /// Lowest points of the body or of all files, which determine how far every file is lifted. Displacements in
    /// `moves` include this lift.
    pub(super) ground: Option<Ground>,
}

/// A joint of the body.
#[derive(Clone, Debug, PartialEq)]
struct BodyJoint {
    /// World position at rest.
    at: DVec3,
    /// Linear part of the world transform at rest.
    linear: DMat3,
    /// Name of the nearest joint above; `None` without one.
    parent: Option<String>,
    moves: NodeMove,
}

impl Skeleton {
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
}

/// Name without a namespace. Some programs remove the colon from `mixamorig:Hips`, so the prefix `mixamorig` is removed,
/// too.
pub(super) fn bare(name: &str) -> &str {
    let name = name.rsplit(':').next().unwrap_or(name);
    name.strip_prefix("mixamorig").filter(|rest| !rest.is_empty()).unwrap_or(name)
}

/// Name of a node without its namespace; `None` if the node has no name.
fn bare_name(document: &GltfDocument, node: usize) -> Option<&str> {
    document.json["nodes"][node]["name"].as_str().map(bare).filter(|name| !name.is_empty())
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
        let names = holding.filter_map(|(joint, _)| bare_name(document, joint.value()));
        skeleton.holds.extend(names.map(str::to_owned));
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
        let name = |node: usize| bare_name(self.document, node);
        let follows = self.following(None).into_iter().enumerate();
        let is_joint: Vec<bool> = follows.map(|(node, follows)| follows && name(node).is_some()).collect();
        let above = nearest(&self.worlds, &is_joint);
        let mut skeleton = Skeleton { ground, ..joints_with_vertices(self.document) };
        // Of several nodes with the same name, the first one defines the moves: list joints first.
        let follows = self.follows.iter().map(|&(node, _)| node as usize);
        for node in holders(self.document).into_iter().chain(follows) {
            let world = self.worlds.world[node];
            let Some(own) = name(node) else { continue };
            skeleton.moves.entry(own.to_owned()).or_insert_with(|| BodyJoint {
                at: world.w_axis.truncate(),
                linear: DMat3::from_mat4(world),
                parent: above[node].and_then(name).map(str::to_owned),
                moves: moved.moves[node],
            });
        }
        skeleton
    }

    /// Looks up the moves of this document's nodes by their names. Displacements are scaled by the ratio of the sizes
    /// of the two skeletons, measured over their common joints.
    ///
    /// A file of clips can have another rest pose than the body. A joint then moves relative to the joint above as in
    /// the body, but in the frame of that joint at rest, so that its bone gets the length of the body's bone.
    pub(super) fn named(&self, skeleton: &Skeleton) -> NamedMoves {
        let n = self.held.len();
        let names: Vec<Option<&str>> = (0..n).map(|node| bare_name(self.document, node)).collect();
        let joint = |node: usize| skeleton.moves.get(names[node]?);
        let mut found: BTreeMap<&str, usize> = BTreeMap::new();
        let follows = self.follows.iter().map(|&(node, _)| node as usize);
        // A joint of the body that no clip of this file moves can still be the parent of one that a clip moves.
        let others = (0..n).filter(|&node| self.document.root.nodes[node].skin.is_none());
        for node in holders(self.document).into_iter().chain(follows).chain(others) {
            if let Some(name) = names[node].filter(|&name| skeleton.moves.contains_key(name)) {
                found.entry(name).or_insert(node);
            }
        }
        let mut is_found = vec![false; n];
        found.values().for_each(|&node| is_found[node] = true);
        let above = nearest(&self.worlds, &is_found);
        // The joint above each joint that has the same name in both files.
        let parent = |node: usize| {
            let body = joint(node)?;
            above[node].filter(|&above| body.parent.as_deref() == names[above])
        };
        let own = |node: usize| self.worlds.world[node].w_axis.truncate();
        let size = |points: &[DVec3]| {
            let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
            let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
            (high - low).length()
        };
        // The median ratio of bones does not depend on the rest poses. Without bones, the boxes of the joints are compared.
        let of_bone = |&node: &usize| {
            let above = parent(node)?;
            let [mine, others] = [own(node).distance(own(above)), joint(node)?.at.distance(joint(above)?.at)];
            (mine > 0.0 && others > 0.0).then_some(mine / others)
        };
        let mut bones: Vec<f64> = found.values().filter_map(of_bone).collect();
        bones.sort_by(f64::total_cmp);
        let of_boxes = || {
            size(&found.values().map(|&node| own(node)).collect::<Vec<_>>())
                / size(&found.keys().map(|&name| skeleton.moves[name].at).collect::<Vec<_>>())
        };
        let scale = Some(bones.get(bones.len() / 2).copied().unwrap_or_else(of_boxes))
            .filter(|scale| scale.is_finite() && *scale > 0.0 && (scale - 1.0).abs() > MAX_SAME_SCALE)
            .unwrap_or(1.0);
        let mut of_nodes: Vec<Option<NodeMove>> = vec![None; n];
        let bodies: Vec<Option<&BodyJoint>> =
            (0..n).map(|node| joint(node).filter(|_| is_found[node])).collect();
        let turned = self.frame_changes(&bodies, parent);
        // Whether the move of each node is that of the body, without a change by the rest pose.
        let mut is_plain = vec![true; n];
        for node in self.worlds.order.iter().map(|&(node, _)| node as usize) {
            let Some(body) = bodies[node] else { continue };
            let mut own = NodeMove { by: scale * body.moves.by, ..body.moves };
            if let Some(turn) = turned[node] {
                [own.turn, own.heading] = [own.turn, own.heading].map(|of| turn * of * turn.transpose());
            }
            if let Some(above) = parent(node)
                && let (Some(NodeMove { by, .. }), Some(body_above)) = (of_nodes[above], bodies[above])
            {
                is_plain[node] = is_plain[above] && turned[above].is_none();
                if !is_plain[node] {
                    let relative = body.moves.by - body_above.moves.by;
                    own.by = by + scale * (turned[above].unwrap_or(DMat3::IDENTITY) * relative);
                }
            }
            of_nodes[node] = Some(own);
        }
        let holds = names.iter().map(|name| name.is_some_and(|name| skeleton.holds.contains(name))).collect();
        NamedMoves { of_nodes, holds, scale }
    }

    /// Rotation of each joint at rest from the body to this document; `None` if it has the same frame in both. Programs
    /// give bones different axes, so a rotation counts only if it takes the bones below the joint from the body to this
    /// document. `bodies`: for each node, the joint of the body with its name. `parent`: the joint above a joint, if it
    /// has the same name in both files.
    fn frame_changes(
        &self,
        bodies: &[Option<&BodyJoint>],
        parent: impl Fn(usize) -> Option<usize>,
    ) -> Vec<Option<DMat3>> {
        let world = |node: usize| self.worlds.world[node];
        let change = |(node, body): (usize, &Option<&BodyJoint>)| {
            frame_change(DMat3::from_mat4(world(node)), body.as_ref()?.linear)
        };
        let mut changes: Vec<Option<DMat3>> = bodies.iter().enumerate().map(change).collect();
        let (mut has_bone, mut fits) = (vec![false; bodies.len()], vec![true; bodies.len()]);
        for (node, body) in bodies.iter().enumerate() {
            let (Some(body), Some(above)) = (body, parent(node)) else { continue };
            let Some(body_above) = bodies[above] else { continue };
            let own = (world(node).w_axis - world(above).w_axis).truncate().normalize_or_zero();
            let of_body = (body.at - body_above.at).normalize_or_zero();
            has_bone[above] = true;
            fits[above] &= own.distance(changes[above].unwrap_or(DMat3::IDENTITY) * of_body) <= MAX_SAME_BONE;
        }
        for node in self.worlds.order.iter().map(|&(node, _)| node as usize) {
            if bodies[node].is_some() && !has_bone[node] {
                fits[node] = parent(node).is_none_or(|above| fits[above]);
            }
        }
        changes.iter_mut().zip(fits).filter(|(_, fits)| !fits).for_each(|(change, _)| *change = None);
        changes
    }
}

/// For each node, the nearest node above it that is one of `joints`.
fn nearest(worlds: &Worlds, joints: &[bool]) -> Vec<Option<usize>> {
    let mut above = vec![None; joints.len()];
    for &(node, parent) in &worlds.order {
        let parent = parent.map(|parent| parent as usize);
        above[node as usize] = parent.and_then(|p| if joints[p] { Some(p) } else { above[p] });
    }
    above
}

/// Rotation from the frame of a joint at rest in one file to its frame in another; `None` if the frames are equal. Scales
/// are left out, because they are in the ratio of the sizes.
fn frame_change(to: DMat3, from: DMat3) -> Option<DMat3> {
    let normalized = |m: DMat3| {
        DMat3::from_cols_array_2d(
            &[m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.normalize_or_zero().to_array()),
        )
    };
    let [to, from] = [to, from].map(normalized);
    (!to.abs_diff_eq(from, MAX_SAME_FRAME)).then(|| nearest_rotation(to * from.transpose()))
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
