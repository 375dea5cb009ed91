//! A new GLB from an OBJ file.

use std::collections::HashMap;

use cagework_core::TriMesh;
use cagework_core::deform::vertex_normals;
use glam::Vec3;
use serde_json::{Value, json};

use super::pack::{Pack, push};
use crate::error::WriteError;
use crate::obj::{NONE, ObjDocument};

/// A GLB with the OBJ's shape at rest, and for each of its vertices the `v` line it came from.
///
/// One node, one mesh, one primitive for each `usemtl`; a vertex for each different corner (position, texture
/// coordinate, normal). Without `vn` lines the normals are area-weighted, over a smoothing group where the file has any. Materials have their names and a
/// plain surface: `.mtl` files are not read.
pub(crate) fn build_from_obj(
    name: &str,
    document: &ObjDocument,
    rest: &[Vec3],
) -> Result<(Vec<u8>, Vec<u32>), WriteError> {
    let pairs = document.pairs(rest);
    let mut json = json!({
        "asset": { "version": "2.0", "generator": "Cagework" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": name, "mesh": 0 }],
        "meshes": [{ "name": name, "primitives": [] }],
    });
    let mut pack = Pack::empty();
    let mut sources = Vec::new();
    for (material, triangles) in document.by_material() {
        let mut part = Part::default();
        for corner in triangles.into_iter().flatten() {
            let (pair, vt) = (pairs.of_corner[corner as usize], document.corners[corner as usize].vt);
            part.add(pair, vt);
        }
        let position = |&(pair, _): &(u32, u32)| rest[pairs.shading.vertex[pair as usize] as usize];
        let positions: Vec<Vec3> = part.vertices.iter().map(position).collect();
        let normals: Vec<Vec3> =
            part.vertices.iter().map(|&(pair, _)| pairs.shading.normal[pair as usize]).collect();
        let mut primitive = json!({
            "attributes": {
                "POSITION": pack.push_vec3(&mut json, &positions, true),
                "NORMAL": pack.push_vec3(&mut json, &normals, false),
            },
            "indices": pack.push_indices(&mut json, part.indices.iter().copied()),
        });
        if part.vertices.iter().any(|&(_, vt)| vt != NONE) {
            let uv = |&(_, vt): &(u32, u32)| {
                document.texcoords.get(vt as usize).map_or([0.0, 0.0], |&[u, v]| [u, 1.0 - v])
            };
            let flat: Vec<f32> = part.vertices.iter().flat_map(uv).collect();
            primitive["attributes"]["TEXCOORD_0"] = pack.push_floats(&mut json, &flat, 2, true, false).into();
        }
        if material != NONE {
            primitive["material"] =
                push(&mut json, "materials", plain(&document.materials[material as usize])).into();
        }
        push(&mut json["meshes"][0], "primitives", primitive);
        sources.extend(part.vertices.iter().map(|&(pair, _)| pairs.shading.vertex[pair as usize]));
    }
    Ok((pack.finish(json)?, sources))
}

/// A GLB of one mesh with colours: sRGB and opacity for each vertex, 0 to 255, or none at all.
///
/// # Errors
/// [`WriteError::NoFaces`] without triangles, [`WriteError::TooLarge`].
pub fn write_mesh_glb(name: &str, mesh: &TriMesh, colours: &[[u8; 4]]) -> Result<Vec<u8>, WriteError> {
    if mesh.triangles.is_empty() {
        return Err(WriteError::NoFaces);
    }
    let mut json = json!({
        "asset": { "version": "2.0", "generator": "Cagework" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": name, "mesh": 0 }],
        "materials": [plain(name)],
    });
    let mut pack = Pack::empty();
    let normals = vertex_normals(&mesh.positions, &mesh.triangles);
    let mut attributes = json!({
        "POSITION": pack.push_vec3(&mut json, &mesh.positions, true),
        "NORMAL": pack.push_vec3(&mut json, &normals, false),
    });
    if colours.len() == mesh.positions.len() {
        // glTF's colours are linear.
        let linear: Vec<f32> = colours
            .iter()
            .flat_map(|&[r, g, b, a]| [to_linear(r), to_linear(g), to_linear(b), f32::from(a) / 255.0])
            .collect();
        attributes["COLOR_0"] = pack.push_floats(&mut json, &linear, 4, true, false).into();
    }
    let indices = pack.push_indices(&mut json, mesh.triangles.as_flattened().iter().copied());
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
    json["meshes"] = json!([{ "name": name, "primitives": [primitive] }]);
    pack.finish(json)
}

/// Linear light of an sRGB value (IEC 61966-2-1).
fn to_linear(value: u8) -> f32 {
    let value = f32::from(value) / 255.0;
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// glTF's default is a rough mirror, which no OBJ means.
fn plain(name: &str) -> Value {
    json!({ "name": name, "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 } })
}

/// Vertices of one primitive: (pair, texture coordinate), and triangle corners.
#[derive(Default)]
struct Part {
    numbers: HashMap<(u32, u32), u32>,
    vertices: Vec<(u32, u32)>,
    indices: Vec<u32>,
}

impl Part {
    fn add(&mut self, pair: u32, vt: u32) {
        let next = self.vertices.len() as u32;
        let number = *self.numbers.entry((pair, vt)).or_insert(next);
        if number == next {
            self.vertices.push((pair, vt));
        }
        self.indices.push(number);
    }
}
