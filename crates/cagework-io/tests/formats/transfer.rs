//! Clothes get the skeleton, the joint weights and the morph targets of a body: `Model::transfer_from`.

use cagework_core::TriMesh;
use cagework_core::inpaint::Origins;
use cagework_core::skin::{Joint, Rig, skin_vertices};
use cagework_io::{
    Interpolation, Model, Penetration, ReshapeOptions, Timeline, TransferError, TransferOptions,
    TransferReport, transfer_report, write_mesh_glb,
};
use glam::{DVec3, Quat, Vec3, vec3};
use serde_json::{Value, json};

use crate::common::{glb, json_of, read, rigged};

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

fn transfer(clothes: &Model) -> (Model, Value, TransferReport) {
    transferred(&body(), clothes, None)
}

/// Checks that `dressed` has the positions of `clothes` at rest, and the weight y/2 of the second joint.
fn assert_dressed(dressed: &Model, clothes: &[Vec3]) {
    let off = |(a, b): (&Vec3, &Vec3)| a.distance(*b);
    assert_eq!(dressed.positions.len(), clothes.len());
    assert!(dressed.positions.iter().zip(clothes).map(off).fold(0.0, f32::max) < 2e-6);
    let player = dressed.player().unwrap().unwrap();
    let skin = &player.skin;
    let pose = player.pose_at(None, 0.0, &[]);
    let shown = skin_vertices(skin, &pose.palette, &pose.targets);
    assert!(shown.iter().zip(clothes).map(off).fold(0.0, f32::max) < 2e-6);
    // The palette of each slot: its node, then the joints.
    for (v, p) in clothes.iter().enumerate() {
        let joints = &skin.joints[skin.joint_starts[v] as usize..skin.joint_starts[v + 1] as usize];
        let weight = |joint: u32| joints.iter().filter(|j| j.0 % 3 == joint).map(|j| j.1).sum::<f32>();
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
    assert_eq!(report.origins, Origins { matched: 24 * 8, inpainted: 0, copied: 0 });
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
fn faces_that_point_inwards_are_matched_and_reported() {
    let mut shirt = tube(0.22, 0.5, 1.5, 7);
    shirt.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    let (dressed, _, report) = transfer(&read("shirt.obj", obj(&shirt).as_bytes()).unwrap());
    assert_eq!(report.origins, Origins { matched: 24 * 8, inpainted: 0, copied: 0 });
    assert_dressed(&dressed, &dressed.positions);
    let says_so =
        |report: &TransferReport| transfer_report(report).join("\n").contains("opposite directions");
    assert!(report.opposite_faces && says_so(&report));
    let outwards = transfer(&read("shirt.obj", obj(&tube(0.22, 0.5, 1.5, 7)).as_bytes()).unwrap()).2;
    assert!(!outwards.opposite_faces && !says_so(&outwards));
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
    assert_eq!((report.origins.matched, dressed.counts.skins, dressed.counts.meshes), (24 * 12, 2, 2));
    assert_eq!(
        [&json["nodes"][0]["name"], &json["nodes"][0]["scale"]],
        [&json!("shirt"), &json!([0.01, 0.01, 0.01])]
    );
    let player = dressed.player().unwrap().unwrap();
    let shown = skin_vertices(&player.skin, &player.pose_at(None, 0.0, &[]).palette, &[]);
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
    let refused = |clothes: &Model, body: &Model, limit| {
        let options = TransferOptions { push_out: None, memory_limit: limit };
        clothes.transfer_from(body, &options).unwrap_err()
    };
    assert_eq!(refused(&shirt, &shirt, u64::MAX), TransferError::NoSkin("shirt.obj".into()));
    assert_eq!(refused(&body, &body, u64::MAX), TransferError::HasSkin("body.glb".into()));
    // Millimetres.
    let large = read("large.obj", obj(&tube(220.0, 500.0, 1500.0, 7)).as_bytes()).unwrap();
    assert_eq!(refused(&large, &body, u64::MAX), TransferError::Far("large.obj".into()));
    assert!(matches!(refused(&shirt, &body, 1000), TransferError::Memory(_)));
}

#[test]
fn a_body_whose_rest_differs_from_its_bind_pose_is_dressed_at_rest() {
    let body = read("rigged.glb", &rigged().glb()).unwrap();
    let clothes = TriMesh { positions: body.positions.clone(), triangles: body.triangles.clone() };
    let clothes = read("clothes.obj", obj(&clothes).as_bytes()).unwrap();
    let (dressed, _, report) = transferred(&rigged().glb(), &clothes, None);
    assert!(report.origins.matched > 0);
    let player = dressed.player().unwrap().unwrap();
    let pose = player.pose_at(None, 0.0, &[]);
    let shown = skin_vertices(&player.skin, &pose.palette, &pose.targets);
    let fits = |p: &Vec3| clothes.positions.iter().any(|q| q.distance(*p) < 1e-5);
    assert!(shown.iter().all(fits) && dressed.positions.iter().all(fits));
}

#[test]
fn clothes_follow_a_clip_of_the_body() {
    let shirt = tube(0.22, 0.5, 1.5, 7);
    let (dressed, ..) = transfer(&read("shirt.obj", obj(&shirt).as_bytes()).unwrap());
    let body = read("body.glb", &body()).unwrap().player().unwrap().unwrap();
    let player = dressed.player().unwrap().unwrap();
    let at = player.pose_at_clip_of(&body, 0, 1.0, &[]);
    // Linear blend skinning: the share y/2 turns by 1.5 radians about the joint at y = 1.
    let turned = |p: Vec3| Vec3::Y + Quat::from_rotation_z(1.5) * (p - Vec3::Y);
    for (p, shown) in dressed.positions.iter().zip(skin_vertices(&player.skin, &at.palette, &[])) {
        assert!(shown.distance(p.lerp(turned(*p), p.y / 2.0)) < 1e-4, "{p} {shown}");
    }
}

type Displacement = fn(Vec3) -> Vec3;

/// A GLB with morph targets, from a formula for each.
fn morphed(glb: &[u8], targets: &[(&str, Displacement)]) -> Vec<u8> {
    morphed_in_time(glb, targets, None)
}

/// Like [`morphed`], with the timeline of the clip that plays the targets.
fn morphed_in_time(glb: &[u8], targets: &[(&str, Displacement)], timeline: Option<Timeline>) -> Vec<u8> {
    let model = read("body.glb", glb).unwrap();
    let n_extra = model.extra_points().unwrap().len();
    let by = |of: Displacement| -> Vec<DVec3> {
        let vertices = model.positions.iter().map(|&p| of(p).as_dvec3());
        vertices.chain(std::iter::repeat_n(DVec3::ZERO, n_extra)).collect()
    };
    let named: Vec<_> = targets.iter().map(|&(name, of)| (name.to_owned(), by(of))).collect();
    let still = vec![DVec3::ZERO; model.positions.len() + n_extra];
    let options = ReshapeOptions { timeline, ..ReshapeOptions::default() };
    model.write_reshaped(&still, &[], &named, &options).unwrap().0
}

/// Twice as thick; taller; the upper end moves.
const TARGETS: [(&str, Displacement); 3] = [
    ("wide", |p| vec3(p.x, 0.0, p.z)),
    ("tall", |p| vec3(0.0, 0.1 * p.y, 0.0)),
    ("top", |p| if p.y > 1.9 { Vec3::X } else { Vec3::ZERO }),
];

fn transferred(body: &[u8], clothes: &Model, push_out: Option<f32>) -> (Model, Value, TransferReport) {
    let body = read("body.glb", body).unwrap();
    let options = TransferOptions { push_out, memory_limit: u64::MAX };
    let (bytes, report) = clothes.transfer_from(&body, &options).unwrap();
    (read("out.glb", &bytes).unwrap(), json_of(&bytes), report)
}

/// Displacements of all vertices by the targets with this name at weight 1.
fn displacements(model: &Model, name: &str) -> Vec<Vec3> {
    let player = model.player().unwrap().unwrap();
    let (names, defaults) = player.targets();
    let weights: Vec<f32> =
        names.iter().zip(defaults).map(|(own, &default)| if own == name { 1.0 } else { default }).collect();
    let shown = skin_vertices(&player.skin, &player.pose_at(None, 0.0, &[]).palette, &weights);
    shown.iter().zip(&model.positions).map(|(a, b)| *a - *b).collect()
}

/// The vertices of the shirts below are at the angles of those of the body, so their closest points are on its vertical
/// edges, 0.2 from the axis. They get the displacements there.
fn assert_targets(dressed: &Model, share: f32) {
    let [wide, tall] = ["wide", "tall"].map(|name| displacements(dressed, name));
    for (p, (wide, tall)) in dressed.positions.iter().zip(wide.into_iter().zip(tall)) {
        let radial = vec3(p.x, 0.0, p.z).normalize();
        assert!(wide.distance(share * 0.2 * radial) < 1e-5, "{p} {wide}");
        assert!(tall.distance(vec3(0.0, 0.1 * p.y, 0.0)) < 1e-5, "{p} {tall}");
    }
}

#[test]
fn clothes_get_the_targets_that_move_them() {
    let shirt = read("shirt.obj", obj(&tube(0.22, 0.5, 1.5, 7)).as_bytes()).unwrap();
    let (dressed, json, report) = transferred(&morphed(&body(), &TARGETS), &shirt, None);
    assert_targets(&dressed, 1.0);
    assert_eq!(json["meshes"][0]["extras"]["targetNames"], json!(["wide", "tall"]));
    assert_eq!(json.get("animations"), None);
    assert_eq!((report.joints, report.still_targets, report.targets.len()), (2, 1, 2));
    // A body without a skin, then clothes with one and with a target of the same name.
    let bare = write_mesh_glb("body", &tube(0.2, 0.0, 2.0, 10), &[], None).unwrap();
    let bare = morphed(&bare, &TARGETS);
    let (only, _, report) = transferred(&bare, &shirt, None);
    assert_targets(&only, 1.0);
    assert_eq!((only.counts.skins, report.joints), (0, 0));
    let own = morphed(
        &write_mesh_glb("own", &tube(0.22, 0.5, 1.5, 7), &[], None).unwrap(),
        &[("tall", |p| 0.5 * p)],
    );
    let own = transferred(&body(), &read("own.glb", &own).unwrap(), None).0;
    let (both, json, report) = transferred(&bare, &own, None);
    assert_eq!((both.counts.skins, report.joints, report.existing_targets), (1, 0, 1));
    assert_eq!(json["meshes"][0]["extras"]["targetNames"], json!(["tall", "wide"]));
    for (p, by) in both.positions.iter().zip(displacements(&both, "tall")) {
        assert!(by.distance(0.5 * *p) < 1e-5, "{p} {by}");
    }
}

#[test]
fn default_weights_of_the_body_are_kept() {
    let bytes = morphed(&body(), &TARGETS);
    let mut json = json_of(&bytes);
    json["meshes"][0]["weights"] = json!([0.5, 0.0, 0.0]);
    let bytes = glb(&json, Some(&bytes[28 + json_length(&bytes)..]));
    // At rest the body has the radius 0.3.
    let shirt = tube(0.32, 0.5, 1.5, 7);
    let (dressed, json, _) = transferred(&bytes, &read("shirt.obj", obj(&shirt).as_bytes()).unwrap(), None);
    assert_eq!(json["meshes"][0]["weights"], json!([0.5, 0.0]));
    for p in &dressed.positions {
        assert!(shirt.positions.iter().any(|q| q.distance(*p) < 1e-5), "{p}");
    }
    // From the default weight to 1.
    assert_targets(&dressed, 0.5);
}

/// A spline with equal values and tangents of 0 at its keys is constant.
#[test]
fn new_targets_stay_at_their_default_weight_in_splines() {
    let bytes = morphed(&body(), &TARGETS);
    let mut json = json_of(&bytes);
    json["meshes"][0]["weights"] = json!([0.5, 0.0, 0.0]);
    let body = glb(&json, Some(&bytes[28 + json_length(&bytes)..]));
    let own = write_mesh_glb("own", &tube(0.32, 0.5, 1.5, 7), &[], None).unwrap();
    let cubic = Timeline::every_second(1).with(Interpolation::Cubic);
    let own = morphed_in_time(&own, &[("puffed", |p| 0.5 * p)], Some(cubic));
    let (dressed, json, _) = transferred(&body, &read("own.glb", &own).unwrap(), None);
    assert_eq!(json["animations"][0]["samplers"][0]["interpolation"], "CUBICSPLINE");
    let player = dressed.player().unwrap().unwrap();
    assert_eq!(player.targets().0[..2], ["puffed", "wide"]);
    for seconds in [0.0, 0.25, 0.5, 0.75, 1.0] {
        assert_eq!(player.pose_at(Some(0), seconds, &[]).targets[1], 0.5, "{seconds} s");
    }
}

#[test]
fn meshes_that_nodes_share_get_their_own_targets() {
    let shirt = |low: f32| tube(0.22, low, low + 0.4, 3);
    let mut document = json_of(&write_mesh_glb("low", &shirt(0.1), &[], None).unwrap());
    let bytes = write_mesh_glb("low", &shirt(0.1), &[], None).unwrap();
    // Both meshes have the same contents; the copy of mesh 0 for its second node comes after mesh 1.
    document["meshes"] = json!([document["meshes"][0], document["meshes"][0]]);
    let at = |mesh: u32, y: f32| json!({ "mesh": mesh, "translation": [0, y, 0] });
    document["nodes"] = json!([at(0, 0.0), at(0, 0.5), at(1, 1.0)]);
    document["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
    let clothes = read("shirts.glb", &glb(&document, Some(&bytes[28 + json_length(&bytes)..]))).unwrap();
    let (dressed, json, _) = transferred(&morphed(&body(), &TARGETS), &clothes, None);
    assert_eq!(json["meshes"].as_array().unwrap().len(), 3);
    assert_targets(&dressed, 1.0);
    assert_dressed(&dressed, &dressed.positions);
}

/// Distance from the axis to a side of the body, divided by its radius.
fn apothem() -> f32 {
    (std::f32::consts::PI / 24.0).cos()
}

/// Distance of `p` from the planes of the sides of a body with this radius: positive outside.
fn from_sides(p: Vec3, radius: f32) -> f32 {
    let side = |k: u32| {
        let angle = std::f32::consts::TAU * (k as f32 + 0.5) / 24.0;
        p.dot(vec3(angle.sin(), 0.0, angle.cos()))
    };
    (0..24).map(side).fold(f32::MIN, f32::max) - radius * apothem()
}

#[test]
fn vertices_inside_the_body_are_reported_and_pushed_out() {
    let body = morphed(&body(), &TARGETS[..1]);
    let shirt = read("shirt.obj", obj(&tube(0.19, 0.5, 1.5, 7)).as_bytes()).unwrap();
    let (_, _, report) = transferred(&body, &shirt, None);
    let Penetration { inside, left } = report.rest;
    assert_eq!((inside.count, inside), (24 * 8, left));
    assert!((inside.depth - 0.01 * apothem()).abs() < 1e-5, "{inside:?}");
    let (dressed, _, report) = transferred(&body, &shirt, Some(0.02));
    assert_eq!([report.rest.inside.count, report.rest.left.count], [24 * 8, 0]);
    for (p, by) in dressed.positions.iter().zip(displacements(&dressed, "wide")) {
        assert!((from_sides(*p, 0.2) - 0.02).abs() < 1e-5, "{p}");
        assert!(from_sides(*p + by, 0.4) > 0.02 - 1e-4, "{p} {by}");
    }
}

#[test]
fn targets_that_move_another_part_into_the_clothes_are_corrected() {
    // A plate at x = 1 faces the tube. The target moves it to x = 0.215, into the shirt, of which it covers the vertices
    // at x = 0.22, z = 0.
    let mut mesh = tube(0.2, 0.0, 2.0, 10);
    let first = mesh.positions.len() as u32;
    let corners = [(0.4, -0.03), (0.4, 0.03), (1.6, 0.03), (1.6, -0.03)];
    mesh.positions.extend(corners.map(|(y, z)| vec3(1.0, y, z)));
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    let body = write_mesh_glb("body", &mesh, &[], None).unwrap();
    let body = morphed(&body, &[("plate", |p| if p.x > 0.5 { vec3(-0.785, 0.0, 0.0) } else { Vec3::ZERO })]);
    let shirt = read("shirt.obj", obj(&tube(0.22, 0.5, 1.5, 7)).as_bytes()).unwrap();
    assert_eq!(transferred(&body, &shirt, None).2.still_targets, 1);
    let (dressed, _, report) = transferred(&body, &shirt, Some(0.005));
    assert_eq!(report.rest, Penetration::default());
    let Penetration { inside, left } = report.targets[0].penetration;
    assert_eq!([inside.count, left.count], [8, 0]);
    assert!((inside.depth - 0.005).abs() < 1e-5, "{inside:?}");
    for (p, by) in dressed.positions.iter().zip(displacements(&dressed, "plate")) {
        let expected = if p.x > 0.219 { vec3(0.21 - 0.22, 0.0, 0.0) } else { Vec3::ZERO };
        assert!(by.distance(expected) < 1e-5, "{p} {by}");
    }
}
