//! Materials of a glTF: base colours and their textures.

use std::collections::HashMap;
use std::sync::Arc;

use ::gltf::json::mesh::Semantic;
use glam::{Vec2, Vec3};
use serde_json::Value;

use super::accessor::Source;
use super::geometry::{attribute, world_normals};
use super::root::view_bytes;
use super::scene::name_of;
use super::{GltfDocument, Slot};
use crate::look::{Look, LookAlpha, LookGroup, LookImage, LookVertex, LookWrap, sniff_image};
use crate::normals::Shading;
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Images that the materials use, without duplicates.
struct Images<'a> {
    document: &'a GltfDocument,
    /// Index in `found` of each image, by the address and length of its bytes.
    numbers: HashMap<(*const u8, usize), u32>,
    found: Vec<LookImage>,
    /// Limit on the bytes that may still be copied from buffers to `found`: the size of all buffers, minus the bytes
    /// copied so far. Image views can overlap, and copies of all of them could exceed the memory limit.
    left: usize,
}

impl GltfDocument {
    /// Whether vertices of the model have colours.
    pub(crate) fn has_colors(&self) -> bool {
        self.slots.iter().any(|slot| attribute(self.primitive(slot).1, Semantic::Colors(0)).is_some())
    }
}

/// Appearance of a document. `positions` and `triangles` are those of the model.
pub(crate) fn look(document: &GltfDocument, positions: &[Vec3], triangles: &[[u32; 3]]) -> Look {
    let mut vertices: Vec<LookVertex> = (0..positions.len() as u32).map(LookVertex::plain).collect();
    let mut buffers: Vec<_> = document.buffers.iter().collect();
    buffers.sort_unstable_by_key(|buffer| Arc::as_ptr(buffer));
    buffers.dedup_by_key(|buffer| Arc::as_ptr(buffer));
    let left = buffers.iter().map(|buffer| buffer.len()).sum();
    let mut images = Images { document, numbers: HashMap::new(), found: Vec::new(), left };
    let mut normals = vec![Vec3::ZERO; positions.len()];
    let mut groups = Vec::new();
    for slot in &document.slots {
        let range = slot.start as usize..(slot.start + slot.count) as usize;
        if let Ok(Some(original)) = world_normals(document, slot) {
            normals[range.clone()].copy_from_slice(&original[..range.len().min(original.len())]);
        }
        let material = material_of(document, slot);
        let own = &mut vertices[range];
        colours(document, slot, own);
        let Some(material) = material else { continue };
        let texture = Texture::of(&document.json, material);
        coordinates(document, slot, &texture, own);
        groups.push(LookGroup {
            triangles: slot.triangles.start as u32..slot.triangles.end as u32,
            base_color: texture.factor,
            image: texture.image.and_then(|i| images.number(i)),
            wrap: texture.wrap,
            alpha: match material["alphaMode"].as_str() {
                Some("MASK") => LookAlpha::Mask { cutoff: number(&material["alphaCutoff"], 0.5) },
                Some("BLEND") => LookAlpha::Blend,
                _ => LookAlpha::Opaque,
            },
            double_sided: material["doubleSided"].as_bool().unwrap_or(false),
        });
    }
    smooth_seams(positions, normals, triangles, &mut vertices);
    Look { vertices, copies: Vec::new(), triangles: triangles.to_vec(), groups, images: images.found }
}

fn number(value: &Value, default: f32) -> f32 {
    value.as_f64().map_or(default, |x| x as f32)
}

pub(super) fn material_of<'a>(document: &'a GltfDocument, slot: &Slot) -> Option<&'a Value> {
    let mesh = document.instances[slot.instance as usize].mesh as usize;
    let primitive = &document.json["meshes"][mesh]["primitives"][slot.primitive as usize];
    let index = primitive["material"].as_u64()?;
    document.json["materials"].get(index as usize)
}

/// Base colour and its texture, from the core material or KHR_materials_pbrSpecularGlossiness.
pub(super) struct Texture {
    factor: [f32; 4],
    image: Option<usize>,
    wrap: [LookWrap; 2],
    /// Number of the attribute TEXCOORD_n.
    pub(super) set: u32,
    offset: Vec2,
    scale: Vec2,
    rotation: f32,
}

impl Texture {
    pub(super) fn of(json: &Value, material: &Value) -> Self {
        let glossy = &material["extensions"]["KHR_materials_pbrSpecularGlossiness"];
        let (factor, info) = if glossy.is_object() && material.get("pbrMetallicRoughness").is_none() {
            (&glossy["diffuseFactor"], &glossy["diffuseTexture"])
        } else {
            let pbr = &material["pbrMetallicRoughness"];
            (&pbr["baseColorFactor"], &pbr["baseColorTexture"])
        };
        let texture = info["index"].as_u64().map_or(&Value::Null, |t| &json["textures"][t as usize]);
        let webp = &texture["extensions"]["EXT_texture_webp"]["source"];
        let sampler = texture["sampler"].as_u64().map_or(&Value::Null, |s| &json["samplers"][s as usize]);
        let transform = &info["extensions"]["KHR_texture_transform"];
        let pair = |key: &str, default: f32| {
            Vec2::new(number(&transform[key][0], default), number(&transform[key][1], default))
        };
        Self {
            factor: std::array::from_fn(|k| number(&factor[k], 1.0)),
            image: texture["source"].as_u64().or(webp.as_u64()).map(|i| i as usize),
            wrap: ["wrapS", "wrapT"].map(|key| match sampler[key].as_u64() {
                Some(33_071) => LookWrap::Clamp,
                Some(33_648) => LookWrap::Mirror,
                _ => LookWrap::Repeat,
            }),
            set: transform["texCoord"].as_u64().or(info["texCoord"].as_u64()).unwrap_or(0) as u32,
            offset: pair("offset", 0.0),
            scale: pair("scale", 1.0),
            rotation: number(&transform["rotation"], 0.0),
        }
    }

    /// Applies KHR_texture_transform: scales, rotates counter-clockwise (v points down), and translates.
    pub(super) fn transformed(&self, uv: [f32; 2]) -> [f32; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let scaled = self.scale * Vec2::from(uv);
        let turned = Vec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x);
        (turned + self.offset).to_array()
    }
}

fn coordinates(document: &GltfDocument, slot: &Slot, texture: &Texture, vertices: &mut [LookVertex]) {
    let (_, primitive) = document.primitive(slot);
    let Some(accessor) = attribute(primitive, Semantic::TexCoords(texture.set)) else { return };
    let Ok(uvs) = document.source().floats::<2>(accessor, "TEXCOORD") else { return };
    for (vertex, uv) in vertices.iter_mut().zip(uvs) {
        let uv = texture.transformed(uv);
        if uv.iter().all(|x| x.is_finite()) {
            vertex.uv = uv;
        }
    }
}

fn colours(document: &GltfDocument, slot: &Slot, vertices: &mut [LookVertex]) {
    let (_, primitive) = document.primitive(slot);
    let Some(accessor) = attribute(primitive, Semantic::Colors(0)) else { return };
    let source: Source<'_> = document.source();
    let colors: Vec<[f32; 4]> = match source.floats::<4>(accessor, "COLOR_0") {
        Ok(colors) => colors,
        Err(_) => match source.floats::<3>(accessor, "COLOR_0") {
            Ok(colors) => colors.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect(),
            Err(_) => return,
        },
    };
    for (vertex, color) in vertices.iter_mut().zip(colors) {
        vertex.color = color.map(|c| if c.is_finite() { c.clamp(0.0, 1.0) } else { 1.0 });
    }
}

/// Gives coincident vertices of one smooth surface the same source vertex.
fn smooth_seams(positions: &[Vec3], normals: Vec<Vec3>, triangles: &[[u32; 3]], vertices: &mut [LookVertex]) {
    let all = (0..positions.len() as u32).collect();
    let shading = Shading::new(positions, all, normals, &[], triangles.to_vec());
    let mut first: Vec<Option<u32>> = vec![None; positions.len()];
    for (v, &cluster) in (0u32..).zip(shading.clusters()) {
        vertices[v as usize].source = *first[cluster as usize].get_or_insert(v);
    }
}

impl Images<'_> {
    /// Index of an image in the output; `None` if the image is missing or not an image. If image views overlap so much
    /// that their copies would exceed the size of the buffers, images whose copies no longer fit get no bytes.
    fn number(&mut self, image: usize) -> Option<u32> {
        let document = self.document;
        let is_view = document.images.get(image)?.is_none();
        let (name, bytes) = match document.images.get(image)? {
            Some(image) => (image.name.to_string(), image.bytes.as_slice()),
            None => {
                let view = document.json["images"][image]["bufferView"].as_u64()?;
                let name = name_of(&document.json, "images", image as u32, "image");
                let bytes = view_bytes(&document.root, &document.buffers, view)?;
                (shown_start(&name, MAX_NAME_CHARS), bytes)
            }
        };
        let mime = sniff_image(bytes)?;
        let number = *self.numbers.entry((bytes.as_ptr(), bytes.len())).or_insert_with(|| {
            let rest = if is_view { self.left.checked_sub(bytes.len()) } else { Some(self.left) };
            let own = if rest.is_some() { bytes.to_vec() } else { Vec::new() };
            self.left = rest.unwrap_or(self.left);
            self.found.push(LookImage { name, bytes: own, mime: mime.to_owned() });
            self.found.len() as u32 - 1
        });
        Some(number)
    }
}
