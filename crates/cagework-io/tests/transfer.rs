//! Clothes get the skeleton and the joint weights of a body: `Model::write_with_skin_of`.

#![allow(clippy::unwrap_used, reason = "helpers of tests, outside the test functions")]

mod common;

use cagework_core::TriMesh;
use cagework_core::inpaint::Inpainted;
use cagework_core::skin::{Joint, Rig, skin_vertices};
use cagework_io::{Model, TransferError, write_mesh_glb};
use common::{glb, json_of, read, rigged};
use glam::{Quat, Vec3, vec3};
use serde_json::{Value, json};

/// A tube around the y axis, open at both ends, facing outwards.
fn tube(radius: f32, low: f32, high: f32, rings: u32) -> TriMesh {
    const SIDES: u32 = 24;
    let at = |k: u32| {
        let angle = std::f32::consts::TAU * (k % SIDES) as f32 / SIDES as f32;
        let y = low + (high - low) * (k / SIDES) as f32 / rings as f32;
        vec3(radius * angle.sin(), y, radius * angle.cos())
    };
    let quad = |k: u32| {
        let (a, b) = (k, k / SIDES * SIDES + (k + 1) % SIDES);
        [[a, b, b + SIDES], [a, b + SIDES, a + SIDES]]
    };
    TriMesh {
        positions: (0..SIDES * (rings + 1)).map(at).collect(),
        triangles: (0..SIDES * rings).flat_map(quad).collect(),
    }
}

/// A tube from y = 0 to 2 with a joint at 0 and one at 1, which bends by 90 degrees. The weight of the second joint is y/2.
fn body() -> Vec<u8> {
    let mesh = tube(0.2, 0.0, 2.0, 10);
    let joint = |name, y, parent| Joint { name, at: vec3(0.0, y, 0.0), parent };
    let rig = Rig {
        joints: vec![joint("hips", 0.0, None), joint("spine", 1.0, Some(0))],
        influences: mesh
            .positions
            .iter()
            .map(|p| [(0, 1.0 - p.y / 2.0), (1, p.y / 2.0), (0, 0.0), (0, 0.0)])
            .collect(),
        clip: "bend",
        times: vec![0.0, 1.0],
        turns: vec![vec![Quat::IDENTITY; 2], vec![Quat::IDENTITY, Quat::from_rotation_z(1.5)]],
        root: vec![Vec3::ZERO; 2],
    };
    write_mesh_glb("body", &mesh, &[], Some(&rig)).unwrap()
}

fn obj(mesh: &TriMesh) -> String {
    let vertex = |p: &Vec3| format!("v {} {} {}\n", p.x, p.y, p.z);
    let face = |t: &[u32; 3]| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    mesh.positions.iter().map(vertex).chain(mesh.triangles.iter().map(face)).collect()
}

fn transfer(clothes: &Model) -> (Model, Value, Inpainted) {
    let body = read("body.glb", &body()).unwrap();
    let (bytes, report) = clothes.write_with_skin_of(&body, u64::MAX).unwrap();
    (read("out.glb", &bytes).unwrap(), json_of(&bytes), report)
}

/// Checks that `dressed` has the positions of `clothes` at rest, and the weight y/2 of the second joint.
fn assert_dressed(dressed: &Model, clothes: &[Vec3]) {
    let off = |(a, b): (&Vec3, &Vec3)| a.distance(*b);
    assert_eq!(dressed.positions.len(), clothes.len());
    assert!(dressed.positions.iter().zip(clothes).map(off).fold(0.0, f32::max) < 2e-6);
    let player = dressed.player().unwrap().unwrap();
    let skin = &player.skin;
    let palette = player.at(None, 0.0, &[]).palette;
    let shown = skin_vertices(skin, &palette, &[]);
    assert!(shown.iter().zip(clothes).map(off).fold(0.0, f32::max) < 2e-6);
    // The palette of the only slot: its node, then the joints.
    for (v, p) in clothes.iter().enumerate() {
        let joints = &skin.joints[skin.joint_starts[v] as usize..skin.joint_starts[v + 1] as usize];
        let weight = |joint: u32| joints.iter().filter(|j| j.0 == joint).map(|j| j.1).sum::<f32>();
        assert!(
            (weight(2) - p.y / 2.0).abs() < 1e-4 && (weight(1) + weight(2) - 1.0).abs() < 1e-6,
            "{p}: {joints:?}"
        );
    }
}

#[test]
fn a_shirt_without_a_skeleton_follows_the_body() {
    let shirt = tube(0.22, 0.5, 1.5, 7);
    let (dressed, json, report) = transfer(&read("shirt.obj", obj(&shirt).as_bytes()).unwrap());
    assert_eq!([report.matched, report.inpainted, report.copied], [24 * 8, 0, 0]);
    assert_eq!((dressed.counts.skins, dressed.counts.joints), (1, 2));
    let joint = |k: usize| &json["nodes"][json["skins"][0]["joints"][k].as_u64().unwrap() as usize];
    assert_eq!([&joint(0)["name"], &joint(1)["name"]], ["hips", "spine"]);
    assert_eq!(joint(1)["translation"], json!([0.0, 1.0, 0.0]));
    // The GLB orders vertices by their first use in a triangle.
    let clothes: Vec<Vec3> = dressed.positions.clone();
    for p in &clothes {
        assert!(shirt.positions.iter().any(|q| q.distance(*p) < 1e-6), "{p}");
    }
    assert_dressed(&dressed, &clothes);
}

#[test]
fn a_glb_keeps_its_names_and_transforms() {
    // The clothes are stored in centimetres and on their side, and two nodes show the same mesh.
    let shirt = tube(0.22, 0.2, 0.8, 5);
    let stored = TriMesh {
        positions: shirt.positions.iter().map(|p| 100.0 * vec3(p.x, -p.z, p.y)).collect(),
        triangles: shirt.triangles.clone(),
    };
    let bytes = write_mesh_glb("shirt", &stored, &[], None).unwrap();
    let (mut document, bin) = (json_of(&bytes), &bytes[28 + json_length(&bytes)..]);
    let turned = json!({ "name": "shirt", "mesh": 0, "scale": [0.01, 0.01, 0.01], "rotation": [-0.5_f64.sqrt(), 0, 0, 0.5_f64.sqrt()] });
    let mut higher = turned.clone();
    higher["translation"] = json!([0, 1, 0]);
    document["nodes"] = json!([turned, higher]);
    document["scenes"] = json!([{ "nodes": [0, 1] }]);
    let clothes = read("shirt.glb", &glb(&document, Some(bin))).unwrap();
    let highest = clothes.positions.iter().map(|p| p.y).fold(0.0, f32::max);
    assert!((highest - 1.8).abs() < 1e-5, "{highest}");
    let (dressed, json, report) = transfer(&clothes);
    assert_eq!((report.matched, dressed.counts.skins, dressed.counts.meshes), (24 * 12, 2, 2));
    assert_eq!(
        [&json["nodes"][0]["name"], &json["nodes"][0]["scale"]],
        [&json!("shirt"), &json!([0.01, 0.01, 0.01])]
    );
    let player = dressed.player().unwrap().unwrap();
    let shown = skin_vertices(&player.skin, &player.at(None, 0.0, &[]).palette, &[]);
    for (a, b) in shown.iter().zip(&clothes.positions) {
        assert!(a.distance(*b) < 1e-5, "{a} {b}");
    }
}

fn json_length(glb: &[u8]) -> usize {
    u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize
}

#[test]
fn what_cannot_be_transferred_is_refused() {
    let body = read("body.glb", &body()).unwrap();
    let shirt = read("shirt.obj", obj(&tube(0.22, 0.5, 1.5, 7)).as_bytes()).unwrap();
    let refused = |clothes: &Model, body: &Model, limit| clothes.write_with_skin_of(body, limit).unwrap_err();
    assert_eq!(refused(&shirt, &shirt, u64::MAX), TransferError::NoSkin("shirt.obj".into()));
    assert_eq!(refused(&body, &body, u64::MAX), TransferError::HasSkin("body.glb".into()));
    // Millimetres, and a tube that faces inwards.
    let large = read("large.obj", obj(&tube(220.0, 500.0, 1500.0, 7)).as_bytes()).unwrap();
    assert_eq!(refused(&large, &body, u64::MAX), TransferError::Far("large.obj".into()));
    let mut inside_out = tube(0.22, 0.5, 1.5, 7);
    inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let inside_out = read("in.obj", obj(&inside_out).as_bytes()).unwrap();
    assert_eq!(refused(&inside_out, &body, u64::MAX), TransferError::Far("in.obj".into()));
    assert!(matches!(refused(&shirt, &body, 1000), TransferError::Memory(_)));
}

#[test]
fn a_body_whose_rest_differs_from_its_bind_pose_is_dressed_at_rest() {
    let body = read("rigged.glb", &rigged().glb()).unwrap();
    let clothes = TriMesh { positions: body.positions.clone(), triangles: body.triangles.clone() };
    let clothes = read("clothes.obj", obj(&clothes).as_bytes()).unwrap();
    let (bytes, report) = clothes.write_with_skin_of(&body, u64::MAX).unwrap();
    let dressed = read("out.glb", &bytes).unwrap();
    assert!(report.matched > 0);
    let player = dressed.player().unwrap().unwrap();
    let shown = skin_vertices(&player.skin, &player.at(None, 0.0, &[]).palette, &[]);
    let fits = |p: &Vec3| clothes.positions.iter().any(|q| q.distance(*p) < 1e-5);
    assert!(shown.iter().all(fits) && dressed.positions.iter().all(fits));
}

#[test]
fn clothes_follow_a_clip_of_the_body() {
    let shirt = tube(0.22, 0.5, 1.5, 7);
    let (dressed, ..) = transfer(&read("shirt.obj", obj(&shirt).as_bytes()).unwrap());
    let body = read("body.glb", &body()).unwrap().player().unwrap().unwrap();
    let player = dressed.player().unwrap().unwrap();
    let at = player.at_clip_of(&body, 0, 1.0, &[]);
    // Linear blend skinning: the share y/2 turns by 1.5 radians about the joint at y = 1.
    let turned = |p: Vec3| Vec3::Y + Quat::from_rotation_z(1.5) * (p - Vec3::Y);
    for (p, shown) in dressed.positions.iter().zip(skin_vertices(&player.skin, &at.palette, &[])) {
        assert!(shown.distance(p.lerp(turned(*p), p.y / 2.0)) < 1e-4, "{p} {shown}");
    }
}
