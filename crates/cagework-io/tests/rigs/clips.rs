//! Clips: what becomes of their tracks, and how they are baked.

use cagework_io::{Joints, Player, WriteError};
use glam::{Vec3, vec3};

use super::common::{self, json_of, rigged};
use super::{ROUNDED, assert_near, f, player, read, reshaped, shown};

#[test]
fn rotations_scales_and_weights_of_clips_keep_their_bytes_and_translations_grow_with_bones() {
    let model = read(&rigged().glb());
    let (bytes, report) = reshaped(&model, Joints::Follow);
    let [old, new] = [rigged().glb(), bytes].map(|bytes| player(&read(&bytes)));
    assert_eq!(report.tracks, 2, "of the root, which moves, and of a bone, which stands still");
    let json = json_of(&reshaped(&model, Joints::Follow).0);
    let before = json_of(&rigged().glb());
    for k in 0..4 {
        let output = |json: &serde_json::Value| json["animations"][0]["samplers"][k]["output"].clone();
        assert_eq!(output(&json), output(&before), "in place");
    }
    // The tip turns about its joint, which has moved: the clip's end is the same turn about another place.
    for seconds in [0.0, 0.4, 1.0] {
        let [a, b] = [&old, &new].map(|player| player.at(Some(0), seconds, &[]));
        let linear = |m: &glam::Mat4| glam::Mat3::from_mat4(*m);
        for (a, b) in a.palette.iter().zip(&b.palette) {
            assert!(linear(a).abs_diff_eq(linear(b), ROUNDED), "at {seconds} s");
        }
        assert_eq!(a.targets, b.targets);
    }
    let (stay, _) = reshaped(&model, Joints::Stay);
    assert_eq!(json_of(&stay)["nodes"], before["nodes"]);
}

#[test]
fn pointers_to_nodes_are_tracks_as_well() {
    let mut rig = rigged();
    for (k, pointer) in [(0, "/nodes/1/translation"), (1, "/nodes/2/translation"), (3, "/nodes/4/weights")] {
        rig.json["animations"][0]["channels"][k]["target"] = serde_json::json!({
            "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": pointer } }
        });
    }
    rig.json["extensionsUsed"] = serde_json::json!(["KHR_animation_pointer"]);
    let [plain, pointed] = [rigged().glb(), rig.glb()].map(|bytes| read(&bytes));
    let [(a, of_plain), (b, of_pointed)] = [&plain, &pointed].map(|model| reshaped(model, Joints::Follow));
    assert_eq!(of_plain, of_pointed);
    let [a, b] = [a, b].map(|bytes| shown(&player(&read(&bytes)), Some(0), 0.6, &[]));
    assert_eq!(a, b);
}

#[test]
fn clips_do_not_change_what_becomes_of_the_shape() {
    let mut still = rigged();
    still.json.as_object_mut().unwrap().shift_remove("animations");
    let [with, without] = [rigged().glb(), still.glb()].map(|bytes| {
        let (bytes, _) = reshaped(&read(&bytes), Joints::Follow);
        read(&bytes).positions
    });
    assert_eq!(with, without);
}

/// Between keys a spline is the rule's, too: its tangents take the linear part.
#[test]
fn splines_follow_the_rule_between_their_keys() {
    let mut rig = rigged();
    let values: [f32; 18] = [0., 0., 0., 0., 0., 0., 0.3, 0., 1., 0.2, -1., 0., 0., 0.1, 0.6, 0., 0., 0.];
    let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let output = rig.accessor(&bytes, common::F32, 6, "VEC3");
    rig.json["animations"][0]["samplers"][0]["output"] = output.into();
    rig.json["animations"][0]["samplers"][0]["interpolation"] = "CUBICSPLINE".into();
    let model = read(&rig.glb());
    let (before, after) = (player(&model), player(&read(&reshaped(&model, Joints::Follow).0)));
    // The root is the lowest joint: it travels as far as before.
    let root = |player: &Player, seconds: f32| {
        let at = player.at(Some(0), seconds, &[]).palette[1];
        at.transform_point3(vec3(4.0, 0.0, 0.0))
    };
    for seconds in [0.0, 0.3, 0.7, 1.0] {
        let [old, new] = [&before, &after].map(|player| root(player, seconds));
        // `G' B' = G B` at rest, and the same way from there.
        assert!(new.distance(old) <= 2.0 * ROUNDED, "{new} instead of {old} at {seconds} s");
    }
}

/// What bends the moving model is baked: at its frames the clip shows what was given.
#[test]
fn baked_clip_shows_its_frames() {
    let model = read(&rigged().glb());
    let frames = model.frames(0).unwrap();
    let seconds = model.clips()[0].seconds;
    assert_eq!(frames.len(), 1 + (30.0 * seconds).ceil() as usize);
    let last = frames.len() - 1;
    for (k, frame) in frames.iter().enumerate() {
        let at = seconds * k as f32 / last as f32;
        assert_near(frame, &shown(&player(&model), Some(0), at, &[]), ROUNDED, "as it plays");
    }
    let bent: Vec<Vec<Vec3>> = frames.iter().map(|frame| frame.iter().map(|&p| f(p)).collect()).collect();
    let rest: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    let bytes = model.write_baked(0, &rest, bent.clone()).unwrap();
    let baked = read(&bytes);
    assert_near(&baked.positions, &rest, ROUNDED, "at rest");
    let baked_player = player(&baked);
    assert_eq!((baked.clips().len(), baked.clips()[0].name.as_deref()), (1, Some("walk")));
    for (k, frame) in bent.iter().enumerate() {
        let at = shown(&baked_player, Some(0), seconds * k as f32 / last as f32, &[]);
        assert_near(&at, frame, 4.0 * ROUNDED, &format!("frame {k}"));
    }
    assert_eq!(model.frames(7).unwrap_err(), WriteError::NoClip(7));
}
