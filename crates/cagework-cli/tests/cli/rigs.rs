//! Tests of the commands on a rigged and animated model: the humanoid sample.

use cagework_cage::samples;
use cagework_io::{Model, write_mesh_glb};
use predicates::str::contains;

use crate::support::Sandbox;

/// A folder with the humanoid bound to a cage, and `wide.obj`: the cage scaled by 1.3 in x above the hips.
pub(crate) fn bound() -> Sandbox {
    let sandbox = Sandbox::new();
    let sample = samples::build("humanoid").unwrap();
    let glb = write_mesh_glb("humanoid", &sample.mesh, &sample.colours, sample.rig.as_ref()).unwrap();
    sandbox.write("humanoid.glb", &glb);
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

const DEFORM: &str = "deform humanoid.glb --cage cage.obj --weights w.npz";

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
    // These weights lack the rows of the rig's points.
    sandbox.run("deform humanoid.glb --cage cage.obj --weights w.npz --pose cage.obj -o shape.obj").success();
    sandbox.run("bind shape.obj --cage cage.obj -g 24 --weights w.npz").success();
    sandbox
        .run(&format!("{DEFORM} --pose wide.obj -o out.glb"))
        .failure()
        .stderr(contains("the weights have 0 points of the model's rig, but it has 112"));
    sandbox.run(&format!("{DEFORM} --pose wide.obj --static -o out.glb")).success();
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
    const DYNAMIC: &str = "deform humanoid.glb --cage cage.obj --dynamic";
    let done = sandbox.json(&format!("{DYNAMIC} Walk --pose wide.obj -o bent.glb --json"));
    // At 30 frames per second, the maximum, the clip of 2 s has 60 frames and the last one.
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
        .run(&format!("{DYNAMIC} Run --pose wide.obj -o bent.glb"))
        .failure()
        .stderr(contains("there is no clip 'Run'; the model has Walk"));
    sandbox
        .run(&format!("{DYNAMIC} Walk --pose wide.obj --pose cage.obj -o bent.glb"))
        .failure()
        .stderr(contains("--dynamic takes one pose, but 2 were given"));
    sandbox
        .run(&format!("{DYNAMIC} Walk --pose wide.obj -o bent.obj"))
        .failure()
        .stderr(contains("cannot store a clip"));
}
