//! Reshapes rigged and morphed documents.
//!
//! The cage deforms the rest shape, and the skeleton is fitted to it. With `M` the skinning matrix of a
//! vertex at rest (without a skin, the node's world transform) and `f(x) = x + by(x)` the deformation, a
//! vertex p becomes `M'^-1 f(M p)`. Joints follow the cage. Their inverse bind matrices B change so that `G'
//! B' = G B` for the joint's world transform G, hence `M' = M` for any bind pose of the file; module `binds` has an exception.
//!
//! [`Rig`] lists the points to bind: vertices, ends of morph targets (or a lattice around them), nodes that
//! follow the cage, and offsets stored in VRM. An end is a vertex with one morph target at weight 0 or 1.
//! [`reshape()`] writes the document.

mod binds;
mod carried;
mod clip;
mod edit;
mod expressions;
mod feet;
mod ground;
mod joint_player;
mod lattice;
mod lift;
mod nodes;
mod overlap;
mod play;
mod poses;
mod report;
mod reshape;
mod rest;
mod shape;
mod skeleton;
mod tracks;
mod tree;
mod vrm;

use std::collections::{HashMap, HashSet};

use ::gltf::json::mesh::{Primitive, Semantic};
use cagework_core::Bounds;
use cagework_pose::Parts as HeldParts;
use glam::{DMat4, DVec3, Vec3};

use super::geometry::{Frame, attribute, vectors};
use super::patch::is_flat;
use super::scene::{Instance, Worlds};
use super::{GltfDocument, GltfError, skin};
use crate::origin::relative;

pub use clip::Clip;
pub(crate) use clip::clips;
pub use expressions::Vrm;
pub(crate) use expressions::vrm;
pub use feet::Feet;
pub use ground::Ground;
pub use joint_player::JointPlayer;
use lattice::Lattice;
pub use nodes::{JointPoint, Joints};
pub use play::{Player, RigPose};
pub(crate) use poses::PoseDisplacements;
pub use report::ReshapeReport;
pub use reshape::ReshapeOptions;
pub(crate) use reshape::{PointMoves, reshape, skeleton, write_moved, write_targets};
pub(crate) use rest::rest_rig;
pub use skeleton::Skeleton;
pub(crate) use skeleton::joints_with_vertices;
use vrm::VrmPoint;

/// Step of the central differences for the deformation gradient at a node, as a fraction of the model's diagonal.
const GRADIENT_STEP: f64 = 0.02;

/// Directions from a node's origin to the six points that measure the deformation gradient.
const PROBE_DIRECTIONS: [DVec3; 6] = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];

/// Points of a rigged document that the cage deforms. Point indices count the model's vertices first, then `extras`.
pub(crate) struct Rig<'a> {
    document: &'a GltfDocument,
    worlds: Worlds,
    /// Inverse bind matrices of the skins in use.
    binds: HashMap<u32, Vec<DMat4>>,
    parts: Vec<RigPrimitive>,
    /// Nodes that follow the cage, parents first, each with the index of the first of its seven points: its origin,
    /// then the six points around the origin.
    follows: Vec<(u32, usize)>,
    /// For each node, the sum of its weights as a joint, plus the number of vertices of the unskinned meshes that it
    /// carries ([`Self::hold_without_skins`]). `[n_nodes]`
    held: Vec<f64>,
    /// Whether each node is a joint, a node animated by clips, a VRM bone, or a descendant of one of these. `[n_nodes]`
    on_skeleton: Vec<bool>,
    vrm_points: Vec<VrmPoint>,
    n_vertices: usize,
    /// Origin of the model's positions, in world space. All other positions in this struct are absolute.
    origin: DVec3,
    /// Diagonal of the bounding box of the model in all its morph states, object units.
    diagonal: f64,
    /// World positions of the additional points to bind: ends of morph targets, points of nodes and VRM points.
    extras: Vec<DVec3>,
    n_ends: usize,
    /// Lattice whose nodes are bound instead of the ends of morph targets; `None` if the ends are few.
    lattice: Option<Lattice>,
}

/// A primitive that is placed by a node or deformed by a skin.
struct RigPrimitive {
    instance: Instance,
    primitive: u32,
    /// Point index of the primitive's first vertex.
    first: usize,
    /// Index of the document's slot; `None` if the primitive has no triangles or is not visible.
    slot: Option<usize>,
    frame: Frame,
    /// Vertex positions in mesh space, as the file has them.
    local: Vec<DVec3>,
    targets: Vec<Target>,
}

/// A morph target of a primitive.
struct Target {
    default: f64,
    /// Vertices that the target moves, ascending, and their deltas in mesh space.
    moved: Vec<u32>,
    deltas: Vec<DVec3>,
    /// For the weights 0 and 1: point index of the first moved vertex with this target at that weight and all other
    /// targets at their default weights. The points of the other moved vertices follow. `None` if that weight is the
    /// target's default, so that the vertices are at rest, or if no vertex moves.
    ends: [Option<usize>; 2],
}

impl RigPrimitive {
    fn primitive<'a>(&self, document: &'a GltfDocument) -> &'a Primitive {
        &document.root.meshes[self.instance.mesh as usize].primitives[self.primitive as usize]
    }

    /// Vertex positions at rest, world space.
    fn rest(&self) -> Vec<DVec3> {
        let mut local = self.local.clone();
        for target in &self.targets {
            for (&v, &delta) in target.moved.iter().zip(&target.deltas) {
                local[v as usize] += target.default * delta;
            }
        }
        local.iter().enumerate().map(|(v, &p)| self.frame.world(v).transform_point3(p)).collect()
    }
}

impl<'a> Rig<'a> {
    /// Reads the rig of a document. `rest`: vertices of the model, relative to `origin`.
    ///
    /// # Errors
    /// If a primitive cannot be read. Primitives of visible meshes are readable, because they were validated when the
    /// file was read.
    pub(crate) fn new(document: &'a GltfDocument, rest: &[Vec3], origin: DVec3) -> Result<Self, GltfError> {
        let worlds = Worlds::new(&document.root)?;
        let mut rig = Self {
            document,
            binds: HashMap::new(),
            parts: Vec::new(),
            follows: Vec::new(),
            held: vec![0.0; document.root.nodes.len()],
            on_skeleton: vec![false; document.root.nodes.len()],
            vrm_points: Vec::new(),
            n_vertices: rest.len(),
            origin,
            diagonal: 0.0,
            extras: Vec::new(),
            n_ends: 0,
            lattice: None,
            worlds,
        };
        let mut seen = HashSet::new();
        let slots = (0..).zip(&document.slots).map(|(k, slot)| ((slot.instance as usize, slot.primitive), k));
        let slots: HashMap<(usize, u32), usize> = slots.collect();
        let shown = document.instances.iter().enumerate().map(|(k, i)| (Some(k), i));
        for (shown, instance) in shown.chain(document.elsewhere.iter().map(|i| (None, i))) {
            let key = key_of(instance);
            if seen.contains(&key) {
                continue;
            }
            let slot = |primitive| slots.get(&(shown?, primitive)).copied();
            let added = rig.add_instance(slot, instance);
            if shown.is_some() {
                added?;
            } else if added.is_err() {
                // Meshes outside the scene that cannot be read stay unchanged.
                continue;
            }
            seen.insert(key);
        }
        let states: Vec<Vec3> =
            rest.iter().copied().chain(rig.extras.iter().map(|&p| relative(p, origin))).collect();
        rig.diagonal = Bounds::around(&states).map_or(0.0, |b| f64::from(b.diagonal()));
        rig.add_nodes();
        rig.hold_without_skins();
        rig.vrm_points = vrm::points(document, &rig.worlds, rig.diagonal);
        for k in 0..rig.vrm_points.len() {
            rig.vrm_points[k].bound_index = rig.n_vertices + rig.extras.len();
            rig.anchor(rig.vrm_points[k].at);
        }
        // Replace non-finite points, which cannot be bound, by the origin.
        for point in &mut rig.extras {
            if !point.as_vec3().is_finite() {
                *point = origin;
            }
        }
        rig.lattice = rig.lattice();
        Ok(rig)
    }

    /// Whether the document has skins, morph targets or nodes that an export must adapt to the deformation.
    pub(crate) fn is_needed(document: &GltfDocument) -> bool {
        let instances = || document.instances.iter();
        let follow = || !nodes::holders(document).is_empty() || instances().any(|i| has_pivot(&i.world));
        Self::has_skin_or_targets(document) || !instances().any(|i| is_flat(i.world)) && follow()
    }

    /// Whether the document has skins or morph targets, which an export without reshaping removes.
    pub(crate) fn has_skin_or_targets(document: &GltfDocument) -> bool {
        let morphs = |mesh: u32| {
            let primitives = &document.root.meshes[mesh as usize].primitives;
            primitives.iter().any(|p| p.targets.as_ref().is_some_and(|t| !t.is_empty()))
        };
        document.instances.iter().any(|i| i.skin.is_some() || morphs(i.mesh))
    }

    /// Ends of the morph targets of visible meshes, relative to the origin.
    pub(crate) fn shown_ends(&self) -> impl Iterator<Item = Vec3> {
        let shown = self.parts.iter().filter(|part| part.slot.is_some());
        let ends = shown.flat_map(lattice::ends);
        let ends = ends.flat_map(|(target, first)| &self.extras[self.range(target, first)]);
        ends.map(|&end| relative(end, self.origin))
    }

    /// Returns the displacements of all points, with `parts` kept in place or rigid. `by`: displacements without regard
    /// to `parts`. `rest`: `[n_vertices]`.
    pub(crate) fn held(&self, parts: &HeldParts, rest: &[Vec3], mut by: Vec<DVec3>) -> Vec<DVec3> {
        if parts.is_empty() {
            return by;
        }
        let rest: Vec<DVec3> = rest.iter().map(|p| p.as_dvec3()).collect();
        let held = parts.held(&rest, &by[..rest.len()]);
        for part in self.parts.iter().filter(|part| part.slot.is_some()) {
            for (target, first) in lattice::ends(part) {
                let ends = &self.extras[self.range(target, first)];
                for ((&v, &end), by) in target.moved.iter().zip(ends).zip(&mut by[first..]) {
                    *by = held.by(part.first as u32 + v, end - self.origin, *by);
                }
            }
        }
        for (v, (&at, by)) in (0..).zip(rest.iter().zip(&mut by)) {
            *by = held.by(v, at, *by);
        }
        by
    }

    /// Adds the primitives of an instance. `slot`: returns the index of the document's slot of a primitive, if it is
    /// visible.
    fn add_instance(
        &mut self,
        slot: impl Fn(u32) -> Option<usize>,
        instance: &Instance,
    ) -> Result<(), GltfError> {
        let document = self.document;
        let mut joints = Vec::new();
        if let Some(number) = instance.skin {
            let skin = &document.root.skins[number as usize];
            let binds = skin::inverse_binds(document, number)?;
            joints = skin::joints(document, number, &self.worlds, &binds)?;
            self.binds.insert(number, binds);
            for primitive in &document.root.meshes[instance.mesh as usize].primitives {
                let Some(positions) = attribute(primitive, Semantic::Positions) else { continue };
                let count = document.source().count(positions)? as usize;
                skin::each_influence(document.source(), primitive, count, |_, joint, weight| {
                    if let Some(node) = skin.joints.get(joint as usize) {
                        self.held[node.value()] += weight;
                    }
                })?;
            }
        }
        let mut parts = Vec::new();
        let (before, n_ends) = (self.extras.len(), self.n_ends);
        let primitives = &document.root.meshes[instance.mesh as usize].primitives;
        for (number, primitive) in (0..).zip(primitives) {
            match self.part(instance, primitive, number, slot(number), &joints) {
                Ok(Some(part)) => parts.push(part),
                Ok(None) => {}
                Err(error) => {
                    self.extras.truncate(before);
                    self.n_ends = n_ends;
                    return Err(error);
                }
            }
        }
        self.parts.append(&mut parts);
        Ok(())
    }

    fn part(
        &mut self,
        instance: &Instance,
        primitive: &Primitive,
        number: u32,
        slot: Option<usize>,
        joints: &[DMat4],
    ) -> Result<Option<RigPrimitive>, GltfError> {
        let document = self.document;
        let Some(positions) = attribute(primitive, Semantic::Positions) else { return Ok(None) };
        let local = vectors(document, positions, "POSITION")?;
        let frame = match instance.skin {
            None => Frame::Rigid(instance.world),
            Some(skin) => {
                let (source, n) = (document.source(), local.len());
                let (all, _) = skin::matrices(source, (skin, joints), instance.world, primitive, n)?;
                Frame::Skinned(all)
            }
        };
        let first = slot.map(|slot| document.slots[slot].start as usize);
        let mut part = RigPrimitive {
            instance: instance.clone(),
            primitive: number,
            first: first.unwrap_or(self.n_vertices + self.extras.len()),
            slot,
            frame,
            local,
            targets: Vec::new(),
        };
        let defaults = document.default_weights(instance);
        for (k, target) in primitive.targets.iter().flatten().enumerate() {
            let default = defaults.and_then(|w| w.get(k)).map_or(0.0, |&w| f64::from(w));
            let mut of = Target { default, moved: Vec::new(), deltas: Vec::new(), ends: [None; 2] };
            if let Some(accessor) = target.positions {
                let deltas = vectors(document, accessor.value() as u32, "POSITION")?;
                for (v, delta) in deltas.into_iter().enumerate().take(part.local.len()) {
                    if !delta.is_finite() {
                        return Err(GltfError::NotFinite { accessor: accessor.value() as u32, vertex: v });
                    }
                    if delta != DVec3::ZERO {
                        of.moved.push(v as u32);
                        of.deltas.push(delta);
                    }
                }
            }
            part.targets.push(of);
        }
        let rest = part.rest();
        if slot.is_none() {
            self.extras.extend(&rest);
        }
        for target in &mut part.targets {
            for (end, at) in target.ends.iter_mut().zip([0.0, 1.0]) {
                let share = at - target.default;
                if share == 0.0 || target.moved.is_empty() {
                    continue;
                }
                *end = Some(self.n_vertices + self.extras.len());
                self.n_ends += target.moved.len();
                let ends = target.moved.iter().zip(&target.deltas).map(|(&v, &delta)| {
                    rest[v as usize] + part.frame.world(v as usize).transform_vector3(share * delta)
                });
                self.extras.extend(ends);
            }
        }
        Ok(Some(part))
    }

    /// Adds the nodes that follow the cage: joints, animated nodes, VRM bones, nodes with unskinned meshes and a pivot,
    /// and the descendants of these. Excludes descendants with skinned meshes, because the transform of such a node has
    /// no effect on its mesh.
    fn add_nodes(&mut self) {
        let nodes = &self.document.root.nodes;
        for node in nodes::holders(self.document) {
            self.on_skeleton[node] = true;
        }
        let is_holder = self.on_skeleton.clone();
        self.worlds.mark_below(&mut self.on_skeleton);
        let mut below = self.on_skeleton.clone();
        for ((below, node), world) in below.iter_mut().zip(nodes).zip(&self.worlds.world) {
            *below |= node.mesh.is_some() && node.skin.is_none() && has_pivot(world);
        }
        self.worlds.mark_below(&mut below);
        for (node, _) in self.worlds.order.clone() {
            if below[node as usize] && (nodes[node as usize].skin.is_none() || is_holder[node as usize]) {
                self.follows.push((node, self.n_vertices + self.extras.len()));
                self.anchor(self.worlds.world[node as usize].w_axis.truncate());
            }
        }
    }

    /// Adds the number of vertices of each unskinned mesh to `held`: for the mesh's node if it has a pivot, and for the
    /// nearest ancestor that is a joint, an animated node or a VRM bone.
    fn hold_without_skins(&mut self) {
        let mut holders = vec![None; self.held.len()];
        for node in nodes::holders(self.document) {
            holders[node] = Some(node);
        }
        for &(node, parent) in &self.worlds.order {
            holders[node as usize] = holders[node as usize].or(parent.and_then(|p| holders[p as usize]));
        }
        for part in &self.parts {
            let Some(node) = part.instance.node.filter(|_| part.instance.skin.is_none()) else { continue };
            let (node, n) = (node as usize, part.local.len() as f64);
            if has_pivot(&part.instance.world) {
                self.held[node] += n;
            }
            if let Some(holder) = holders[node].filter(|&holder| holder != node) {
                self.held[holder] += n;
            }
        }
    }

    fn anchor(&mut self, at: DVec3) {
        self.extras.push(at);
        self.extras.extend(PROBE_DIRECTIONS.map(|way| at + GRADIENT_STEP * self.diagonal * way));
    }
}

/// Whether a node's origin differs from the world origin. A node at the world origin has no intended pivot.
fn has_pivot(world: &DMat4) -> bool {
    world.w_axis.truncate() != DVec3::ZERO
}

/// Key of an instance's deformation. Instances with equal keys are deformed equally.
fn key_of(instance: &Instance) -> (u32, Option<u32>, Option<u32>) {
    (instance.mesh, instance.skin, instance.skin.is_none().then_some(instance.node).flatten())
}
