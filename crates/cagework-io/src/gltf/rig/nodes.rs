//! Nodes that follow the cage: joints and what hangs on them.

use std::collections::HashMap;

use ::gltf::json::Index;
use ::gltf::json::scene::{Node, UnitQuaternion};
use cagework_pose::parts::Motion;
use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};
use serde_json::{Value, json};

use super::surface::rotation;
use super::tracks::{self, Driven};
use super::{AROUND, Rig, STEP};
use crate::gltf::GltfDocument;
use crate::gltf::scene::{Worlds, local, name_of};

/// What becomes of the skeleton.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Joints {
    /// Joints go where the cage takes them and keep their direction: rotation and scale tracks stay as they are.
    #[default]
    Follow,
    /// Nothing of the skeleton changes: for skeletons that other files share.
    Stay,
    /// Joints turn with the shape, too.
    Turn,
}

/// Displacements below this, over the model's diagonal, are none.
const SMALL: f64 = 1e-6;
/// Bones shorter than this, over the diagonal, have no direction.
const SHORT: f64 = 1e-4;
/// Joints lower than this above the floor, over the height of what their skeleton holds, do not tell how long the legs are.
const LOW: f64 = 0.1;
/// Vertices inside the cage that tell how a rigid mesh moves, at least.
const LEAST: usize = 3;
/// Bounds of the ratio of heights.
const RATIOS: (f64, f64) = (0.2, 5.0);

/// How a node has changed, for its animations.
pub(super) struct Change {
    pub(super) from: DVec3,
    pub(super) to: DVec3,
    /// What the linear part of translations becomes in a track that stands still, and in one that moves.
    pub(super) still: DMat3,
    pub(super) moving: DMat3,
    /// What rotations are turned by, from the left.
    pub(super) turn: Option<DQuat>,
}

/// All nodes after the cage has moved.
pub(super) struct Moved {
    /// By node.
    pub(super) changes: Vec<Option<Change>>,
    pub(super) nodes: Vec<Node>,
    /// Of the numbers as they are written, in f32.
    pub(super) world: Vec<DMat4>,
    pub(super) n_moved: usize,
    /// Joints outside the cage: those that hold vertices, and those that hold none and go with their parent.
    pub(super) n_outside: usize,
    pub(super) n_loose: usize,
}

/// What nodes are moved with.
pub(super) struct Given<'a> {
    pub(super) by: &'a [DVec3],
    pub(super) is_outside: &'a [bool],
    pub(super) joints: Joints,
    pub(super) keep_travel: bool,
    /// How nodes move whose meshes keep their shape.
    pub(super) rigid: &'a HashMap<u32, Motion>,
    /// The file's axis that points up.
    pub(super) up: DVec3,
}

/// Gradient of the deformation at an anchor, by central differences.
pub(super) fn gradient(by: &[DVec3], anchor: usize, diagonal: f64) -> DMat3 {
    let column = |axis: usize| {
        let [plus, minus] = [1 + axis, 1 + axis + AROUND.len() / 2].map(|k| by[anchor + k]);
        DMat3::IDENTITY.col(axis) + (plus - minus) / (2.0 * STEP * diagonal)
    };
    DMat3::from_cols(column(0), column(1), column(2))
}

/// What holds vertices, by a skin or by carrying them: joints, nodes that clips move, bones of a person (VRM).
pub(super) fn holders(document: &GltfDocument) -> Vec<usize> {
    let json = &document.json;
    let animations = json["animations"].as_array().into_iter().flatten();
    let channels = animations.flat_map(|animation| animation["channels"].as_array().into_iter().flatten());
    let animated = channels.filter_map(|channel| match tracks::driven(channel)? {
        Driven::Translation(node) | Driven::Rotation(node) | Driven::Scale(node) => Some(node),
        Driven::Weights(_) | Driven::MeshWeights(_) => None,
    });
    let bones = |extension: &str| &json["extensions"][extension]["humanoid"]["humanBones"];
    let of_vrm0 = bones("VRM").as_array().into_iter().flatten();
    let of_vrm1 = bones("VRMC_vrm").as_object().into_iter().flat_map(|bones| bones.values());
    let bones = of_vrm0.chain(of_vrm1).filter_map(|bone| bone["node"].as_u64()).map(|node| node as usize);
    let joints = document.root.skins.iter().flat_map(|skin| &skin.joints).map(Index::value);
    joints.chain(animated).chain(bones).filter(|&node| node < document.root.nodes.len()).collect()
}

/// A node that follows the cage: a joint, one that a clip moves or that shows a mesh, or one below these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointPoint {
    /// Its number in the file.
    pub node: u32,
    /// Which of the points that are bound besides the vertices is its origin.
    pub point: usize,
    /// What it hangs on, by its number among the joints; none for a root. It comes before.
    pub parent: Option<usize>,
    /// Whether vertices hang on it: one that holds none and is outside the cage goes with its parent.
    pub holds: bool,
}

impl Rig<'_> {
    /// The nodes that follow, each after its parent.
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
                // Behind all ends.
                point: at - self.n_vertices - of_ends,
                parent: above.and_then(|above| numbers[above as usize]),
                holds: self.held[node as usize] > 0.0,
            });
        }
        joints
    }

    /// Names of the nodes of a skeleton that show a mesh without a skin.
    pub(crate) fn props(&self) -> Vec<String> {
        let name = |node| name_of(&self.document.json, "nodes", node, "node");
        self.follows.iter().map(|&(node, _)| node).filter(|&node| self.is_prop(node)).map(name).collect()
    }

    fn is_prop(&self, node: u32) -> bool {
        let of_node = &self.document.root.nodes[node as usize];
        of_node.mesh.is_some() && of_node.skin.is_none() && self.on_skeleton[node as usize]
    }

    /// The nodes of [`Self::props`] that have a name.
    pub(super) fn props_named(&self, name: &str) -> Vec<u32> {
        let follows = |node: &u32| self.follows.iter().any(|(follows, _)| follows == node);
        let named = named(&self.document.json, name).into_iter();
        named.filter(|&node| self.is_prop(node)).filter(follows).collect()
    }

    /// How they move if their meshes keep their shape: as near as a rigid motion is to how what the cage encloses of them would
    /// bend; as their origin does where that is too little.
    pub(super) fn motions(&self, props: &[u32], by: &[DVec3], is_outside: &[bool]) -> HashMap<u32, Motion> {
        let of = |&(node, at): &(u32, usize)| {
            let own = self.parts.iter().filter(|part| part.instance.node == Some(node));
            let points = own.flat_map(|part| (part.first..).zip(part.rest()));
            let inside: Vec<(DVec3, DVec3)> =
                points.filter(|&(v, _)| !is_outside[v]).map(|(v, rest)| (rest, by[v])).collect();
            if inside.len() >= LEAST {
                return (node, Motion::of(&inside));
            }
            let turn = rotation(gradient(by, at, self.diagonal)).unwrap_or(DMat3::IDENTITY);
            (node, Motion::about(self.worlds.world[node as usize].w_axis.truncate(), turn, by[at]))
        };
        self.follows.iter().filter(|(node, _)| props.contains(node)).map(of).collect()
    }

    /// Moves the nodes that follow, in `json` and as what they are now.
    pub(super) fn moved(&self, given: &Given<'_>, json: &mut Value) -> Moved {
        let root = &self.document.root;
        let n = root.nodes.len();
        let mut moved = Moved {
            changes: (0..n).map(|_| None).collect(),
            nodes: root.nodes.clone(),
            world: self.worlds.world.clone(),
            n_moved: 0,
            n_outside: 0,
            n_loose: 0,
        };
        let stays = given.joints == Joints::Stay;
        if stays && given.rigid.is_empty() {
            return moved;
        }
        let mut anchor = vec![None; n];
        // Of a skeleton that stays, what hangs on it rigidly still follows the cage.
        let goes = |node: u32| !stays || given.rigid.contains_key(&node);
        self.follows
            .iter()
            .filter(|(node, _)| goes(*node))
            .for_each(|&(node, at)| anchor[node as usize] = Some(at));
        let old = &self.worlds.world;
        let mut delta = vec![DVec3::ZERO; n];
        let mut new: Vec<DMat4> = Vec::from(old.as_slice());
        for &(node, parent) in &self.worlds.order {
            let i = node as usize;
            let Some(at) = anchor[i] else {
                if let Some(parent) = parent {
                    let parent = parent as usize;
                    if new[parent] != old[parent] {
                        new[i] = new[parent] * local(&root.nodes[i]);
                    }
                }
                continue;
            };
            if let Some(motion) = given.rigid.get(&node) {
                new[i] = motion.transform() * old[i];
                delta[i] = (new[i].w_axis - old[i].w_axis).truncate();
                continue;
            }
            let is_outside = given.is_outside[at];
            let is_loose = is_outside && self.held[i] <= 0.0;
            moved.n_outside += usize::from(is_outside && !is_loose);
            moved.n_loose += usize::from(is_loose);
            // It holds nothing: a root on the floor, a control, the end of a chain.
            let by = if is_loose { parent.map_or(DVec3::ZERO, |p| delta[p as usize]) } else { given.by[at] };
            delta[i] = if by.length() <= SMALL * self.diagonal { DVec3::ZERO } else { by };
            let turn = given.joints == Joints::Turn;
            let turn = turn.then(|| rotation(gradient(given.by, at, self.diagonal))).flatten();
            if delta[i] == DVec3::ZERO && turn.is_none_or(|t| t == DMat3::IDENTITY) {
                continue;
            }
            let linear = turn.unwrap_or(DMat3::IDENTITY) * DMat3::from_mat4(old[i]);
            new[i] = DMat4::from_mat3_translation(linear, old[i].w_axis.truncate() + delta[i]);
        }
        let travels = !given.keep_travel && json["animations"].as_array().is_some_and(|all| !all.is_empty());
        let ratios = if travels { self.ratios(given, &delta) } else { vec![1.0; n] };
        for &(node, parent) in &self.worlds.order {
            let i = node as usize;
            let [above, above_new] =
                [old, &new].map(|world| parent.map_or(DMat4::IDENTITY, |p| world[p as usize]));
            if anchor[i].is_none() || (new[i] == old[i] && above == above_new) {
                continue;
            }
            let to = above_new.inverse() * new[i];
            if !to.is_finite() {
                continue;
            }
            let from = local(&root.nodes[i]);
            let [t0, t1] = [from, to].map(|m| m.w_axis.truncate());
            moved.n_moved += 1;
            let of_json = &mut json["nodes"][i];
            let node = &mut moved.nodes[i];
            let mut turn = None;
            if node.matrix.is_some() {
                let matrix = to.as_mat4().to_cols_array();
                of_json["matrix"] = json!(matrix);
                node.matrix = Some(matrix);
            } else {
                let translation = t1.as_vec3().to_array();
                of_json["translation"] = json!(translation);
                node.translation = Some(translation);
                let turned = DMat3::from_mat4(new[i]) != DMat3::from_mat4(old[i])
                    || DMat3::from_mat4(above) != DMat3::from_mat4(above_new);
                // Of the change alone: its own scale may mirror it.
                let change = DMat3::from_mat4(to) * DMat3::from_mat4(from).inverse();
                if let Some(m) = rotation(change).filter(|_| turned) {
                    let before = node
                        .rotation
                        .as_ref()
                        .map_or(DQuat::IDENTITY, |r| DQuat::from_array(r.0.map(f64::from)).normalize());
                    let after = (DQuat::from_mat3(&m) * before).normalize();
                    let rotation = after.as_quat().to_array();
                    of_json["rotation"] = json!(rotation);
                    node.rotation = Some(UnitQuaternion(rotation));
                    turn = Some(after * before.inverse());
                }
            }
            // Where the parent scales, short is relative to it.
            let scale = DMat3::from_mat4(above).determinant().abs().cbrt().max(1e-12);
            let short = SHORT * self.diagonal / scale;
            let still = if t0.length().min(t1.length()) > short {
                let turn = DQuat::from_rotation_arc(t0.normalize(), t1.normalize());
                DMat3::from_quat(turn) * (t1.length() / t0.length())
            } else {
                DMat3::IDENTITY
            };
            let moving = DMat3::from_diagonal(DVec3::splat(ratios[i]));
            moved.changes[i] = Some(Change { from: t0, to: t1, still, moving, turn });
        }
        if moved.n_moved > 0 {
            let mut root = root.clone();
            root.nodes = std::mem::take(&mut moved.nodes);
            // They were a tree before.
            if let Ok(worlds) = Worlds::new(&root) {
                moved.world = worlds.world;
            }
            moved.nodes = root.nodes;
        }
        moved
    }

    /// By how much the translations of clips grow, by node; one number for a skeleton, or its feet would leave its legs.
    ///
    /// It is the ratio of the heights of its hips over the lowest vertex that it holds. The hips are the node that carries most
    /// of those that are not as low as the floor.
    fn ratios(&self, given: &Given<'_>, delta: &[DVec3]) -> Vec<f64> {
        let (skeletons, n_skeletons) = self.skeletons();
        let mut carried = self.held.clone();
        for &(node, parent) in self.worlds.order.iter().rev() {
            if let Some(parent) = parent {
                carried[parent as usize] += carried[node as usize];
            }
        }
        // Lowest and highest vertex at rest, and the lowest after.
        let mut spans = vec![[f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY]; n_skeletons];
        for part in self.parts.iter().filter(|part| part.slot.is_some()) {
            let joint =
                part.instance.skin.and_then(|skin| self.document.root.skins[skin as usize].joints.first());
            let holder = joint.map(Index::value).or(part.instance.node.map(|node| node as usize));
            let Some(skeleton) = holder.and_then(|node| skeletons[node]) else { continue };
            let motion = part.instance.node.and_then(|node| given.rigid.get(&node));
            for (at, by) in part.rest().into_iter().zip(&given.by[part.first..]) {
                let (height, by) = (at.dot(given.up), motion.map_or(*by, |motion| motion.by(at)));
                let [low, high, after] = &mut spans[skeleton];
                (*low, *high) = (low.min(height), high.max(height));
                *after = after.min(height + by.dot(given.up));
            }
        }
        let mut hips = vec![(0.0, 1.0); n_skeletons];
        for &(node, _) in &self.follows {
            let i = node as usize;
            let Some(skeleton) = skeletons[i] else { continue };
            let ([low, high, after], at) = (spans[skeleton], self.worlds.world[i].w_axis.truncate());
            let (before, now) = (at.dot(given.up) - low, (at + delta[i]).dot(given.up) - after);
            if carried[i] > hips[skeleton].0 && before > LOW * (high - low) {
                hips[skeleton] = (carried[i], (now / before).clamp(RATIOS.0, RATIOS.1));
            }
        }
        skeletons.iter().map(|skeleton| skeleton.map_or(1.0, |skeleton| hips[skeleton].1)).collect()
    }

    /// The number of the skeleton of each node that follows, and how many there are: what hangs on one node that does not follow,
    /// or has joints of the same skin, belongs together.
    fn skeletons(&self) -> (Vec<Option<usize>>, usize) {
        let n = self.held.len();
        let top = |above: &[usize], mut node: usize| {
            while above[node] != node {
                node = above[node];
            }
            node
        };
        // Number `n` is of what hangs on nothing.
        let mut above: Vec<usize> = (0..=n).collect();
        let mut follows = vec![false; n];
        self.follows.iter().for_each(|(node, _)| follows[*node as usize] = true);
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

/// The number of a node that has a name, or of the nodes that have it; "node 7" where the file has none.
fn named(json: &Value, name: &str) -> Vec<u32> {
    let n = json["nodes"].as_array().map_or(0, Vec::len) as u32;
    (0..n).filter(|&node| name_of(json, "nodes", node, "node") == name).collect()
}

/// f32 as JSON.
pub(super) fn vector(v: Vec3) -> Value {
    json!(v.to_array())
}
