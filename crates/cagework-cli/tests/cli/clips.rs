//! Tests of `deform --clip`: captures and meshes that follow the clip of a rig.

use cagework_io::Model;
use glam::Vec3;
use predicates::str::contains;
use serde_json::Value;

use crate::rigs::humanoid;
use crate::support::{Sandbox, glb_json};

/// Mean distance of points that follow the cage from those that follow the skin, in heights: the cage of 148 vertices
/// has no skin weights.
const SKIN_ERROR: f32 = 0.02;

/// A folder with the humanoid, its cage, and its vertices as a point cloud without a rig.
fn cloud() -> Sandbox {
    let sandbox = humanoid();
    let model = Model::read("humanoid.glb", &sandbox.read("humanoid.glb"), &mut |_| None).unwrap();
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        model.positions.len()
    );
    let lines = model.positions.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z));
    sandbox.write("cloud.ply", header + &lines.collect::<String>());
    sandbox.run("cage humanoid.glb -o cage.obj").success();
    sandbox
}

const WALK: &str = "deform cloud.ply --cage cage.obj --rig humanoid.glb --clip Walk --fps 2 -o walk.ply";

#[test]
fn a_cloud_walks_as_the_skin_does_in_numbered_files() {
    let sandbox = cloud();
    let done = sandbox.json(&format!("{WALK} --joints-out joints.json --json"));
    assert_eq!((&done["frames"], &done["fitted_by"]), (&5.into(), &"limbs".into()), "{done}");
    let body = Model::read("humanoid.glb", &sandbox.read("humanoid.glb"), &mut |_| None).unwrap();
    for (k, at) in [0.0, 0.5, 1.0, 1.5, 2.0].into_iter().enumerate() {
        let name = format!("walk-000{}.ply", k + 1);
        let frame = Model::read(&name, &sandbox.read(&name), &mut |_| None).unwrap();
        let skinned = body.frames_at(0, &[at]).unwrap().remove(0);
        let distances = frame.positions.iter().zip(&skinned).map(|(a, b)| a.distance(*b));
        let mean = distances.sum::<f32>() / skinned.len() as f32 / 1.87;
        assert!(mean < SKIN_ERROR, "{at} s: {mean}");
    }
    // Joints that are given back give the same files, and a moved one others.
    let first = sandbox.read("walk-0002.ply");
    let again = sandbox.json(&format!("{WALK} --joints-in joints.json --json"));
    assert_eq!((&again["fitted_by"], sandbox.read("walk-0002.ply") == first), (&"given".into(), true));
    let mut joints: Value = serde_json::from_slice(&sandbox.read("joints.json")).unwrap();
    joints["joints"]["leftLowerLeg"][1] = 0.7.into();
    sandbox.write("moved.json", joints.to_string());
    sandbox.run(&format!("{WALK} --joints-in moved.json")).success();
    assert!(sandbox.read("walk-0002.ply") != first);
    let resumed = sandbox.json(&format!("{WALK} --resume --json"));
    assert_eq!(resumed["skipped"], 5);
}

#[test]
fn a_mesh_without_a_rig_gets_a_morph_target_per_frame() {
    let sandbox = cloud();
    let body = Model::read("humanoid.glb", &sandbox.read("humanoid.glb"), &mut |_| None).unwrap();
    let vertex = |p: &Vec3| format!("v {} {} {}\n", p.x, p.y, p.z);
    let face = |t: &[u32; 3]| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    let text = body.positions.iter().map(vertex).chain(body.triangles.iter().map(face));
    sandbox.write("statue.obj", text.collect::<String>());
    sandbox.run("bind statue.obj --cage cage.obj -g 24 --weights w.npz").success();
    let walk = "deform statue.obj --cage cage.obj --weights w.npz --rig humanoid.glb --clip Walk --fps 2";
    sandbox.run(&format!("{walk} -o walk.glb")).success().stdout(contains("limbs of both models"));
    let glb = glb_json(&sandbox.read("walk.glb"));
    assert_eq!(glb["meshes"][0]["primitives"][0]["targets"].as_array().unwrap().len(), 5);
    assert_eq!(glb["animations"].as_array().unwrap().len(), 1);
    sandbox.run(&format!("{walk} -o walk.obj")).success();
    assert!(sandbox.read("walk-0005.obj").starts_with(b"v "));
}

#[test]
fn clips_rigs_and_joints_that_do_not_fit_are_refused() {
    let sandbox = cloud();
    sandbox.run(&WALK.replace("Walk", "Fly")).failure().stderr(contains("there is no clip 'Fly'"));
    sandbox.run(&WALK.replace("--rig humanoid.glb ", "")).failure().stderr(contains("--rig"));
    sandbox.run(&WALK.replace("humanoid.glb", "cage.obj")).failure().stderr(contains("no skeleton"));
    sandbox.run(&format!("{WALK} --pose cage.obj")).failure().stderr(contains("cannot be used with"));
    sandbox.run(&format!("{WALK} --split")).failure().stderr(contains("needs a capture of splats"));
    sandbox.write("joints.json", r#"{"joints": {"tail": [0, 0, 0]}}"#);
    sandbox.run(&format!("{WALK} --joints-in joints.json")).failure().stderr(contains("no bone \"tail\""));
    sandbox.write("joints.json", r#"{"joints": {"hips": 3}}"#);
    sandbox.run(&format!("{WALK} --joints-in joints.json")).failure().stderr(contains("joints.json"));
}
