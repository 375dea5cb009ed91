//! Patches the model parts of an archive with new positions.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DAffine3, DVec3, Vec3};
use quick_xml::Reader;
use quick_xml::events::Event;

use super::package::Package;
use super::part::Object;
use super::scene::{Key, Scene};
use super::xml::{attributes, span_of};
use crate::error::WriteError;
use crate::polygons::{PolygonsError, Shape};

/// Limit on the text of a part with the copies of its objects, bytes.
const MAX_PART_BYTES: u64 = 1 << 30;

/// Rounding error of a deformed coordinate, as a fraction of the largest coordinate of its object in the build. Positions
/// have 24 bits, and so do the weights whose sum moves them. On a plate with 16 placements of a sphere up to 210 mm from
/// the origin, the shapes by one shift and by one stretch differed by 1.8 units of the last bit, 2^-23 of 210 mm.
const ROUNDING: f64 = 4.0 / 8_388_608.0;

/// Number of shapes of an object with which a placement is compared. A file can have 131,072 placements, so the number of
/// comparisons must not be its square.
const MAX_COMPARED: usize = 1000;

/// A shape of an object: new positions of its vertices in its own space, and identifiers of its components.
struct Variant {
    object: Key,
    id: u32,
    /// `None` if the vertex did not move.
    positions: Vec<Option<DVec3>>,
    /// Largest rounding error of a position, in the object's own space.
    rounding: f64,
    components: Vec<u32>,
}

impl Variant {
    /// Whether two shapes of an object differ by rounding only.
    fn is_like(&self, other: &Self, object: &Object) -> bool {
        let most = self.rounding + other.rounding;
        let at = |of: &Self, v: usize| of.positions[v].unwrap_or(object.vertices[v]);
        let near = |v| (at(self, v) - at(other, v)).abs().max_element() <= most;
        self.components == other.components && (0..self.positions.len()).all(near)
    }
}

/// Shapes of all objects, in order of first use.
struct Variants<'a> {
    scene: &'a Scene,
    rest: &'a [Vec3],
    shape: &'a Shape<'a>,
    /// Shapes of each object. The first one keeps the object's identifier.
    of_object: HashMap<Key, Vec<Variant>>,
    /// Largest identifier in any part. New identifiers are unique across parts, because some programs confuse objects
    /// of different parts with equal identifiers.
    last_id: u32,
    /// Index of the next vertex of the model.
    vertex: usize,
}

/// Copies the archive `bytes` with new positions. `rest`: the model's positions at rest, relative to the origin of
/// `shape`.
///
/// # Errors
/// [`WriteError::Document`] if the archive cannot be written.
pub(crate) fn patch(bytes: &[u8], rest: &[Vec3], shape: &Shape<'_>) -> Result<Vec<u8>, WriteError> {
    if *rest == *shape.positions {
        return Ok(bytes.to_vec());
    }
    let fault = |error: PolygonsError| WriteError::Document(error.to_string());
    let scene = Scene::read(bytes, u64::MAX).map_err(fault)?;
    let mut variants = Variants {
        scene: &scene,
        rest,
        shape,
        of_object: HashMap::new(),
        last_id: scene.parts.iter().map(|(_, part)| part.last_id).max().unwrap_or(0),
        vertex: 0,
    };
    let mut items = Vec::new();
    for item in &scene.parts[0].1.items {
        let id = variants.add(scene.target(0, item).map_err(fault)?, item.transform)?;
        items.push((item.id_span.clone(), id.to_string()));
    }
    let mut package = Package::open(bytes, u64::MAX).map_err(fault)?;
    let mut texts = HashMap::new();
    for (k, (name, part)) in scene.parts.iter().enumerate() {
        let Some(index) = package.archive.index(name) else { continue };
        let text = package.text(name, index).map_err(fault)?;
        let mut n_bytes = text.len() as u64;
        let mut edits = if k == 0 { std::mem::take(&mut items) } else { Vec::new() };
        for (index, object) in part.objects.iter().enumerate() {
            let shapes = variants.of_object.get(&(k, index)).map_or(&[][..], Vec::as_slice);
            let mut copies = String::new();
            n_bytes += (object.span.len() * shapes.len()) as u64;
            if n_bytes > MAX_PART_BYTES {
                let (id, n) = (object.id, shapes.len());
                return Err(WriteError::Document(format!(
                    "object {id} takes {n} shapes, whose text is longer than the limit of 1 GiB: export an OBJ"
                )));
            }
            for (copy, variant) in shapes.iter().enumerate() {
                copies += &object_text(&text, &variants, variant, copy);
                copies.push('\n');
            }
            if !copies.is_empty() {
                copies.pop();
                edits.push((object.span.clone(), copies));
            }
        }
        let new = edited(&text, 0..text.len(), edits);
        if new != text {
            texts.insert(index, new);
        }
    }
    package.archive.with_texts(&texts)
}

impl Variants<'_> {
    /// Adds the shape of an object in its next placement. Returns the identifier of this shape.
    fn add(&mut self, key: Key, transform: DAffine3) -> Result<u32, WriteError> {
        let object = self.scene.object(key);
        let mut components = Vec::with_capacity(object.components.len());
        for component in &object.components {
            let target = self.scene.target(key.0, component);
            let target = target.map_err(|error| WriteError::Document(error.to_string()))?;
            components.push(self.add(target, transform * component.transform)?);
        }
        let inverse = transform.inverse();
        let mut largest = 0.0_f64;
        let positions = (self.vertex..self.vertex + object.vertices.len()).map(|v| {
            let new = self.shape.positions[v];
            if new == self.rest[v] {
                return Ok(None);
            }
            let world = self.shape.origin + new.as_dvec3();
            let place = inverse.transform_point3(world);
            largest = largest.max(f64::from(new.abs().max_element()));
            let is_finite = place.as_vec3().is_finite();
            if is_finite { Ok(Some(place)) } else { Err(WriteError::NotFinite { vertex: v }) }
        });
        let positions = positions.collect::<Result<_, _>>()?;
        self.vertex += object.vertices.len();
        // Largest factor by which the inverse stretches an error along an axis.
        let stretch = inverse.matrix3.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        let rounding = ROUNDING * largest * stretch;
        let mut variant = Variant { object: key, id: object.id, positions, rounding, components };
        let known = self.of_object.entry(key).or_default();
        if let Some(same) = known.iter().take(MAX_COMPARED).find(|known| known.is_like(&variant, object)) {
            return Ok(same.id);
        }
        if !known.is_empty() {
            self.last_id = self.last_id.checked_add(1).ok_or_else(|| {
                WriteError::Document("no identifier is left for the copy of an object".into())
            })?;
            variant.id = self.last_id;
        }
        let id = variant.id;
        known.push(variant);
        Ok(id)
    }
}

/// Writes the text of an object in one of its shapes. `copy`: number of the shape, 0 for the original.
fn object_text(text: &str, variants: &Variants<'_>, variant: &Variant, copy: usize) -> String {
    let object = variants.scene.object(variant.object);
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    let components = object.components.iter().zip(&variant.components);
    edits.extend(components.map(|(component, id)| (component.id_span.clone(), id.to_string())));
    let number = |x: f64| {
        if variants.shape.origin == DVec3::ZERO { (x as f32).to_string() } else { x.to_string() }
    };
    let mut reader = Reader::from_str(&text[object.span.clone()]);
    let mut positions = variant.positions.iter();
    let mut is_in_mesh = false;
    // The text has been read before without an error.
    while let Ok(event) = reader.read_event() {
        let tag = match &event {
            Event::Eof => break,
            Event::Start(tag) | Event::Empty(tag) => tag,
            Event::End(tag) => {
                is_in_mesh &= tag.local_name().as_ref() != "mesh";
                continue;
            }
            _ => continue,
        };
        let name = tag.local_name();
        let name = name.as_ref();
        is_in_mesh |= name == "mesh" && matches!(event, Event::Start(_));
        let new = if name == "vertex" && is_in_mesh { positions.next().copied().flatten() } else { None };
        for (key, value) in attributes(tag) {
            let axis = ["x", "y", "z"].iter().position(|&axis| axis == key);
            let replacement = match (axis, new) {
                (Some(axis), Some(new)) => number(new[axis]),
                _ if copy > 0 && name == "object" && key == "id" => variant.id.to_string(),
                _ if copy > 0 && key.ends_with(":UUID") => other_uuid(value, copy),
                _ => continue,
            };
            edits.push((span_of(text, value), replacement));
        }
    }
    edited(text, object.span.clone(), edits)
}

/// Derives the UUID of a copy: adds `copy` to the number in the last eight digits.
fn other_uuid(uuid: &str, copy: usize) -> String {
    let end = uuid.len().saturating_sub(8);
    let digits = uuid.get(end..).and_then(|digits| u32::from_str_radix(digits, 16).ok());
    digits.map_or_else(|| uuid.to_owned(), |n| format!("{}{:08x}", &uuid[..end], n.wrapping_add(copy as u32)))
}

/// Returns the bytes `range` of a text, with replacements applied.
fn edited(text: &str, range: Range<usize>, mut edits: Vec<(Range<usize>, String)>) -> String {
    edits.sort_unstable_by_key(|(span, _)| span.start);
    let mut out = String::with_capacity(range.len() + range.len() / 8);
    let mut copied = range.start;
    for (span, new) in edits {
        out += &text[copied..span.start];
        out += &new;
        copied = span.end;
    }
    out += &text[copied..range.end];
    out
}
