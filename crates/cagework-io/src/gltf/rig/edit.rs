//! A document that is changed as little as possible: what nobody writes keeps its bytes.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasher as _, BuildHasherDefault, DefaultHasher};

use ::gltf::binary::{Glb, Header};
use serde_json::{Value, json};

use super::overlap::{Place, overlapping};
use crate::error::WriteError;
use crate::gltf::GltfDocument;
use crate::gltf::pack::{F32, VERTICES, each_accessor, push};
use crate::gltf::patch::embed_images_by;

/// All accessors are aligned to it.
const ALIGN: usize = 4;

pub(super) struct Edit<'a> {
    document: &'a GltfDocument,
    pub(super) json: Value,
    /// All buffers, one after the other.
    bin: Vec<u8>,
    /// References to each place in the buffer.
    uses: HashMap<Place, usize>,
    /// Places that are never written over.
    overlapping: HashSet<Place>,
    /// New accessors of attributes by a hash of their bytes: primitives may share their vertices.
    appended: HashMap<u64, usize>,
}

impl<'a> Edit<'a> {
    pub(super) fn new(document: &'a GltfDocument) -> Self {
        let mut json = document.json.clone();
        let (mut bin, mut starts) = (Vec::new(), Vec::new());
        for bytes in &document.buffers {
            bin.resize(bin.len().next_multiple_of(ALIGN), 0);
            starts.push(bin.len());
            bin.extend_from_slice(bytes);
        }
        for view in json["bufferViews"].as_array_mut().into_iter().flatten() {
            let start = view["buffer"].as_u64().and_then(|b| starts.get(b as usize)).copied().unwrap_or(0);
            if start > 0 {
                view["byteOffset"] = (view["byteOffset"].as_u64().unwrap_or(0) + start as u64).into();
                view["buffer"] = 0.into();
            }
        }
        let overlapping = overlapping(&json);
        let mut edit =
            Self { document, json, bin, uses: HashMap::new(), overlapping, appended: HashMap::new() };
        edit.count_uses();
        edit
    }

    /// Counts the references anew, after some were added.
    pub(super) fn count_uses(&mut self) {
        let mut named = Vec::new();
        each_accessor(&mut self.json, &mut |reference| named.extend(reference.as_u64()));
        self.uses.clear();
        for accessor in named {
            *self.uses.entry(self.place(accessor as usize)).or_default() += 1;
        }
    }

    /// Something that was copied names an accessor as well.
    pub(super) fn use_again(&mut self, accessor: usize) {
        *self.uses.entry(self.place(accessor)).or_default() += 1;
    }

    fn place(&self, accessor: usize) -> Place {
        let accessor_json = &self.json["accessors"][accessor];
        match accessor_json["bufferView"].as_u64() {
            Some(view) => (view, accessor_json["byteOffset"].as_u64().unwrap_or(0)),
            None => (u64::MAX, accessor as u64),
        }
    }

    /// Writes vectors over those of an accessor if they are plain floats that nothing else uses; otherwise, or without one,
    /// into a new accessor, which takes the place of the other. Returns its number.
    pub(super) fn write<const N: usize>(
        &mut self,
        accessor: Option<usize>,
        values: &[[f32; N]],
        attribute: bool,
        bounds: bool,
    ) -> usize {
        let over = accessor.filter(|&accessor| self.overwrite(accessor, values));
        if let Some(left) = accessor.filter(|_| over.is_none()) {
            let place = self.place(left);
            self.uses.entry(place).and_modify(|uses| *uses = uses.saturating_sub(1));
        }
        let accessor = over.unwrap_or_else(|| self.append(values, attribute));
        let of_accessor = &mut self.json["accessors"][accessor];
        if bounds || of_accessor.get("min").is_some() || of_accessor.get("max").is_some() {
            let fold = |f: fn(f32, f32) -> f32, start: f32| {
                values.iter().fold([start; N], |all, value| std::array::from_fn(|k| f(all[k], value[k])))
            };
            of_accessor["min"] = fold(f32::min, f32::INFINITY).to_vec().into();
            of_accessor["max"] = fold(f32::max, f32::NEG_INFINITY).to_vec().into();
        }
        accessor
    }

    fn overwrite<const N: usize>(&mut self, accessor: usize, values: &[[f32; N]]) -> bool {
        let of_accessor = &self.json["accessors"][accessor];
        let number = |value: &Value, key: &str| value[key].as_u64().unwrap_or(0) as usize;
        let plain = of_accessor["componentType"] == F32
            && of_accessor.get("sparse").is_none()
            && number(of_accessor, "count") == values.len()
            && self.uses.get(&self.place(accessor)) == Some(&1)
            && !self.overlapping.contains(&self.place(accessor));
        let Some(view) = of_accessor["bufferView"].as_u64().filter(|_| plain) else { return false };
        let view = &self.json["bufferViews"][view as usize];
        let start = number(view, "byteOffset") + number(of_accessor, "byteOffset");
        let stride = view["byteStride"].as_u64().map_or(4 * N, |s| s as usize);
        let end = start + stride * values.len().saturating_sub(1) + 4 * N;
        if stride < 4 * N || end > self.bin.len() {
            return false;
        }
        for (k, value) in values.iter().enumerate() {
            for (c, x) in value.iter().enumerate() {
                self.bin[start + k * stride + 4 * c..][..4].copy_from_slice(&x.to_le_bytes());
            }
        }
        true
    }

    fn append<const N: usize>(&mut self, values: &[[f32; N]], attribute: bool) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let hash = BuildHasherDefault::<DefaultHasher>::default().hash_one((&bytes, N));
        if let Some(&same) =
            self.appended.get(&hash).filter(|&&same| attribute && self.has_bytes(same, &bytes))
        {
            return same;
        }
        let view = Self::push_view(&mut self.bin, &mut self.json, bytes);
        if attribute {
            self.json["bufferViews"][view]["target"] = VERTICES.into();
        }
        let kind = match N {
            1 => "SCALAR",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        let of_accessor =
            json!({ "bufferView": view, "componentType": F32, "count": values.len(), "type": kind });
        let accessor = push(&mut self.json, "accessors", of_accessor);
        if attribute {
            self.appended.insert(hash, accessor);
        }
        accessor
    }

    /// Whether a new accessor has these bytes.
    fn has_bytes(&self, accessor: usize, bytes: &[u8]) -> bool {
        let view = self.json["accessors"][accessor]["bufferView"].as_u64().unwrap_or(0) as usize;
        let start = self.json["bufferViews"][view]["byteOffset"].as_u64().unwrap_or(0) as usize;
        self.bin.get(start..start + bytes.len()) == Some(bytes)
    }

    fn push_view(bin: &mut Vec<u8>, json: &mut Value, bytes: Vec<u8>) -> usize {
        bin.resize(bin.len().next_multiple_of(ALIGN), 0);
        let view = json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len() });
        bin.extend(bytes);
        push(json, "bufferViews", view)
    }

    /// The GLB; the file as it was read if nothing has changed.
    pub(super) fn finish(self) -> Result<Vec<u8>, WriteError> {
        let Self { document, mut json, mut bin, .. } = self;
        let is_as_read = |text: &&[u8]| serde_json::from_slice::<Value>(text).is_ok_and(|read| read == json);
        let text = match document.text.as_deref().filter(is_as_read) {
            Some(text) => text.to_vec(),
            None => {
                embed_images_by(document, &mut json, &mut |json, bytes| {
                    Self::push_view(&mut bin, json, bytes)
                });
                // What was there keeps its length: a chunk may be padded.
                let only = if let [only] = document.buffers.as_slice() { only.len() } else { 0 };
                if bin.is_empty() {
                    json.as_object_mut().map(|object| object.shift_remove("buffers"));
                } else if bin.len() != only {
                    json["buffers"] = json!([{ "byteLength": bin.len() }]);
                }
                serde_json::to_vec(&json).map_err(|e| WriteError::Document(e.to_string()))?
            }
        };
        let bytes = 64 + text.len() as u64 + bin.len() as u64;
        if bytes > u64::from(u32::MAX) {
            return Err(WriteError::TooLarge { bytes });
        }
        let header = Header { magic: *b"glTF", version: 2, length: 0 };
        let glb = Glb { header, json: text.into(), bin: (!bin.is_empty()).then(|| bin.into()) };
        glb.to_vec().map_err(|e| WriteError::Document(e.to_string()))
    }
}
