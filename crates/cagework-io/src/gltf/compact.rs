//! Makes a GLB smaller: normals, texture coordinates and skin weights as integers, and meshopt streams.
//!
//! Positions stay floats: integers would need a scale, which nodes, inverse bind matrices and morph targets would have
//! to contain. If quantisation and meshopt are combined, positions are rounded to [`POSITION_BITS`] bits, which
//! compresses well.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ::gltf::binary::Glb;
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    ExpMode, IndexEncoding, VertexEncoding, encode_filter_exp, encode_index_buffer, encode_index_sequence,
    encode_vertex_buffer,
};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::accessor::Source;
use super::pack::{F32, INDICES, Pack, U16, U32, VERTICES, each_view, push, write_glb};
use super::root::{DRACO, MESHOPT, typed};
use crate::error::WriteError;

cagework_core::choice! {
    /// Compression of a GLB.
    Compression {
        /// No compression: plain buffers.
        #[default]
        None = "none",
        /// EXT_meshopt_compression.
        Meshopt = "meshopt",
    }
}

/// Options of [`compact`]. By default, it returns the GLB unchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct CompactOptions {
    /// Whether attributes other than positions are stored as integers (KHR_mesh_quantization).
    pub quantize: bool,
    /// Compression of the buffers.
    pub compress: Compression,
}

/// Bits of the largest coordinate of a position, its sign included. All coordinates of a position share an exponent. If
/// the largest one is between 1 and 2 m, rounding moves each of them by at most 2^-15 m, 0.03 mm.
const POSITION_BITS: u32 = 16;

const QUANTIZATION: &str = "KHR_mesh_quantization";
const I8: u32 = 5120;
const U8: u32 = 5121;
const ALIGN: usize = 4;

/// How a document uses an accessor.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Use {
    /// Vertex attribute: its name, and whether it belongs to a morph target.
    Vertex(String, bool),
    /// Indices, and whether they form a list of triangles.
    Index(bool),
    /// Keys of clips, and inverse bind matrices.
    Other,
    /// References of different kinds, and whether any of them is a vertex attribute.
    Several(bool),
}

/// Elements of an accessor in a buffer view of their own.
struct Elements {
    bytes: Vec<u8>,
    component: u32,
    normalized: bool,
    /// Distance between two elements in `bytes`, bytes.
    stride: usize,
}

/// Makes a GLB smaller. A GLB whose geometry is compressed already is returned unchanged, as is one that would not become
/// smaller: the descriptions of streams take space, too.
///
/// # Errors
/// [`WriteError`] if the GLB cannot be parsed.
pub fn compact(glb: Vec<u8>, options: CompactOptions) -> Result<Vec<u8>, WriteError> {
    if options == CompactOptions::default() {
        return Ok(glb);
    }
    let (mut json, bin) = parts(&glb)?;
    let is_packed = |name: &Value| name == DRACO || MESHOPT.iter().any(|meshopt| name == meshopt);
    if json["extensionsUsed"].as_array().is_some_and(|names| names.iter().any(is_packed)) {
        return Ok(glb);
    }
    let mut small = split(&mut json, &bin, options.quantize)?;
    if options.compress == Compression::Meshopt {
        let (mut json, bin) = parts(&small)?;
        let bin = compress(&mut json, &bin, options.quantize);
        small = write_glb(&json, &bin)?;
    }
    Ok(if small.len() < glb.len() { small } else { glb })
}

fn damaged(problem: impl std::fmt::Display) -> WriteError {
    WriteError::Document(problem.to_string())
}

/// JSON and binary chunk of a GLB.
fn parts(glb: &[u8]) -> Result<(Value, Vec<u8>), WriteError> {
    let glb = Glb::from_slice(glb).map_err(damaged)?;
    let json = serde_json::from_slice(&glb.json).map_err(damaged)?;
    Ok((json, glb.bin.map_or_else(Vec::new, std::borrow::Cow::into_owned)))
}

impl Use {
    /// Whether vertices use the accessor, so that its elements must be aligned to 4 bytes.
    fn is_vertex(&self) -> bool {
        matches!(self, Self::Vertex(..) | Self::Several(true))
    }
}

/// The use of each accessor.
fn uses(json: &Value) -> BTreeMap<usize, Use> {
    let mut all: BTreeMap<usize, Use> = BTreeMap::new();
    let mut add = |accessor: &Value, of: Use| {
        let Some(accessor) = accessor.as_u64() else { return };
        all.entry(accessor as usize)
            .and_modify(|known| {
                if *known != of {
                    *known = Use::Several(known.is_vertex() || of.is_vertex());
                }
            })
            .or_insert(of);
    };
    let list = |of: &Value, key: &str| of[key].as_array().cloned().unwrap_or_default();
    for primitive in list(json, "meshes").iter().flat_map(|mesh| list(mesh, "primitives")) {
        let targets = list(&primitive, "targets");
        let groups =
            std::iter::once((&primitive["attributes"], false)).chain(targets.iter().map(|t| (t, true)));
        for (attributes, is_target) in groups {
            for (name, accessor) in attributes.as_object().into_iter().flatten() {
                add(accessor, Use::Vertex(name.clone(), is_target));
            }
        }
        add(&primitive["indices"], Use::Index(primitive["mode"].as_u64().unwrap_or(4) == 4));
    }
    for sampler in list(json, "animations").iter().flat_map(|animation| list(animation, "samplers")) {
        add(&sampler["input"], Use::Other);
        add(&sampler["output"], Use::Other);
    }
    list(json, "skins").iter().for_each(|skin| add(&skin["inverseBindMatrices"], Use::Other));
    all
}

fn number(of: &Value, key: &str) -> usize {
    of[key].as_u64().unwrap_or(0) as usize
}

fn component_size(component: u32) -> usize {
    match component {
        I8 | U8 => 1,
        5122 | U16 => 2,
        _ => 4,
    }
}

fn width(accessor: &Value) -> usize {
    match accessor["type"].as_str() {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("MAT4") => 16,
        _ => 4,
    }
}

/// Gives each accessor a buffer view of its own, with quantised elements where possible. Sparse accessors and matrices
/// of 2 or 3 rows stay as they are.
fn split(json: &mut Value, bin: &[u8], quantize: bool) -> Result<Vec<u8>, WriteError> {
    let root = typed(json)?;
    let buffers = [Arc::new(bin.to_vec())];
    let source = Source { root: &root, buffers: &buffers };
    let before = json.clone();
    let mut pack = Pack::of_bytes(&before, bin);
    // A view that one accessor alone refers to gets new bytes. Old views of others stay if the document has an unknown
    // extension, which may refer to them.
    let mut n_references = vec![0_usize; before["bufferViews"].as_array().map_or(0, Vec::len)];
    each_view(json, &mut |view| {
        if let Some(n) = view.as_u64().and_then(|view| n_references.get_mut(view as usize)) {
            *n += 1;
        }
    });
    let mut needs_extension = false;
    let uses = uses(&before);
    let has_more_weights = uses.values().any(|of| matches!(of, Use::Vertex(name, _) if name == "WEIGHTS_1"));
    for (accessor, of) in uses {
        let of_json = &before["accessors"][accessor];
        if of_json.get("sparse").is_some() || matches!(of_json["type"].as_str(), Some("MAT2" | "MAT3")) {
            continue;
        }
        let quantized = match &of {
            Use::Vertex(name, is_target) if quantize => {
                quantized(source, accessor as u32, of_json, (name, *is_target), has_more_weights)
            }
            _ => None,
        };
        needs_extension |= quantized.as_ref().is_some_and(|elements| elements.component == I8);
        let is_vertex = of.is_vertex();
        let is_quantized = quantized.is_some();
        let Some(elements) = quantized.or_else(|| raw(&before, bin, of_json, is_vertex)) else { continue };
        let Elements { bytes, component, normalized, stride } = elements;
        let element = component_size(component) * width(of_json);
        let target = match of {
            _ if is_vertex => Some(VERTICES),
            Use::Index(_) => Some(INDICES),
            _ => None,
        };
        let own = of_json["bufferView"].as_u64().map(|view| view as usize);
        let view = match own.filter(|&view| n_references.get(view) == Some(&1)) {
            Some(view) => {
                pack.replace_view(json, view, bytes, target);
                view
            }
            None => pack.push_view(json, bytes, target),
        };
        if is_vertex && stride != element {
            json["bufferViews"][view]["byteStride"] = stride.into();
        }
        let Some(of_json) = json["accessors"][accessor].as_object_mut() else { continue };
        of_json.shift_remove("byteOffset");
        of_json.insert("bufferView".into(), view.into());
        of_json.insert("componentType".into(), component.into());
        if is_quantized {
            ["min", "max", "normalized"].iter().for_each(|key| drop(of_json.shift_remove(*key)));
            if normalized {
                of_json.insert("normalized".into(), true.into());
            }
        }
    }
    if needs_extension {
        require(json, QUANTIZATION);
    }
    pack.finish(std::mem::take(json))
}

/// Adds an extension to the lists of used and of required extensions, unless they have it.
fn require(json: &mut Value, extension: &str) {
    for list in ["extensionsUsed", "extensionsRequired"] {
        if !json[list].as_array().is_some_and(|names| names.iter().any(|name| name == extension)) {
            push(json, list, extension.into());
        }
    }
}

/// The elements of an accessor without conversion, tightly packed; those of vertices are padded to multiples of 4
/// bytes. `None` if they are in no buffer view, or extend beyond it.
fn raw(json: &Value, bin: &[u8], accessor: &Value, is_vertex: bool) -> Option<Elements> {
    let component = number(accessor, "componentType") as u32;
    let element = component_size(component) * width(accessor);
    let view = json["bufferViews"].get(accessor["bufferView"].as_u64()? as usize)?;
    let start = number(view, "byteOffset").checked_add(number(accessor, "byteOffset"))?;
    let old = Some(number(view, "byteStride")).filter(|&stride| stride > 0).unwrap_or(element);
    let stride = if is_vertex { element.next_multiple_of(ALIGN) } else { element };
    let mut bytes = Vec::new();
    for k in 0..number(accessor, "count") {
        let at = start.checked_add(k.checked_mul(old)?)?;
        bytes.extend_from_slice(bin.get(at..at.checked_add(element)?)?);
        bytes.resize((k + 1) * stride, 0);
    }
    Some(Elements { bytes, component, normalized: false, stride })
}

/// Quantised elements of a vertex attribute; `None` if the attribute is not quantised.
fn quantized(
    source: Source<'_>,
    accessor: u32,
    of_json: &Value,
    (name, is_target): (&str, bool),
    has_more_weights: bool,
) -> Option<Elements> {
    if name.starts_with("JOINTS_") && of_json["componentType"] == U16 {
        let joints = source.unsigned::<4>(accessor, name).ok()?;
        let bytes =
            joints.as_flattened().iter().map(|&joint| u8::try_from(joint).ok()).collect::<Option<_>>()?;
        return Some(Elements { bytes, component: U8, normalized: false, stride: 4 });
    }
    if of_json["componentType"] != F32 {
        return None;
    }
    let kind = if is_target && name != "NORMAL" && name != "TANGENT" { "" } else { name };
    match (kind, width(of_json)) {
        ("NORMAL" | "TANGENT", 3) => signed(&source.floats::<3>(accessor, name).ok()?),
        ("TANGENT", 4) => signed(&source.floats::<4>(accessor, name).ok()?),
        ("WEIGHTS_0", 4) if !has_more_weights => weights(&source.floats::<4>(accessor, name).ok()?),
        (name, 2) if name.starts_with("TEXCOORD_") => unsigned(&source.floats::<2>(accessor, name).ok()?),
        (name, 3) if name.starts_with("COLOR_") => unsigned(&source.floats::<3>(accessor, name).ok()?),
        (name, 4) if name.starts_with("COLOR_") => unsigned(&source.floats::<4>(accessor, name).ok()?),
        _ => None,
    }
}

/// Numbers from -1 to 1 as signed bytes; `None` if a number is outside this range.
fn signed<const N: usize>(values: &[[f32; N]]) -> Option<Elements> {
    let mut bytes = Vec::with_capacity(4 * values.len());
    for value in values {
        for x in value {
            bytes.push(((-1.0..=1.0).contains(x).then(|| (x * 127.0).round() as i8)?).cast_unsigned());
        }
        bytes.resize(bytes.len().next_multiple_of(ALIGN), 0);
    }
    Some(Elements { bytes, component: I8, normalized: true, stride: N.next_multiple_of(ALIGN) })
}

/// Numbers from 0 to 1 as unsigned 16-bit integers; `None` if a number is outside this range.
fn unsigned<const N: usize>(values: &[[f32; N]]) -> Option<Elements> {
    let mut bytes = Vec::with_capacity(2 * N.next_multiple_of(2) * values.len());
    for value in values {
        for x in value {
            let x = (0.0..=1.0).contains(x).then(|| (x * f32::from(u16::MAX)).round() as u16)?;
            bytes.extend(x.to_le_bytes());
        }
        bytes.resize(bytes.len().next_multiple_of(ALIGN), 0);
    }
    Some(Elements { bytes, component: U16, normalized: true, stride: (2 * N).next_multiple_of(ALIGN) })
}

/// Joint weights as 16-bit integers. The largest weight of a vertex absorbs the rounding errors of the others, so that
/// the sum changes by at most half a unit.
fn weights(values: &[[f32; 4]]) -> Option<Elements> {
    let unit = f64::from(u16::MAX);
    let mut bytes = Vec::with_capacity(8 * values.len());
    for value in values {
        if !value.iter().all(|x| (0.0..=1.0).contains(x)) {
            return None;
        }
        let sum = (value.iter().map(|&x| f64::from(x)).sum::<f64>() * unit).round() as i64;
        let mut rounded = value.map(|x| (f64::from(x) * unit).round() as i64);
        let largest = (0..4).max_by_key(|&k| rounded[k])?;
        rounded[largest] += sum - rounded.iter().sum::<i64>();
        for x in rounded {
            bytes.extend(u16::try_from(x).ok()?.to_le_bytes());
        }
    }
    Some(Elements { bytes, component: U16, normalized: true, stride: 8 })
}

/// A meshopt stream of the elements of an accessor.
struct Stream {
    bytes: Vec<u8>,
    mode: &'static str,
    filter: Option<&'static str>,
    stride: usize,
}

/// Replaces each buffer view by a meshopt stream if the stream is shorter. Returns the new buffer.
fn compress(json: &mut Value, bin: &[u8], quantize: bool) -> Vec<u8> {
    let mut of_views: BTreeMap<usize, (usize, Use)> = BTreeMap::new();
    for (accessor, of) in uses(json) {
        if let Some(view) = json["accessors"][accessor]["bufferView"].as_u64() {
            of_views.insert(view as usize, (accessor, of));
        }
    }
    // Views of sparse accessors are not compressed, nor are views without an accessor, such as images.
    let others: BTreeSet<usize> = json["accessors"]
        .as_array()
        .into_iter()
        .flatten()
        .filter(|accessor| accessor.get("sparse").is_some())
        .filter_map(|accessor| Some(accessor["bufferView"].as_u64()? as usize))
        .collect();
    let (mut out, mut fallback) = (Vec::new(), 0);
    for number_of_view in 0..json["bufferViews"].as_array().map_or(0, Vec::len) {
        let view = &json["bufferViews"][number_of_view];
        let (start, length) = (number(view, "byteOffset"), number(view, "byteLength"));
        let bytes = bin.get(start..start.saturating_add(length)).unwrap_or_default();
        let of = of_views.get(&number_of_view).filter(|_| !others.contains(&number_of_view));
        let stream = of.and_then(|(accessor, of)| {
            let accessor = &json["accessors"][*accessor];
            let stream = stream(accessor, of, view, bytes, quantize)?;
            (stream.bytes.len() < bytes.len()).then(|| (stream, number(accessor, "count")))
        });
        out.resize(out.len().next_multiple_of(ALIGN) + if stream.is_some() { 0 } else { start % ALIGN }, 0);
        let at = out.len();
        let view = &mut json["bufferViews"][number_of_view];
        match stream {
            None => {
                view["byteOffset"] = at.into();
                out.extend_from_slice(bytes);
            }
            Some((Stream { bytes, mode, filter, stride }, count)) => {
                let mut extension = json!({
                    "buffer": 0, "byteOffset": at, "byteLength": bytes.len(), "byteStride": stride, "count": count,
                    "mode": mode,
                });
                if let Some(filter) = filter {
                    extension["filter"] = filter.into();
                }
                (view["buffer"], view["byteOffset"]) = (1.into(), fallback.into());
                view["extensions"] = json!({ MESHOPT[0]: extension });
                fallback = (fallback + length).next_multiple_of(ALIGN);
                out.extend(bytes);
            }
        }
    }
    out.resize(out.len().next_multiple_of(ALIGN), 0);
    json["buffers"] = json!([{ "byteLength": out.len() }]);
    if fallback > 0 {
        let of_fallback =
            json!({ "byteLength": fallback, "extensions": { MESHOPT[0]: { "fallback": true } } });
        push(json, "buffers", of_fallback);
        require(json, MESHOPT[0]);
    }
    out
}

/// Encodes the elements of an accessor that has a buffer view of its own; `None` if meshopt cannot encode them.
fn stream(accessor: &Value, of: &Use, view: &Value, bytes: &[u8], quantize: bool) -> Option<Stream> {
    let workspace = &mut Workspace::default();
    let (component, count) = (number(accessor, "componentType") as u32, number(accessor, "count"));
    if let Use::Index(is_triangles) = of {
        let indices: Vec<u32> = match component {
            U16 => bytes.as_chunks().0.iter().map(|&b| u16::from_le_bytes(b).into()).collect(),
            U32 => bytes.as_chunks().0.iter().map(|&b| u32::from_le_bytes(b)).collect(),
            _ => return None,
        };
        let is_triangles = *is_triangles && count.is_multiple_of(3);
        let encoding = IndexEncoding::DEFAULT;
        let (mode, bytes) = if is_triangles {
            ("TRIANGLES", encode_index_buffer(&indices, encoding, workspace).ok()?)
        } else {
            ("INDICES", encode_index_sequence(&indices, encoding, workspace).ok()?)
        };
        return Some(Stream { bytes, mode, filter: None, stride: component_size(component) });
    }
    let element = component_size(component) * width(accessor);
    let stride = Some(number(view, "byteStride")).filter(|&stride| stride > 0).unwrap_or(element);
    // EXT_meshopt_compression uses version 0 of the vertex encoding.
    let encoding = VertexEncoding::new(0, 2).ok()?;
    let is_position = matches!(of, Use::Vertex(name, _) if name == "POSITION");
    if quantize && is_position && component == F32 {
        let values: Vec<f32> = bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
        let mode = ExpMode::SharedVector;
        if let Ok(rounded) = encode_filter_exp(count, stride, POSITION_BITS, &values, mode, workspace) {
            let bytes = encode_vertex_buffer(&rounded, count, stride, encoding, workspace).ok()?;
            return Some(Stream { bytes, mode: "ATTRIBUTES", filter: Some("EXPONENTIAL"), stride });
        }
    }
    let bytes = encode_vertex_buffer(bytes, count, stride, encoding, workspace).ok()?;
    Some(Stream { bytes, mode: "ATTRIBUTES", filter: None, stride })
}
