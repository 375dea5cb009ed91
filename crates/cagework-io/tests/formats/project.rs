//! Projects can be read again, and are plain GLBs for other programs.

use std::borrow::Cow;

use cagework_core::{PolygonMesh, subdivided_box};
use cagework_io::{
    Look, Model, ModelFormat, Project, ProjectError, UpAxis, WriteError, read_project, write_cage_obj,
    write_project, write_project_in_pieces,
};
use glam::{DVec3, Vec3};
use serde_json::json;

use crate::common::{
    self, CUBE_OBJ, PNG, glb, instanced, json_of, plain_cube, quantized, read, skinned, textured_square,
};

const SETTINGS: &str = r#"{"grid":128,"name":"Überpose"}"#;

fn models() -> Vec<Model> {
    let square = textured_square().glb();
    let square =
        Model::read("square.glb", &square, &mut |uri| (uri == "red dot.png").then(|| Ok(PNG.to_vec())));
    let mut models = vec![square.unwrap()];
    models.extend(
        [plain_cube(), instanced(), skinned(), quantized()].map(|b| read("x.glb", &b.glb()).unwrap()),
    );
    models.push(read("box.obj", CUBE_OBJ.as_bytes()).unwrap());
    for name in ["box.ply", "box.stl"] {
        let cube = read("box.obj", CUBE_OBJ.as_bytes()).unwrap();
        let format = ModelFormat::of_export(name).unwrap();
        models.push(read(name, &cube.write(format, &cube.positions).unwrap()).unwrap());
    }
    models
}

fn cage(model: &Model) -> PolygonMesh {
    subdivided_box(bounds(&model.positions), 0.1, [2, 1, 1])
}

fn poses(cage: &PolygonMesh) -> Vec<(String, Vec<Vec3>)> {
    let moved = |by: Vec3| cage.positions.iter().map(|&p| p + by).collect();
    vec![("raised".to_owned(), moved(Vec3::Y)), ("ä \"quoted\"".to_owned(), moved(Vec3::splat(0.1)))]
}

fn written(model: &Model) -> Vec<u8> {
    let cage = cage(model);
    write_project(&[model], &cage, &poses(&cage), SETTINGS).unwrap()
}

fn reopened(bytes: &[u8]) -> Project {
    read_project("saved.glb", bytes, u64::MAX).unwrap().unwrap()
}

/// Removes the names of images, because projects store names of textures differently.
fn without_names(mut look: Look) -> Look {
    look.images.iter_mut().for_each(|image| image.name.clear());
    look
}

#[test]
fn project_round_trip_is_exact() {
    for model in models() {
        let project = reopened(&written(&model));
        assert_eq!(project.models[0].name, model.name);
        assert_eq!(project.models[0].format(), model.format(), "{}", model.name);
        assert_eq!(project.models[0].positions, model.positions, "{}", model.name);
        assert_eq!(project.models[0].triangles, model.triangles);
        assert_eq!(project.models[0].counts, model.counts, "{}", model.name);
        assert_eq!(project.models[0].notices, model.notices);
        assert_eq!(without_names(project.models[0].look()), without_names(model.look()), "{}", model.name);
        let cage = cage(&model);
        assert_eq!((&project.cage, &project.poses), (&cage, &poses(&cage)));
        assert_eq!(project.settings, SETTINGS);
    }
}

#[test]
fn several_models_keep_their_order() {
    let models = models();
    let all: Vec<&Model> = models.iter().collect();
    let cage = cage(&models[0]);
    let once = write_project(&all, &cage, &poses(&cage), SETTINGS).unwrap();
    let project = reopened(&once);
    assert_eq!(project.models.len(), models.len());
    for (back, model) in project.models.iter().zip(&models) {
        assert_eq!((&back.name, back.format()), (&model.name, model.format()));
        assert_eq!((&back.positions, &back.triangles), (&model.positions, &model.triangles));
        assert_eq!(without_names(back.look()), without_names(model.look()), "{}", model.name);
    }
    assert_eq!((project.cage, project.poses), (cage.clone(), poses(&cage)));
    let again: Vec<&Model> = project.models.iter().collect();
    let twice = write_project(&again, &cage, &poses(&cage), SETTINGS).unwrap();
    assert!(twice.len() <= once.len() + 64, "{} then {}", once.len(), twice.len());
}

#[test]
fn projects_above_a_limit_are_refused() {
    let models = models();
    let all: Vec<&Model> = models.iter().collect();
    let cage = PolygonMesh::default();
    let within = |models: &[&Model], limit| {
        let mut written = None;
        let mut write = |pieces: &[Cow<'_, [u8]>]| written = Some(pieces.concat());
        write_project_in_pieces(models, &cage, &[], "{}", limit, &mut write)?;
        Ok(written)
    };
    let whole = write_project(&all, &cage, &[], "{}").unwrap();
    let bytes = whole.len() as u64;
    assert_eq!(within(&all, bytes), Ok(Some(whole)));
    assert_eq!(within(&all, bytes - 1), Err(WriteError::Limit { bytes, limit: bytes - 1 }));
    // Eight vertices and six faces have at least 12 and 6 bytes each in the visible mesh.
    let cube = read("box.obj", CUBE_OBJ.as_bytes()).unwrap();
    assert_eq!(within(&[&cube], 131), Err(WriteError::Limit { bytes: 8 * 12 + 6 * 6, limit: 131 }));
}

/// Cage and poses are stored relative to the models' origin, and a node places the cage for other programs.
#[test]
fn projects_far_from_the_origin_keep_their_origin() {
    let place = DVec3::new(500_000.25, 0.0, -4_500_000.5);
    let mut b = plain_cube();
    b.json["nodes"][0]["translation"] = json!(place.to_array());
    let cube = read("x.glb", &b.glb()).unwrap();
    let text = String::from_utf8(write_cage_obj(&cube.cage_mesh(), cube.origin())).unwrap();
    for mut model in [cube.clone(), read("x.obj", text.as_bytes()).unwrap()] {
        model.set_origin(cube.origin());
        let cage = cage(&model);
        let bytes = write_project(&[&model, &cube], &cage, &poses(&cage), SETTINGS).unwrap();
        let project = reopened(&bytes);
        assert_eq!((&project.cage, &project.poses), (&cage, &poses(&cage)));
        for (back, model) in project.models.iter().zip([&model, &cube]) {
            assert_eq!((back.origin(), &back.positions), (model.origin(), &model.positions));
        }
        let json = json_of(&bytes);
        let lines = json["nodes"].as_array().unwrap().last().unwrap();
        assert_eq!(lines["translation"], json!(cube.origin().to_array()));
        for origin in [json!([1.0, 2.0]), json!([f64::MAX, 0.0, 0.0])] {
            let mut json = json.clone();
            json["extensions"]["CAGEWORK_project"]["origin"] = origin;
            let bin = &bytes[bytes.len() - json["buffers"][0]["byteLength"].as_u64().unwrap() as usize..];
            let damaged = read_project("saved.glb", &glb(&json, Some(bin)), u64::MAX);
            assert!(damaged.unwrap_err().to_string().contains("its origin is"));
        }
    }
}

#[test]
fn up_axis_is_kept_and_other_programs_see_the_files_axes() {
    for mut model in models() {
        let lying = model.positions.clone();
        model.set_up(UpAxis::Z);
        let bytes = written(&model);
        let project = reopened(&bytes);
        assert_eq!((project.models[0].up(), &project.models[0].positions), (UpAxis::Z, &model.positions));
        let cage = cage(&model);
        assert_eq!((&project.cage, &project.poses), (&cage, &poses(&cage)));
        let seen = read("seen.glb", &bytes).unwrap();
        assert_eq!(bounds(&seen.positions), bounds(&lying), "{}", model.name);
        let json = json_of(&bytes);
        let lines =
            json["meshes"].as_array().unwrap().last().unwrap()["primitives"][0]["attributes"]["POSITION"]
                .as_u64()
                .unwrap();
        let in_file = bounds(&UpAxis::Z.mesh_turned_back(&cage).positions);
        assert_eq!(json["accessors"][lines as usize]["max"], json!(in_file.max.to_array()));
    }
}

fn bounds(positions: &[Vec3]) -> cagework_core::Bounds {
    cagework_core::Bounds::around(positions).unwrap()
}

#[test]
fn saving_repeatedly_does_not_grow_the_file() {
    for model in models() {
        let once = written(&model);
        let twice = written(&reopened(&once).models[0]);
        let thrice = written(&reopened(&twice).models[0]);
        assert_eq!(twice.len(), thrice.len(), "{}", model.name);
        assert!(twice.len() <= once.len() + 64, "{}: {} then {}", model.name, once.len(), twice.len());
    }
}

#[test]
fn other_programs_see_the_model_and_the_cage_as_lines() {
    let model = models().remove(0);
    let bytes = written(&model);
    let seen = read("seen.glb", &bytes).unwrap();
    assert_eq!(seen.positions, model.positions);
    let json = json_of(&bytes);
    let node = json["nodes"].as_array().unwrap().last().unwrap();
    let mesh = &json["meshes"][node["mesh"].as_u64().unwrap() as usize];
    assert_eq!((&node["name"], &mesh["primitives"][0]["mode"]), (&json!("cage"), &json!(1)));
}

#[test]
fn other_files_are_not_projects() {
    for bytes in [plain_cube().glb(), CUBE_OBJ.as_bytes().to_vec(), Vec::new(), b"glTF".to_vec()] {
        assert!(read_project("x.glb", &bytes, u64::MAX).unwrap().is_none());
    }
}

#[test]
fn damaged_projects_and_those_of_other_versions_are_errors() {
    let bytes = written(&models()[1]);
    let mut json = json_of(&bytes);
    let bin = &bytes[bytes.len() - json["buffers"][0]["byteLength"].as_u64().unwrap() as usize..];
    let version = json["extensions"]["CAGEWORK_project"]["version"].clone();
    for other in [3, 7] {
        json["extensions"]["CAGEWORK_project"]["version"] = json!(other);
        let found = read_project("x.glb", &glb(&json, Some(bin)), u64::MAX);
        assert!(matches!(found, Err(ProjectError::Version { found, .. }) if found == other));
    }
    json["extensions"]["CAGEWORK_project"]["version"] = version;
    json["extensions"]["CAGEWORK_project"]["cage"]["faces"]["bufferView"] = json!(1_000_000);
    let damaged = read_project("x.glb", &glb(&json, Some(bin)), u64::MAX);
    assert!(matches!(damaged, Err(ProjectError::Damaged { .. })), "{damaged:?}");
    assert!(read_project("x.glb", &bytes[..bytes.len() - 9], u64::MAX).is_err());
}

/// A small file could otherwise hold any number of poses of a large cage, or of models.
#[test]
fn parts_that_share_their_bytes_are_an_error() {
    let bytes = written(&models()[1]);
    let json = json_of(&bytes);
    let bin = &bytes[bytes.len() - json["buffers"][0]["byteLength"].as_u64().unwrap() as usize..];
    let project = json["extensions"]["CAGEWORK_project"].clone();
    for (list, part, problem) in [
        ("poses", &project["poses"][0], "poses share their positions"),
        ("more", &project["cage"]["positions"], "models share their bytes"),
    ] {
        let mut json = json.clone();
        json["extensions"]["CAGEWORK_project"][list] = vec![part.clone(); 10_000].into();
        let shared = read_project("x.glb", &glb(&json, Some(bin)), u64::MAX).unwrap_err();
        assert_eq!(shared.to_string(), format!("x.glb is a damaged project: its {problem}"));
    }
}

/// A point cloud in a project is stored as its file.
#[test]
fn point_clouds_survive_in_projects() {
    let file = b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 0 255 0 0\n1 2 3 0 255 0\n";
    let model = read("a.ply", file).unwrap();
    let project = reopened(&written(&model));
    let again = &project.models[0];
    assert_eq!(
        (again.format(), &*again.name, &again.positions),
        (ModelFormat::Ply, "a.ply", &model.positions)
    );
    let splats = again.drawn_splats().unwrap();
    assert_eq!(splats.colors, [Vec3::X, Vec3::Y]);
    assert!(splats.scales[0].x > 0.0 && splats.scales[0].x < 3.0);
}

/// A project stores a 3MF as the original file.
#[test]
fn archives_survive_in_projects() {
    let model = read("a.3mf", &common::plate()).unwrap();
    let project = reopened(&written(&model));
    assert_eq!(project.models[0].write(ModelFormat::ThreeMf, &model.positions).unwrap(), common::plate());
}

/// A project of a capture keeps its splats and its up axis.
#[test]
fn captures_survive_in_projects() {
    let mut file = Vec::new();
    for k in 0..5_u8 {
        let numbers = [f32::from(k), 1.0, 2.0, 0.1, 0.2, 0.3];
        file.extend(numbers.into_iter().flat_map(f32::to_le_bytes));
        file.extend([10 * k, 20, 30, 200, 255, 128, 128, 128]);
    }
    for up in [UpAxis::Y, UpAxis::Z] {
        let mut model = read("a.splat", &file).unwrap();
        model.set_up(up);
        let project = reopened(&written(&model));
        let again = &project.models[0];
        assert_eq!((again.format(), again.up(), &*again.name), (ModelFormat::Splat, up, "a.splat"));
        assert_eq!(again.splats(), model.splats());
    }
}

#[test]
fn the_project_among_the_samples_of_the_page_is_read() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../web/public/samples/wardrobe.glb");
    let bytes = std::fs::read(path).unwrap();
    assert!(read_project("wardrobe.glb", &bytes, u64::MAX).unwrap().is_some());
}
