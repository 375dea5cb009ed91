use predicates::prelude::*;
use predicates::str::contains;

use crate::rigs;
use crate::support::{CORNERS, Sandbox, assert_close, box_obj, obj_positions};

/// Tolerance of positions, object units: the field is stored and interpolated in `f32`.
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
fn points_beyond_the_lattice_are_counted() {
    let sandbox = posed();
    let map = "map probes.csv --cage cage.obj --pose posed.obj";
    let notice =
        "1 of 3 points is beyond the lattice around the cage and stays where it is. The first is point 3.";
    // At rest only `far` is beyond the lattice; from there, no inverse starts or ends inside.
    for inverse in ["", " --inverse"] {
        let done = sandbox.json(&format!("{map}{inverse} -o out.csv --json"));
        assert_eq!((&done["beyond_lattice"], &done["notices"]), (&1.into(), &serde_json::json!([notice])));
        assert_eq!(rows(&sandbox.read("out.csv"))[2], [40.0, 0.0, 0.0]);
    }
    sandbox.run(&format!("{map} -o out.csv")).success().stdout(contains(format!("note: {notice}")));
    sandbox.write("near.csv", "0.1,0.2,0.3\n1.2,0,0\n");
    let done = sandbox.json("map near.csv --cage cage.obj --pose posed.obj -o out.csv --json");
    assert_eq!((&done["beyond_lattice"], &done["notices"]), (&0.into(), &serde_json::json!([])));
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
        .stderr(contains("takes one pose, but 2 were given"));
}

#[test]
fn invalid_points_and_outputs_of_map_are_refused() {
    let sandbox = posed();
    let map = |points: &str, output: &str| {
        sandbox.run(&format!("map {points} --cage cage.obj --pose posed.obj -o {output}"))
    };
    sandbox.write("words.csv", "a,b,c\nno,numbers,here\n");
    map("words.csv", "out.csv").code(1).stderr(contains("words.csv: line 1 has neither three numbers"));
    map("probes.csv", "out.obj")
        .code(1)
        .stderr(contains("points are written in the format that they were read in"));
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

/// Triangles of an OBJ whose faces are convex.
fn obj_triangles(bytes: &[u8]) -> Vec<[[f64; 3]; 3]> {
    let positions = obj_positions(bytes);
    let text = std::str::from_utf8(bytes).unwrap();
    let corners = text.lines().filter_map(|line| line.strip_prefix("f ")).map(|line| {
        line.split_whitespace().map(|word| positions[word.parse::<usize>().unwrap() - 1]).collect::<Vec<_>>()
    });
    corners.flat_map(|c| (2..c.len()).map(|k| [c[0], c[k - 1], c[k]]).collect::<Vec<_>>()).collect()
}

/// A binary STL without normals.
fn stl(triangles: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.as_flattened().iter().flat_map(|&x| (x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn stl_triangles(bytes: &[u8]) -> Vec<[[f64; 3]; 3]> {
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let corner = |at: usize| [float(at), float(at + 4), float(at + 8)];
    let triangles = (84..bytes.len()).step_by(50);
    triangles.map(|at| [corner(at + 12), corner(at + 24), corner(at + 36)]).collect()
}

/// The points at which the edges of triangles cross the plane with this y.
fn slice(triangles: &[[[f64; 3]; 3]], y: f64) -> Vec<[f64; 3]> {
    let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let crossing = edges.filter(|[a, b]| (a[1] < y) != (b[1] < y));
    crossing
        .map(|[a, b]| {
            let t = (y - a[1]) / (b[1] - a[1]);
            [0, 1, 2].map(|k| a[k] + t * (b[k] - a[k]))
        })
        .collect()
}

#[test]
fn slices_of_a_bent_stl_are_mapped_back_and_forth() {
    let sandbox = Sandbox::with_sphere_in_box();
    let rest = obj_triangles(&sandbox.read("mesh.obj"));
    sandbox.write("mesh.stl", stl(&rest));
    // The higher a corner is, the more it turns about z and moves along x.
    let bend = |[x, y, z]: [f64; 3]| {
        let (sin, cos) = (0.2 * (y + 1.0)).sin_cos();
        [x * cos - y * sin + 0.1 * y, x * sin + y * cos, z + 0.1 * x * y]
    };
    sandbox.write("bent.obj", box_obj(&CORNERS.map(bend)));
    sandbox.run("bind mesh.stl --cage cage.obj --weights w.npz").success();
    sandbox.run("deform mesh.stl --cage cage.obj --weights w.npz --pose bent.obj -o bent.stl").success();
    let bent = stl_triangles(&sandbox.read("bent.stl"));
    let points = [-0.4, 0.013, 0.35].map(|y| slice(&bent, y)).concat();
    assert!(points.len() > 150, "{}", points.len());
    let lines = points.iter().map(|[x, y, z]| format!("{x},{y},{z}\n"));
    sandbox.write("sliced.csv", lines.fold("x,y,z\n".to_owned(), |all, line| all + &line));
    let map = "--cage cage.obj --pose bent.obj";
    let back = sandbox.json(&format!("map sliced.csv {map} --inverse -o back.csv --json"));
    assert_eq!(back["not_found"], serde_json::json!([]));
    sandbox.run(&format!("map back.csv {map} -o again.csv")).success();
    let numbers = |name: &str| -> Vec<[f64; 3]> {
        let text = String::from_utf8(sandbox.read(name)).unwrap();
        let numbers = |line: &str| line.split(',').map(|word| word.parse().unwrap()).collect::<Vec<f64>>();
        text.lines().skip(1).map(|line| <[f64; 3]>::try_from(numbers(line)).unwrap()).collect()
    };
    let radius = rest.as_flattened().iter().map(|[x, y, z]| x.hypot(*y).hypot(*z)).fold(0.0, f64::max);
    assert_close(&numbers("again.csv"), &points, TOLERANCE * 2.0 * radius);
    // A triangle of the mesh spans at most pi / 12 by pi / 8 of the sphere, so its points are at most the radius times
    // 1 - cos(pi / 24) cos(pi / 16) = 0.028 below the sphere. The bent edges are straight, which adds a little.
    for [x, y, z] in numbers("back.csv") {
        let height = x.hypot(y).hypot(z) / radius;
        assert!((0.96..1.01).contains(&height), "{x} {y} {z} is at {height} of the radius");
    }
}

#[test]
fn rig_that_map_drops_is_a_notice() {
    let sandbox = rigs::bound();
    let map = "map humanoid.glb --cage cage.obj --pose wide.obj";
    let notice = "note: the glb file does not keep skins and morph targets; `cagework deform` does";
    sandbox.run(&format!("{map} -o out.glb")).success().stdout(contains(notice));
    // The output has no skin, so the next one loses nothing.
    sandbox
        .run(&format!("{map} -o again.glb").replace("humanoid", "out"))
        .success()
        .stdout(contains("note:").not());
}
