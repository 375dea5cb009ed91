//! From bytes to JSON, buffers and images.

use std::borrow::Cow;
use std::collections::HashSet;
use std::sync::Arc;

use ::gltf::binary::{Glb, Header};
use ::gltf::json::Root;
use data_url::DataUrl;
use percent_encoding::percent_decode_str;
use serde_json::{Map, Value, json};

use super::GltfError;
use crate::look::sniff_image;
use crate::memory::MemoryError;
use crate::shown::{MAX_NAME_CHARS, json_fault, shown, shown_start};
use crate::siblings::{Absent, Image, NO_IMAGE, Resolve, Siblings};

/// Extensions that hide geometry from a reader without their decoder; meshopt's has the same streams by both names.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Most items of each of [`LISTS`]: one takes up to a kilobyte while a file is written.
const MAX_ITEMS: u64 = 1 << 18;
/// Lists of a document whose items take no bytes elsewhere in the file.
const LISTS: [&str; 9] =
    ["nodes", "meshes", "materials", "textures", "images", "samplers", "skins", "animations", "cameras"];
/// Bytes of a GLB's header.
const GLB_HEADER: usize = 12;
/// Parts of the document that geometry does not need: a fault in one of them must not refuse the file.
const NOT_GEOMETRY: [&str; 8] =
    ["animations", "cameras", "extras", "images", "materials", "samplers", "textures", "extensions"];

pub(crate) struct Loaded {
    pub(crate) json: Value,
    /// The JSON chunk of a GLB whose buffers are in it.
    pub(crate) text: Option<Vec<u8>>,
    /// Whether its geometry was compressed.
    pub(crate) is_decoded: bool,
    pub(crate) root: Root,
    pub(crate) buffers: Vec<Arc<Vec<u8>>>,
    pub(crate) images: Vec<Option<Image>>,
    /// Bytes that all of it takes, about.
    pub(crate) bytes: u64,
}

/// JSON and binary chunk.
type Chunks<'a> = (Cow<'a, [u8]>, Option<Cow<'a, [u8]>>);

/// Loads the document and everything it refers to.
pub(crate) fn load(
    name: &str,
    bytes: &[u8],
    resolve: &mut Resolve<'_>,
    memory_limit: u64,
    notices: &mut Vec<String>,
) -> Result<Loaded, GltfError> {
    let (json, bin) = split(bytes)?;
    let of_json = bytes_of_json(&json);
    MemoryError::check(of_json + decoded_bytes(&json) + bytes.len() as u64, memory_limit)?;
    let text = bin.is_some().then(|| json.to_vec());
    let mut json = parsed(&json)?;
    check_version(&json)?;
    write_integers(&mut json, false);
    for what in LISTS {
        let count = json[what].as_array().map_or(0, Vec::len) as u64;
        if count > MAX_ITEMS {
            return Err(GltfError::TooLarge { what, count, limit: MAX_ITEMS });
        }
    }
    #[cfg(not(feature = "decompress"))]
    check_compression(name, &json)?;
    let (fallbacks, all) = (fallbacks(&json), (0..).zip(json["buffers"].as_array().into_iter().flatten()));
    let mut used = all.filter(|(number, _)| !fallbacks.contains(number));
    let text = text.filter(|_| used.all(|(_, buffer)| buffer.get("uri").is_none()));
    let mut siblings = Siblings::new(resolve, memory_limit);
    let buffers = load_buffers(&mut json, bin.as_deref(), &mut siblings)?;
    let n_in_file = buffers.len();
    #[cfg(feature = "decompress")]
    let buffers = {
        let mut buffers = buffers;
        super::decompress::decompress(&mut json, &mut buffers).map_err(|(extension, problem)| {
            compressed(name, extension, format!("could not be decoded: {problem}"))
        })?;
        buffers
    };
    let is_decoded = buffers.len() > n_in_file;
    drop_missing(&mut json, notices);
    let root = typed(&json)?;
    let images = load_images(&json, &root, &buffers, &mut siblings, notices);
    // The caller still holds the file itself; buffers and images of one file share its bytes.
    let mut seen = HashSet::new();
    let loaded = buffers.iter().chain(images.iter().flatten().map(|image| &image.bytes));
    let loaded = loaded.filter(|bytes| seen.insert(Arc::as_ptr(bytes))).map(|bytes| bytes.len() as u64);
    let held = of_json + bytes.len() as u64 + loaded.sum::<u64>();
    MemoryError::check(held, memory_limit)?;
    Ok(Loaded { json, text, is_decoded, root, buffers, images, bytes: held })
}

/// Names of the buffers and images outside the file, none if it cannot be read.
pub(crate) fn named_files(bytes: &[u8], memory_limit: u64) -> Vec<String> {
    let Ok((json, _)) = split(bytes) else { return Vec::new() };
    let fits = MemoryError::check(bytes_of_json(&json) + bytes.len() as u64, memory_limit).is_ok();
    let json = if fits { parsed(&json).unwrap_or_default() } else { Value::Null };
    let items = ["buffers", "images"].into_iter().filter_map(|list| json[list].as_array()).flatten();
    let uris = items.filter_map(|item| item["uri"].as_str()).filter(|uri| !is_data(uri));
    uris.map(|uri| decoded(uri).into_owned()).collect()
}

/// Takes out attributes that only pictures need and whose accessor is not there. Accessors that are written later would take
/// its number.
fn drop_missing(json: &mut Value, notices: &mut Vec<String>) {
    let n_accessors = json["accessors"].as_array().map_or(0, Vec::len) as u64;
    let mut missing = Vec::new();
    let mut meshes = json.get_mut("meshes").and_then(Value::as_array_mut);
    for (mesh, value) in meshes.iter_mut().flat_map(|meshes| meshes.iter_mut()).enumerate() {
        let primitives = value.get_mut("primitives").and_then(Value::as_array_mut).into_iter().flatten();
        for attributes in primitives.filter_map(|p| p.get_mut("attributes")?.as_object_mut()) {
            attributes.retain(|name, accessor| {
                let is_drawn = ["TEXCOORD_", "COLOR_", "_"].iter().any(|start| name.starts_with(start));
                let is_missing = is_drawn && accessor.as_u64().is_some_and(|number| number >= n_accessors);
                if is_missing {
                    missing.push(format!("{} of mesh {mesh}, accessor {accessor}", shown(name)));
                }
                !is_missing
            });
        }
    }
    if let Some(first) = missing.first() {
        notices
            .push(format!("attributes without an accessor are left out ({} in all): {first}", missing.len()));
    }
}

/// Bytes that JSON takes once it is read: its text, twice for a while, and every value in it as a value of any kind and
/// as one of the document's own.
fn bytes_of_json(text: &[u8]) -> u64 {
    const VALUE_BYTES: u64 = 140;
    // Those in strings are counted too: names have few, and data of a buffer has one.
    let values = text.iter().filter(|b| matches!(b, b',' | b':' | b'[' | b'{')).count() as u64;
    2 * text.len() as u64 + VALUE_BYTES * values
}

/// Bytes that base64 in JSON will have once it is decoded.
fn decoded_bytes(text: &[u8]) -> u64 {
    let strings = text.split(|&b| b == b'"').filter(|string| string.starts_with(b"data:"));
    strings.map(|uri| uri.len() as u64 / 4 * 3).sum()
}

/// JSON and binary chunk of a GLB; a file without the GLB magic is JSON itself.
fn split(bytes: &[u8]) -> Result<Chunks<'_>, GltfError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).into(), None));
    }
    let fault = |problem: String| GltfError::Container(problem);
    let word = |at: usize| {
        let word = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(fault(format!("it has {} bytes; the header alone has {GLB_HEADER}", bytes.len())));
    };
    if version != 2 {
        return Err(fault(format!(
            "version {version}, but only version 2 is read: export it anew as glTF 2.0"
        )));
    }
    // The library subtracts the header's length without a check, and stumbles over bytes after the end.
    let length = length as usize;
    if length < GLB_HEADER {
        return Err(fault(format!("it says it has {length} bytes; the header alone has {GLB_HEADER}")));
    }
    if length > bytes.len() {
        return Err(GltfError::CutOff { declared: length as u64, found: bytes.len() as u64 });
    }
    let glb = Glb::from_slice(&bytes[..length]).map_err(|e| {
        use ::gltf::binary::Error::{ChunkType, UnknownChunkType};
        fault(match e {
            ::gltf::Error::Binary(ChunkType(_) | UnknownChunkType(_)) => {
                "its first chunk must be JSON, and the one after it binary data".into()
            }
            _ => "one of its chunks ends after the file: it is cut off or damaged".to_owned(),
        })
    })?;
    // Some writers fill up the chunk with zeros instead of spaces.
    let json = match glb.json {
        Cow::Borrowed(json) => Cow::Borrowed(unpadded(json)),
        Cow::Owned(json) => unpadded(&json).to_vec().into(),
    };
    Ok((json, glb.bin))
}

fn unpadded(json: &[u8]) -> &[u8] {
    json.trim_ascii_end().strip_suffix(b"\0").map_or(json, |json| {
        let end = json.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1);
        &json[..end]
    })
}

fn parsed(json: &[u8]) -> Result<Value, GltfError> {
    serde_json::from_slice(json).map_err(|e| GltfError::Json(json_fault(json, &e)))
}

/// JSON and binary chunk of a GLB, nothing resolved.
pub(crate) fn glb_parts(bytes: &[u8], memory_limit: u64) -> Result<(Value, Vec<u8>), GltfError> {
    let (json, bin) = split(bytes)?;
    MemoryError::check(bytes_of_json(&json) + 2 * bytes.len() as u64, memory_limit)?;
    let json = parsed(&json)?;
    check_version(&json)?;
    Ok((json, bin.map(Cow::into_owned).unwrap_or_default()))
}

/// A GLB of what [`glb_parts`] took apart.
pub(crate) fn glb_of(json: &Value, bin: &[u8]) -> Result<Vec<u8>, GltfError> {
    let json = serde_json::to_vec(json).map_err(|e| GltfError::Json(e.to_string()))?;
    let header = Header { magic: *b"glTF", version: 2, length: 0 };
    let glb = Glb { header, json: json.into(), bin: (!bin.is_empty()).then(|| bin.into()) };
    glb.to_vec().map_err(|e| GltfError::Container(e.to_string()))
}

fn check_version(json: &Value) -> Result<(), GltfError> {
    match json["asset"]["version"].as_str() {
        Some(v) if v.starts_with("2.") => Ok(()),
        Some(v) => Err(GltfError::Json(format!("its version is {v:?}, but only 2.x is read"))),
        None => Err(GltfError::Json("it has no asset version".into())),
    }
}

fn compressed(name: &str, extension: &str, problem: String) -> GltfError {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let output = format!("{stem}-plain.glb");
    GltfError::Compressed { extension: extension.into(), problem, name: name.into(), output }
}

#[cfg(not(feature = "decompress"))]
fn check_compression(name: &str, json: &Value) -> Result<(), GltfError> {
    let has = |object: &Value, extension: &str| object["extensions"].get(extension).is_some();
    let items = |object: &Value, key: &str| object[key].as_array().cloned().unwrap_or_default();
    for extension in [DRACO].into_iter().chain(MESHOPT) {
        let required = items(json, "extensionsRequired").iter().any(|e| e == extension);
        let in_views = items(json, "bufferViews").iter().any(|view| has(view, extension));
        let in_meshes = json["meshes"].as_array().into_iter().flatten().any(|mesh| {
            mesh["primitives"].as_array().into_iter().flatten().any(|primitive| has(primitive, extension))
        });
        if required || in_views || in_meshes {
            return Err(compressed(name, extension, "there is no decoder here".into()));
        }
    }
    Ok(())
}

/// Typed view of what geometry needs.
pub(super) fn typed(json: &Value) -> Result<Root, GltfError> {
    let Value::Object(object) = json else {
        return Err(GltfError::Json("the JSON is not an object".into()));
    };
    let is_geometry = |key: &str, value: &Value| !NOT_GEOMETRY.contains(&key) && !value.is_null();
    let of_geometry = object.iter().filter(|(key, value)| is_geometry(key, value));
    let mut geometry: Map<String, Value> =
        of_geometry.map(|(key, value)| (key.clone(), strict(value))).collect();
    geometry.insert("asset".into(), json!({ "version": "2.0" }));
    // The specification lets a scene have no nodes; the library does not.
    for scene in geometry.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| json!([]));
        }
    }
    let whole = Value::Object(geometry);
    serde_json::from_value(whole.clone()).map_err(|_| {
        let lists =
            whole.as_object().into_iter().flatten().filter_map(|(key, list)| Some((key, list.as_array()?)));
        let mut items =
            lists.flat_map(|(key, list)| list.iter().enumerate().map(move |(k, item)| (key, k, item)));
        let at = items.find(|(key, _, item)| {
            serde_json::from_value::<Root>(json!({ "asset": whole["asset"], *key: [item] })).is_err()
        });
        let place = at.map_or("a part of it".into(), |(key, k, _)| format!("item {k} of '{}'", shown(key)));
        GltfError::Json(format!("{place} lacks a value, or has one of another type than glTF 2.0 says"))
    })
}

/// A value as the library wants it: `extras`, which may have any type, and extensions are left out, and so is `null`.
fn strict(value: &Value) -> Value {
    let is_read = |key: &str, value: &Value| !matches!(key, "extras" | "extensions") && !value.is_null();
    match value {
        Value::Array(items) => items.iter().map(strict).collect(),
        Value::Object(object) => {
            let read = object.iter().filter(|(key, value)| is_read(key, value));
            Value::Object(read.map(|(key, value)| (key.clone(), strict(value))).collect())
        }
        value => value.clone(),
    }
}

/// Writes integers as such: glTF 2.0 (section 2.7) lets a file write 24 as 24.0.
fn write_integers(value: &mut Value, is_integer: bool) {
    const MEMBERS: [&str; 26] = [
        "attributes",
        "buffer",
        "bufferView",
        "byteLength",
        "byteOffset",
        "byteStride",
        "camera",
        "children",
        "componentType",
        "count",
        "index",
        "indices",
        "input",
        "inverseBindMatrices",
        "joints",
        "material",
        "mesh",
        "mode",
        "node",
        "nodes",
        "output",
        "sampler",
        "scene",
        "skeleton",
        "skin",
        "targets",
    ];
    match value {
        Value::Number(number) if is_integer && !number.is_u64() => {
            let whole = number.as_f64().filter(|x| x.fract() == 0.0 && (0.0..=9e15).contains(x));
            if let Some(x) = whole {
                *value = (x as u64).into();
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| write_integers(item, is_integer)),
        Value::Object(object) => {
            for (key, value) in object.iter_mut().filter(|(key, _)| *key != "extras") {
                let is_member = is_integer && value.is_number() || MEMBERS.contains(&key.as_str());
                write_integers(value, is_member);
            }
        }
        _ => {}
    }
}

fn load_buffers(
    json: &mut Value,
    bin: Option<&[u8]>,
    siblings: &mut Siblings<'_>,
) -> Result<Vec<Arc<Vec<u8>>>, GltfError> {
    let mut buffers = Vec::new();
    let fallbacks = fallbacks(json);
    let list = json.get_mut("buffers").and_then(Value::as_array_mut);
    for (number, buffer) in list.into_iter().flatten().enumerate() {
        let declared = buffer["byteLength"].as_u64().unwrap_or(0);
        let uri = buffer.as_object_mut().and_then(|b| b.shift_remove("uri"));
        if fallbacks.contains(&(number as u64)) {
            buffers.push(Arc::default());
            continue;
        }
        let bytes = match uri.as_ref().and_then(Value::as_str) {
            Some(uri) => match data_of(uri) {
                Some(data) => data,
                None => siblings.file(&decoded(uri)),
            }
            .map_err(|why| GltfError::MissingFile { uri: shown_uri(uri), problem: why.to_string() })?,
            None if number == 0 => Arc::new(bin.unwrap_or_default().to_vec()),
            None => Arc::default(),
        };
        if declared > bytes.len() as u64 {
            return Err(GltfError::Buffer { buffer: number, declared, found: bytes.len() as u64 });
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// Buffers that only compressed views name: they are for programs without a decoder, and may not be there.
fn fallbacks(json: &Value) -> Vec<u64> {
    let views = || json["bufferViews"].as_array().into_iter().flatten();
    let is_packed = |view: &Value| MESHOPT.iter().any(|name| view["extensions"].get(name).is_some());
    let named = |packed: bool| {
        views().filter(move |view| is_packed(view) == packed).filter_map(|view| view["buffer"].as_u64())
    };
    let streams =
        views().flat_map(|view| MESHOPT.iter().filter_map(|n| view["extensions"][n]["buffer"].as_u64()));
    let used: Vec<u64> = named(false).chain(streams).collect();
    named(true).filter(|buffer| !used.contains(buffer)).collect()
}

/// Images that are not in a buffer view; the notices name each that is not there or no image.
fn load_images(
    json: &Value,
    root: &Root,
    buffers: &[Arc<Vec<u8>>],
    siblings: &mut Siblings<'_>,
    notices: &mut Vec<String>,
) -> Vec<Option<Image>> {
    let list = json["images"].as_array();
    list.into_iter()
        .flatten()
        .enumerate()
        .map(|(number, image)| {
            let Some(uri) = image["uri"].as_str() else {
                let view = image["bufferView"].as_u64().and_then(|view| view_bytes(root, buffers, view));
                if view.is_some_and(|bytes| sniff_image(bytes).is_none()) {
                    notices.push(format!("image {number} {NO_IMAGE}: it is not drawn"));
                }
                return None;
            };
            let otherwise = "exports keep the reference";
            match data_of(uri) {
                None => siblings.image(&decoded(uri), otherwise, notices),
                Some(data) => {
                    let image = data.and_then(|bytes| Image::new(&format!("image {number}"), bytes));
                    if let Err(reason) = &image {
                        notices.push(format!("texture '{}' {reason}: {otherwise}", shown_uri(uri)));
                    }
                    image.ok()
                }
            }
        })
        .collect()
}

/// The bytes of a buffer view; nothing where the buffer is too short.
pub(super) fn view_bytes<'a>(root: &Root, buffers: &'a [Arc<Vec<u8>>], view: u64) -> Option<&'a [u8]> {
    let view = root.buffer_views.get(usize::try_from(view).ok()?)?;
    let start = usize::try_from(view.byte_offset.map_or(0, |o| o.0)).ok()?;
    let end = start.checked_add(usize::try_from(view.byte_length.0).ok()?)?;
    buffers.get(view.buffer.value())?.get(start..end)
}

fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// The bytes of a `data:` URI; nothing for any other URI.
///
/// # Errors
/// That it cannot be decoded.
fn data_of(uri: &str) -> Option<Result<Arc<Vec<u8>>, Absent>> {
    if !is_data(uri) {
        return None;
    }
    // Of base64; growing by doubling would take as much again.
    let mut bytes = Vec::with_capacity(uri.len() / 4 * 3);
    let append = |part: &[u8]| {
        bytes.extend_from_slice(part);
        Ok::<(), std::convert::Infallible>(())
    };
    let decoded = DataUrl::process(uri).is_ok_and(|url| url.decode(append).is_ok());
    Some(if decoded { Ok(Arc::new(bytes)) } else { Err(Absent::Refused("is no valid data: URI".into())) })
}

fn decoded(uri: &str) -> Cow<'_, str> {
    percent_decode_str(uri).decode_utf8_lossy()
}

/// A URI for a message: a `data:` URI may have megabytes.
fn shown_uri(uri: &str) -> String {
    shown_start(&decoded(uri), MAX_NAME_CHARS)
}
