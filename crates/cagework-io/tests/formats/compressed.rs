//! glTF files compressed with Draco or meshopt.

use cagework_io::{Model, ReshapeOptions};
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute, PointIndex,
};
use glam::{DVec3, Vec3};
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    IndexEncoding, VertexEncoding, encode_filter_color, encode_index_buffer, encode_vertex_buffer,
};
use serde_json::json;

use crate::common::{self, Builder, CUBE, CUBE_TRIANGLES, json_of, plain_cube, read, volume};

const DRACO: &str = "KHR_draco_mesh_compression";

fn floats() -> Vec<u8> {
    CUBE.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
}

fn cube_mesh() -> Mesh {
    let mut positions = PointAttribute::new();
    positions.init(GeometryAttributeType::Position, 3, DataType::Float32, false, CUBE.len());
    positions.buffer_mut().write(0, &floats());
    let mut mesh = Mesh::new();
    mesh.set_num_points(CUBE.len());
    mesh.add_attribute(positions);
    mesh.set_num_faces(CUBE_TRIANGLES.len());
    for (f, t) in (0..).zip(CUBE_TRIANGLES) {
        mesh.set_face(FaceIndex(f), t.map(PointIndex));
    }
    mesh
}

/// The cube as a Draco stream.
pub(crate) fn draco_stream() -> Vec<u8> {
    stream_of(cube_mesh())
}

fn stream_of(mesh: Mesh) -> Vec<u8> {
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut out = EncoderBuffer::new();
    encoder.encode(&EncoderOptions::new(), &mut out).unwrap();
    out.data().to_vec()
}

/// The cube with its geometry in a Draco stream; its accessors have no buffer views.
pub(crate) fn draco(stream: &[u8]) -> Builder {
    let mut b = plain_cube();
    let view = b.view(stream);
    for accessor in b.json["accessors"].as_array_mut().unwrap() {
        accessor.as_object_mut().unwrap().remove("bufferView");
    }
    b.primitive(0)["extensions"] = json!({ DRACO: { "bufferView": view, "attributes": { "POSITION": 0 } } });
    b.json["extensionsUsed"] = json!([DRACO]);
    b.json["extensionsRequired"] = json!([DRACO]);
    b
}

/// The cube as two meshopt streams. Its buffer views refer to a second buffer without bytes.
fn meshopt(extension: &str, version: u8) -> Builder {
    let mut b = plain_cube();
    let workspace = &mut Workspace::default();
    let encoding = VertexEncoding::new(version, 0).unwrap();
    let vertices = encode_vertex_buffer(&floats(), CUBE.len(), 12, encoding, workspace).unwrap();
    let corners: Vec<u32> = CUBE_TRIANGLES.as_flattened().to_vec();
    let indices = encode_index_buffer(&corners, IndexEncoding::DEFAULT, workspace).unwrap();
    for (key, stream, mode, count, stride) in [
        ("attributes", vertices, "ATTRIBUTES", CUBE.len(), 12),
        ("indices", indices, "TRIANGLES", corners.len(), 4),
    ] {
        let packed = b.view(&stream);
        let mut packed = b.json["bufferViews"][packed].clone();
        (packed["mode"], packed["count"], packed["byteStride"]) = (mode.into(), count.into(), stride.into());
        let accessor = &b.primitive(0)[key];
        let accessor = accessor.get("POSITION").unwrap_or(accessor).as_u64().unwrap() as usize;
        if key == "indices" {
            b.json["accessors"][accessor]["componentType"] = json!(5125);
        }
        let view = b.json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
        b.json["bufferViews"][view] = json!({
            "buffer": 1, "byteLength": count * stride, "extensions": { extension: packed }
        });
    }
    b.json["extensionsUsed"] = json!([extension]);
    b
}

/// The vertex codec of version 1, and the filter COLOR, which stores luma, chroma and opacity.
#[test]
fn version_1_of_the_vertex_codec_and_the_filter_of_colours_are_read() {
    const KHR: &str = "KHR_meshopt_compression";
    let workspace = &mut Workspace::default();
    let colors: [[f32; 4]; 8] = std::array::from_fn(|v| {
        [0.0, 1.0, 2.0, 3.0]
            .map(|c| if c == 3.0 { 1.0 } else { ((v as f32 * 3.0 + c) / 24.0 * 255.0).round() / 255.0 })
    });
    for (version, filter) in [(0, None), (1, None), (0, Some("COLOR")), (1, Some("COLOR"))] {
        let mut b = meshopt(KHR, version);
        if filter.is_some() {
            let filtered = encode_filter_color(CUBE.len(), 4, 8, colors.as_flattened(), workspace).unwrap();
            let encoding = VertexEncoding::new(version, 0).unwrap();
            let stream = encode_vertex_buffer(&filtered, CUBE.len(), 4, encoding, workspace).unwrap();
            let packed = b.view(&stream);
            let mut packed = b.json["bufferViews"][packed].clone();
            (packed["mode"], packed["count"], packed["byteStride"]) =
                ("ATTRIBUTES".into(), CUBE.len().into(), 4.into());
            packed["filter"] = json!(filter);
            let view = b.push(
                "bufferViews",
                json!({ "buffer": 1, "byteLength": 32, "byteStride": 4, "extensions": { KHR: packed } }),
            );
            let accessor = b.push(
                "accessors",
                json!({ "bufferView": view, "componentType": 5121, "normalized": true, "count": 8, "type": "VEC4" }),
            );
            b.primitive(0)["attributes"]["COLOR_0"] = accessor.into();
        }
        let model = read("x.glb", &with_fallback(&b)).unwrap();
        assert_eq!(model.positions, CUBE.map(Vec3::from), "version {version}, {filter:?}");
        assert_eq!(model.triangles.len(), CUBE_TRIANGLES.len());
        if filter.is_some() {
            let found = model.look().vertices;
            for (vertex, expected) in found.iter().zip(colors) {
                // Luma and two chroma values are rounded to bytes.
                let off = (0..4).map(|c| (expected[c] - vertex.color[c]).abs());
                assert!(off.fold(0.0, f32::max) < 0.02, "{:?} instead of {expected:?}", vertex.color);
            }
        }
    }
}

/// A GLB with a missing fallback buffer for programs without a decoder.
fn with_fallback(b: &Builder) -> Vec<u8> {
    let mut json = b.json.clone();
    json["buffers"] = json!([{ "byteLength": b.bin.len() }, { "byteLength": 1000, "uri": "fallback.bin" }]);
    common::glb(&json, Some(&b.bin))
}

/// An unmoved export equals the input; a moved export is not compressed.
fn assert_plain(model: &Model, bytes: &[u8]) {
    assert!(model.write_glb(&model.positions).unwrap() == bytes);
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| p + Vec3::X).collect();
    let written = model.write_glb(&moved).unwrap();
    assert!(!json_of(&written).to_string().contains("compression"));
    assert_eq!(read("y.glb", &written).unwrap().positions, moved);
}

#[test]
fn draco_is_decoded_and_written_plain() {
    let bytes = draco(&draco_stream()).glb();
    let model = read("x.glb", &bytes).unwrap();
    // Draco reorders vertices, so compare sorted positions. They are equal, because the stream is not quantised.
    let sorted = |mut positions: Vec<Vec3>| {
        positions.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
        positions
    };
    assert_eq!(sorted(model.positions.clone()), sorted(CUBE.map(Vec3::from).to_vec()));
    assert_eq!(model.triangles.len(), CUBE_TRIANGLES.len());
    let plain = read("x.glb", &plain_cube().glb()).unwrap();
    assert!((volume(&model) - volume(&plain)).abs() < 1e-6);
    assert_plain(&model, &bytes);
}

/// Encoders quantise and reorder vertices, so the document's bounds do not match the decoded values.
#[test]
fn bounds_and_weights_match_the_decoded_values() {
    let mut weights = [[0.5_f32, 0.49, 0.0, 0.0]; 8];
    weights[3] = [1.0, 0.0, 0.0, 0.0];
    let weights: Vec<u8> = weights.as_flattened().iter().flat_map(|w| w.to_le_bytes()).collect();
    let joints = [[0_u8, 1, 1, 0]; 8];
    let mut mesh = cube_mesh();
    for (bytes, kind) in [(joints.as_flattened(), DataType::Uint8), (&weights, DataType::Float32)] {
        let mut attribute = PointAttribute::new();
        attribute.init(GeometryAttributeType::Generic, 4, kind, false, CUBE.len());
        attribute.buffer_mut().write(0, bytes);
        mesh.add_attribute(attribute);
    }
    let mut b = draco(&stream_of(mesh));
    for (name, component, id) in [("JOINTS_0", common::U8, 1), ("WEIGHTS_0", common::F32, 2)] {
        let accessor = json!({ "componentType": component, "count": 8, "type": "VEC4", "min": [9, 9, 9, 9] });
        let accessor = b.push("accessors", accessor);
        b.primitive(0)["attributes"][name] = accessor.into();
        b.primitive(0)["extensions"][DRACO]["attributes"][name] = id.into();
    }
    for (accessor, bounds) in [(0, json!([-1.0, -1.0, -1.0])), (1, json!([99]))] {
        (b.json["accessors"][accessor]["min"], b.json["accessors"][accessor]["max"]) =
            (bounds.clone(), bounds);
    }
    b.json["nodes"][0]["skin"] = 0.into();
    let joint = b.push("nodes", json!({ "children": [2] }));
    b.push("nodes", json!({}));
    b.push("skins", json!({ "joints": [joint, joint + 1] }));
    b.json["scenes"][0]["nodes"] = json!([0, joint]);
    let bytes = b.glb();
    let model = read("x.glb", &bytes).unwrap();
    let n = model.positions.len() + model.extra_points().unwrap().len();
    let reshaped = |by| model.write_reshaped(&vec![by; n], &[], &[], &ReshapeOptions::default()).unwrap().0;
    assert!(reshaped(DVec3::ZERO) == bytes, "unmoved");
    let written = reshaped(DVec3::X);
    let json = json_of(&written);
    let start = 28 + u32::from_le_bytes(written[12..16].try_into().unwrap()) as usize;
    let primitive = &json["meshes"][0]["primitives"][0];
    let accessor = |number: &serde_json::Value| &json["accessors"][number.as_u64().unwrap() as usize];
    let data = |number: &serde_json::Value| {
        let view = &json["bufferViews"][accessor(number)["bufferView"].as_u64().unwrap() as usize];
        let [from, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        written[start + from..][..length].to_vec()
    };
    let names = ["POSITION", "JOINTS_0", "WEIGHTS_0"].map(|name| &primitive["attributes"][name]);
    for number in [names[1], names[2], &primitive["indices"]] {
        assert!(accessor(number).get("min").is_none(), "{}", accessor(number));
    }
    let weights = data(names[2]);
    let weights: Vec<f32> = weights.as_chunks().0.iter().map(|&w| f32::from_le_bytes(w)).collect();
    for (weights, joints) in weights.chunks(4).zip(data(names[1]).chunks(8)) {
        assert!((weights.iter().sum::<f32>() - 1.0).abs() <= f32::EPSILON, "{weights:?}");
        // Each joint index takes two bytes.
        let is_free = |k: usize| weights[k] > 0.0 || joints[2 * k] == 0;
        assert!((0..4).all(is_free), "{weights:?} of {joints:?}");
    }
    let decoded = read("x.glb", &written).unwrap();
    assert_eq!(decoded.positions.iter().copied().reduce(Vec3::min), Some(Vec3::X));
    assert_eq!(accessor(names[0])["max"], json!([2.0, 1.0, 1.0]));
    assert!(!json.to_string().contains(DRACO) && json["buffers"].as_array().unwrap().len() == 1);
}

#[test]
fn meshopt_is_decoded_by_both_names_without_its_fallback() {
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let bytes = with_fallback(&meshopt(extension, 0));
        let model = read("x.glb", &bytes).unwrap();
        let plain = read("x.glb", &plain_cube().glb()).unwrap();
        assert_eq!(model.positions, plain.positions);
        assert!((volume(&model) - volume(&plain)).abs() < 1e-6);
        assert_plain(&model, &bytes);
    }
}

#[test]
fn damaged_streams_are_errors() {
    let stream = draco_stream();
    for length in 0..stream.len() {
        assert!(
            read("x.glb", &draco(&stream[..length]).glb()).is_err(),
            "{length} of {} bytes",
            stream.len()
        );
    }
    // Flipped bits cause an error or another shape, never a panic.
    for at in 0..stream.len() {
        for bit in 0..8 {
            let mut wrong = stream.clone();
            wrong[at] ^= 1 << bit;
            let _ = read("x.glb", &draco(&wrong).glb());
        }
    }
    let mut b = meshopt("EXT_meshopt_compression", 0);
    for view in b.json["bufferViews"].as_array_mut().unwrap() {
        if view.get("extensions").is_some() {
            view["extensions"]["EXT_meshopt_compression"]["count"] = json!(u64::MAX);
        }
    }
    let message = read("x.glb", &with_fallback(&b)).unwrap_err().to_string();
    assert!(message.contains("could not be decoded"), "{message}");
    // The message does not quote the decoder's error.
    let message = read("x.glb", &draco(&stream[..stream.len() / 2]).glb()).unwrap_err().to_string();
    assert!(
        message.contains("could not be decoded: its stream is damaged or has an unsupported version"),
        "{message}"
    );
}

/// The humanoid sample, with skin and clip.
/// The decoded bytes of a stream are in memory once, also if several primitives use it.
#[test]
fn a_draco_stream_of_many_primitives_is_decoded_once() {
    const POINTS: usize = 10_000;
    let places: Vec<u8> =
        (0..POINTS).flat_map(|v| [v as f32, (v % 2) as f32, 0.0]).flat_map(f32::to_le_bytes).collect();
    let mut positions = PointAttribute::new();
    positions.init(GeometryAttributeType::Position, 3, DataType::Float32, false, POINTS);
    positions.buffer_mut().write(0, &places);
    let mut mesh = Mesh::new();
    mesh.set_num_points(POINTS);
    mesh.add_attribute(positions);
    mesh.set_num_faces(POINTS - 2);
    for f in 0..POINTS as u32 - 2 {
        mesh.set_face(FaceIndex(f), [f, f + 1, f + 2].map(PointIndex));
    }
    let mut b = draco(&stream_of(mesh));
    let mut again = b.primitive(0).clone();
    // The other primitives use only the triangles of the stream, 120 kB each.
    again["attributes"] = json!({});
    again["extensions"][DRACO]["attributes"] = json!({});
    again.as_object_mut().unwrap().remove("indices");
    let primitives = b.json["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives.extend(vec![again; 200]);
    let model = Model::read_within("x.glb", b.glb(), &mut |_| None, 8 << 20).unwrap();
    assert_eq!(model.triangles.len(), POINTS - 2);
}

/// The size of a stream is checked against the memory limit before the stream is decoded.
#[test]
fn streams_are_priced_before_they_are_decoded() {
    let mut b = meshopt("EXT_meshopt_compression", 0);
    for view in b.json["bufferViews"].as_array_mut().unwrap() {
        if let Some(packed) = view.get_mut("extensions") {
            packed["EXT_meshopt_compression"]["count"] = json!(1 << 20);
        }
    }
    let found = Model::read_within("x.glb", with_fallback(&b), &mut |_| None, 8 << 20).unwrap_err();
    let message = found.to_string();
    assert!(message.contains("needs about 13 MiB of memory, more than the limit of 8 MiB"), "{message}");
}

/// Bounds and weights are corrected for each accessor, and any number of accessors can share a stream.
#[test]
fn corrections_of_decoded_values_are_limited() {
    let limit = "more than the limit of 268435456";
    let mut b = meshopt("EXT_meshopt_compression", 0);
    let bounded = b.json["accessors"][0].clone();
    let unused = json!({
        "bufferView": bounded["bufferView"], "componentType": 5126, "count": 1 << 20, "type": "VEC3", "min": [0],
    });
    for _ in 0..100 {
        b.push("accessors", unused.clone());
    }
    let message = read("x.glb", &with_fallback(&b)).unwrap_err().to_string();
    assert!(message.contains(&format!("compressed geometry: 314572824, {limit}")), "{message}");

    let mut b = meshopt("EXT_meshopt_compression", 0);
    let mut four = json!({
        "bufferView": bounded["bufferView"], "componentType": 5126, "count": 1 << 20, "type": "VEC4",
    });
    let weights = b.push("accessors", four.clone());
    four["componentType"] = json!(5121);
    for _ in 0..40 {
        let joints = b.push("accessors", four.clone());
        let rigged = json!({ "attributes": { "JOINTS_0": joints, "WEIGHTS_0": weights } });
        b.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(rigged);
    }
    let message = read("x.glb", &with_fallback(&b)).unwrap_err().to_string();
    assert!(message.contains(limit), "{message}");
}
