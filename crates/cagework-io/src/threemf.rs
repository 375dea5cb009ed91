//! 3MF: a zip archive with model parts in XML (3MF Core Specification 1.3, Production Extension 1.1.2, Materials and
//! Properties Extension 1.2.1).
//!
//! Reading creates the vertices of an object once for each placement of the object in the build. An export replaces
//! changed coordinates in the text of the model parts. If placements of one object have different shapes, it writes a
//! copy of the object for each additional shape. Shapes that differ by rounding only are one. All other files of the
//! archive are copied byte for byte.

mod package;
mod part;
mod patch;
mod scene;
mod xml;

use std::collections::HashMap;
use std::fmt::Write as _;

use crate::archive::write_new;
use crate::error::WriteError;
use crate::obj::{Group, MAX_MATERIALS, Material, NONE};
use crate::origin::Coordinate;
use crate::polygons::{Polygons, PolygonsError, Shape};

pub(crate) use package::is_3mf;
use part::ModelPart;
pub(crate) use patch::patch;
use scene::{Instance, Scene};

/// Reads an archive, using at most `memory_limit` bytes. `near`: store positions relative to an origin near them.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<Polygons, PolygonsError> {
    let scene = Scene::read(bytes, memory_limit)?;
    let mut read = Polygons { face_starts: vec![0], bytes_of_file: scene.bytes, ..Polygons::default() };
    let mut positions = Vec::with_capacity(scene.n_vertices);
    let places = scene.instances.iter().flat_map(|instance| {
        let vertices = &scene.object(instance.object).vertices;
        vertices.iter().map(|&p| instance.transform.transform_point3(p))
    });
    positions.extend(places);
    read.place(&positions, near);
    drop(positions);
    let mut palette = Palette::default();
    for instance in &scene.instances {
        let first_face = read.face_starts.len() as u32 - 1;
        read.groups.push(Group { is_object: true, name: scene.name(instance).to_owned(), first_face });
        let object = scene.object(instance.object);
        let is_mirrored = instance.transform.matrix3.determinant() < 0.0;
        for (t, triangle) in object.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|v| instance.first_vertex + v);
            read.corners.extend(if is_mirrored { [a, c, b] } else { [a, b, c] });
            read.end_face(None)?;
            read.face_materials.push(palette.material_of(&scene, instance, t));
        }
    }
    if read.groups.iter().all(|group| group.name.is_empty()) {
        read.groups.clear();
    }
    if palette.names.is_empty() {
        read.face_materials.clear();
    }
    (read.materials, read.looks) = (palette.names, palette.looks);
    read.notices = scene.notices;
    if palette.is_full {
        read.notices.push(format!("it has more than {MAX_MATERIALS} colours: the others are not shown"));
    }
    Ok(read)
}

/// Number of objects in all model parts of an archive that can be read; 0 for others.
pub(crate) fn n_objects(bytes: &[u8]) -> usize {
    Scene::read(bytes, u64::MAX)
        .map_or(0, |scene| scene.parts.iter().map(|(_, part)| part.objects.len()).sum())
}

/// Materials in use, in order of first use.
#[derive(Default)]
struct Palette {
    names: Vec<String>,
    looks: HashMap<String, Material>,
    /// Index of a material by name.
    index_of: HashMap<String, u32>,
    /// Index of a material by part, group of properties, and index in the group.
    known: HashMap<(usize, u32, u32), u32>,
    /// Whether there are more materials than the limit.
    is_full: bool,
}

impl Palette {
    /// Material of triangle `t` of an instance, or [`NONE`].
    fn material_of(&mut self, scene: &Scene, instance: &Instance, t: usize) -> u32 {
        let (part, object) = (&scene.parts[instance.object.0].1, scene.object(instance.object));
        let property = object.properties.get(t).copied().flatten().or(object.property);
        let Some((group, index)) = property else { return NONE };
        let key = (instance.object.0, group, index);
        if let Some(&known) = self.known.get(&key) {
            return known;
        }
        let material = self.add(part, group, index);
        self.known.insert(key, material);
        material
    }

    fn add(&mut self, part: &ModelPart, group: u32, index: u32) -> u32 {
        let Some((name, color)) = part.colors.get(&group).and_then(|colors| colors.get(index as usize))
        else {
            return NONE;
        };
        let hex: String = color.iter().map(|x| format!("{:02X}", (255.0 * x).round() as u8)).collect();
        let same = |look: &Material| look.color == *color;
        let name = match self.looks.get(name) {
            _ if name.is_empty() => format!("#{hex}"),
            Some(look) if !same(look) => format!("{name} #{hex}"),
            _ => name.clone(),
        };
        if let Some(&known) = self.index_of.get(&name) {
            return known;
        }
        if self.names.len() == MAX_MATERIALS {
            self.is_full = true;
            return NONE;
        }
        self.index_of.insert(name.clone(), self.names.len() as u32);
        self.looks.insert(name.clone(), Material { color: *color, image: None });
        self.names.push(name);
        self.names.len() as u32 - 1
    }
}

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;
const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="rel0" Target="/3D/3dmodel.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;

/// Writes a new archive with one object, in millimetres: all vertices in order, and the triangles.
///
/// # Errors
/// [`WriteError::NoFaces`] if no triangle has three different vertices.
pub(crate) fn write(shape: &Shape<'_>) -> Result<Vec<u8>, WriteError> {
    let mut text = r#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources>
<object id="1" type="model">
<mesh>
<vertices>
"#
    .to_owned();
    let mut line = |content: std::fmt::Arguments<'_>| {
        text.write_fmt(content).expect("writing to a String cannot fail");
        text.push('\n');
    };
    for &p in shape.positions.iter() {
        let [x, y, z] = Coordinate::of(shape.origin, p);
        line(format_args!(r#"<vertex x="{x}" y="{y}" z="{z}"/>"#));
    }
    line(format_args!("</vertices>\n<triangles>"));
    let mut n = 0;
    for [a, b, c] in shape.triangles.iter().filter(|[a, b, c]| a != b && b != c && c != a) {
        line(format_args!(r#"<triangle v1="{a}" v2="{b}" v3="{c}"/>"#));
        n += 1;
    }
    if n == 0 {
        return Err(WriteError::NoFaces { format: "3MF" });
    }
    text += "</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"1\"/>\n</build>\n</model>\n";
    write_new(&[
        ("[Content_Types].xml", CONTENT_TYPES),
        ("_rels/.rels", RELATIONSHIPS),
        ("3D/3dmodel.model", &text),
    ])
}
