//! Tests of `cagework proportions` on the humanoid sample.

use cagework_io::Model;
use glam::Vec3;
use predicates::str::contains;

use crate::rigs::humanoid;
use crate::support::Sandbox;

/// Heights of the lowest and highest vertex of a file, without its clips.
fn heights(sandbox: &Sandbox, name: &str) -> [f32; 2] {
    let model = Model::read(name, &sandbox.read(name), &mut |_| None).unwrap();
    let up = |p: &Vec3| p.y;
    let heights = || model.positions.iter().map(up);
    [heights().fold(f32::INFINITY, f32::min), heights().fold(f32::NEG_INFINITY, f32::max)]
}

#[test]
fn longer_legs_and_a_bigger_head_in_one_command() {
    let sandbox = humanoid();
    let done = sandbox.json(
        "proportions humanoid.glb --leg 1.2 --head 1.15 -g 32 -o tall.glb --save-cage cage.obj --pose-out tall.obj --json",
    );
    assert_eq!((&done["factors"]["leg"], &done["factors"]["head"]), (&1.2.into(), &1.15.into()));
    assert_eq!((&done["bones_by"], done["bones"].as_array().unwrap().len()), (&"names".into(), 16));
    let [[low, high], [low_after, high_after]] =
        ["humanoid.glb", "tall.glb"].map(|name| heights(&sandbox, name));
    // Legs of 0.8 grow by a fifth; the soles stay.
    assert!((low_after - low).abs() < 1e-4, "{low} {low_after}");
    assert!(high_after - high > 0.15, "{high} {high_after}");
    let model = Model::read("tall.glb", &sandbox.read("tall.glb"), &mut |_| None).unwrap();
    assert_eq!(model.clips().len(), 1);

    // The pose does the same in `deform`.
    sandbox.run("bind humanoid.glb --cage cage.obj -g 32 --weights w.npz").success();
    sandbox
        .run("deform humanoid.glb --cage cage.obj --weights w.npz --pose tall.obj --ground -o again.glb")
        .success();
    let read = |name: &str| Model::read(name, &sandbox.read(name), &mut |_| None).unwrap().positions;
    let far =
        read("tall.glb").iter().zip(&read("again.glb")).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(far < 1e-4, "{far}");
}

#[test]
fn presets_sides_and_ranges() {
    let sandbox = humanoid();
    sandbox.run("proportions --presets").success().stdout(contains("chibi"));
    let done = sandbox.json(
        "proportions humanoid.glb --cage box:2 -g 16 --preset slim --waist 1.1 --left arm=0.8 --ranges --json",
    );
    assert_eq!((&done["factors"]["waist"], &done["factors"]["left_arm"]), (&1.1.into(), &0.8.into()));
    assert_eq!(done["factors"]["hip"], 0.92);
    let ranges = done["ranges"].as_array().unwrap();
    assert_eq!((ranges.len(), &ranges[11]["proportion"]), (12, &"height".into()));
}

#[test]
fn wrong_factors_and_models_are_refused() {
    let sandbox = humanoid();
    let refused = |line: &str, part: &str| {
        sandbox.run(&format!("proportions humanoid.glb {line} -o out.glb")).failure().stderr(contains(part));
    };
    refused("--leg 3", "from 0.5 to 2");
    refused("--left head=1.2", "head has no sides");
    refused("--left arm", "expected NAME=FACTOR");
    refused("--bone leftClaw=x", "leftClaw");
    refused("--bone leftHand=Claw", "there is no joint \"Claw\"");
    sandbox.run("demo -o out").success();
    sandbox.run("proportions out/rat.obj --leg 1.2 -o out.glb").failure().stderr(contains("no skeleton"));
}
