//! Converts OBJ documents and meshes to GLB.

use std::collections::HashMap;
use std::sync::Arc;

use cagework_core::TriMesh;
use cagework_core::color::{linear_from_byte, linear_from_srgb};
use cagework_core::deform::vertex_normals;
use cagework_core::skin::Rig;
use glam::{DVec3, Mat4, Quat, Vec3};
use serde_json::{Value, json};

use super::accessor::MAX_ELEMENTS;
use super::pack::{Pack, VERTICES, push};
use crate::error::WriteError;
use crate::obj::{NONE, PolygonDocument};
use crate::origin::translation;
use crate::siblings::Image;

/// Builds a GLB of an OBJ at rest, placed at `origin` by its node. Also returns the OBJ vertex of each GLB vertex.
///
/// The GLB has one node, one mesh, one primitive per `usemtl` name, and one vertex per distinct corner (position,
/// texture coordinate, normal). Without `vn` lines, normals are area-weighted within smoothing groups. Names, base
/// colours and textures of materials, and vertex colours are preserved.
pub(crate) fn build_from_obj(
    name: &str,
    document: &PolygonDocument,
    rest: &[Vec3],
    origin: DVec3,
) -> Result<(Vec<u8>, Vec<u32>), WriteError> {
    let by_material = document.by_material();
    let corners = by_material.iter().map(|(_, triangles)| 3 * triangles.len() as u64).max().unwrap_or(0);
    if corners > MAX_ELEMENTS {
        return Err(WriteError::Corners { corners, limit: MAX_ELEMENTS });
    }
    let pairs = document.pairs(rest);
    let mut json = json!({
        "asset": { "version": "2.0", "generator": "Cagework" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": name, "mesh": 0 }],
        "meshes": [{ "name": name, "primitives": [] }],
    });
    let (at, beside) = translation(origin);
    if origin != DVec3::ZERO {
        json["nodes"][0]["translation"] = json!(at);
    }
    let mut pack = Pack::empty();
    let mut sources = Vec::new();
    let mut textures = HashMap::new();
    for (material, triangles) in by_material {
        let mut part = PrimitiveBuilder::default();
        for corner in triangles.into_iter().flatten() {
            let (pair, vt) = (pairs.of_corner[corner as usize], document.corners[corner as usize].vt);
            part.add(pair, vt);
        }
        let position = |&(pair, _): &(u32, u32)| {
            (rest[pairs.shading.vertex[pair as usize] as usize].as_dvec3() + beside).as_vec3()
        };
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
        if !document.colors.is_empty() {
            let color = |&(pair, _): &(u32, u32)| {
                let color = document.colors.get(&pairs.shading.vertex[pair as usize]);
                color.map_or([1.0; 3], |color| color.map(|share| linear_from_srgb(share.clamp(0.0, 1.0))))
            };
            let flat: Vec<f32> = part.vertices.iter().flat_map(color).collect();
            primitive["attributes"]["COLOR_0"] = pack.push_floats(&mut json, &flat, 3, true, false).into();
        }
        if material != NONE {
            let name = &document.materials[material as usize];
            let mut made = plain(name);
            if let Some(found) = document.looks.get(name) {
                let image = found.image.as_ref().map(|image| {
                    let key = Arc::as_ptr(&image.bytes);
                    *textures.entry(key).or_insert_with(|| push_texture(&mut json, &mut pack, image))
                });
                let surface = &mut made["pbrMetallicRoughness"];
                surface["baseColorFactor"] = json!(found.base_color());
                if let Some(texture) = image {
                    surface["baseColorTexture"] = json!({ "index": texture });
                }
                if found.color[3] < 1.0 {
                    made["alphaMode"] = "BLEND".into();
                }
            }
            primitive["material"] = push(&mut json, "materials", made).into();
        }
        push(&mut json["meshes"][0], "primitives", primitive);
        sources.extend(part.vertices.iter().map(|&(pair, _)| pairs.shading.vertex[pair as usize]));
    }
    Ok((pack.finish(json)?, sources))
}

/// Adds a texture with an embedded image; returns its index.
fn push_texture(json: &mut Value, pack: &mut Pack<'_>, image: &Image) -> usize {
    let view = pack.push_view(json, image.bytes.to_vec(), None);
    let mut shown = json!({ "bufferView": view, "mimeType": image.mime });
    if !image.name.is_empty() {
        shown["name"] = json!(&*image.name);
    }
    let source = push(json, "images", shown);
    let extension = match image.mime {
        "image/webp" => "EXT_texture_webp",
        "image/ktx2" => "KHR_texture_basisu",
        _ => return push(json, "textures", json!({ "source": source })),
    };
    for list in ["extensionsUsed", "extensionsRequired"] {
        if !json[list].as_array().is_some_and(|list| list.iter().any(|name| name == extension)) {
            push(json, list, extension.into());
        }
    }
    push(json, "textures", json!({ "extensions": { extension: { "source": source } } }))
}

/// Writes a mesh as a GLB. `colours`: sRGB and opacity per vertex, 0 to 255, or empty. `rig`: optional
/// skeleton and clip.
///
/// # Errors
/// [`WriteError::NoFaces`] without triangles, [`WriteError::TooLarge`] above 4 GiB.
pub fn write_mesh_glb(
    name: &str,
    mesh: &TriMesh,
    colours: &[[u8; 4]],
    rig: Option<&Rig>,
) -> Result<Vec<u8>, WriteError> {
    if mesh.triangles.is_empty() {
        return Err(WriteError::NoFaces { format: "GLB" });
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
        // OBJ colours are sRGB, glTF vertex colours linear.
        let linear: Vec<f32> = colours
            .iter()
            .flat_map(|&[r, g, b, a]| {
                [linear_from_byte(r), linear_from_byte(g), linear_from_byte(b), f32::from(a) / 255.0]
            })
            .collect();
        attributes["COLOR_0"] = pack.push_floats(&mut json, &linear, 4, true, false).into();
    }
    if let Some(rig) = rig {
        add_rig(rig, &mut json, &mut pack, &mut attributes);
    }
    let indices = pack.push_indices(&mut json, mesh.triangles.as_flattened().iter().copied());
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
    json["meshes"] = json!([{ "name": name, "primitives": [primitive] }]);
    pack.finish(json)
}

/// Adds skeleton, skin and clip. `attributes` receives joints and weights.
fn add_rig(rig: &Rig, json: &mut Value, pack: &mut Pack<'_>, attributes: &mut Value) {
    const U16: u32 = 5123;
    let first = json["nodes"].as_array().map_or(0, Vec::len);
    let at = |k: usize| rig.joints[k].at;
    for (k, joint) in rig.joints.iter().enumerate() {
        let from_parent = at(k) - joint.parent.map_or(Vec3::ZERO, at);
        let children: Vec<usize> =
            (0..rig.joints.len()).filter(|&c| rig.joints[c].parent == Some(k)).map(|c| first + c).collect();
        let mut node = json!({ "name": joint.name, "translation": from_parent.to_array() });
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        push(json, "nodes", node);
        if joint.parent.is_none() {
            push(&mut json["scenes"][0], "nodes", (first + k).into());
        }
    }
    let binds: Vec<f32> =
        (0..rig.joints.len()).flat_map(|k| Mat4::from_translation(-at(k)).to_cols_array()).collect();
    let bind = pack.push_floats(json, &binds, 16, false, false);
    let joints: Vec<usize> = (first..first + rig.joints.len()).collect();
    push(json, "skins", json!({ "joints": joints, "inverseBindMatrices": bind }));
    json["nodes"][0]["skin"] = 0.into();

    // glTF requires joint 0 if the weight is 0.
    let of_vertex = |all: &[(u32, f32); 4]| all.map(|(j, w)| if w > 0.0 { j as u16 } else { 0 });
    let bytes: Vec<u8> = rig.influences.iter().flat_map(of_vertex).flat_map(u16::to_le_bytes).collect();
    let view = pack.push_view(json, bytes, Some(VERTICES));
    let count = rig.influences.len();
    let accessor = json!({ "bufferView": view, "componentType": U16, "count": count, "type": "VEC4" });
    attributes["JOINTS_0"] = push(json, "accessors", accessor).into();
    let weights: Vec<f32> = rig.influences.iter().flatten().map(|(_, w)| *w).collect();
    attributes["WEIGHTS_0"] = pack.push_floats(json, &weights, 4, true, false).into();

    let input = pack.push_floats(json, &rig.times, 1, false, true);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let mut add = |output: usize, node: usize, path: &str| {
        channels.push(json!({ "sampler": samplers.len(), "target": { "node": node, "path": path } }));
        samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
    };
    for (k, turns) in rig.turns.iter().enumerate().filter(|(_, t)| t.iter().any(|&q| q != Quat::IDENTITY)) {
        let flat: Vec<f32> = turns.iter().flat_map(Quat::to_array).collect();
        add(pack.push_floats(json, &flat, 4, false, false), first + k, "rotation");
    }
    let root: Vec<f32> = rig.root.iter().flat_map(Vec3::to_array).collect();
    add(pack.push_floats(json, &root, 3, false, false), first, "translation");
    push(json, "animations", json!({ "name": rig.clip, "samplers": samplers, "channels": channels }));
}

/// A rough, non-metallic material. glTF's default is metallic, unlike OBJ materials.
fn plain(name: &str) -> Value {
    json!({ "name": name, "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 } })
}

/// Vertices of a primitive as (index of the (vertex, normal) pair, index of the texture coordinate), and the indices of
/// the primitive.
#[derive(Default)]
struct PrimitiveBuilder {
    numbers: HashMap<(u32, u32), u32>,
    vertices: Vec<(u32, u32)>,
    indices: Vec<u32>,
}

impl PrimitiveBuilder {
    fn add(&mut self, pair: u32, vt: u32) {
        let next = self.vertices.len() as u32;
        let number = *self.numbers.entry((pair, vt)).or_insert(next);
        if number == next {
            self.vertices.push((pair, vt));
        }
        self.indices.push(number);
    }
}
