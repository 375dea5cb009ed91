use predicates::prelude::*;
use predicates::str::contains;

use crate::support::{CORNERS, Sandbox, box_obj};

/// A `.splat` file of splats on a sphere of radius 0.7, and one far outside the cage.
pub(crate) fn capture() -> Vec<u8> {
    const N: usize = 3000;
    let mut bytes = Vec::new();
    for k in 0..N {
        let z = 1.0 - 2.0 * (k as f32 + 0.5) / N as f32;
        let (radius, angle) = (0.7 * (1.0 - z * z).sqrt(), 2.4 * k as f32);
        let far = if k == 7 { 30.0 } else { 0.0 };
        let numbers = [radius * angle.cos() + far, radius * angle.sin(), 0.7 * z, 0.03, 0.02, 0.002];
        bytes.extend(numbers.into_iter().flat_map(f32::to_le_bytes));
        bytes.extend([200, 100, 50, 255, 255, 128, 128, 128]);
    }
    bytes
}

pub(crate) fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("a.splat", capture());
    sandbox.write("box.obj", box_obj(&CORNERS));
    sandbox.write("pose.obj", box_obj(&CORNERS.map(|[x, y, z]| [-y, x, z])));
    sandbox
}

fn float(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

#[test]
fn splats_turn_with_the_cage_and_stay_far_outside() {
    let sandbox = sandbox();
    let deform = "deform a.splat --cage box.obj --pose pose.obj -o turned.splat";
    sandbox
        .run(deform)
        .success()
        .stdout(contains("deformed 3,000 splats").and(contains("1 of 3,000 splats are outside the cage")));
    let (given, turned) = (capture(), sandbox.read("turned.splat"));
    for splat in 0..3000 {
        let [x, y, z] = [0, 4, 8].map(|k| float(&given, 32 * splat + k));
        let now = [0, 4, 8].map(|k| float(&turned, 32 * splat + k));
        let expected = if splat == 7 { [x, y, z] } else { [-y, x, z] };
        assert!(now.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{splat}: {now:?}");
        // A quarter turn about z, as w, x, y, z: sqrt(1/2), 0, 0, sqrt(1/2), times 128 plus 128.
        let bytes = if splat == 7 { [255, 128, 128, 128] } else { [219, 128, 128, 219] };
        assert_eq!(turned[32 * splat + 28..32 * splat + 32], bytes);
    }
    sandbox.run("deform a.splat --cage box.obj --pose box.obj -o same.splat").success();
    assert_eq!(sandbox.read("same.splat"), given);
    for format in ["ply", "spz", "glb", "obj"] {
        let done =
            sandbox.json(&format!("{} --json", deform.replace("turned.splat", &format!("turned.{format}"))));
        assert_eq!(done["outside_points"], 1);
        sandbox.run(&format!("info turned.{format}")).success().stdout(contains("3000"));
    }
    let refused = |args: &str, message: &'static str| {
        sandbox.run(args).failure().stderr(contains(message));
    };
    refused(&format!("{deform} --weights a.npz"), "is deformed without weights");
    refused(&format!("{deform} --pose box.obj"), "takes one pose as its shape, not 2 morph targets");
    refused("map a.splat --cage box.obj --pose box.obj -o b.splat", "leave their shapes");
    refused("bind a.splat --cage box.obj --weights a.npz", "a.splat: has 3,000 splats but no faces");
    refused("refit a.splat --cage box.obj --pose pose.obj -o out", "`cagework deform` moves splats");
}

/// Options for rigs and parts would be without effect on splats and points, and on a lattice.
#[test]
fn options_of_rigs_are_refused_for_splats_points_and_lattices() {
    let sandbox = sandbox();
    sandbox.write("cloud.ply", cloud());
    let all = [
        "--ground",
        "--rigid all",
        "--mask all=0.5",
        "--joints stay",
        "--feet lock",
        "--keep-travel",
        "--static",
    ];
    let cage = "--cage box.obj --pose pose.obj";
    for option in all {
        let name = option.split(' ').next().unwrap();
        for file in ["a.splat", "cloud.ply"] {
            sandbox
                .run(&format!("deform {file} {cage} {option} -o out.ply"))
                .code(1)
                .stderr(contains(format!("the option {} needs a mesh", name.trim_start_matches('-'))));
        }
        sandbox
            .run(&format!("deform box.obj {cage} {option} --lattice out.npz"))
            .code(1)
            .stderr(contains(format!("{name}: this option changes a model")));
    }
    // The model of the same run could follow these, but the lattice could not.
    for option in ["--ground", "--rigid all", "--mask all"] {
        let both = format!("deform box.obj {cage} {option} --weights w.npz -o out.obj --lattice out.npz");
        sandbox.run(&both).code(1).stderr(contains("this option changes a model"));
    }
    assert!(!sandbox.names().iter().any(|name| name.starts_with("out")));
}

/// The centres of [`capture`] that are not far outside, as a PLY without faces.
pub(crate) fn cloud() -> String {
    let capture = capture();
    let points: String = (0..3000)
        .map(|k| [0, 4, 8].map(|at| float(&capture, 32 * k + at)))
        .filter(|[x, ..]| *x < 1.0)
        .map(|[x, y, z]| format!("{x} {y} {z} 5\n"))
        .collect();
    let header = "ply\nformat ascii 1.0\nelement vertex 2999\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar intensity\nend_header\n";
    format!("{header}{points}")
}

#[test]
fn cages_of_captures_and_clouds_enclose_them() {
    let sandbox = sandbox();
    sandbox.write("cloud.ply", cloud());
    let info = sandbox.json("info a.splat --json");
    assert_eq!((&info["splats"]["degree"], &info["vertices"]), (&0.into(), &3000.into()));
    sandbox.run("info cloud.ply").success().stdout(contains("none: points"));
    for (file, outside) in [("a.splat", 1), ("cloud.ply", 0)] {
        let made = sandbox.json(&format!("cage {file} -o made.obj --json"));
        assert!(made["vertices"].as_u64().unwrap() <= 80 || file == "a.splat", "{made}");
        let done = sandbox.json(&format!("deform {file} --cage made.obj --pose made.obj -o out.ply --json"));
        assert!(done["outside_points"].as_u64().unwrap() <= outside, "{done}");
        sandbox.run("check made.obj").success();
    }
    sandbox.run("deform cloud.ply --cage box.obj --pose pose.obj -o turned.ply").success();
    sandbox.run("info turned.ply").success().stdout(contains("2999"));
}

/// Tolerance of a pull by 0.4, 1 %: its handles are springs that are 1000 times as stiff as the model.
const PULL_TOLERANCE: f32 = 4e-3;

#[test]
fn a_pulled_splat_reaches_its_target_and_a_pinned_one_stays() {
    let sandbox = sandbox();
    sandbox.write("cloud.ply", cloud());
    let capture = capture();
    let splat = |k: usize| [0, 4, 8].map(|at| float(&capture, 32 * k + at));
    // Splat 7 is far outside. The cloud lacks it, so indices from 8 on are one lower.
    for (file, n_missing) in [("a.splat", 0), ("cloud.ply", 1)] {
        let highest = |sign: f32| {
            let near = (8..3000).max_by(|&a, &b| (sign * splat(a)[1]).total_cmp(&(sign * splat(b)[1])));
            near.unwrap()
        };
        let (top, bottom) = (highest(1.0), highest(-1.0));
        let [x, y, z] = splat(top);
        let (grab, pin, to) = (top - n_missing, bottom - n_missing, y + 0.4);
        sandbox.write(
            "job.json",
            format!(
                r#"{{"grabs": [{{"vertex": {grab}, "to": [{x}, {to}, {z}]}}], "pins": [{{"vertex": {pin}}}], "reach": "all"}}"#
            ),
        );
        let pull = format!("pull {file} --cage box.obj --job job.json -o pulled.obj");
        sandbox.run(&pull).success().stdout(contains("wrote pulled.obj"));
        sandbox.run(&format!("deform {file} --cage box.obj --pose pulled.obj -o posed.obj")).success();
        let posed = crate::support::obj_positions(&sandbox.read("posed.obj"));
        for (index, expected) in [(grab, [x, to, z]), (pin, splat(bottom))] {
            let off = posed[index].iter().zip(expected).map(|(&a, b)| (a as f32 - b).abs());
            assert!(off.fold(0.0, f32::max) < PULL_TOLERANCE, "{file}: {:?}, not {expected:?}", posed[index]);
        }
        sandbox
            .run(&format!("{pull} --weights w.npz"))
            .failure()
            .stderr(contains("is pulled without weights"));
    }
    for (handle, message) in [
        (r#""vertex": 7"#, "splat or point 7 is outside the cage"),
        (r#""vertex": 3000"#, "no splat or point 3000: indices run from 0 to 2999"),
        (r#""triangle": 0"#, "splats and points have no triangles"),
        (r#""cage": 8"#, "no vertex of the cage 8: indices run from 0 to 7"),
    ] {
        sandbox.write("job.json", format!(r#"{{"grabs": [{{{handle}, "to": [0, 0, 0]}}]}}"#));
        sandbox
            .run("pull a.splat --cage box.obj --job job.json -o none.obj")
            .failure()
            .stderr(contains(message));
    }
    sandbox
        .run("fit a.splat --cage box.obj --target a.splat -o none.obj")
        .failure()
        .stderr(contains("no faces"));
    assert!(!sandbox.path("none.obj").exists());
}

#[test]
fn a_cage_around_half_of_a_capture_moves_that_half() {
    let sandbox = sandbox();
    // The lattice has a margin of a quarter of the longest side, which is 1.8.
    const MARGIN: f32 = 0.25 * 1.8;
    let half = CORNERS.map(|[x, y, z]| [0.9 * x, 0.5 + 0.5 * y, 0.9 * z]);
    let shift = [0.3, 0.2, -0.1];
    sandbox.write("half.obj", box_obj(&half));
    sandbox.write("moved.obj", box_obj(&half.map(|p| [0, 1, 2].map(|k| p[k] + f64::from(shift[k])))));
    sandbox.run("deform a.splat --cage half.obj --pose moved.obj -o moved.splat").success();
    let (given, moved) = (capture(), sandbox.read("moved.splat"));
    let mut counts = [0; 3];
    for splat in (0..3000).filter(|splat| *splat != 7) {
        let at = |of: &[u8]| [0, 4, 8].map(|k| float(of, 32 * splat + k));
        let (before, after) = (at(&given), at(&moved));
        let share = (0..3).map(|k| (after[k] - before[k]) / shift[k]);
        // A cell of the lattice is 1.8 / 64 wide, and the margin is rounded up to whole cells.
        if before[1] > 0.03 {
            assert!(share.into_iter().all(|share| (share - 1.0).abs() < 1e-4), "{before:?} {after:?}");
            counts[0] += 1;
        } else if before[1] < -MARGIN - 0.03 {
            assert_eq!(given[32 * splat..][..32], moved[32 * splat..][..32], "{before:?}");
            counts[1] += 1;
        } else {
            assert!(share.into_iter().all(|share| (-1e-3..1.001).contains(&share)), "{before:?} {after:?}");
            counts[2] += 1;
        }
    }
    // Points on a sphere are spread evenly along y (Archimedes): 0.67 / 1.4 of 3,000, and 0.22 / 1.4.
    assert!(counts[0] > 1400 && counts[1] > 450 && counts[2] > 800, "{counts:?}");
}
