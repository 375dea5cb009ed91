//! Tests of adding and removing models, and of their settings in projects.

use cagework_core::skin::{Joint, Rig};
use cagework_core::{Bounds, subdivided_box};
use cagework_io::{TransferError, read_project, transfer_report, write_mesh_glb};
use glam::Quat;

use super::*;
use crate::{Command, Contents, Document, Editor, SurfacePoint};

/// Three faces of a tetrahedron translated by `at` along x: one with the material `skin`, two with `cloth`.
fn model(name: &str, at: f32) -> Model {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut text = String::new();
    for [x, y, z] in corners {
        text += &format!("v {} {y} {z}\n", x + at);
    }
    text += "usemtl skin\nf 1 3 2\nusemtl cloth\nf 1 2 4\nf 2 3 4\n";
    let mut model = Model::read(name, text.as_bytes(), &mut |_| None).unwrap();
    model.set_origin(DVec3::ZERO);
    model
}

fn three() -> Models {
    let mut models = Models::default();
    for (name, at) in [("body.obj", 0.0), ("shirt.obj", 10.0), ("hat.obj", 20.0)] {
        models.add([(model(name, at), None)]);
    }
    models
}

/// A model with its settings, as read from a project.
fn again((member, settings): (&Member, &MemberSettings)) -> NewModel {
    ((*member.model).clone(), Some(settings.clone()))
}

fn names(models: &Models) -> Vec<&str> {
    models.iter().map(|member| member.model.name.as_str()).collect()
}

/// VRM 1 (VRMC_vrm) prescribes that a model faces +z, as glTF does; VRM 0 prescribes -z.
#[test]
fn only_vrm_0_faces_negative_z() {
    let faces_back = |extensions: &str| {
        let text = format!(
            r#"{{"asset": {{"version": "2.0"}}, "extensions": {{{extensions}}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
                "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}], "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
                "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}}],
                "buffers": [{{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}]}}"#
        );
        let mut models = Models::default();
        models.add([(Model::read("a.gltf", text.as_bytes(), &mut |_| None).unwrap(), None)]);
        models.faces_negative_z()
    };
    assert!(faces_back(r#""VRM": {"specVersion": "0.0"}"#));
    assert!(!faces_back(r#""VRMC_vrm": {"specVersion": "1.0"}"#) && !faces_back(""));
}

#[test]
fn rigs_are_read_once() {
    let mut models = three();
    // As undo keeps them.
    let copy = models.clone();
    models.extra_points().unwrap();
    let is_read =
        |models: &Models| models.iter().map(|m| m.known.extra_points.get().is_some()).collect::<Vec<_>>();
    assert_eq!((is_read(&models), is_read(&copy)), (vec![true; 3], vec![true; 3]));
    models.replace(models.iter().next().unwrap().id, model("body.obj", 5.0)).unwrap();
    assert_eq!(is_read(&models).iter().filter(|&&read| read).count(), 2, "the new body is read for itself");
}

#[test]
fn surface_points_keep_their_triangle_when_models_change() {
    let mut models = three();
    let of_hat = 7;
    let at = |models: &Models| models.corners(of_hat).map(|c| c.map(|v| models.positions()[v as usize]));
    let before = at(&models).unwrap();
    models.remove(1).unwrap();
    assert_eq!((names(&models), models.triangles().len()), (vec!["body.obj", "hat.obj"], 6));
    assert_eq!(at(&models).unwrap(), before);
    assert_eq!(models.number_of(4), of_hat, "the hat's second triangle is the fifth of the mesh now");
    assert_eq!(models.corners(4), None, "the shirt is not in the cage");
    // A project stores only the models in the cage, with their triangle numbers.
    models.remove(0).unwrap();
    let saved = models.settings();
    let mut opened = Models::default();
    opened.add(models.iter().zip(&saved).map(again));
    assert_eq!(at(&opened).unwrap(), before);
}

#[test]
fn the_last_model_cannot_be_removed() {
    let mut models = three();
    models.remove(0).unwrap();
    models.remove(2).unwrap();
    let error = models.remove(1).unwrap_err();
    assert!(error.to_string().contains("only model"), "{error}");
    assert!(models.remove(9).is_err());
    assert_eq!(names(&models), ["shirt.obj"]);
}

#[test]
fn models_in_one_cage_have_the_origin_of_the_first() {
    let at = |name: &str, x: f64| {
        let text = format!("v {} 0 0\nv {} 0 0\nv {x} 1 0\nf 1 2 3\n", x + 0.25, x + 1.0);
        Model::read(name, text.as_bytes(), &mut |_| None).unwrap()
    };
    let mut models = Models::default();
    assert_eq!((models.origin(), models.origin_notice()), (DVec3::ZERO, None));
    for mut one in [at("a.obj", 4.5e6), at("b.obj", 4.6e6)] {
        if !models.is_empty() {
            one.set_origin(models.origin());
        }
        models.add([(one, None)]);
    }
    let origin = models.origin();
    assert_eq!(models.positions()[3].as_dvec3().x + origin.x, 4.6e6 + 0.25);
    models.remove(0).unwrap();
    assert_eq!(models.origin(), origin, "the cage keeps its place");
    assert!(models.origin_notice().unwrap().contains("seen from 4500000.5, 0, 0"));
}

#[test]
fn parts_are_named_painted_and_kept_in_settings() {
    let mut models = three();
    assert!(models.parts().is_empty());
    let options = |rigid: &[&str], stays: &[&str]| PartOptions {
        rigid: rigid.iter().map(|&s| s.to_owned()).collect(),
        stays: stays.iter().map(|&s| s.to_owned()).collect(),
        ..PartOptions::default()
    };
    models.set_options(0, options(&[], &["material:skin"])).unwrap();
    models.set_options(1, options(&["all"], &[])).unwrap();
    let error = models.set_options(2, options(&["material:gold"], &[])).unwrap_err();
    assert!(error.to_string().contains("material:skin"), "the error lists the parts: {error}");
    assert_eq!(models.get(2).unwrap().options, PartOptions::default());
    models.set_painted(2, vec![0, 255, 255, 51]).unwrap();
    assert!(models.set_painted(2, vec![1; 3]).is_err());
    let expected = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.2];
    let parts = models.parts();
    assert_eq!((parts.stays.as_slice(), &parts.rigid), (&expected[..], &vec![vec![4, 5, 6, 7]]));
    // Convert the settings to JSON and back, as projects do.
    let text = serde_json::to_string(&models.settings()).unwrap();
    let saved: Vec<MemberSettings> = serde_json::from_str(&text).unwrap();
    let mut opened = Models::default();
    opened.add(models.iter().zip(&saved).map(again));
    assert_eq!(opened.parts(), parts);
    assert_eq!(opened.settings(), saved);
    // Settings that do not fit the model are ignored.
    let odd =
        r#"{"first_triangle": 4294967295, "options": {"rigid": ["nobody"]}, "painted": [[255, 4000000000]]}"#;
    let mut other = Models::default();
    let odd: MemberSettings = serde_json::from_str(odd).unwrap();
    other.add([(model("a.obj", 0.0), Some(odd.clone()))]);
    // A second model with the same settings must not overflow the triangle numbers.
    other.add([(model("b.obj", 0.0), Some(odd.clone()))]);
    assert!(other.parts().is_empty());
    assert_eq!(other.settings().len(), 2);
    assert_eq!(
        [MAX_FIRST_TRIANGLE, MAX_FIRST_TRIANGLE + 3].map(|t| other.corners(t)),
        [Some([0, 2, 1]), Some([4, 6, 5])]
    );
}

#[test]
fn a_single_default_model_stores_no_settings() {
    let mut models = Models::default();
    models.add([(model("a.obj", 0.0), None)]);
    assert_eq!(models.settings(), Vec::new());
}

/// A cube around the origin. `body.glb` has two joints, whose weights change along y; the faces of `shirt.obj` alternate between
/// two materials.
fn cube(name: &str, half: f32) -> Model {
    let bounds = Bounds { min: Vec3::splat(-half), max: Vec3::splat(half) };
    let mesh = subdivided_box(bounds, 0.0, [3; 3]);
    let corners = |f: &Vec<u32>| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]];
    let mesh = TriMesh {
        positions: mesh.positions.clone(),
        triangles: mesh.faces.iter().flat_map(corners).collect(),
    };
    let joint = |name, y, parent| Joint { name, at: Vec3::Y * y, parent };
    let share = |p: &Vec3| [(0, 0.5 - p.y), (1, 0.5 + p.y), (0, 0.0), (0, 0.0)];
    let rig = Rig {
        joints: vec![joint("hips", -0.5, None), joint("chest", 0.0, Some(0))],
        influences: mesh.positions.iter().map(share).collect(),
        clip: "still",
        times: vec![0.0],
        turns: vec![vec![Quat::IDENTITY]; 2],
        root: vec![Vec3::ZERO],
    };
    let vertex = |p: &Vec3| format!("v {} {} {}\n", p.x, p.y, p.z);
    let face =
        |(k, t): (usize, &[u32; 3])| format!("usemtl {}\nf {} {} {}\n", k % 2, t[0] + 1, t[1] + 1, t[2] + 1);
    let bytes = match name {
        "shirt.obj" => {
            let faces = mesh.triangles.iter().enumerate().map(face);
            mesh.positions.iter().map(vertex).chain(faces).collect::<String>().into_bytes()
        }
        _ => write_mesh_glb(name, &mesh, &[], (name == "body.glb").then_some(&rig)).unwrap(),
    };
    Model::read(name, &bytes, &mut |_| None).unwrap()
}

#[test]
fn a_model_that_gets_a_skin_keeps_place_paint_and_pins() {
    for name in ["shirt.glb", "shirt.obj"] {
        let (body, shirt) = (cube("body.glb", 0.5), cube(name, 0.51));
        let mut editor = Editor::default();
        let pins = vec![SurfacePoint { triangle: 5, bary: [1.0, 0.0, 0.0] }];
        let models = [(shirt.clone(), None), (body.clone(), None)];
        editor.open(models, Contents { pins: pins.clone(), ..Contents::default() });
        let amount = |p: &Vec3| (100.0 + 50.0 * p.y + 20.0 * p.x) as u8;
        let amounts: Vec<u8> = shirt.positions.iter().map(amount).collect();
        let options = PartOptions { shown: false, rigid: vec![WHOLE_MODEL.to_owned()], stays: Vec::new() };
        editor.apply(Command::SetPainted { id: 0, amounts }).unwrap();
        editor.apply(Command::SetParts { id: 0, options: options.clone() }).unwrap();
        editor.amend();
        let before = editor.document().clone();
        let joints = |editor: &Editor| {
            let all = editor.document().models.iter();
            all.map(|member| member.model.counts.joints).collect::<Vec<_>>()
        };

        let (dressed, found) = shirt.with_skin_of(&body, u64::MAX).unwrap();
        // A cube of 3 x 3 faces per side has 4^3 - 2^3 vertices.
        assert_eq!(
            transfer_report(&found),
            ["56 positions like the closest point of the body", "2 joints of the body"]
        );
        let refused = dressed.with_skin_of(&body, u64::MAX).unwrap_err();
        assert_eq!(refused, TransferError::HasSkin("shirt.glb".into()));
        assert!(editor.replace_model(7, dressed.clone()).is_err());
        assert!(editor.document().is_same(&before));
        let id = editor.replace_model(0, dressed).unwrap();
        assert!(editor.commit("rig"));
        let Document { models, cage, pose, .. } = editor.document();
        assert_eq!((names(models), joints(&editor)), (vec!["shirt.glb", "body.glb"], vec![2, 2]));
        let member = models.first().unwrap();
        assert_eq!((member.id, &member.options), (id, &options));
        assert!(member.positions().iter().zip(&*member.painted).all(|(p, &painted)| painted == amount(p)));
        assert_eq!((cage, pose), (&before.cage, &before.pose));
        let place = |models: &Models| models.corners(5).map(|c| c.map(|v| models.positions()[v as usize]));
        // The GLB of an OBJ sorts triangles by material, so the pin's triangle is not known.
        let expected = if name == "shirt.glb" { place(&before.models) } else { None };
        assert_eq!(place(models), expected);

        assert!(editor.undo());
        assert_eq!((joints(&editor), editor.document() == &before), (vec![0, 2], true));
        assert!(editor.redo());
        assert_eq!(joints(&editor), [2, 2]);
        let project = read_project("a.glb", &editor.write_project("{}").unwrap(), u64::MAX).unwrap().unwrap();
        let again: Vec<_> = project.models.iter().map(|model| (&*model.name, model.counts.joints)).collect();
        assert_eq!(again, [("shirt.glb", 2), ("body.glb", 2)]);
        let settings = editor.document().models.settings();
        let mut opened = Models::default();
        opened.add(project.models.into_iter().zip(settings.into_iter().map(Some)));
        assert_eq!(opened.first().unwrap().painted, editor.document().models.first().unwrap().painted);
    }
}
