//! Edits a document in place: unmodified data keeps its bytes.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasher as _, BuildHasherDefault, DefaultHasher};

use serde_json::{Value, json};

use super::overlap::{ViewOffset, overlapping};
use crate::error::WriteError;
use crate::gltf::GltfDocument;
use crate::gltf::pack::{self, F32, Pack, VERTICES, each_accessor, push, write_glb};
use crate::gltf::patch::embed_images_by;
use crate::gltf::scene::Instance;

/// Alignment of accessors, bytes.
const ALIGN: usize = 4;

pub(super) struct Edit<'a> {
    document: &'a GltfDocument,
    pub(super) json: Value,
    /// Bytes of the document's buffers, concatenated, then those of new accessors.
    bin: Vec<u8>,
    /// Whether any accessor was written.
    has_written: bool,
    /// Number of references to each location in the buffer.
    uses: HashMap<ViewOffset, usize>,
    /// Locations that other accessors overlap; they are not overwritten.
    overlapping: HashSet<ViewOffset>,
    /// New attribute accessors by hash of their bytes, so that primitives with equal vertices share one.
    appended: HashMap<u64, usize>,
}

impl<'a> Edit<'a> {
    pub(super) fn new(document: &'a GltfDocument) -> Self {
        let mut bin = Vec::new();
        for bytes in &document.buffers {
            bin.resize(bin.len().next_multiple_of(ALIGN), 0);
            bin.extend_from_slice(bytes);
        }
        let json = joined(document);
        let overlapping = overlapping(&json);
        let (uses, appended) = (HashMap::new(), HashMap::new());
        let mut edit = Self { document, json, bin, has_written: false, uses, overlapping, appended };
        edit.count_uses();
        edit
    }

    /// Index of the instance's mesh in the edited document.
    pub(super) fn mesh_of(&self, instance: &Instance) -> usize {
        let of_node = |node: u32| self.json["nodes"][node as usize]["mesh"].as_u64();
        instance.node.and_then(of_node).map_or(instance.mesh as usize, |mesh| mesh as usize)
    }

    /// Counts the references again, after references were added.
    pub(super) fn count_uses(&mut self) {
        let mut named = Vec::new();
        each_accessor(&mut self.json, &mut |reference| named.extend(reference.as_u64()));
        self.uses.clear();
        for accessor in named {
            *self.uses.entry(self.place(accessor as usize)).or_default() += 1;
        }
    }

    /// Counts one more reference to the location of an accessor.
    pub(super) fn use_again(&mut self, accessor: usize) {
        *self.uses.entry(self.place(accessor)).or_default() += 1;
    }

    fn place(&self, accessor: usize) -> ViewOffset {
        let accessor_json = &self.json["accessors"][accessor];
        match accessor_json["bufferView"].as_u64() {
            Some(view) => (view, accessor_json["byteOffset"].as_u64().unwrap_or(0)),
            None => (u64::MAX, accessor as u64),
        }
    }

    /// Writes vectors, in place if the accessor is unshared plain f32 data, otherwise into a new accessor.
    /// Returns the accessor's index.
    pub(super) fn write<const N: usize>(
        &mut self,
        accessor: Option<usize>,
        values: &[[f32; N]],
        attribute: bool,
        bounds: bool,
    ) -> usize {
        self.has_written = true;
        let over = accessor.filter(|&accessor| self.overwrite(accessor, values));
        if let Some(left) = accessor.filter(|_| over.is_none()) {
            let place = self.place(left);
            self.uses.entry(place).and_modify(|uses| *uses = uses.saturating_sub(1));
        }
        let accessor = over.unwrap_or_else(|| self.append(values, attribute));
        let of_accessor = &mut self.json["accessors"][accessor];
        if bounds || of_accessor.get("min").is_some() || of_accessor.get("max").is_some() {
            [of_accessor["min"], of_accessor["max"]] = pack::bounds(values);
        }
        accessor
    }

    /// Whether an accessor can be overwritten with `count` f32 vectors.
    fn is_plain(&self, accessor: usize, count: usize) -> bool {
        let of_accessor = &self.json["accessors"][accessor];
        of_accessor["componentType"] == F32
            && of_accessor.get("sparse").is_none()
            && of_accessor["bufferView"].is_u64()
            && of_accessor["count"].as_u64() == Some(count as u64)
            && self.uses.get(&self.place(accessor)) == Some(&1)
            && !self.overlapping.contains(&self.place(accessor))
    }

    fn overwrite<const N: usize>(&mut self, accessor: usize, values: &[[f32; N]]) -> bool {
        let of_accessor = &self.json["accessors"][accessor];
        let number = |value: &Value, key: &str| value[key].as_u64().unwrap_or(0) as usize;
        let is_plain = self.is_plain(accessor, values.len());
        let Some(view) = of_accessor["bufferView"].as_u64().filter(|_| is_plain) else { return false };
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
        let view = Self::push_view(&mut self.bin, &mut self.json, &bytes);
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

    /// Whether the new accessor with this index has these bytes.
    fn has_bytes(&self, accessor: usize, bytes: &[u8]) -> bool {
        let view = self.json["accessors"][accessor]["bufferView"].as_u64().unwrap_or(0) as usize;
        let start = self.json["bufferViews"][view]["byteOffset"].as_u64().unwrap_or(0) as usize;
        self.bin.get(start..start + bytes.len()) == Some(bytes)
    }

    fn push_view(bin: &mut Vec<u8>, json: &mut Value, bytes: &[u8]) -> usize {
        bin.resize(bin.len().next_multiple_of(ALIGN), 0);
        let view = json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len() });
        bin.extend_from_slice(bytes);
        push(json, "bufferViews", view)
    }

    /// Returns the GLB, or the original file if nothing has changed.
    pub(super) fn finish(self) -> Result<Vec<u8>, WriteError> {
        let (document, has_written) = (self.document, self.has_written);
        if let Some(file) = document.as_read().filter(|_| !has_written && self.json == joined(document)) {
            return file;
        }
        let (json, bin) = self.into_contents();
        write(json, &bin, document.is_decoded)
    }

    /// Returns the edited document, for further edits.
    ///
    /// # Errors
    /// If its vertices or joints cannot be read.
    pub(super) fn into_document(self) -> Result<GltfDocument, WriteError> {
        let is_decoded = self.document.is_decoded;
        let (json, bin) = self.into_contents();
        Ok(GltfDocument::of_edited(json, bin, is_decoded)?)
    }

    /// The document's JSON and its only buffer, with external images embedded.
    fn into_contents(self) -> (Value, Vec<u8>) {
        let Self { document, mut json, mut bin, .. } = self;
        embed_images_by(document, &mut json, &mut |json, bytes| Self::push_view(&mut bin, json, bytes));
        // If the buffer has not changed, keep its declared length: the chunk may be longer because of padding.
        let only = if let [only] = document.buffers.as_slice() { only.len() } else { 0 };
        if bin.is_empty() {
            json.as_object_mut().map(|object| object.shift_remove("buffers"));
        } else if bin.len() != only {
            json["buffers"] = json!([{ "byteLength": bin.len() }]);
        }
        (json, bin)
    }
}

impl GltfDocument {
    /// Writes a document that was edited ([`Edit::into_document`]).
    pub(super) fn write_edited(self) -> Result<Vec<u8>, WriteError> {
        let bin = self.buffers.first().map_or(&[][..], |bin| bin.as_slice());
        write(self.json, bin, self.is_decoded)
    }
}

fn write(json: Value, bin: &[u8], is_decoded: bool) -> Result<Vec<u8>, WriteError> {
    if is_decoded {
        // Nothing refers to the compressed streams, so `Pack::finish` drops them.
        return Pack::of_bytes(&json, bin).finish(json);
    }
    write_glb(&json, bin)
}

/// The document's JSON, as if all buffers were concatenated into one.
fn joined(document: &GltfDocument) -> Value {
    let mut json = document.json.clone();
    let (mut starts, mut end) = (Vec::new(), 0);
    for bytes in &document.buffers {
        let start = usize::next_multiple_of(end, ALIGN);
        starts.push(start as u64);
        end = start + bytes.len();
    }
    let views = json.get_mut("bufferViews").and_then(Value::as_array_mut);
    for view in views.into_iter().flatten() {
        let start = view["buffer"].as_u64().and_then(|b| starts.get(b as usize)).copied().unwrap_or(0);
        if start > 0 {
            view["byteOffset"] = (view["byteOffset"].as_u64().unwrap_or(0) + start).into();
            view["buffer"] = 0.into();
        }
    }
    json
}
