//! Reshapes a rigged document and writes it.

use std::collections::HashMap;

use cagework_pose::Parts;
use glam::{DMat4, DVec3, Mat4, Vec3};
use serde_json::Value;

use super::edit::Edit;
use super::nodes::{Deformation, Joints};
use super::poses::PoseDisplacements;
use super::report::ReshapeReport;
use super::shape::{Shape, SurfaceGradients};
use super::{Rig, RigPrimitive, key_of, poses, tracks, vrm};
use crate::error::WriteError;
use crate::gltf::geometry::{Frame, triangles_of};
use crate::gltf::pack::push;
use crate::gltf::{GltfDocument, skin};
use crate::shown::shown;
use crate::timeline::Timeline;

/// Options for reshaping a rigged document.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReshapeOptions {
    /// How the skeleton follows the cage.
    pub joints: Joints,
    /// Whether translations of clips stay unchanged. Otherwise they scale with the height of the hips.
    pub keep_travel: bool,
    /// Names of nodes with unskinned meshes that stay rigid, such as buckles, eyes and weapons.
    pub rigid: Vec<String>,
    /// Vertices that stay in place or keep their shape.
    pub parts: Parts,
    /// When the clip of the poses shows each of them; `None` for one per second, starting and ending at rest.
    pub timeline: Option<Timeline>,
}

/// Writes the document with points displaced by `by`; with `poses`, at rest with one more morph target per pose.
///
/// `triangles`: of the model. `is_outside`: whether each point is outside the cage. The caller checks the counts.
pub(crate) fn reshape(
    document: &GltfDocument,
    rig: &Rig<'_>,
    triangles: &[[u32; 3]],
    (by, is_outside): (&[DVec3], &[bool]),
    poses: &[PoseDisplacements<'_>],
    (options, up): (&ReshapeOptions, DVec3),
) -> Result<(Vec<u8>, ReshapeReport), WriteError> {
    if options.joints == Joints::Turn && document.json.pointer("/extensions/VRM").is_some() {
        let message = "bones of a VRM 0 cannot have rotations: choose --joints follow or stay, or convert the file to VRM 1";
        return Err(WriteError::Document(message.into()));
    }
    let mut edit = Edit::new(document);
    let mut rigid = Vec::new();
    for name in &options.rigid {
        let found = rig.props_named(name);
        if found.is_empty() {
            let name = shown(name);
            return Err(WriteError::Document(format!(
                "there is no node '{name}' attached to a joint that could stay rigid: cagework info lists the names"
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
        let given = Deformation { by, is_outside, joints, keep_travel, rigid: &motions, up };
        let moved = rig.moved(&given, &mut edit.json);
        report.joints_moved = moved.n_moved;
        report.joints_outside = moved.n_outside;
        report.joints_loose = moved.n_loose;
        let binds = write_binds(rig, &mut edit, &moved.world);
        let turned = SurfaceGradients::new(triangles, by);
        for part in &rig.parts {
            if part.instance.node.is_some_and(|node| motions.contains_key(&node)) {
                continue;
            }
            let frame = rig.frame(part, &moved.world, &binds)?;
            let Some(shape) = rig.shape(part, &turned, &frame)? else { continue };
            let states = shape.targets.iter().map(|target| &target.positions).chain([&shape.positions]);
            // Check the values that readers get, after rounding to f32.
            let is_seen = |(v, p): (usize, &DVec3)| {
                frame.world(v).transform_point3(p.as_vec3().as_dvec3()).as_vec3().is_finite()
            };
            if states.flatten().any(|p| !p.as_vec3().is_finite())
                || !shape.positions.iter().enumerate().all(is_seen)
            {
                return Err(WriteError::Document(format!(
                    "mesh {}: its skin scales vertices so strongly that their new positions exceed the range of f32; \
                     export it without the rig (--static)",
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
    let every_second = Timeline::every_second(poses.len());
    let timeline = options.timeline.as_ref().filter(|_| !poses.is_empty()).unwrap_or(&every_second);
    timeline.require(poses.len())?;
    poses::append(rig, &mut edit, triangles, (poses, timeline), (&rigid, is_outside))?;
    Ok((edit.finish()?, report))
}

impl Rig<'_> {
    /// Number of ends of morph targets outside the cage.
    fn ends_outside(&self, is_outside: &[bool]) -> usize {
        let targets = self.parts.iter().flat_map(|part| &part.targets);
        let ends = targets.flat_map(|t| t.ends.iter().flatten().map(|&first| first..first + t.moved.len()));
        ends.map(|points| is_outside[points].iter().filter(|outside| **outside).count()).sum()
    }

    /// Triangles of a primitive, with indices of the primitive's own vertices; empty for points and lines.
    pub(super) fn triangles(&self, part: &RigPrimitive, all: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let Some(slot) = part.slot.map(|slot| &self.document.slots[slot]) else {
            // Meshes outside the scene are not among the model's triangles. Unreadable meshes get no triangles.
            let own = triangles_of(self.document, part.primitive(self.document), part.local.len());
            return own.unwrap_or_default();
        };
        all[slot.triangles.clone()].iter().map(|t| t.map(|v| v - slot.start)).collect()
    }

    /// Skinning matrices of a primitive after the update of the nodes.
    fn frame(
        &self,
        part: &RigPrimitive,
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

/// Duplicates meshes that several nodes show with different deformations. The first node keeps the original mesh.
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

/// Inverse bind matrices that keep each skinning matrix, `B' = G'^-1 G B`, rounded to f32.
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

fn write_part(rig: &Rig<'_>, edit: &mut Edit<'_>, part: &RigPrimitive, shape: &Shape) {
    let mesh = edit.mesh_of(&part.instance);
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
