use predicates::prelude::*;
use predicates::str::contains;

use crate::support::{CORNERS, Sandbox, assert_close, box_obj, obj_positions};

/// Tolerance of positions: the field is stored and interpolated in `f32`.
const TOLERANCE: f64 = 1e-5;

/// A folder with a sphere in a box cage, `posed.obj`, the cage moved by [`affine`], and `probes.csv`, two points inside
/// the cage and one far outside.
fn posed() -> Sandbox {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("posed.obj", box_obj(&CORNERS.map(affine)));
    sandbox.write("probes.csv", "name,x,y,z,t\na,0.1,0.2,-0.3,20\nb,-0.5,0.5,0.5,21\n\nfar,40,0,0,1\n");
    sandbox
}

fn affine([x, y, z]: [f64; 3]) -> [f64; 3] {
    [1.5 * x + 0.25 * y + 0.3, 0.75 * y - 0.5 * z, z + 0.1 * x - 0.2]
}

fn rows(text: &[u8]) -> Vec<[f64; 3]> {
    let lines = std::str::from_utf8(text).unwrap().lines().skip(1).filter(|line| !line.is_empty());
    let row = |line: &str| {
        let words: Vec<&str> = line.split(',').collect();
        [1, 2, 3].map(|k| words[k].parse().unwrap())
    };
    lines.map(row).collect()
}

#[test]
fn points_are_mapped_there_and_back() {
    let sandbox = posed();
    sandbox
        .run("map probes.csv --cage cage.obj --pose posed.obj -o moved.csv")
        .success()
        .stdout(contains("mapped 3 points").and(contains("wrote moved.csv")));
    let (given, moved) = (sandbox.read("probes.csv"), sandbox.read("moved.csv"));
    let expected: Vec<_> = rows(&given)[..2].iter().map(|&p| affine(p)).collect();
    assert_close(&rows(&moved)[..2], &expected, TOLERANCE);
    let text = String::from_utf8(moved).unwrap();
    assert!(text.starts_with("name,x,y,z,t\na,") && text.ends_with(",21\n\nfar,40,0,0,1\n"), "{text}");
    let done = sandbox.json("map moved.csv --cage cage.obj --pose posed.obj --inverse -o back.csv --json");
    assert_eq!(done["not_found"], serde_json::json!([]));
    assert_close(&rows(&sandbox.read("back.csv")), &rows(&given), TOLERANCE);
}

#[test]
fn vertices_of_models_and_clouds_are_mapped() {
    let sandbox = posed();
    sandbox.run("map mesh.obj --cage cage.obj --pose posed.obj -o out.obj").success();
    let expected: Vec<_> = obj_positions(&sandbox.read("mesh.obj")).into_iter().map(affine).collect();
    assert_close(&obj_positions(&sandbox.read("out.obj")), &expected, TOLERANCE);
    // With --up z, cage, pose and model are rotated in the same way, so the map in the file's axes is still `affine`.
    sandbox.run("map mesh.obj --up z --cage cage.obj --pose posed.obj -o z.obj").success();
    assert_close(&obj_positions(&sandbox.read("z.obj")), &expected, TOLERANCE);
    sandbox.run("map probes.csv --up z --cage cage.obj --pose posed.obj -o z.csv").success();
    let expected: Vec<_> = rows(&sandbox.read("probes.csv"))[..2].iter().map(|&p| affine(p)).collect();
    assert_close(&rows(&sandbox.read("z.csv"))[..2], &expected, TOLERANCE);
}

#[test]
fn points_without_an_inverse_are_reported_and_kept() {
    let sandbox = posed();
    // A cage that is flattened to a plane has no inverse map.
    sandbox.write("flat.obj", box_obj(&CORNERS.map(|[x, _, z]| [x, 0.0, z])));
    sandbox
        .run("map probes.csv --cage cage.obj --pose flat.obj --inverse -o back.csv")
        .success()
        .stdout(contains("of 3 points have no inverse").and(contains("The first is point 1")));
    let lines = |name: &str| String::from_utf8(sandbox.read(name)).unwrap();
    assert_eq!(lines("back.csv"), lines("probes.csv"));
}

#[test]
fn the_lattice_is_written_without_weights() {
    let sandbox = posed();
    let deform = "deform mesh.obj --cage cage.obj --pose posed.obj";
    sandbox
        .run(&format!("{deform} --lattice field.npz --lattice-cells 16"))
        .success()
        .stdout("wrote field.npz: 25 x 25 x 25 nodes, 0.125 apart\n");
    assert!(sandbox.read("field.npz").starts_with(b"PK"));
    sandbox
        .run(&format!("{deform} --lattice field.npz -o out.obj"))
        .code(1)
        .stderr(contains("give --weights"));
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --weights w.npz").success();
    let done = sandbox.json(&format!("{deform} --weights w.npz --lattice field.npz -o out.obj --json"));
    assert_eq!((&done["vertices"], &done["lattice"]["output"]), (&178.into(), &"field.npz".into()));
    sandbox
        .run(&format!("{deform} --pose cage.obj --lattice field.npz"))
        .code(1)
        .stderr(contains("take one pose, but 2 were given"));
}

#[test]
fn invalid_points_and_outputs_of_map_are_refused() {
    let sandbox = posed();
    let map = |points: &str, output: &str| {
        sandbox.run(&format!("map {points} --cage cage.obj --pose posed.obj -o {output}"))
    };
    sandbox.write("words.csv", "a,b,c\nno,numbers,here\n");
    map("words.csv", "out.csv").code(1).stderr(contains("words.csv: the file has no points"));
    map("probes.csv", "out.obj").code(1).stderr(contains("points keep their format"));
    map("mesh.obj", "out.csv").code(1).stderr(contains("out.csv"));
    map("probes.csv", "probes.csv").code(1).stderr(contains("probes.csv"));
    sandbox
        .run("map probes.csv --cage cage.obj --pose mesh.obj -o out.csv")
        .code(1)
        .stderr(contains("mesh.obj"));
    sandbox.run("map probes.csv --cage cage.obj --pose posed.obj --cells 7 -o out.csv").code(2);
    sandbox
        .run("map probes.csv --cage cage.obj --pose posed.obj --cells 256 --memory-limit 500 -o out.csv")
        .code(1)
        .stderr(contains("binding needs about").and(contains("limit of 500 MiB")));
    assert!(!sandbox.names().iter().any(|name| name.starts_with("out")));
}
