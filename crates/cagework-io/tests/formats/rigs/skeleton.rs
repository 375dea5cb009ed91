//! Joints that move as those of the same name in another file.

use std::sync::Arc;

use cagework_cage::samples;
use cagework_io::{Joints, Model, ReshapeOptions, UpAxis, write_mesh_glb};
use glam::{DVec3, Quat, Vec3, vec3};
use serde_json::json;

use super::{ROUNDING_TOLERANCE, assert_near, by, f, player, read};
use crate::common::{self, json_of, rigged};

/// Tolerance for joints that turn. The gradient of a deformation that moves points of f32 has an error of about 3e-6.
const TURN_TOLERANCE: f32 = 2e-5;

/// The skeleton and the clip of [`rigged`] without its mesh. `tracks`: channels of the clip that are kept. The clip rotates
/// the middle joint.
fn clip_of(tracks: &[usize]) -> Model {
    let mut rig = rigged();
    let file = rig.json.as_object_mut().unwrap();
    ["meshes", "skins"].into_iter().for_each(|key| drop(file.shift_remove(key)));
    rig.json["nodes"][4] = json!({ "name": "bar" });
    rig.json["animations"][0]["channels"][2]["target"]["node"] = 2.into();
    let channels = rig.json["animations"][0]["channels"].as_array().unwrap();
    rig.json["animations"][0]["channels"] = tracks.iter().map(|&track| channels[track].clone()).collect();
    Model::read_with_clips("walk.glb", rig.glb(), &mut |_| None, u64::MAX).unwrap()
}

/// Origins of the joints at a time of the clip: before and after both files are deformed by `moved`, and those of the body.
/// `tracks`: channels of the clip's file.
fn origins(
    (tracks, seconds): (&[usize], f32),
    joints: Joints,
    moved: impl Fn(Vec3) -> Vec3,
) -> [Vec<Vec3>; 3] {
    let (body, clip) = (read(&rigged().glb()), clip_of(tracks));
    let points = [body.positions.clone(), body.extra_points().unwrap()].concat();
    let by: Vec<DVec3> = points.iter().map(|&p| moved(p).as_dvec3() - p.as_dvec3()).collect();
    let mut options = ReshapeOptions { joints, ..ReshapeOptions::default() };
    let (of_body, _) = body.write_reshaped(&by, &[], &[], &options).unwrap();
    options.skeleton = Some(Arc::new(body.skeleton(&by, &[], &options).unwrap()));
    let still = vec![DVec3::ZERO; clip.extra_points().unwrap().len()];
    let (of_clip, report) = clip.write_reshaped(&still, &[], &[], &options).unwrap();
    assert_eq!((report.joints_moved, report.joints), (3, 3));
    let of_clip = Model::read_with_clips("walk.glb", of_clip, &mut |_| None, u64::MAX).unwrap();
    [&clip, &of_clip, &read(&of_body)]
        .map(|model| player(model).pose_at(Some(0), seconds, &[]).origins[1..4].to_vec())
}

#[test]
fn joints_without_tracks_follow_the_body() {
    let shift = vec3(0.5, 0.0, 0.25);
    for (tracks, seconds) in [(&[1, 2][..], 0.4), (&[1, 2], 1.0), (&[2], 0.7)] {
        let [before, after, _] = origins((tracks, seconds), Joints::Follow, |p| p + shift);
        let expected: Vec<Vec3> = before.iter().map(|&p| p + shift).collect();
        assert_near(&after, &expected, ROUNDING_TOLERANCE, &format!("tracks {tracks:?}"));
        let [_, after, body] = origins((tracks, 0.0), Joints::Follow, f);
        assert_near(&after, &body, ROUNDING_TOLERANCE, "first key, which is the rest pose");
    }
}

#[test]
fn joints_at_rest_are_those_of_the_file() {
    let sample = samples::build("humanoid").unwrap();
    let own = sample.rig.as_ref().unwrap();
    let mut model = read(&write_mesh_glb("humanoid", &sample.mesh, &sample.colours, Some(own)).unwrap());
    let rig = model.rest_rig().unwrap().unwrap();
    assert_eq!(rig.joints.len(), own.joints.len());
    for (joint, expected) in rig.joints.iter().zip(&own.joints) {
        assert_eq!((joint.name.as_str(), joint.parent), (expected.name, expected.parent.map(|p| p as u32)));
        assert!(joint.at.distance(expected.at) < 1e-5, "{}: {} {}", joint.name, joint.at, expected.at);
    }
    assert_eq!(rig.first.len(), model.positions.len() + 1);
    for (range, expected) in rig.first.windows(2).zip(&own.influences) {
        let influences = &rig.influences[range[0] as usize..range[1] as usize];
        let sum = |joint| {
            let own = influences.iter().filter(|influence| influence.0 == joint);
            own.map(|influence| influence.1).sum::<f32>()
        };
        assert!(expected.iter().all(|&(joint, weight)| (sum(joint) - weight).abs() < 0.01));
    }
    // The joints turn with the positions.
    model.set_up(UpAxis::Z);
    let turned = model.rest_rig().unwrap().unwrap();
    let at = |rig: &cagework_core::rig::Rig| rig.joints.iter().map(|joint| joint.at).collect::<Vec<_>>();
    assert_eq!(at(&turned), UpAxis::Z.turned(&at(&rig)).into_owned());
}

/// Key of the clip at which the file of clips is at rest, and tolerance for lengths of bones, m.
const KEY: usize = 20;
const LENGTH_TOLERANCE: f32 = 1e-4;

/// Many exporters write the pose of the current frame as the rest pose of a file of clips. Rotations do not change the
/// length of a bone, so in each frame a bone is as long as in the deformed body.
#[test]
fn bones_have_the_lengths_of_the_body_whatever_the_rest_pose() {
    let sample = samples::build("humanoid").unwrap();
    let glb = write_mesh_glb("humanoid", &sample.mesh, &sample.colours, sample.rig.as_ref()).unwrap();
    let body = read(&glb);
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let (mut json, bin) = (json_of(&glb), &glb[28 + length..]);
    let joints: Vec<usize> = json["skins"][0]["joints"]
        .as_array()
        .unwrap()
        .iter()
        .map(|joint| joint.as_u64().unwrap() as usize)
        .collect();
    let children = |node: usize| json["nodes"][node]["children"].as_array().into_iter().flatten();
    let bones: Vec<(usize, usize)> = joints
        .iter()
        .flat_map(|&node| children(node).map(move |child| (node, child.as_u64().unwrap() as usize)))
        .filter(|(_, child)| joints.contains(child))
        .collect();
    assert!(bones.len() > 10);
    let animation = json["animations"][0].clone();
    for channel in animation["channels"].as_array().unwrap() {
        let path = channel["target"]["path"].as_str().unwrap();
        let n = if path == "rotation" { 4 } else { 3 };
        let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
        let accessor = &json["accessors"][sampler["output"].as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let start = view["byteOffset"].as_u64().unwrap_or(0) as usize + 4 * n * KEY;
        let key: Vec<f32> =
            bin[start..start + 4 * n].as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        json["nodes"][channel["target"]["node"].as_u64().unwrap() as usize][path] = json!(key);
    }
    let file = json.as_object_mut().unwrap();
    ["meshes", "skins"].into_iter().for_each(|key| drop(file.shift_remove(key)));
    for node in file["nodes"].as_array_mut().unwrap() {
        let node = node.as_object_mut().unwrap();
        ["mesh", "skin"].into_iter().for_each(|key| drop(node.shift_remove(key)));
    }
    let clips = |bytes: Vec<u8>| Model::read_with_clips("walk.glb", bytes, &mut |_| None, u64::MAX).unwrap();
    let clip = clips(common::glb(&json, Some(bin)));
    for joints in [Joints::Follow, Joints::Turn] {
        let mut options = ReshapeOptions { joints, ..ReshapeOptions::default() };
        let (of_body, _) = body.write_reshaped(&by(&body), &[], &[], &options).unwrap();
        options.skeleton = Some(Arc::new(body.skeleton(&by(&body), &[], &options).unwrap()));
        let still = vec![DVec3::ZERO; clip.extra_points().unwrap().len()];
        let (of_clip, _) = clip.write_reshaped(&still, &[], &[], &options).unwrap();
        let (of_body, of_clip) = (read(&of_body), clips(of_clip));
        for seconds in [0.0, 0.3, 0.9] {
            let origins = |model: &Model| player(model).pose_at(Some(0), seconds, &[]).origins;
            let (in_body, in_clip, before) = (origins(&of_body), origins(&of_clip), origins(&body));
            for &(a, b) in &bones {
                let [expected, found, old] =
                    [&in_body, &in_clip, &before].map(|origins| origins[a].distance(origins[b]));
                let off = (found - expected).abs();
                assert!(
                    off < LENGTH_TOLERANCE,
                    "{joints:?} {a} {b}: {found} instead of {expected}, before {old}"
                );
            }
        }
    }
}

/// Programs give bones different axes. If the positions of the joints are those of the body, the joints move as in the
/// body.
#[test]
fn axes_of_bones_do_not_change_where_joints_move() {
    let (body, mut rig) = (read(&rigged().glb()), rigged());
    let file = rig.json.as_object_mut().unwrap();
    ["meshes", "skins", "animations"].into_iter().for_each(|key| drop(file.shift_remove(key)));
    rig.json["nodes"][4] = json!({ "name": "bar" });
    // "root" turns by 90 degrees about z, which takes x to y. Its bone leads along its own x now, and "middle" turns back.
    let turn = std::f32::consts::FRAC_1_SQRT_2;
    rig.json["nodes"][1]["rotation"] = json!([0.0, 0.0, turn, turn]);
    rig.json["nodes"][2]["translation"] = json!([0.5, 0.0, 0.0]);
    rig.json["nodes"][2]["rotation"] = json!([0.0, 0.0, -turn, turn]);
    let times = rig.accessor(&common::floats(&[0.0, 1.0]), common::F32, 2, "SCALAR");
    let turns =
        rig.accessor(&common::floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]), common::F32, 2, "VEC4");
    rig.push(
        "animations",
        json!({
            "samplers": [{ "input": times, "output": turns }],
            "channels": [{ "sampler": 0, "target": { "node": 3, "path": "rotation" } }],
        }),
    );
    let clips = |bytes| Model::read_with_clips("walk.glb", bytes, &mut |_| None, u64::MAX).unwrap();
    let clip = clips(rig.glb());
    let mut options = ReshapeOptions::default();
    let (of_body, _) = body.write_reshaped(&by(&body), &[], &[], &options).unwrap();
    options.skeleton = Some(Arc::new(body.skeleton(&by(&body), &[], &options).unwrap()));
    let still = vec![DVec3::ZERO; clip.extra_points().unwrap().len()];
    let (of_clip, _) = clip.write_reshaped(&still, &[], &[], &options).unwrap();
    let at_rest = |model: &Model| player(model).pose_at(None, 0.0, &[]).origins[1..4].to_vec();
    assert_near(&at_rest(&clips(of_clip)), &at_rest(&read(&of_body)), ROUNDING_TOLERANCE, "at rest");
}

#[test]
fn joints_turn_as_in_the_body() {
    let turn = Quat::from_axis_angle(vec3(1.0, 2.0, 3.0).normalize(), 0.8);
    let moved = |p| turn * p + vec3(0.2, 0.0, 0.1);
    for (tracks, seconds) in [(&[1, 2][..], 0.4), (&[1, 2], 1.0), (&[2], 0.7)] {
        let [before, after, _] = origins((tracks, seconds), Joints::Turn, moved);
        let expected: Vec<Vec3> = before.into_iter().map(moved).collect();
        assert_near(&after, &expected, TURN_TOLERANCE, &format!("tracks {tracks:?} at {seconds} s"));
        let [_, after, body] = origins((tracks, 0.0), Joints::Turn, f);
        assert_near(&after, &body, TURN_TOLERANCE, "first key, which is the rest pose");
    }
}

/// The body is 100 times as large as the file of clips, so all places in clips are 100 times as far from the origin.
#[test]
fn lifts_have_the_unit_of_the_file_of_clips() {
    // The clip holds the root above the ground.
    let mut rig = rigged();
    let raised = rig.accessor(&common::floats(&[0.0, 0.5, 0.0, 0.0, 0.6, 0.6]), common::F32, 2, "VEC3");
    rig.json["animations"][0]["samplers"][0]["output"] = raised.into();
    let body = read(&rig.glb());
    let file = rig.json.as_object_mut().unwrap();
    ["meshes", "skins"].into_iter().for_each(|key| drop(file.shift_remove(key)));
    rig.json["nodes"][4] = json!({ "name": "bar" });
    rig.json["animations"][0]["channels"].as_array_mut().unwrap().truncate(3);
    rig.json["nodes"][0]["scale"] = json!([0.02, 0.02, 0.02]);
    let read_clips =
        |bytes: Vec<u8>| Model::read_with_clips("a.glb", &bytes, &mut |_| None, u64::MAX).unwrap();
    let clips = read_clips(rig.glb());
    let mut options = ReshapeOptions { ground: true, ..ReshapeOptions::default() };
    let (of_body, report) = body.write_reshaped(&by(&body), &[], &[], &options).unwrap();
    assert!(report.lift < -0.01 && report.clip_lifts[0] < -0.1, "{report:?}");
    options.skeleton = Some(Arc::new(body.skeleton(&by(&body), &[], &options).unwrap()));
    let still = vec![DVec3::ZERO; clips.extra_points().unwrap().len()];
    let (of_clips, of_report) = clips.write_reshaped(&still, &[], &[], &options).unwrap();
    assert!((100.0 * of_report.lift - report.lift).abs() < 1e-6, "{of_report:?}");
    for seconds in [0.0, 0.3, 1.0] {
        let places = |model: &Model, scale: f32| -> Vec<Vec3> {
            let origins = player(model).pose_at(Some(0), seconds, &[]).origins;
            origins[1..4].iter().map(|&p| scale * p).collect()
        };
        let (found, expected) = (places(&read_clips(of_clips.clone()), 100.0), places(&read(&of_body), 1.0));
        assert_near(&found, &expected, 5.0 * ROUNDING_TOLERANCE, &format!("{seconds} s"));
    }
}

#[test]
fn nodes_without_a_name_do_not_match() {
    let nameless = |mut rig: common::Builder| {
        for node in rig.json["nodes"].as_array_mut().unwrap() {
            node.as_object_mut().unwrap().shift_remove("name");
        }
        rig
    };
    let body = read(&nameless(rigged()).glb());
    let mut rig = nameless(rigged());
    let file = rig.json.as_object_mut().unwrap();
    ["meshes", "skins"].into_iter().for_each(|key| drop(file.shift_remove(key)));
    rig.json["nodes"][4] = json!({});
    let clips = Model::read_with_clips("walk.glb", rig.glb(), &mut |_| None, u64::MAX).unwrap();
    let mut options = ReshapeOptions::default();
    options.skeleton = Some(Arc::new(body.skeleton(&by(&body), &[], &options).unwrap()));
    let still = vec![DVec3::ZERO; clips.extra_points().unwrap().len()];
    let error = clips.write_reshaped(&still, &[], &[], &options).map(drop).unwrap_err().to_string();
    assert!(error.contains("none of its nodes has the name of a joint of the skeleton"), "{error}");
}
