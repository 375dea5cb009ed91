//! The buffer of an export: adds accessors, drops unused ones, and writes the GLB.

use std::borrow::Cow;

use glam::Vec3;
use serde_json::{Value, json};

use super::root::view_bytes;
use super::{GltfDocument, SPLATS_EXTENSION};
use crate::error::WriteError;

pub(super) const F32: u32 = 5126;
pub(super) const U32: u32 = 5125;
pub(super) const U16: u32 = 5123;
// Targets of buffer views, as glTF numbers them.
pub(super) const VERTICES: u32 = 34962;
pub(super) const INDICES: u32 = 34963;
/// Alignment of accessors and buffer views, bytes: a multiple of the sizes of all component types.
const ALIGN: usize = 4;
/// Padding; never longer than this.
const ZEROS: [u8; 2 * ALIGN] = [0; 2 * ALIGN];

/// Name of the glTF extension that stores a project.
pub const PROJECT_EXTENSION: &str = "CAGEWORK_project";

/// Extensions whose accessor references [`each_accessor`] visits. If a document uses others, unused items are
/// kept, since renumbering could break unknown references.
const KNOWN_EXTENSIONS: [&str; 12] = [
    "VRM",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_animation_pointer",
    "KHR_xmp",
    "EXT_mesh_gpu_instancing",
    SPLATS_EXTENSION,
    "FB_ngon_encoding",
    PROJECT_EXTENSION,
];

/// Consecutive parts of a file. They borrow the bytes of the model, so the size of a file is known before it is copied.
pub(crate) type Pieces<'a> = Vec<Cow<'a, [u8]>>;

/// The buffer views of a document that is being written.
pub(crate) struct Pack<'a> {
    /// `None` if the view is longer than its buffer.
    views: Vec<Option<View<'a>>>,
}

struct View<'a> {
    pieces: Pieces<'a>,
    /// Offset modulo [`ALIGN`].
    phase: usize,
}

impl View<'_> {
    fn len(&self) -> usize {
        length_of(&self.pieces)
    }
}

impl<'a> Pack<'a> {
    /// Creates a pack for a new document, which has no buffer views.
    pub(crate) fn empty() -> Self {
        Self { views: Vec::new() }
    }

    /// Creates a pack of the buffer views of a document.
    pub(crate) fn of(document: &'a GltfDocument) -> Self {
        let views = (0u64..).zip(&document.root.buffer_views).map(|(number, view)| {
            let bytes = view_bytes(&document.root, &document.buffers, number)?;
            let start = view.byte_offset.map_or(0, |o| o.0) as usize;
            Some(View { pieces: vec![bytes.into()], phase: start % ALIGN })
        });
        Self { views: views.collect() }
    }

    /// Creates a pack of the buffer views of a document whose only buffer is `bin`.
    pub(crate) fn of_bytes(json: &Value, bin: &'a [u8]) -> Self {
        let views = json["bufferViews"].as_array().into_iter().flatten().map(|view| {
            let [start, length] =
                ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap_or(0) as usize);
            let bytes = bin.get(start..start.checked_add(length)?)?;
            Some(View { pieces: vec![bytes.into()], phase: start % ALIGN })
        });
        Self { views: views.collect() }
    }

    /// Adds a buffer view with these bytes; returns its index.
    pub(crate) fn push_view(
        &mut self,
        json: &mut Value,
        bytes: impl Into<Cow<'a, [u8]>>,
        target: Option<u32>,
    ) -> usize {
        let number = self.push_pieces(json, vec![bytes.into()]);
        if let Some(target) = target {
            json["bufferViews"][number]["target"] = target.into();
        }
        number
    }

    /// Adds a buffer view with these bytes; returns its index.
    pub(crate) fn push_pieces(&mut self, json: &mut Value, pieces: Pieces<'a>) -> usize {
        let length = length_of(&pieces);
        self.views.push(Some(View { pieces, phase: 0 }));
        push(json, "bufferViews", json!({ "buffer": 0, "byteLength": length }))
    }

    /// Adds an f32 accessor with `components` numbers per element; `bounds` adds min and max.
    pub(crate) fn push_floats(
        &mut self,
        json: &mut Value,
        values: &[f32],
        components: usize,
        attribute: bool,
        bounds: bool,
    ) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.push_view(json, bytes, attribute.then_some(VERTICES));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"].get(components - 1).unwrap_or(&"MAT4");
        let count = values.len() / components;
        let mut accessor = json!({ "bufferView": view, "componentType": F32, "count": count, "type": kind });
        if bounds {
            let fold = |f: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
                let column = |c: usize| values.iter().skip(c).step_by(components).copied();
                (0..components).map(|c| column(c).fold(start, f)).collect()
            };
            accessor["min"] = json!(fold(f32::min, f32::INFINITY));
            accessor["max"] = json!(fold(f32::max, f32::NEG_INFINITY));
        }
        push(json, "accessors", accessor)
    }

    /// Adds an accessor of f32 vectors as a vertex attribute; `bounds` adds min and max.
    pub(crate) fn push_vec3(&mut self, json: &mut Value, values: &[Vec3], bounds: bool) -> usize {
        let flat: Vec<f32> = values.iter().flat_map(Vec3::to_array).collect();
        self.push_floats(json, &flat, 3, true, bounds)
    }

    /// Adds an accessor for the vertex indices of line segments; returns its index.
    pub(crate) fn push_lines(&mut self, json: &mut Value, lines: &[[u32; 2]]) -> usize {
        self.push_indices(json, lines.iter().flatten().copied())
    }

    /// Adds an index accessor, 16-bit if possible. 0xffff is reserved for primitive restart.
    pub(crate) fn push_indices(
        &mut self,
        json: &mut Value,
        indices: impl Iterator<Item = u32> + Clone,
    ) -> usize {
        let short = indices.clone().all(|i| i < u32::from(u16::MAX));
        let bytes: Vec<u8> = if short {
            indices.flat_map(|i| (i as u16).to_le_bytes()).collect()
        } else {
            indices.flat_map(u32::to_le_bytes).collect()
        };
        let count = bytes.len() / if short { 2 } else { 4 };
        let view = self.push_view(json, bytes, Some(INDICES));
        let kind = if short { U16 } else { U32 };
        push(
            json,
            "accessors",
            json!({ "bufferView": view, "componentType": kind, "count": count, "type": "SCALAR" }),
        )
    }

    /// Drops unused accessors and buffer views, lays out the buffer and writes the GLB.
    pub(crate) fn finish(self, json: Value) -> Result<Vec<u8>, WriteError> {
        Ok(self.into_pieces(json)?.concat())
    }

    /// As [`Self::finish`], without a copy of the buffer views.
    pub(crate) fn into_pieces(mut self, mut json: Value) -> Result<Pieces<'a>, WriteError> {
        if only_known_extensions(&json) {
            drop_unused(&mut json, "accessors", each_accessor);
            let kept = drop_unused(&mut json, "bufferViews", each_view);
            let mut kept = kept.into_iter();
            self.views.retain(|_| kept.next().unwrap_or(true));
        }
        let (starts, length) = self.lay_out(&mut json)?;
        match &mut json {
            Value::Object(object) if length == 0 => drop(object.shift_remove("buffers")),
            json => json["buffers"] = json!([{ "byteLength": length }]),
        }
        for key in ["accessors", "bufferViews"] {
            if json[key].as_array().is_none_or(Vec::is_empty)
                && let Value::Object(object) = &mut json
            {
                object.shift_remove(key);
            }
        }
        let mut pieces = start_of_glb(text_of(&json)?.into(), length)?;
        let mut end = 0;
        for (view, start) in self.views.into_iter().flatten().zip(starts) {
            pieces.push(ZEROS[..start - end].into());
            end = start + view.len();
            pieces.extend(view.pieces);
        }
        pieces.push(ZEROS[..length - end].into());
        Ok(pieces)
    }

    /// Sets the offsets of all buffer views, and returns them with the length of the buffer.
    fn lay_out(&self, json: &mut Value) -> Result<(Vec<usize>, usize), WriteError> {
        let bytes: u64 = self.views.iter().flatten().map(|view| (view.len() + 2 * ALIGN) as u64).sum();
        if bytes > u64::from(u32::MAX) {
            return Err(WriteError::TooLarge { bytes });
        }
        let (mut starts, mut end) = (Vec::with_capacity(self.views.len()), 0_usize);
        for (number, view) in self.views.iter().enumerate() {
            let Some(view) = view else {
                return Err(WriteError::Document(format!("buffer view {number} is longer than its buffer")));
            };
            // Alignment is relative to the buffer: keep the offset of the original view modulo 4.
            let start = end.next_multiple_of(ALIGN) + view.phase;
            json["bufferViews"][number]["buffer"] = 0.into();
            json["bufferViews"][number]["byteOffset"] = start.into();
            starts.push(start);
            end = start + view.len();
        }
        Ok((starts, end.next_multiple_of(ALIGN)))
    }
}

/// Minimum and maximum of the vectors' components.
pub(super) fn bounds<const N: usize>(values: &[[f32; N]]) -> [Value; 2] {
    let fold = |f: fn(f32, f32) -> f32, start: f32| {
        values.iter().fold([start; N], |all, value| std::array::from_fn(|k| f(all[k], value[k])))
    };
    [fold(f32::min, f32::INFINITY), fold(f32::max, f32::NEG_INFINITY)].map(|all| all.to_vec().into())
}

/// Writes a GLB of a document whose only buffer is `bin`.
pub(super) fn write_glb(json: &Value, bin: &[u8]) -> Result<Vec<u8>, WriteError> {
    join_chunks(text_of(json)?.into(), bin)
}

fn text_of(json: &Value) -> Result<Vec<u8>, WriteError> {
    serde_json::to_vec(json).map_err(|e| WriteError::Document(e.to_string()))
}

fn join_chunks(text: Cow<'_, [u8]>, bin: &[u8]) -> Result<Vec<u8>, WriteError> {
    let mut pieces = start_of_glb(text, bin.len())?;
    let padding = bin.len().next_multiple_of(ALIGN) - bin.len();
    pieces.extend([bin.into(), ZEROS[..padding].into()]);
    Ok(pieces.concat())
}

/// A GLB (glTF 2.0, section 4.4) up to the first byte of its binary chunk, which will have `length` bytes and, after
/// them, zeros up to a multiple of [`ALIGN`].
fn start_of_glb(text: Cow<'_, [u8]>, length: usize) -> Result<Pieces<'_>, WriteError> {
    let [json, bin] = [text.len(), length].map(|length| (length as u64).next_multiple_of(ALIGN as u64));
    let bytes = 20 + json + if bin > 0 { 8 + bin } else { 0 };
    if bytes > u64::from(u32::MAX) {
        return Err(WriteError::TooLarge { bytes });
    }
    let word = |number: u64| (number as u32).to_le_bytes();
    let header = [&b"glTF"[..], &word(2), &word(bytes), &word(json), b"JSON"].concat();
    let mut after = vec![b' '; json as usize - text.len()];
    if bin > 0 {
        after.extend(word(bin));
        after.extend(b"BIN\0");
    }
    Ok(vec![header.into(), text, after.into()])
}

pub(crate) fn length_of(pieces: &Pieces<'_>) -> usize {
    pieces.iter().map(|piece| piece.len()).sum()
}

impl GltfDocument {
    /// The original file, byte for byte; `None` unless it was a self-contained GLB.
    pub(super) fn as_read(&self) -> Option<Result<Vec<u8>, WriteError>> {
        if let Some(packed) = &self.packed {
            return Some(Ok(packed.clone()));
        }
        let bin = self.buffers.first()?;
        Some(join_chunks(self.text.as_deref()?.into(), bin))
    }
}

/// Appends an item to a list of the document; returns its index.
pub(crate) fn push(json: &mut Value, list: &str, item: Value) -> usize {
    if !json[list].is_array() {
        json[list] = json!([]);
    }
    let list = json[list].as_array_mut().expect("an array was stored above");
    list.push(item);
    list.len() - 1
}

fn only_known_extensions(json: &Value) -> bool {
    json["extensionsUsed"]
        .as_array()
        .into_iter()
        .flatten()
        .all(|e| e.as_str().is_some_and(|e| KNOWN_EXTENSIONS.iter().any(|known| e.starts_with(known))))
}

pub(super) type Visit<'v> = &'v mut dyn FnMut(&mut Value);

/// Removes items of `list` to which nothing refers, and renumbers the references. Returns whether each item was kept.
fn drop_unused(json: &mut Value, list: &str, each: fn(&mut Value, Visit<'_>)) -> Vec<bool> {
    let n = json[list].as_array().map_or(0, Vec::len);
    let mut used = vec![false; n];
    each(json, &mut |reference| {
        if let Some(used) = reference.as_u64().and_then(|i| used.get_mut(i as usize)) {
            *used = true;
        }
    });
    let mut next = 0;
    let renumbered: Vec<usize> = used
        .iter()
        .map(|&used| {
            next += usize::from(used);
            next.saturating_sub(1)
        })
        .collect();
    each(json, &mut |reference| {
        if let Some(&new) = reference.as_u64().and_then(|i| renumbered.get(i as usize)) {
            *reference = new.into();
        }
    });
    if let Some(items) = json[list].as_array_mut() {
        let mut used = used.iter();
        items.retain(|_| used.next().copied().unwrap_or(true));
    }
    used
}

/// Calls `visit` with each reference to an accessor.
pub(super) fn each_accessor(json: &mut Value, visit: Visit<'_>) {
    fn items<'v>(value: &'v mut Value, key: &str) -> impl Iterator<Item = &'v mut Value> {
        value.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten()
    }
    fn members(value: Option<&mut Value>, visit: Visit<'_>) {
        value.and_then(Value::as_object_mut).into_iter().flat_map(|o| o.values_mut()).for_each(visit);
    }
    for mesh in items(json, "meshes") {
        for primitive in items(mesh, "primitives") {
            members(primitive.get_mut("attributes"), visit);
            items(primitive, "targets").for_each(|target| members(Some(target), visit));
            primitive.get_mut("indices").into_iter().for_each(&mut *visit);
        }
    }
    for node in items(json, "nodes") {
        members(node.pointer_mut("/extensions/EXT_mesh_gpu_instancing/attributes"), visit);
    }
    for animation in items(json, "animations") {
        for sampler in items(animation, "samplers") {
            sampler.get_mut("input").into_iter().for_each(&mut *visit);
            sampler.get_mut("output").into_iter().for_each(&mut *visit);
        }
    }
    for skin in items(json, "skins") {
        skin.get_mut("inverseBindMatrices").into_iter().for_each(&mut *visit);
    }
}

/// Calls `visit` with each reference to a buffer view: members named `bufferView` outside `extras`.
pub(super) fn each_view(json: &mut Value, visit: Visit<'_>) {
    match json {
        Value::Object(object) => {
            for (key, value) in object {
                match key.as_str() {
                    "bufferView" => visit(value),
                    "extras" => {}
                    _ => each_view(value, visit),
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| each_view(item, visit)),
        _ => {}
    }
}
