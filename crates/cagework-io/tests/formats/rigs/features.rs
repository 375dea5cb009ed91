//! Rigid props, several sets of joints, instancing, meshes outside the scene, singular skins.

use cagework_io::{Interpolation, Joints, Model, ReshapeOptions, Timeline, WriteError};
use glam::{DVec3, Mat4, Vec3, vec3};
use serde_json::json;

use super::{ROUNDING_TOLERANCE, assert_near, assert_targets, by, f, player, read, reshaped, shown};
use crate::common::{self, Builder, F32, U8, floats, json_of, plain_cube, rigged};

/// The column of [`rigged`] with a cube attached to the column's tip by a matrix.
fn with_hat() -> Builder {
    let mut rig = rigged();
    let cube = rig.cube_mesh("cube");
    let placed = Mat4::from_translation(vec3(0.05, 0.1, 0.0)) * Mat4::from_scale(Vec3::splat(0.1));
    rig.push("nodes", json!({ "name": "hat", "mesh": cube, "matrix": placed.to_cols_array() }));
    rig.json["nodes"][3]["children"] = json!([5]);
    rig
}

/// The last `n` vertices, which belong to the added mesh.
fn last(model: &Model, n: usize) -> Vec<Vec3> {
    model.positions[model.positions.len() - n..].to_vec()
}

#[test]
fn props_on_bones_bend_or_stay_rigid() {
    let model = read(&with_hat().glb());
    assert_eq!(model.props().unwrap(), ["hat"]);
    let moved: Vec<Vec3> = last(&model, 8).iter().map(|&p| f(p)).collect();
    let bent = read(&reshaped(&model, Joints::Follow).0);
    assert_near(&last(&bent, 8), &moved, ROUNDING_TOLERANCE, "it bends");

    let options = ReshapeOptions { rigid: vec!["hat".into()], ..ReshapeOptions::default() };
    let (bytes, _) = model.write_reshaped(&by(&model), &[], &[], &options).unwrap();
    let rigid = last(&read(&bytes), 8);
    // The least-squares rigid motion maps the centroid to the centroid of the bent shape (Kabsch 1976).
    let middle = |at: &[Vec3]| at.iter().sum::<Vec3>() / at.len() as f32;
    assert!(middle(&rigid).distance(middle(&moved)) <= ROUNDING_TOLERANCE, "{rigid:?} {moved:?}");
    for (a, b) in [(0, 7), (1, 6), (2, 4)] {
        let [before, after] = [&last(&model, 8), &rigid].map(|at| at[a].distance(at[b]));
        assert!((before - after).abs() <= ROUNDING_TOLERANCE, "{before} {after}");
        assert!((before - moved[a].distance(moved[b])).abs() > 1e-3, "otherwise it is stretched");
    }

    // The result is the same with an unchanged skeleton, as one of several poses, with another mesh origin, and
    // mirrored.
    let stays = ReshapeOptions { joints: Joints::Stay, ..options.clone() };
    let (bytes, _) = model.write_reshaped(&by(&model), &[], &[], &stays).unwrap();
    assert_near(&last(&read(&bytes), 8), &rigid, ROUNDING_TOLERANCE, "the skeleton stays");
    let still = vec![DVec3::ZERO; by(&model).len()];
    let poses = ["once", "twice"].map(|name| (name.to_owned(), by(&model)));
    let (bytes, _) = model.write_reshaped(&still, &[], &poses, &options).unwrap();
    let posed = player(&read(&bytes));
    let mut targets = posed.targets().1.to_vec();
    *targets.last_mut().unwrap() = 1.0;
    let all = shown(&posed, None, 0.0, &targets);
    assert_near(&all[all.len() - 8..], &rigid, ROUNDING_TOLERANCE, "in a pose");
    let mut baked = with_hat();
    let away = vec3(0.4, -3.0, 0.2);
    let corners = common::CUBE.map(|c| (Vec3::from_array(c) * 0.1 - away).to_array());
    let position = baked.vec3(&corners);
    baked.json["meshes"][1]["primitives"][0]["attributes"]["POSITION"] = json!(position);
    baked.json["nodes"][5] =
        json!({ "name": "hat", "mesh": 1, "translation": (vec3(0.05, 0.1, 0.0) + away).to_array() });
    // The mirrored cube occupies the same box.
    let mut mirrored = with_hat();
    mirrored.json["nodes"][5] =
        json!({ "name": "hat", "mesh": 1, "translation": [0.15, 0.1, 0.0], "scale": [-0.1, 0.1, 0.1] });
    for (what, rig) in [("baked", baked), ("mirrored", mirrored)] {
        let model = read(&rig.glb());
        let (bytes, _) = model.write_reshaped(&by(&model), &[], &[], &options).unwrap();
        for p in last(&read(&bytes), 8) {
            let near = rigid.iter().map(|q| p.distance(*q)).fold(f32::INFINITY, f32::min);
            assert!(near <= 4.0 * ROUNDING_TOLERANCE, "{what}: {near:e}");
        }
    }
    // Joints and skinned meshes with the same name are not props.
    let mut same_name = with_hat();
    for node in [3, 4] {
        same_name.json["nodes"][node]["name"] = json!("hat");
    }
    let model = read(&same_name.glb());
    let (bytes, _) = model.write_reshaped(&by(&model), &[], &[], &options).unwrap();
    assert_near(
        &read(&bytes).positions[..20],
        &read(&reshaped(&model, Joints::Follow).0).positions[..20],
        ROUNDING_TOLERANCE,
        "bends",
    );

    let mut nameless = with_hat();
    nameless.json["nodes"][5].as_object_mut().unwrap().shift_remove("name");
    let model = read(&nameless.glb());
    assert_eq!(model.props().unwrap(), ["node 5"]);
    let options = ReshapeOptions { rigid: vec!["node 5".into()], ..ReshapeOptions::default() };
    let (bytes, _) = model.write_reshaped(&by(&model), &[], &[], &options).unwrap();
    assert_eq!(last(&read(&bytes), 8), rigid);
}

/// UniVRM exports a mesh of several materials as primitives that share one set of vertex attributes.
#[test]
fn vertices_shared_between_primitives_stay_shared() {
    let mut rig = rigged();
    let one = reshaped(&read(&rig.glb()), Joints::Follow).0.len();
    let primitive = rig.json["meshes"][0]["primitives"][0].clone();
    rig.json["meshes"][0]["primitives"] = vec![primitive; 8].into();
    let model = read(&rig.glb());
    let (bytes, _) = reshaped(&model, Joints::Follow);
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    assert_near(&read(&bytes).positions, &moved, ROUNDING_TOLERANCE, "each is where it goes");
    let document = json_of(&bytes);
    for attribute in ["POSITION", "NORMAL"] {
        let primitives = document["meshes"][0]["primitives"].as_array().unwrap();
        let accessors = primitives.iter().map(|p| p["attributes"][attribute].as_u64().unwrap());
        let different: std::collections::HashSet<u64> = accessors.collect();
        assert!(different.len() <= 2, "{attribute}: {different:?}");
    }
    // Separate copies would take eight times the vertices.
    assert!(bytes.len() < 3 * one, "{} and {one} bytes", bytes.len());
}

#[test]
fn export_without_moving_parts_is_the_input() {
    let bytes = rigged().glb();
    let model = read(&bytes);
    // No joint and no vertex moves in any state, so nothing is written.
    let parts = model.parts(&[("bar".into(), 1.0)], &[]).unwrap();
    let options = ReshapeOptions { joints: Joints::Stay, parts, ..ReshapeOptions::default() };
    assert!(model.write_reshaped(&by(&model), &[], &[], &options).unwrap().0 == bytes);
}

#[test]
fn a_rigid_piece_of_a_skin_keeps_its_lengths_with_every_target() {
    let model = read(&rigged().glb());
    let parts = model.parts(&[], &["bar".into()]).unwrap();
    let options = ReshapeOptions { parts, ..ReshapeOptions::default() };
    let (bytes, _) = model.write_reshaped(&by(&model), &[], &[], &options).unwrap();
    let [before, after] = [player(&model), player(&read(&bytes))];
    for targets in [[0.25, 0.0], [1.0, 0.0], [0.0, 1.0]] {
        let [from, to] = [&before, &after].map(|player| shown(player, None, 0.0, &targets));
        for (a, b) in [(0, 19), (3, 12), (7, 8)] {
            let change = to[a].distance(to[b]) - from[a].distance(from[b]);
            assert!(change.abs() <= ROUNDING_TOLERANCE, "{targets:?}, {a} to {b}: {change:e}");
        }
        assert!(to[19].distance(from[19]) > 0.3, "it has moved");
    }
}

/// The second joint influence of each vertex is stored in a second set of attributes, `JOINTS_1` and `WEIGHTS_1`.
#[test]
fn several_sets_of_joints_add_up() {
    let mut rig = rigged();
    let n = 20;
    let mut sets = [(Vec::new(), Vec::new()), (Vec::new(), Vec::new())];
    for v in 0..n {
        let y = 0.5 * (v / 4) as f32;
        let (joints, share) = (if y < 0.9 { [0, 1] } else { [1, 2] }, y.fract());
        for ((of_set, weights), (joint, weight)) in
            sets.iter_mut().zip([(joints[0], 1.0 - share), (joints[1], share)])
        {
            of_set.extend([joint, 0, 0, 0_u8]);
            weights.extend([weight, 0.0, 0.0, 0.0_f32]);
        }
    }
    for (k, (joints, weights)) in sets.iter().enumerate() {
        let joints = rig.accessor(joints, U8, n, "VEC4");
        let weights = rig.accessor(&floats(weights), F32, n, "VEC4");
        rig.primitive(0)["attributes"][format!("JOINTS_{k}")] = joints.into();
        rig.primitive(0)["attributes"][format!("WEIGHTS_{k}")] = weights.into();
    }
    let [plain, split] = [rigged().glb(), rig.glb()].map(|bytes| {
        let model = read(&bytes);
        let after = player(&read(&reshaped(&model, Joints::Follow).0));
        shown(&after, Some(0), 0.6, &[])
    });
    assert_near(&split, &plain, ROUNDING_TOLERANCE, "at 0.6 s");
}

#[test]
fn gpu_instances_stay_unchanged_with_a_notice() {
    let mut rig = with_hat();
    let places = rig.accessor(&floats(&[0.0; 6]), F32, 2, "VEC3");
    rig.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    rig.json["nodes"][5]["extensions"] = instancing.clone();
    let model = read(&rig.glb());
    let expected = "draws instances of its mesh (EXT_mesh_gpu_instancing): only one of them is bound";
    assert!(model.notices.iter().any(|notice| notice.contains(expected)), "{:?}", model.notices);
    let moved: Vec<Vec3> = last(&model, 8).iter().map(|&p| f(p)).collect();
    let (bytes, _) = reshaped(&model, Joints::Follow);
    assert_near(&last(&read(&bytes), 8), &moved, ROUNDING_TOLERANCE, "the one at the node");
    assert_eq!(json_of(&bytes)["nodes"][5]["extensions"], instancing);
}

/// A level of detail outside the scene must match the visible mesh.
#[test]
fn meshes_outside_the_scene_are_deformed() {
    let mut rig = rigged();
    let coarse = rig.cube_mesh("coarse");
    rig.push("nodes", json!({ "name": "coarse", "mesh": coarse }));
    rig.json["extensionsUsed"] = json!(["MSFT_lod"]);
    rig.json["nodes"][4]["extensions"] = json!({ "MSFT_lod": { "ids": [5] } });
    let model = read(&rig.glb());
    let (bytes, _) = reshaped(&model, Joints::Follow);
    let mut json = json_of(&bytes);
    json["scenes"][0]["nodes"] = json!([5]);
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let shown = read(&common::glb(&json, Some(&bytes[28 + length..])));
    let moved: Vec<Vec3> = common::cube().iter().map(|&p| f(p)).collect();
    assert_near(&shown.positions, &moved, ROUNDING_TOLERANCE, "the level of detail");
}

/// The end of a chain is a joint without vertices, here outside the cage.
#[test]
fn joints_without_vertices_outside_the_cage_follow_their_parents() {
    let mut rig = rigged();
    rig.push("nodes", json!({ "name": "end", "translation": [0.0, 0.5, 0.3] }));
    rig.json["nodes"][3]["children"] = json!([5]);
    let model = read(&rig.glb());
    let joints = model.joints().unwrap();
    assert_eq!(
        joints.iter().map(|j| (j.node, j.parent, j.holds)).collect::<Vec<_>>(),
        [(1, None, true), (2, Some(0), true), (3, Some(1), true), (5, Some(2), false)]
    );
    let end = (model.positions.len() + joints[3].point) as u32;
    let (bytes, report) = model.write_reshaped(&by(&model), &[end], &[], &ReshapeOptions::default()).unwrap();
    assert_eq!((report.joints_outside, report.joints_following_parent), (0, 1));
    let [loose, inside] = [bytes, reshaped(&model, Joints::Follow).0].map(|bytes| {
        let at = json_of(&bytes)["nodes"][5]["translation"].clone();
        vec3(0.0, 0.5, 0.3).distance(Vec3::from_array([0, 1, 2].map(|k| at[k].as_f64().unwrap() as f32)))
    });
    assert!(
        loose <= ROUNDING_TOLERANCE && inside > 0.05,
        "{loose} and {inside} away from the original offset to its parent"
    );
}

/// The skinning matrices of the upper three of the column's five rings are singular.
#[test]
fn vertices_with_singular_skinning_follow_their_neighbours() {
    let mut rig = rigged();
    let binds = rig.json["skins"][0]["inverseBindMatrices"].as_u64().unwrap();
    let mut values = super::floats(&rig, binds);
    // The bind matrices of the middle and the tip project along x.
    for column in 4..12 {
        values[4 * column] = 0.0;
    }
    rig.json["skins"][0]["inverseBindMatrices"] = rig.accessor(&floats(&values), F32, 3, "MAT4").into();
    let model = read(&rig.glb());
    let (bytes, report) = reshaped(&model, Joints::Follow);
    assert_eq!(report.singular_vertices, 12, "three of five rings: {report:?}");
    assert!(report.notices().iter().any(|n| n.contains("collapsed by the skin")), "{:?}", report.notices());
    assert!(read(&bytes).positions.iter().all(|p| p.is_finite()));
    let still = vec![DVec3::ZERO; by(&model).len()];
    assert!(model.write_reshaped(&still, &[], &[], &ReshapeOptions::default()).unwrap().0 == rig.glb());
}

#[test]
fn step_tracks_are_rescaled_like_linear_ones() {
    let mut steps = rigged();
    steps.json["animations"][0]["samplers"][0]["interpolation"] = "STEP".into();
    let [linear, step] =
        [rigged().glb(), steps.glb()].map(|bytes| player(&read(&reshaped(&read(&bytes), Joints::Follow).0)));
    for at in [0.0, 1.0] {
        assert_eq!(shown(&linear, Some(0), at, &[]), shown(&step, Some(0), at, &[]), "at a key");
    }
    let [root, key] = [0.9, 0.0].map(|at| step.pose_at(Some(0), at, &[]).origins[1]);
    assert_eq!(root, key, "it holds until the next key");
}

/// The column is bent by 60 degrees at rest but straight in its bind pose.
#[test]
fn a_rest_pose_far_from_the_bind_pose_survives() {
    let mut rig = rigged();
    let (sine, cosine) = 30.0_f32.to_radians().sin_cos();
    rig.json["nodes"][2]["rotation"] = json!([0.0, 0.0, sine, cosine]);
    let model = read(&rig.glb());
    let straight = read(&rigged().glb());
    let top = |model: &Model| model.positions[16];
    assert!(top(&model).distance(top(&straight)) > 0.9, "it is bent at rest");
    for joints in [Joints::Follow, Joints::Stay] {
        let bytes = reshaped(&model, joints).0;
        // Compare the states of the target with default weight 0, at weights 0 and 1.
        assert_targets(&model, &bytes, &[1], 2.0 * ROUNDING_TOLERANCE);
        let [before, after] = [&model, &read(&bytes)].map(|m| player(m).pose_at(None, 0.0, &[]).palette);
        for (a, b) in before.iter().zip(&after) {
            assert!(a.abs_diff_eq(*b, 2.0 * ROUNDING_TOLERANCE), "{a} {b}");
        }
    }
}

/// With the middle joint bent at rest, vertices between the joints are in two poses. A clip of the shifted and uniformly
/// scaled model must show the shifted and scaled frames of the original.
#[test]
fn clips_follow_a_uniform_scale_if_the_rest_pose_is_not_the_bind_pose() {
    let mut rig = rigged();
    let (sine, cosine) = 30.0_f32.to_radians().sin_cos();
    rig.json["nodes"][2]["rotation"] = json!([0.0, 0.0, sine, cosine]);
    // The clip turns this joint, and with it only one of the two joints of the vertices below.
    rig.json["animations"][0]["channels"][2]["target"]["node"] = json!(2);
    let model = read(&rig.glb());
    let extra = model.extra_points().unwrap();
    for (scale, shift) in
        [(1.0, vec3(0.3, 0.0, 0.1)), (1.7, vec3(0.2, 0.0, 0.0)), (0.6, vec3(-0.2, 0.4, 0.1))]
    {
        let scaled = |p: Vec3| scale * p + shift;
        let by: Vec<DVec3> =
            model.positions.iter().chain(&extra).map(|&p| scaled(p).as_dvec3() - p.as_dvec3()).collect();
        for joints in [Joints::Follow, Joints::Turn] {
            let options = ReshapeOptions { joints, ..ReshapeOptions::default() };
            let bytes = model.write_reshaped(&by, &[], &[], &options).unwrap().0;
            let [before, after] = [&model, &read(&bytes)].map(player);
            for (clip, seconds) in
                [(None, 0.0), (Some(0), 0.0), (Some(0), 0.3), (Some(0), 0.7), (Some(0), 1.0)]
            {
                let expected: Vec<Vec3> =
                    shown(&before, clip, seconds, &[]).into_iter().map(scaled).collect();
                let what = format!("{scale} {joints:?} {clip:?} at {seconds}");
                assert_near(&shown(&after, clip, seconds, &[]), &expected, 4.0 * ROUNDING_TOLERANCE, &what);
            }
        }
    }
}

/// Found by fuzzing: positions beyond f32 must not be written.
#[test]
fn skin_that_scales_beyond_f32_is_rejected() {
    let mut rig = rigged();
    rig.json["nodes"][0]["scale"] = json!([1e-39, 1e-39, 1e-39]);
    let model = read(&rig.glb());
    let by = vec![DVec3::ONE; model.positions.len() + model.extra_points().unwrap().len()];
    let refused = model.write_reshaped(&by, &[], &[], &ReshapeOptions::default()).unwrap_err().to_string();
    assert!(refused.contains("exceed the range of f32"), "{refused}");
}

/// Colliders of VRM 1 without an offset are at their node; radii and tails scale.
#[test]
fn colliders_without_offset_are_scaled() {
    let mut rig = rigged();
    rig.json["extensionsUsed"] = json!(["VRMC_springBone"]);
    rig.json["extensions"] = json!({ "VRMC_springBone": { "colliders": [
        { "node": 2, "shape": { "sphere": { "radius": 0.1 } } },
        { "node": 2, "shape": { "capsule": { "radius": 0.1, "tail": [0.0, 0.4, 0.0] } } },
    ] } });
    let json = json_of(&reshaped(&read(&rig.glb()), Joints::Follow).0);
    let shape =
        |k: usize, kind: &str| json["extensions"]["VRMC_springBone"]["colliders"][k]["shape"][kind].clone();
    // At height 1, `f` scales y by 1.2 and shears. A shear preserves volume, so radii change by the cube root of 1.2.
    // The armature scales by two, so local tails are half as long.
    for of in [shape(0, "sphere"), shape(1, "capsule")] {
        let radius = of["radius"].as_f64().unwrap();
        assert!((radius / 0.1 - 1.2_f64.cbrt()).abs() < 1e-3, "{radius}");
        assert!(of.get("offset").is_none(), "{of}");
    }
    let tail = (f(vec3(0.0, 1.8, 0.0)) - f(vec3(0.0, 1.0, 0.0))) / 2.0;
    let found = Vec3::from_array([0, 1, 2].map(|k| shape(1, "capsule")["tail"][k].as_f64().unwrap() as f32));
    assert!(found.distance(tail) <= ROUNDING_TOLERANCE, "{found} instead of {tail}");
}

/// Vertices without weights follow the mesh's node, with a notice.
#[test]
fn vertices_without_weights_follow_the_node_with_a_notice() {
    for (weight, n) in [(f32::NAN, 1), (0.0, 1), (-1.0, 1)] {
        let mut rig = rigged();
        let weights = rig.primitive(0)["attributes"]["WEIGHTS_0"].as_u64().unwrap();
        let mut values = super::floats(&rig, weights);
        values[4 * 7..4 * 8].fill(weight);
        let weights = rig.accessor(&floats(&values), F32, 20, "VEC4");
        rig.primitive(0)["attributes"]["WEIGHTS_0"] = weights.into();
        let model = read(&rig.glb());
        let notice = format!("skin 0 has no positive weight for {n} vertex: they follow the mesh's node");
        assert!(model.notices.contains(&notice), "{weight}: {:?}", model.notices);
        // The vertex without weights is moved by the mesh's node, whose translation is (7, 7, 7), and is bound there.
        let moved: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
        let bytes = reshaped(&model, Joints::Follow).0;
        assert_near(&read(&bytes).positions, &moved, 16.0 * ROUNDING_TOLERANCE, "with a loose vertex");
    }
    assert!(!read(&rigged().glb()).notices.iter().any(|notice| notice.contains("no positive weight")));
}

/// All primitives of a mesh must have the same number of targets, so missing ones are added before the poses.
#[test]
fn primitives_with_fewer_targets_are_padded() {
    let mut rig = rigged();
    let mut second = rig.primitive(0).clone();
    second.as_object_mut().unwrap().shift_remove("targets");
    rig.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    // The default weight of the first target applies to the first primitive only.
    let model = read(&rig.glb());
    let by = by(&model);
    let still = vec![DVec3::ZERO; by.len()];
    let poses = [("bent".to_owned(), by)];
    let (bytes, _) = model.write_reshaped(&still, &[], &poses, &ReshapeOptions::default()).unwrap();
    let json = json_of(&bytes);
    let n_targets = [0, 1].map(|p| json["meshes"][0]["primitives"][p]["targets"].as_array().unwrap().len());
    assert_eq!((n_targets, json["meshes"][0]["weights"].as_array().unwrap().len()), ([3, 3], 3));
    let posed = shown(&player(&read(&bytes)), None, 0.0, &[0.25, 0.0, 1.0]);
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    assert_near(&posed, &moved, 4.0 * ROUNDING_TOLERANCE, "the pose");
}

/// Poses become the keyframes of one extra clip, "poses", beside the model's own clips.
#[test]
fn poses_are_played_at_their_times() {
    let rig = rigged();
    let model = read(&rig.glb());
    let by = by(&model);
    let still = vec![DVec3::ZERO; by.len()];
    let poses = [("rest".to_owned(), still.clone()), ("bent".to_owned(), by)];
    let timed = |timeline| {
        let options = ReshapeOptions { timeline: Some(timeline), ..ReshapeOptions::default() };
        model.write_reshaped(&still, &[], &poses, &options)
    };
    let cubic = timed(Timeline::new(&[0.5, 2.0], None).unwrap().with(Interpolation::Cubic)).unwrap().0;
    let written = read(&cubic);
    let clip = written.clips().iter().position(|clip| clip.name.as_deref() == Some("poses")).unwrap();
    // 0.875 s is a quarter of the way from the key at 0.5 s to the last key. Share of the last pose by cubic Hermite
    // interpolation: 3 u^2 - 2 u^3, plus the term of the slope at 0.5 s. The share grows from 0 to 1 between the
    // neighbouring keys at 0 and 2 s, so this slope is 1/2 per second. The slope at the last key is 0.
    let (u, gap) = (0.25_f32, 1.5);
    let share = 3.0 * u * u - 2.0 * u.powi(3) + gap * (u.powi(3) - 2.0 * u * u + u) / 2.0;
    let at = shown(&player(&written), Some(clip), 0.875, &[]);
    let [from, to] = [0.0, 2.0].map(|seconds| shown(&player(&written), Some(clip), seconds, &[]));
    let expected: Vec<Vec3> = from.iter().zip(&to).map(|(a, b)| a.lerp(*b, share)).collect();
    assert_near(&at, &expected, 4.0 * ROUNDING_TOLERANCE, "cubic");
    let wrong = timed(Timeline::every_second(3)).unwrap_err();
    assert_eq!(wrong, WriteError::Poses { given: 2, expected: 3 });
    let written = read(&timed(Timeline::at_keys(&[0.25, 0.75])).unwrap().0);
    let clip = written.clips().iter().position(|clip| clip.name.as_deref() == Some("poses")).unwrap();
    assert_eq!(written.clips()[clip].seconds, 0.75);
    let player = player(&written);
    let at = |seconds: f32| shown(&player, Some(clip), seconds, &[]);
    let (before, bent) = (at(0.1), at(0.75));
    let half: Vec<Vec3> = before.iter().zip(&bent).map(|(a, b)| a.midpoint(*b)).collect();
    assert!(before.iter().zip(&bent).any(|(a, b)| a.distance(*b) > 0.1));
    assert_near(&at(0.5), &half, 4.0 * ROUNDING_TOLERANCE, "half-way");
}

#[test]
fn non_finite_bind_matrices_are_errors() {
    let mut rig = rigged();
    let binds = rig.json["skins"][0]["inverseBindMatrices"].as_u64().unwrap();
    let mut values = super::floats(&rig, binds);
    values[20] = f32::NAN;
    let binds = rig.accessor(&floats(&values), F32, 3, "MAT4");
    rig.json["skins"][0]["inverseBindMatrices"] = binds.into();
    let message = Model::read("rigged.glb", &rig.glb(), &mut |_| None).unwrap_err().to_string();
    assert!(message.contains("a non-finite inverse bind matrix for joint 1 of skin 0"), "{message}");
}

#[test]
fn positions_that_overlap_indices_are_not_overwritten() {
    let mut cube = plain_cube();
    // The ninth vertex, unused by triangles, overlaps the first six indices.
    cube.json["accessors"][0]["count"] = 9.into();
    cube.json["bufferViews"][0]["byteLength"] = (9 * 12).into();
    let model = read(&cube.glb());
    let again = read(&reshaped(&model, Joints::Follow).0);
    assert_eq!(again.triangles, model.triangles);
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| f(p)).collect();
    assert_near(&again.positions, &moved, ROUNDING_TOLERANCE, "deformed positions");
}
