//! Tests of the commands on a rigged and animated model: the humanoid sample.

use cagework_cage::samples;
use cagework_io::{Model, write_mesh_glb};
use predicates::str::contains;
use serde_json::{Value, json};

use crate::support::{Sandbox, glb_json};

/// A folder with the humanoid.
pub(crate) fn humanoid() -> Sandbox {
    let sandbox = Sandbox::new();
    let sample = samples::build("humanoid").unwrap();
    let glb = write_mesh_glb("humanoid", &sample.mesh, &sample.colours, sample.rig.as_ref()).unwrap();
    sandbox.write("humanoid.glb", &glb);
    sandbox
}

/// A folder with the humanoid bound to a cage, and `wide.obj`: the cage scaled by 1.3 in x above the hips.
pub(crate) fn bound() -> Sandbox {
    let sandbox = humanoid();
    sandbox.run("cage humanoid.glb -o cage.obj").success();
    sandbox.run("bind humanoid.glb --cage cage.obj -g 24 --weights w.npz").success();
    let wider = |line: &str| {
        let Some(xyz) = line.strip_prefix("v ") else { return line.to_owned() };
        let [x, y, z] = [0, 1, 2].map(|k| xyz.split(' ').nth(k).unwrap().parse::<f64>().unwrap());
        format!("v {} {y} {z}", if y > 0.8 { 1.3 * x } else { x })
    };
    let cage = String::from_utf8(sandbox.read("cage.obj")).unwrap();
    sandbox.write("wide.obj", cage.lines().map(wider).collect::<Vec<_>>().join("\n"));
    sandbox
}

pub(crate) const DEFORM: &str = "deform humanoid.glb --cage cage.obj --weights w.npz";

#[test]
fn rig_is_kept_and_an_unmoved_model_is_byte_identical() {
    let sandbox = bound();
    let info = sandbox.json("info humanoid.glb --json");
    assert_eq!((&info["joints"], &info["clips"][0]["name"]), (&16.into(), &"Walk".into()));
    assert_eq!(info["clips"][0]["seconds"], 2.0);

    sandbox.run(&format!("{DEFORM} --pose cage.obj -o same.glb")).success();
    assert!(sandbox.read("same.glb") == sandbox.read("humanoid.glb"));

    let done = sandbox.json(&format!("{DEFORM} --pose wide.obj -o wide.vrm --json"));
    assert_eq!(done["joints"], 16);
    assert!(done["joints_moved"].as_u64().unwrap() >= 6, "{done}");
    assert!(done["tracks"].as_u64().unwrap() <= 1, "rotations are kept: {done}");
    let wide = sandbox.read("wide.vrm");
    let read = |bytes: &[u8]| Model::read("model.glb", bytes, &mut |_| None).unwrap();
    assert_eq!((read(&wide).counts.skins, read(&wide).clips().len()), (1, 1));

    let stay = sandbox.json(&format!("{DEFORM} --pose wide.obj --joints stay -o stay.glb --json"));
    assert_eq!((&stay["joints_moved"], &stay["tracks"]), (&0.into(), &0.into()));
    let plain = sandbox.json(&format!("{DEFORM} --pose wide.obj --static -o plain.glb --json"));
    assert!(plain.get("joints").is_none());
    // The rest shape is the same in all three outputs.
    let shapes = [wide, sandbox.read("stay.glb"), sandbox.read("plain.glb")].map(|bytes| read(&bytes));
    for other in &shapes[1..] {
        let pairs = shapes[0].positions.iter().zip(&other.positions);
        let off = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(off < 2e-6, "{off:e}");
    }
}

#[test]
fn missing_parts_clips_and_rig_points_are_reported() {
    let sandbox = bound();
    sandbox.run(&format!("{DEFORM} --pose wide.obj --rigid hat -o out.glb")).failure().stderr(contains(
        "no part is called 'hat'; the model has material:humanoid, node:humanoid, joint:hips",
    ));
    sandbox
        .run("cage humanoid.glb --around-clip Run -o run.obj")
        .failure()
        .stderr(contains("there is no clip 'Run'; the model has Walk"));
    sandbox.run("cage humanoid.glb --around-clip Walk -o walk.obj").success();
    // The bound model has no rig, so the weights lack the rows of the rig's points.
    sandbox.run("deform humanoid.glb --cage cage.obj --weights w.npz --pose cage.obj -o shape.obj").success();
    sandbox.run("bind shape.obj --cage cage.obj -g 24 --weights w.npz").success();
    sandbox
        .run(&format!("{DEFORM} --pose wide.obj -o out.glb"))
        .failure()
        .stderr(contains("the weights were made for another version of this rig (0 points, now 112)"));
    sandbox.run(&format!("{DEFORM} --pose wide.obj --static -o out.glb")).success();
}

#[test]
fn shared_name_of_a_material_and_a_node_is_a_notice() {
    let sandbox = bound();
    let info = sandbox.json("info humanoid.glb --json");
    let parts = info["parts"].as_array().unwrap();
    assert!(
        ["material:humanoid", "node:humanoid", "joint:hips"].iter().all(|&name| parts.contains(&name.into()))
    );
    sandbox
        .run("info humanoid.glb")
        .success()
        .stdout(contains("parts       material:humanoid, node:humanoid, joint:hips"));
    let mask = |name: &str, out: &str| {
        sandbox.run(&format!("{DEFORM} --pose wide.obj --mask {name} -o {out}.glb")).success()
    };
    mask("humanoid", "short")
        .stdout(contains("note: 'humanoid' means material:humanoid; for the other part write node:humanoid"));
    mask("material:humanoid", "full");
    assert!(sandbox.read("short.glb") == sandbox.read("full.glb"));
}

#[test]
fn masked_parts_stay_and_rigid_parts_keep_their_shape() {
    let sandbox = bound();
    let read = |bytes: &[u8]| Model::read("model.glb", bytes, &mut |_| None).unwrap();
    let rest = read(&sandbox.read("humanoid.glb"));
    let joint = rest.part_names().into_iter().find(|name| name.contains("head")).unwrap();
    let held = rest.select(&joint).unwrap();
    assert!(held.len() > 100 && held.len() < rest.positions.len() / 2);
    let run = |options: &str| {
        sandbox.run(&format!("{DEFORM} --pose wide.obj {options} -o out.glb")).success();
        read(&sandbox.read("out.glb")).positions
    };
    let bent = run("");
    let off = |a: &[glam::Vec3], b: &[glam::Vec3]| {
        held.iter().map(|&v| a[v as usize].distance(b[v as usize])).fold(0.0, f32::max)
    };
    assert!(off(&bent, &rest.positions) > 0.01);
    assert!(off(&run(&format!("--mask {joint}")), &rest.positions) <= 1e-6);
    let half: Vec<_> = bent.iter().zip(&rest.positions).map(|(a, b)| 0.5 * (*a + *b)).collect();
    assert!(off(&run(&format!("--mask {joint}=0.5")), &half) <= 1e-6);
    for options in ["", "--static"] {
        let rigid = run(&format!("--rigid {joint} {options}"));
        for pair in held.windows(2).step_by(7) {
            let [before, after] =
                [&rest.positions, &rigid].map(|at| at[pair[0] as usize].distance(at[pair[1] as usize]));
            assert!((before - after).abs() <= 2e-6, "{options}: {before} {after}");
        }
    }
    sandbox
        .run(&format!("{DEFORM} --pose wide.obj --mask {joint}=2 -o out.glb"))
        .failure()
        .stderr(contains("the amount is 2; expected 0 (follows the cage) to 1 (stays in place)"));
}

#[test]
fn dynamic_deform_bends_every_frame_of_a_clip() {
    let sandbox = bound();
    const DYNAMIC_DEFORM: &str = "deform humanoid.glb --cage cage.obj --dynamic";
    let done = sandbox.json(&format!("{DYNAMIC_DEFORM} Walk --pose wide.obj -o bent.glb --json"));
    // At 30 frames per second, the maximum, the clip of 2 s has 60 frames and one at its end.
    assert_eq!((&done["frames"], &done["clip"]), (&61.into(), &"Walk".into()));
    let read = |name: &str| Model::read("model.glb", &sandbox.read(name), &mut |_| None).unwrap();
    let (model, bent) = (read("humanoid.glb"), read("bent.glb"));
    assert_eq!((bent.clips().len(), bent.clips()[0].seconds), (1, 2.0));
    let (before, after) = (model.frames(0).unwrap(), bent.frames(0).unwrap());
    // In every frame the chest is 1.3 times as wide, as in the posed cage.
    let chest = |p: &&glam::Vec3| p.y > 1.2 && p.y < 1.4 && p.x.abs() > 0.05 && p.x.abs() < 0.12;
    for (old, new) in before.iter().zip(&after).step_by(20) {
        let pairs = old.iter().zip(new).filter(|(old, _)| chest(old));
        let wider: Vec<f32> = pairs.map(|(old, new)| new.x / old.x).collect();
        let mean = wider.iter().sum::<f32>() / wider.len() as f32;
        assert!(wider.len() > 50 && (mean - 1.3).abs() < 0.05, "{mean} of {}", wider.len());
    }
    sandbox
        .run(&format!("{DYNAMIC_DEFORM} Run --pose wide.obj -o bent.glb"))
        .failure()
        .stderr(contains("there is no clip 'Run'; the model has Walk"));
    sandbox
        .run(&format!("{DYNAMIC_DEFORM} Walk --pose wide.obj --pose cage.obj -o bent.glb"))
        .failure()
        .stderr(contains("a clip that the cage bends takes one pose as its shape, not 2 morph targets"));
    sandbox
        .run(&format!("{DYNAMIC_DEFORM} Walk --pose wide.obj -o bent.obj"))
        .failure()
        .stderr(contains("cannot store a clip"));
}

/// The humanoid with extensions in its document, such as VRM data. `extensions`: by their names.
fn with_extensions(sandbox: &Sandbox, extensions: &Value) -> Vec<u8> {
    let glb = sandbox.read("humanoid.glb");
    let mut json = glb_json(&glb);
    json["extensionsUsed"] = extensions.as_object().unwrap().keys().cloned().collect();
    json["extensions"] = extensions.clone();
    let mut text = serde_json::to_vec(&json).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let old = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let total = (glb.len() - old + text.len()) as u32;
    let header = [&glb[..8], &total.to_le_bytes(), &(text.len() as u32).to_le_bytes(), b"JSON"].concat();
    [&header, text.as_slice(), &glb[20 + old..]].concat()
}

#[test]
fn poses_are_morph_targets_with_the_given_names() {
    let sandbox = bound();
    let poses = format!("{DEFORM} --pose wide.obj --pose cage.obj");
    sandbox.run(&format!("{poses} --name wide --name rest -o poses.glb")).success();
    let targets = |name: &str| glb_json(&sandbox.read(name))["meshes"][0]["extras"]["targetNames"].clone();
    assert_eq!(targets("poses.glb"), json!(["wide", "rest"]));
    for (names, message) in [
        ("--name wide", "--name: 1 name for 2 files of poses"),
        ("--name wide --name wide", "--name: 'wide' is given twice"),
        ("--name wide --name rest --expression", "humanoid.glb: expressions need a VRM"),
    ] {
        sandbox.run(&format!("{poses} {names} -o out.glb")).code(1).stderr(contains(message));
    }
    sandbox.run(&format!("{poses} --name wide --name rest --expression --static -o out.glb")).code(2);
}

/// The expected fields of expressions are those that VRMC_vrm-1.0 ("Expressions") and VRM 0.x (`vrm.blendshape.group`)
/// specify.
#[test]
fn poses_become_expressions_of_a_vrm() {
    let sandbox = bound();
    let vrm_1 = json!({ "specVersion": "1.0", "expressions": { "preset": { "aa": { "morphTargetBinds": [{ "node": 0, "index": 0, "weight": 1.0 }] } }, "custom": 3 } });
    sandbox.write("one.vrm", with_extensions(&sandbox, &json!({ "VRMC_vrm": vrm_1 })));
    let vrm_0 = json!({ "blendShapeMaster": { "blendShapeGroups": [{ "name": "A", "presetName": "a", "binds": [{ "mesh": 0, "index": 0, "weight": 100.0 }] }] } });
    sandbox.write("zero.vrm", with_extensions(&sandbox, &json!({ "VRM": vrm_0 })));
    let node = glb_json(&sandbox.read("humanoid.glb"))["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .position(|n| n.get("mesh").is_some());
    let deform = |model: &str, poses: &str| {
        format!("deform {model} --cage cage.obj --weights w.npz --expression {poses} -o out.vrm")
    };
    let both = "--pose wide.obj --name happy --pose wide.obj --name smirk --pose cage.obj --name still";
    sandbox
        .run(&deform("one.vrm", both))
        .success()
        .stdout(contains("3 poses as VRM expressions (happy, smirk, still)"));
    let json = glb_json(&sandbox.read("out.vrm"));
    let expressions = &json["extensions"]["VRMC_vrm"]["expressions"];
    let binds = |k: usize| json!([{ "node": node, "index": k, "weight": 1.0 }]);
    assert_eq!(expressions["preset"]["happy"]["morphTargetBinds"], binds(0));
    assert_eq!(expressions["custom"]["smirk"]["morphTargetBinds"], binds(1));
    assert_eq!(expressions["custom"]["still"]["morphTargetBinds"], json!([]), "it moves nothing");
    assert_eq!(expressions["preset"]["aa"]["morphTargetBinds"][0]["index"], 0, "unchanged");
    assert_eq!(json["animations"].as_array().unwrap().len(), 1, "the model's own clip alone");
    let info = sandbox.json("info out.vrm --json");
    assert_eq!(info["vrm"]["version"], "1.0");
    assert_eq!(info["vrm"]["expressions"], json!(["aa", "happy", "smirk", "still"]));

    // A single pose is also written as an expression, and the model remains at rest.
    let one = "--pose wide.obj --name Joy";
    sandbox.run(&deform("zero.vrm", one)).success();
    let json = glb_json(&sandbox.read("out.vrm"));
    let groups = &json["extensions"]["VRM"]["blendShapeMaster"]["blendShapeGroups"];
    let bind = json!([{ "mesh": 0, "index": 0, "weight": 100.0 }]);
    assert_eq!((&groups[0]["name"], &groups[1]["name"]), (&"A".into(), &"Joy".into()));
    assert_eq!((&groups[1]["presetName"], &groups[1]["binds"]), (&"joy".into(), &bind));
    let read = |name: &str| Model::read("model.glb", &sandbox.read(name), &mut |_| None).unwrap();
    assert_eq!(read("out.vrm").positions, read("zero.vrm").positions);
    sandbox
        .run(&deform("one.vrm", "--pose wide.obj --name aa"))
        .code(1)
        .stderr(contains("the file has an expression 'aa' already"));
    // Presets of VRM 0 are case-insensitive, and applications find an expression by its preset, not by its name.
    for name in ["a", "A"] {
        sandbox
            .run(&deform("zero.vrm", &format!("--pose wide.obj --name {name}")))
            .code(1)
            .stderr(contains(format!("the file has an expression '{name}' already")));
    }
    sandbox
        .run(&deform("zero.vrm", "--pose wide.obj --name Joy --pose wide.obj --name joy"))
        .code(1)
        .stderr(contains("the file has an expression 'joy' already"));
    sandbox
        .run(&format!("{} --times 0.5", deform("one.vrm", one)))
        .success()
        .stdout(contains("1 pose as VRM expressions (Joy) and an animation of 0.5 s"));
}

/// Exporters write presets that are not used as expressions without morph targets. Both specifications allow empty
/// lists, and an application finds the expression by its preset.
#[test]
fn expressions_that_do_nothing_are_filled() {
    let sandbox = bound();
    let happy = json!({ "isBinary": true, "morphTargetBinds": [], "overrideBlink": "block" });
    let colors =
        json!({ "materialColorBinds": [{ "material": 0, "type": "color", "targetValue": [1, 1, 1, 1] }] });
    let vrm_1 =
        json!({ "specVersion": "1.0", "expressions": { "preset": { "happy": happy, "sad": colors } } });
    sandbox.write("one.vrm", with_extensions(&sandbox, &json!({ "VRMC_vrm": vrm_1 })));
    let groups = json!([
        { "name": "Smile", "presetName": "Joy", "binds": [], "materialValues": [] },
        { "name": "Sorrow", "presetName": "sorrow", "binds": [], "materialValues": [{ "materialName": "a" }] },
    ]);
    let vrm_0 = json!({ "blendShapeMaster": { "blendShapeGroups": groups } });
    sandbox.write("zero.vrm", with_extensions(&sandbox, &json!({ "VRM": vrm_0 })));
    let deform = |model: &str, name: &str| {
        sandbox.run(&format!(
            "deform {model} --cage cage.obj --weights w.npz --expression --pose wide.obj --name {name} -o out.vrm"
        ))
    };
    deform("one.vrm", "happy").success();
    let expressions = &glb_json(&sandbox.read("out.vrm"))["extensions"]["VRMC_vrm"]["expressions"];
    let happy = &expressions["preset"]["happy"];
    assert_eq!((&happy["isBinary"], &happy["overrideBlink"]), (&json!(true), &json!("block")), "kept");
    assert_eq!(
        (&happy["morphTargetBinds"][0]["index"], &happy["morphTargetBinds"][0]["weight"]),
        (&json!(0), &json!(1.0))
    );
    deform("zero.vrm", "joy").success();
    let groups =
        &glb_json(&sandbox.read("out.vrm"))["extensions"]["VRM"]["blendShapeMaster"]["blendShapeGroups"];
    let bind = json!([{ "mesh": 0, "index": 0, "weight": 100.0 }]);
    assert_eq!((groups.as_array().unwrap().len(), &groups[0]["name"]), (2, &json!("Smile")));
    assert_eq!((&groups[0]["presetName"], &groups[0]["binds"]), (&json!("Joy"), &bind));
    for (model, name) in [("one.vrm", "sad"), ("zero.vrm", "sorrow")] {
        let message = format!("the file has an expression '{name}' already");
        deform(model, name).code(1).stderr(contains(message));
    }
}

#[test]
fn springs_and_colliders_of_a_vrm_are_counted() {
    let sandbox = humanoid();
    let sphere = json!({ "node": 1, "shape": { "sphere": { "radius": 0.1 } } });
    let vrm_1 = json!({
        "VRMC_vrm": { "specVersion": "1.0" },
        "VRMC_springBone": {
            "specVersion": "1.0",
            "colliders": [sphere, sphere, sphere],
            "springs": [{ "joints": [{ "node": 2 }, { "node": 3 }] }, { "joints": [{ "node": 4 }] }],
        },
    });
    // In VRM 0, a group contains the colliders of a node, and another one the chains of springs with the same settings.
    let collider = json!({ "offset": { "x": 0.0, "y": 0.0, "z": 0.0 }, "radius": 0.1 });
    let vrm_0 = json!({ "VRM": { "secondaryAnimation": {
        "colliderGroups": [{ "node": 1, "colliders": [collider, collider] }, { "node": 2, "colliders": [collider] }],
        "boneGroups": [{ "bones": [3, 4], "colliderGroups": [0, 1] }, { "bones": [5] }],
    } } });
    let bare = json!({ "VRMC_vrm": { "specVersion": "1.0" } });
    let one = json!({
        "VRMC_vrm": { "specVersion": "1.0" },
        "VRMC_springBone": { "colliders": [sphere], "springs": [{ "joints": [{ "node": 2 }] }] },
    });
    for (extensions, version, springs, colliders, row) in [
        (vrm_1, "1.0", 2, 3, "VRM         1.0, 2 springs, 3 colliders\n"),
        (vrm_0, "0.0", 2, 3, "VRM         0.0, 2 springs, 3 colliders\n"),
        (bare, "1.0", 0, 0, "VRM         1.0, 0 springs, 0 colliders\n"),
        (one, "1.0", 1, 1, "VRM         1.0, 1 spring, 1 collider\n"),
    ] {
        sandbox.write("person.vrm", with_extensions(&sandbox, &extensions));
        sandbox.run("info person.vrm").success().stdout(contains(row));
        let expected =
            json!({ "version": version, "expressions": [], "springs": springs, "colliders": colliders });
        assert_eq!(sandbox.json("info person.vrm --json")["vrm"], expected);
    }
}

#[test]
fn ground_and_feet_are_options_of_one_pose() {
    let sandbox = bound();
    // Lower the cage, and with it the model, by half a unit.
    let sunk = |line: &str| match line.strip_prefix("v ") {
        None => format!("{line}\n"),
        Some(xyz) => {
            let [x, y, z] = [0, 1, 2].map(|k| xyz.split(' ').nth(k).unwrap().parse::<f64>().unwrap());
            format!("v {x} {} {z}\n", y - 0.5)
        }
    };
    let cage = String::from_utf8(sandbox.read("cage.obj")).unwrap();
    sandbox.write("low.obj", cage.lines().map(sunk).collect::<String>());
    let low = |name: &str| {
        let model = Model::read(name, &sandbox.read(name), &mut |_| None).unwrap();
        model.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min)
    };
    for name in ["out.glb", "out.obj"] {
        sandbox.run(&format!("{DEFORM} --pose low.obj --ground -o {name}")).success();
        assert!((low(name) - low("humanoid.glb")).abs() < 1e-5, "{name}");
    }
    let held = sandbox.json(&format!("{DEFORM} --pose wide.obj --feet lock -o out.glb --json"));
    assert_eq!(held["feet"][0], 2, "{held}");
    for (args, message) in [
        ("--pose low.obj --pose wide.obj --ground", "the option ground takes one pose as its shape"),
        ("--pose low.obj --pose wide.obj --feet lock", "the option feet = lock takes one pose as its shape"),
    ] {
        sandbox.run(&format!("{DEFORM} {args} -o out.glb")).code(1).stderr(contains(message));
    }
    sandbox
        .run(&format!("{DEFORM} --pose low.obj --feet glue -o out.glb"))
        .code(2)
        .stderr(contains("free, lock"));
    sandbox.run(&format!("{DEFORM} --pose low.obj --ground --static -o out.glb")).code(2);
    sandbox.run("bind out.obj --cage cage.obj -g 16 --weights v.npz").success();
    sandbox
        .run("deform out.obj --cage cage.obj --weights v.npz --pose low.obj --feet lock -o held.obj")
        .code(1)
        .stderr(contains("out.obj: locked feet need a model with a skeleton"));
}
