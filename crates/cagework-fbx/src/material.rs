//! Materials, textures and images.

use std::collections::{HashMap, HashSet};

use cagework_core::words::counted;
use glam::DVec2;
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
/// Extension with transforms of texture coordinates.
const TRANSFORM: &str = "KHR_texture_transform";

struct Textures<'a> {
    scene: &'a Scene,
    /// Texture of the document for each FBX texture; `None` if its image is not readable.
    known: HashMap<u32, Option<usize>>,
    images: HashMap<u32, Option<usize>>,
    /// Number of sets of texture coordinates that the material being written needs.
    n_sets: usize,
    /// Whether a texture has a transform.
    has_transforms: bool,
    /// Images of the material being written that are not converted yet.
    unused: HashSet<u32>,
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
    let mut textures = Textures {
        scene,
        known: HashMap::new(),
        images: HashMap::new(),
        n_sets: 0,
        has_transforms: false,
        unused: HashSet::new(),
        notices,
    };
    let (mut left_out, mut n_sets) = (HashSet::new(), Vec::new());
    for material in &scene.materials {
        let mesh = meshes.get(&material.element.typed_id).copied();
        textures.n_sets = 0;
        textures.unused = material.textures.iter().filter_map(|one| image_of(&one.texture)).collect();
        let written = write_one(material, mesh, &mut textures, document)?;
        n_sets.push(textures.n_sets);
        document.push("materials", written)?;
        left_out.extend(textures.unused.drain());
    }
    if textures.has_transforms {
        document.push("extensionsUsed", TRANSFORM.into())?;
    }
    if !left_out.is_empty() {
        notices.push(format!(
            "{} of roughness, opacity or other properties: not converted from FBX",
            counted(left_out.len(), "texture", "textures")
        ));
    }
    Ok(n_sets)
}

/// Number of a texture's image in the FBX file.
fn image_of(texture: &Texture) -> Option<u32> {
    texture.file_textures.first().filter(|texture| texture.has_file).map(|texture| texture.file_index)
}

/// Image of a map; `None` if it has none.
fn image_of_map(map: &MaterialMap) -> Option<u32> {
    map.texture.as_ref().filter(|_| map.texture_enabled).and_then(|texture| image_of(texture))
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
    // glTF reads the opacity of a material from its base colour texture.
    let of_base = image_of_map(&pbr.base_color);
    let of_opacity = [&pbr.opacity, &material.fbx.transparency_color].into_iter().find_map(image_of_map);
    let is_cut = base.is_some() && of_base.is_some() && of_opacity == of_base;
    let opacity = share(&pbr.opacity).filter(|&opacity| opacity > 0.0 && !is_cut).unwrap_or(1.0);
    let is_pbr = material.features.pbr.enabled;
    let mut metallic = share(&pbr.metalness).filter(|_| is_pbr).unwrap_or(0.0);
    let mut roughness = share(&pbr.roughness).unwrap_or(0.9);
    // glTF reads roughness from green and metalness from blue, so grey images of both cannot be kept.
    let [of_roughness, of_metalness] = [&pbr.roughness, &pbr.metalness].map(image_of_map);
    let mut surface = None;
    if is_pbr
        && of_roughness.is_some()
        && (of_metalness == of_roughness || of_metalness.is_none() && metallic == 0.0)
    {
        surface = textures.write(&pbr.roughness, mesh, document)?;
        if surface.is_some() {
            (metallic, roughness) = (if of_metalness.is_some() { 1.0 } else { 0.0 }, 1.0);
        }
    }
    let mut written = json!({
        "name": &*material.element.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, opacity],
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
        },
    });
    if let Some(surface) = surface {
        written["pbrMetallicRoughness"]["metallicRoughnessTexture"] = surface;
    }
    if let Some(occlusion) = textures.write(&pbr.ambient_occlusion, mesh, document)? {
        written["occlusionTexture"] = occlusion;
    }
    if let Some(base) = base {
        written["pbrMetallicRoughness"]["baseColorTexture"] = base;
    }
    if opacity < 1.0 || is_cut {
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
        self.unused.remove(&texture.file_index);
        let sets = mesh.into_iter().flat_map(|mesh| &*mesh.uv_sets);
        let set = sets.filter(|set| set.vertex_uv.exists).position(|set| *set.name == *texture.uv_set);
        let set = set.unwrap_or(0);
        self.n_sets = self.n_sets.max(set + 1);
        let mut reference = json!({ "index": number });
        if set > 0 {
            reference["texCoord"] = set.into();
        }
        if let Some(transform) = transform_of(texture) {
            self.has_transforms = true;
            reference["extensions"] = json!({ TRANSFORM: transform });
        }
        Ok(Some(reference))
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
        if texture.has_uv_transform && transform_of(texture).is_none() {
            let name = &*texture.element.name;
            self.notices.push(format!(
                "the transform of texture '{name}' in the FBX file is left out: glTF scales an image before it turns it"
            ));
        }
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

/// Transform of texture coordinates as in KHR_texture_transform: a scale, a rotation, then a translation, with v downwards.
/// `None` without a transform, and for other ones.
fn transform_of(texture: &Texture) -> Option<Value> {
    /// Cosine of the angle between the axes of the image, above which it is sheared.
    const SHEAR: f64 = 1e-6;
    let m = &texture.uv_to_texture;
    let (x, y) = (DVec2::new(m.m00, -m.m10), DVec2::new(-m.m01, m.m11));
    let offset = DVec2::new(m.m01 + m.m03, 1.0 - m.m11 - m.m13);
    let scale = DVec2::new(x.length(), x.perp_dot(y) / x.length());
    let is_sheared = x.dot(y).abs() > SHEAR * x.length() * y.length();
    if !texture.has_uv_transform || is_sheared || scale.x == 0.0 || !(scale.is_finite() && offset.is_finite())
    {
        return None;
    }
    let [offset, scale] = [offset, scale].map(|v| v.as_vec2().to_array());
    Some(json!({ "offset": offset, "rotation": (-x.y).atan2(x.x) as f32, "scale": scale }))
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
