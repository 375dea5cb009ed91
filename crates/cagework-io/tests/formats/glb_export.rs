//! GLB export: the deformed shape in the original document.

use cagework_io::{Model, ModelFormat, Timeline};
use glam::{EulerRot, Quat, Vec3};
use serde_json::{Value, json};

use crate::common::{
    self, Builder, CUBE_OBJ, PNG, cube, instanced, json_of, plain_cube, quantized, read, relative_error,
    skinned, textured_square, twist, volume,
};

/// Tolerance of f32 positions that are transformed back and forth.
const ROUND_TRIP: f32 = 1e-6;

fn deformed(model: &Model) -> Vec<Vec3> {
    model.positions.iter().map(|&p| twist(p)).collect()
}

fn square() -> Model {
    let bytes = textured_square().glb();
    Model::read("square.glb", &bytes, &mut |uri| (uri == "red dot.png").then(|| Ok(PNG.to_vec()))).unwrap()
}

#[test]
fn exported_positions_are_those_of_the_deformed_model() {
    let models = [plain_cube(), textured_square(), instanced(), skinned(), quantized()];
    for (k, b) in models.iter().enumerate() {
        let model = read("x.glb", &b.glb()).unwrap();
        let expected = deformed(&model);
        let again = read("y.glb", &model.write_glb(&expected).unwrap()).unwrap();
        assert!(relative_error(&expected, &again.positions) < ROUND_TRIP, "model {k}");
        let same_winding = volume(&again) * volume(&model) >= 0.0;
        assert!(same_winding, "model {k}");
        let obj = read("y.obj", &model.write_obj(&expected).unwrap()).unwrap();
        assert!(relative_error(&expected, &obj.positions) < ROUND_TRIP, "model {k} as OBJ");
        assert_eq!(obj.triangles, model.triangles, "model {k} as OBJ");
    }
}

#[test]
fn export_at_rest_is_the_original_shape() {
    let model = square();
    let again = read("y.glb", &model.write_glb(&model.positions).unwrap()).unwrap();
    assert!(relative_error(&model.positions, &again.positions) < ROUND_TRIP);
}

/// A cube whose buffer is a data URI.
pub(crate) fn inline_glb() -> Vec<u8> {
    let mut json = plain_cube().json;
    let bin = plain_cube().bin;
    let hex: String = bin.iter().map(|byte| format!("%{byte:02x}")).collect();
    json["buffers"] = json!([{ "byteLength": bin.len(), "uri": format!("data:,{hex}") }]);
    common::glb(&json, None)
}

#[test]
fn unmoved_glb_with_its_buffer_in_a_data_uri_is_written_as_read() {
    let file = inline_glb();
    let model = read("x.glb", &file).unwrap();
    assert!(model.write_glb(&model.positions).unwrap() == file);
    let moved = deformed(&model);
    let again = read("y.glb", &model.write_glb(&moved).unwrap()).unwrap();
    assert!(relative_error(&moved, &again.positions) < ROUND_TRIP);
}

#[test]
fn materials_textures_names_and_nodes_survive() {
    let model = square();
    let (before, after) = (textured_square().json, json_of(&model.write_glb(&deformed(&model)).unwrap()));
    for key in ["nodes", "materials", "textures", "scenes", "asset"] {
        assert_eq!(before[key], after[key], "{key}");
    }
    let primitive = &after["meshes"][0]["primitives"][0];
    assert_eq!((&primitive["material"], &after["meshes"][0]["name"]), (&json!(0), &json!("square")));
    assert!(primitive["attributes"]["TEXCOORD_0"].is_u64());
    let image = &after["images"][0];
    assert_eq!((&image["mimeType"], &image["uri"]), (&json!("image/png"), &Value::Null));
    let view = &after["bufferViews"][image["bufferView"].as_u64().unwrap() as usize];
    assert_eq!(view["byteLength"], PNG.len());
    // The export has four accessors, and a fifth buffer view for the image. Replaced data is dropped.
    assert_eq!(after["accessors"].as_array().unwrap().len(), 4);
    assert_eq!(after["bufferViews"].as_array().unwrap().len(), 5);
}

#[test]
fn missing_texture_is_a_notice_and_keeps_its_reference() {
    let model = read("x.glb", &textured_square().glb()).unwrap();
    assert!(model.notices[0].contains("'red dot.png' is missing"), "{:?}", model.notices);
    let after = json_of(&model.write_glb(&model.positions).unwrap());
    assert_eq!(after["images"][0]["uri"], "red%20dot.png");
}

#[test]
fn bounds_are_those_of_the_new_positions() {
    let model = read("x.glb", &plain_cube().glb()).unwrap();
    let moved: Vec<Vec3> = cube().iter().map(|p| 2.0 * *p - Vec3::Y).collect();
    let after = json_of(&model.write_glb(&moved).unwrap());
    let position = after["meshes"][0]["primitives"][0]["attributes"]["POSITION"].as_u64().unwrap() as usize;
    let accessor = &after["accessors"][position];
    assert_eq!((&accessor["min"], &accessor["max"]), (&json!([0.0, -1.0, 0.0]), &json!([2.0, 1.0, 2.0])));
}

/// Attribute of the only primitive, as rows of floats.
fn attribute(glb: &[u8], name: &str, width: usize) -> Vec<Vec<f32>> {
    let json = json_of(glb);
    let accessor = json["meshes"][0]["primitives"][0]["attributes"][name].as_u64().unwrap() as usize;
    let view = &json["bufferViews"][json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize];
    let start = view["byteOffset"].as_u64().unwrap() as usize;
    let json_length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let bytes = &glb[28 + json_length + start..][..view["byteLength"].as_u64().unwrap() as usize];
    let values: Vec<f32> = bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    values.chunks(width).map(<[f32]>::to_vec).collect()
}

#[test]
fn normals_and_tangents_turn_with_the_surface() {
    let mut b = textured_square();
    b.json["nodes"] = json!([{ "mesh": 0 }]);
    let model = read("x.glb", &b.glb()).unwrap();
    // The vertices rotate by 90 degrees about x: y becomes z.
    let turned: Vec<Vec3> = model.positions.iter().map(|p| Vec3::new(p.x, -p.z, p.y)).collect();
    let glb = model.write_glb(&turned).unwrap();
    for (normal, tangent) in attribute(&glb, "NORMAL", 3).iter().zip(attribute(&glb, "TANGENT", 4)) {
        assert!(Vec3::from_slice(normal).distance(-Vec3::Y) < 1e-6, "{normal:?}");
        assert!(Vec3::from_slice(&tangent).distance(Vec3::X) < 1e-6 && tangent[3] == 1.0, "{tangent:?}");
    }
}

#[test]
fn seams_stay_smooth() {
    let mut b = textured_square();
    b.json["nodes"] = json!([{ "mesh": 0 }]);
    let model = read("x.glb", &b.glb()).unwrap();
    // Fold along the diagonal, where the triangles have separate vertices.
    let folded: Vec<Vec3> = model.positions.iter().map(|p| p.with_z((p.x - p.y).abs())).collect();
    let normals = attribute(&model.write_glb(&folded).unwrap(), "NORMAL", 3);
    // Vertices 0 and 3, and 2 and 4, are coincident.
    assert_eq!((&normals[0], &normals[2]), (&normals[3], &normals[4]));
    // At vertex 0, the least squares over the edges to z = 1 at (1, 0) and (0, 1), and twice to z = 0 at (1, 1), have the
    // slopes 1 / 5.
    let expected = Vec3::new(-0.2, -0.2, 1.0).normalize();
    assert!(Vec3::from_slice(&normals[0]).distance(expected) < 1e-6, "{:?}", normals[0]);
}

/// A rotation turns a stored normal and a tangent, whatever the normal of the face is. Each face of a doubled sheet has a
/// copy that faces the other way, so that the sheet has no mean normal.
#[test]
fn oblique_normals_of_single_and_doubled_sheets_turn_with_the_surface() {
    let (normal, tangent) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.8, 0.0, -0.6));
    let at = [[0.1, 0.0, 0.3], [1.0, 0.1, 0.3], [1.1, 1.0, 0.3], [0.0, 0.7, 0.3]];
    for sides in [1, 2] {
        let mut b = Builder::new();
        let corners = [0, 1, 2, 0, 2, 3, 2, 1, 0, 3, 2, 0];
        let tangents = tangent.extend(1.0).to_array().repeat(4);
        let attributes = json!({
            "POSITION": b.vec3(&at), "NORMAL": b.vec3(&[normal.to_array(); 4]),
            "TANGENT": b.accessor(&common::floats(&tangents), common::F32, 4, "VEC4"),
        });
        let indices = b.indices(&corners[..6 * sides]);
        b.push("meshes", json!({ "primitives": [{ "attributes": attributes, "indices": indices }] }));
        b.json["nodes"] = json!([{ "mesh": 0 }]);
        let model = read("x.glb", &b.glb()).unwrap();
        let text = at.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
        let faces = ["f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n", "f 3//1 2//1 1//1\nf 4//1 3//1 1//1\n"];
        let obj = format!("{text}vn 0.6 0 0.8\n{}", faces[..sides].concat());
        let obj = read("x.obj", obj.as_bytes()).unwrap();
        for turn in [Quat::from_rotation_z(1.2), Quat::from_euler(EulerRot::XYZ, 0.7, -0.4, 1.1)] {
            let turned: Vec<Vec3> = model.positions.iter().map(|&p| turn * p).collect();
            let from_obj = obj.write_glb(&turned).unwrap();
            let glb = model.write_glb(&turned).unwrap();
            let near = |found: &[f32], expected: Vec3, what: &str| {
                let off = Vec3::from_slice(found).distance(turn * expected);
                assert!(off < 1e-5, "{sides} sides, {what}: {found:?}");
            };
            attribute(&glb, "NORMAL", 3).iter().for_each(|n| near(n, normal, "GLB"));
            attribute(&glb, "TANGENT", 4).iter().for_each(|t| near(t, tangent, "tangent"));
            attribute(&from_obj, "NORMAL", 3).iter().for_each(|n| near(n, normal, "GLB of an OBJ"));
            for obj in [obj.write_obj(&turned).unwrap(), model.write_obj(&turned).unwrap()] {
                let obj = String::from_utf8(obj).unwrap();
                let lines: Vec<&str> = obj.lines().filter_map(|line| line.strip_prefix("vn ")).collect();
                assert_eq!(lines.len(), 4);
                for line in lines {
                    let found: Vec<f32> = line.split(' ').map(|x| x.parse().unwrap()).collect();
                    near(&found, normal, "OBJ");
                }
            }
        }
    }
}

#[test]
fn each_instance_gets_its_own_mesh() {
    let mut b = instanced();
    let unseen = b.push("nodes", json!({ "name": "unseen", "mesh": 0 }));
    let model = read("x.glb", &b.glb()).unwrap();
    let after = json_of(&model.write_glb(&deformed(&model)).unwrap());
    let mesh = |node: usize| after["nodes"][node]["mesh"].as_u64().unwrap();
    assert_eq!(after["meshes"].as_array().unwrap().len(), 3);
    assert!(mesh(0) != mesh(1) && mesh(0) != mesh(unseen) && mesh(1) != mesh(unseen));
    assert_eq!(
        after["meshes"][mesh(unseen) as usize],
        b.json["meshes"][0],
        "a node outside the scene keeps its mesh"
    );
}

#[test]
fn static_export_drops_the_skin_and_keeps_the_joints() {
    let model = read("x.glb", &skinned().glb()).unwrap();
    let after = json_of(&model.write_glb(&deformed(&model)).unwrap());
    let (node, names) = (&after["nodes"][3], [0, 1, 2].map(|n| after["nodes"][n]["name"].clone()));
    assert_eq!(names, ["body", "low", "high"]);
    assert_eq!(
        (&node["name"], &node["skin"], &node["translation"]),
        (&json!("body"), &Value::Null, &Value::Null)
    );
    assert_eq!(after["nodes"][0].get("mesh"), None);
    assert_eq!(after["scenes"][0]["nodes"], json!([0, 1, 3]));
    let mesh = &after["meshes"][0];
    assert_eq!(mesh["primitives"][0]["attributes"].as_object().unwrap().len(), 1);
    assert_eq!(mesh["primitives"][0]["targets"], Value::Null);
    assert_eq!(mesh["extras"], json!({ "kept": 7 }));
    assert_eq!(
        after["animations"].as_array().unwrap().len(),
        1,
        "the animation of the morph target is removed"
    );
}

#[test]
fn mesh_under_a_singular_transform_is_exported() {
    let mut b = plain_cube();
    b.json["nodes"][0]["scale"] = json!([1.0, 1.0, 0.0]);
    let model = read("x.glb", &b.glb()).unwrap();
    let expected = deformed(&model);
    let again = read("y.glb", &model.write_glb(&expected).unwrap()).unwrap();
    assert!(relative_error(&expected, &again.positions) < ROUND_TRIP);
}

#[test]
fn file_without_nodes_gets_one() {
    let mut b = plain_cube();
    for key in ["nodes", "scenes", "scene"] {
        b.json.as_object_mut().unwrap().remove(key);
    }
    let model = read("x.glb", &b.glb()).unwrap();
    let expected = deformed(&model);
    let glb = model.write_glb(&expected).unwrap();
    assert_eq!(json_of(&glb)["scenes"], json!([{ "nodes": [0] }]));
    assert!(relative_error(&expected, &read("y.glb", &glb).unwrap().positions) < ROUND_TRIP);
}

#[test]
fn unknown_extensions_keep_every_accessor() {
    let mut b = plain_cube();
    b.json["extensionsUsed"] = json!(["VENDOR_secret"]);
    b.json["extensions"] = json!({ "VENDOR_secret": { "accessor": 1 } });
    let model = read("x.glb", &b.glb()).unwrap();
    let after = json_of(&model.write_glb(&deformed(&model)).unwrap());
    assert_eq!(after["accessors"].as_array().unwrap().len(), 3);
    assert_eq!(after["accessors"][1], b.json["accessors"][1]);
}

fn poses(model: &Model) -> Vec<(String, Vec<Vec3>)> {
    let shift = model.positions.iter().map(|p| *p + Vec3::Z).collect();
    vec![("twisted".into(), deformed(model)), ("raised".into(), shift)]
}

#[test]
fn poses_are_morph_targets_with_an_animation() {
    let obj = read("box.obj", CUBE_OBJ.as_bytes()).unwrap();
    for model in [square(), obj, read("x.glb", &instanced().glb()).unwrap()] {
        let poses = poses(&model);
        let mut after = json_of(&model.write_glb_poses(&model.positions, &poses).unwrap());
        let nodes = after["nodes"].as_array().unwrap().iter().filter(|n| n["mesh"].is_u64()).count();
        for mesh in after["meshes"].as_array().unwrap() {
            assert_eq!(mesh["extras"]["targetNames"], json!(["twisted", "raised"]));
            assert!(
                mesh["primitives"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .all(|p| p["targets"].as_array().unwrap().len() == 2)
            );
        }
        let animation = after["animations"][0].take();
        assert_eq!(animation["channels"].as_array().unwrap().len(), nodes);
        let times = &after["accessors"][animation["samplers"][0]["input"].as_u64().unwrap() as usize];
        assert_eq!((&times["count"], &times["max"]), (&json!(4), &json!([3.0])));
    }
}

#[test]
fn morph_target_at_weight_one_is_the_pose() {
    let model = read("x.glb", &instanced().glb()).unwrap();
    let poses = poses(&model);
    let glb = model.write_glb_poses(&model.positions, &poses).unwrap();
    for (k, (name, expected)) in poses.iter().enumerate() {
        let mut json = json_of(&glb);
        for mesh in json["meshes"].as_array_mut().unwrap() {
            mesh["weights"][k] = 1.0.into();
        }
        let json_length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        let posed = common::glb(&json, Some(&glb[28 + json_length..]));
        let posed = read("y.glb", &posed).unwrap();
        assert!(relative_error(expected, &posed.positions) < ROUND_TRIP, "{name}");
    }
}

#[test]
fn states_of_a_pose_are_the_keys_of_its_clip_or_its_morph_targets() {
    let cage = read("cage.glb", &plain_cube().glb()).unwrap();
    let poses = poses(&cage);
    let glb = cage.write_glb_poses_at(&cage.positions, &poses, &Timeline::at_keys(&[0.25, 1.5])).unwrap();
    let states = cage.pose_states(&read("pose.glb", &glb).unwrap()).unwrap();
    let names: Vec<_> = states.iter().map(|state| (state.name.as_str(), state.seconds)).collect();
    assert_eq!(names, [("0.250 s", Some(0.25)), ("1.500 s", Some(1.5))]);
    for (state, (_, expected)) in states.iter().zip(&poses) {
        assert!(relative_error(expected, &state.positions) < ROUND_TRIP, "{}", state.name);
    }
    // If the file has no clip, each morph target is a state.
    let mut json = json_of(&glb);
    json.as_object_mut().unwrap().remove("animations");
    let json_length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let keys = read("keys.glb", &common::glb(&json, Some(&glb[28 + json_length..]))).unwrap();
    let keys = cage.pose_states(&keys).unwrap();
    for ((state, key), (name, _)) in states.iter().zip(&keys).zip(&poses) {
        assert_eq!((&key.name, key.seconds, &key.positions), (name, None, &state.positions));
    }
    assert_eq!((keys.len(), cage.pose_states(&cage).unwrap()), (2, vec![]));
}

#[test]
fn obj_becomes_a_glb_with_texture_coordinates_and_hard_edges() {
    let model = read("box.obj", CUBE_OBJ.as_bytes()).unwrap();
    let expected = deformed(&model);
    let glb = model.write_glb(&expected).unwrap();
    let json = json_of(&glb);
    let primitives = json["meshes"][0]["primitives"].as_array().unwrap();
    let materials: Vec<&Value> = primitives
        .iter()
        .map(|p| &json["materials"][p["material"].as_u64().unwrap() as usize]["name"])
        .collect();
    assert_eq!(materials, ["red", "blue"]);
    assert!(primitives.iter().all(|p| p["attributes"]["TEXCOORD_0"].is_u64()));
    let again = read("y.glb", &glb).unwrap();
    // The GLB has four vertices per face, with the face's normal.
    assert_eq!((again.positions.len(), again.triangles.len()), (24, 12));
    assert!(again.positions.iter().all(|p| expected.contains(p)));
    let mut before = model.clone();
    before.positions = expected;
    assert!((volume(&before) - volume(&again)).abs() < 1e-5);
    let no_faces = read("p.obj", b"v 0 0 0").unwrap();
    for (format, name) in
        [(ModelFormat::Gltf, "GLB"), (ModelFormat::Stl, "STL"), (ModelFormat::ThreeMf, "3MF")]
    {
        let message = no_faces.write(format, &no_faces.positions).unwrap_err().to_string();
        let expected = format!("no faces, but {name} needs triangles: export PLY");
        assert!(message.contains(&expected), "{message}");
    }
    assert!(no_faces.write(ModelFormat::Ply, &no_faces.positions).is_ok());
}

/// GLB exports of several poses keep colours, textures and opacity of materials, and vertex colours.
/// The name of a model may be a path on the user's machine.
#[test]
fn a_glb_of_an_obj_is_named_after_the_file_without_its_folder() {
    let model = read("/home/me/a.b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let glb = json_of(&model.write_glb(&model.positions).unwrap());
    assert_eq!(glb["nodes"][0]["name"], "a.b");
    assert_eq!(glb["meshes"][0]["name"], "a.b");
}

#[test]
fn obj_and_ply_become_a_glb_with_materials_and_colours() {
    let mtl = "newmtl red\nKd 1 0.5 0\nd 0.25\nnewmtl blue\nKd 0 0 0\nmap_Kd t.png\n";
    let mut files = |name: &str| match name {
        "box.mtl" => Some(Ok(mtl.into())),
        "t.png" => Some(Ok(PNG.to_vec())),
        _ => None,
    };
    let model = Model::read("box.obj", CUBE_OBJ.as_bytes(), &mut files).unwrap();
    assert_eq!(model.lost_in(ModelFormat::Gltf), None);
    let glb = model.write_glb(&deformed(&model)).unwrap();
    let json = json_of(&glb);
    let material = |name: &str| {
        json["materials"].as_array().unwrap().iter().find(|m| m["name"] == name).unwrap().clone()
    };
    let color = |m: &Value| {
        m["pbrMetallicRoughness"]["baseColorFactor"]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .collect::<Vec<_>>()
    };
    // sRGB 0.5 is linear 0.214 (IEC 61966-2-1).
    let red = material("red");
    assert!(color(&red).iter().zip([1.0, 0.214_04, 0.0, 0.25]).all(|(a, b)| (a - b).abs() < 1e-5));
    assert_eq!(
        (&red["alphaMode"], red["pbrMetallicRoughness"]["baseColorTexture"].is_null()),
        (&"BLEND".into(), true)
    );
    let blue = material("blue");
    assert_eq!((color(&blue), &blue["alphaMode"]), (vec![1.0; 4], &Value::Null));
    let again = read("again.glb", &glb).unwrap().look();
    assert_eq!(
        (again.images.len(), again.images[0].bytes.as_slice(), again.images[0].mime.as_str()),
        (1, &PNG[..], "image/png")
    );

    let colored = CUBE_OBJ
        .lines()
        .map(|line| if line.starts_with("v ") { format!("{line} 1 0.5 0\n") } else { format!("{line}\n") });
    let model = read("box.obj", colored.collect::<String>().as_bytes()).unwrap();
    for model in [read("box.ply", &model.write(ModelFormat::Ply, &model.positions).unwrap()).unwrap(), model]
    {
        let glb = model.write_glb(&model.positions).unwrap();
        // The PLY stores 0.5 as the byte 128 of 255.
        let close = |c: &Vec<f32>| (c[0], c[2]) == (1.0, 0.0) && (c[1] - 0.214).abs() < 2e-3;
        let colors = attribute(&glb, "COLOR_0", 3);
        assert!(colors.len() >= 8 && colors.iter().all(close), "{colors:?}");
    }
}

#[test]
fn gltf_becomes_an_obj_with_its_texture_coordinates_and_names() {
    let model = square();
    let text = String::from_utf8(model.write_obj(&model.positions).unwrap()).unwrap();
    for line in ["o leaf", "usemtl paint", "vt 0.5 0", "f 1/1/1 2/2/2 3/3/3"] {
        assert!(text.lines().any(|l| l == line), "{line}");
    }
    let instanced: Builder = instanced();
    let text = read("x.glb", &instanced.glb()).unwrap();
    let text = String::from_utf8(text.write_obj(&text.positions).unwrap()).unwrap();
    assert!(text.contains("o left") && text.contains("o right") && !text.contains('/'));
}

/// OBJ has no texture transform, so its texture coordinates contain it.
#[test]
fn texture_transform_is_applied_to_the_coordinates_of_an_obj() {
    let mut b = textured_square();
    b.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = json!({
        "KHR_texture_transform": { "offset": [0.1, 0.2], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2.0, 4.0] }
    });
    let model = read("x.glb", &b.glb()).unwrap();
    let text = String::from_utf8(model.write_obj(&model.positions).unwrap()).unwrap();
    let third = text.lines().filter_map(|line| line.strip_prefix("vt ")).nth(2).unwrap();
    let [u, v] = [0, 1].map(|k| third.split(' ').nth(k).unwrap().parse::<f32>().unwrap());
    // (0.5, 1) scales to (1, 4), rotates by 90 degrees to (4, -1) and moves to (4.1, -0.8); v points up in an OBJ.
    assert!((u - 4.1).abs() < 1e-5 && (v - 1.8).abs() < 1e-5, "{third}");
}

/// Lines in a mesh with triangles lose their skin and targets too, and get as many targets as there are poses.
#[test]
fn lines_beside_triangles_stay_at_rest() {
    let mut b = skinned();
    b.json["meshes"][0]["weights"] = json!([1.0]);
    let mut lines = b.primitive(0).clone();
    lines["mode"] = json!(1);
    b.json["meshes"][0]["primitives"].as_array_mut().unwrap().insert(0, lines);
    let model = read("x.glb", &b.glb()).unwrap();
    for poses in [Vec::new(), poses(&model)] {
        let glb = model.write_glb_poses(&deformed(&model), &poses).unwrap();
        let primitives = &json_of(&glb)["meshes"][0]["primitives"];
        for primitive in [&primitives[0], &primitives[1]] {
            assert_eq!(primitive["targets"].as_array().map_or(0, Vec::len), poses.len());
            let names: Vec<&String> = primitive["attributes"].as_object().unwrap().keys().collect();
            assert_eq!(names, ["POSITION"]);
        }
        let at = attribute(&glb, "POSITION", 3);
        let at: Vec<Vec3> = at.iter().map(|p| Vec3::from_slice(p)).collect();
        assert!(relative_error(&model.positions, &at) < ROUND_TRIP, "{at:?}");
    }
}

/// A channel of KHR_animation_pointer can animate the weights of a node or of a mesh.
#[test]
fn static_export_has_no_channels_of_morph_weights() {
    for pointer in ["/nodes/0/weights", "/meshes/0/weights"] {
        let mut b = skinned();
        b.json["animations"][1]["channels"][0]["target"] = json!({
            "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": pointer } }
        });
        let model = read("x.glb", &b.glb()).unwrap();
        let after = json_of(&model.write_glb(&deformed(&model)).unwrap());
        assert_eq!(after["animations"].as_array().unwrap().len(), 1, "{pointer}");
        assert_eq!(after["animations"][0]["channels"][0]["target"]["path"], "rotation");
    }
}

/// UniVRM writes the names of morph targets to the extras of primitives.
#[test]
fn static_export_forgets_the_target_names_of_primitives() {
    let mut b = skinned();
    let names = json!({ "targetNames": ["wide"], "kept": 7 });
    b.json["meshes"][0]["extras"] = json!({});
    b.primitive(0)["extras"] = names;
    let model = read("x.glb", &b.glb()).unwrap();
    let after = json_of(&model.write_glb(&deformed(&model)).unwrap());
    assert_eq!(after["meshes"][0]["primitives"][0]["extras"], json!({ "kept": 7 }));
}
