//! Reshaping of rigged models: the rules of `docs/rigs.md`, on a model whose bind pose differs from its rest pose.
//!
//! Expected positions follow from the definition of skinning: `sum_j w_j G_j B_j (p + sum_k t_k d_k)`.

mod clips;
mod features;
mod feet;
mod nodes;
mod people;
mod skeleton;
mod surfaces;

use crate::common::{self, json_of, rigged};
use cagework_core::skin::skin_vertices;
use cagework_io::{Joints, Model, Player, ReshapeOptions, ReshapeReport};
use glam::{DVec3, Vec3, vec3};

/// Tolerance for positions of up to 2 that are transformed back and forth in f32.
const ROUNDING_TOLERANCE: f32 = 2e-6;

fn read(bytes: &[u8]) -> Model {
    Model::read("rigged.glb", bytes, &mut |_| None).unwrap()
}

fn player(model: &Model) -> Player {
    model.player().unwrap().unwrap()
}

fn shown(player: &Player, clip: Option<usize>, seconds: f32, targets: &[f32]) -> Vec<Vec3> {
    let posed = player.pose_at(clip, seconds, targets);
    skin_vertices(&player.skin, &posed.palette, &posed.targets)
}

/// A deformation that is not affine.
fn f(p: Vec3) -> Vec3 {
    p + vec3(0.1 + 0.1 * p.y * p.y, 0.05 + 0.2 * p.y, 0.05 * p.x * p.y)
}

/// Displacements of all points under `f`.
fn by(model: &Model) -> Vec<DVec3> {
    let extra = model.extra_points().unwrap();
    model.positions.iter().chain(&extra).map(|&p| f(p).as_dvec3() - p.as_dvec3()).collect()
}

fn reshaped(model: &Model, joints: Joints) -> (Vec<u8>, ReshapeReport) {
    let options = ReshapeOptions { joints, ..ReshapeOptions::default() };
    model.write_reshaped(&by(model), &[], &[], &options).unwrap()
}

fn assert_near(found: &[Vec3], expected: &[Vec3], within: f32, what: &str) {
    assert_eq!(found.len(), expected.len());
    let off = found.iter().zip(expected).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(off <= within, "{what}: {off:e}");
}

#[test]
fn player_at_rest_matches_the_model() {
    let model = read(&rigged().glb());
    assert_near(&shown(&player(&model), None, 0.0, &[]), &model.positions, ROUNDING_TOLERANCE, "rest");
}

#[test]
fn unmoved_cage_returns_the_input() {
    let bytes = rigged().glb();
    let model = read(&bytes);
    let still = vec![DVec3::ZERO; model.positions.len() + model.extra_points().unwrap().len()];
    for joints in [Joints::Follow, Joints::Stay, Joints::Turn] {
        let options = ReshapeOptions { joints, ..ReshapeOptions::default() };
        assert!(model.write_reshaped(&still, &[], &[], &options).unwrap().0 == bytes, "{joints:?}");
    }
}

/// Reshaping, playback and baking in map coordinates, where f32 has steps of 0.5, are as exact as near the origin.
#[test]
fn rigs_far_from_the_origin_are_as_exact_as_near_it() {
    let place = vec3(500_000.25, 0.0, 4_500_000.5);
    let at_place = |bytes: &[u8]| {
        let mut model = read(bytes);
        model.set_origin(place.as_dvec3());
        model
    };
    let mut b = rigged();
    let near = read(&b.glb());
    b.push("nodes", serde_json::json!({ "translation": place.to_array(), "children": [0, 4] }));
    b.json["scenes"][0]["nodes"] = serde_json::json!([5]);
    let far = at_place(&b.glb());
    assert_eq!(far.notices, near.notices);
    assert_near(&far.positions, &near.positions, ROUNDING_TOLERANCE, "read");
    assert_near(
        &far.extra_points().unwrap(),
        &near.extra_points().unwrap(),
        ROUNDING_TOLERANCE,
        "points of the rig",
    );
    let states = |model: &Model| model.states(Some("walk")).unwrap().0;
    assert_near(&states(&far), &states(&near), ROUNDING_TOLERANCE, "what a cage should enclose");
    let still = vec![DVec3::ZERO; far.positions.len() + far.extra_points().unwrap().len()];
    let unmoved = far.write_reshaped(&still, &[], &[], &ReshapeOptions::default()).unwrap().0;
    assert!(unmoved == b.glb(), "unmoved export is the input");
    let rigid = far.parts(&[], &["bar".to_owned()]).unwrap();
    for (joints, parts) in [Joints::Follow, Joints::Stay, Joints::Turn, Joints::Follow].into_iter().zip([
        Default::default(),
        Default::default(),
        Default::default(),
        rigid,
    ]) {
        let options = ReshapeOptions { joints, parts, ..ReshapeOptions::default() };
        let [far, near] =
            [&far, &near].map(|model| model.write_reshaped(&by(&near), &[], &[], &options).unwrap().0);
        assert_eq!(json_of(&far)["nodes"][5], b.json["nodes"][5]);
        let [far, near] = [at_place(&far), read(&near)].map(|model| player(&model));
        for (clip, targets) in [(None, &[1.0, 0.5]), (Some(0), &[0.25, 0.0])] {
            let [far, near] = [&far, &near].map(|player| shown(player, clip, 0.7, targets));
            assert_near(&far, &near, 2.0 * ROUNDING_TOLERANCE, "reshaped");
        }
    }
    let baked = |model: &Model| model.write_baked(0, &near.positions, near.frames(0).unwrap()).unwrap();
    let [far, near] = [at_place(&baked(&far)), read(&baked(&near))].map(|model| player(&model));
    assert_near(
        &shown(&far, Some(0), 0.7, &[]),
        &shown(&near, Some(0), 0.7, &[]),
        ROUNDING_TOLERANCE,
        "baked",
    );
}

#[test]
fn rest_and_single_targets_follow_the_cage() {
    let model = read(&rigged().glb());
    let before = player(&model);
    for joints in [Joints::Follow, Joints::Stay, Joints::Turn] {
        let (bytes, report) = reshaped(&model, joints);
        let after = player(&read(&bytes));
        let moved = |at: &[Vec3]| at.iter().map(|&p| f(p)).collect::<Vec<_>>();
        let rest = shown(&before, None, 0.0, &[]);
        assert_near(&shown(&after, None, 0.0, &[]), &moved(&rest), ROUNDING_TOLERANCE, "at rest");
        let (names, defaults) = before.targets();
        assert_eq!((names.len(), after.targets()), (2, (names, defaults)));
        for k in 0..names.len() {
            for share in [0.0, 1.0] {
                let mut targets = defaults.to_vec();
                targets[k] = share;
                let state = moved(&shown(&before, None, 0.0, &targets));
                assert_near(
                    &shown(&after, None, 0.0, &targets),
                    &state,
                    ROUNDING_TOLERANCE,
                    &format!("{k} at {share}"),
                );
            }
        }
        assert_eq!(report.joints_moved, if joints == Joints::Stay { 0 } else { 3 });
        assert!(report.max_condition < 2.0);
    }
}

#[test]
fn joints_follow_the_cage_and_keep_skinning_matrices() {
    let model = read(&rigged().glb());
    let (bytes, _) = reshaped(&model, Joints::Follow);
    let (before, after) = (player(&model), player(&read(&bytes)));
    // The palettes contain the skinning matrix `G B` of each joint.
    let [old, new] = [&before, &after].map(|player| player.pose_at(None, 0.0, &[]).palette);
    for (a, b) in old.iter().zip(&new) {
        assert!(a.abs_diff_eq(*b, ROUNDING_TOLERANCE), "{a} {b}");
    }
    let json = json_of(&bytes);
    let world = |node: usize| {
        let at = |n: usize| {
            Vec3::from_array([0, 1, 2].map(|k| json["nodes"][n]["translation"][k].as_f64().unwrap() as f32))
        };
        // The armature scales by two; joints do not rotate.
        at(0) + 2.0 * (1..=node).map(at).sum::<Vec3>()
    };
    for (node, y) in [(1, 0.0), (2, 1.0), (3, 2.0)] {
        assert!(
            world(node).distance(f(vec3(0.0, y, 0.0))) <= ROUNDING_TOLERANCE,
            "joint {node} at {}",
            world(node)
        );
    }
}

#[test]
fn poses_are_appended_to_the_targets() {
    let model = read(&rigged().glb());
    let by = by(&model);
    let still = vec![DVec3::ZERO; by.len()];
    let (bytes, _) =
        model.write_reshaped(&still, &[], &[("bent".into(), by)], &ReshapeOptions::default()).unwrap();
    let after = player(&read(&bytes));
    assert_eq!(after.targets().0, ["wide", "tall", "bent"]);
    let rest = shown(&after, None, 0.0, &[]);
    assert_near(&rest, &model.positions, ROUNDING_TOLERANCE, "rest");
    let mut targets = after.targets().1.to_vec();
    assert_eq!(targets, [0.25, 0.0, 0.0]);
    targets[2] = 1.0;
    let bent: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    assert_near(&shown(&after, None, 0.0, &targets), &bent, ROUNDING_TOLERANCE, "bent");
    // Existing clips have weights for all three targets; the new clip plays the pose.
    assert_near(&shown(&after, Some(1), 1.0, &[]), &bent, ROUNDING_TOLERANCE, "played");
    let old = player(&model);
    assert_near(
        &shown(&after, Some(0), 0.7, &[]),
        &shown(&old, Some(0), 0.7, &[]),
        ROUNDING_TOLERANCE,
        "the old clip",
    );
}

/// A mesh with two skins has two deformations, so it is duplicated with its targets.
#[test]
fn mesh_with_two_skins_is_duplicated() {
    let mut rig = rigged();
    let skin = rig.json["skins"][0].clone();
    let joints = serde_json::json!([3, 2, 1]);
    rig.push("skins", skin);
    rig.json["skins"][1]["joints"] = joints;
    rig.push("nodes", serde_json::json!({ "name": "other", "mesh": 0, "skin": 1 }));
    rig.json["scenes"][0]["nodes"] = serde_json::json!([0, 4, 5]);
    let model = read(&rig.glb());
    let (bytes, _) = reshaped(&model, Joints::Follow);
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    let again = model.player_of(&bytes).unwrap();
    assert_near(&shown(&again, None, 0.0, &[]), &moved, 4.0 * ROUNDING_TOLERANCE, "both");
    let by = by(&model);
    let still = vec![DVec3::ZERO; by.len()];
    let poses = [("bent".to_owned(), by)];
    let (bytes, _) = model.write_reshaped(&still, &[], &poses, &ReshapeOptions::default()).unwrap();
    let again = model.player_of(&bytes).unwrap();
    assert_eq!(again.targets().0, ["wide", "tall", "bent", "wide", "tall", "bent"]);
    let mut targets = again.targets().1.to_vec();
    (targets[2], targets[5]) = (1.0, 1.0);
    assert_near(&shown(&again, None, 0.0, &targets), &moved, 4.0 * ROUNDING_TOLERANCE, "as a pose");
}

#[test]
fn rig_errors_are_reported_or_ignored() {
    let fault = |change: &dyn Fn(&mut common::Builder)| {
        let mut rig = rigged();
        change(&mut rig);
        Model::read("rigged.glb", &rig.glb(), &mut |_| None).map(|m| m.extra_points().map(|p| p.len()))
    };
    let message = |change: &dyn Fn(&mut common::Builder)| fault(change).unwrap_err().to_string();
    assert_eq!(
        message(&|rig| rig.json["skins"][0]["joints"][1] = 99.into()),
        "rigged.glb: skin 0 refers to joint node 99, but there are 5"
    );
    assert_eq!(
        message(&|rig| {
            let binds = rig.json["skins"][0]["inverseBindMatrices"].as_u64().unwrap() as usize;
            rig.json["accessors"][binds]["count"] = 2.into();
        }),
        "rigged.glb: skin 0 refers to inverse bind matrix 2, but there are 2"
    );
    assert_eq!(
        message(&|rig| rig.json["nodes"][3]["children"] = serde_json::json!([1])),
        "rigged.glb: node 1 has two parents: the nodes must be a tree"
    );
    // Viewers accept a file with an unreadable track, so it is no error, and the track stays unchanged.
    let mut rig = rigged();
    let output = rig.json["animations"][0]["samplers"][0]["output"].as_u64().unwrap() as usize;
    rig.json["accessors"][output]["count"] = 1.into();
    let model = read(&rig.glb());
    assert_eq!(reshaped(&model, Joints::Follow).1.tracks_unread, 1);
    for (key, value) in [("channels", serde_json::json!([])), ("samplers", serde_json::json!([]))] {
        let mut rig = rigged();
        rig.json["animations"][0][key] = value;
        let model = read(&rig.glb());
        assert_eq!(player(&model).clips().len(), 1);
        reshaped(&model, Joints::Turn);
    }
}

#[test]
fn cage_of_a_model_encloses_targets_and_a_clip() {
    let model = read(&rigged().glb());
    let rest = model.positions.len();
    let (positions, triangles) = model.states(None).unwrap();
    assert!(positions.len() > rest && triangles == model.triangles);
    let widest = positions.iter().map(|p| p.x).fold(0.0, f32::max);
    assert!(widest > model.positions.iter().map(|p| p.x).fold(0.0, f32::max), "the target 'wide' is at 1");
    // At its default weight 0.25, the target widens the column; only the state with the target at 0 is 0.2 wide.
    let narrow = |p: &&Vec3| p.y > 1.9 && (p.x - 0.2).abs() < 1e-5;
    assert_eq!([&model.positions, &positions].map(|at| at.iter().filter(narrow).count()), [0, 2]);
    let (frames, of_frames) = model.states(Some("walk")).unwrap();
    assert_eq!(of_frames.len(), 33 * model.triangles.len());
    assert!(frames.len() > positions.len());
    let message = model.states(Some("run")).unwrap_err().to_string();
    assert_eq!(message, "there is no clip 'run'; the model has walk");
}

/// Offsets of VRM 0 (with negated z) and VRM 1 move with the surface.
#[test]
fn offsets_of_a_vrm_move_with_the_shape() {
    let mut rig = rigged();
    let offset = [0.1, 0.2, 0.05];
    rig.json["extensionsUsed"] = serde_json::json!(["VRM", "VRMC_vrm", "VRMC_springBone"]);
    rig.json["extensions"] = serde_json::json!({
        "VRM": {
            "firstPerson": { "firstPersonBone": 3, "firstPersonBoneOffset": { "x": 0.1, "y": 0.2, "z": -0.05 } },
            "secondaryAnimation": {
                "colliderGroups": [{ "node": 2, "colliders": [{ "offset": { "x": 0.1, "y": 0.2, "z": -0.05 }, "radius": 0.1 }] }],
                "boneGroups": [{ "bones": [3], "hitRadius": 0.02 }],
            },
        },
        "VRMC_vrm": {
            "humanoid": { "humanBones": { "head": { "node": 3 } } },
            "lookAt": { "offsetFromHeadBone": offset },
        },
        "VRMC_springBone": {
            "colliders": [{
                "node": 2,
                "shape": { "capsule": { "offset": offset, "tail": [0.0, 0.4, 0.0], "radius": 0.1 } },
                "extensions": { "VRMC_springBone_extended_collider": { "specVersion": "1.0", "shape": {
                    "sphere": { "offset": offset, "radius": 0.1, "inside": true },
                    "capsule": { "offset": offset, "tail": [0.0, 0.4, 0.0], "radius": 0.1, "inside": true },
                    "plane": { "offset": offset, "normal": [0.0, 1.0, 0.0] },
                } } },
            }, { "node": 2, "shape": { "sphere": { "offset": [0.0, -10000.0, 0.0], "radius": 10000.0 } } }],
            "springs": [{ "joints": [{ "node": 3, "hitRadius": 0.02 }] }],
        },
    });
    let model = read(&rig.glb());
    let json = json_of(&reshaped(&model, Joints::Follow).0)["extensions"].clone();
    let number = |v: &serde_json::Value| v.as_f64().unwrap() as f32;
    let array = |v: &serde_json::Value| vec3(number(&v[0]), number(&v[1]), number(&v[2]));
    let object = |v: &serde_json::Value| vec3(number(&v["x"]), number(&v["y"]), -number(&v["z"]));
    // The joints are at heights 1 and 2. The armature scales by two; joints do not rotate.
    let expected = |y: f32, offset: Vec3| {
        let joint = vec3(0.0, y, 0.0);
        (f(joint + 2.0 * offset) - f(joint)) / 2.0
    };
    let offset = Vec3::from_array(offset);
    let turns = ReshapeOptions { joints: Joints::Turn, ..ReshapeOptions::default() };
    let message = model.write_reshaped(&by(&model), &[], &[], &turns).unwrap_err().to_string();
    assert!(message.contains("bones of a VRM 0 cannot have rotations"), "{message}");
    assert_eq!(model.skeleton(&by(&model), &[], &turns).unwrap_err().to_string(), message);
    let springs = &json["VRM"]["secondaryAnimation"]["colliderGroups"][0]["colliders"][0];
    let colliders = &json["VRMC_springBone"]["colliders"];
    let capsule = &colliders[0]["shape"]["capsule"];
    let extended = &colliders[0]["extensions"]["VRMC_springBone_extended_collider"]["shape"];
    for (what, found, expected) in [
        ("first person", object(&json["VRM"]["firstPerson"]["firstPersonBoneOffset"]), expected(2.0, offset)),
        ("collider of VRM 0", object(&springs["offset"]), expected(1.0, offset)),
        ("look at", array(&json["VRMC_vrm"]["lookAt"]["offsetFromHeadBone"]), expected(2.0, offset)),
        ("capsule", array(&capsule["offset"]), expected(1.0, offset)),
        ("its tail", array(&capsule["tail"]), expected(1.0, vec3(0.0, 0.4, 0.0))),
        ("extended sphere", array(&extended["sphere"]["offset"]), expected(1.0, offset)),
        ("extended capsule", array(&extended["capsule"]["tail"]), expected(1.0, vec3(0.0, 0.4, 0.0))),
        ("plane", array(&extended["plane"]["offset"]), expected(1.0, offset)),
        ("instead of a plane", array(&colliders[1]["shape"]["sphere"]["offset"]), vec3(0.0, -1e4, 0.0)),
    ] {
        assert!(found.distance(expected) <= ROUNDING_TOLERANCE, "{what}: {found} instead of {expected}");
    }
    // `f` scales y by 1.2; its other first-order terms are shears, which preserve volume.
    for radius in [&springs["radius"], &capsule["radius"], &extended["sphere"]["radius"]] {
        assert!((number(radius) / 0.1 - 1.2_f32.cbrt()).abs() < 1e-3, "{radius}");
    }
    // A collider outside the cage, at a joint inside, moves with the surroundings of the joint: under a shift, its offset
    // stays.
    let extra = model.extra_points().unwrap();
    let n = model.positions.len() + extra.len();
    let at_offset = vec3(0.0, 1.0, 0.0) + 2.0 * offset;
    let is_collider = |k: usize| {
        let near = |p: &Vec3| p.distance(at_offset) < 0.1;
        k.checked_sub(model.positions.len()).is_some_and(|k| near(&extra[k]))
    };
    let (outside, inside): (Vec<u32>, Vec<u32>) = (0..n as u32).partition(|&k| is_collider(k as usize));
    assert!(!outside.is_empty() && !inside.is_empty());
    let shift: Vec<DVec3> = (0..n).map(|k| if is_collider(k) { DVec3::ZERO } else { DVec3::X }).collect();
    let (bytes, _) = model.write_reshaped(&shift, &outside, &[], &ReshapeOptions::default()).unwrap();
    let springs = &json_of(&bytes)["extensions"]["VRM"]["secondaryAnimation"];
    let collider = &springs["colliderGroups"][0]["colliders"][0];
    assert!(object(&collider["offset"]).distance(offset) < ROUNDING_TOLERANCE, "{collider}");
    assert!((number(&collider["radius"]) - 0.1).abs() < 1e-6, "{collider}");
    // Offsets from a joint outside the cage stay unchanged.
    let joints = model.joints().unwrap();
    let outside = (model.positions.len() + joints[2].point) as u32;
    let (bytes, _) = model.write_reshaped(&by(&model), &[outside], &[], &ReshapeOptions::default()).unwrap();
    let person = &json_of(&bytes)["extensions"]["VRM"]["firstPerson"];
    assert_eq!(person["firstPersonBoneOffset"], serde_json::json!({ "x": 0.1, "y": 0.2, "z": -0.05 }));
}

/// A sheet of 4,000 vertices with morph targets. `added(target, vertex)`: displacement of the vertex along z by the
/// target; its displacement along y is half of that.
fn sheet(n_targets: usize, added: impl Fn(usize, usize) -> f32) -> common::Builder {
    let n = 4_000;
    let mut rig = common::Builder::new();
    let at: Vec<[f32; 3]> = (0..n)
        .map(|k| {
            let (u, v) = ((k % 63) as f32 / 62.0, (k / 63) as f32 / 63.0);
            [u, v, 0.2 * (3.0 * u).sin()]
        })
        .collect();
    let indices: Vec<u32> =
        (0..n as u32 - 64).filter(|k| k % 63 < 62).flat_map(|k| [k, k + 1, k + 63]).collect();
    let (position, indices) = (rig.vec3(&at), rig.indices(&indices));
    let normal = rig.vec3(&vec![[0.0, 0.0, 1.0]; n]);
    let targets: Vec<serde_json::Value> = (0..n_targets)
        .map(|k| {
            let delta: Vec<[f32; 3]> =
                (0..n).map(|v| [0.0, 0.5, 1.0].map(|share| share * added(k, v))).collect();
            serde_json::json!({ "POSITION": rig.vec3(&delta), "NORMAL": rig.vec3(&vec![[0.0; 3]; n]) })
        })
        .collect();
    let attributes = serde_json::json!({ "POSITION": position, "NORMAL": normal });
    rig.push(
        "meshes",
        serde_json::json!({ "primitives": [{ "attributes": attributes, "indices": indices, "targets": targets }] }),
    );
    rig.json["nodes"] = serde_json::json!([{ "mesh": 0 }]);
    rig
}

/// Compares the states of single targets of a reshaped model with `f` applied to the original states. `numbers`:
/// indices of the targets.
fn assert_targets(model: &Model, bytes: &[u8], numbers: &[usize], within: f32) {
    let (before, after) = (player(model), player(&read(bytes)));
    for (&k, share) in numbers.iter().flat_map(|k| [(k, 0.0), (k, 1.0)]) {
        let mut targets = before.targets().1.to_vec();
        targets[k] = share;
        let moved: Vec<Vec3> = shown(&before, None, 0.0, &targets).into_iter().map(f).collect();
        assert_near(&shown(&after, None, 0.0, &targets), &moved, within, &format!("target {k} at {share}"));
    }
}

/// The model has 93 morph targets, as many as detailed face rigs have.
#[test]
fn ninety_three_targets_are_exported() {
    let model = read(&sheet(93, |k, v| if v % 93 == k { 0.1 } else { 0.0 }).glb());
    let n = model.positions.len();
    assert_eq!(model.extra_points().unwrap().len(), n, "each moved vertex once");
    let (bytes, report) = reshaped(&model, Joints::Follow);
    assert_eq!((report.morph_ends, report.lattice_points), (n, 0));
    assert_targets(&model, &bytes, &[0, 46, 92], ROUNDING_TOLERANCE);
}

/// The 54 targets move all 4,000 vertices and so have 216,000 ends, as in a baked clip.
#[test]
fn many_morph_ends_are_interpolated_in_a_lattice() {
    let mut rig = sheet(54, |k, v| 0.02 + 0.4 * (k as f32 + (v % 63) as f32 / 20.0).sin().abs());
    let mut weights = vec![0.0; 54];
    weights[7] = 1.0;
    rig.json["meshes"][0]["weights"] = serde_json::json!(weights);
    let bytes = rig.glb();
    let model = read(&bytes);
    let (out, report) = reshaped(&model, Joints::Follow);
    assert_eq!(report.morph_ends, 54 * 4_000);
    assert_eq!(report.lattice_points, model.extra_points().unwrap().len());
    assert!((1..=60_000).contains(&report.lattice_points), "{report:?}");
    assert!(report.notices()[0].contains("interpolated between"), "{:?}", report.notices());

    let [before, after] = [&bytes, &out].map(|b| shown(&player(&read(b)), None, 0.0, &[]));
    let rest: Vec<Vec3> = before.into_iter().map(f).collect();
    assert_near(&after, &rest, 4.0 * ROUNDING_TOLERANCE, "the rest shape is exact");
    // Linear interpolation of `f` errs by at most 1/8 of its second derivative (0.2, along y) times the
    // squared cell size.
    let diagonal = {
        let all = model.extra_points().unwrap();
        let bounds = cagework_core::Bounds::around(&[&model.positions[..], &all].concat()).unwrap();
        bounds.diagonal() as f64
    };
    let cell = report.lattice_cell * diagonal;
    // 60,000 nodes, the limit, in a box of 1 x 1.2 x 0.7 give cells of size 0.0241.
    assert!(cell < 0.026, "{cell}");
    assert_targets(
        &model,
        &out,
        &[0, 7, 30, 53],
        4.0 * ROUNDING_TOLERANCE + (0.2 / 8.0 * cell * cell) as f32,
    );

    let still = vec![DVec3::ZERO; model.positions.len() + model.extra_points().unwrap().len()];
    assert!(model.write_reshaped(&still, &[], &[], &ReshapeOptions::default()).unwrap().0 == bytes);
    let all: Vec<u32> = (0..still.len() as u32).collect();
    let far = model.write_reshaped(&by(&model), &all, &[], &ReshapeOptions::default()).unwrap().1;
    assert_eq!(far.morph_ends_outside, report.morph_ends, "all ends are outside");
}

/// Floats of an accessor that has its own buffer view.
fn floats(rig: &common::Builder, accessor: u64) -> Vec<f32> {
    let view = rig.json["accessors"][accessor as usize]["bufferView"].as_u64().unwrap() as usize;
    let [start, length] =
        ["byteOffset", "byteLength"].map(|key| rig.json["bufferViews"][view][key].as_u64().unwrap() as usize);
    let (numbers, _) = rig.bin[start..start + length].as_chunks();
    numbers.iter().map(|&b| f32::from_le_bytes(b)).collect()
}

/// Positions use KHR_mesh_quantization with the scale in the inverse bind matrices, and a morph target is sparse.
#[test]
fn quantised_and_sparse_data_is_reshaped_as_plain_data() {
    const UNIT: f32 = 1.0 / 1024.0;
    let mut rig = rigged();
    let attribute =
        |rig: &mut common::Builder, key: &str| rig.primitive(0)["attributes"][key].as_u64().unwrap();
    let position = attribute(&mut rig, "POSITION");
    let short: Vec<u8> = floats(&rig, position)
        .chunks(3)
        .flat_map(|p| [p[0], p[1], p[2], 0.0])
        .flat_map(|x| ((x / UNIT).round() as i16).to_le_bytes())
        .collect();
    let n = short.len() / 8;
    let quantised = rig.accessor(&short, common::I16, n, "VEC3");
    let view = rig.json["accessors"][quantised]["bufferView"].as_u64().unwrap() as usize;
    rig.json["bufferViews"][view]["byteStride"] = 8.into();
    rig.primitive(0)["attributes"]["POSITION"] = quantised.into();
    let binds = rig.json["skins"][0]["inverseBindMatrices"].as_u64().unwrap();
    let scaled: Vec<u8> = floats(&rig, binds)
        .chunks(16)
        .flat_map(|m| {
            let bind = glam::Mat4::from_cols_slice(m) * glam::Mat4::from_scale(Vec3::splat(UNIT));
            bind.to_cols_array().map(f32::to_le_bytes).concat()
        })
        .collect();
    rig.json["skins"][0]["inverseBindMatrices"] = rig.accessor(&scaled, common::F32, 3, "MAT4").into();
    for k in 0..2 {
        let target = rig.primitive(0)["targets"][k]["POSITION"].as_u64().unwrap();
        let deltas = floats(&rig, target);
        let moved: Vec<usize> = (0..n).filter(|v| deltas[3 * v..3 * v + 3] != [0.0; 3]).collect();
        let places: Vec<u8> = moved.iter().flat_map(|&v| (v as u16).to_le_bytes()).collect();
        let values: Vec<u8> = moved
            .iter()
            .flat_map(|&v| {
                deltas[3 * v..3 * v + 3].iter().flat_map(|x| (x / UNIT).to_le_bytes()).collect::<Vec<_>>()
            })
            .collect();
        let (places, values) = (rig.view(&places), rig.view(&values));
        let sparse = serde_json::json!({
            "componentType": common::F32, "count": n, "type": "VEC3",
            "sparse": {
                "count": moved.len(),
                "indices": { "bufferView": places, "componentType": common::U16 },
                "values": { "bufferView": values },
            },
        });
        let accessor = rig.push("accessors", sparse);
        rig.primitive(0)["targets"][k]["POSITION"] = accessor.into();
    }
    rig.json["extensionsUsed"] = serde_json::json!(["KHR_mesh_quantization"]);
    let model = read(&rig.glb());
    assert_near(&model.positions, &read(&rigged().glb()).positions, 2.0 * UNIT, "half a step, doubled");
    let bytes = reshaped(&model, Joints::Follow).0;
    let after = player(&read(&bytes));
    let before = player(&model);
    for targets in [[0.25, 0.0], [1.0, 0.0], [0.25, 1.0]] {
        let moved: Vec<Vec3> = shown(&before, None, 0.0, &targets).into_iter().map(f).collect();
        assert_near(&shown(&after, None, 0.0, &targets), &moved, ROUNDING_TOLERANCE, &format!("{targets:?}"));
    }
}

/// UniVRM writes the names of morph targets to the extras of primitives.
#[test]
fn target_names_of_primitives_are_read_and_extended() {
    let mut rig = rigged();
    let names = rig.json["meshes"][0]["extras"].take();
    rig.primitive(0)["extras"] = names;
    let model = read(&rig.glb());
    assert_eq!(player(&model).targets().0, ["wide", "tall"]);
    let by = by(&model);
    let still = vec![DVec3::ZERO; by.len()];
    let poses = [("bent".to_owned(), by)];
    let (bytes, _) = model.write_reshaped(&still, &[], &poses, &ReshapeOptions::default()).unwrap();
    let mesh = &json_of(&bytes)["meshes"][0];
    let all = serde_json::json!(["wide", "tall", "bent"]);
    assert_eq!(
        (&mesh["extras"]["targetNames"], &mesh["primitives"][0]["extras"]["targetNames"]),
        (&all, &all)
    );
}
