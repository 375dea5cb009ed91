//! Loads a glTF file: JSON, buffers and images.

use cagework_core::words::counted;
use std::borrow::Cow;
use std::collections::HashSet;
use std::sync::Arc;

use ::gltf::binary::{Glb, Header};
use ::gltf::json::Root;
use data_url::DataUrl;
use percent_encoding::percent_decode_str;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;

use super::GltfError;
use super::decompress::decompress;
use super::root::{MESHOPT, typed, view_bytes};
use crate::look::sniff_image;
use crate::memory::MemoryError;
use crate::order::{Budget, Expansion, Order, Price};
use crate::shown::{MAX_NAME_CHARS, json_fault, shown, shown_start, without_byte_order_mark};
use crate::siblings::{IMAGE_FAULT, Image, Resolve, SiblingError, Siblings};

/// Limit on the items of each of [`Lists`]. An item takes up to 1 KB while a file is written.
const MAX_ITEMS: u64 = 1 << 18;
/// Limit on the values of a document's JSON; larger texts may have one value per 4 bytes. A value takes up to 200 bytes
/// while it is read.
const MAX_JSON_VALUES: u64 = 1 << 22;
const BYTES_PER_JSON_VALUE: u64 = 4;
/// Size of the GLB header, bytes.
const GLB_HEADER_BYTES: usize = 12;
pub(crate) struct GltfContents {
    pub(crate) json: Value,
    /// JSON chunk as read, if the file is a self-contained GLB.
    pub(crate) text: Option<Vec<u8>>,
    /// The file, if it is a GLB with all buffers in `data:` URIs or in its binary chunk.
    pub(crate) packed: Option<Vec<u8>>,
    /// Whether compressed geometry was decoded.
    pub(crate) is_decoded: bool,
    pub(crate) root: Root,
    pub(crate) buffers: Vec<Arc<Vec<u8>>>,
    pub(crate) images: Vec<Option<Image>>,
    /// Approximate memory of the document, its buffers and its images, bytes.
    pub(crate) bytes: u64,
}

/// The JSON chunk of a GLB and, if present, its binary chunk.
type Chunks<'a> = (Cow<'a, [u8]>, Option<Cow<'a, [u8]>>);

/// Loads a document with its buffers and images.
pub(crate) fn load(
    name: &str,
    bytes: &[u8],
    resolve: &mut Resolve<'_>,
    memory_limit: u64,
    notices: &mut Vec<String>,
) -> Result<GltfContents, GltfError> {
    let (json, bin) = split(bytes)?;
    let of_json = bytes_of_json(&json);
    let text = bin.is_some().then(|| json.to_vec());
    let mut json = parsed(&json, bytes.len() as u64, memory_limit)?;
    check_version(&json)?;
    write_integers(&mut json, false);
    let (fallbacks, all) = (fallbacks(&json), (0..).zip(json["buffers"].as_array().into_iter().flatten()));
    let uris =
        all.filter(|(number, _)| !fallbacks.contains(number)).filter_map(|(_, buffer)| buffer.get("uri"));
    let uris: Vec<&Value> = uris.collect();
    let text = text.filter(|_| uris.is_empty());
    let is_inline = !uris.is_empty() && uris.iter().all(|uri| uri.as_str().is_some_and(is_data));
    let packed = (is_inline && bytes.starts_with(b"glTF")).then(|| bytes.to_vec());
    let mut siblings = Siblings::new(resolve, memory_limit);
    let mut buffers = load_buffers(&mut json, bin.as_deref(), &mut siblings)?;
    let n_in_file = buffers.len();
    let in_buffers = distinct_bytes(&buffers);
    let (file, held) = (in_buffers.max(bytes.len() as u64), of_json + bytes.len() as u64 + in_buffers);
    let budget = Budget::new(file, held, memory_limit, Expansion::GEOMETRY);
    decompress(name, &mut json, &mut buffers, budget)?;
    let is_decoded = buffers.len() > n_in_file;
    drop_missing(&mut json, notices);
    let root = typed(&json)?;
    let images = load_images(&json, &root, &buffers, &mut siblings, notices);
    // Memory includes the caller's copy of the file.
    let loaded = distinct_bytes(buffers.iter().chain(images.iter().flatten().map(|image| &image.bytes)));
    let of_packed = packed.as_ref().map_or(0, Vec::len) as u64;
    let held = of_json + bytes.len() as u64 + of_packed + loaded;
    MemoryError::check(held, memory_limit)?;
    Ok(GltfContents { json, text, packed, is_decoded, root, buffers, images, bytes: held })
}

/// Total size of buffers and images, bytes. Those that share their bytes count once.
fn distinct_bytes<'a>(all: impl IntoIterator<Item = &'a Arc<Vec<u8>>>) -> u64 {
    let mut seen = HashSet::new();
    let distinct = all.into_iter().filter(|bytes| seen.insert(Arc::as_ptr(bytes)));
    distinct.map(|bytes| bytes.len() as u64).sum()
}

/// Names of external buffers and images; empty if the file cannot be read.
pub(crate) fn named_files(bytes: &[u8], memory_limit: u64) -> Vec<String> {
    let Ok((json, _)) = split(bytes) else { return Vec::new() };
    let json = parsed(&json, bytes.len() as u64, memory_limit).unwrap_or_default();
    let items = ["buffers", "images"].into_iter().filter_map(|list| json[list].as_array()).flatten();
    let uris = items.filter_map(|item| item["uri"].as_str()).filter(|uri| !is_data(uri));
    uris.map(|uri| decoded(uri).into_owned()).collect()
}

/// Removes optional vertex attributes whose accessor does not exist. Otherwise, an accessor that an export
/// appends could get the missing index.
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
                    missing.push(format!("{} of mesh {mesh} refers to accessor {accessor}", shown(name)));
                }
                !is_missing
            });
        }
    }
    if let Some(first) = missing.first() {
        notices.push(format!(
            "ignored {}: {first}",
            counted(missing.len(), "attribute without data", "attributes without data; the first is")
        ));
    }
}

/// Approximate memory of parsed JSON: its text twice, and per value a `serde_json::Value` and a typed copy.
pub(super) fn bytes_of_json(text: &[u8]) -> u64 {
    const VALUE_BYTES: u64 = 140;
    2 * text.len() as u64 + VALUE_BYTES * values_of_json(text)
}

/// Approximate number of values. Separators inside strings, which are rare, are counted too.
fn values_of_json(text: &[u8]) -> u64 {
    text.iter().filter(|b| matches!(b, b',' | b':' | b'[' | b'{')).count() as u64
}

/// Total size of the document's base64 data URIs after decoding, bytes.
fn decoded_bytes(text: &[u8]) -> u64 {
    let strings = text.split(|&b| b == b'"').filter(|string| string.starts_with(b"data:"));
    strings.map(|uri| uri.len() as u64 / 4 * 3).sum()
}

/// Splits a GLB into JSON and binary chunk. Without GLB magic, the file is JSON.
fn split(bytes: &[u8]) -> Result<Chunks<'_>, GltfError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((without_byte_order_mark(bytes).into(), None));
    }
    let fault = |problem: String| GltfError::Container(problem);
    let word = |at: usize| {
        let word = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(fault(format!(
            "it has {} bytes, but the header alone takes {GLB_HEADER_BYTES}",
            bytes.len()
        )));
    };
    if version != 2 {
        return Err(fault(format!(
            "it has version {version}, but only version 2 is supported: export it as glTF 2.0"
        )));
    }
    // `Glb::from_slice` subtracts the header's length without a check and rejects trailing bytes. Check the declared
    // length and remove trailing bytes first.
    let length = length as usize;
    if length < GLB_HEADER_BYTES {
        return Err(fault(format!(
            "its header declares {length} bytes, but the header alone takes {GLB_HEADER_BYTES}"
        )));
    }
    if length > bytes.len() {
        return Err(GltfError::CutOff { declared: length as u64, found: bytes.len() as u64 });
    }
    let glb = Glb::from_slice(&bytes[..length]).map_err(|e| {
        use ::gltf::binary::Error::{ChunkType, UnknownChunkType};
        fault(match e {
            ::gltf::Error::Binary(ChunkType(_) | UnknownChunkType(_)) => {
                "its first chunk must be JSON and its second chunk binary data".into()
            }
            _ => "a chunk extends beyond the end of the file: it is cut off or damaged".to_owned(),
        })
    })?;
    // Some exporters pad the JSON chunk with zeros instead of spaces. Remove them, because they are invalid in JSON.
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

/// The lists of a document whose lengths are not limited by the size of the buffers.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Lists {
    nodes: Vec<IgnoredAny>,
    meshes: Vec<IgnoredAny>,
    materials: Vec<IgnoredAny>,
    textures: Vec<IgnoredAny>,
    images: Vec<IgnoredAny>,
    samplers: Vec<IgnoredAny>,
    skins: Vec<IgnoredAny>,
    cameras: Vec<IgnoredAny>,
}

/// The text of a document.
struct JsonText<'a>(&'a [u8]);

impl Order for JsonText<'_> {
    fn price(&self) -> Price {
        let limit = MAX_JSON_VALUES.max(self.0.len() as u64 / BYTES_PER_JSON_VALUE);
        let counts = vec![("values in the JSON", values_of_json(self.0), limit)];
        Price { counts, bytes: bytes_of_json(self.0) + decoded_bytes(self.0), unpacked: 0 }
    }
}

/// Parses the JSON of a document. `held`: memory in use, bytes.
fn parsed(json: &[u8], held: u64, memory_limit: u64) -> Result<Value, GltfError> {
    Budget::new(held, held, memory_limit, Expansion::TEXT).permit(JsonText(json))?;
    let fault = |e: serde_json::Error| GltfError::Json(json_fault(json, &e));
    // Lists are counted before values are built, because an object takes up to 600 bytes.
    let lists: Lists = serde_json::from_slice(json).map_err(fault)?;
    for (what, count) in [
        ("nodes", lists.nodes.len() as u64),
        ("meshes", lists.meshes.len() as u64),
        ("materials", lists.materials.len() as u64),
        ("textures", lists.textures.len() as u64),
        ("images", lists.images.len() as u64),
        ("samplers", lists.samplers.len() as u64),
        ("skins", lists.skins.len() as u64),
        ("cameras", lists.cameras.len() as u64),
    ] {
        if count > MAX_ITEMS {
            return Err(GltfError::TooLarge { what, count, limit: MAX_ITEMS });
        }
    }
    serde_json::from_slice(json).map_err(fault)
}

/// Splits a GLB into its JSON and its binary chunk, without loading external files.
pub(crate) fn glb_parts(bytes: &[u8], memory_limit: u64) -> Result<(Value, Vec<u8>), GltfError> {
    let (json, bin) = split(bytes)?;
    let json = parsed(&json, 2 * bytes.len() as u64, memory_limit)?;
    check_version(&json)?;
    Ok((json, bin.map(Cow::into_owned).unwrap_or_default()))
}

/// Builds a GLB from the parts returned by [`glb_parts`].
pub(crate) fn glb_of(json: &Value, bin: &[u8]) -> Result<Vec<u8>, GltfError> {
    let json = serde_json::to_vec(json).map_err(|e| GltfError::Json(e.to_string()))?;
    let header = Header { magic: *b"glTF", version: 2, length: 0 };
    let glb = Glb { header, json: json.into(), bin: (!bin.is_empty()).then(|| bin.into()) };
    glb.to_vec().map_err(|e| GltfError::Container(e.to_string()))
}

fn check_version(json: &Value) -> Result<(), GltfError> {
    match json["asset"]["version"].as_str() {
        Some(v) if v.starts_with("2.") => Ok(()),
        Some(v) => Err(GltfError::Json(format!("its version is {v:?}, but only 2.x is supported"))),
        None => Err(GltfError::Json("it has no asset version".into())),
    }
}

/// Replaces integers written as floats, such as 24.0, by integers. glTF 2.0 allows such floats (section 2.7).
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

/// Indices of fallback buffers of meshopt: only compressed buffer views refer to them, and their files may be missing.
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

/// Loads images that are not in buffer views. Missing files and non-images become notices.
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
                    notices.push(format!("image {number} {IMAGE_FAULT}: it is not drawn"));
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

fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// Decodes a `data:` URI; `None` for other URIs.
///
/// # Errors
/// If the URI cannot be decoded.
fn data_of(uri: &str) -> Option<Result<Arc<Vec<u8>>, SiblingError>> {
    if !is_data(uri) {
        return None;
    }
    // Reserve the size of the decoded base64 data, because growing by doubling could take twice the memory.
    let mut bytes = Vec::with_capacity(uri.len() / 4 * 3);
    let append = |part: &[u8]| {
        bytes.extend_from_slice(part);
        Ok::<(), std::convert::Infallible>(())
    };
    let decoded = DataUrl::process(uri).is_ok_and(|url| url.decode(append).is_ok());
    Some(if decoded {
        Ok(Arc::new(bytes))
    } else {
        Err(SiblingError::Refused("is not a valid data: URI".into()))
    })
}

fn decoded(uri: &str) -> Cow<'_, str> {
    percent_decode_str(uri).decode_utf8_lossy()
}

/// A URI shortened for a message, since `data:` URIs can be megabytes long.
fn shown_uri(uri: &str) -> String {
    shown_start(&decoded(uri), MAX_NAME_CHARS)
}
