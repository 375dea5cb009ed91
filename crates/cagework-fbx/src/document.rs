//! A glTF document that is being written, and its buffer.

use std::borrow::Cow;

use gltf::binary::{Glb, Header};
use serde_json::{Value, json};

use crate::limits::FbxError;

/// Targets of buffer views, as glTF numbers them.
pub(crate) const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
const F32: u32 = 5126;
const U32: u32 = 5125;
const U16: u32 = 5123;

/// Limit on the items of a list, such as accessors. An item takes up to 1 kB while it is written.
const MAX_ITEMS: usize = 1 << 18;

/// Types of accessors.
const KINDS: [&str; 4] = ["SCALAR", "VEC2", "VEC3", "VEC4"];

pub(crate) struct Document {
    json: Value,
    bin: Vec<u8>,
    /// Limit on the size of `bin`, bytes.
    room: u64,
    /// The memory limit, for messages, bytes.
    limit: u64,
}

impl Document {
    /// `room`: limit on the size of the buffer; `limit`: the memory limit, for messages; bytes.
    pub(crate) fn new(room: u64, limit: u64) -> Self {
        let json = json!({ "asset": { "version": "2.0", "generator": "Cagework" }, "scene": 0 });
        // A GLB stores its size in 32 bits.
        Self { json, bin: Vec::new(), room: room.min(u64::from(u32::MAX) / 2), limit }
    }

    /// Checks that the buffer has room for `count` elements of `each` bytes.
    pub(crate) fn reserve(&self, count: usize, each: usize) -> Result<(), FbxError> {
        let bytes = (count as u64).saturating_mul(each as u64).saturating_add(self.bin.len() as u64);
        if bytes > self.room { Err(FbxError::Memory { limit: self.limit }) } else { Ok(()) }
    }

    /// Appends an item to a list; returns its index.
    pub(crate) fn push(&mut self, list: &'static str, item: Value) -> Result<usize, FbxError> {
        if !self.json[list].is_array() {
            self.json[list] = json!([]);
        }
        let list_items = self.json[list].as_array_mut().expect("an array was stored above");
        if list_items.len() >= MAX_ITEMS {
            return Err(FbxError::TooMany { what: list, limit: MAX_ITEMS });
        }
        list_items.push(item);
        Ok(list_items.len() - 1)
    }

    /// Adds a buffer view with these bytes.
    pub(crate) fn view(&mut self, bytes: &[u8], target: Option<u32>) -> Result<usize, FbxError> {
        self.reserve(bytes.len() + 4, 1)?;
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// Adds an accessor of `N` f32 per element. `bounds` adds minimum and maximum.
    pub(crate) fn floats<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        target: Option<u32>,
        bounds: bool,
    ) -> Result<usize, FbxError> {
        self.reserve(values.len(), 4 * N)?;
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes, target)?;
        let kind = KINDS.get(N - 1).unwrap_or(&"MAT4");
        let mut accessor =
            json!({ "bufferView": view, "componentType": F32, "count": values.len(), "type": kind });
        if bounds {
            [accessor["min"], accessor["max"]] = bounds_of(&values.iter());
        }
        self.push("accessors", accessor)
    }

    /// Adds an accessor of vectors that are zero except at `indices`, which must increase.
    pub(crate) fn sparse(
        &mut self,
        count: usize,
        indices: &[u32],
        values: &[[f32; 3]],
    ) -> Result<usize, FbxError> {
        let is_zero_elsewhere = indices.len() < count;
        let [least, most] = bounds_of(&values.iter().chain(is_zero_elsewhere.then_some(&[0.0; 3])));
        let mut accessor =
            json!({ "componentType": F32, "count": count, "type": "VEC3", "min": least, "max": most });
        if !indices.is_empty() {
            self.reserve(values.len(), 16)?;
            let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
            let at = self.view(&bytes, None)?;
            let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
            let what = self.view(&bytes, None)?;
            accessor["sparse"] = json!({
                "count": indices.len(),
                "indices": { "bufferView": at, "componentType": U32 },
                "values": { "bufferView": what },
            });
        }
        self.push("accessors", accessor)
    }

    /// Adds the indices of triangles.
    pub(crate) fn indices(&mut self, indices: &[u32]) -> Result<usize, FbxError> {
        self.reserve(indices.len(), 4)?;
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(INDICES))?;
        let accessor =
            json!({ "bufferView": view, "componentType": U32, "count": indices.len(), "type": "SCALAR" });
        self.push("accessors", accessor)
    }

    /// Adds an accessor of four joints per vertex.
    pub(crate) fn joints(&mut self, joints: &[[u16; 4]]) -> Result<usize, FbxError> {
        self.reserve(joints.len(), 8)?;
        let bytes: Vec<u8> = joints.as_flattened().iter().flat_map(|j| j.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(VERTICES))?;
        let accessor =
            json!({ "bufferView": view, "componentType": U16, "count": joints.len(), "type": "VEC4" });
        self.push("accessors", accessor)
    }

    /// Writes the GLB.
    pub(crate) fn finish(mut self) -> Result<Vec<u8>, FbxError> {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        if !self.bin.is_empty() {
            self.json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        let fault = |e: String| FbxError::Damaged(e);
        let json = serde_json::to_vec(&self.json).map_err(|e| fault(e.to_string()))?;
        let header = Header { magic: *b"glTF", version: 2, length: 0 };
        let bin = (!self.bin.is_empty()).then_some(Cow::Owned(self.bin));
        Glb { header, json: json.into(), bin }.to_vec().map_err(|e| fault(e.to_string()))
    }
}

/// Minimum and maximum of each component.
fn bounds_of<'a, const N: usize>(values: &(impl Iterator<Item = &'a [f32; N]> + Clone)) -> [Value; 2] {
    let fold = |f: fn(f32, f32) -> f32, start: f32| {
        values.clone().fold([start; N], |all, value| std::array::from_fn(|k| f(all[k], value[k])))
    };
    [fold(f32::min, f32::INFINITY), fold(f32::max, f32::NEG_INFINITY)].map(|all| all.to_vec().into())
}
