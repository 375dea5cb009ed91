//! glTF files compressed by Draco or meshopt.

#![allow(clippy::unwrap_used, reason = "helpers of tests, outside the test functions")]

mod common;

use cagework_io::Model;
use common::{Builder, CUBE, CUBE_TRIANGLES, json_of, plain_cube, read, volume};
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute, PointIndex,
};
use glam::Vec3;
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{IndexEncoding, VertexEncoding, encode_index_buffer, encode_vertex_buffer};
use serde_json::json;

const DRACO: &str = "KHR_draco_mesh_compression";

fn floats() -> Vec<u8> {
    CUBE.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
}

/// A Draco stream of the cube.
fn draco_stream() -> Vec<u8> {
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
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut out = EncoderBuffer::new();
    encoder.encode(&EncoderOptions::new(), &mut out).unwrap();
    out.data().to_vec()
}

/// The cube with accessors that have no bytes of their own.
fn draco(stream: &[u8]) -> Builder {
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

/// The cube as two streams, for views of a second buffer that has no bytes.
fn meshopt(extension: &str) -> Builder {
    let mut b = plain_cube();
    let workspace = &mut Workspace::default();
    let encoding = VertexEncoding::new(0, 0).unwrap();
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

/// A GLB with a second buffer for programs without a decoder, whose bytes are not there.
fn with_fallback(b: &Builder) -> Vec<u8> {
    let mut json = b.json.clone();
    json["buffers"] = json!([{ "byteLength": b.bin.len() }, { "byteLength": 1000, "uri": "fallback.bin" }]);
    common::glb(&json, Some(&b.bin))
}

/// An export is a plain GLB.
fn assert_plain(model: &Model) {
    let written = model.write_glb(&model.positions).unwrap();
    assert!(!json_of(&written).to_string().contains("compression"));
    assert_eq!(read("y.glb", &written).unwrap().positions, model.positions);
}

#[test]
fn draco_is_decoded_and_written_plain() {
    let model = read("x.glb", &draco(&draco_stream()).glb()).unwrap();
    // Draco numbers vertices anew, but no quantisation was asked for.
    let sorted = |mut positions: Vec<Vec3>| {
        positions.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
        positions
    };
    assert_eq!(sorted(model.positions.clone()), sorted(CUBE.map(Vec3::from).to_vec()));
    assert_eq!(model.triangles.len(), CUBE_TRIANGLES.len());
    let plain = read("x.glb", &plain_cube().glb()).unwrap();
    assert!((volume(&model) - volume(&plain)).abs() < 1e-6);
    assert_plain(&model);
}

#[test]
fn meshopt_is_decoded_by_both_names_without_its_fallback() {
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let model = read("x.glb", &with_fallback(&meshopt(extension))).unwrap();
        let plain = read("x.glb", &plain_cube().glb()).unwrap();
        assert_eq!(model.positions, plain.positions);
        assert!((volume(&model) - volume(&plain)).abs() < 1e-6);
        assert_plain(&model);
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
    // Any byte may be wrong: that is an error or another shape, and no panic.
    for at in 0..stream.len() {
        for bit in 0..8 {
            let mut wrong = stream.clone();
            wrong[at] ^= 1 << bit;
            let _ = read("x.glb", &draco(&wrong).glb());
        }
    }
    let mut b = meshopt("EXT_meshopt_compression");
    for view in b.json["bufferViews"].as_array_mut().unwrap() {
        if view.get("extensions").is_some() {
            view["extensions"]["EXT_meshopt_compression"]["count"] = json!(u64::MAX);
        }
    }
    let message = read("x.glb", &with_fallback(&b)).unwrap_err().to_string();
    assert!(message.contains("could not be decoded"), "{message}");
}
