//! From bytes to JSON, buffers and images.

use std::borrow::Cow;

use ::gltf::binary::{Glb, Header};
use ::gltf::json::Root;
use data_url::DataUrl;
use percent_encoding::percent_decode_str;
use serde_json::{Value, json};

use super::{GltfError, Image};
use crate::look::sniff_image;

/// Extensions that hide geometry from a reader without their decoder; meshopt's has the same streams by both names.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Bytes of a GLB's header.
const GLB_HEADER: usize = 12;
/// Parts of the document that geometry does not need: a fault in one of them must not refuse the file.
const NOT_GEOMETRY: [&str; 8] =
    ["animations", "cameras", "extras", "images", "materials", "samplers", "textures", "extensions"];

pub(crate) struct Loaded {
    pub(crate) json: Value,
    pub(crate) root: Root,
    pub(crate) buffers: Vec<Vec<u8>>,
    pub(crate) images: Vec<Option<Image>>,
}

/// JSON and binary chunk.
type Chunks<'a> = (Cow<'a, [u8]>, Option<Cow<'a, [u8]>>);
type Resolve<'a> = &'a mut dyn FnMut(&str) -> Option<Vec<u8>>;

/// Loads the document and everything it refers to.
pub(crate) fn load(
    name: &str,
    bytes: &[u8],
    resolve: Resolve<'_>,
    notices: &mut Vec<String>,
) -> Result<Loaded, GltfError> {
    let (json, bin) = split(bytes)?;
    let mut json: Value = serde_json::from_slice(&json).map_err(|e| GltfError::Json(e.to_string()))?;
    check_version(&json)?;
    #[cfg(not(feature = "decompress"))]
    check_compression(name, &json)?;
    let buffers = load_buffers(&mut json, bin.as_deref(), resolve)?;
    #[cfg(feature = "decompress")]
    let buffers = {
        let mut buffers = buffers;
        super::decompress::decompress(&mut json, &mut buffers).map_err(|(extension, problem)| {
            compressed(name, extension, format!("could not be decoded: {problem}"))
        })?;
        buffers
    };
    let images = load_images(&json, resolve, notices);
    let root = typed(&json)?;
    Ok(Loaded { json, root, buffers, images })
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
    if length < GLB_HEADER || length > bytes.len() {
        return Err(fault(format!(
            "it says it has {length} bytes but has {}: it is cut off or damaged",
            bytes.len()
        )));
    }
    let glb = Glb::from_slice(&bytes[..length]).map_err(|e| fault(e.to_string()))?;
    Ok((glb.json, glb.bin))
}

/// JSON and binary chunk of a GLB, nothing resolved.
pub(crate) fn glb_parts(bytes: &[u8]) -> Result<(Value, Vec<u8>), GltfError> {
    let (json, bin) = split(bytes)?;
    let json: Value = serde_json::from_slice(&json).map_err(|e| GltfError::Json(e.to_string()))?;
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
fn typed(json: &Value) -> Result<Root, GltfError> {
    let Value::Object(object) = json else {
        return Err(GltfError::Json("the JSON is not an object".into()));
    };
    let mut geometry = object.clone();
    for key in NOT_GEOMETRY {
        geometry.shift_remove(key);
    }
    // The specification lets a scene have no nodes; the library does not.
    for scene in geometry.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| json!([]));
        }
    }
    serde_json::from_value(Value::Object(geometry)).map_err(|e| GltfError::Json(e.to_string()))
}

fn load_buffers(
    json: &mut Value,
    bin: Option<&[u8]>,
    resolve: Resolve<'_>,
) -> Result<Vec<Vec<u8>>, GltfError> {
    let mut buffers = Vec::new();
    let fallbacks = fallbacks(json);
    let list = json.get_mut("buffers").and_then(Value::as_array_mut);
    for (number, buffer) in list.into_iter().flatten().enumerate() {
        let declared = buffer["byteLength"].as_u64().unwrap_or(0);
        let uri = buffer.as_object_mut().and_then(|b| b.shift_remove("uri"));
        if fallbacks.contains(&(number as u64)) {
            buffers.push(Vec::new());
            continue;
        }
        let bytes = match uri.as_ref().and_then(Value::as_str) {
            Some(uri) => match fetch(uri, resolve) {
                Some((bytes, _)) => bytes,
                None => return Err(GltfError::MissingFile { uri: shown_uri(uri) }),
            },
            None if number == 0 => bin.unwrap_or_default().to_vec(),
            None => Vec::new(),
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

fn load_images(json: &Value, resolve: Resolve<'_>, notices: &mut Vec<String>) -> Vec<Option<Image>> {
    let list = json["images"].as_array();
    list.into_iter()
        .flatten()
        .map(|image| {
            let uri = image["uri"].as_str()?;
            let Some((bytes, mime)) = fetch(uri, resolve) else {
                notices
                    .push(format!("texture '{}' is not there: exports keep the reference", shown_uri(uri)));
                return None;
            };
            let declared = image["mimeType"].as_str().map(str::to_owned);
            let mime = sniff_image(&bytes).map(str::to_owned).or(declared).or(mime)?;
            Some(Image { bytes, mime })
        })
        .collect()
}

/// Bytes and media type behind a URI: `data:` is decoded, anything else is asked for.
fn fetch(uri: &str, resolve: Resolve<'_>) -> Option<(Vec<u8>, Option<String>)> {
    if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        let url = DataUrl::process(uri).ok()?;
        let mime = url.mime_type();
        let mime = format!("{}/{}", mime.type_, mime.subtype);
        return url.decode_to_vec().ok().map(|(bytes, _)| (bytes, Some(mime)));
    }
    resolve(&percent_decode_str(uri).decode_utf8_lossy()).map(|bytes| (bytes, None))
}

/// A URI for a message: a `data:` URI may have megabytes.
fn shown_uri(uri: &str) -> String {
    /// As long as a long path.
    const MAX_CHARS: usize = 120;
    percent_decode_str(uri).decode_utf8_lossy().chars().take(MAX_CHARS).collect()
}
