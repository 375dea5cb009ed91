//! Unskinned nodes: wheels, robots of rigid parts, VRM bones that carry meshes.

use cagework_io::{Joints, Model, ReshapeOptions};
use glam::{DVec3, Quat, Vec3, vec3};
use serde_json::{Value, json};

use super::{ROUNDING_TOLERANCE, assert_near, by, f, player, read, reshaped, shown};
use crate::common::{self, Builder, CUBE, F32, U8, floats, json_of, rigged};

/// A mesh of a cube with edges of 0.5, centred at its origin.
fn centred_cube(b: &mut Builder) -> usize {
    let mesh = b.cube_mesh("part");
    let position = b.vec3(&CUBE.map(|corner| corner.map(|x| 0.5 * (x - 0.5))));
    b.primitive(mesh)["attributes"]["POSITION"] = position.into();
    mesh
}

/// Adds a clip. `channels`: node, path and values of two keys at 0 and 1 s.
fn clip(b: &mut Builder, channels: &[(usize, &str, Vec<f32>)]) {
    let times = b.accessor(&floats(&[0.0, 1.0]), F32, 2, "SCALAR");
    (b.json["accessors"][times]["min"], b.json["accessors"][times]["max"]) = (json!([0.0]), json!([1.0]));
    let mut animation = json!({ "samplers": [], "channels": [] });
    for (k, (node, path, values)) in channels.iter().enumerate() {
        let kind = if *path == "rotation" { "VEC4" } else { "VEC3" };
        let output = b.accessor(&floats(values), F32, 2, kind);
        let list = |animation: &mut Value, key: &str, item| animation[key].as_array_mut().unwrap().push(item);
        list(&mut animation, "samplers", json!({ "input": times, "output": output }));
        list(&mut animation, "channels", json!({ "sampler": k, "target": { "node": node, "path": path } }));
    }
    b.push("animations", animation);
}

/// Exports a model with all points displaced by `moved`.
fn moved_by(model: &Model, joints: Joints, moved: impl Fn(Vec3) -> Vec3) -> Vec<u8> {
    let extra = model.extra_points().unwrap();
    let by: Vec<DVec3> =
        model.positions.iter().chain(&extra).map(|&p| moved(p).as_dvec3() - p.as_dvec3()).collect();
    let options = ReshapeOptions { joints, ..ReshapeOptions::default() };
    model.write_reshaped(&by, &[], &[], &options).unwrap().0
}

fn translation(json: &Value, node: usize) -> Vec3 {
    let at = &json["nodes"][node]["translation"];
    Vec3::from_array([0, 1, 2].map(|k| at[k].as_f64().unwrap() as f32))
}

/// A body at rest, and a wheel that a clip rotates.
fn wheel() -> Builder {
    let mut b = Builder::new();
    let mesh = centred_cube(&mut b);
    b.push("nodes", json!({ "mesh": mesh, "translation": [0.0, 1.0, 0.0] }));
    b.push("nodes", json!({ "name": "wheel", "mesh": mesh, "translation": [3.0, 0.0, 0.0] }));
    b.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    clip(&mut b, &[(1, "rotation", vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.8, 0.6])]);
    b
}

#[test]
fn vertices_of_rigid_parts_have_one_influence() {
    let rig = read(&wheel().glb()).rest_rig().unwrap().unwrap();
    let joints: Vec<_> =
        rig.joints.iter().map(|joint| (joint.name.as_str(), joint.parent, joint.at)).collect();
    assert_eq!(joints, [("wheel", None, vec3(3.0, 0.0, 0.0))]);
    let n: Vec<u32> = rig.first.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // The body hangs on no joint.
    assert_eq!(n, [[0; CUBE.len()], [1; CUBE.len()]].concat());
    assert!(rig.influences.iter().all(|&influence| influence == (0, 1.0)));
}

#[test]
fn wheels_rotate_about_their_moved_axles() {
    let model = read(&wheel().glb());
    let wider = |p: Vec3| vec3(1.2 * (p.x - 1.25) + 1.25, p.y, p.z);
    let bytes = moved_by(&model, Joints::Follow, wider);
    let after = player(&read(&bytes));
    for seconds in [0.0, 0.5, 1.0] {
        let at = shown(&after, Some(0), seconds, &[]);
        let middle = at[8..].iter().sum::<Vec3>() / 8.0;
        assert!(middle.distance(vec3(3.35, 0.0, 0.0)) <= ROUNDING_TOLERANCE, "{middle} at {seconds} s");
    }
    let rest: Vec<Vec3> = model.positions.iter().map(|&p| wider(p)).collect();
    assert_near(&read(&bytes).positions, &rest, ROUNDING_TOLERANCE, "at rest");
    let (_, report) = reshaped(&model, Joints::Follow);
    assert_eq!(report.notices()[0], "moved 2 of 2 joints and other nodes and adapted 0 animation tracks");

    assert_eq!(model.props().unwrap(), ["wheel"]);
    let rigid = ReshapeOptions { rigid: vec!["wheel".into()], ..ReshapeOptions::default() };
    let by: Vec<DVec3> = by(&model);
    let json = json_of(&model.write_reshaped(&by, &[], &[], &rigid).unwrap().0);
    let corners = model.positions[8..].iter().map(|&p| f(p)).sum::<Vec3>() / 8.0;
    assert!(
        translation(&json, 1).distance(corners) <= ROUNDING_TOLERANCE,
        "the axle is at the centre of the rigid wheel"
    );

    let stays = json_of(&moved_by(&model, Joints::Stay, wider));
    assert_eq!(stays["nodes"][1]["translation"], json!([3.0, 0.0, 0.0]));
    assert!(moved_by(&model, Joints::Follow, |p| p) == wheel().glb(), "unmoved");
}

#[test]
fn pivots_follow_the_cage_unless_they_are_at_the_origin() {
    let mut still = wheel();
    still.json.as_object_mut().unwrap().shift_remove("animations");
    let model = read(&still.glb());
    let json = json_of(&reshaped(&model, Joints::Follow).0);
    for (node, at) in [(0, vec3(0.0, 1.0, 0.0)), (1, vec3(3.0, 0.0, 0.0))] {
        assert!(translation(&json, node).distance(f(at)) <= ROUNDING_TOLERANCE);
    }
    assert_eq!(model.props().unwrap(), Vec::<String>::new(), "there is no skeleton");
    let plain = read(&common::plain_cube().glb());
    assert!(!plain.is_rigged() && plain.extra_points().unwrap().is_empty());
    // A singular transform cannot be inverted, so the model does not count as rigged.
    still.json["nodes"][0]["scale"] = json!([1.0, 0.0, 1.0]);
    assert!(!read(&still.glb()).is_rigged());
}

#[test]
fn vrm_bones_follow_the_cage_with_their_meshes() {
    for extension in ["VRM", "VRMC_vrm"] {
        let mut rig = rigged();
        let mesh = centred_cube(&mut rig);
        rig.push("nodes", json!({ "name": "head", "translation": [0.1, 1.0, 0.0], "children": [6] }));
        rig.push("nodes", json!({ "name": "hair", "mesh": mesh, "translation": [0.0, 0.5, 0.0] }));
        rig.push("nodes", json!({ "name": "chest", "translation": [0.0, 1.5, 0.1] }));
        rig.json["scenes"][0]["nodes"] = json!([0, 4, 5, 7]);
        rig.json["extensionsUsed"] = json!([extension]);
        let bones = if extension == "VRM" {
            json!([{ "bone": "head", "node": 5 }, { "bone": "chest", "node": 7 }])
        } else {
            json!({ "head": { "node": 5 }, "chest": { "node": 7 } })
        };
        rig.json["extensions"] = json!({ extension: { "humanoid": { "humanBones": bones } } });
        let model = read(&rig.glb());
        let (bytes, report) = reshaped(&model, Joints::Follow);
        assert_eq!((report.joints, report.joints_moved), (6, 6));
        let json = json_of(&bytes);
        let [head, hair, chest] = [5, 6, 7].map(|node| translation(&json, node));
        assert!(head.distance(f(vec3(0.1, 1.0, 0.0))) <= ROUNDING_TOLERANCE, "{extension}: {head}");
        assert!((head + hair).distance(f(vec3(0.1, 1.5, 0.0))) <= ROUNDING_TOLERANCE, "{extension}: {hair}");
        assert!(chest.distance(f(vec3(0.0, 1.5, 0.1))) <= ROUNDING_TOLERANCE, "{extension}: {chest}");
    }
}

/// A robot of rigid parts with a skinned hand. The hips and the foot are children of the root. A node without a mesh, the
/// end of the shin, is a child of the hips and lies at the foot. In the first clip the robot jumps; in the second it
/// stands somewhere else.
fn robot() -> Builder {
    let mut b = Builder::new();
    let mesh = centred_cube(&mut b);
    let hand = b.cube_mesh("hand");
    let joints = b.accessor(&[0_u8; 32], U8, 8, "VEC4");
    let weights = b.accessor(&floats(&[[1.0, 0.0, 0.0, 0.0]; 8].concat()), F32, 8, "VEC4");
    let bind = glam::Mat4::from_translation(vec3(0.0, -1.5, 0.0)).to_cols_array();
    let bind = b.accessor(&floats(&bind), F32, 1, "MAT4");
    let attributes = &mut b.primitive(hand)["attributes"];
    (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (joints.into(), weights.into());
    b.push("skins", json!({ "joints": [4], "inverseBindMatrices": bind }));
    b.json["nodes"] = json!([
        { "name": "root", "children": [1, 3] },
        { "name": "hips", "mesh": mesh, "translation": [0.0, 1.0, 0.0], "children": [2, 4] },
        { "name": "end of the shin", "translation": [0.5, -0.75, 0.0] },
        { "name": "foot", "mesh": mesh, "translation": [0.5, 0.25, 0.0] },
        { "name": "hand", "translation": [0.0, 0.5, 0.0] },
        { "mesh": hand, "skin": 0 },
    ]);
    b.json["scenes"] = json!([{ "nodes": [0, 5] }]);
    let jump = |x: f32, y: f32| vec![x, y, 0.0, x, y + 0.2, 0.4];
    clip(&mut b, &[(1, "translation", jump(0.0, 1.0)), (3, "translation", jump(0.5, 0.25))]);
    let elsewhere = |x: f32, y: f32| vec![x, y, 0.5, x, y, 0.5];
    clip(&mut b, &[(1, "translation", elsewhere(0.0, 1.0)), (3, "translation", elsewhere(0.5, 0.25))]);
    b
}

#[test]
fn feet_stay_attached_to_legs_in_clips() {
    let model = read(&robot().glb());
    // The deformation lengthens the legs. The floor at 0 is the lower side of the foot's cube; the hips are at 1.
    let taller = |p: Vec3| vec3(p.x, if p.y < 1.0 { 1.35 * p.y } else { p.y + 0.35 }, p.z);
    let bytes = moved_by(&model, Joints::Follow, taller);
    let [before, after] = [player(&model), player(&read(&bytes))];
    for (clip, seconds) in [(0, 0.0), (0, 0.5), (0, 1.0), (1, 0.0)] {
        let [old, new] = [&before, &after].map(|player| player.pose_at(Some(clip), seconds, &[]).origins);
        assert!(old[2].distance(old[3]) <= ROUNDING_TOLERANCE);
        let gap = new[2].distance(new[3]);
        assert!(gap <= ROUNDING_TOLERANCE, "clip {clip} at {seconds} s: {gap} between shin and foot");
        // Translations scale with the height of the hips.
        let way = |origins: &[Vec3], start: Vec3| origins[1] - start;
        let [old, new] = [way(&old, vec3(0.0, 1.0, 0.0)), way(&new, vec3(0.0, 1.35, 0.0))];
        assert!(new.distance(1.35 * old) <= ROUNDING_TOLERANCE, "{new} instead of 1.35 times {old}");
    }
    let options = ReshapeOptions { keep_travel: true, ..ReshapeOptions::default() };
    let by: Vec<DVec3> = by(&model);
    let kept = player(&read(&model.write_reshaped(&by, &[], &[], &options).unwrap().0));
    let way = |seconds| kept.pose_at(Some(0), seconds, &[]).origins[1];
    assert!((way(1.0) - way(0.0)).distance(vec3(0.0, 0.2, 0.4)) <= ROUNDING_TOLERANCE);
}

/// The clip in which the robot stands somewhere else places its hips and its foot. The root cannot be moved: it has no reason
/// to follow the cage or, with a track, is outside the cage and carries no vertices.
#[test]
fn constant_translations_of_top_nodes_are_positions() {
    let shifted = |p: Vec3| p + vec3(0.5, -0.9, 0.0);
    let taller = |p: Vec3| vec3(p.x, 1.35 * p.y, p.z);
    for root_has_track in [false, true] {
        let mut robot = robot();
        robot.json["animations"].as_array_mut().unwrap().remove(0);
        if root_has_track {
            clip(&mut robot, &[(0, "rotation", [0.0, 0.0, 0.0, 1.0].repeat(2))]);
        }
        let model = read(&robot.glb());
        let (joints, extra) = (model.joints().unwrap(), model.extra_points().unwrap());
        let outside: Vec<u32> = joints
            .iter()
            .filter(|joint| joint.node == 0)
            .map(|joint| (model.positions.len() + joint.point) as u32)
            .collect();
        for (moved, ratio) in [(&shifted as &dyn Fn(Vec3) -> Vec3, 1.0), (&taller, 1.35)] {
            let points = model.positions.iter().chain(&extra);
            let by: Vec<DVec3> = points.map(|&p| moved(p).as_dvec3() - p.as_dvec3()).collect();
            let options = ReshapeOptions::default();
            let (bytes, _) = model.write_reshaped(&by, &outside, &[], &options).unwrap();
            let origins = player(&read(&bytes)).pose_at(Some(0), 0.5, &[]).origins;
            for (node, at) in [(1, vec3(0.0, 1.0, 0.0)), (3, vec3(0.5, 0.25, 0.0))] {
                let expected = moved(at) + ratio * vec3(0.0, 0.0, 0.5);
                assert!(
                    origins[node].distance(expected) <= ROUNDING_TOLERANCE,
                    "node {node}: {} instead of {expected}",
                    origins[node]
                );
            }
        }
    }
}

/// A root on the floor, at the fixed point of a scale, carries the travel of the clip.
#[test]
fn travel_of_a_root_that_stays_scales_with_the_skeleton() {
    let mut robot = robot();
    robot.json["animations"] = serde_json::json!([]);
    clip(&mut robot, &[(0, "translation", vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0])]);
    let model = read(&robot.glb());
    let (joints, extra) = (model.joints().unwrap(), model.extra_points().unwrap());
    let root = joints.iter().find(|joint| joint.node == 0).unwrap();
    let outside = [(model.positions.len() + root.point) as u32];
    let taller = |p: Vec3| vec3(p.x, 1.35 * p.y, p.z);
    let by: Vec<DVec3> =
        model.positions.iter().chain(&extra).map(|&p| taller(p).as_dvec3() - p.as_dvec3()).collect();
    for outside in [&outside[..], &[]] {
        let (bytes, _) = model.write_reshaped(&by, outside, &[], &ReshapeOptions::default()).unwrap();
        let travel = |model: &Model| {
            let at = |seconds: f32| player(model).pose_at(Some(0), seconds, &[]).origins[1];
            at(0.5) - at(0.0)
        };
        let (before, after) = (travel(&model), travel(&read(&bytes)));
        assert!(before.z > 0.4 && after.distance(1.35 * before) < ROUNDING_TOLERANCE, "{before} {after}");
    }
}

/// A turn about the vertical axis takes each frame of a clip to the turned frame: the travel turns with the figure. The
/// travel is at the hips, or at a root outside the cage that carries no vertices. If the figure is tilted, the travel stays
/// on the ground.
#[test]
fn travel_of_turned_joints_turns_with_the_figure() {
    let (turn, tilt) = (Quat::from_rotation_y(1.1), Quat::from_rotation_x(0.4));
    for (travels, turn) in [(0, turn), (1, turn), (0, tilt), (1, tilt)] {
        let turned = |p: Vec3| turn * p;
        let mut robot = robot();
        robot.json["animations"] = json!([]);
        let rest = translation(&robot.json, 1) * travels as f32;
        let keys = [rest, rest + vec3(0.3, 0.0, 1.0)].map(|key| key.to_array());
        // The rotation tracks make hips and foot animated nodes, so that the root carries no vertices itself.
        let still = || [0.0, 0.0, 0.0, 1.0].repeat(2);
        let travel = keys.as_flattened().to_vec();
        clip(
            &mut robot,
            &[(travels, "translation", travel), (1, "rotation", still()), (3, "rotation", still())],
        );
        let model = read(&robot.glb());
        let (joints, extra) = (model.joints().unwrap(), model.extra_points().unwrap());
        let root = joints.iter().find(|joint| joint.node == 0).map(|root| model.positions.len() + root.point);
        let points = model.positions.iter().chain(&extra).enumerate();
        // The seven points of a root outside the cage stay.
        let by: Vec<DVec3> = points
            .map(|(k, &p)| {
                let stays = root.is_some_and(|root| (root..root + 7).contains(&k));
                if stays { DVec3::ZERO } else { turned(p).as_dvec3() - p.as_dvec3() }
            })
            .collect();
        let outside: Vec<u32> = root.into_iter().flat_map(|root| root..root + 7).map(|k| k as u32).collect();
        let options = ReshapeOptions { joints: Joints::Turn, ..ReshapeOptions::default() };
        let bytes = model.write_reshaped(&by, &outside, &[], &options).unwrap().0;
        let after = model.player_of(&bytes).unwrap();
        if turn == tilt {
            let at = |seconds| after.pose_at(Some(0), seconds, &[]).origins[1];
            let (travel, way) = (at(1.0) - at(0.0), vec3(0.3, 0.0, 1.0));
            assert!(travel.normalize().distance(way.normalize()) < 1e-5, "tilted, node {travels}: {travel}");
            continue;
        }
        for seconds in [0.0, 1.0] {
            let before = shown(&player(&model), Some(0), seconds, &[]);
            let expected: Vec<Vec3> = before.iter().map(|&p| turned(p)).collect();
            let found = shown(&after, Some(0), seconds, &[]);
            assert_near(&found, &expected, 1e-5, &format!("travel of node {travels} at {seconds} s"));
        }
    }
}

/// An animated node without a mesh is in the gap between its two boxes, outside the cage. It moves with the boxes.
#[test]
fn pivots_outside_the_cage_move_with_what_they_carry() {
    let mut b = Builder::new();
    let mesh = centred_cube(&mut b);
    b.json["nodes"] = json!([
        { "name": "spinner", "children": [1, 2] },
        { "mesh": mesh, "translation": [-2.0, 0.0, 0.0] },
        { "mesh": mesh, "translation": [2.0, 0.0, 0.0] },
    ]);
    b.json["scenes"] = json!([{ "nodes": [0] }]);
    clip(&mut b, &[(0, "rotation", vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8])]);
    let model = read(&b.glb());
    let spinner = model.joints().unwrap().into_iter().find(|joint| joint.node == 0).unwrap();
    let pivot = model.positions.len() + spinner.point;
    let n = model.positions.len() + model.extra_points().unwrap().len();
    let by: Vec<DVec3> =
        (0..n).map(|k| if (pivot..pivot + 7).contains(&k) { DVec3::ZERO } else { DVec3::Z }).collect();
    let outside: Vec<u32> = (pivot..pivot + 7).map(|k| k as u32).collect();
    let (bytes, report) = model.write_reshaped(&by, &outside, &[], &ReshapeOptions::default()).unwrap();
    assert_eq!(report.joints_outside, 0);
    let before = shown(&player(&model), Some(0), 1.0, &[]);
    let expected: Vec<Vec3> = before.iter().map(|&p| p + Vec3::Z).collect();
    assert_near(&shown(&model.player_of(&bytes).unwrap(), Some(0), 1.0, &[]), &expected, 1e-5, "at 1 s");
    // With its boxes outside the cage, too, it stays, and the notice has its name.
    let outside: Vec<u32> = (0..n as u32).collect();
    let (_, report) = model.write_reshaped(&by, &outside, &[], &ReshapeOptions::default()).unwrap();
    let notices = report.notices().join("\n");
    assert!(notices.contains("outside the cage (spinner, "), "{notices}");
}

/// A uniform scale s takes each place of each clip to s times that place.
#[test]
fn travel_of_clips_has_the_unit_of_the_model() {
    let model = read(&robot().glb());
    for scale in [0.01, 100.0] {
        let after = player(&read(&moved_by(&model, Joints::Follow, |p| scale * p)));
        for (clip, seconds) in [(0, 0.5), (0, 1.0), (1, 0.0)] {
            let before = player(&model).pose_at(Some(clip), seconds, &[]).origins;
            let expected: Vec<Vec3> = before.iter().map(|&p| scale * p).collect();
            let found = &after.pose_at(Some(clip), seconds, &[]).origins;
            assert_near(found, &expected, scale * ROUNDING_TOLERANCE, &format!("scale {scale}, clip {clip}"));
        }
    }
}

/// A node that shows a skinned mesh carries a prop. Under a uniform scale s, a clip that moves the node takes the prop
/// to s times its places.
#[test]
fn animated_nodes_with_skinned_meshes_follow_the_cage() {
    let mut rig = rigged();
    let mesh = centred_cube(&mut rig);
    rig.push("nodes", json!({ "name": "prop", "mesh": mesh, "translation": [0.0, -1.0, 0.0] }));
    rig.json["nodes"][4]["children"] = json!([5]);
    clip(&mut rig, &[(4, "translation", vec![7.0, 7.0, 7.0, 7.0, 7.5, 9.0])]);
    let model = read(&rig.glb());
    let after = player(&read(&moved_by(&model, Joints::Follow, |p| 1.6 * p)));
    for seconds in [0.0, 0.6, 1.0] {
        let before = shown(&player(&model), Some(1), seconds, &[]);
        let expected: Vec<Vec3> = before.iter().map(|&p| 1.6 * p).collect();
        assert_near(&shown(&after, Some(1), seconds, &[]), &expected, 1e-5, &format!("{seconds} s"));
    }
}

#[test]
fn joints_that_show_skinned_meshes_follow_the_cage() {
    let mut rig = rigged();
    rig.json["skins"][0]["joints"] = json!([1, 2, 4]);
    let model = read(&rig.glb());
    let bytes = reshaped(&model, Joints::Follow).0;
    let [found, expected] = [translation(&json_of(&bytes), 4), f(Vec3::splat(7.0))];
    assert!(found.distance(expected) <= 1e-5, "{found} instead of {expected}");
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    assert_near(&read(&bytes).positions, &moved, 2e-5, "at rest");
}

/// [`rigged`] with joints whose scales differ along their axes, and with a cube on the tip.
fn unevenly_scaled() -> Model {
    let mut rig = rigged();
    let mesh = centred_cube(&mut rig);
    rig.json["nodes"][1]["scale"] = json!([1.0, 2.0, 0.5]);
    rig.json["nodes"][2]["rotation"] = json!([0.0, 0.28, 0.0, 0.96]);
    rig.json["nodes"][3]["children"] = json!([5]);
    rig.push("nodes", json!({ "name": "sword", "mesh": mesh, "translation": [0.1, 0.1, 0.0] }));
    read(&rig.glb())
}

/// A translation, a rotation and a scale cannot express the shear of a turned joint below one with such a scale.
#[test]
fn origins_of_turned_joints_with_uneven_scales_follow_the_cage() {
    let model = unevenly_scaled();
    let origins = |model: &Model| player(model).pose_at(None, 0.0, &[]).origins;
    for joints in [Joints::Follow, Joints::Turn] {
        let after = origins(&read(&reshaped(&model, joints).0));
        for node in [1, 2, 3, 5] {
            let expected = f(origins(&model)[node]);
            let off = after[node].distance(expected);
            assert!(off <= 1e-5, "{joints:?}: node {node} misses {expected} by {off}");
        }
    }
}

#[test]
fn rigid_props_on_joints_with_uneven_scales_keep_all_lengths() {
    let model = unevenly_scaled();
    let lengths = |at: &[Vec3]| -> Vec<f32> {
        let corners = &at[at.len() - 8..];
        corners.iter().flat_map(|a| corners.iter().map(move |b| a.distance(*b))).collect()
    };
    for joints in [Joints::Follow, Joints::Stay, Joints::Turn] {
        let options = ReshapeOptions { joints, rigid: vec!["sword".into()], ..ReshapeOptions::default() };
        let after = read(&model.write_reshaped(&by(&model), &[], &[], &options).unwrap().0);
        assert!(after.positions.last() != model.positions.last());
        for (before, after) in lengths(&model.positions).into_iter().zip(lengths(&after.positions)) {
            assert!((after - before).abs() < 1e-5, "{joints:?}: {after} instead of {before}");
        }
    }
}
