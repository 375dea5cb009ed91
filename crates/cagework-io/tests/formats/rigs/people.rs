//! Deforms the walking sample by its own cage, and checks the skeleton and the clips of the export.

use cagework_cage::generate::{CageOptions, generate};
use cagework_cage::samples;
use cagework_core::bind::bind;
use cagework_core::deform::displacements;
use cagework_core::progress::NoProgress;
use cagework_core::{BindOptions, Cage};
use cagework_io::{Joints, Model, Player, ReshapeOptions, ReshapeReport, write_mesh_glb};
use glam::{DVec3, Mat3, Mat4, Vec3, vec3};

use serde_json::json;

use super::{player, read};
use crate::common::{Builder, json_of};

/// The walking sample, and its export with displaced cage vertices.
fn shaped(moved: impl Fn(Vec3) -> Vec3, joints: Joints) -> (Model, Model, ReshapeReport) {
    let sample = samples::build("humanoid").unwrap();
    let glb = write_mesh_glb(&sample.name, &sample.mesh, &sample.colours, sample.rig.as_ref()).unwrap();
    let (model, cage) = (read(&glb), Cage::new(&sample.cage).unwrap());
    let (shaped, report) = by_cage(&model, &cage, moved, joints);
    (model, shaped, report)
}

/// Reshapes a model by displaced cage vertices and reads the export.
fn by_cage(
    model: &Model,
    cage: &Cage,
    moved: impl Fn(Vec3) -> Vec3,
    joints: Joints,
) -> (Model, ReshapeReport) {
    let mut points = model.positions.clone();
    points.extend(model.extra_points().unwrap());
    let binding = bind(&points, cage, &BindOptions::default(), &NoProgress).unwrap();
    let posed: Vec<Vec3> = cage.positions().iter().map(|&p| moved(p)).collect();
    let by = displacements(&binding.weights, &binding.frames, cage.positions(), &posed);
    let outside: Vec<u32> = binding.outside.iter().map(|o| o.vertex).collect();
    let options = ReshapeOptions { joints, ..ReshapeOptions::default() };
    let (bytes, report) = model.write_reshaped(&by, &outside, &[], &options).unwrap();
    (read(&bytes), report)
}

/// Lengthens the arms by half, starting at the shoulders (x = 0.2). Arms are above y = 1.1.
fn arms(p: Vec3) -> Vec3 {
    let beyond = if p.y > 1.1 { (p.x.abs() - 0.2).max(0.0) } else { 0.0 };
    p + Vec3::X * p.x.signum() * 0.5 * beyond
}

/// World position of a named node; joints have no rotation at rest.
fn origin(model: &Model, name: &str) -> Vec3 {
    let json = json_of(&model.write_reshaped(&still(model), &[], &[], &ReshapeOptions::default()).unwrap().0);
    let nodes = json["nodes"].as_array().unwrap();
    let mut number = nodes.iter().position(|n| n["name"] == name).unwrap();
    let mut at = Vec3::ZERO;
    loop {
        let [x, y, z] = [0, 1, 2].map(|k| nodes[number]["translation"][k].as_f64().unwrap_or(0.0) as f32);
        at += vec3(x, y, z);
        let is_parent = |n: &serde_json::Value| {
            n["children"].as_array().is_some_and(|c| c.iter().any(|c| c.as_u64() == Some(number as u64)))
        };
        match nodes.iter().position(is_parent) {
            Some(parent) => number = parent,
            None => return at,
        }
    }
}

fn still(model: &Model) -> Vec<DVec3> {
    vec![DVec3::ZERO; model.positions.len() + model.extra_points().unwrap().len()]
}

#[test]
fn joints_of_lengthened_arms_follow_the_arms() {
    let (model, longer, _) = shaped(arms, Joints::Follow);
    for name in ["forearm.L", "hand.R"] {
        let (before, after) = (origin(&model, name), origin(&longer, name));
        // The limb has a length of 0.8, and the tolerance is 2 % of this length.
        assert!(after.distance(arms(before)) <= 0.016, "{name}: {after} instead of {}", arms(before));
    }
    let knee = origin(&model, "shin.L");
    assert!(origin(&longer, "shin.L").distance(knee) <= 1e-3);
    let (_, stays, report) = shaped(arms, Joints::Stay);
    assert_eq!(origin(&stays, "forearm.L"), origin(&model, "forearm.L"));
    assert_eq!((report.joints_moved, report.tracks), (0, 0));
}

/// Whether each triangle faces against its rest normal, transformed by the skinning matrix of its first corner, in each
/// of eight frames of the first clip.
fn turned(player: &Player, triangles: &[[u32; 3]]) -> Vec<bool> {
    let at_rest = player.pose_at(None, 0.0, &[]).palette;
    let rest = cagework_core::skin::skin_vertices(&player.skin, &at_rest, &[]);
    let blended = |palette: &[Mat4], v: u32| {
        let v = v as usize;
        let range = player.skin.joint_starts[v] as usize..player.skin.joint_starts[v + 1] as usize;
        let sum = |sum: Mat3, &(joint, w): &(u32, f32)| sum + w * Mat3::from_mat4(palette[joint as usize]);
        player.skin.joints[range].iter().fold(Mat3::ZERO, sum)
    };
    let normal = |at: &[Vec3], t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| at[v as usize]);
        (b - a).cross(c - a)
    };
    (0..8)
        .flat_map(|frame| {
            let palette = player.pose_at(Some(0), 0.25 * frame as f32, &[]).palette;
            let at = cagework_core::skin::skin_vertices(&player.skin, &palette, &[]);
            let is_turned = |t: &[u32; 3]| {
                let change = blended(&palette, t[0]) * blended(&at_rest, t[0]).inverse();
                let carried = change.inverse().transpose() * normal(&rest, t);
                normal(&at, t).dot(carried) * change.determinant() < 0.0
            };
            triangles.iter().map(is_turned).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn joints_that_follow_flip_fewer_triangles_than_joints_that_stay() {
    let new = |joints| {
        let (model, longer, _) = shaped(arms, joints);
        let [before, after] = [&model, &longer].map(|model| turned(&player(model), &model.triangles));
        (before.len(), before.iter().zip(&after).filter(|(before, after)| !**before && **after).count())
    };
    let ((n, follow), (_, stay)) = (new(Joints::Follow), new(Joints::Stay));
    // Measured: 43 triangles flip if joints follow, 378 if joints stay.
    assert!(follow * 5 < stay && follow * 1000 < n, "of {n}: {follow} follow, {stay} stay");
}

/// A bumpy target leaves every tight cage of the rest shape, so the cage must enclose the rest shape and the target.
#[test]
fn targets_inside_the_cage_flip_no_triangles() {
    let n = 40;
    let point = |i: u32, j: u32| vec3(i as f32 / n as f32, 0.0, j as f32 / n as f32);
    let positions: Vec<Vec3> = (0..=n).flat_map(|j| (0..=n).map(move |i| point(i, j))).collect();
    let bump = |p: Vec3| 0.2 * Vec3::Y * (9.0 * p.x).sin() * (8.0 * p.z).cos();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let triangles: Vec<[u32; 3]> = (0..n)
        .flat_map(|j| (0..n).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, d, c], [a, c, b]]
        })
        .collect();
    let mut rig = Builder::new();
    let mut vectors = |of: &dyn Fn(Vec3) -> Vec3| {
        let values: Vec<[f32; 3]> = positions.iter().map(|&p| of(p).to_array()).collect();
        rig.vec3(&values)
    };
    let [at, target] = [vectors(&|p| p), vectors(&bump)];
    let indices = rig.indices(triangles.as_flattened());
    let primitive =
        json!({ "attributes": { "POSITION": at }, "indices": indices, "targets": [{ "POSITION": target }] });
    rig.json["meshes"] = json!([{ "primitives": [primitive] }]);
    rig.json["nodes"] = json!([{ "mesh": 0 }]);
    let model = read(&rig.glb());
    let (states, of_states) = model.states(None).unwrap();
    let made = generate(&states, &of_states, &CageOptions::default(), &NoProgress).unwrap();
    let bent = |p: Vec3| p + vec3(0.0, 0.4 * p.x * p.x, 0.1 * p.x * p.z);
    let (shaped, report) = by_cage(&model, &made.cage, bent, Joints::Follow);
    assert!(report.morph_ends > 1000 && report.morph_ends_outside == 0, "{report:?}");
    let player = player(&shaped);
    let up = |weight| {
        let posed = player.pose_at(None, 0.0, &[weight]);
        let at = cagework_core::skin::skin_vertices(&player.skin, &posed.palette, &posed.targets);
        triangles
            .iter()
            .filter(|t| {
                let [a, b, c] = t.map(|v| at[v as usize]);
                (b - a).cross(c - a).y <= 0.0
            })
            .count()
    };
    assert_eq!([up(0.0), up(0.5), up(1.0)], [0; 3], "triangles that do not face up");
}

/// The walking sample with a spear in its left hand, whose tip is 0.2 below the soles.
fn spearman() -> Model {
    let mut sample = samples::build("humanoid").unwrap();
    let rig = sample.rig.as_mut().unwrap();
    let hand = rig.joints.iter().position(|joint| joint.name == "hand.L").unwrap();
    let (at, first) = (rig.joints[hand].at, sample.mesh.positions.len() as u32);
    sample.mesh.positions.extend([at, at + vec3(0.02, 0.0, 0.0), vec3(at.x, -0.2, at.z)]);
    sample.mesh.triangles.push([first, first + 1, first + 2]);
    sample.colours.extend([[90, 90, 90, 255]; 3]);
    rig.influences.extend([[(hand as u32, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)]; 3]);
    read(&write_mesh_glb("spearman", &sample.mesh, &sample.colours, sample.rig.as_ref()).unwrap())
}

#[test]
fn what_a_hand_carries_does_not_stand_on_the_ground() {
    let model = spearman();
    let n = model.positions.len();
    // Everything rises by 0.1, and the tip of the spear falls by 0.3.
    let mut by = vec![DVec3::Y * 0.1; n + model.extra_points().unwrap().len()];
    by[n - 1] = DVec3::NEG_Y * 0.3;
    let options = ReshapeOptions { ground: true, ..ReshapeOptions::default() };
    let (glb, report) = model.write_reshaped(&by, &[], &[], &options).unwrap();
    let low = |positions: &[Vec3]| positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    let stood = read(&glb);
    assert!((low(&stood.positions[..n - 3]) - low(&model.positions[..n - 3])).abs() < 1e-5);
    assert!((report.lift + 0.1).abs() < 1e-6, "{}", report.lift);
    assert!(report.clip_lifts.iter().all(|lift| lift.abs() < 1e-3), "{:?}", report.clip_lifts);
}
