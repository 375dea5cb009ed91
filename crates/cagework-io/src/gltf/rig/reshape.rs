//! Writing a reshaped document.

use std::collections::HashMap;

use cagework_pose::Parts;
use glam::{DMat4, DVec3, Mat4, Vec3};
use serde::Serialize;
use serde_json::Value;

use super::edit::Edit;
use super::lattice::MAX_ENDS;
use super::nodes::{Given, Joints};
use super::shape::{Shape, Turned};
use super::{Part, Rig, key_of, poses, tracks, vrm};
use crate::error::WriteError;
use crate::gltf::geometry::{Frame, triangles_of};
use crate::gltf::pack::push;
use crate::gltf::scene::Instance;
use crate::gltf::{GltfDocument, skin};
use crate::shown::shown;

/// How a rigged document is reshaped.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReshapeOptions {
    /// What becomes of the skeleton.
    pub joints: Joints,
    /// How far clips travel stays as it is; otherwise it grows as the height of the hips does.
    pub keep_travel: bool,
    /// Names of nodes below joints whose meshes keep their shape: buckles, eyes, weapons.
    pub rigid: Vec<String>,
    /// Vertices that the cage does not bend, in every state of theirs.
    pub parts: Parts,
    /// When each pose is shown, seconds; none: one after the other, a second each, from rest to rest.
    pub pose_seconds: Vec<f32>,
}

/// What was moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ReshapeReport {
    /// Joints and other nodes that follow: those that clips move or that carry meshes, and what hangs below.
    pub joints: usize,
    /// Of them, those whose transform was written anew.
    pub joints_moved: usize,
    /// Outside the cage, although they hold vertices: they follow it as its policy for points outside says.
    pub joints_outside: usize,
    /// Outside the cage and without vertices: they go with their parent.
    pub joints_loose: usize,
    /// Vertices in states of morph targets, besides the rest shape.
    pub morph_ends: usize,
    /// Of them, those outside the cage: they follow it as its policy for points outside says.
    pub morph_ends_outside: usize,
    /// Points of the lattice that they are read from where they are too many to be bound one by one; otherwise 0.
    pub lattice_points: usize,
    /// Distance of two of these, over the model's diagonal.
    pub lattice_cell: f64,
    /// Animation tracks that were written anew.
    pub tracks: usize,
    /// Animation tracks that could not be read, and stay as they are.
    pub tracks_unread: usize,
    /// Largest condition of a skinning matrix.
    pub max_condition: f64,
    /// Vertices whose skinning matrix cannot be undone: they go with their neighbours.
    pub singular_vertices: usize,
}

impl ReshapeReport {
    /// What a user should know of it, each a sentence.
    #[must_use]
    pub fn notices(&self) -> Vec<String> {
        let Self { joints, joints_moved, joints_outside, morph_ends, morph_ends_outside, tracks, .. } = self;
        let mut notices = Vec::new();
        let mut say = |n: usize, sentence: String| notices.extend((n > 0).then_some(sentence));
        say(
            *joints,
            format!(
                "{joints_moved} of {joints} joints and other nodes moved, {tracks} animation tracks with them"
            ),
        );
        say(
            *joints_outside,
            format!(
                "{joints_outside} joints or other nodes that hold vertices are outside the cage: near it they follow, far away they \
                 stay"
            ),
        );
        say(
            *morph_ends_outside,
            format!(
                "{morph_ends_outside} of {morph_ends} vertices of morph targets leave the cage: near it they follow, far \
                 away they stay; make a cage around them"
            ),
        );
        let (n, cell) = (self.lattice_points, 100.0 * self.lattice_cell);
        say(
            n,
            format!(
                "the morph targets move {morph_ends} vertices, more than the {MAX_ENDS} that are bound one by one: what they \
                 add is read between {n} points, {cell:.1} % of the model's size apart"
            ),
        );
        let n = self.singular_vertices;
        say(n, format!("{n} vertices are flattened by their skin: they go with their neighbours"));
        let n = self.tracks_unread;
        say(n, format!("{n} animation tracks cannot be read: they stay as they are"));
        notices
    }
}

/// A pose by name: how far each point moves. `[n_points]`, world space as the file has it.
pub(crate) struct Named<'a> {
    pub(crate) name: &'a str,
    pub(crate) by: &'a [DVec3],
}

/// Writes the document with its points moved `by`, or, with poses, at rest and with a morph target more for each pose.
///
/// `triangles` of the model; `is_outside`: of each point; counts are the caller's to check.
pub(crate) fn reshape(
    document: &GltfDocument,
    rig: &Rig<'_>,
    triangles: &[[u32; 3]],
    (by, is_outside): (&[DVec3], &[bool]),
    poses: &[Named<'_>],
    (options, up): (&ReshapeOptions, DVec3),
) -> Result<(Vec<u8>, ReshapeReport), WriteError> {
    if options.joints == Joints::Turn && document.json.pointer("/extensions/VRM").is_some() {
        let message = "the bones of a VRM 0 have no rotation of their own, and must not get one: let joints follow or stay, \
            or convert the file to VRM 1";
        return Err(WriteError::Document(message.into()));
    }
    let mut edit = Edit::new(document);
    let mut rigid = Vec::new();
    for name in &options.rigid {
        let found = rig.props_named(name);
        if found.is_empty() {
            let name = shown(name);
            return Err(WriteError::Document(format!(
                "there is no node '{name}' below a joint to keep rigid: see the names with cagework info"
            )));
        }
        rigid.extend(found);
    }
    let mut report = ReshapeReport {
        joints: rig.follows.len(),
        morph_ends: rig.n_ends,
        morph_ends_outside: rig.ends_outside(is_outside),
        lattice_points: rig.lattice.as_ref().map_or(0, |lattice| lattice.nodes.len()),
        lattice_cell: rig.lattice.as_ref().map_or(0.0, |lattice| lattice.cell / rig.diagonal),
        ..ReshapeReport::default()
    };
    let has_moved = by.iter().any(|&by| by != DVec3::ZERO);
    if has_moved || !poses.is_empty() {
        separate(rig, &mut edit);
    }
    if has_moved {
        let (joints, keep_travel) = (options.joints, options.keep_travel);
        let motions = rig.motions(&rigid, by, is_outside);
        let given = Given { by, is_outside, joints, keep_travel, rigid: &motions, up };
        let moved = rig.moved(&given, &mut edit.json);
        report.joints_moved = moved.n_moved;
        report.joints_outside = moved.n_outside;
        report.joints_loose = moved.n_loose;
        let binds = write_binds(rig, &mut edit, &moved.world);
        let turned = Turned::new(triangles, by);
        for part in &rig.parts {
            if part.instance.node.is_some_and(|node| motions.contains_key(&node)) {
                continue;
            }
            let frame = rig.frame(part, &moved.world, &binds)?;
            let Some(shape) = rig.shape(part, &turned, &frame)? else { continue };
            let states = shape.targets.iter().map(|target| &target.positions).chain([&shape.positions]);
            // As a reader will see them, after rounding.
            let is_seen = |(v, p): (usize, &DVec3)| {
                frame.world(v).transform_point3(p.as_vec3().as_dvec3()).as_vec3().is_finite()
            };
            if states.flatten().any(|p| !p.as_vec3().is_finite())
                || !shape.positions.iter().enumerate().all(is_seen)
            {
                return Err(WriteError::Document(format!(
                    "mesh {}: its skin shrinks or stretches vertices so much that their new places are beyond numbers of 32 bits; \
                     write it without its rig (--static)",
                    part.instance.mesh
                )));
            }
            report.max_condition = report.max_condition.max(shape.condition);
            report.singular_vertices += shape.n_singular;
            write_part(rig, &mut edit, part, &shape);
        }
        tracks::rescale(document, &mut edit, &moved.changes, &mut report);
        vrm::write(rig, &given, &moved.world, &mut edit.json);
    }
    poses::append(rig, &mut edit, triangles, (poses, &options.pose_seconds), (&rigid, is_outside))?;
    Ok((edit.finish()?, report))
}

impl Rig<'_> {
    /// Ends of morph targets outside the cage.
    fn ends_outside(&self, is_outside: &[bool]) -> usize {
        let targets = self.parts.iter().flat_map(|part| &part.targets);
        let ends = targets.flat_map(|t| t.ends.iter().flatten().map(|&first| first..first + t.moved.len()));
        ends.map(|points| is_outside[points].iter().filter(|outside| **outside).count()).sum()
    }

    /// Triangles of a part's own vertices; none of points and lines.
    pub(super) fn triangles(&self, part: &Part, all: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let Some(slot) = part.slot.map(|slot| &self.document.slots[slot]) else {
            // What no scene shows, such as a coarser level of detail; what cannot be read has none.
            let own = triangles_of(self.document, part.primitive(self.document), part.local.len());
            return own.unwrap_or_default();
        };
        all[slot.triangles.clone()].iter().map(|t| t.map(|v| v - slot.start)).collect()
    }

    /// Skinning matrices of a part where the nodes are now.
    fn frame(
        &self,
        part: &Part,
        world: &[DMat4],
        binds: &HashMap<u32, Vec<DMat4>>,
    ) -> Result<Frame, WriteError> {
        let node = part.instance.node.map_or(part.instance.world, |node| world[node as usize]);
        let Some(number) = part.instance.skin else { return Ok(Frame::Rigid(node)) };
        let joints = &self.document.root.skins[number as usize].joints;
        let joints: Vec<DMat4> =
            joints.iter().zip(&binds[&number]).map(|(j, &bind)| world[j.value()] * bind).collect();
        let source = self.document.source();
        let primitive = part.primitive(self.document);
        let (all, _) = skin::matrices(source, (number, &joints), node, primitive, part.local.len())?;
        Ok(Frame::Skinned(all))
    }
}

/// Gives meshes that several nodes show, each in its own way, a copy for each of them but the first.
fn separate(rig: &Rig<'_>, edit: &mut Edit<'_>) {
    let mut first = HashMap::new();
    let mut copies = HashMap::new();
    let document = rig.document;
    for instance in document.instances.iter().chain(&document.elsewhere) {
        let key = key_of(instance);
        let mesh = instance.mesh as usize;
        if *first.entry(mesh).or_insert(key) == key {
            continue;
        }
        let copy = *copies.entry(key).or_insert_with(|| {
            let copy = edit.json["meshes"][mesh].clone();
            push(&mut edit.json, "meshes", copy)
        });
        if let Some(node) = instance.node {
            edit.json["nodes"][node as usize]["mesh"] = copy.into();
        }
    }
    if !copies.is_empty() {
        edit.count_uses();
    }
}

/// Inverse bind matrices with which every joint holds its vertices as before, as they are in f32.
fn write_binds(rig: &Rig<'_>, edit: &mut Edit<'_>, world: &[DMat4]) -> HashMap<u32, Vec<DMat4>> {
    let mut all = rig.binds.clone();
    let mut numbers: Vec<u32> = all.keys().copied().collect();
    numbers.sort_unstable();
    for number in numbers {
        let skin = &rig.document.root.skins[number as usize];
        let Some(binds) = all.get_mut(&number) else { continue };
        let mut has_changed = false;
        for (joint, bind) in skin.joints.iter().zip(binds.iter_mut()) {
            let [old, new] = [&rig.worlds.world[joint.value()], &world[joint.value()]];
            let back = new.inverse();
            if old != new && back.is_finite() {
                *bind = (back * *old * *bind).as_mat4().as_dmat4();
                has_changed = true;
            }
        }
        if has_changed {
            let values: Vec<[f32; 16]> =
                binds.iter().map(|b: &DMat4| Mat4::to_cols_array(&b.as_mat4())).collect();
            let accessor = skin.inverse_bind_matrices.map(|a| a.value());
            let accessor = edit.write(accessor, &values, false, false);
            edit.json["skins"][number as usize]["inverseBindMatrices"] = accessor.into();
        }
    }
    all
}

/// The mesh that an instance has by now.
pub(super) fn mesh_of(edit: &Edit<'_>, instance: &Instance) -> usize {
    let of_node = |node: u32| edit.json["nodes"][node as usize]["mesh"].as_u64();
    instance.node.and_then(of_node).map_or(instance.mesh as usize, |mesh| mesh as usize)
}

fn write_part(rig: &Rig<'_>, edit: &mut Edit<'_>, part: &Part, shape: &Shape) {
    let mesh = mesh_of(edit, &part.instance);
    let number = part.primitive as usize;
    let before = part.primitive(rig.document);
    let path = |rest: &str| format!("/meshes/{mesh}/primitives/{number}/{rest}");
    let mut put = |rest: &str, write: &mut dyn FnMut(&mut Edit<'_>, Option<usize>) -> usize| {
        let path = path(rest);
        let accessor = edit.json.pointer(&path).and_then(Value::as_u64).map(|a| a as usize);
        let written = write(edit, accessor);
        if let Some(reference) = edit.json.pointer_mut(&path) {
            *reference = written.into();
        }
    };
    let narrow = |all: &[DVec3]| -> Vec<[f32; 3]> { all.iter().map(|p| p.as_vec3().to_array()).collect() };
    put("attributes/POSITION", &mut |edit, a| edit.write(a, &narrow(&shape.positions), true, true));
    if let Some(normals) = &shape.normals {
        put("attributes/NORMAL", &mut |edit, a| edit.write(a, &narrow(normals), true, false));
    }
    if let Some(tangents) = &shape.tangents {
        let values: Vec<[f32; 4]> =
            tangents.iter().map(|(t, w)| Vec3::extend(t.as_vec3(), *w).to_array()).collect();
        put("attributes/TANGENT", &mut |edit, a| edit.write(a, &values, true, false));
    }
    for (k, (deltas, target)) in shape.targets.iter().zip(before.targets.iter().flatten()).enumerate() {
        if target.positions.is_some() && !part.targets[k].moved.is_empty() {
            put(&format!("targets/{k}/POSITION"), &mut |edit, a| {
                edit.write(a, &narrow(&deltas.positions), true, true)
            });
        }
        for (what, values) in [("NORMAL", &deltas.normals), ("TANGENT", &deltas.tangents)] {
            if let Some(values) = values {
                put(&format!("targets/{k}/{what}"), &mut |edit, a| {
                    edit.write(a, &narrow(values), true, false)
                });
            }
        }
    }
}
