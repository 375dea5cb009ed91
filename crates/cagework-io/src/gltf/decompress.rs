//! Decompresses Draco and meshopt geometry into plain buffer views, before the document is interpreted.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::{Primitive, Semantic};
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

use super::GltfError;
use super::accessor::{MAX_DECODED_VALUES, MAX_ELEMENTS, Source};
use super::pack::{INDICES, VERTICES, bounds, push};
use super::root::{DRACO, MESHOPT, typed};
use crate::order::{Budget, Order, Permit, Price, Refusal, Stream};

/// If the joint weights of a vertex sum to 1 within this tolerance, they are not rescaled, because the difference comes
/// from rounding to f32.
const MAX_WEIGHT_SUM_ERROR: f64 = 1e-6;

/// Memory of four joints and weights of a vertex, bytes: while they are corrected, and as stored.
const WEIGHTS_READ_BYTES: u64 = 32;
const WEIGHTS_STORED_BYTES: u64 = 24;

type Buffers = Vec<Arc<Vec<u8>>>;

/// Why geometry cannot be decompressed.
enum Fault {
    /// What is wrong with the stream.
    Stream(String),
    /// A limit on memory or work is exceeded.
    Limit(GltfError),
}

impl From<String> for Fault {
    fn from(problem: String) -> Self {
        Self::Stream(problem)
    }
}

impl From<&str> for Fault {
    fn from(problem: &str) -> Self {
        Self::Stream(problem.to_owned())
    }
}

impl From<Refusal> for Fault {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Unpacked(problem) => Self::Stream(problem),
            other => Self::Limit(other.into()),
        }
    }
}

/// A meshopt stream, as its buffer view declares it.
struct MeshoptStream<'a> {
    source: &'a [u8],
    count: usize,
    stride: usize,
    mode: &'a str,
    filter: &'a str,
}

impl<'a> MeshoptStream<'a> {
    fn of(packed: &'a Value, buffers: &'a Buffers) -> Result<Self, Fault> {
        let number = |key: &str| packed[key].as_u64().and_then(|n| usize::try_from(n).ok()).unwrap_or(0);
        Ok(Self {
            source: bytes_of(packed, buffers).ok_or("its stream is cut off")?,
            count: number("count"),
            stride: number("byteStride"),
            mode: packed["mode"].as_str().unwrap_or_default(),
            filter: packed["filter"].as_str().unwrap_or("NONE"),
        })
    }
}

impl Order for MeshoptStream<'_> {
    fn price(&self) -> Price {
        let bytes = (self.count as u64).saturating_mul(self.stride.max(1) as u64);
        Price { unpacked: bytes, bytes, ..Price::default() }
    }
}

/// A Draco stream. Only the primitives that use it declare its size: the attributes of the stream follow its
/// connectivity, which has to be decoded first. The decoder stops at the bytes of the permit.
struct DracoStream<'a> {
    source: &'a [u8],
    /// Bytes of the accessors of all attributes and of the indices.
    bytes: u64,
}

impl<'a> DracoStream<'a> {
    /// `primitives`: JSON pointer and extension of each primitive that uses the stream of buffer view `view`.
    fn of(
        json: &Value,
        buffers: &'a Buffers,
        view: u64,
        primitives: &[(String, Value)],
    ) -> Result<Self, Fault> {
        let source = json["bufferViews"].get(view as usize).and_then(|view| bytes_of(view, buffers));
        let count = |accessor: &Value| {
            let accessor = accessor.as_u64().and_then(|number| json["accessors"].get(number as usize));
            accessor.and_then(|accessor| accessor["count"].as_u64()).unwrap_or(0)
        };
        // Every attribute takes at least 4 bytes per point, as glTF aligns them.
        let mut attributes: BTreeMap<u64, u64> = BTreeMap::new();
        let mut indices = 0;
        for (place, packed) in primitives {
            let Some(primitive) = json.pointer(place) else { continue };
            indices = count(&primitive["indices"]).max(indices);
            for (name, id) in packed["attributes"].as_object().into_iter().flatten() {
                let most = attributes.entry(id.as_u64().unwrap_or(0)).or_default();
                *most = count(&primitive["attributes"][name]).max(*most);
            }
        }
        let n = attributes.into_values().fold(indices, u64::saturating_add);
        Ok(Self { source: source.ok_or("its stream is cut off")?, bytes: n.saturating_mul(4) })
    }
}

impl Order for DracoStream<'_> {
    fn price(&self) -> Price {
        Price { unpacked: self.bytes, bytes: self.bytes, ..Price::default() }
    }
}

/// Decodes all compressed geometry, appending buffers to `buffers` and the document. Each stream is decoded once.
/// `name`: name of the file.
///
/// # Errors
/// [`GltfError::Compressed`], [`GltfError::Memory`], [`GltfError::TooLarge`].
pub(super) fn decompress(
    name: &str,
    json: &mut Value,
    buffers: &mut Buffers,
    mut budget: Budget,
) -> Result<(), GltfError> {
    let n_in_file = buffers.len();
    let fault = |extension| {
        move |fault| match fault {
            Fault::Stream(problem) => {
                GltfError::compressed(name, extension, format!("could not be decoded: {problem}"))
            }
            Fault::Limit(error) => error,
        }
    };
    for extension in MESHOPT {
        for number in 0..json["bufferViews"].as_array().map_or(0, Vec::len) {
            let Some(packed) = take(json, &format!("/bufferViews/{number}"), extension) else { continue };
            let bytes =
                MeshoptStream::of(&packed, buffers).and_then(|stream| meshopt(&budget.permit(stream)?));
            let bytes = bytes.map_err(fault(extension))?;
            let length = bytes.len();
            let buffer = push_buffer(json, buffers, bytes);
            let view = &mut json["bufferViews"][number];
            (view["buffer"], view["byteOffset"], view["byteLength"]) =
                (buffer.into(), 0.into(), length.into());
        }
    }
    // Primitives by the buffer view of their stream.
    let mut streams: BTreeMap<u64, Vec<(String, Value)>> = BTreeMap::new();
    for m in 0..json["meshes"].as_array().map_or(0, Vec::len) {
        for p in 0..json["meshes"][m]["primitives"].as_array().map_or(0, Vec::len) {
            let place = format!("/meshes/{m}/primitives/{p}");
            let Some(packed) = take(json, &place, DRACO) else { continue };
            let view = packed["bufferView"].as_u64().unwrap_or(u64::MAX);
            streams.entry(view).or_default().push((place, packed));
        }
    }
    for (view, primitives) in streams {
        draco(json, buffers, view, &primitives, &mut budget).map_err(fault(DRACO))?;
    }
    if buffers.len() > n_in_file {
        // A document that cannot be parsed is reported when it is read.
        if let Ok(root) = typed(json) {
            let permit = budget.permit(Corrections::of(&root, n_in_file))?;
            correct_bounds(json, &root, buffers, &permit);
            normalise_weights(json, &root, buffers, &permit);
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

/// Accessors of joints and of weights for each set of a vertex.
type WeightSets = Vec<(usize, usize)>;

/// The distinct sets of joint weights of all primitives that have decoded weights.
fn weight_sets(root: &Root, first: usize) -> Vec<WeightSets> {
    let decoded: HashSet<usize> = decoded(root, first).map(|(number, _)| number).collect();
    let of_primitive = |primitive: &Primitive| {
        let accessor = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(Index::value);
        let of_set = |set| Some((accessor(Semantic::Joints(set))?, accessor(Semantic::Weights(set))?));
        (0..).map_while(of_set).collect::<WeightSets>()
    };
    let all = root.meshes.iter().flat_map(|mesh| &mesh.primitives).map(of_primitive);
    let mut seen = HashSet::new();
    all.filter(|sets| sets.iter().any(|(_, weights)| decoded.contains(weights)) && seen.insert(sets.clone()))
        .collect()
}

/// What [`correct_bounds`] and [`normalise_weights`] read: any number of accessors can share the decoded bytes.
struct Corrections {
    /// Decoded accessors with bounds.
    bounded: Vec<usize>,
    weights: Vec<WeightSets>,
    /// Values of all these accessors.
    values: u64,
    /// Memory that the corrections take at most, bytes.
    bytes: u64,
}

impl Corrections {
    /// `first`: index of the first decoded buffer.
    fn of(root: &Root, first: usize) -> Self {
        let count = |number: usize| root.accessors.get(number).map_or(0, |accessor| accessor.count.0);
        let width = |accessor: &Accessor| match &accessor.type_ {
            Checked::Valid(kind) => kind.multiplicity() as u64,
            Checked::Invalid => 0,
        };
        let values_of = |accessor: &Accessor| accessor.count.0.saturating_mul(width(accessor));
        let add = |sum: u64, n: u64| sum.saturating_add(n);
        let is_bounded =
            |(_, accessor): &(usize, &Accessor)| accessor.min.is_some() || accessor.max.is_some();
        let bounded = || decoded(root, first).filter(is_bounded);
        let weights = weight_sets(root, first);
        let weighted = weights.iter().flatten().flat_map(|&(joints, weights)| [joints, weights]);
        let weighted = weighted.filter_map(|number| root.accessors.get(number)).map(values_of);
        let of_bounds = || bounded().map(|(_, accessor)| values_of(accessor));
        let largest = of_bounds().max().unwrap_or(0).saturating_mul(4);
        let vertices = |sets: &WeightSets| {
            sets.iter().map(|&(joints, weights)| count(joints).max(count(weights))).fold(0, add)
        };
        let read = weights.iter().map(vertices).max().unwrap_or(0).saturating_mul(WEIGHTS_READ_BYTES);
        let stored = weights.iter().map(vertices).fold(0, add).saturating_mul(WEIGHTS_STORED_BYTES);
        Self {
            values: of_bounds().chain(weighted).fold(0, add),
            bytes: largest.max(read).saturating_add(stored),
            bounded: bounded().map(|(number, _)| number).collect(),
            weights,
        }
    }
}

impl Order for Corrections {
    fn price(&self) -> Price {
        let what = "values of accessors that share compressed geometry";
        Price { counts: vec![(what, self.values, MAX_DECODED_VALUES)], bytes: self.bytes, unpacked: 0 }
    }
}

/// Recomputes the bounds `min` and `max`, because decoding a quantised stream does not return exactly the values that
/// they were computed from. glTF requires bounds for positions and times.
fn correct_bounds(json: &mut Value, root: &Root, buffers: &Buffers, permit: &Permit<Corrections>) {
    let mut plain = root.clone();
    plain.accessors.iter_mut().for_each(|accessor| accessor.normalized = false);
    let source = Source::new(&plain, buffers, permit);
    for &number in &permit.bounded {
        let Some(of_json) = json["accessors"][number].as_object_mut() else { continue };
        of_json.shift_remove("min");
        of_json.shift_remove("max");
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
fn normalise_weights(json: &mut Value, root: &Root, buffers: &mut Buffers, permit: &Permit<Corrections>) {
    for sets in &permit.weights {
        let source = Source::new(root, buffers, permit);
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
    let view = push_view(json, buffers, bytes, view);
    if refer(json, accessor, view, component_type, n).is_ok()
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

fn meshopt(stream: &Permit<MeshoptStream<'_>>) -> Result<Vec<u8>, Fault> {
    let MeshoptStream { source, count, stride, filter, .. } = **stream;
    let work = &mut Workspace::default();
    let mut decode = || {
        let mode = Mode::parse(stream.mode)?;
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
    decode().map_err(|_| "its stream is damaged or has an unknown mode".into())
}

/// Decodes the Draco stream in buffer view `view` into the accessors of its primitives. `primitives`: JSON pointer and
/// extension of each.
fn draco(
    json: &mut Value,
    buffers: &mut Buffers,
    view: u64,
    primitives: &[(String, Value)],
    budget: &mut Budget,
) -> Result<(), Fault> {
    let order = budget.permit(DracoStream::of(json, buffers, view, primitives)?)?;
    let most = order.bytes.saturating_add(budget.left());
    let limits = DecodeLimits::default()
        .with_max_points(MAX_ELEMENTS)
        .with_max_faces(2 * MAX_ELEMENTS)
        .with_max_decoded_bytes(most);
    let mut stream = DecoderBuffer::new(order.source).with_limits(limits);
    let mut mesh = Mesh::new();
    MeshDecoder::new().decode(&mut stream, &mut mesh).map_err(|error| match error.kind() {
        ErrorKind::LimitExceeded => Fault::from(format!(
            "it unpacks to more than {} MiB, or more than {MAX_ELEMENTS} points: save it again",
            most >> 20
        )),
        _ => "its stream is damaged or has an unsupported version".into(),
    })?;
    // glTF aligns vertex attributes to 4 bytes. All attributes count, also those that no primitive uses, because each
    // takes time to decode.
    let stride = |attribute: &PointAttribute| element_size(attribute).next_multiple_of(4);
    let strides: usize = (0..mesh.num_attributes()).map(|a| stride(mesh.attribute(a))).sum();
    let [points, faces] = [mesh.num_points(), mesh.num_faces()].map(|n| n as u64);
    let found = points.saturating_mul(strides.max(4) as u64).saturating_add(12 * faces);
    budget.permit(Stream { unpacked: found.saturating_sub(order.bytes), copies: 1 })?;

    let mut views: HashMap<u32, usize> = HashMap::new();
    let mut of_indices = None;
    for (place, packed) in primitives {
        let of_primitive = |key: &str| json.pointer(place).map(|primitive| primitive[key].clone());
        let (attributes, indices) = (of_primitive("attributes"), of_primitive("indices"));
        for (name, id) in packed["attributes"].as_object().into_iter().flatten() {
            let accessor = attributes.as_ref().and_then(|a| a[name].as_u64());
            let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
            let attribute = id.and_then(|id| Some((id, mesh.attribute_by_unique_id(id)?)));
            let (Some(accessor), Some((id, attribute))) = (accessor, attribute) else {
                return Err(format!("its stream has no attribute for {name}").into());
            };
            let kind = component_type(attribute).ok_or_else(|| format!("{name} has an unknown type"))?;
            let view = match views.get(&id) {
                Some(&view) => view,
                None => {
                    let bytes = values(&mesh, attribute).ok_or_else(|| format!("{name} is cut off"))?;
                    let view = json!({ "byteStride": stride(attribute), "target": VERTICES });
                    push_view(json, buffers, bytes, view)
                }
            };
            views.insert(id, view);
            refer(json, accessor as usize, view, kind, mesh.num_points())?;
        }
        let view = *of_indices.get_or_insert_with(|| {
            let corners = mesh.faces().iter().flatten().flat_map(|corner| corner.0.to_le_bytes());
            push_view(json, buffers, corners.collect(), json!({ "target": INDICES }))
        });
        let indices = match indices.and_then(|indices| indices.as_u64()) {
            Some(indices) => indices as usize,
            None => push(json, "accessors", json!({ "type": "SCALAR" })),
        };
        refer(json, indices, view, UNSIGNED_INT, 3 * mesh.num_faces())?;
        json.pointer_mut(place).ok_or("its primitive does not exist")?["indices"] = indices.into();
    }
    Ok(())
}

/// Bytes of an attribute's value of each point, padded to 4 bytes; `None` if the stream lacks values.
fn values(mesh: &Mesh, attribute: &PointAttribute) -> Option<Vec<u8>> {
    let element = element_size(attribute);
    let mut bytes = Vec::with_capacity(element.next_multiple_of(4) * mesh.num_points());
    for point in 0..mesh.num_points() as u32 {
        let start = attribute.mapped_index(PointIndex(point)).0 as usize * element;
        bytes.extend_from_slice(attribute.buffer().data().get(start..start + element)?);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    Some(bytes)
}

/// glTF component types.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// glTF component type; `None` for types that glTF lacks.
fn component_type(attribute: &PointAttribute) -> Option<u32> {
    Some(match attribute.data_type() {
        DataType::Int8 => 5120,
        DataType::Uint8 => 5121,
        DataType::Int16 => 5122,
        DataType::Uint16 => UNSIGNED_SHORT,
        DataType::Uint32 => UNSIGNED_INT,
        DataType::Float32 => FLOAT,
        _ => return None,
    })
}

/// Size of an attribute's value, bytes.
fn element_size(attribute: &PointAttribute) -> usize {
    attribute.data_type().byte_length() * usize::from(attribute.num_components())
}

/// Appends a buffer view of `bytes`. `view`: its other properties.
fn push_view(json: &mut Value, buffers: &mut Buffers, bytes: Vec<u8>, mut view: Value) -> usize {
    view["byteLength"] = bytes.len().into();
    view["buffer"] = push_buffer(json, buffers, bytes).into();
    push(json, "bufferViews", view)
}

/// Makes an accessor refer to buffer view `view`. `count`: number of elements of the accessor.
fn refer(
    json: &mut Value,
    accessor: usize,
    view: usize,
    component_type: u32,
    count: usize,
) -> Result<(), String> {
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
