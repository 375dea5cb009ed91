//! Converts glTF documents to OBJ.

use ::gltf::json::mesh::Semantic;
use glam::Vec3;

use super::geometry::{attribute, world_normals};
use super::look::{Texture, material_of};
use super::patch::Rest;
use super::scene::name_of;
use super::{GltfDocument, Slot};
use crate::error::WriteError;
use crate::obj::{ObjGroup, write_new};
use crate::surface::{gradients, turned_normal};

/// Writes a new OBJ file: vertices in the model's order, one object per primitive, texture coordinates and
/// normals if the document has them, and material names.
pub(crate) fn write_obj(
    document: &GltfDocument,
    rest: Rest<'_>,
    positions: &[Vec3],
) -> Result<Vec<u8>, WriteError> {
    let mut parts = Vec::with_capacity(document.slots.len());
    for slot in &document.slots {
        parts.push(ObjGroup {
            name: part_name(document, slot),
            material: material(document, slot),
            start: slot.start,
            texcoords: texcoords(document, slot),
            normals: world_normals(document, slot)?.unwrap_or_default(),
            triangles: rest.triangles[slot.triangles.clone()].to_vec(),
        });
    }
    let gradients = gradients(rest.positions, positions, rest.triangles.to_vec());
    for (part, slot) in parts.iter_mut().zip(&document.slots) {
        let of_part = gradients.get(range(slot)).into_iter().flatten();
        part.normals.iter_mut().zip(of_part).for_each(|(n, &gradient)| *n = turned_normal(gradient, *n));
    }
    Ok(write_new(positions, rest.origin, &parts))
}

fn range(slot: &Slot) -> std::ops::Range<usize> {
    slot.start as usize..(slot.start + slot.count) as usize
}

fn part_name(document: &GltfDocument, slot: &Slot) -> String {
    let (instance, _) = document.primitive(slot);
    let name = match instance.node {
        Some(node) if document.json["nodes"][node as usize]["name"].is_string() => {
            name_of(&document.json, "nodes", node, "node")
        }
        _ => name_of(&document.json, "meshes", instance.mesh, "mesh"),
    };
    if slot.primitive == 0 { name } else { format!("{name}.{}", slot.primitive) }
}

fn material(document: &GltfDocument, slot: &Slot) -> Option<String> {
    let material = document.primitive(slot).1.material?;
    Some(name_of(&document.json, "materials", material.value() as u32, "material"))
}

/// Texture coordinates of the base colour, v upwards as in OBJ, with the texture transform applied, for which OBJ has no
/// field. Empty if missing or invalid.
fn texcoords(document: &GltfDocument, slot: &Slot) -> Vec<[f32; 2]> {
    let texture = material_of(document, slot).map(|material| Texture::of(&document.json, material));
    let set = texture.as_ref().map_or(0, |texture| texture.set);
    let placed = |uv| {
        let [u, v] = texture.as_ref().map_or(uv, |texture| texture.transformed(uv));
        [u, 1.0 - v]
    };
    attribute(document.primitive(slot).1, Semantic::TexCoords(set))
        .and_then(|accessor| document.source().floats::<2>(accessor, "TEXCOORD").ok())
        .map(|uv| uv.into_iter().map(placed).collect::<Vec<_>>())
        .filter(|uv| uv.len() == slot.count as usize && uv.iter().flatten().all(|x| x.is_finite()))
        .unwrap_or_default()
}
