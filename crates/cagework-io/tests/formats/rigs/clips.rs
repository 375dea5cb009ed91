//! Animation clips: adaptation of tracks, and baking.

use cagework_io::{Joints, Player, WriteError};
use glam::Vec3;

use super::{ROUNDING_TOLERANCE, assert_near, f, player, read, reshaped, shown};
use crate::common::{self, json_of, rigged};

#[test]
fn rotations_scales_and_weights_of_clips_keep_their_bytes_and_translations_grow_with_bones() {
    let model = read(&rigged().glb());
    let (bytes, report) = reshaped(&model, Joints::Follow);
    let [old, new] = [rigged().glb(), bytes].map(|bytes| player(&read(&bytes)));
    assert_eq!(report.tracks, 2, "tracks of the root, which moves, and of a bone of constant length");
    let json = json_of(&reshaped(&model, Joints::Follow).0);
    let before = json_of(&rigged().glb());
    for k in 0..4 {
        let output = |json: &serde_json::Value| json["animations"][0]["samplers"][k]["output"].clone();
        assert_eq!(output(&json), output(&before), "in place");
    }
    // Joints keep their orientation, so only translations of the palette change.
    for seconds in [0.0, 0.4, 1.0] {
        let [a, b] = [&old, &new].map(|player| player.pose_at(Some(0), seconds, &[]));
        let linear = |m: &glam::Mat4| glam::Mat3::from_mat4(*m);
        for (a, b) in a.palette.iter().zip(&b.palette) {
            assert!(linear(a).abs_diff_eq(linear(b), ROUNDING_TOLERANCE), "at {seconds} s");
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
fn clips_do_not_affect_the_reshaped_positions() {
    let mut still = rigged();
    still.json.as_object_mut().unwrap().shift_remove("animations");
    let [with, without] = [rigged().glb(), still.glb()].map(|bytes| {
        let (bytes, _) = reshaped(&read(&bytes), Joints::Follow);
        read(&bytes).positions
    });
    assert_eq!(with, without);
}

/// Translations between the keys of a cubic spline are mapped like those at the keys, because the map's linear part is
/// applied to the tangents.
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
    // `f` scales heights by 1.2, so the translations of the root scale by 1.2 as well.
    let root = |player: &Player, seconds: f32| player.pose_at(Some(0), seconds, &[]).origins[1];
    for seconds in [0.0, 0.3, 0.7, 1.0] {
        let [old, new] = [&before, &after].map(|player| root(player, seconds));
        let expected = f(Vec3::ZERO) + 1.2 * old;
        assert!(
            new.distance(expected) <= 4.0 * ROUNDING_TOLERANCE,
            "{new} instead of {expected} at {seconds} s"
        );
    }
}

/// A baked clip reproduces the given frames.
#[test]
fn baked_clip_shows_its_frames() {
    let model = read(&rigged().glb());
    let frames = model.frames(0).unwrap();
    let seconds = model.clips()[0].seconds;
    assert_eq!(frames.len(), 1 + (30.0 * seconds).ceil() as usize);
    let last = frames.len() - 1;
    for (k, frame) in frames.iter().enumerate() {
        let at = seconds * k as f32 / last as f32;
        assert_near(frame, &shown(&player(&model), Some(0), at, &[]), ROUNDING_TOLERANCE, "as it plays");
    }
    let bent: Vec<Vec<Vec3>> = frames.iter().map(|frame| frame.iter().map(|&p| f(p)).collect()).collect();
    let rest: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    let bytes = model.write_baked(0, &rest, bent.clone()).unwrap();
    let baked = read(&bytes);
    assert_near(&baked.positions, &rest, ROUNDING_TOLERANCE, "at rest");
    let baked_player = player(&baked);
    assert_eq!((baked.clips().len(), baked.clips()[0].name.as_deref()), (1, Some("walk")));
    for (k, frame) in bent.iter().enumerate() {
        let at = shown(&baked_player, Some(0), seconds * k as f32 / last as f32, &[]);
        assert_near(&at, frame, 4.0 * ROUNDING_TOLERANCE, &format!("frame {k}"));
    }
    assert_eq!(model.frames(7).unwrap_err(), WriteError::NoClip(7));
}

/// Clips of more than two seconds have 61 frames, the last at the clip's end.
#[test]
fn long_clip_is_baked_to_61_frames() {
    let mut rig = rigged();
    let (end, n) = (10.0_f32, 2);
    let times: Vec<u8> = [0.0, end].into_iter().flat_map(f32::to_le_bytes).collect();
    let input = rig.accessor(&times, common::F32, n, "SCALAR");
    rig.json["accessors"][input]["min"] = serde_json::json!([0.0]);
    rig.json["accessors"][input]["max"] = serde_json::json!([end]);
    let values: Vec<u8> = [0.0_f32, 0., 0., 0., 1., 0.].into_iter().flat_map(f32::to_le_bytes).collect();
    let output = rig.accessor(&values, common::F32, n, "VEC3");
    rig.json["animations"] = serde_json::json!([{
        "name": "rise",
        "samplers": [{ "input": input, "output": output }],
        "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
    }]);
    let model = read(&rig.glb());
    let frames = model.frames(0).unwrap();
    assert_eq!(frames.len(), 61);
    assert_near(&frames[60], &shown(&player(&model), Some(0), end, &[]), ROUNDING_TOLERANCE, "at the end");
}

/// Two channels with a missing sampler must stay unchanged. Indexing the JSON would add null members.
#[test]
fn channels_with_a_missing_sampler_stay_unchanged() {
    let mut rig = rigged();
    for channel in [0, 1] {
        rig.json["animations"][0]["channels"][channel]["sampler"] = 99.into();
    }
    let model = read(&rig.glb());
    let (bytes, report) = reshaped(&model, Joints::Follow);
    assert_eq!((report.tracks, report.tracks_unread), (0, 2));
    assert_eq!(json_of(&bytes)["animations"], rig.json["animations"]);
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    assert_near(&read(&bytes).positions, &moved, ROUNDING_TOLERANCE, "at rest");
}

/// Channels that share samplers or accessors get separate values; the last one reuses the shared accessor.
#[test]
fn shared_samplers_and_accessors_are_separated() {
    let mut rig = rigged();
    let root = rig.json["animations"][0]["samplers"][0]["output"].clone();
    rig.json["animations"][0]["samplers"][1]["output"] = root.clone();
    // Root and middle share one sampler. The new channel of the tip uses another sampler with the same output.
    rig.json["animations"][0]["channels"][1]["sampler"] = 0.into();
    let channel = serde_json::json!({ "sampler": 1, "target": { "node": 3, "path": "translation" } });
    rig.json["animations"][0]["channels"].as_array_mut().unwrap().push(channel);
    let [before, after] = [rig.glb(), reshaped(&read(&rig.glb()), Joints::Follow).0];
    let json = json_of(&after);
    let outputs: Vec<_> = [0, 1, 4]
        .map(|c| json["animations"][0]["channels"][c]["sampler"].as_u64().unwrap())
        .map(|s| json["animations"][0]["samplers"][s as usize]["output"].as_u64().unwrap())
        .into();
    assert!(outputs[0] != outputs[1] && outputs[1] != outputs[2] && outputs[0] != outputs[2], "{outputs:?}");
    assert!(outputs.contains(&root.as_u64().unwrap()), "{outputs:?}: the shared accessor is reused");
    // All translations scale by 1.2, as heights do under `f`.
    let at = |bytes: &[u8], seconds| player(&read(bytes)).pose_at(Some(0), seconds, &[]).origins;
    let [old, new] = [&before, &after].map(|bytes| [at(bytes, 0.0), at(bytes, 1.0)]);
    let way = |of: &[Vec<Vec3>; 2], node: usize| of[1][node] - of[0][node];
    for node in [1, 2] {
        let (found, expected) = (way(&new, node), 1.2 * way(&old, node));
        assert!(found.distance(expected) <= 4.0 * ROUNDING_TOLERANCE, "{found} instead of {expected}");
    }
}

#[test]
fn unnamed_clips_are_called_by_their_index() {
    let mut rig = rigged();
    rig.json["animations"][0].as_object_mut().unwrap().shift_remove("name");
    let model = read(&rig.glb());
    assert_eq!(model.states(Some("clip 0")).unwrap(), read(&rigged().glb()).states(Some("walk")).unwrap());
    let message = model.states(Some("walk")).unwrap_err().to_string();
    assert_eq!(message, "there is no clip 'walk'; the model has clip 0");
}

/// Counting all references to accessors again for each track would take quadratic time: more than 5 min for 60 clips of
/// 65 joints.
#[test]
fn many_clips_take_linear_time() {
    let mut rig = rigged();
    let animation = rig.json["animations"][0].clone();
    let output = rig.json["animations"][0]["samplers"][0]["output"].as_u64().unwrap() as usize;
    for _ in 0..4000 {
        let accessor = rig.json["accessors"][output].clone();
        let own = rig.push("accessors", accessor);
        let mut clip = animation.clone();
        clip["samplers"][0]["output"] = own.into();
        rig.push("animations", clip);
    }
    let model = read(&rig.glb());
    // This takes 0.4 s. An algorithm of quadratic time would take half a minute.
    let (bytes, report) = reshaped(&model, Joints::Follow);
    assert_eq!(report.tracks, 2 * 4001);
    assert_eq!(read(&bytes).clips().len(), 4001);
}

/// The number of values must match the keys and the width of the property.
#[test]
fn channels_with_too_few_values_are_ignored() {
    let mut rig = rigged();
    let whole = player(&read(&rig.glb())).clips()[0].channels;
    let output = rig.json["animations"][0]["samplers"][0]["output"].as_u64().unwrap() as usize;
    let count = rig.json["accessors"][output]["count"].as_u64().unwrap();
    for interpolation in ["LINEAR", "CUBICSPLINE"] {
        rig.json["animations"][0]["samplers"][0]["interpolation"] = interpolation.into();
        rig.json["accessors"][output]["count"] = (2 * count / 3).into();
        let model = read(&rig.glb());
        let player = player(&model);
        assert_eq!(player.clips()[0].channels, whole - 1, "{interpolation}");
        assert_eq!(
            player.pose_at(Some(0), 0.5, &[]).palette.len(),
            player.pose_at(None, 0.0, &[]).palette.len()
        );
        assert!(model.states(Some(&player.clips()[0].label(0))).is_ok());
    }
}

/// A clip with one key has length 0. Times of keys must increase strictly (glTF 2.0, section 3.11), so it has one frame.
#[test]
fn baked_clip_of_one_key_has_one_frame() {
    let mut rig = rigged();
    let samplers = rig.json["animations"][0]["samplers"].clone();
    for accessor in samplers.as_array().unwrap().iter().flat_map(|s| [&s["input"], &s["output"]]) {
        let accessor = &mut rig.json["accessors"][accessor.as_u64().unwrap() as usize];
        let is_weights = accessor["type"] == "SCALAR" && accessor["count"] == 4;
        accessor["count"] = if is_weights { 2 } else { 1 }.into();
        accessor["max"] = accessor["min"].clone();
    }
    let model = read(&rig.glb());
    assert_eq!(model.clips()[0].seconds, 0.0);
    let frames = model.frames(0).unwrap();
    assert_eq!(frames.len(), 1);
    let json = json_of(&model.write_baked(0, &model.positions, frames).unwrap());
    let input = json["animations"][0]["samplers"][0]["input"].as_u64().unwrap() as usize;
    assert_eq!(json["accessors"][input]["count"], 1);
}

/// Two nodes with different skins show one mesh, which is copied. A clip that points to the weights of the mesh plays both.
#[test]
fn pointers_to_the_weights_of_a_mesh_play_its_copies() {
    let mut rig = rigged();
    let skin = rig.json["skins"][0].clone();
    rig.push("skins", skin);
    rig.json["skins"][1]["joints"] = serde_json::json!([3, 2, 1]);
    rig.push("nodes", serde_json::json!({ "name": "other", "mesh": 0, "skin": 1 }));
    rig.json["scenes"][0]["nodes"] = serde_json::json!([0, 4, 5]);
    rig.json["animations"][0]["channels"][3]["target"] = serde_json::json!({
        "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": "/meshes/0/weights" } }
    });
    rig.json["extensionsUsed"] = serde_json::json!(["KHR_animation_pointer"]);
    let model = read(&rig.glb());
    let (bytes, _) = reshaped(&model, Joints::Follow);
    assert_eq!(json_of(&bytes)["meshes"].as_array().unwrap().len(), 2);
    // The last key of the weights is [1, 0.5].
    for played in [player(&model), player(&read(&bytes))] {
        assert_eq!(played.pose_at(Some(0), 1.0, &[]).targets, [1.0, 0.5, 1.0, 0.5]);
    }
}
