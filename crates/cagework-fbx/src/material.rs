//! Materials, textures and images.

use std::collections::{HashMap, HashSet};

use cagework_core::words::counted;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::{Value, json};
use ufbx::{Material, MaterialMap, Mesh, Scene, Texture, WrapMode};

use crate::document::Document;
use crate::limits::FbxError;

/// Characters of a path that a URI keeps.
const OF_PATHS: &AsciiSet = &NON_ALPHANUMERIC.remove(b'/').remove(b'.').remove(b'-').remove(b'_');
/// Wrapping mode of a sampler: clamp to the edge.
const CLAMP: u32 = 33071;
const REPEAT: u32 = 10497;

struct Textures<'a> {
    scene: &'a Scene,
    /// Texture of the document for each FBX texture; `None` if its image is not readable.
    known: HashMap<u32, Option<usize>>,
    images: HashMap<u32, Option<usize>>,
    /// Number of sets of texture coordinates that the material being written needs.
    n_sets: usize,
    notices: &'a mut Vec<String>,
}

/// Writes all materials, in the order of the scene. Returns the number of sets of texture coordinates that each needs.
pub(crate) fn write(
    scene: &Scene,
    document: &mut Document,
    notices: &mut Vec<String>,
) -> Result<Vec<usize>, FbxError> {
    let mut meshes: HashMap<u32, &Mesh> = HashMap::new();
    for mesh in &scene.meshes {
        for material in &mesh.materials {
            meshes.entry(material.element.typed_id).or_insert(mesh);
        }
    }
    let mut textures = Textures { scene, known: HashMap::new(), images: HashMap::new(), n_sets: 0, notices };
    let (mut left_out, mut n_sets) = (HashSet::new(), Vec::new());
    for material in &scene.materials {
        let mesh = meshes.get(&material.element.typed_id).copied();
        textures.n_sets = 0;
        let written = write_one(material, mesh, &mut textures, document)?;
        n_sets.push(textures.n_sets);
        document.push("materials", written)?;
        let pbr = &material.pbr;
        let kept = [&pbr.base_color, &pbr.emission_color, &pbr.normal_map].map(id_of);
        let others = material.textures.iter().map(|one| one.texture.element.typed_id);
        left_out.extend(others.filter(|id| !kept.contains(&Some(*id))));
    }
    if !left_out.is_empty() {
        notices.push(format!(
            "{} of roughness, opacity or other properties: not converted from FBX",
            counted(left_out.len(), "texture", "textures")
        ));
    }
    Ok(n_sets)
}

fn id_of(map: &MaterialMap) -> Option<u32> {
    map.texture.as_ref().map(|texture| texture.element.typed_id)
}

fn write_one(
    material: &Material,
    mesh: Option<&Mesh>,
    textures: &mut Textures<'_>,
    document: &mut Document,
) -> Result<Value, FbxError> {
    let pbr = &material.pbr;
    let base = textures.write(&pbr.base_color, mesh, document)?;
    // As in other importers, a texture replaces the colour.
    let [r, g, b] = if base.is_some() { [1.0; 3] } else { scaled(&pbr.base_color, &pbr.base_factor) };
    let opacity = share(&pbr.opacity).filter(|&opacity| opacity > 0.0).unwrap_or(1.0);
    let is_pbr = material.features.pbr.enabled;
    let mut written = json!({
        "name": &*material.element.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, opacity],
            "metallicFactor": share(&pbr.metalness).filter(|_| is_pbr).unwrap_or(0.0),
            "roughnessFactor": share(&pbr.roughness).unwrap_or(0.9),
        },
    });
    if let Some(base) = base {
        written["pbrMetallicRoughness"]["baseColorTexture"] = base;
    }
    if opacity < 1.0 {
        written["alphaMode"] = "BLEND".into();
    }
    if let Some(normal) = textures.write(&pbr.normal_map, mesh, document)? {
        written["normalTexture"] = normal;
    }
    let glow = scaled(&pbr.emission_color, &pbr.emission_factor);
    if let Some(texture) = textures.write(&pbr.emission_color, mesh, document)? {
        written["emissiveTexture"] = texture;
        written["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    } else if glow != [0.0; 3] {
        written["emissiveFactor"] = json!(glow);
    }
    if material.features.double_sided.enabled {
        written["doubleSided"] = true.into();
    }
    Ok(written)
}

/// The value of a map between 0 and 1; `None` if it has none.
fn share(map: &MaterialMap) -> Option<f32> {
    let value = map.value_vec4.x as f32;
    (map.has_value && value.is_finite()).then_some(value.clamp(0.0, 1.0))
}

/// A colour times its factor.
fn scaled(color: &MaterialMap, factor: &MaterialMap) -> [f32; 3] {
    let factor = if factor.has_value { factor.value_vec4.x } else { 1.0 };
    [color.value_vec4.x, color.value_vec4.y, color.value_vec4.z].map(|x| {
        let value = (x * factor) as f32;
        if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 }
    })
}

impl Textures<'_> {
    /// Writes the texture of a map; returns a reference to it.
    fn write(
        &mut self,
        map: &MaterialMap,
        mesh: Option<&Mesh>,
        document: &mut Document,
    ) -> Result<Option<Value>, FbxError> {
        let found = map.texture.as_ref().filter(|_| map.texture_enabled);
        let Some(texture) = found.and_then(|texture| texture.file_textures.first()) else { return Ok(None) };
        let id = texture.element.typed_id;
        let number = if let Some(&known) = self.known.get(&id) {
            known
        } else {
            let made = self.make(texture, document)?;
            self.known.insert(id, made);
            made
        };
        let Some(number) = number else { return Ok(None) };
        let sets = mesh.into_iter().flat_map(|mesh| &*mesh.uv_sets);
        let set = sets.filter(|set| set.vertex_uv.exists).position(|set| *set.name == *texture.uv_set);
        let set = set.unwrap_or(0);
        self.n_sets = self.n_sets.max(set + 1);
        Ok(Some(match set {
            0 => json!({ "index": number }),
            set => json!({ "index": number, "texCoord": set }),
        }))
    }

    fn make(&mut self, texture: &Texture, document: &mut Document) -> Result<Option<usize>, FbxError> {
        if !texture.has_file {
            return Ok(None);
        }
        let image = if let Some(&known) = self.images.get(&texture.file_index) {
            known
        } else {
            let made = self.image(texture, document)?;
            self.images.insert(texture.file_index, made);
            made
        };
        let Some(image) = image else { return Ok(None) };
        let mut made = json!({ "name": &*texture.element.name, "source": image });
        let wraps = [texture.wrap_u, texture.wrap_v];
        if wraps.contains(&WrapMode::Clamp) {
            let [s, t] = wraps.map(|wrap| if wrap == WrapMode::Clamp { CLAMP } else { REPEAT });
            made["sampler"] = document.push("samplers", json!({ "wrapS": s, "wrapT": t }))?.into();
        }
        document.push("textures", made).map(Some)
    }

    /// Writes an image: the embedded one, or a reference to a file.
    fn image(&mut self, texture: &Texture, document: &mut Document) -> Result<Option<usize>, FbxError> {
        let file = self.scene.texture_files.get(texture.file_index as usize);
        let content: &[u8] = match file {
            Some(file) if texture.content.is_empty() => &file.content,
            _ => &texture.content,
        };
        let path = path_of(texture);
        let name = path.rsplit('/').next().unwrap_or_default();
        if content.is_empty() {
            if name.is_empty() {
                return Ok(None);
            }
            let uri = utf8_percent_encode(&path, OF_PATHS).to_string();
            return document.push("images", json!({ "name": name, "uri": uri })).map(Some);
        }
        let mime = match content {
            [0x89, b'P', b'N', b'G', ..] => "image/png",
            [0xff, 0xd8, 0xff, ..] => "image/jpeg",
            _ => {
                self.notices.push(format!("texture '{name}' in the FBX file is not a PNG or JPEG: left out"));
                return Ok(None);
            }
        };
        let view = document.view(content, None)?;
        document.push("images", json!({ "name": name, "bufferView": view, "mimeType": mime })).map(Some)
    }
}

/// Path of a texture's file relative to the FBX file. A path that leads elsewhere becomes a name beside the FBX file.
fn path_of(texture: &Texture) -> String {
    let names = [&texture.relative_filename, &texture.filename, &texture.absolute_filename];
    let path =
        names.iter().find(|name| !name.is_empty()).map_or(String::new(), |name| name.replace('\\', "/"));
    let is_elsewhere =
        path.starts_with('/') || path.contains(':') || path.split('/').any(|part| part == "..");
    if is_elsewhere { path.rsplit('/').next().unwrap_or_default().to_owned() } else { path }
}
