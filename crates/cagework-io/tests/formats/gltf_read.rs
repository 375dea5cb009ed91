//! glTF reader: all ways to store a mesh.

use cagework_io::{Model, ModelFormat, ReshapeOptions};
use glam::{DVec3, Vec3};
use serde_json::json;

use crate::common::{
    self, Builder, CUBE, CUBE_TRIANGLES, F32, I16, U8, U32, cube, floats, glb, instanced, json_of,
    plain_cube, quantized, read, relative_error, skinned, twist, volume,
};

/// Tolerance for coordinates near 1 that are rounded to f32 once or twice.
const ROUNDING: f32 = 1e-6;

fn read_glb(b: &Builder) -> Model {
    read("x.glb", &b.glb()).unwrap()
}

/// Checks positions and number of triangles of a cube.
fn assert_cube(model: &Model, expected: &[Vec3]) {
    assert!(relative_error(expected, &model.positions) < ROUNDING, "{:?}", model.positions);
    assert_eq!(model.triangles.len(), 12);
}

#[test]
fn plain_glb_and_gltf_with_files_read_the_same() {
    let b = plain_cube();
    let model = read_glb(&b);
    assert_cube(&model, &cube());
    assert_eq!((model.format(), model.counts.nodes, model.counts.primitives), (ModelFormat::Gltf, 1, 1));
    assert!((volume(&model) - 1.0).abs() < ROUNDING);
    let mut json = b.json.clone();
    json["buffers"] = json!([{ "byteLength": b.bin.len(), "uri": "my%20cube.bin" }]);
    let text = [b"\xef\xbb\xbf \n", serde_json::to_vec(&json).unwrap().as_slice()].concat();
    let with_file =
        Model::read("x.gltf", &text[..], &mut |uri| (uri == "my cube.bin").then(|| Ok(b.bin.clone())));
    // A byte order mark is invalid in JSON, but some exporters write it.
    assert_eq!(with_file.unwrap().positions, cube());
    let hex: String = b.bin.iter().map(|byte| format!("%{byte:02x}")).collect();
    json["buffers"][0]["uri"] = format!("data:application/octet-stream,{hex}").into();
    assert_eq!(read("x.gltf", &serde_json::to_vec(&json).unwrap()).unwrap().positions, cube());
}

#[test]
fn indices_of_every_width_are_read() {
    for component in [U8, common::U16, U32] {
        let mut b = plain_cube();
        let bytes: Vec<u8> = CUBE_TRIANGLES
            .as_flattened()
            .iter()
            .flat_map(|i| {
                i.to_le_bytes()[..match component {
                    U8 => 1,
                    U32 => 4,
                    _ => 2,
                }]
                    .to_vec()
            })
            .collect();
        let accessor = b.accessor(&bytes, component, 36, "SCALAR");
        b.primitive(0)["indices"] = accessor.into();
        assert_eq!(read_glb(&b).triangles, CUBE_TRIANGLES, "component type {component}");
    }
}

#[test]
fn non_indexed_triangles_are_read() {
    let mut b = plain_cube();
    let corners: Vec<[f32; 3]> = CUBE_TRIANGLES.as_flattened().iter().map(|&i| CUBE[i as usize]).collect();
    let position = b.vec3(&corners);
    *b.primitive(0) = json!({ "attributes": { "POSITION": position } });
    let model = read_glb(&b);
    assert_eq!((model.positions.len(), model.triangles.len()), (36, 12));
    assert!((volume(&model) - 1.0).abs() < ROUNDING);
    let cage = model.cage_mesh();
    assert_eq!((cage.positions.len(), cage.faces.len()), (8, 12));
    assert_eq!(
        cage.positions[..3],
        [Vec3::ZERO, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)],
        "first occurrence first"
    );
}

#[test]
fn strips_and_fans_keep_their_winding() {
    let mut b = plain_cube();
    let indices = b.indices(&[0, 1, 3, 2]);
    b.primitive(0)["indices"] = indices.into();
    b.primitive(0)["mode"] = 6.into();
    // Triangle i of a fan is (v_(i + 1), v_(i + 2), v_0), see glTF 2.0, section 3.7.2.1.
    assert_eq!(read_glb(&b).triangles, [[1, 3, 0], [3, 2, 0]]);
    let mut b = plain_cube();
    let indices = b.indices(&[0, 1, 2, 3, 3, 5]);
    b.primitive(0)["indices"] = indices.into();
    b.primitive(0)["mode"] = 5.into();
    // Triangle i of a strip is (v_i, v_(i + 1 + i % 2), v_(i + 2 - i % 2)), see glTF 2.0, section 3.7.2.1. The
    // degenerate triangle is dropped.
    assert_eq!(read_glb(&b).triangles, [[0, 1, 2], [1, 3, 2]]);
}

#[test]
fn quantized_positions_are_read() {
    assert_cube(&read_glb(&quantized()), &cube());
    let mut b = quantized();
    let bytes: Vec<u8> = CUBE.iter().flatten().flat_map(|&x| ((x * 32767.0) as i16).to_le_bytes()).collect();
    let position = b.accessor(&bytes, I16, 8, "VEC3");
    b.json["accessors"][position]["normalized"] = true.into();
    b.primitive(0)["attributes"]["POSITION"] = position.into();
    b.json["nodes"][0]["scale"] = json!([1.0, 1.0, 1.0]);
    assert_cube(&read_glb(&b), &cube());
}

#[test]
fn interleaved_attributes_are_read() {
    let mut b = plain_cube();
    let rows: Vec<f32> = CUBE.iter().flat_map(|p| [p[0], p[1], p[2], 7.0, 8.0]).collect();
    let view = b.view(&floats(&rows));
    b.json["bufferViews"][view]["byteStride"] = 20.into();
    let accessor =
        b.push("accessors", json!({ "bufferView": view, "componentType": 5126, "count": 8, "type": "VEC3" }));
    b.primitive(0)["attributes"]["POSITION"] = accessor.into();
    assert_cube(&read_glb(&b), &cube());
    // With an offset of one component, positions are read as (y, z, 7).
    b.json["accessors"][accessor]["byteOffset"] = 4.into();
    let expected: Vec<Vec3> = CUBE.iter().map(|p| Vec3::new(p[1], p[2], 7.0)).collect();
    assert_eq!(read_glb(&b).positions, expected);
}

#[test]
fn sparse_values_replace_zeros_and_data() {
    let mut b = plain_cube();
    let places = b.view(&[2, 7]);
    let values = b.view(&floats(&[0., 1., 0., 3., 3., 3.]));
    let sparse = json!({
        "count": 2,
        "indices": { "bufferView": places, "componentType": U8 },
        "values": { "bufferView": values },
    });
    b.json["accessors"][0]["sparse"] = sparse.clone();
    let mut expected = cube();
    expected[7] = Vec3::splat(3.0);
    assert_eq!(read_glb(&b).positions, expected);
    let zeros =
        b.push("accessors", json!({ "componentType": 5126, "count": 8, "type": "VEC3", "sparse": sparse }));
    b.primitive(0)["attributes"]["POSITION"] = zeros.into();
    let model = read_glb(&b);
    assert_eq!(
        (model.positions[1], model.positions[2], model.positions[7]),
        (Vec3::ZERO, Vec3::Y, expected[7])
    );
}

#[test]
fn nested_transforms_are_applied() {
    let mut b = plain_cube();
    // Scale by (2, 1, 1), rotate by 90 degrees about z, translate: (x, y, z) -> (-y, 2x, z) + (10, 0, 0).
    let half = std::f32::consts::FRAC_1_SQRT_2;
    b.json["nodes"] = json!([
        { "translation": [10.0, 0.0, 0.0], "children": [1] },
        { "rotation": [0.0, 0.0, half, half], "children": [2] },
        { "mesh": 0, "matrix": [2.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0] },
    ]);
    let expected: Vec<Vec3> = cube().iter().map(|p| Vec3::new(10.0 - p.y, 2.0 * p.x, p.z)).collect();
    let model = read_glb(&b);
    assert_cube(&model, &expected);
    assert!((volume(&model) - 2.0).abs() < 1e-4);
}

#[test]
fn mirrored_node_stays_outward() {
    let mut b = plain_cube();
    b.json["nodes"][0]["scale"] = json!([1.0, -2.0, 1.0]);
    assert!((volume(&read_glb(&b)) - 2.0).abs() < ROUNDING);
}

#[test]
fn only_the_default_scene_is_read() {
    let mut b = instanced();
    b.json["scenes"] = json!([{ "nodes": [0] }, { "nodes": [1] }, {}]);
    b.json["scene"] = 1.into();
    let model = read_glb(&b);
    assert_eq!(model.positions.len(), 8);
    assert_eq!(model.positions[1], Vec3::new(4.0, 0.0, 0.0));
    assert_eq!(model.notices.len(), 1);
    b.json["scene"] = 2.into();
    let model = read_glb(&b);
    assert_eq!(model.positions.len(), 16, "all meshes are used if the scene is empty");
}

#[test]
fn vertices_are_ordered_by_mesh_then_node_then_primitive() {
    let mut b = Builder::new();
    let (first, second) = (b.cube_mesh("a"), b.cube_mesh("b"));
    // The second mesh comes first in the hierarchy, and the first mesh is shown twice.
    b.json["nodes"] = json!([
        { "mesh": second, "translation": [30.0, 0.0, 0.0], "children": [2] },
        { "mesh": first, "translation": [10.0, 0.0, 0.0] },
        { "mesh": first, "translation": [-10.0, 0.0, 0.0] },
    ]);
    b.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    let x: Vec<f32> = read_glb(&b).positions.iter().step_by(8).map(|p| p.x).collect();
    assert_eq!(x, [10.0, 20.0, 30.0]);
}

#[test]
fn file_without_nodes_shows_its_meshes() {
    let mut b = plain_cube();
    for key in ["nodes", "scenes", "scene"] {
        b.json.as_object_mut().unwrap().remove(key);
    }
    assert_cube(&read_glb(&b), &cube());
}

#[test]
fn skinned_mesh_is_read_in_its_rest_pose() {
    let model = read_glb(&skinned());
    let expected: Vec<Vec3> =
        cube().iter().map(|p| *p + Vec3::Z * if p.z > 0.5 { 2.0 } else { 0.0 }).collect();
    assert_cube(&model, &expected);
    assert!(
        model.notices.iter().any(|n| n == "rigged model: opened in its rest pose"),
        "{:?}",
        model.notices
    );
    assert_eq!((model.counts.skins, model.counts.animations, model.counts.morph_targets), (1, 2, 1));
}

#[test]
fn inverse_bind_matrices_undo_the_joints() {
    let mut b = skinned();
    let bind = |z: f32| [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., -z, 1.];
    let matrices = b.accessor(&floats(&[bind(0.0), bind(2.0)].concat()), F32, 2, "MAT4");
    b.json["skins"][0]["inverseBindMatrices"] = matrices.into();
    assert_cube(&read_glb(&b), &cube());
}

#[test]
fn morph_targets_apply_at_default_weights() {
    let mut b = plain_cube();
    let delta = b.vec3(&[[0.0, 2.0, 0.0]; 8]);
    b.primitive(0)["targets"] = json!([{ "POSITION": delta }]);
    b.json["meshes"][0]["weights"] = json!([0.5]);
    let shifted = |y: f32| cube().iter().map(|p| *p + Vec3::Y * y).collect::<Vec<_>>();
    assert_cube(&read_glb(&b), &shifted(1.0));
    b.json["nodes"][0]["weights"] = json!([0.25]);
    assert_cube(&read_glb(&b), &shifted(0.5));
}

#[test]
fn unknown_required_material_extensions_are_accepted() {
    let mut b = plain_cube();
    b.json["extensionsRequired"] = json!(["KHR_texture_basisu", "VENDOR_paint"]);
    b.json["materials"] = json!([{ "alphaMode": "UNHEARD_OF" }]);
    assert_cube(&read_glb(&b), &cube());
}

#[test]
fn points_open_as_points_and_move_in_their_file() {
    let mut b = plain_cube();
    let red = b.accessor(&floats(&[[1.0, 0.0, 0.0]; 8].concat()), F32, 8, "VEC3");
    b.primitive(0)["mode"] = 0.into();
    b.primitive(0)["attributes"]["COLOR_0"] = red.into();
    b.json["nodes"][0]["scale"] = json!([2.0, 2.0, 2.0]);
    let model = read_glb(&b);
    let doubled: Vec<Vec3> = cube().iter().map(|p| 2.0 * *p).collect();
    assert_eq!((&model.positions, model.n_faces()), (&doubled, 0));
    let drawn = model.drawn_splats().unwrap();
    assert!(drawn.len() == 8 && drawn.colors[7].distance(Vec3::X) < 1e-6, "{}", drawn.colors[7]);
    assert!(model.write_glb(&model.positions).unwrap() == b.glb(), "an unmoved model is its file");

    let bent: Vec<Vec3> = doubled.iter().map(|&p| twist(p)).collect();
    let written = model.write(ModelFormat::Gltf, &bent).unwrap();
    let again = read("again.glb", &written).unwrap();
    let off = again.positions.iter().zip(&bent).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(off < 1e-6, "{off}");
    let json = json_of(&written);
    let primitive = &json["meshes"][0]["primitives"][0];
    assert!(primitive["mode"] == 0 && primitive["attributes"]["COLOR_0"].is_u64(), "{primitive}");
    let ply = read("points.ply", &model.write(ModelFormat::Ply, &bent).unwrap()).unwrap();
    assert_eq!((&ply.positions, ply.n_faces()), (&bent, 0));
}

#[test]
fn points_beside_triangles_move_with_them() {
    let mut b = plain_cube();
    let points = b.cube_mesh("points");
    b.primitive(points)["mode"] = 0.into();
    b.push("nodes", json!({ "mesh": points }));
    b.json["scenes"][0]["nodes"] = json!([0, 1]);
    let model = read_glb(&b);
    assert_eq!((model.positions.len(), model.triangles.len()), (16, 12));
    let notice = "1 primitive of points: moved with the triangles, but not shown";
    assert!(model.notices.iter().any(|found| found == notice), "{:?}", model.notices);
    let shifted: Vec<Vec3> = model.positions.iter().map(|&p| p + Vec3::Y).collect();
    let by = vec![DVec3::Y; 16 + model.extra_points().unwrap().len()];
    for written in [
        model.write_glb(&shifted).unwrap(),
        model.write_reshaped(&by, &[], &[], &ReshapeOptions::default()).unwrap().0,
    ] {
        let again = read("again.glb", &written).unwrap().positions;
        assert!(again.iter().zip(&shifted).all(|(a, b)| a.distance(*b) < 1e-6), "{again:?}");
    }
}

#[test]
fn lines_are_skipped() {
    let mut b = instanced();
    let lines = b.cube_mesh("lines");
    b.primitive(lines)["mode"] = 1.into();
    b.push("nodes", json!({ "mesh": lines }));
    b.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let model = read_glb(&b);
    assert_eq!(model.positions.len(), 16);
    assert!(model.notices[0].contains("1 primitive of lines: not shown"));
}

#[test]
fn splats_beside_triangles_are_counted() {
    let mut b = instanced();
    let splats = b.cube_mesh("splats");
    b.primitive(splats)["mode"] = 0.into();
    b.primitive(splats)["extensions"] = json!({ "KHR_gaussian_splatting": { "kernel": "ellipse" } });
    b.push("nodes", json!({ "mesh": splats }));
    b.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let model = read_glb(&b);
    assert_eq!((model.positions.len(), model.notices.len()), (16, 1));
    let said = model.notices[0].starts_with(&format!("{} splats are not read", cube().len()));
    assert!(said && model.notices[0].ends_with("as two files"), "{}", model.notices[0]);
}

#[test]
fn trailing_bytes_and_missing_bin_padding_are_tolerated() {
    let mut bytes = plain_cube().glb();
    bytes.extend_from_slice(b"trailing");
    assert_eq!(read("x.glb", &bytes).unwrap().positions, cube());
    let mut json = plain_cube().json;
    json["meshes"] = json!([]);
    json["nodes"] = json!([]);
    json["scenes"] = json!([{}]);
    assert!(
        read("x.glb", &glb(&json, None)).unwrap_err().to_string().contains("it has no triangles or points")
    );
    json["animations"] = json!([{ "channels": [], "samplers": [] }]);
    assert!(read("x.glb", &glb(&json, None)).unwrap_err().to_string().contains("refit --skeleton"));
}

#[test]
fn pose_of_a_welded_cage_is_found_by_its_vertices() {
    let mut b = plain_cube();
    let corners: Vec<[f32; 3]> = CUBE_TRIANGLES.as_flattened().iter().map(|&i| CUBE[i as usize]).collect();
    let position = b.vec3(&corners);
    *b.primitive(0) = json!({ "attributes": { "POSITION": position } });
    let cage = read_glb(&b);
    let moved: Vec<[f32; 3]> = corners.iter().map(|p| [2.0 * p[0], p[1], p[2]]).collect();
    let position = b.vec3(&moved);
    b.primitive(0)["attributes"]["POSITION"] = position.into();
    let expected: Vec<Vec3> =
        cage.cage_mesh().positions.iter().map(|p| Vec3::new(2.0 * p.x, p.y, p.z)).collect();
    assert_eq!(cage.pose_positions(&read_glb(&b)).unwrap(), expected);
    // As Blender may do, cut a quad along its other diagonal, and choose other vertices among the coincident ones.
    let mut indices: Vec<u32> = (0..36).collect();
    let place = |v: u32| corners[v as usize];
    let ends = [indices[0], indices[1], indices[2]].map(place);
    let other = (3..6).find(|&v| !ends.contains(&place(v))).unwrap();
    // The first two triangles form the quad 0 2 3 1 of the cage, which is cut from 0 to 3. Cut it from 2 to 1.
    let at = |p: [f32; 3]| (6..36).find(|&v| place(v) == p).unwrap();
    let [a, b0, c] = ends;
    indices[..6].copy_from_slice(&[at(a), at(b0), other, at(b0), at(c), other]);
    let indices = b.indices(&indices);
    b.primitive(0)["indices"] = indices.into();
    assert_eq!(cage.pose_positions(&read_glb(&b)).unwrap(), expected);
}

/// Found by fuzzing: an export that kept the attribute would refer to an added accessor.
#[test]
fn attribute_without_accessor_is_ignored_with_a_notice() {
    let mut b = plain_cube();
    b.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 9.into();
    let model = read("x.glb", &b.glb()).unwrap();
    assert!(model.notices[0].contains("TEXCOORD_0 of mesh 0 refers to accessor 9"), "{:?}", model.notices);
    let poses = [("a".into(), model.positions.clone()), ("b".into(), model.positions.clone())];
    let written = model.write_glb_poses(&model.positions, &poses).unwrap();
    assert_eq!(read("y.glb", &written).unwrap().positions, model.positions);
}

#[test]
fn extras_of_any_type_are_read_and_kept() {
    const PLACES: [&str; 12] = [
        "",
        "/asset",
        "/scenes/0",
        "/nodes/0",
        "/nodes/1",
        "/meshes/0",
        "/meshes/0/primitives/0",
        "/accessors/0",
        "/bufferViews/0",
        "/skins/0",
        "/animations/0",
        "/animations/0/channels/0/target",
    ];
    for extras in [json!(null), json!("a note"), json!(7.5), json!(true), json!([{ "key": "value" }])] {
        let mut b = skinned();
        for place in PLACES {
            b.json.pointer_mut(place).unwrap()["extras"] = extras.clone();
        }
        let (model, plain) = (read_glb(&b), read_glb(&skinned()));
        assert_eq!(model.positions, plain.positions);
        let moved: Vec<Vec3> = model.positions.iter().map(|&p| p + Vec3::X).collect();
        let written = json_of(&model.write_glb(&moved).unwrap());
        for place in &PLACES[..6] {
            assert_eq!(written.pointer(place).unwrap()["extras"], extras, "{place}");
        }
    }
}

/// glTF 2.0, section 2.7, allows integers with a fraction of zero.
#[test]
fn integers_may_have_a_fraction_of_zero() {
    fn with_fractions(value: &mut serde_json::Value) {
        match value {
            serde_json::Value::Number(number) => *value = json!(number.as_f64().unwrap()),
            serde_json::Value::Array(items) => items.iter_mut().for_each(with_fractions),
            serde_json::Value::Object(object) => object.values_mut().for_each(with_fractions),
            _ => {}
        }
    }
    let mut b = skinned();
    with_fractions(&mut b.json);
    let (model, plain) = (read_glb(&b), read_glb(&skinned()));
    assert_eq!((&model.positions, &model.triangles), (&plain.positions, &plain.triangles));
    assert_eq!(model.clips(), plain.clips());
}
