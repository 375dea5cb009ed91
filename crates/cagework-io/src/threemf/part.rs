//! A model part: objects, colours and build items in XML.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DAffine3, DVec3};
use quick_xml::Reader;
use quick_xml::escape::unescape;
use quick_xml::events::{BytesStart, Event};

use super::package::fault;
use super::xml::{attributes, span_of};
use crate::gltf::{MAX_ELEMENTS, MAX_TRIANGLES};
use crate::polygons::PolygonsError;
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Limit on the objects of a part, and on the objects of the build with every placement counted.
pub(super) const MAX_OBJECTS: u64 = 1 << 17;

/// Group of properties, and index in the group.
pub(super) type Property = (u32, u32);

/// Content of a model part.
#[derive(Default)]
pub(super) struct ModelPart {
    pub(super) unit: String,
    pub(super) objects: Vec<Object>,
    /// Index of each object by its identifier.
    pub(super) index_of: HashMap<u32, usize>,
    pub(super) items: Vec<Placement>,
    /// Names and sRGB colours of each group of properties; empty for groups that are not read.
    pub(super) colors: HashMap<u32, Vec<(String, [f32; 4])>>,
    /// Largest identifier of a resource.
    pub(super) last_id: u32,
    /// Kinds of data that are kept in the file but not shown.
    pub(super) unseen: Vec<&'static str>,
}

/// An object: triangles, or placements of other objects.
#[derive(Default)]
pub(super) struct Object {
    pub(super) id: u32,
    pub(super) name: String,
    /// Bytes of the element in the text of the part.
    pub(super) span: Range<usize>,
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Property of the first corner of each triangle; empty if no triangle has one.
    pub(super) properties: Vec<Option<Property>>,
    /// Default property, for triangles without a property.
    pub(super) property: Option<Property>,
    pub(super) components: Vec<Placement>,
}

/// A placement of an object: a component or a build item.
pub(super) struct Placement {
    pub(super) object: u32,
    /// Path of the model part that contains the object; `None` for the part of this placement.
    pub(super) path: Option<String>,
    pub(super) transform: DAffine3,
    /// Bytes of the identifier in the text of the part.
    pub(super) id_span: Range<usize>,
}

/// Parts of the namespaces of extensions that a file may require. Their data are read, or kept but not shown.
const EXTENSIONS: [&str; 8] = [
    "/core/",
    "/production/",
    "/material/",
    "/beamlattice/",
    "/slice/",
    "/trianglesets/",
    "/volumetric/",
    "/displacement/",
];

/// Limit on the colours of all groups.
const MAX_COLORS: u64 = 1 << 18;

/// Numbers of elements read so far in all parts. They are limited, because an element takes more memory than its text.
#[derive(Default)]
pub(super) struct PartCounts {
    vertices: u64,
    triangles: u64,
    objects: u64,
    placements: u64,
    colors: u64,
}

impl PartCounts {
    /// Counts an element.
    ///
    /// # Errors
    /// [`PolygonsError::TooMany`] for the first element above the limit.
    fn add(&mut self, name: &str) -> Result<(), PolygonsError> {
        let (count, what, limit) = match name {
            "vertex" => (&mut self.vertices, "vertices", MAX_ELEMENTS),
            "triangle" => (&mut self.triangles, "triangles", MAX_TRIANGLES),
            "object" => (&mut self.objects, "objects", MAX_OBJECTS),
            "component" | "item" => (&mut self.placements, "objects", MAX_OBJECTS),
            "base" | "color" => (&mut self.colors, "colours", MAX_COLORS),
            _ => return Ok(()),
        };
        *count += 1;
        if *count > limit { Err(PolygonsError::TooMany { count: *count, what, limit }) } else { Ok(()) }
    }
}

/// Local name of a tag or attribute.
fn local(key: &str) -> &str {
    key.rsplit_once(':').map_or(key, |(_, name)| name)
}

/// Parses the number in an attribute.
fn number<T: std::str::FromStr>(key: &str, value: &str) -> Result<T, String> {
    let quoted = || shown_start(value, MAX_NAME_CHARS);
    value.trim().parse().map_err(|_| format!("has {key}=\"{}\", which is not a number in range", quoted()))
}

/// State of the reader between two tags.
struct PartReader<'a> {
    text: &'a str,
    part: ModelPart,
    object: Option<Object>,
    is_in_mesh: bool,
    /// Group of properties whose colours follow.
    group: Option<u32>,
}

impl ModelPart {
    /// Reads the text of the part `name`.
    pub(super) fn read(name: &str, text: &str, counts: &mut PartCounts) -> Result<Self, PolygonsError> {
        let mut reader = Reader::from_str(text);
        let mut read =
            PartReader { text, part: Self::default(), object: None, is_in_mesh: false, group: None };
        let malformed = |position: usize| {
            let line = 1 + text.as_bytes()[..position].iter().filter(|&&byte| byte == b'\n').count();
            fault(name, &format!("is not well-formed XML, at line {line}"))
        };
        let mut has_root = false;
        loop {
            let start = text.len() - reader.get_ref().len();
            let event = reader.read_event().map_err(|_| malformed(start))?;
            let is_empty = matches!(event, Event::Empty(_));
            match event {
                Event::Start(tag) | Event::Empty(tag) => {
                    let tag_name = tag.local_name();
                    if !std::mem::replace(&mut has_root, true) && tag_name.as_ref() != "model" {
                        let root = shown_start(tag_name.as_ref(), MAX_NAME_CHARS);
                        return Err(fault(name, &format!("is not a model: its root is '{root}'")));
                    }
                    if tag_name.as_ref() == "model" {
                        check_extensions(name, &tag)?;
                    }
                    counts.add(tag_name.as_ref())?;
                    read.start(&tag).map_err(|problem| fault(name, &problem))?;
                    if is_empty {
                        read.end(tag_name.as_ref(), text.len() - reader.get_ref().len())
                            .map_err(|problem| fault(name, &problem))?;
                    }
                }
                Event::End(tag) => read
                    .end(tag.local_name().as_ref(), text.len() - reader.get_ref().len())
                    .map_err(|problem| fault(name, &problem))?,
                Event::DocType(_) => {
                    return Err(fault(name, "has a document type definition, which 3MF forbids"));
                }
                Event::Eof if has_root => return Ok(read.part),
                Event::Eof => return Err(fault(name, "has no XML elements")),
                _ => {}
            }
        }
    }
}

/// Checks that all extensions that the root of the part `name` requires are known.
fn check_extensions(name: &str, tag: &BytesStart<'_>) -> Result<(), PolygonsError> {
    let of = |name: &str| attributes(tag).find(|(key, _)| *key == name).map(|(_, value)| value);
    for prefix in of("requiredextensions").unwrap_or_default().split_ascii_whitespace() {
        let space = of(&format!("xmlns:{prefix}")).unwrap_or(prefix);
        if !EXTENSIONS.iter().any(|known| space.contains(known)) {
            let [name, space] = [name, space].map(|text| shown_start(text, MAX_NAME_CHARS));
            return Err(PolygonsError::Unsupported(format!(
                "its part '{name}' requires the extension '{space}', which is not read: save the model again without it"
            )));
        }
    }
    Ok(())
}

impl PartReader<'_> {
    fn start(&mut self, tag: &BytesStart<'_>) -> Result<(), String> {
        let name = tag.local_name();
        match (name.as_ref(), &mut self.object) {
            ("vertex", Some(object)) if self.is_in_mesh => {
                let mut place = [f64::NAN; 3];
                for (key, value) in attributes(tag) {
                    if let Some(axis) = ["x", "y", "z"].iter().position(|&axis| axis == key) {
                        let whose = |e| format!(": vertex {} {e}", object.vertices.len());
                        place[axis] = number(key, value).map_err(whose)?;
                    }
                }
                object.vertices.push(DVec3::from_array(place));
            }
            ("triangle", Some(object)) if self.is_in_mesh => {
                let unseen = triangle(tag, object)
                    .map_err(|e| format!(": triangle {} {e}", object.triangles.len()))?;
                unseen.into_iter().for_each(|what| self.part.add_unseen(what));
            }
            ("mesh", Some(_)) => self.is_in_mesh = true,
            ("component", Some(object)) if !self.is_in_mesh => {
                object.components.push(placement(self.text, tag)?);
            }
            ("object", None) => self.object = Some(self.part.start_object(tag, self.text)?),
            ("object", Some(_)) => return Err("has an object inside an object".into()),
            ("item", None) => self.part.items.push(placement(self.text, tag)?),
            ("model", None) => {
                let unit =
                    attributes(tag).find(|(key, _)| *key == "unit").map_or("millimeter", |(_, unit)| unit);
                self.part.unit = unit.to_owned();
            }
            (name @ ("basematerials" | "colorgroup"), None) => {
                let id = self.part.id_of(tag)?.ok_or_else(|| format!("has a {name} without id"))?;
                self.group = Some(id);
                self.part.colors.insert(id, Vec::new());
            }
            ("base" | "color", None) => {
                if let Some(colors) = self.group.and_then(|group| self.part.colors.get_mut(&group)) {
                    let (mut name, mut color) = (String::new(), [1.0; 4]);
                    for (key, value) in attributes(tag) {
                        match key {
                            "name" => name = plain(value),
                            "displaycolor" | "color" => color = color_of(value).unwrap_or(color),
                            _ => {}
                        }
                    }
                    colors.push((name, color));
                }
            }
            (name, None) => {
                // Other resources. Ignore identifiers that are not numbers: they cannot equal the identifier of an
                // object.
                let _ = self.part.id_of(tag);
                if ["texture2dgroup", "compositematerials", "multiproperties"].contains(&name) {
                    self.part.add_unseen("textures and mixed materials");
                }
            }
            (name, Some(_)) => {
                if ["displacementmesh", "levelset", "beamlattice"].contains(&name) {
                    self.part.add_unseen("beams, level sets and displacements");
                }
            }
        }
        Ok(())
    }

    /// Ends an element. `end`: the byte after it.
    fn end(&mut self, name: &str, end: usize) -> Result<(), String> {
        match name {
            "mesh" => self.is_in_mesh = false,
            "basematerials" | "colorgroup" => self.group = None,
            "object" => {
                let Some(mut object) = self.object.take() else { return Ok(()) };
                self.is_in_mesh = false;
                object.span.end = end;
                let n = object.vertices.len();
                let refers = |t: &[u32; 3]| t.iter().copied().find(|&v| v as usize >= n);
                if let Some((t, v)) =
                    object.triangles.iter().enumerate().find_map(|(t, triangle)| Some((t, refers(triangle)?)))
                {
                    let id = object.id;
                    return Err(format!(
                        ": triangle {t} of object {id} refers to vertex {v}, but the object has {n}, counted from 0"
                    ));
                }
                let id = object.id;
                if self.part.index_of.insert(id, self.part.objects.len()).is_some() {
                    return Err(format!(": two objects have the id {id}"));
                }
                self.part.objects.push(object);
            }
            _ => {}
        }
        Ok(())
    }
}

impl ModelPart {
    fn add_unseen(&mut self, what: &'static str) {
        if !self.unseen.contains(&what) {
            self.unseen.push(what);
        }
    }

    /// Reads the identifier of a resource, if it has one.
    fn id_of(&mut self, tag: &BytesStart<'_>) -> Result<Option<u32>, String> {
        let Some((key, value)) = attributes(tag).find(|(key, _)| *key == "id") else { return Ok(None) };
        let id: u32 = number(key, value).map_err(|e| format!(": a resource {e}"))?;
        self.last_id = self.last_id.max(id);
        Ok(Some(id))
    }

    fn start_object(&mut self, tag: &BytesStart<'_>, text: &str) -> Result<Object, String> {
        let id = self.id_of(tag)?.ok_or(": an object has no id")?;
        let start = span_of(text, tag.name().0).start - 1;
        let mut object = Object { id, span: start..start, ..Object::default() };
        let (mut group, mut index) = (None, None);
        for (key, value) in attributes(tag) {
            let whose = |e| format!(": object {id} {e}");
            match key {
                "name" => object.name = plain(value),
                "pid" => group = Some(number(key, value).map_err(whose)?),
                "pindex" => index = Some(number(key, value).map_err(whose)?),
                _ => {}
            }
        }
        object.property = group.zip(index.or(Some(0)));
        Ok(object)
    }
}

/// Adds a triangle, unless two of its vertices are equal, which 3MF forbids. Such triangles are kept in the file, but
/// not shown. Returns the kind of data of the triangle that is not shown.
fn triangle(tag: &BytesStart<'_>, object: &mut Object) -> Result<Option<&'static str>, String> {
    let mut corners = [None; 3];
    let (mut group, mut indices) = (None, [None; 3]);
    let mut unseen = None;
    for (key, value) in attributes(tag) {
        let axis = |names: [&str; 3]| names.iter().position(|&name| name == key);
        if let Some(k) = axis(["v1", "v2", "v3"]) {
            corners[k] = Some(number(key, value)?);
        } else if let Some(k) = axis(["p1", "p2", "p3"]) {
            indices[k] = Some(number::<u32>(key, value)?);
        } else if key == "pid" {
            group = Some(number(key, value)?);
        } else if ["paint_color", "mmu_segmentation"].contains(&local(key)) {
            unseen = Some("colours painted in a slicer");
        }
    }
    let [Some(a), Some(b), Some(c)] = corners else { return Err("has fewer than three vertices".into()) };
    if a == b || b == c || c == a {
        return Ok(unseen);
    }
    // `p1` without `pid` refers to the object's group.
    let group = group.or(object.property.map(|(group, _)| group));
    let property = group.zip(indices[0].or_else(|| Some(object.property?.1)).or(Some(0)));
    if property.is_some() && property != object.property {
        object.properties.resize(object.triangles.len(), None);
        object.properties.push(property);
    }
    object.triangles.push([a, b, c]);
    let first = indices[0];
    let is_mixed = indices[1..].iter().any(|index| index.is_some() && *index != first);
    Ok(unseen.or(is_mixed.then_some("colours that change within a triangle")))
}

fn placement(text: &str, tag: &BytesStart<'_>) -> Result<Placement, String> {
    let (mut object, mut path, mut transform) = (None, None, DAffine3::IDENTITY);
    for (key, value) in attributes(tag) {
        let whose = |e: String| format!(": a component or item {e}");
        match key {
            "objectid" => object = Some((number(key, value).map_err(whose)?, span_of(text, value))),
            "transform" => {
                let numbers: Result<Vec<f64>, String> =
                    value.split_ascii_whitespace().take(13).map(|word| number(key, word)).collect();
                let numbers: [f64; 12] = numbers
                    .map_err(whose)?
                    .try_into()
                    .map_err(|_| whose("has a transform without 12 numbers".into()))?;
                transform = DAffine3::from_cols_array(&numbers);
                let determinant = transform.matrix3.determinant();
                if !transform.is_finite() || !determinant.is_normal() {
                    return Err(whose("has a transform that flattens it or is not finite".into()));
                }
            }
            key if local(key) == "path" => path = Some(plain(value)),
            _ => {}
        }
    }
    let (object, id_span) = object.ok_or(": a component or item has no objectid")?;
    Ok(Placement { object, path, transform, id_span })
}

/// Unescapes the value of an attribute; returns it unchanged if an escape is invalid.
fn plain(value: &str) -> String {
    unescape(value).map_or_else(|_| value.to_owned(), std::borrow::Cow::into_owned)
}

/// Parses a colour `#RRGGBB` or `#RRGGBBAA`.
fn color_of(value: &str) -> Option<[f32; 4]> {
    let digits = value
        .trim()
        .strip_prefix('#')
        .filter(|digits| digits.is_ascii() && [6, 8].contains(&digits.len()))?;
    let mut color = [1.0; 4];
    for (k, channel) in color.iter_mut().enumerate().take(digits.len() / 2) {
        *channel = f32::from(u8::from_str_radix(&digits[2 * k..2 * k + 2], 16).ok()?) / 255.0;
    }
    Some(color)
}
