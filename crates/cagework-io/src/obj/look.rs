//! Appearance of an OBJ: base colours and textures of the materials in its `.mtl` files.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::lex::{lines, tokens};
use cagework_core::color::linear_from_srgb;
use cagework_core::words::counted;
use glam::Vec3;

use super::{NONE, PolygonDocument};
use crate::look::{Look, LookAlpha, LookGroup, LookImage, LookVertex};
use crate::normals::Shading;
use crate::siblings::{Image, Resolve, SiblingError, Siblings};

/// A material of an `.mtl` file.
#[derive(Clone, Debug)]
pub(crate) struct Material {
    /// Colour `Kd`, with `d` as alpha; sRGB as written.
    pub(crate) color: [f32; 4],
    /// Texture of `map_Kd`, if any.
    pub(crate) image: Option<Image>,
}

impl Material {
    /// Base colour factor, linear RGBA. A grey `Kd` next to a texture is an exporter's default, often black,
    /// and is replaced by white.
    pub(crate) fn base_color(&self) -> [f32; 4] {
        let [r, g, b, alpha] = self.color;
        let is_default = self.image.is_some() && r == g && g == b;
        let [r, g, b] = if is_default { [1.0; 3] } else { [r, g, b].map(linear_from_srgb) };
        [r, g, b, alpha].map(|share| share.clamp(0.0, 1.0))
    }
}

/// Adds the materials of an `.mtl` file, with their textures, to `into`.
pub(crate) fn read_materials(
    bytes: &[u8],
    siblings: &mut Siblings<'_>,
    notices: &mut Vec<String>,
    into: &mut HashMap<String, Material>,
) {
    let mut name: Option<String> = None;
    let (mut has_opacity, mut n_placed) = (false, 0_usize);
    for line in lines(bytes) {
        let mut words = tokens(bytes, line.range.clone());
        let Some(keyword) = words.next() else { continue };
        let rest = rest_of(&bytes[line.range.clone()], &bytes[keyword.clone()]);
        let mut number =
            || words.next().and_then(|w| std::str::from_utf8(&bytes[w]).ok()?.parse::<f32>().ok());
        if &bytes[keyword.clone()] == b"newmtl" {
            into.insert(rest.clone(), Material { color: [1.0; 4], image: None });
            (name, has_opacity) = (Some(rest), false);
            continue;
        }
        let Some(material) = name.as_ref().and_then(|n| into.get_mut(n)) else { continue };
        match &bytes[keyword] {
            b"Kd" => {
                if let (Some(r), Some(g), Some(b)) = (number(), number(), number()) {
                    material.color[..3].copy_from_slice(&[r, g, b]);
                }
            }
            b"d" => (material.color[3], has_opacity) = (number().unwrap_or(1.0), true),
            // Some exporters write the opacity as both `d` and `Tr`.
            b"Tr" if !has_opacity => material.color[3] = 1.0 - number().unwrap_or(0.0),
            b"map_Kd" => {
                let (file, is_placed) = without_options(&rest);
                n_placed += usize::from(is_placed);
                material.image = siblings.image(&file.replace('\\', "/"), "it is not drawn", notices);
            }
            _ => {}
        }
    }
    if n_placed > 0 {
        let textures = counted(n_placed, "texture has", "textures have");
        notices.push(format!("{textures} an offset, a scale or a turbulence in a material file: ignored"));
    }
}

/// Returns the file name after the options of a `map_Kd` line, and whether an option moves or scales the texture. File
/// names may contain blanks.
fn without_options(line: &str) -> (&str, bool) {
    let (mut rest, mut is_placed) = (line, false);
    while let Some((option, mut after)) = rest.split_once(char::is_whitespace) {
        let (n_words, identity) = match option {
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-imfchan" | "-texres" | "-boost" | "-bm" => (1, None),
            "-mm" => (2, None),
            // One to three numbers.
            "-o" | "-t" => (3, Some(0.0)),
            "-s" => (3, Some(1.0)),
            _ => break,
        };
        for _ in 0..n_words {
            let Some((word, next)) = after.trim_start().split_once(char::is_whitespace) else { break };
            if let Some(identity) = identity {
                let Ok(number) = word.parse::<f32>() else { break };
                is_placed |= number != identity;
            }
            after = next;
        }
        rest = after.trim_start();
    }
    (rest, is_placed)
}

/// Lists the names of an OBJ's material files and their textures.
pub(crate) fn named_files(bytes: &[u8], resolve: &mut Resolve<'_>, memory_limit: u64) -> Vec<String> {
    let (mut names, mut libraries) = (Vec::new(), HashSet::new());
    let mut note = |name: &str| {
        names.push(name.to_owned());
        resolve(name)
    };
    let mut siblings = Siblings::new(&mut note, memory_limit);
    for line in lines(bytes) {
        let keyword = tokens(bytes, line.range.clone()).next();
        if keyword.is_none_or(|keyword| &bytes[keyword] != b"mtllib") {
            continue;
        }
        for (_, file) in libraries_of(&rest_of(&bytes[line.range], b"mtllib"), &mut siblings, &mut libraries)
        {
            if let Ok(file) = file {
                read_materials(&file, &mut siblings, &mut Vec::new(), &mut HashMap::new());
            }
        }
    }
    names
}

/// Name and content of a material file.
type Library = (String, Result<Arc<Vec<u8>>, SiblingError>);

/// Reads the files of a `mtllib` line that are not in `known`, and adds them to it. The text after the keyword is one name
/// with blanks or, if there is no such file, several names.
pub(super) fn libraries_of(
    text: &str,
    siblings: &mut Siblings<'_>,
    known: &mut HashSet<String>,
) -> Vec<Library> {
    let text = text.replace('\\', "/");
    let names = match siblings.file(&text) {
        Err(SiblingError::Missing) => text.split_whitespace().map(str::to_owned).collect(),
        _ => vec![text],
    };
    let new = names.into_iter().filter(|name| known.insert(name.clone()));
    new.map(|name| (name.clone(), siblings.file(&name))).collect()
}

/// Returns the text after the keyword. Names may contain blanks.
pub(crate) fn rest_of(line: &[u8], keyword: &[u8]) -> String {
    let rest = line.trim_ascii().strip_prefix(keyword).unwrap_or_default().trim_ascii();
    String::from_utf8_lossy(rest).into_owned()
}

/// Builds the appearance of a document, with one [`LookVertex`] per distinct pair of source vertex and texture
/// coordinate.
pub(crate) fn look(document: &PolygonDocument, positions: &[Vec3]) -> Look {
    let mut look = Look::default();
    let sources = sources(document, positions, &mut look.copies);
    let mut numbers: HashMap<(u32, u32), u32> = HashMap::new();
    let mut corner = |c: u32, look: &mut Look| {
        let (corner, source) = (document.corners[c as usize], sources[c as usize]);
        *numbers.entry((source, corner.vt)).or_insert_with(|| {
            let uv = document.texcoords.get(corner.vt as usize).map_or([0.0; 2], |&[u, v]| [u, 1.0 - v]);
            let color = document.colors.get(&corner.v).map_or([1.0; 4], |&[r, g, b]| {
                [linear_from_srgb(r), linear_from_srgb(g), linear_from_srgb(b), 1.0]
            });
            look.vertices.push(LookVertex { uv, color, ..LookVertex::plain(source) });
            look.vertices.len() as u32 - 1
        })
    };
    let mut images = HashMap::new();
    for (material, triangles) in document.by_material() {
        let start = look.triangles.len() as u32;
        for t in triangles {
            let drawn = t.map(|c| corner(c, &mut look));
            look.triangles.push(drawn);
        }
        let range = start..look.triangles.len() as u32;
        let name = document.materials.get(material as usize);
        match name.and_then(|name| document.looks.get(name)) {
            Some(found) => {
                let image = found.image.as_ref().map(|image| {
                    *images.entry(Arc::as_ptr(&image.bytes)).or_insert_with(|| {
                        let (name, mime) = (image.name.as_ref().into(), image.mime.into());
                        look.images.push(LookImage { name, bytes: image.bytes.to_vec(), mime });
                        look.images.len() as u32 - 1
                    })
                });
                look.groups.push(LookGroup {
                    triangles: range,
                    base_color: found.base_color(),
                    image,
                    alpha: if found.color[3] < 1.0 { LookAlpha::Blend } else { LookAlpha::Opaque },
                    double_sided: true,
                    ..LookGroup::default()
                });
            }
            None if !document.colors.is_empty() => {
                look.groups.push(LookGroup { triangles: range, double_sided: true, ..LookGroup::default() });
            }
            None => debug_assert!(material == NONE || name.is_some()),
        }
    }
    look
}

/// Finds the source vertex of each corner: its own vertex or, at a vertex where normals or smoothing groups separate
/// several surfaces, a duplicate appended to `copies`. Corners without normal and smoothing group keep their vertex.
/// `[n_corners]`
fn sources(document: &PolygonDocument, positions: &[Vec3], copies: &mut Vec<u32>) -> Vec<u32> {
    let vertices: Vec<u32> = document.corners.iter().map(|corner| corner.v).collect();
    if document.normals.is_empty() && document.face_smoothing.is_empty() {
        return vertices;
    }
    let normals: Vec<Vec3> = document.corners.iter().map(|corner| document.normal(corner)).collect();
    let surfaces = document.surfaces();
    let says: Vec<bool> = normals.iter().zip(&surfaces).map(|(n, &s)| *n != Vec3::ZERO || s != 0).collect();
    if !says.contains(&true) {
        return vertices;
    }
    let shading = Shading::new(positions, vertices.clone(), normals, &surfaces, document.triangles.clone());
    let mut taken = vec![false; positions.len()];
    let mut source_of = HashMap::new();
    let corners = vertices.into_iter().zip(says).zip(shading.clusters());
    corners
        .map(|((v, says), &surface)| {
            if !says {
                return v;
            }
            *source_of.entry(surface).or_insert_with(|| {
                if !std::mem::replace(&mut taken[v as usize], true) {
                    return v;
                }
                copies.push(v);
                (positions.len() + copies.len() - 1) as u32
            })
        })
        .collect()
}
