//! Damaged glTF files: reading each of them returns an error that names the cause and the location.

use cagework_io::{GltfError, Model, ReadError};
use serde_json::json;

use crate::common::{Builder, F32, U32, floats, glb, plain_cube, read, skinned};

fn fault(bytes: &[u8]) -> String {
    read("x.glb", bytes).unwrap_err().to_string()
}

/// Error of reading the cube after `change`.
fn fault_of(change: impl FnOnce(&mut Builder)) -> String {
    let mut b = plain_cube();
    change(&mut b);
    fault(&b.glb())
}

#[test]
fn every_truncation_is_an_error() {
    let bytes = plain_cube().glb();
    for length in 0..bytes.len() {
        assert!(read("x.glb", &bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
    }
}

#[test]
fn damaged_headers_are_errors() {
    let good = plain_cube().glb();
    let with = |at: usize, word: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        bytes
    };
    assert!(fault(&with(0, 0)).contains("not a GLB"));
    assert!(fault(&with(4, 1)).contains("version 1"));
    assert!(fault(&with(8, 3)).contains("its header declares 3 bytes"));
    let half = &plain_cube().glb()[..400];
    let all = u32::from_le_bytes(half[8..12].try_into().expect("four bytes"));
    assert!(fault(half).contains(&format!("it is cut off: it has 400 of {all} bytes. Export")));
    assert!(fault(&with(8, 236_008)).contains(&format!("cut off: it has {} of 236 kB", good.len() / 1000)));
    assert!(fault(&with(8, u32::MAX)).contains("cut off: it has 0 of 4294 MB"));
    assert!(fault(&with(12, u32::MAX)).contains("not a readable GLB"));
    assert!(fault(&with(16, 0)).contains("not a readable GLB"));
    assert!(fault(&with(12, u32::MAX)).contains("a chunk extends beyond the end of the file"));
    assert!(fault(&with(16, 0)).contains("its first chunk must be JSON"));
    assert!(
        fault(b"{\"asset\": {\n \"version\"")
            .contains("the JSON ends too early: the file is cut off, at line 2")
    );
    assert!(fault(b"{\"asset\" {}}").contains("the JSON is damaged, at line 1, column 10"));
    let of_type = fault_of(|b| b.json["bufferViews"][1]["byteLength"] = "long".into());
    assert!(
        of_type.contains("item 1 of 'bufferViews' has a missing value or a value of the wrong type"),
        "{of_type}"
    );
    // Some writers pad the JSON chunk with zeros.
    let mut padded = good.clone();
    let end = 20 + padded[12] as usize + 256 * padded[13] as usize;
    padded.splice(end..end, [0; 4]);
    let length = padded.len() as u32;
    padded[8..12].copy_from_slice(&length.to_le_bytes());
    let length = (end - 20 + 4) as u32;
    padded[12..16].copy_from_slice(&length.to_le_bytes());
    assert_eq!(read("x.glb", &padded).unwrap().positions, read("x.glb", &good).unwrap().positions);
    assert!(fault(&glb(&json!([1, 2]), None)).contains("wrong type"));
    assert!(fault(&glb(&json!({ "asset": { "version": "1.0" } }), None)).contains("1.0"));
}

#[test]
fn indices_out_of_range_are_errors() {
    for (message, expected) in [
        (fault_of(|b| b.json["nodes"][0]["mesh"] = 5.into()), "node 0 refers to mesh 5, but there are 1"),
        (fault_of(|b| b.json["nodes"][0]["children"] = json!([9])), "node 0 refers to child node 9"),
        (fault_of(|b| b.json["scene"] = 3.into()), "refers to scene 3, but there are 1"),
        (fault_of(|b| b.json["scenes"][0]["nodes"] = json!([4])), "scene 0 refers to node 4"),
        (fault_of(|b| b.json["nodes"][0]["skin"] = 0.into()), "node 0 refers to skin 0, but there are 0"),
        (
            fault_of(|b| b.primitive(0)["attributes"]["POSITION"] = 77.into()),
            "refers to accessor 77, but there are 2",
        ),
        (fault_of(|b| b.primitive(0)["indices"] = 77.into()), "refers to accessor 77"),
        (fault_of(|b| b.json["accessors"][0]["bufferView"] = 9.into()), "accessor 0 refers to buffer view 9"),
        (fault_of(|b| b.json["bufferViews"][0]["buffer"] = 9.into()), "buffer view 0 refers to buffer 9"),
        (
            fault_of(|b| {
                let indices = b.indices(&[0, 1, 8]);
                b.primitive(0)["indices"] = indices.into();
            }),
            "accessor 2: a triangle refers to vertex 8, but there are 8",
        ),
    ] {
        assert!(message.contains(expected), "{message} should contain {expected}");
    }
    let mut b = skinned();
    b.json["skins"][0]["joints"] = json!([1]);
    assert!(fault(&b.glb()).contains("skin 0 refers to joint 1, but there are 1"));
    b.json["skins"][0]["joints"] = json!([1, 99]);
    assert!(fault(&b.glb()).contains("skin 0 refers to joint node 99"));
}

#[test]
fn accessors_that_do_not_fit_are_errors() {
    for (message, expected) in [
        (fault_of(|b| b.json["accessors"][0]["count"] = 9.into()), "accessor 0 has 9 elements"),
        (
            fault_of(|b| b.json["accessors"][0]["count"] = json!(1_u64 << 40)),
            "more than the limit of 16777216",
        ),
        (fault_of(|b| b.json["accessors"][0]["byteOffset"] = json!(u64::MAX)), "accessor 0 has 8 elements"),
        (
            fault_of(|b| b.json["bufferViews"][0]["byteStride"] = json!(1_u64 << 62)),
            "accessor 0 has 8 elements",
        ),
        (
            fault_of(|b| b.json["bufferViews"][0]["byteStride"] = 4.into()),
            "accessor 0 has elements of 12 bytes every 4 bytes, so they overlap: export it again",
        ),
        (fault_of(|b| b.json["bufferViews"][0]["byteLength"] = 10_000.into()), "extends beyond its buffer"),
        (fault_of(|b| b.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX)), "extends beyond its buffer"),
        (
            fault_of(|b| b.json["accessors"][0]["type"] = "VEC2".into()),
            "has type vec2, but position needs vec3",
        ),
        (fault_of(|b| b.json["accessors"][0]["componentType"] = 1.into()), "unknown component type"),
        (fault_of(|b| b.json["accessors"][1]["componentType"] = 5126.into()), "must have unsigned integers"),
    ] {
        assert!(message.contains(expected), "{message} should contain {expected}");
    }
    let message = fault_of(|b| {
        let (places, values) = (b.view(&[8]), b.view(&floats(&[0.0; 3])));
        b.json["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": { "bufferView": places, "componentType": 5121 },
            "values": { "bufferView": values },
        });
    });
    assert!(message.contains("sparse value for element 8"), "{message}");
}

/// Attributes with another count than the vertices are rejected before they are decoded: in a file of 18 kB, a thousand
/// of them can have a million implicit zeros each.
#[test]
fn attribute_counts_must_match_the_vertices() {
    let zeros = |b: &mut Builder, kind: &str| {
        b.push("accessors", json!({ "componentType": F32, "count": 1 << 20, "type": kind }))
    };
    for (name, kind) in
        [("NORMAL", "VEC3"), ("TANGENT", "VEC4"), ("TEXCOORD_0", "VEC2"), ("WEIGHTS_0", "VEC4")]
    {
        let message = fault_of(|b| {
            let many = zeros(b, kind);
            b.primitive(0)["attributes"][name] = many.into();
        });
        let expected = format!("accessor 2 has 1048576 elements for {name}, but there are 8 vertices");
        assert!(message.contains(&expected), "{message}");
    }
    let message = fault_of(|b| {
        let many = zeros(b, "VEC3");
        b.primitive(0)["targets"] = json!(vec![json!({ "POSITION": many }); 1000]);
    });
    assert!(
        message.contains("1048576 elements for POSITION of morph target 0, but there are 8"),
        "{message}"
    );
    let message = fault_of(|b| {
        b.json["accessors"][0] = json!({ "componentType": F32, "count": 1 << 24, "type": "VEC3" });
    });
    assert!(message.contains("accessor 0 has 16777216 elements without data in the file"), "{message}");
    let mut b = skinned();
    let many = zeros(&mut b, "MAT4");
    b.json["skins"][0]["inverseBindMatrices"] = many.into();
    assert!(fault(&b.glb()).contains("1048576 elements for inverse bind matrices, but there are 2 joints"));
}

/// The memory check covers all primitives of a mesh at all nodes that show it, and precedes allocation.
#[test]
fn memory_is_checked_before_allocation() {
    let mut b = plain_cube();
    let nodes = 60_000;
    b.json["nodes"] = vec![json!({ "mesh": 0 }); nodes].into();
    b.json["scenes"][0]["nodes"] = (0..nodes).collect::<Vec<_>>().into();
    let within = |b: &Builder, limit| Model::read_within("x.glb", b.glb(), &mut |_| None, limit);
    let message = within(&b, 64 << 20).unwrap_err().to_string();
    assert!(message.contains("MiB of memory, more than the limit of 64 MiB"), "{message}");
    // The base64 is damaged, so decoding would give another error: memory is checked before decoding.
    let mut embedded = plain_cube().json;
    embedded["buffers"] =
        json!([{ "byteLength": 72, "uri": format!("data:;base64,{}", "!".repeat(4 << 20)) }]);
    let text = serde_json::to_vec(&embedded).unwrap();
    let message = Model::read_within("x.gltf", &text, &mut |_| None, 14 << 20).unwrap_err().to_string();
    assert!(message.contains("needs about 16 MiB of memory"), "{message}");
    // The mesh has a thousand primitives and is shown by 60,000 nodes.
    let primitive = b.primitive(0).clone();
    b.json["meshes"][0]["primitives"] = vec![primitive; 1000].into();
    let message = within(&b, u64::MAX).unwrap_err().to_string();
    assert!(message.contains("vertices: 480000000, more than the limit of 16777216"), "{message}");
    for list in ["nodes", "materials"] {
        b.json[list] = vec![json!({}); 1 << 19].into();
        let message = fault(&b.glb());
        assert!(message.contains(&format!("{list}: 524288, more than the limit of 262144")), "{message}");
        b.json[list] = json!([]);
    }
    let message = fault_of(|b| {
        let zeros = json!({ "componentType": U32, "count": 1 << 20, "type": "SCALAR" });
        let zeros = b.push("accessors", zeros);
        let primitive = b.primitive(0);
        primitive["indices"] = zeros.into();
        let primitives = vec![primitive.clone(); 100];
        b.json["meshes"][0]["primitives"] = primitives.into();
    });
    assert!(message.contains("triangles: 34952500, more than the limit of 33554432"), "{message}");
}

#[test]
fn joints_clips_and_channels_are_limited() {
    let channel = json!({ "sampler": 0, "target": { "node": 0, "path": "translation" } });
    let clip = |n: usize| json!({ "samplers": [{ "input": 0, "output": 0 }], "channels": vec![&channel; n] });
    for (list, items, expected) in [
        ("skins", json!(vec![json!({ "joints": vec![0; 1000] }); 263]), "joints of all skins: 263000"),
        ("animations", json!(vec![clip(1); 4_097]), "clips: 4097, more than the limit of 4096"),
        ("animations", json!([clip(131_073)]), "channels of all clips: 131073"),
    ] {
        let found = fault_of(|b| b.json[list] = items);
        assert!(found.contains(expected), "{expected}: {found}");
    }
}

#[test]
fn nodes_with_cycles_or_two_parents_are_errors() {
    let nodes = |nodes| fault_of(move |b| b.json["nodes"] = nodes);
    let cycle = json!([{ "mesh": 0 }, { "children": [2] }, { "children": [1] }]);
    assert!(nodes(cycle).contains("node 1 is its own ancestor"));
    let own = json!([{ "mesh": 0, "children": [0] }]);
    assert!(nodes(own).contains("is its own ancestor"));
    let shared = json!([{ "mesh": 0, "children": [2] }, { "children": [2] }, {}]);
    assert!(nodes(shared).contains("node 2 has two parents"));
}

#[test]
fn deep_trees_need_no_stack() {
    let depth = 60_000;
    let mut b = plain_cube();
    let mut nodes: Vec<_> = (1..depth).map(|i| json!({ "children": [i] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    b.json["nodes"] = nodes.clone().into();
    assert_eq!(read("x.glb", &b.glb()).unwrap().positions.len(), 8);
    // Reading takes linear time: walking from each node to the root would take half a minute.
    for node in &mut nodes {
        node["mesh"] = 0.into();
    }
    b.json["nodes"] = nodes.into();
    assert_eq!(read("x.glb", &b.glb()).unwrap().positions.len(), 8 * depth);
}

#[test]
fn non_finite_numbers_are_errors() {
    let message = fault_of(|b| {
        let position = b.vec3(&[[0.0; 3], [0.0, f32::NAN, 0.0], [1.0; 3]]);
        b.json["accessors"][position].as_object_mut().unwrap().remove("min");
        *b.primitive(0) = json!({ "attributes": { "POSITION": position } });
    });
    assert!(message.contains("accessor 2: the position of vertex 1 is not finite"), "{message}");
    let message = fault_of(|b| b.json["nodes"][0]["scale"] = json!([1e39, 1.0, 1.0]));
    assert!(message.contains("not finite"), "{message}");
    let far =
        json!([{ "scale": [1e38, 1.0, 1.0], "children": [1] }, { "scale": [10.0, 1.0, 1.0], "mesh": 0 }]);
    let message = fault_of(|b| b.json["nodes"] = far);
    assert!(message.contains("accessor 0: the position of vertex 1"), "{message}");
}

#[test]
fn error_of_compressed_geometry_gives_the_conversion_command() {
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let in_view = |b: &mut Builder| b.json["bufferViews"][0]["extensions"] = json!({ extension: {} });
        assert_convertible(&fault_of(in_view), extension);
    }
    let extension = "KHR_draco_mesh_compression";
    let packed = json!({ extension: { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    assert_convertible(&fault_of(|b| b.primitive(0)["extensions"] = packed), extension);
}

fn assert_convertible(message: &str, extension: &str) {
    assert!(message.contains(&format!("compressed ({extension}), and could not be decoded: ")), "{message}");
    assert!(message.contains("npx @gltf-transform/cli copy x.glb x-plain.glb"), "{message}");
}

#[test]
fn missing_buffer_file_is_an_error() {
    let mut b = plain_cube();
    b.json["buffers"] = json!([{ "byteLength": 100, "uri": "far%20away.bin" }]);
    let text = serde_json::to_vec(&b.json).unwrap();
    let error = read("x.gltf", &text).unwrap_err();
    let expected = GltfError::MissingFile { uri: "far away.bin".into(), problem: "is missing".into() };
    assert_eq!(error, ReadError::Gltf { name: "x.gltf".into(), source: expected });
    let short = Model::read("x.gltf", &text, &mut |_| Some(Ok(vec![0; 10]))).unwrap_err().to_string();
    assert!(short.contains("buffer 0 is cut off: it has 10 of 100 bytes"), "{short}");
}

/// Found by fuzzing: the list of scenes can be empty.
#[test]
fn empty_lists_are_treated_as_missing() {
    let mut b = skinned();
    b.json["scenes"] = json!([]);
    let model = read("x.glb", &b.glb()).unwrap();
    let again = read("y.glb", &model.write_glb(&model.positions).unwrap()).unwrap();
    assert_eq!(again.positions, model.positions);
    assert!(fault_of(|b| b.json["nodes"] = json!([])).contains("scene 0 refers to node 0, but there are 0"));
}

/// In a small file, many nodes can show one mesh. The limits count once per node the mesh's elements without data, its
/// splats, and the texts that an export repeats. They also count once per channel the values of a sampler that several
/// channels share.
#[test]
fn what_nodes_repeat_is_in_the_price() {
    let document = |nodes: usize, mesh: &serde_json::Value| {
        let zeros = |kind: &str| json!({ "componentType": 5126, "count": 1 << 20, "type": kind });
        let accessors = json!([
            zeros("VEC3"), zeros("VEC4"), zeros("SCALAR"),
            { "componentType": 5126, "count": 3, "type": "VEC3" },
        ]);
        let json = json!({
            "asset": { "version": "2.0" },
            "scenes": [{ "nodes": (0..nodes).collect::<Vec<_>>() }],
            "nodes": vec![json!({ "mesh": 0 }); nodes],
            "meshes": [mesh],
            "accessors": accessors,
        });
        glb(&json, None)
    };
    let mesh = |primitive: serde_json::Value| json!({ "primitives": [primitive] });
    let found = fault(&document(3, &mesh(json!({ "attributes": { "POSITION": 0 } }))));
    let all = "elements without data in the file, of all nodes: 3145728, more than the limit of 2097152";
    assert!(found.contains(all), "{found}");
    let splats = mesh(json!({
        "mode": 0,
        "extensions": { "KHR_gaussian_splatting": {} },
        "attributes": {
            "POSITION": 0,
            "KHR_gaussian_splatting:SCALE": 0,
            "KHR_gaussian_splatting:ROTATION": 1,
            "KHR_gaussian_splatting:OPACITY": 2,
            "KHR_gaussian_splatting:SH_DEGREE_0_COEF_0": 0,
        },
    }));
    let found = fault(&document(3, &splats));
    assert!(found.contains("splats of all nodes: 3145728, more than the limit of 1048576"), "{found}");
    let splat =
        json!({ "mode": 0, "extensions": { "KHR_gaussian_splatting": {} }, "attributes": { "POSITION": 3 } });
    let found = fault(&document(17, &json!({ "primitives": vec![splat; 1 << 12] })));
    assert!(found.contains("primitives of all nodes: 69632, more than the limit of 65536"), "{found}");
    // 40 channels with the same 2^20 times and vectors.
    let mut played = plain_cube();
    let zeros = |kind: &str| json!({ "componentType": F32, "count": 1 << 20, "type": kind });
    let [input, output] = [zeros("SCALAR"), zeros("VEC3")].map(|accessor| played.push("accessors", accessor));
    let channel = json!({ "sampler": 0, "target": { "node": 0, "path": "translation" } });
    let samplers = json!([{ "input": input, "output": output }]);
    played.push("animations", json!({ "samplers": samplers, "channels": vec![channel; 40] }));
    let found = fault(&played.glb());
    assert!(
        found.contains("values of all channels of clips: 167772160, more than the limit of 134217728"),
        "{found}"
    );
    let long = "n".repeat(1 << 20);
    for (key, value) in [("name", json!(long)), ("extras", json!({ "targetNames": [long] }))] {
        let mut named = mesh(json!({ "attributes": { "POSITION": 3 } }));
        named[key] = value;
        let found = Model::read_within("x.glb", document(50, &named), &mut |_| None, 1 << 26);
        let found = found.unwrap_err().to_string();
        assert!(found.contains("MiB of memory, more than the limit of 64 MiB"), "{key}: {found}");
    }
    // Exports repeat the names of the targets for each node: 1.2 GB for 60 names of 20,000 characters and 1000 nodes.
    let mut named = mesh(json!({ "attributes": { "POSITION": 3 } }));
    named["extras"] = json!({ "targetNames": vec!["n".repeat(20_000); 60] });
    let found = fault(&document(1000, &named));
    assert!(found.contains("bytes of text that every node of a mesh repeats: 24"), "{found}");
}

#[test]
fn json_of_too_many_values_is_refused_before_it_is_read() {
    let extras = "0,".repeat(1 << 22);
    let found = read("x.gltf", format!(r#"{{"asset":{{"version":"2.0"}},"extras":[{extras}0]}}"#).as_bytes());
    let found = found.unwrap_err().to_string();
    // One separator for each item of the array, and seven others.
    assert!(found.contains("values in the JSON: 4194311, more than the limit of 4194304"), "{found}");
}

#[test]
fn lines_alone_are_refused() {
    let mut b = plain_cube();
    b.primitive(0)["mode"] = json!(1);
    let message = read("x.glb", &b.glb()).unwrap_err().to_string();
    assert!(message.ends_with("it has no triangles or points (lines are not surfaces)"), "{message}");
}
