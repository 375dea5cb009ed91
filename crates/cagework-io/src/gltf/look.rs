//! What a glTF document says about its looks: see [`crate::look`].

use std::collections::HashMap;

use ::gltf::json::mesh::Semantic;
use cagework_core::mesh::weld;
use glam::{Vec2, Vec3};
use serde_json::Value;

use super::geometry::{attribute, world_normals};
use super::{GltfDocument, Slot};
use crate::look::{Look, LookAlpha, LookCorner, LookGroup, LookTexture, LookWrap};

/// Cosine of about 2.5 degrees: normals this close are one surface, split at a seam of its texture.
const SAME_NORMAL: f32 = 0.999;

/// Looks of all primitives, in the order of the model's vertices and triangles.
pub(crate) fn look(document: &GltfDocument, positions: &[Vec3], triangles: &[[u32; 3]]) -> Look {
    let mut look = Look { triangles: triangles.to_vec(), ..Look::default() };
    let sources = shared_sources(document, positions);
    let mut textures = HashMap::new();
    for slot in &document.slots {
        let material = material(document, slot);
        let (group, uv_set, transform) = group(document, slot, material, &mut look.textures, &mut textures);
        let uv = texcoords(document, slot, uv_set);
        let colors = colors(document, slot);
        for k in 0..slot.count {
            look.corners.push(LookCorner {
                source: sources[(slot.start + k) as usize],
                uv: uv.get(k as usize).map_or([0.0; 2], |&uv| transform.apply(uv)),
                color: colors.get(k as usize).copied().unwrap_or([1.0; 4]),
            });
        }
        look.groups.push(group);
    }
    look
}

/// For each vertex the one it shares its normal with: the first at its place with its normal.
fn shared_sources(document: &GltfDocument, positions: &[Vec3]) -> Vec<u32> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for slot in &document.slots {
        if let Ok(Some(world)) = world_normals(document, slot) {
            normals[slot.start as usize..][..world.len()].copy_from_slice(&world);
        }
    }
    let welded = weld(positions);
    let mut at_place: Vec<Vec<u32>> = vec![Vec::new(); welded.first.len()];
    (0..positions.len() as u32)
        .map(|v| {
            let here = &mut at_place[welded.unique_of[v as usize] as usize];
            let normal = normals[v as usize];
            let same = |&&u: &&u32| {
                let other = normals[u as usize];
                normal.dot(other) >= SAME_NORMAL || (normal == Vec3::ZERO && other == Vec3::ZERO)
            };
            here.iter().find(same).copied().unwrap_or_else(|| {
                here.push(v);
                v
            })
        })
        .collect()
}

fn material<'a>(document: &'a GltfDocument, slot: &Slot) -> Option<&'a Value> {
    let material = document.primitive(slot).1.material?;
    document.json["materials"].get(material.value())
}

/// `KHR_texture_transform`.
#[derive(Clone, Copy)]
struct Transform {
    offset: Vec2,
    rotation: f32,
    scale: Vec2,
}

impl Transform {
    const NONE: Self = Self { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };

    fn of(texture: &Value) -> Self {
        let json = &texture["extensions"]["KHR_texture_transform"];
        let pair = |key: &str, default: Vec2| match numbers::<2>(&json[key]) {
            Some(pair) => Vec2::from_array(pair),
            None => default,
        };
        Self {
            offset: pair("offset", Vec2::ZERO),
            rotation: json["rotation"].as_f64().unwrap_or(0.0) as f32,
            scale: pair("scale", Vec2::ONE),
        }
    }

    fn apply(self, uv: [f32; 2]) -> [f32; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let uv = Vec2::from_array(uv) * self.scale;
        (Vec2::new(cos * uv.x + sin * uv.y, cos * uv.y - sin * uv.x) + self.offset).to_array()
    }
}

/// Material of a primitive, the set of its texture coordinates, and what is done to them.
fn group(
    document: &GltfDocument,
    slot: &Slot,
    material: Option<&Value>,
    textures: &mut Vec<LookTexture>,
    known: &mut HashMap<u64, Option<u32>>,
) -> (LookGroup, u32, Transform) {
    let triangles = slot.triangles.start as u32..slot.triangles.end as u32;
    let mut group = LookGroup { triangles, base_color: None, texture: None, alpha: LookAlpha::Opaque };
    let Some(material) = material else { return (group, 0, Transform::NONE) };
    let pbr = &material["pbrMetallicRoughness"];
    // The older model of materials, which many downloads still have.
    let old = &material["extensions"]["KHR_materials_pbrSpecularGlossiness"];
    let (factor, texture) = if pbr.is_object() || !old.is_object() {
        (&pbr["baseColorFactor"], &pbr["baseColorTexture"])
    } else {
        (&old["diffuseFactor"], &old["diffuseTexture"])
    };
    group.base_color = Some(numbers::<4>(factor).unwrap_or([1.0; 4]));
    group.alpha = match material["alphaMode"].as_str() {
        Some("MASK") => LookAlpha::Mask(material["alphaCutoff"].as_f64().unwrap_or(0.5) as f32),
        Some("BLEND") => LookAlpha::Blend,
        _ => LookAlpha::Opaque,
    };
    if let Some(index) = texture["index"].as_u64() {
        group.texture = *known.entry(index).or_insert_with(|| {
            let loaded = load_texture(document, index as usize)?;
            textures.push(loaded);
            Some(textures.len() as u32 - 1)
        });
    }
    let transform = &texture["extensions"]["KHR_texture_transform"];
    let uv_set = transform["texCoord"].as_u64().or(texture["texCoord"].as_u64()).unwrap_or(0);
    (group, uv_set.min(u64::from(u32::MAX)) as u32, Transform::of(texture))
}

/// The image of a texture; none if it is missing or of a kind that browsers do not decode.
fn load_texture(document: &GltfDocument, index: usize) -> Option<LookTexture> {
    let texture = document.json["textures"].get(index)?;
    let extension = |name: &str| texture["extensions"][name]["source"].as_u64();
    let source = texture["source"].as_u64().or_else(|| extension("EXT_texture_webp"))? as usize;
    let sampler = texture["sampler"].as_u64().and_then(|s| document.json["samplers"].get(s as usize));
    let wrap = |key: &str| match sampler.and_then(|s| s[key].as_u64()) {
        Some(33071) => LookWrap::Clamp,
        Some(33648) => LookWrap::Mirror,
        _ => LookWrap::Repeat,
    };
    let wrap = [wrap("wrapS"), wrap("wrapT")];
    if let Some(Some(image)) = document.images.get(source) {
        return Some(LookTexture { bytes: image.bytes.clone(), mime: image.mime.clone(), wrap });
    }
    let image = document.json["images"].get(source)?;
    let view = document.root.buffer_views.get(image["bufferView"].as_u64()? as usize)?;
    let start = usize::try_from(view.byte_offset.map_or(0, |o| o.0)).ok()?;
    let end = start.checked_add(usize::try_from(view.byte_length.0).ok()?)?;
    let bytes = document.buffers.get(view.buffer.value())?.get(start..end)?.to_vec();
    Some(LookTexture { bytes, mime: image["mimeType"].as_str().unwrap_or_default().to_owned(), wrap })
}

fn texcoords(document: &GltfDocument, slot: &Slot, set: u32) -> Vec<[f32; 2]> {
    attribute(document.primitive(slot).1, Semantic::TexCoords(set))
        .and_then(|accessor| document.source().floats::<2>(accessor, "TEXCOORD").ok())
        .filter(|uv| uv.iter().flatten().all(|x| x.is_finite()))
        .unwrap_or_default()
}

fn colors(document: &GltfDocument, slot: &Slot) -> Vec<[f32; 4]> {
    let Some(accessor) = attribute(document.primitive(slot).1, Semantic::Colors(0)) else {
        return Vec::new();
    };
    let source = document.source();
    let four = source.floats::<4>(accessor, "COLOR_0").or_else(|_| {
        let three = source.floats::<3>(accessor, "COLOR_0")?;
        Ok::<_, super::GltfError>(three.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect())
    });
    let finite = |c: [f32; 4]| c.map(|x| if x.is_finite() { x.clamp(0.0, 1.0) } else { 1.0 });
    four.unwrap_or_default().into_iter().map(finite).collect()
}

fn numbers<const N: usize>(json: &Value) -> Option<[f32; N]> {
    let list = json.as_array().filter(|list| list.len() == N)?;
    let mut out = [0.0; N];
    for (out, value) in out.iter_mut().zip(list) {
        *out = value.as_f64().filter(|x| x.is_finite())? as f32;
    }
    Some(out)
}
