//! Feet on the ground, in clips of a walker whose planted feet are known.

use cagework_io::{Feet, Model, ReshapeOptions};
use glam::{DVec3, Quat, Vec3, vec3};
use serde_json::json;

use super::{player, read};
use crate::common::{Builder, F32, U8, floats};

/// Lengths of thigh and shin, and height of the hips during the walk.
const LENGTHS: [f32; 2] = [1.0, 1.0];
const HIPS: f32 = 1.9;
/// Duration of a cycle of two steps, seconds, and the distance that the hips travel in this time.
const CYCLE: f32 = 1.0;
const STRIDE: f32 = 1.2;
const KEYS: usize = 61;
const CYCLES: f32 = 2.0;

/// Whether foot `side` (0 or 1) is planted, and the world position of its ankle, at a time.
fn ankle(side: usize, t: f32) -> (bool, Vec3) {
    let phase = t / CYCLE + 0.5 * side as f32;
    let (step, u) = (phase.floor(), phase.fract());
    // The foot is planted in the first half of its cycle, at the x coordinate of the hips in the middle of that half.
    let from = STRIDE * (step + 0.25 - 0.5 * side as f32);
    let swing = (2.0 * u - 1.0).max(0.0);
    let smooth = swing * swing * (3.0 - 2.0 * swing);
    let height = 0.25 * (std::f32::consts::PI * swing).sin();
    (u < 0.5, vec3(from + STRIDE * smooth, height, 0.0))
}

/// A figure that walks along x: hips, and thigh, shin and foot of two legs, each with a triangle. `on_spot`: the hips
/// stay in place. `phase`: fraction of the cycle at which the clip starts.
fn walker_from(phase: f32, on_spot: bool) -> Builder {
    let mut b = Builder::new();
    let rests = [0.0, -LENGTHS[0], -LENGTHS[0] - LENGTHS[1]];
    let joints: Vec<Vec3> = std::iter::once(vec3(0.0, LENGTHS[0] + LENGTHS[1], 0.0))
        .chain([0.2, -0.2].into_iter().flat_map(|z| rests.map(|y| vec3(0.0, LENGTHS[0] + LENGTHS[1] + y, z))))
        .collect();
    let mut positions = Vec::new();
    let mut holders = Vec::new();
    for (k, joint) in joints.iter().enumerate() {
        for corner in [vec3(0.05, 0.0, 0.0), vec3(-0.05, 0.0, 0.05), vec3(-0.05, 0.0, -0.05)] {
            positions.push((*joint + corner).to_array());
            holders.extend([k as u8, 0, 0, 0]);
        }
    }
    let n = positions.len();
    let (position, corners) = (b.vec3(&positions), b.indices(&(0..n as u32).collect::<Vec<_>>()));
    let holders = b.accessor(&holders, U8, n, "VEC4");
    let weights = b.accessor(&floats(&[[1.0, 0.0, 0.0, 0.0]].repeat(n).concat()), F32, n, "VEC4");
    let attributes = json!({ "POSITION": position, "JOINTS_0": holders, "WEIGHTS_0": weights });
    b.push("meshes", json!({ "primitives": [{ "attributes": attributes, "indices": corners }] }));
    let names = ["hips", "thigh.L", "shin.L", "foot.L", "thigh.R", "shin.R", "foot.R"];
    let parents = [None, Some(0), Some(1), Some(2), Some(0), Some(4), Some(5)];
    for (k, name) in names.iter().enumerate() {
        let at = joints[k] - parents[k].map_or(Vec3::ZERO, |p: usize| joints[p]);
        let children: Vec<usize> = (0..names.len()).filter(|&c| parents[c] == Some(k)).collect();
        let mut node = json!({ "name": name, "translation": at.to_array() });
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        b.push("nodes", node);
    }
    b.push("nodes", json!({ "mesh": 0, "skin": 0 }));
    b.json["scenes"] = json!([{ "nodes": [0, 7] }]);
    let binds: Vec<f32> =
        joints.iter().flat_map(|&j| glam::Mat4::from_translation(-j).to_cols_array()).collect();
    let binds = b.accessor(&floats(&binds), F32, 7, "MAT4");
    b.push("skins", json!({ "joints": [0, 1, 2, 3, 4, 5, 6], "inverseBindMatrices": binds }));

    let times: Vec<f32> = (0..KEYS).map(|k| CYCLES * CYCLE * k as f32 / (KEYS - 1) as f32).collect();
    let input = b.accessor(&floats(&times), F32, KEYS, "SCALAR");
    (b.json["accessors"][input]["min"], b.json["accessors"][input]["max"]) =
        (json!([0.0]), json!([times[KEYS - 1]]));
    let mut tracks = vec![Vec::new(); 7];
    for &t in &times {
        let t = t + phase * CYCLE;
        let hips = vec3(STRIDE * t / CYCLE, HIPS, 0.0);
        let shown = if on_spot { hips.with_x(0.0) } else { hips };
        tracks[0].extend(shown.to_array());
        for side in 0..2 {
            // The angles of the leg by the law of cosines; the knee points to +x.
            let to = ankle(side, t).1 - hips;
            let d = to.length().min(1.999);
            let swing = to.x.atan2(-to.y);
            let bend = (d / 2.0).acos();
            let thigh = Quat::from_rotation_z(swing + bend);
            let shin = Quat::from_rotation_z(-2.0 * bend);
            let foot = (thigh * shin).inverse();
            for (k, q) in [thigh, shin, foot].into_iter().enumerate() {
                tracks[1 + 3 * side + k].extend(q.to_array());
            }
        }
    }
    let mut clip = json!({ "name": "walk", "samplers": [], "channels": [] });
    for (node, track) in tracks.iter().enumerate() {
        let (kind, path) = if node == 0 { ("VEC3", "translation") } else { ("VEC4", "rotation") };
        let output = b.accessor(&floats(track), F32, KEYS, kind);
        let sampler = json!({ "input": input, "output": output });
        clip["samplers"].as_array_mut().unwrap().push(sampler);
        let channel = json!({ "sampler": node, "target": { "node": node, "path": path } });
        clip["channels"].as_array_mut().unwrap().push(channel);
    }
    b.push("animations", clip);
    b
}

fn walker(on_spot: bool) -> Vec<u8> {
    walker_from(0.0, on_spot).glb()
}

/// Makes thighs 1.4 times and shins 1.1 times as long, with the feet in place, then lowers everything by `sink`.
fn longer(p: Vec3, sink: f32) -> Vec3 {
    p.with_y(1.1 * p.y.min(1.0) + 1.4 * (p.y - 1.0).max(0.0) - sink)
}

fn reshaped(model: &Model, sink: f32, options: &ReshapeOptions) -> (Vec<u8>, cagework_io::ReshapeReport) {
    let extra = model.extra_points().unwrap();
    let by: Vec<DVec3> =
        model.positions.iter().chain(&extra).map(|&p| (longer(p, sink) - p).as_dvec3()).collect();
    model.write_reshaped(&by, &[], &[], options).unwrap()
}

/// Mean distance that an ankle slides per contact, relative to ground that moves with `velocity`, in the phases in
/// which [`ankle`] plants the foot.
fn slide(glb: &[u8], velocity: f32) -> f32 {
    let player = player(&read(glb));
    let (mut path, mut contacts) = (0.0, 0.0);
    for (side, node) in [(0, 3), (1, 6)] {
        let n = 400;
        let mut last: Option<Vec3> = None;
        for k in 0..=n {
            let t = CYCLES * CYCLE * k as f32 / n as f32;
            // Skip the first and last tenth of a planted phase. Contacts are detected by differences of neighbouring
            // samples, which at both ends of the phase include the swing.
            let u = (t / CYCLE + 0.5 * side as f32).fract();
            let at = player.pose_at(Some(0), t, &[]).origins[node] - vec3(velocity * t, 0.0, 0.0);
            if !(0.05..0.45).contains(&u) {
                last = None;
                continue;
            }
            match last {
                Some(last) => path += at.with_y(0.0).distance(last.with_y(0.0)),
                None => contacts += 1.0,
            }
            last = Some(at);
        }
    }
    path / contacts
}

#[test]
fn planted_feet_slide_less_than_a_quarter() {
    for (on_spot, keep_travel) in [(false, false), (false, true), (true, false)] {
        let model = read(&walker(on_spot));
        let options = ReshapeOptions { keep_travel, ..ReshapeOptions::default() };
        let (free, report) = reshaped(&model, 0.0, &options);
        assert_eq!((report.feet, report.slide), (None, [0.0; 2]));
        let (locked, report) = reshaped(&model, 0.0, &ReshapeOptions { feet: Feet::Lock, ..options });
        let what = format!("on the spot: {on_spot}, travel: {keep_travel}: {report:?}");
        // In two cycles, one foot has two contacts. The other foot has one, and half a contact at each end of the clip.
        let [legs, contacts] = report.feet.unwrap();
        assert!(legs == 2 && (4..=5).contains(&contacts), "{what}");
        assert!(report.slide[1] <= 0.25 * report.slide[0] && report.slide[0] > 0.01, "{what}");
        // In a walk on the spot, planted feet move backwards by one stride per cycle, 2.5 / 2 times as fast with the
        // longer legs.
        let ratio = if keep_travel { 1.0 } else { 2.5 / 2.0 };
        let velocity = if on_spot { -STRIDE / CYCLE * ratio } else { 0.0 };
        let [before, after] = [&free, &locked].map(|glb| slide(glb, velocity));
        if !on_spot {
            assert!(after <= 0.25 * before, "{what}: {before} {after}");
        }
        // Legs keep their lengths, and the mesh at rest is the same.
        let found = read(&locked);
        assert_eq!(found.positions, read(&free).positions, "{what}");
        for k in 0..50 {
            let at = player(&found).pose_at(Some(0), 0.04 * k as f32, &[]).origins;
            for leg in [[1, 2, 3], [4, 5, 6]] {
                let [thigh, shin] = [at[leg[0]].distance(at[leg[1]]), at[leg[1]].distance(at[leg[2]])];
                assert!((thigh - 1.4).abs() < 1e-3 && (shin - 1.1).abs() < 1e-3, "{what}: {thigh} {shin}");
            }
        }
    }
}

#[test]
fn leg_without_a_foot_is_not_held() {
    let mut glb = walker(false);
    // A name of the same length keeps the layout of the file.
    let at = glb.windows(6).position(|word| word == b"foot.R").unwrap();
    glb[at..at + 6].copy_from_slice(b"toes.R");
    let model = read(&glb);
    let options = ReshapeOptions { feet: Feet::Lock, ..ReshapeOptions::default() };
    let (locked, report) = reshaped(&model, 0.0, &options);
    assert_eq!(report.feet.unwrap()[0], 1);
    assert_eq!(read(&locked).clips()[0].channels, 7);
}

#[test]
fn model_stands_where_it_stood() {
    let model = read(&walker(false));
    let low = |model: &Model| model.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    let options = ReshapeOptions { ground: true, ..ReshapeOptions::default() };
    let (glb, report) = reshaped(&model, 0.5, &options);
    assert!((low(&read(&glb)) - low(&model)).abs() < 1e-6);
    assert!((report.lift - 0.5).abs() < 1e-6, "{report:?}");
    // The skeleton is lifted with the mesh: the player's rest pose equals the positions in the file.
    let shown = super::shown(&player(&read(&glb)), None, 0.0, &[]);
    super::assert_near(&shown, &read(&glb).positions, super::ROUNDING_TOLERANCE, "rest");
}

/// Height of the lowest vertex during the clip.
fn lowest(glb: &[u8]) -> f32 {
    let player = player(&read(glb));
    let at = |k: usize| super::shown(&player, Some(0), CYCLES * CYCLE * k as f32 / 480.0, &[]);
    (0..=480).flat_map(at).map(|p| p.y).fold(f32::INFINITY, f32::min)
}

#[test]
fn clips_keep_the_height_of_their_lowest_point() {
    let mut still_hips = walker_from(0.0, false);
    still_hips.json["animations"][0]["channels"].as_array_mut().unwrap().remove(0);
    for (glb, keep_travel, sink) in [
        (walker(false), false, 0.0),
        (walker(false), true, 0.5),
        (walker(true), false, -0.2),
        (still_hips.glb(), false, 0.0),
    ] {
        let model = read(&glb);
        let free = ReshapeOptions { keep_travel, ..ReshapeOptions::default() };
        let (sunk, _) = reshaped(&model, sink, &free);
        let (stood, report) = reshaped(&model, sink, &ReshapeOptions { ground: true, ..free.clone() });
        let [before, without, with] = [&glb, &sunk, &stood].map(|glb| lowest(glb));
        let what = format!("{before} {without} {with} {report:?}");
        assert!((without - before).abs() > 0.01, "{what}");
        // The export takes the lowest point from 60 samples per second, `lowest` from 240. The tolerance covers the
        // difference.
        assert!((with - before).abs() < 2e-3, "{what}");
        // In a walk on the spot (`sink` < 0) the track of the hips is scaled by the length of their translation at
        // rest. Lifting the skeleton changes this length, so the lifts of skeleton and clip do not add up exactly.
        if sink >= 0.0 {
            assert!((f64::from(with - without) - report.lift - report.clip_lifts[0]).abs() < 1e-5, "{what}");
        }
        // `ground` moves the joints only vertically.
        let at = |glb: &[u8]| player(&read(glb)).pose_at(Some(0), 0.7, &[]).origins;
        for (a, b) in at(&sunk).into_iter().zip(at(&stood)).take(7) {
            assert!((a - b).with_y(0.0).length() < 1e-5, "{what}");
        }
        // The lowest point also keeps its height with locked feet, but less exactly.
        let (held, _) = reshaped(&model, sink, &ReshapeOptions { ground: true, feet: Feet::Lock, ..free });
        assert!((lowest(&held) - before).abs() < 0.02, "{what}: {}", lowest(&held));
    }
}

#[test]
fn loops_stay_loops() {
    for (phase, on_spot) in [(0.0, true), (0.25, true), (0.25, false), (0.4, false), (0.49, true)] {
        let model = read(&walker_from(phase, on_spot).glb());
        let (locked, report) =
            reshaped(&model, 0.0, &ReshapeOptions { feet: Feet::Lock, ..ReshapeOptions::default() });
        let what = format!("{phase} {on_spot} {report:?}");
        let player = player(&read(&locked));
        let [first, last] = [0.0, CYCLES * CYCLE].map(|t| player.pose_at(Some(0), t, &[]).origins);
        // During the two cycles of the clip, all joints travel as far as the hips.
        let travel = last[0] - first[0];
        for k in 0..7 {
            assert!(
                (last[k] - first[k] - travel).length() < 2e-3,
                "{what}: {k}: {} {travel}",
                last[k] - first[k]
            );
        }
        // In two cycles each foot has two contacts.
        assert_eq!(report.feet, Some([2, 4]), "{what}");
    }
}

#[test]
fn hands_near_the_ground_are_feet() {
    for (lift, legs) in [(0.0, 2), (1.0, 1)] {
        let mut b = walker_from(0.0, false);
        for (node, name) in [(4, "arm.R"), (5, "forearm.R"), (6, "hand.R")] {
            b.json["nodes"][node]["name"] = name.into();
        }
        b.json["nodes"][4]["translation"][1] = lift.into();
        let model = read(&b.glb());
        let (_, report) =
            reshaped(&model, 0.0, &ReshapeOptions { feet: Feet::Lock, ..ReshapeOptions::default() });
        assert_eq!(report.feet.unwrap()[0], legs, "{lift}");
    }
}

/// A mirrored armature walks as the armature itself, with the sides exchanged.
#[test]
fn feet_of_a_mirrored_armature_are_held() {
    let mut b = walker_from(0.0, false);
    b.push("nodes", json!({ "name": "mirror", "scale": [1.0, 1.0, -1.0], "children": [0] }));
    b.json["scenes"] = json!([{ "nodes": [8, 7] }]);
    let options = ReshapeOptions { feet: Feet::Lock, ..ReshapeOptions::default() };
    let [plain, mirrored] = [walker(false), b.glb()].map(|glb| reshaped(&read(&glb), 0.0, &options));
    for report in [&plain.1, &mirrored.1] {
        assert!(report.slide[0] > 0.01 && report.slide[1] <= 0.25 * report.slide[0], "{report:?}");
    }
    assert!((mirrored.1.slide[1] - plain.1.slide[1]).abs() < 1e-5, "{:?} {:?}", mirrored.1, plain.1);
    for k in 0..50 {
        let at = |glb: &[u8]| player(&read(glb)).pose_at(Some(0), 0.04 * k as f32, &[]).origins[..7].to_vec();
        let expected: Vec<Vec3> = at(&plain.0).iter().map(|&p| p.with_z(-p.z)).collect();
        super::assert_near(&at(&mirrored.0), &expected, 1e-5, &format!("key {k}"));
    }
}

/// Where all tracks of the legs are STEP, the hips stand still between two keys, and so does a held foot. Another track
/// can be LINEAR.
#[test]
fn feet_are_held_between_the_keys_of_step_tracks() {
    for with_linear in [false, true] {
        let mut b = walker_from(0.0, false);
        for sampler in b.json["animations"][0]["samplers"].as_array_mut().unwrap() {
            sampler["interpolation"] = "STEP".into();
        }
        if with_linear {
            let (times, scales) = (floats(&[0.0, CYCLES * CYCLE]), floats(&[1.0; 6]));
            let input = b.accessor(&times, F32, 2, "SCALAR");
            let output = b.accessor(&scales, F32, 2, "VEC3");
            let clip = &mut b.json["animations"][0];
            clip["samplers"].as_array_mut().unwrap().push(json!({ "input": input, "output": output }));
            let channel = json!({ "sampler": 7, "target": { "node": 3, "path": "scale" } });
            clip["channels"].as_array_mut().unwrap().push(channel);
        }
        let model = read(&b.glb());
        let [free, locked] = [Feet::Free, Feet::Lock]
            .map(|feet| reshaped(&model, 0.0, &ReshapeOptions { feet, ..ReshapeOptions::default() }));
        let [before, after] = [&free.0, &locked.0].map(|glb| slide(glb, 0.0));
        let what = format!("{with_linear}: {before} {after} {:?}", locked.1);
        assert!(before > 0.01 && after <= 0.25 * before, "{what}");
        let [before, after] = locked.1.slide;
        assert!(before > 0.01 && after <= 0.25 * before, "{what}");
    }
}
