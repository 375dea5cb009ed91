//! Writes deformed shapes into the original glTF document.
//!
//! * POSITION is transformed back by the inverse of the node's world transform. NORMAL and TANGENT follow
//!   the gradient of the deformation ([`crate::surface`]). Primitives without normals get none; viewers shade them flat.
//! * A mesh shown by several nodes is duplicated, since each node deforms it differently.
//! * A skinned mesh loses its skin and moves to a new root node, because the deformed vertices are already in
//!   world space. The same applies to a mesh under a singular transform.
//! * The deformed positions include the morph targets at their default weights. The targets and the animations of
//!   their weights are removed.

use std::collections::HashMap;
use std::sync::Arc;

use ::gltf::json::mesh::Semantic;
use glam::{DMat3, DMat4, DVec3, Vec3};
use serde_json::{Value, json};

use super::animate::{self, MeshPlacement, Pose, PoseClip};
use super::geometry::{Frame, attribute, positions, vertices, world_normals, world_tangents};
use super::pack::{Pack, push};
use super::scene::{Instance, name_of};
use super::{GltfDocument, GltfError, Rig, Slot};
use crate::error::WriteError;
use crate::origin::translation;
use crate::surface::{gradients, turned_normal};

/// Threshold for |det| / product of column lengths, below which a transform counts as singular in f32.
const MIN_RELATIVE_DETERMINANT: f64 = 1e-9;

/// The model before its deformation.
#[derive(Clone, Copy)]
pub(crate) struct Rest<'a> {
    pub(crate) positions: &'a [Vec3],
    /// Point in world space to which all positions are relative.
    pub(crate) origin: DVec3,
    pub(crate) triangles: &'a [[u32; 3]],
}

impl From<GltfError> for WriteError {
    fn from(error: GltfError) -> Self {
        Self::Document(error.to_string())
    }
}

/// Writes the document with `base` as its shape and `poses` as morph targets with an animation.
///
/// Positions are in world space minus the document's origin, in the model's vertex order. The caller checks their counts.
pub(crate) fn patch(
    document: &GltfDocument,
    rest: Rest<'_>,
    base: &[Vec3],
    poses: &[Pose<'_>],
    clip: PoseClip<'_>,
) -> Result<Vec<u8>, WriteError> {
    let is_at_rest = base == rest.positions && poses.is_empty() && !Rig::has_skin_or_targets(document);
    if let Some(file) = document.as_read().filter(|_| is_at_rest) {
        return file;
    }
    let mut json = document.json.clone();
    let mut pack = Pack::of(document);
    embed_images(document, &mut json, &mut pack);
    let places = place_meshes(document, &mut json, rest.origin);
    let normals =
        document.slots.iter().map(|slot| world_normals(document, slot)).collect::<Result<Vec<_>, _>>()?;
    let turns = |to: &[Vec3]| gradients(rest.positions, to, rest.triangles.to_vec());
    let of_base = turns(base);
    let mut shapes = Vec::with_capacity(document.slots.len());
    for (slot, normals) in document.slots.iter().zip(&normals) {
        let place = &places[slot.instance as usize];
        let shape = Shape::new(slot, place, normals.as_deref(), base, &of_base);
        let tangents = if normals.is_some() { tangents(document, slot, place, &of_base)? } else { None };
        let flip = place.detached && !slot.triangles.is_empty() && is_mirrored(document, slot)?;
        let indices = flip.then(|| {
            let corners = rest.triangles[slot.triangles.clone()].iter().flatten().map(|&v| v - slot.start);
            pack.push_indices(&mut json, corners)
        });
        let position = pack.push_vec3(&mut json, &shape.positions, true);
        let normal = normals.as_ref().map(|_| pack.push_vec3(&mut json, &shape.normals, false));
        let tangent = tangents.map(|t| pack.push_floats(&mut json, &t, 4, true, false));
        let primitive = &mut json["meshes"][place.mesh]["primitives"][slot.primitive as usize];
        patch_primitive(primitive, place.detached, Some(position), normal, tangent, indices);
        shapes.push(shape);
    }
    for pose in poses {
        let of_pose = turns(pose.positions);
        for ((slot, base), normals) in document.slots.iter().zip(&shapes).zip(&normals) {
            let place = &places[slot.instance as usize];
            let shape = Shape::new(slot, place, normals.as_deref(), pose.positions, &of_pose);
            let delta =
                |a: &[Vec3], b: &[Vec3]| -> Vec<Vec3> { a.iter().zip(b).map(|(&a, &b)| a - b).collect() };
            let positions = delta(&shape.positions, &base.positions);
            let mut target = json!({ "POSITION": pack.push_vec3(&mut json, &positions, true) });
            if normals.is_some() {
                target["NORMAL"] =
                    pack.push_vec3(&mut json, &delta(&shape.normals, &base.normals), false).into();
            }
            push(&mut json["meshes"][place.mesh]["primitives"][slot.primitive as usize], "targets", target);
        }
    }
    for (number, place) in places.iter().enumerate() {
        patch_others(document, number as u32, place, rest.origin, poses.len(), &mut json, &mut pack)?;
    }
    animate::forget_morphs(&mut json, &places);
    if !poses.is_empty() {
        animate::play_poses(&mut json, &mut pack, &places, poses, clip);
    }
    pack.finish(json)
}

/// Patches the lines and splats of an instance, which are not deformed. They lose their skin and morph targets, stay in
/// their rest pose, and get one empty target per pose, because all primitives of a mesh have equally many targets.
fn patch_others(
    document: &GltfDocument,
    instance: u32,
    place: &MeshPlacement,
    origin: DVec3,
    n_poses: usize,
    json: &mut Value,
    pack: &mut Pack<'_>,
) -> Result<(), WriteError> {
    let mesh = document.instances[instance as usize].mesh;
    for (number, primitive) in document.root.meshes[mesh as usize].primitives.iter().enumerate() {
        let is_moved = vertices(&document.json, mesh, number, primitive).is_some();
        let position = attribute(primitive, Semantic::Positions).filter(|_| !is_moved);
        let Some(position) = position else { continue };
        let count = document.source().count(position)? as usize;
        if place.detached || primitive.targets.is_some() {
            let slot =
                Slot { instance, primitive: number as u32, start: 0, count: count as u32, triangles: 0..0 };
            let instance = &document.instances[instance as usize];
            let (local, _) = positions(document, instance, primitive, position)?;
            let (frame, _) = Frame::of(document, instance, primitive, count)?;
            let at = |(v, p): (usize, &DVec3)| {
                let world = frame.world(v).transform_point3(*p) - origin;
                place.mesh_from_world.transform_point3(world).as_vec3()
            };
            let at: Vec<Vec3> = local.iter().enumerate().map(at).collect();
            let position = pack.push_vec3(json, &at, true);
            let world_from_mesh = DMat3::from_mat4(place.mesh_from_world.inverse());
            let to_mesh = |n: &Vec3| unit(world_from_mesh.transpose() * n.as_dvec3()).as_vec3();
            let normal = world_normals(document, &slot)?
                .map(|world| pack.push_vec3(json, &world.iter().map(to_mesh).collect::<Vec<_>>(), false));
            let of_json = &mut json["meshes"][place.mesh]["primitives"][number];
            patch_primitive(of_json, place.detached, Some(position), normal, None, None);
        }
        if n_poses > 0 {
            let still = pack.push_vec3(json, &vec![Vec3::ZERO; count], true);
            let targets = vec![json!({ "POSITION": still }); n_poses];
            json["meshes"][place.mesh]["primitives"][number]["targets"] = targets.into();
        }
    }
    Ok(())
}

/// Gives every instance a mesh of its own, at a node whose transform can be inverted.
fn place_meshes(document: &GltfDocument, json: &mut Value, origin: DVec3) -> Vec<MeshPlacement> {
    let mut users = vec![0_usize; document.root.meshes.len()];
    for mesh in document.root.nodes.iter().filter_map(|n| n.mesh) {
        // Unused nodes may refer to missing meshes.
        if let Some(users) = users.get_mut(mesh.value()) {
            *users += 1;
        }
    }
    for instance in &document.instances {
        if instance.node.is_some() {
            users[instance.mesh as usize] -= 1;
        }
    }
    let mut kept = vec![false; document.root.meshes.len()];
    let mut places: Vec<MeshPlacement> = Vec::with_capacity(document.instances.len());
    for instance in &document.instances {
        let m = instance.mesh as usize;
        // The first instance keeps the mesh, unless a node outside the scene also shows the mesh.
        let keeps = users[m] == 0 && !std::mem::replace(&mut kept[m], true);
        let mesh = if keeps {
            instance.mesh as usize
        } else {
            let copy = document.json["meshes"][instance.mesh as usize].clone();
            push(json, "meshes", copy)
        };
        let mut mesh_from_world = instance.world.inverse();
        if origin != DVec3::ZERO {
            mesh_from_world *= DMat4::from_translation(origin);
        }
        let detached = instance.node.is_none() || instance.skin.is_some() || is_flat(instance.world);
        let original = instance.node.map(|n| n as usize);
        let node = match original {
            Some(node) if !detached => node,
            _ => detach(document, json, instance),
        };
        json["nodes"][node]["mesh"] = mesh.into();
        if detached {
            let (at, rest) = translation(origin);
            mesh_from_world = DMat4::from_translation(rest);
            if origin != DVec3::ZERO {
                json["nodes"][node]["translation"] = json!(at);
            }
        }
        places.push(MeshPlacement { mesh, node, original, detached, mesh_from_world });
    }
    places
}

pub(super) fn is_flat(world: DMat4) -> bool {
    let m = DMat3::from_mat4(world);
    let size = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    m.determinant().abs() <= MIN_RELATIVE_DETERMINANT * size || !world.inverse().is_finite()
}

/// Moves a mesh from its node to a new root node of the scene; returns the node.
fn detach(document: &GltfDocument, json: &mut Value, instance: &Instance) -> usize {
    let name = match instance.node {
        Some(node) => name_of(&document.json, "nodes", node, "node"),
        None => name_of(&document.json, "meshes", instance.mesh, "mesh"),
    };
    if let Some(old) = instance.node.and_then(|n| json["nodes"][n as usize].as_object_mut()) {
        for key in ["mesh", "skin", "weights"] {
            old.shift_remove(key);
        }
    }
    let node = push(json, "nodes", json!({ "name": name }));
    if document.root.scenes.is_empty() {
        if document.root.nodes.is_empty() {
            // A file of meshes without nodes needs a scene to be visible.
            if json["scenes"].as_array().is_none_or(Vec::is_empty) {
                json["scenes"] = json!([{}]);
                json["scene"] = 0.into();
            }
            push(&mut json["scenes"][0], "nodes", node.into());
        }
    } else {
        let scene = document.root.scene.map_or(0, |s| s.value());
        push(&mut json["scenes"][scene], "nodes", node.into());
    }
    node
}

/// Vertices of a primitive after the deformation, in mesh space.
struct Shape {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Shape {
    /// `normals`: at rest in world space, if the file has any. `gradients`: of all vertices.
    fn new(
        slot: &Slot,
        place: &MeshPlacement,
        normals: Option<&[Vec3]>,
        positions: &[Vec3],
        gradients: &[Option<DMat3>],
    ) -> Self {
        let range = slot.start as usize..(slot.start + slot.count) as usize;
        let world_from_mesh = DMat3::from_mat4(place.mesh_from_world.inverse());
        let to_mesh = |p: &Vec3| place.mesh_from_world.transform_point3(p.as_dvec3()).as_vec3();
        let normal = |(&n, &gradient): (&Vec3, &Option<DMat3>)| {
            unit(world_from_mesh.transpose() * turned_normal(gradient, n).as_dvec3()).as_vec3()
        };
        Self {
            positions: positions[range.clone()].iter().map(to_mesh).collect(),
            normals: normals.into_iter().flatten().zip(&gradients[range]).map(normal).collect(),
        }
    }
}

fn unit(v: DVec3) -> DVec3 {
    v.normalize_or(DVec3::Z)
}

/// Tangents after the deformation, in mesh space; `None` without original tangents.
fn tangents(
    document: &GltfDocument,
    slot: &Slot,
    place: &MeshPlacement,
    gradients: &[Option<DMat3>],
) -> Result<Option<Vec<f32>>, WriteError> {
    let Some(world) = world_tangents(document, slot)? else { return Ok(None) };
    let turned = world.into_iter().zip(&gradients[slot.start as usize..]).flat_map(|((t, handedness), g)| {
        let world = g.unwrap_or(DMat3::IDENTITY) * t.as_dvec3();
        let t = place.mesh_from_world.transform_vector3(world).normalize_or_zero().as_vec3();
        [t.x, t.y, t.z, handedness]
    });
    Ok(Some(turned.collect()))
}

/// Whether [`super::geometry::read`] reversed the triangles, because the transform mirrors them.
fn is_mirrored(document: &GltfDocument, slot: &Slot) -> Result<bool, WriteError> {
    let (instance, primitive) = document.primitive(slot);
    let (frame, _) = Frame::of(document, instance, primitive, slot.count as usize)?;
    Ok(slot.count > 0 && frame.world(0).determinant() < 0.0)
}

fn patch_primitive(
    primitive: &mut Value,
    detached: bool,
    position: Option<usize>,
    normal: Option<usize>,
    tangent: Option<usize>,
    indices: Option<usize>,
) {
    if let Some(object) = primitive.as_object_mut() {
        object.shift_remove("targets");
        if let Some(indices) = indices {
            object.insert("indices".into(), indices.into());
            object.shift_remove("mode");
        }
    }
    let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut) else { return };
    for (key, accessor) in [("POSITION", position), ("NORMAL", normal), ("TANGENT", tangent)] {
        match accessor {
            Some(accessor) => drop(attributes.insert(key.into(), accessor.into())),
            None => drop(attributes.shift_remove(key)),
        }
    }
    if detached {
        attributes.retain(|key, _| !key.starts_with("JOINTS_") && !key.starts_with("WEIGHTS_"));
    }
}

/// Embeds external images in the GLB.
pub(crate) fn embed_images<'a>(document: &'a GltfDocument, json: &mut Value, pack: &mut Pack<'a>) {
    embed_images_by(document, json, &mut |json, bytes| pack.push_view(json, bytes, None));
}

/// Like [`embed_images`]; `push_view` adds a buffer view and returns its index.
pub(crate) fn embed_images_by<'a>(
    document: &'a GltfDocument,
    json: &mut Value,
    push_view: &mut dyn FnMut(&mut Value, &'a [u8]) -> usize,
) {
    // Images from the same file share one buffer view.
    let mut views = HashMap::new();
    for (number, image) in document.images.iter().enumerate() {
        let Some(image) = image else { continue };
        let view = *views.entry(Arc::as_ptr(&image.bytes)).or_insert_with(|| push_view(json, &image.bytes));
        let Some(object) = json["images"][number].as_object_mut() else { continue };
        object.shift_remove("uri");
        object.insert("mimeType".into(), image.mime.into());
        object.insert("bufferView".into(), view.into());
    }
}
