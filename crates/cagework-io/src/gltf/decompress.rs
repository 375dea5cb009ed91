//! Decompresses Draco and meshopt geometry into plain buffer views, before the document is interpreted.

use std::sync::Arc;

use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::Semantic;
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Root};
use draco_core::{
    DataType, DecodeLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder, PointAttribute, PointIndex,
};
use meshoptimizer_rs::codec::{
    BufferView, Filter, Mode, decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat,
    decode_vertex_buffer,
};
use meshoptimizer_rs::{Error, Workspace};
use serde_json::{Map, Value, json};

use super::accessor::{MAX_ELEMENTS, Source};
use super::pack::{INDICES, VERTICES, bounds, push};
use super::root::{DRACO, MESHOPT, typed};

/// Limit on the decompressed size of all streams, bytes. A file of a few hundred bytes can claim any size.
const MAX_DECOMPRESSED_BYTES: u64 = 1 << 30;

/// If the joint weights of a vertex sum to 1 within this tolerance, they are not rescaled, because the difference comes
/// from rounding to f32.
const MAX_WEIGHT_SUM_ERROR: f64 = 1e-6;

type Buffers = Vec<Arc<Vec<u8>>>;

/// Decodes all compressed geometry, appending buffers to `buffers` and the document.
///
/// # Errors
/// Returns the name of the extension and what is wrong with its stream.
pub(super) fn decompress(json: &mut Value, buffers: &mut Buffers) -> Result<(), (&'static str, String)> {
    let (mut left, n_in_file) = (MAX_DECOMPRESSED_BYTES, buffers.len());
    for extension in MESHOPT {
        for number in 0..json["bufferViews"].as_array().map_or(0, Vec::len) {
            let Some(packed) = take(json, &format!("/bufferViews/{number}"), extension) else { continue };
            let bytes = meshopt(&packed, buffers, left).map_err(|problem| (extension, problem))?;
            let length = bytes.len();
            left = left.saturating_sub(length as u64);
            let buffer = push_buffer(json, buffers, bytes);
            let view = &mut json["bufferViews"][number];
            (view["buffer"], view["byteOffset"], view["byteLength"]) =
                (buffer.into(), 0.into(), length.into());
        }
    }
    for m in 0..json["meshes"].as_array().map_or(0, Vec::len) {
        for p in 0..json["meshes"][m]["primitives"].as_array().map_or(0, Vec::len) {
            let place = format!("/meshes/{m}/primitives/{p}");
            let Some(packed) = take(json, &place, DRACO) else { continue };
            let before = buffers.len();
            draco(json, buffers, &place, &packed, left).map_err(|problem| (DRACO, problem))?;
            left = left.saturating_sub(buffers[before..].iter().map(|b| b.len() as u64).sum());
        }
    }
    if buffers.len() > n_in_file {
        // A document that cannot be parsed is reported when it is read.
        if let Ok(root) = typed(json) {
            correct_bounds(json, &root, buffers, n_in_file);
            normalise_weights(json, &root, buffers, n_in_file);
        }
    }
    let Some(document) = json.as_object_mut() else { return Ok(()) };
    for key in ["extensionsUsed", "extensionsRequired"] {
        let Some(names) = document.get_mut(key).and_then(Value::as_array_mut) else { continue };
        names.retain(|name| name != DRACO && MESHOPT.iter().all(|meshopt| name != meshopt));
        if names.is_empty() {
            document.shift_remove(key);
        }
    }
    Ok(())
}

/// Indices and accessors of the decoded values, which are in buffers from index `first` on. Excludes accessors with
/// sparse values.
fn decoded(root: &Root, first: usize) -> impl Iterator<Item = (usize, &Accessor)> {
    let is_decoded = move |accessor: &Accessor| {
        let view = accessor.buffer_view.and_then(|view| root.buffer_views.get(view.value()));
        accessor.sparse.is_none() && view.is_some_and(|view| view.buffer.value() >= first)
    };
    root.accessors.iter().enumerate().filter(move |(_, accessor)| is_decoded(accessor))
}

/// Recomputes the bounds `min` and `max`, because decoding a quantised stream does not return exactly the values that
/// they were computed from. glTF requires bounds for positions and times.
fn correct_bounds(json: &mut Value, root: &Root, buffers: &Buffers, first: usize) {
    let mut plain = root.clone();
    plain.accessors.iter_mut().for_each(|accessor| accessor.normalized = false);
    let source = Source { root: &plain, buffers };
    for (number, _) in decoded(root, first) {
        let Some(of_json) = json["accessors"][number].as_object_mut() else { continue };
        let had = [of_json.shift_remove("min"), of_json.shift_remove("max")];
        if had.iter().all(Option::is_none) {
            continue;
        }
        let number = number as u32;
        let vectors = source.floats::<3>(number, "").map(|all| bounds(&all)).ok();
        let found = vectors.or_else(|| source.floats::<1>(number, "").map(|all| bounds(&all)).ok());
        if let Some([min, max]) = found {
            of_json.insert("min".into(), min);
            of_json.insert("max".into(), max);
        }
    }
}

/// Scales joint weights to a sum of 1, and sets joints with weight 0 to joint 0, as glTF requires. The encoder's
/// rounding can change the sums and make small weights 0.
fn normalise_weights(json: &mut Value, root: &Root, buffers: &mut Buffers, first: usize) {
    let decoded: Vec<usize> = decoded(root, first).map(|(number, _)| number).collect();
    let mut done = Vec::new();
    for primitive in root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let accessor = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(Index::value);
        let of_set = |set| Some((accessor(Semantic::Joints(set))?, accessor(Semantic::Weights(set))?));
        let sets: Vec<(usize, usize)> = (0..).map_while(of_set).collect();
        if done.contains(&sets) || !sets.iter().any(|(_, weights)| decoded.contains(weights)) {
            continue;
        }
        let source = Source { root, buffers };
        let read = |&(joints, weights): &(usize, usize)| {
            let joints = source.unsigned::<4>(joints as u32, "joints").ok()?;
            let weights = source.floats::<4>(weights as u32, "joint weights").ok()?;
            (joints.len() == weights.len()).then_some((joints, weights))
        };
        let Some(mut values) = sets.iter().map(read).collect::<Option<Vec<_>>>() else { continue };
        let (mut is_off, mut is_named) = (false, false);
        for v in 0..values.iter().map(|(joints, _)| joints.len()).min().unwrap_or(0) {
            let sum: f64 = values.iter().flat_map(|(_, weights)| weights[v]).map(f64::from).sum();
            let changes = sum.is_finite() && sum > 0.0 && (sum - 1.0).abs() > MAX_WEIGHT_SUM_ERROR;
            is_off |= changes;
            for (joints, weights) in &mut values {
                for (joint, weight) in joints[v].iter_mut().zip(&mut weights[v]) {
                    if changes {
                        *weight = (f64::from(*weight) / sum) as f32;
                    }
                    if *weight == 0.0 && *joint != 0 {
                        (*joint, is_named) = (0, true);
                    }
                }
            }
        }
        for ((joints, weights), (new_joints, new_weights)) in sets.iter().zip(values) {
            let n = new_weights.len();
            if is_named {
                let bytes = new_joints.iter().flatten().flat_map(|&joint| (joint as u16).to_le_bytes());
                put_vertices(json, buffers, *joints, bytes.collect(), UNSIGNED_SHORT, n);
            }
            if is_off {
                let bytes = new_weights.iter().flatten().flat_map(|weight| weight.to_le_bytes());
                put_vertices(json, buffers, *weights, bytes.collect(), FLOAT, n);
            }
        }
        done.push(sets);
    }
}

/// Replaces the values of a four-component accessor of `n` vertices. `bytes`: the new values, little-endian, of the
/// glTF type `component_type`.
fn put_vertices(
    json: &mut Value,
    buffers: &mut Buffers,
    accessor: usize,
    bytes: Vec<u8>,
    component_type: u32,
    n: usize,
) {
    let view = json!({ "byteStride": bytes.len() / n.max(1), "target": VERTICES });
    if fill(json, buffers, accessor, bytes, view, component_type, n).is_ok()
        && let Some(accessor) = json["accessors"][accessor].as_object_mut()
    {
        for key in ["normalized", "sparse", "min", "max"] {
            accessor.shift_remove(key);
        }
    }
}

/// Removes an extension from the object at `place` and returns it.
fn take(json: &mut Value, place: &str, extension: &str) -> Option<Value> {
    let object = json.pointer_mut(place)?.as_object_mut()?;
    let extensions = object.get_mut("extensions")?.as_object_mut()?;
    let packed = extensions.shift_remove(extension)?;
    if extensions.is_empty() {
        object.shift_remove("extensions");
    }
    Some(packed)
}

fn push_buffer(json: &mut Value, buffers: &mut Buffers, bytes: Vec<u8>) -> usize {
    let buffer = push(json, "buffers", json!({ "byteLength": bytes.len() }));
    buffers.push(Arc::new(bytes));
    buffer
}

/// Bytes that a buffer view, or its meshopt extension, refers to.
fn bytes_of<'a>(view: &Value, buffers: &'a Buffers) -> Option<&'a [u8]> {
    let number = |key: &str| view[key].as_u64().and_then(|n| usize::try_from(n).ok());
    let start = number("byteOffset").unwrap_or(0);
    buffers.get(number("buffer")?)?.get(start..start.checked_add(number("byteLength")?)?)
}

fn meshopt(packed: &Value, buffers: &Buffers, left: u64) -> Result<Vec<u8>, String> {
    let number =
        |key: &str| packed[key].as_u64().filter(|&n| n <= MAX_DECOMPRESSED_BYTES).map_or(0, |n| n as usize);
    let source = bytes_of(packed, buffers).ok_or("its stream is cut off")?;
    if (number("count") as u64).saturating_mul(number("byteStride") as u64) > left {
        return Err(format!("the decompressed geometry exceeds {} MiB", MAX_DECOMPRESSED_BYTES >> 20));
    }
    let (count, stride, work) = (number("count"), number("byteStride"), &mut Workspace::default());
    let filter = packed["filter"].as_str().unwrap_or("NONE");
    let mut decode = || {
        let mode = Mode::parse(packed["mode"].as_str().unwrap_or_default())?;
        if mode != Mode::Attributes {
            return BufferView::new(mode, Filter::parse(filter)?, count, stride)?.decode(source, work);
        }
        // `BufferView` lacks version 1 of the vertex codec and the filter COLOR of KHR_meshopt_compression.
        let mut bytes = decode_vertex_buffer(count, stride, source, work)?;
        match filter {
            "COLOR" => decode_filter_color(&mut bytes, count, stride, work)?,
            _ => match Filter::parse(filter)? {
                Filter::None => {}
                Filter::Octahedral => decode_filter_oct(&mut bytes, count, stride, work)?,
                Filter::Quaternion => decode_filter_quat(&mut bytes, count, stride, work)?,
                Filter::Exponential => decode_filter_exp(&mut bytes, count, stride, work)?,
            },
        }
        Ok::<_, Error>(bytes)
    };
    decode().map_err(|_| "its stream is damaged or has an unknown mode".to_owned())
}

/// Decodes a Draco stream into the accessors of its primitive.
fn draco(
    json: &mut Value,
    buffers: &mut Buffers,
    place: &str,
    packed: &Value,
    left: u64,
) -> Result<(), String> {
    let view = packed["bufferView"].as_u64().unwrap_or(u64::MAX) as usize;
    let source = json["bufferViews"].get(view).and_then(|view| bytes_of(view, buffers));
    let limits = DecodeLimits::default()
        .with_max_points(MAX_ELEMENTS)
        .with_max_faces(2 * MAX_ELEMENTS)
        .with_max_decoded_bytes(left);
    let mut stream = DecoderBuffer::new(source.ok_or("its stream is cut off")?).with_limits(limits);
    let mut mesh = Mesh::new();
    MeshDecoder::new().decode(&mut stream, &mut mesh).map_err(|error| match error.kind() {
        ErrorKind::LimitExceeded => {
            format!("the decompressed geometry exceeds {} MiB", MAX_DECOMPRESSED_BYTES >> 20)
        }
        _ => "its stream is damaged or has an unsupported version".to_owned(),
    })?;

    let primitive = json.pointer(place).and_then(Value::as_object).cloned().unwrap_or_default();
    for (name, id) in packed["attributes"].as_object().into_iter().flatten() {
        let accessor = primitive.get("attributes").and_then(|a| a[name].as_u64());
        let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
        let attribute = id.and_then(|id| mesh.attribute_by_unique_id(id));
        let (Some(accessor), Some(attribute)) = (accessor, attribute) else {
            return Err(format!("its stream has no attribute for {name}"));
        };
        let (kind, element) = layout(attribute).ok_or_else(|| format!("{name} has an unknown type"))?;
        // glTF aligns vertex attributes to 4 bytes.
        let stride = element.next_multiple_of(4);
        let mut bytes = Vec::with_capacity(stride * mesh.num_points());
        for point in 0..mesh.num_points() as u32 {
            let start = attribute.mapped_index(PointIndex(point)).0 as usize * element;
            let value = attribute.buffer().data().get(start..start + element);
            bytes.extend_from_slice(value.ok_or_else(|| format!("{name} is cut off"))?);
            bytes.resize(bytes.len().next_multiple_of(4), 0);
        }
        let view = json!({ "byteStride": stride, "target": VERTICES });
        fill(json, buffers, accessor as usize, bytes, view, kind, mesh.num_points())?;
    }
    let corners = mesh.faces().iter().flatten();
    let bytes: Vec<u8> = corners.flat_map(|corner| corner.0.to_le_bytes()).collect();
    let indices = match primitive.get("indices").and_then(Value::as_u64) {
        Some(indices) => indices as usize,
        None => push(json, "accessors", json!({ "type": "SCALAR" })),
    };
    fill(json, buffers, indices, bytes, json!({ "target": INDICES }), UNSIGNED_INT, 3 * mesh.num_faces())?;
    json.pointer_mut(place).ok_or("its primitive does not exist")?["indices"] = indices.into();
    Ok(())
}

/// glTF component types.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// Component type and element size; `None` for types that glTF lacks.
fn layout(attribute: &PointAttribute) -> Option<(u32, usize)> {
    let kind = match attribute.data_type() {
        DataType::Int8 => 5120,
        DataType::Uint8 => 5121,
        DataType::Int16 => 5122,
        DataType::Uint16 => UNSIGNED_SHORT,
        DataType::Uint32 => UNSIGNED_INT,
        DataType::Float32 => FLOAT,
        _ => return None,
    };
    Some((kind, attribute.data_type().byte_length() * usize::from(attribute.num_components())))
}

/// Makes an accessor refer to `bytes`. `count`: number of elements of the accessor.
fn fill(
    json: &mut Value,
    buffers: &mut Buffers,
    accessor: usize,
    bytes: Vec<u8>,
    mut view: Value,
    component_type: u32,
    count: usize,
) -> Result<(), String> {
    view["byteLength"] = bytes.len().into();
    view["buffer"] = push_buffer(json, buffers, bytes).into();
    let view = push(json, "bufferViews", view);
    let accessor: &mut Map<String, Value> = json["accessors"]
        .get_mut(accessor)
        .and_then(Value::as_object_mut)
        .ok_or_else(|| format!("accessor {accessor} does not exist"))?;
    accessor.shift_remove("byteOffset");
    accessor.insert("bufferView".into(), view.into());
    accessor.insert("componentType".into(), component_type.into());
    accessor.insert("count".into(), count.into());
    Ok(())
}
