//! Joints that move as those of the same name in another file.

use std::sync::Arc;

use cagework_io::{Joints, Model, ReshapeOptions};
use glam::{DVec3, Quat, Vec3, vec3};
use serde_json::json;

use super::{ROUNDING_TOLERANCE, assert_near, f, player, read};
use crate::common::rigged;

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
        .map(|model| player(model).at(Some(0), seconds, &[]).origins[1..4].to_vec())
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
