//! FBX files in a cage: exports as GLB, and displacements for the original file.

#[path = "../../../cagework-io/tests/common/fbx.rs"]
mod files;

use cagework_core::Bounds;
use cagework_io::Model;
use files::{binary, corners, placed, rigged, text};
use glam::{Affine3A, Quat, Vec3};
use predicates::str::contains;
use serde_json::Value;

use crate::support::{CORNERS, Sandbox, box_obj};

const DEFORM: &str = "deform box.fbx --cage cage.obj --weights w.npz --pose pose.obj";

/// A scale by 1.3, a turn by 20 degrees and a shift.
fn map() -> Affine3A {
    let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, 2.0) / 3.0, 20_f32.to_radians());
    Affine3A::from_scale_rotation_translation(Vec3::splat(1.3), turn, Vec3::new(0.3, -0.2, 0.5))
}

/// A folder with an FBX file bound to a box, and with the box under [`map`]. Also returns the model.
fn bound(fbx: &[u8]) -> (Sandbox, Model) {
    let sandbox = Sandbox::new();
    let model = Model::read("box.fbx", fbx, &mut |_| None).unwrap();
    let Bounds { min, max } = Bounds::around(&model.positions).unwrap();
    let around = CORNERS
        .map(|corner| (min + max) / 2.0 + 0.7 * (max - min) * Vec3::from_array(corner.map(|x| x as f32)));
    let file = |at: [Vec3; 8]| box_obj(&at.map(|p| p.to_array().map(f64::from)));
    sandbox.write("box.fbx", fbx);
    sandbox.write("cage.obj", file(around));
    sandbox.write("pose.obj", file(around.map(|p| map().transform_point3(p))));
    sandbox.run("bind box.fbx --cage cage.obj -g 16 --weights w.npz").success();
    (sandbox, model)
}

/// A point of the file, centimetres with z up, in metres with y up.
fn metres([x, y, z]: [f32; 3]) -> Vec3 {
    Vec3::new(x, z, -y) / 100.0
}

fn points(list: &Value) -> Vec<Vec3> {
    serde_json::from_value::<Vec<[f32; 3]>>(list.clone()).unwrap().into_iter().map(Vec3::from).collect()
}

/// Places a point of the box in the world, centimetres.
type Place = fn([f32; 3]) -> [f32; 3];

/// By linear precision, every vertex of the export is the image of a vertex under the map of the cage. The same holds for
/// the control points of the file with their displacements, after the transforms of the file.
#[test]
fn affine_map_of_the_cage_is_applied_to_vertices_and_control_points() {
    // Geometric translation, pre-rotation of 90 degrees about z, translation.
    let turned: Place = |[x, y, z]| [10.0 - y, 20.0 + x, 30.0 + z + 5.0];
    let as_it_is: Place = |p| p;
    let files = [("crate", text(&placed()), turned), ("body", binary(&rigged()), as_it_is)];
    for (node, fbx, place) in files {
        let (sandbox, model) = bound(&fbx);
        sandbox
            .run(&format!("{DEFORM} -o out.glb --displacements d.json"))
            .success()
            .stdout(contains("wrote d.json"));
        let out = Model::read("out.glb", &sandbox.read("out.glb"), &mut |_| None).unwrap();
        assert_eq!(out.positions.len(), model.positions.len());
        for (before, after) in model.positions.iter().zip(&out.positions) {
            let image = map().transform_point3(*before);
            assert!(image.distance(*after) < 1e-5, "{node}: {before} became {after}, not {image}");
        }

        let file: Value = serde_json::from_slice(&sandbox.read("d.json")).unwrap();
        assert_eq!(file["poses"], serde_json::json!(["pose"]));
        assert_eq!(file["meshes"].as_array().unwrap().len(), 1);
        let mesh = &file["meshes"][0];
        assert_eq!((&mesh["node"], &mesh["mesh"]), (&node.into(), &"box".into()));
        assert_eq!(mesh["indices"], serde_json::json!([0, 1, 2, 3, 4, 5, 6, 7]));
        let (at, by) = (points(&mesh["positions"]), points(&mesh["displacements"][0]));
        for (k, corner) in corners().into_iter().enumerate() {
            let corner = Vec3::from_array(corner.map(|x| x as f32));
            assert!(corner.distance(at[k]) < 1e-4, "{node}: point {k} is at {corner}, not {}", at[k]);
            let [before, after] = [corner, corner + by[k]].map(|p| metres(place(p.to_array())));
            let image = map().transform_point3(before);
            assert!(image.distance(after) < 1e-5, "{node}: point {k} moved to {after}, not {image}");
        }
    }
}

#[test]
fn displacements_need_an_fbx() {
    let (sandbox, _) = bound(&binary(&rigged()));
    sandbox
        .run(&format!("{DEFORM} --displacements d.npz"))
        .success()
        .stdout(contains("wrote d.npz: pose pose"));
    sandbox.run(&format!("{DEFORM} --displacements d.txt")).failure().stderr(contains(".npz or .json"));
    sandbox
        .run(&format!("{DEFORM} --ground --displacements d.npz"))
        .failure()
        .stderr(contains("cannot be used"));

    let other = Sandbox::with_sphere_in_box();
    other.run("bind mesh.obj --cage cage.obj -g 16 --weights w.npz").success();
    let refused =
        "deform mesh.obj --cage cage.obj --weights w.npz --pose cage.obj -o out.obj --displacements d.npz";
    other.run(refused).failure().stderr(contains("mesh.obj: --displacements needs a model from an FBX file"));
    assert!(!other.names().contains(&"out.obj".into()), "nothing is written");
}
