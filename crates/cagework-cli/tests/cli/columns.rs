//! One bind in parts, put together.

use predicates::str::contains;

use crate::rigs;
use crate::support::Sandbox;

#[test]
fn parts_put_together_are_the_whole_bind_to_the_byte() {
    // With points of the rig, small weights dropped, a smooth cage and a control inside.
    let sandbox = rigs::bound();
    sandbox.write("inside.obj", "v 0 1.2 0\np 1\n");
    let bind = "bind humanoid.glb --cage cage.obj -g 24 --sparsify 1e-3 --smooth 1 --controls inside.obj --radius 0.05";
    let whole = sandbox.json(&format!("{bind} --weights whole.npz --json"));
    let n = whole["cage_vertices"].as_u64().unwrap() + 1;
    for (k, columns) in
        [format!("0:{}", n / 3), format!("{}:{n}", n / 2), format!("{}:{}", n / 3, n / 2)].iter().enumerate()
    {
        sandbox
            .run(&format!("{bind} --columns {columns} --threads {} --weights {k}.npz", 1 + k % 2))
            .success()
            .stdout(contains(format!("to columns {columns} of {n} in ")));
    }
    sandbox.run("merge 0.npz 1.npz 2.npz -o merged.npz").success().stdout(contains("merged 3 parts\nbound "));
    assert!(sandbox.read("merged.npz") == sandbox.read("whole.npz"));
    let report = sandbox.json("merge 2.npz 0.npz 1.npz -o again.npz --json");
    assert!(sandbox.read("again.npz") == sandbox.read("whole.npz"));
    for key in ["iterations", "rest_error", "weights", "vertices", "outside_vertices", "cage_vertices"] {
        assert_eq!(report[key], whole[key], "{key}");
    }
}

#[test]
fn parts_that_are_no_whole_are_refused() {
    let sandbox = Sandbox::with_sphere_in_box();
    let part = |columns: &str, name: &str, more: &str| {
        sandbox.run(&format!(
            "bind mesh.obj --cage cage.obj -g 8 --columns {columns} --weights {name}.npz {more}"
        ))
    };
    part("0:3", "a", "").success();
    part("3:8", "b", "").success();
    part("2:8", "overlap", "").success();
    part("3:8", "finer", "--tau 1e-6").success();
    let merge = |parts: &str, said: &str| {
        sandbox.run(&format!("merge {parts} -o w.npz")).code(1).stdout("").stderr(contains(said.to_owned()));
    };
    merge("b.npz", "columns 0:3 are in no part: bind them with `--columns 0:3`");
    merge("a.npz overlap.npz", "overlap.npz: column 2 is in another part already");
    merge("a.npz a.npz", "a.npz: column 0 is in another part already");
    merge("a.npz finer.npz", "finer.npz: is a part of another bind than a.npz: its set of options differs");
    sandbox.run("bind mesh.obj --cage cage.obj -g 8 --weights whole.npz").success();
    merge("a.npz whole.npz", "whole.npz: is no part of a bind");
    sandbox
        .run("deform mesh.obj --cage cage.obj --weights a.npz --pose cage.obj -o out.obj")
        .code(1)
        .stderr(contains("a.npz: holds some columns of the weights only"));
    part("0:3", "c", "--solver jacobi")
        .code(1)
        .stderr(contains("Jacobi's method, whose stop rule looks at all"));
    part("0:3", "c", "--backend gpu").code(1).stderr(contains("on the processor only"));
    part("4:9", "c", "").code(1).stderr(contains("columns 4:9 are no range of the 8 controls"));
    assert!(!sandbox.path("w.npz").exists() && !sandbox.path("c.npz").exists());
}
