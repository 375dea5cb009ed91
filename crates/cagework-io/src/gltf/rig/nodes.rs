//! Nodes that follow the cage: joints and their descendants.

use std::collections::HashMap;

use ::gltf::json::Index;
use ::gltf::json::scene::{Node, UnitQuaternion};
use cagework_pose::parts::Motion;
use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};
use serde_json::{Value, json};

use super::tracks::NodeChange;
use super::{GRADIENT_STEP, PROBE_DIRECTIONS, Rig};
use crate::gltf::GltfDocument;
use crate::gltf::channels::{ChannelTarget, channel_target};
use crate::gltf::scene::{local, name_of};
use crate::surface::rotation;

cagework_core::choice! {
    /// How the skeleton follows the cage.
    Joints {
        /// Joints move with the cage and keep their orientation. Rotation and scale tracks stay unchanged.
        #[default]
        Follow = "follow",
        /// The skeleton stays unchanged, for skeletons shared between files.
        Stay = "stay",
        /// Joints move with the cage, and rotate with the deformation around them.
        Turn = "turn",
    }
}

/// Displacements below this fraction of the model's diagonal are ignored.
const MIN_DISPLACEMENT: f64 = 1e-6;
/// Bones shorter than this fraction of the model's diagonal have no defined direction.
const MIN_BONE_LENGTH: f64 = 1e-4;
/// Minimum height of hips above the floor, as a fraction of the height of the skeleton's vertices.
const MIN_HIP_HEIGHT: f64 = 0.1;
/// Largest difference between components of two transforms that is rounding, as a fraction of their scale.
const MAX_ROUNDING: f64 = 1e-5;
/// Minimum number of enclosed vertices for fitting a rigid motion.
const MIN_RIGID_VERTICES: usize = 3;
/// Limits of the factor that scales the translations in clips of a skeleton, relative to the change of the skeleton's
/// size.
const TRAVEL_SCALE_RANGE: (f64, f64) = (0.2, 5.0);

/// The nodes of a document after the deformation.
pub(super) struct NodeUpdate {
    /// Change of each node; `None` for unchanged nodes. `[n_nodes]`
    pub(super) changes: Vec<Option<NodeChange>>,
    pub(super) nodes: Vec<Node>,
    /// World transforms, computed from the local transforms after rounding them to f32, as they are written.
    pub(super) world: Vec<DMat4>,
    /// `[n_nodes]`
    pub(super) moves: Vec<NodeMove>,
    /// Nodes of rigid meshes that cannot move rigidly, because the nodes above scale differently along their axes: a
    /// translation, a rotation and a scale cannot express the shear.
    pub(super) sheared: Vec<u32>,
    pub(super) n_moved: usize,
    /// Joints and nodes outside the cage that carry vertices and move like vertices outside the cage.
    pub(super) outside: Vec<u32>,
    /// Number of joints outside the cage that carry no vertices. These joints follow their parent.
    pub(super) n_follow_parent: usize,
}

/// How a node moves, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NodeMove {
    pub(super) by: DVec3,
    pub(super) turn: DMat3,
    /// Scale factor of clip translations.
    pub(super) ratio: f64,
    /// Rotation about the up axis of the clip translations of a node at the top.
    pub(super) heading: DMat3,
    /// Whether the cage can move none of the nodes above. Constant translations of such a node are positions, not
    /// lengths of a bone.
    pub(super) is_top: bool,
}

/// Moves of a document's nodes, taken from the nodes of the same names in a [`Skeleton`](super::Skeleton).
pub(super) struct NamedMoves {
    /// A node with a move follows the cage, even if this document alone gives no reason for that. `[n_nodes]`
    pub(super) of_nodes: Vec<Option<NodeMove>>,
    /// Whether each node carries vertices in one of the files. `[n_nodes]`
    pub(super) holds: Vec<bool>,
    /// Size of this document's skeleton as a multiple of that of the shared skeleton.
    pub(super) scale: f64,
}

/// The deformation that [`Rig::moved`] applies to the nodes.
pub(super) struct Deformation<'a> {
    pub(super) by: &'a [DVec3],
    pub(super) is_outside: &'a [bool],
    pub(super) joints: Joints,
    pub(super) keep_travel: bool,
    /// Motions of nodes whose meshes stay rigid.
    pub(super) rigid: &'a HashMap<u32, Motion>,
    /// Moves of nodes given by a skeleton that is shared with other files.
    pub(super) named: Option<&'a NamedMoves>,
    /// Whether each vertex belongs to something that is carried, which does not count for the height of the hips; empty
    /// if that is not known. `[n_vertices]`
    pub(super) carried: &'a [bool],
    /// Up axis of the file.
    pub(super) up: DVec3,
}

impl Deformation<'_> {
    /// The move of a node that the shared skeleton gives.
    fn named_move(&self, node: usize) -> Option<NodeMove> {
        self.named.and_then(|named| named.of_nodes[node])
    }
}

/// Computes the deformation gradient at a node by central differences. `anchor`: index of the node's first point in
/// `by`.
pub(super) fn gradient(by: &[DVec3], anchor: usize, diagonal: f64) -> DMat3 {
    let column = |axis: usize| {
        let [plus, minus] = [1 + axis, 1 + axis + PROBE_DIRECTIONS.len() / 2].map(|k| by[anchor + k]);
        DMat3::IDENTITY.col(axis) + (plus - minus) / (2.0 * GRADIENT_STEP * diagonal)
    };
    DMat3::from_cols(column(0), column(1), column(2))
}

/// Nodes that can carry vertices: joints, nodes animated by clips, and VRM bones.
pub(super) fn holders(document: &GltfDocument) -> Vec<usize> {
    let json = &document.json;
    let animations = json["animations"].as_array().into_iter().flatten();
    let channels = animations.flat_map(|animation| animation["channels"].as_array().into_iter().flatten());
    let animated = channels.filter_map(|channel| match channel_target(channel)? {
        ChannelTarget::Translation(node) | ChannelTarget::Rotation(node) | ChannelTarget::Scale(node) => {
            Some(node)
        }
        ChannelTarget::Weights(_) | ChannelTarget::MeshWeights(_) => None,
    });
    let bones = vrm_bones(document).into_iter().map(|(_, node)| node);
    let joints = document.root.skins.iter().flat_map(|skin| &skin.joints).map(Index::value);
    joints.chain(animated).chain(bones).filter(|&node| node < document.root.nodes.len()).collect()
}

/// Humanoid bones of a VRM, by their names in its version of the specification, and their nodes: those of VRM 1, then
/// those of VRM 0.
pub(super) fn vrm_bones(document: &GltfDocument) -> Vec<(&str, usize)> {
    let bones = |extension: &str| &document.json["extensions"][extension]["humanoid"]["humanBones"];
    let of_vrm1 = bones("VRMC_vrm").as_object().into_iter().flatten();
    let of_vrm1 = of_vrm1.map(|(name, bone)| (Some(name.as_str()), bone));
    let of_vrm0 = bones("VRM").as_array().into_iter().flatten().map(|bone| (bone["bone"].as_str(), bone));
    let node = |bone: &Value| usize::try_from(bone["node"].as_u64()?).ok();
    of_vrm1.chain(of_vrm0).filter_map(|(name, bone)| Some((name?, node(bone)?))).collect()
}

/// A node that follows the cage: a joint, an animated node, a VRM bone, a node with an unskinned mesh, or a descendant
/// of these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointPoint {
    /// Node index in the file.
    pub node: u32,
    /// Index of the node's origin among the extra points.
    pub point: usize,
    /// Index of the parent in the list of joints, which lists parents first; `None` for roots.
    pub parent: Option<usize>,
    /// Whether the node carries vertices. A joint outside the cage that carries none follows its parent.
    pub holds: bool,
}

impl Rig<'_> {
    /// Nodes that follow the cage, parents first.
    pub(crate) fn joints(&self) -> Vec<JointPoint> {
        let mut numbers = vec![None; self.held.len()];
        let parents: HashMap<u32, Option<u32>> = self.worlds.order.iter().copied().collect();
        let of_ends = if self.lattice.is_some() { self.n_ends } else { 0 };
        let mut joints = Vec::with_capacity(self.follows.len());
        for (k, &(node, at)) in self.follows.iter().enumerate() {
            numbers[node as usize] = Some(k);
            let above = parents.get(&node).copied().flatten();
            joints.push(JointPoint {
                node,
                // With a lattice, the ends of morph targets, which precede the points of nodes, are not among the extra
                // points.
                point: at - self.n_vertices - of_ends,
                parent: above.and_then(|above| numbers[above as usize]),
                holds: self.held[node as usize] > 0.0,
            });
        }
        joints
    }

    /// Whether each node follows the cage or moves as a node of the same name. `[n_nodes]`
    pub(super) fn following(&self, named: Option<&NamedMoves>) -> Vec<bool> {
        let is_named = |node: usize| named.is_some_and(|named| named.of_nodes[node].is_some());
        let mut follows: Vec<bool> = (0..self.held.len()).map(is_named).collect();
        self.follows.iter().for_each(|&(node, _)| follows[node as usize] = true);
        follows
    }

    /// Names of skeleton nodes with unskinned meshes.
    pub(crate) fn props(&self) -> Vec<String> {
        let name = |node| name_of(&self.document.json, "nodes", node, "node");
        self.follows.iter().map(|&(node, _)| node).filter(|&node| self.is_prop(node)).map(name).collect()
    }

    fn is_prop(&self, node: u32) -> bool {
        let of_node = &self.document.root.nodes[node as usize];
        of_node.mesh.is_some() && of_node.skin.is_none() && self.on_skeleton[node as usize]
    }

    /// Nodes of [`Self::props`] with this name.
    pub(super) fn props_named(&self, name: &str) -> Vec<u32> {
        let follows = |node: &u32| self.follows.iter().any(|(follows, _)| follows == node);
        let named = named(&self.document.json, name).into_iter();
        named.filter(|&node| self.is_prop(node)).filter(follows).collect()
    }

    /// Fits the rigid motions of nodes whose meshes stay rigid: least squares over the vertices inside the cage or,
    /// with fewer than [`MIN_RIGID_VERTICES`], the displacement and rotation at the node's origin.
    pub(super) fn motions(&self, props: &[u32], by: &[DVec3], is_outside: &[bool]) -> HashMap<u32, Motion> {
        let of = |&(node, at): &(u32, usize)| {
            let own = self.parts.iter().filter(|part| part.instance.node == Some(node));
            let points = own.flat_map(|part| (part.first..).zip(part.rest()));
            let inside: Vec<(DVec3, DVec3)> =
                points.filter(|&(v, _)| !is_outside[v]).map(|(v, rest)| (rest, by[v])).collect();
            if inside.len() >= MIN_RIGID_VERTICES {
                return (node, Motion::fit(&inside));
            }
            let turn = rotation(gradient(by, at, self.diagonal)).unwrap_or(DMat3::IDENTITY);
            (node, Motion::about(self.worlds.world[node as usize].w_axis.truncate(), turn, by[at]))
        };
        self.follows.iter().filter(|(node, _)| props.contains(node)).map(of).collect()
    }

    /// Fits the rigid motion of the vertices inside the cage that the unskinned meshes at a node and below it have.
    /// `None` for a joint of a skin, and with fewer than [`MIN_RIGID_VERTICES`].
    fn carried(&self, node: u32, given: &Deformation<'_>) -> Option<Motion> {
        let mut joints = self.document.root.skins.iter().flat_map(|skin| &skin.joints);
        if joints.any(|joint| joint.value() == node as usize) {
            return None;
        }
        let mut is_below = vec![false; self.held.len()];
        is_below[node as usize] = true;
        self.worlds.mark_below(&mut is_below);
        let is_carried = |part: &&super::RigPrimitive| {
            part.instance.skin.is_none() && part.instance.node.is_some_and(|node| is_below[node as usize])
        };
        let points = self.parts.iter().filter(is_carried).flat_map(|part| (part.first..).zip(part.rest()));
        let inside = points.filter(|&(v, _)| !given.is_outside[v]);
        let inside: Vec<(DVec3, DVec3)> = inside.map(|(v, rest)| (rest, given.by[v])).collect();
        (inside.len() >= MIN_RIGID_VERTICES).then(|| Motion::fit(&inside))
    }

    /// Moves the nodes that follow the cage: writes their transforms to `json` and returns their changes.
    pub(super) fn moved(&self, given: &Deformation<'_>, json: &mut Value) -> NodeUpdate {
        let root = &self.document.root;
        let n = root.nodes.len();
        let heading = DMat3::IDENTITY;
        let still = NodeMove { by: DVec3::ZERO, turn: DMat3::IDENTITY, ratio: 1.0, heading, is_top: true };
        let mut moved = NodeUpdate {
            changes: (0..n).map(|_| None).collect(),
            nodes: root.nodes.clone(),
            world: self.worlds.world.clone(),
            moves: vec![still; n],
            sheared: Vec::new(),
            n_moved: 0,
            outside: Vec::new(),
            n_follow_parent: 0,
        };
        if given.joints == Joints::Stay && given.rigid.is_empty() {
            return moved;
        }
        let anchors = self.anchors(given);
        let new = self.place(given, &anchors, &mut moved);
        let travels = !given.keep_travel && json["animations"].as_array().is_some_and(|all| !all.is_empty());
        if travels {
            let travel = self.travel(given, &moved.moves);
            // Joints that are missing in the shared skeleton travel like another joint.
            let travel_of = |named: NodeMove| (named.ratio, named.heading);
            let one = (0..n).find_map(|i| given.named_move(i)).map(travel_of);
            for (i, own) in travel.into_iter().enumerate() {
                let of = &mut moved.moves[i];
                (of.ratio, of.heading) = given.named_move(i).map(travel_of).or(one).unwrap_or(own);
            }
        }
        let old = &self.worlds.world;
        for &(node, parent) in &self.worlds.order {
            let i = node as usize;
            let follows =
                anchors[i].is_some() || given.joints != Joints::Stay && given.named_move(i).is_some();
            // The transform that the nodes above have reached, so that errors do not add up along chains of nodes.
            let [above, above_new] =
                [old, &moved.world].map(|world| parent.map_or(DMat4::IDENTITY, |p| world[p as usize]));
            if follows {
                moved.changes[i] = self.change(i, [above, above_new], new[i], &mut moved, json);
            }
            moved.world[i] = above_new * local(&moved.nodes[i]);
            let [reached, wanted] = [moved.world[i], new[i]].map(DMat3::from_mat4);
            let rounding = MAX_ROUNDING * wanted.determinant().abs().cbrt();
            if given.rigid.contains_key(&node) && !reached.abs_diff_eq(wanted, rounding) {
                moved.sheared.push(node);
            }
        }
        moved
    }

    /// Moves node `i` towards the world transform `new`: writes its local transform and returns the change. `above`: the
    /// transforms of its parent before and after the deformation.
    fn change(
        &self,
        i: usize,
        [above, above_new]: [DMat4; 2],
        new: DMat4,
        moved: &mut NodeUpdate,
        json: &mut Value,
    ) -> Option<NodeChange> {
        let old = self.worlds.world[i];
        let from = local(&self.document.root.nodes[i]);
        let NodeMove { ratio, heading, is_top, .. } = moved.moves[i];
        let mut moving = DMat3::from_diagonal(DVec3::splat(ratio));
        if is_top && heading != DMat3::IDENTITY {
            // Translations are in the frame of the parent, the heading is in world space.
            let [above, above_new] = [above, above_new].map(DMat3::from_mat4);
            let turned = above_new.inverse() * heading * above * moving;
            moving = if turned.is_finite() { turned } else { moving };
        }
        if new == old && above == above_new {
            // A root that stays where it is, such as one on the floor outside the cage, travels with the skeleton.
            let at = from.w_axis.truncate();
            return (is_top && moving != DMat3::IDENTITY).then_some(NodeChange {
                from: at,
                to: at,
                still: moving,
                moving,
                turn: None,
            });
        }
        let to = above_new.inverse() * new;
        if !to.is_finite() {
            return None;
        }
        moved.n_moved += 1;
        let turns = DMat3::from_mat4(new) != DMat3::from_mat4(old)
            || DMat3::from_mat4(above) != DMat3::from_mat4(above_new);
        let turn = set_local(&mut moved.nodes[i], &mut json["nodes"][i], &to, turns);
        // Bone lengths are relative to the parent's scale.
        let scale = DMat3::from_mat4(above).determinant().abs().cbrt().max(1e-12);
        let [t0, t1] = [from, to].map(|m| m.w_axis.truncate());
        let still = if is_top {
            moving
        } else if t0.length().min(t1.length()) > MIN_BONE_LENGTH * self.diagonal / scale {
            let turn = DQuat::from_rotation_arc(t0.normalize(), t1.normalize());
            DMat3::from_quat(turn) * (t1.length() / t0.length())
        } else {
            DMat3::IDENTITY
        };
        Some(NodeChange { from: t0, to: t1, still, moving, turn })
    }

    /// Index of the point that each node follows; `None` for the others. If the skeleton stays, only nodes of rigid
    /// meshes follow the cage. `[n_nodes]`
    fn anchors(&self, given: &Deformation<'_>) -> Vec<Option<usize>> {
        let mut anchors = vec![None; self.held.len()];
        let follows = |node| given.joints != Joints::Stay || given.rigid.contains_key(&node);
        for &(node, at) in self.follows.iter().filter(|&&(node, _)| follows(node)) {
            anchors[node as usize] = Some(at);
        }
        anchors
    }

    /// Computes the world transforms of all nodes after the deformation, and sets the moves and counts of `moved`,
    /// except the ratios. `[n_nodes]`
    fn place(
        &self,
        given: &Deformation<'_>,
        anchors: &[Option<usize>],
        moved: &mut NodeUpdate,
    ) -> Vec<DMat4> {
        let stays = given.joints == Joints::Stay;
        let (old, moves) = (&self.worlds.world, &mut moved.moves);
        let mut new = old.clone();
        // Whether the cage can move each node or one above it.
        let mut movable = vec![false; new.len()];
        for &(node, parent) in &self.worlds.order {
            let (i, parent) = (node as usize, parent.map(|p| p as usize));
            let is_below = parent.is_some_and(|p| movable[p]);
            (movable[i], moves[i].is_top) = (is_below, !is_below);
            if let Some(motion) = given.rigid.get(&node) {
                movable[i] = true;
                new[i] = motion.transform() * old[i];
                moves[i].by = (new[i].w_axis - old[i].w_axis).truncate();
                continue;
            }
            let named = given.named_move(i).filter(|_| !stays);
            // A file that contains only clips has no vertices, and its points are not bound.
            let anchor = anchors[i].filter(|_| !self.parts.is_empty());
            let (by, turn) = match (named, anchor) {
                (Some(named), _) => {
                    (movable[i], moves[i].is_top) = (true, named.is_top);
                    (named.by, named.turn)
                }
                (None, Some(at)) => {
                    let holds = self.held[i] > 0.0 || given.named.is_some_and(|named| named.holds[i]);
                    let follows_parent = given.is_outside[at] && !holds;
                    let carried =
                        if given.is_outside[at] && holds { self.carried(node, given) } else { None };
                    if given.is_outside[at] && holds && carried.is_none() {
                        moved.outside.push(node);
                    }
                    moved.n_follow_parent += usize::from(follows_parent);
                    movable[i] |= !follows_parent;
                    // Nodes outside the cage that carry no vertices, such as a root on the floor or the end of a chain,
                    // follow their parent.
                    let by = if follows_parent {
                        parent.map_or(DVec3::ZERO, |p| moves[p].by)
                    } else {
                        let at_pivot = |motion: &Motion| motion.by(old[i].w_axis.truncate());
                        carried.as_ref().map_or(given.by[at], at_pivot)
                    };
                    let gradient = || match &carried {
                        Some(motion) => DMat3::from_mat4(motion.transform()),
                        None => gradient(given.by, at, self.diagonal),
                    };
                    let turns = given.joints == Joints::Turn;
                    let turn = turns.then(|| rotation(gradient())).flatten();
                    (by, turn.unwrap_or(DMat3::IDENTITY))
                }
                (None, None) => {
                    moved.n_follow_parent += usize::from(anchors[i].is_some());
                    if let Some(parent) = parent.filter(|&p| new[p] != old[p]) {
                        new[i] = new[parent] * local(&self.document.root.nodes[i]);
                        moves[i].by = (new[i].w_axis - old[i].w_axis).truncate();
                        moves[i].turn = moves[parent].turn;
                    }
                    continue;
                }
            };
            let by = if by.length() <= MIN_DISPLACEMENT * self.diagonal { DVec3::ZERO } else { by };
            (moves[i].by, moves[i].turn) = (by, turn);
            if by == DVec3::ZERO && turn == DMat3::IDENTITY {
                continue;
            }
            let linear = turn * DMat3::from_mat4(old[i]);
            new[i] = DMat4::from_mat3_translation(linear, old[i].w_axis.truncate() + by);
        }
        new
    }

    /// Computes scale factor and rotation of clip translations, by node. All nodes of a skeleton share one factor;
    /// otherwise, feet would detach from legs.
    ///
    /// The rotation is the part about the up axis of the rotation of the node inside the cage that, together with its
    /// descendants, carries the most vertices. Travel along the ground stays on the ground if the hips are tilted.
    /// The factor is the height of the hips above the skeleton's lowest vertex after the deformation, divided by this
    /// height before the deformation, within [`TRAVEL_SCALE_RANGE`]. The hips are the node above the floor that,
    /// together with its descendants, carries the most vertices.
    fn travel(&self, given: &Deformation<'_>, moves: &[NodeMove]) -> Vec<(f64, DMat3)> {
        let (skeletons, n_skeletons) = self.skeletons();
        let mut carried = self.held.clone();
        for &(node, parent) in self.worlds.order.iter().rev() {
            if let Some(parent) = parent {
                carried[parent as usize] += carried[node as usize];
            }
        }
        // Opposite corners of the box around the vertices of each skeleton, before and after the deformation.
        let mut boxes = vec![[[DVec3::INFINITY, DVec3::NEG_INFINITY]; 2]; n_skeletons];
        for part in self.parts.iter().filter(|part| part.slot.is_some()) {
            let joint =
                part.instance.skin.and_then(|skin| self.document.root.skins[skin as usize].joints.first());
            let holder = joint.map(Index::value).or(part.instance.node.map(|node| node as usize));
            let Some(skeleton) = holder.and_then(|node| skeletons[node]) else { continue };
            let motion = part.instance.node.and_then(|node| given.rigid.get(&node));
            for (v, (at, by)) in (part.first..).zip(part.rest().into_iter().zip(&given.by[part.first..])) {
                if given.carried.get(v) == Some(&true) {
                    continue;
                }
                let by = motion.map_or(*by, |motion| motion.by(at));
                for ([low, high], at) in boxes[skeleton].iter_mut().zip([at, at + by]) {
                    (*low, *high) = (low.min(at), high.max(at));
                }
            }
        }
        let mut hips = vec![(0.0, 1.0); n_skeletons];
        let mut headings = vec![(0.0, DMat3::IDENTITY); n_skeletons];
        for &(node, point) in &self.follows {
            let i = node as usize;
            let Some(skeleton) = skeletons[i] else { continue };
            if carried[i] > headings[skeleton].0 && !given.is_outside[point] {
                headings[skeleton] = (carried[i], about(moves[i].turn, given.up));
            }
            let at = self.worlds.world[i].w_axis.truncate();
            let heights = |corners: [DVec3; 2]| {
                let [a, b] = corners.map(|corner| corner.dot(given.up));
                [a.min(b), a.max(b)]
            };
            let [[low, high], [after, _]] = boxes[skeleton].map(heights);
            let (before, now) = (at.dot(given.up) - low, (at + moves[i].by).dot(given.up) - after);
            if carried[i] > hips[skeleton].0 && before > MIN_HIP_HEIGHT * (high - low) {
                let [size, size_now] = boxes[skeleton].map(|[low, high]| low.distance(high));
                let change = Some(size_now / size).filter(|change| change.is_finite()).unwrap_or(1.0);
                let (least, most) = TRAVEL_SCALE_RANGE;
                hips[skeleton] = (carried[i], (now / before).clamp(least * change, most * change));
            }
        }
        let of = |skeleton: usize| (hips[skeleton].1, headings[skeleton].1);
        skeletons.iter().map(|skeleton| skeleton.map_or((1.0, DMat3::IDENTITY), of)).collect()
    }

    /// Returns the skeleton index of each node that follows the cage, and a number that is larger than all these
    /// indices. Nodes belong to the same skeleton if their nearest ancestors that do not follow the cage are equal, or
    /// if a skin connects them.
    fn skeletons(&self) -> (Vec<Option<usize>>, usize) {
        let n = self.held.len();
        let top = |above: &[usize], mut node: usize| {
            while above[node] != node {
                node = above[node];
            }
            node
        };
        // Entry `n` stands for the missing parent of root nodes.
        let mut above: Vec<usize> = (0..=n).collect();
        let follows = self.following(None);
        for &(node, parent) in self.worlds.order.iter().filter(|(node, _)| follows[*node as usize]) {
            above[node as usize] = parent.map_or(n, |parent| above[parent as usize]);
        }
        for skin in &self.document.root.skins {
            let mut joints = skin.joints.iter().map(Index::value).filter(|&joint| joint < n);
            let Some(first) = joints.next().map(|joint| top(&above, joint)) else { continue };
            for joint in joints {
                let other = top(&above, joint);
                above[other] = first;
            }
        }
        let skeletons = (0..n).map(|node| follows[node].then(|| top(&above, node)));
        (skeletons.collect(), n + 1)
    }
}

/// The part of a rotation about `axis`, after the shortest rotation that moves the axis as the whole does is removed.
fn about(turn: DMat3, axis: DVec3) -> DMat3 {
    let turn = DQuat::from_mat3(&turn);
    let along = turn.xyz().dot(axis) * axis;
    let twist = DQuat::from_xyzw(along.x, along.y, along.z, turn.w);
    if twist.length() > 1e-6 { DMat3::from_quat(twist.normalize()) } else { DMat3::IDENTITY }
}

/// Sets the local transform of a node and of its JSON. A node with a matrix gets a matrix, another one a translation
/// and, if it `turns`, a rotation. Returns the change of its rotation.
fn set_local(node: &mut Node, json: &mut Value, to: &DMat4, turns: bool) -> Option<DQuat> {
    if node.matrix.is_some() {
        let linear = DMat3::from_mat4(if turns { *to } else { local(node) });
        let matrix = DMat4::from_mat3_translation(linear, to.w_axis.truncate()).as_mat4().to_cols_array();
        json["matrix"] = json!(matrix);
        node.matrix = Some(matrix);
        return None;
    }
    // Use the rotation of the change only, since the node's own scale can mirror.
    let change = DMat3::from_mat4(*to) * DMat3::from_mat4(local(node)).inverse();
    let translation = to.w_axis.truncate().as_vec3();
    json["translation"] = vector(translation);
    node.translation = Some(translation.to_array());
    let turn = rotation(change).filter(|_| turns)?;
    let before = node.rotation.as_ref().map(|r| DQuat::from_array(r.0.map(f64::from)).normalize());
    let before = before.unwrap_or(DQuat::IDENTITY);
    let after = (DQuat::from_mat3(&turn) * before).normalize();
    let rotation = after.as_quat().to_array();
    json["rotation"] = json!(rotation);
    node.rotation = Some(UnitQuaternion(rotation));
    Some(after * before.inverse())
}

/// Nodes with this name; unnamed nodes are called "node 7".
fn named(json: &Value, name: &str) -> Vec<u32> {
    let n = json["nodes"].as_array().map_or(0, Vec::len) as u32;
    (0..n).filter(|&node| name_of(json, "nodes", node, "node") == name).collect()
}

/// f32 vector as JSON.
pub(super) fn vector(v: Vec3) -> Value {
    json!(v.to_array())
}
