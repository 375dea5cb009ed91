//! FBX files, whose expected positions follow from the file by formula.

use cagework_io::{Model, ModelFormat, fbx_displacements};
use glam::{DVec2, Mat3, Vec3};
use serde_json::{Value, json};

use crate::common::fbx::{
    self, BOX, Item, binary, connect, corners, geometry, object, placed, property, rigged, rigged_with, text,
    texture,
};
use crate::common::{PNG, json_of, read, volume};

/// A point of an FBX file, centimetres with z up, in metres with y up.
fn metres([x, y, z]: [f32; 3]) -> Vec3 {
    Vec3::new(x, z, -y) / 100.0
}

/// The corner of the box at `point`, both in metres.
fn corner_at(point: Vec3, placed: impl Fn([f32; 3]) -> [f32; 3]) -> usize {
    let at = |corner: &[f64; 3]| metres(placed(corner.map(|x| x as f32)));
    corners().iter().position(|corner| at(corner).distance(point) < 1e-6).expect("it is a corner of the box")
}

fn file(items: &[Item]) -> Model {
    read("box.fbx", &binary(items)).unwrap()
}

#[test]
fn pivots_units_and_axes_place_a_mesh() {
    let model = file(&placed());
    // Translation, pre-rotation of 90 degrees about z, geometric translation.
    let place = |[x, y, z]: [f32; 3]| [10.0 - y, 20.0 + x, 30.0 + z + 5.0];
    let found: Vec<usize> = model.positions.iter().map(|&p| corner_at(p, place)).collect();
    assert!((0..8).all(|corner| found.contains(&corner)), "{found:?}");
    assert_eq!((model.triangles.len(), model.counts.primitives, model.counts.materials), (12, 2, 2));
    let size = BOX[0] * BOX[1] * BOX[2] / 1e6;
    assert!((f64::from(volume(&model)) - size).abs() < 1e-5, "{}", volume(&model));
    assert_eq!(model.format(), ModelFormat::Gltf);
}

#[test]
fn text_and_binary_are_the_same_model() {
    for items in [placed(), rigged()] {
        let [a, b] = [text(&items), binary(&items)].map(|bytes| read("x", &bytes).unwrap());
        assert_eq!(a.write_glb(&a.positions), b.write_glb(&b.positions));
    }
}

#[test]
fn textures_are_looked_for_beside_the_file() {
    let missing = file(&placed());
    let notice = "texture 'wood grain.png' is missing: exports keep the reference";
    assert!(missing.notices.iter().any(|found| found == notice), "{:?}", missing.notices);
    let mut asked = Vec::new();
    let mut beside = |name: &str| {
        asked.push(name.to_owned());
        Some(Ok(PNG.to_vec()))
    };
    let model = Model::read("box.fbx", &binary(&placed()), &mut beside).unwrap();
    assert_eq!(asked, ["wood grain.png"]);
    let json = json_of(&model.write_glb(&model.positions).unwrap());
    assert_eq!(json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
    assert_eq!(json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][0], 1.0);
}

/// A box with a physical material of 3ds Max. The base colour's image has its opacity, too.
fn painted(metalness: f64, scaling: &[f64], degrees: f64) -> Model {
    let main = |name: &str| format!("3dsMax|main|{name}");
    let properties = vec![
        property("3dsMax|ClassIDa", "int", &[-804_315_648.0]),
        property("3dsMax|ClassIDb", "int", &[-1_099_438_848.0]),
        property(&main("metalness"), "Float", &[metalness]),
    ];
    let moved = vec![
        property("Translation", "Vector", &[0.25, 0.0, 0.0]),
        property("Rotation", "Vector", &[0.0, 0.0, degrees]),
        property("Scaling", "Vector", scaling),
    ];
    let mut objects = vec![
        geometry(1),
        object("Model", 2, "crate", "Mesh", Vec::new(), Vec::new()),
        object("Material", 20, "wood", "", properties, Vec::new()),
        texture(22, "base", "base.png", moved),
    ];
    let mut connections = vec![connect(2, 0, ""), connect(1, 2, ""), connect(20, 2, "")];
    connections.extend(["base_color_map", "opacity_map"].map(|map| connect(22, 20, &main(map))));
    for (id, map) in (23..).zip(["Roughness_Map", "ao_map", "displacement_map"]) {
        objects.push(texture(id, map, &format!("{map}.png"), Vec::new()));
        connections.push(connect(id, 20, &main(map)));
    }
    file(&fbx::file(objects, connections))
}

#[test]
fn textures_are_kept_where_gltf_reads_the_same_channels() {
    let model = painted(0.0, &[0.5, 0.5, 1.0], 90.0);
    let lost = "1 texture of roughness, opacity or other properties: not converted from FBX";
    assert!(model.notices.iter().any(|found| found == lost), "{:?}", model.notices);
    let json = json_of(&model.write_glb(&model.positions).unwrap());
    let (material, images) = (&json["materials"][0], &json["images"]);
    let image = |info: &Value| {
        let texture = &json["textures"][info["index"].as_u64().unwrap() as usize];
        images[texture["source"].as_u64().unwrap() as usize]["uri"].as_str().unwrap().to_owned()
    };
    let surface = &material["pbrMetallicRoughness"];
    assert_eq!(image(&surface["metallicRoughnessTexture"]), "Roughness_Map.png");
    assert_eq!((&surface["metallicFactor"], &surface["roughnessFactor"]), (&0.0.into(), &1.0.into()));
    assert_eq!(image(&material["occlusionTexture"]), "ao_map.png");
    assert_eq!((&material["alphaMode"], &surface["baseColorFactor"][3]), (&"BLEND".into(), &1.0.into()));

    // In FBX, v points upwards, and the image is scaled by 1/2, turned by 90 degrees and moved by (1/4, 0).
    assert_eq!(json["extensionsUsed"], json!(["KHR_texture_transform"]));
    let transform = &surface["baseColorTexture"]["extensions"]["KHR_texture_transform"];
    let number = |value: &Value| value.as_f64().unwrap();
    let pair = |key: &str| DVec2::new(number(&transform[key][0]), number(&transform[key][1]));
    let (sin, cos) = number(&transform["rotation"]).sin_cos();
    for uv in [DVec2::new(0.0, 0.0), DVec2::new(1.0, 0.25), DVec2::new(-0.5, 2.0)] {
        let back = uv - DVec2::new(0.25, 0.0);
        let expected = DVec2::new(back.y, -back.x) / 0.5;
        let scaled = pair("scale") * DVec2::new(uv.x, 1.0 - uv.y);
        let turned = DVec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x);
        let found = turned + pair("offset");
        assert!(DVec2::new(found.x, 1.0 - found.y).distance(expected) < 1e-6, "{uv}: {found}");
    }
}

#[test]
fn textures_that_gltf_cannot_express_are_named() {
    // A grey image of roughness would also be read as metalness. An image that is stretched, then turned, is sheared.
    let model = painted(0.5, &[0.5, 1.0, 1.0], 45.0);
    let json = json_of(&model.write_glb(&model.positions).unwrap());
    let surface = &json["materials"][0]["pbrMetallicRoughness"];
    assert_eq!((surface.get("metallicRoughnessTexture"), &surface["metallicFactor"]), (None, &0.5.into()));
    assert!(surface["baseColorTexture"].get("extensions").is_none());
    let notices = [
        "2 textures of roughness, opacity or other properties: not converted from FBX",
        "the transform of texture 'base' in the FBX file is left out: glTF scales an image before it turns it",
    ];
    for notice in notices {
        assert!(model.notices.iter().any(|found| found == notice), "{:?}", model.notices);
    }
}

/// The clip turns the upper corners about x by 90 degrees per second, and moves corner 0 by 8 cm in a second.
#[test]
fn skins_shapes_and_clips_move_as_in_the_file() {
    moves_as_in_the_file(&file(&rigged()), 0.0);
}

/// Saved with a bent joint and a turned root, the box is opened as it was bound. The clip turns the joint only, and keeps the
/// root as it was saved.
#[test]
fn a_figure_is_opened_in_the_pose_of_its_skin() {
    let turned = |degrees: [f64; 3]| vec![property("Lcl Rotation", "Lcl Rotation", &degrees)];
    let model = file(&rigged_with(turned([0.0, 30.0, 0.0]), turned([90.0, 0.0, 0.0])));
    for &at in &model.positions {
        let rest = metres(corners()[corner_at(at, |p| p)].map(|x| x as f32));
        assert!(rest.distance(at) < 1e-6, "{at}, not {rest}");
    }
    assert!(model.notices.iter().any(|notice| notice.contains("another pose than that of its skin")));
    moves_as_in_the_file(&model, 30.0);
    // Below the limit of 20 degrees, the saved pose is kept.
    let model = file(&rigged_with(Vec::new(), turned([10.0, 0.0, 0.0])));
    assert!(!model.notices.iter().any(|notice| notice.contains("another pose")));
}

/// Checks the clip, with the root turned about y.
fn moves_as_in_the_file(model: &Model, degrees: f32) {
    let of_root = Mat3::from_rotation_y(degrees.to_radians());
    assert!(model.is_rigged());
    let clips = model.clips();
    assert_eq!(clips.iter().map(|clip| clip.name.as_deref()).collect::<Vec<_>>(), [Some("bend")]);
    let middle = Vec3::Z * (BOX[2] / 2.0) as f32;
    let times = [0.0, 0.25, 1.0];
    for (seconds, frame) in times.into_iter().zip(model.frames_at(0, &times).unwrap()) {
        let turn = Mat3::from_rotation_x(seconds * std::f32::consts::FRAC_PI_2);
        for (v, &moved) in frame.iter().enumerate() {
            let corner = corner_at(model.positions[v], |p| p);
            let rest = Vec3::from_array(corners()[corner].map(|x| x as f32));
            let expected = match corner {
                0 => rest - seconds * 8.0 * Vec3::X,
                1..=3 => rest,
                _ => middle + turn * (rest - middle),
            };
            let expected = metres((of_root * expected).to_array());
            assert!(
                expected.distance(moved) < 1e-5,
                "corner {corner} at {seconds} s: {moved}, not {expected}"
            );
        }
    }
}

/// A joint can ignore the scale of its parent (`InheritType` 2). It stays a joint, and keeps its name and its place in the
/// skeleton: an additional node would hide it from the search for a humanoid.
#[test]
fn joints_that_ignore_a_scale_keep_their_names() {
    let ignoring = vec![property("InheritType", "enum", &[2.0])];
    let model = file(&rigged_with(vec![property("Lcl Scaling", "Lcl Scaling", &[2.0; 3])], ignoring));
    let rig = model.rest_rig().unwrap().unwrap();
    let names: Vec<&str> = rig.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["root", "tip"]);
    assert_eq!(rig.joints[1].parent, Some(0));
}

#[test]
fn damaged_and_large_files_are_errors() {
    let whole = binary(&rigged());
    for length in [30, 200, whole.len() / 2] {
        let message = read("box.fbx", &whole[..length]).unwrap_err().to_string();
        assert!(message.starts_with("box.fbx: not readable as FBX: "), "{message}");
        assert!(message.ends_with("Export it again, as FBX 7.4 or newer"), "{message}");
    }
    let small = Model::read_within("box.fbx", &whole, &mut |_| None, 100_000).unwrap_err().to_string();
    assert!(small.contains("its contents need more than the limit of"), "{small}");
    let none = read("box.fbx", b"; FBX 7.4.0 project file\nObjects: {\n}\n").unwrap_err().to_string();
    assert!(none.contains("it has no triangles"), "{none}");
}

/// In an NPZ, each name takes as much memory as the longest one.
#[test]
fn displacements_are_refused_before_they_exceed_the_memory_limit() {
    let model = file(&placed());
    let glb = model.write_glb(&model.positions).unwrap();
    assert_eq!(fbx_displacements(&glb, 0, 1 << 20).unwrap().len(), 1);
    let refused = fbx_displacements(&glb, 0, 2 * glb.len() as u64).unwrap_err().to_string();
    assert!(refused.contains("of memory, more than the limit of"), "{refused}");
}
