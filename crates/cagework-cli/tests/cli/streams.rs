//! Standard input and output as files, and `--quiet`.

use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::{contains, is_empty};

use crate::support::{CORNERS, Sandbox, box_obj};

#[test]
fn models_pass_through_standard_input_and_output() {
    let sandbox = Sandbox::with_sphere_in_box();
    let mesh = sandbox.read("mesh.obj");
    for [files, streams] in [
        ["cage mesh.obj --vertices 20 -o a.ply", "cage - --format obj --vertices 20 -o b.ply"],
        [
            "bind mesh.obj --cage cage.obj --grid 16 --weights a.npz",
            "bind - --cage cage.obj --grid 16 --format obj --weights b.npz",
        ],
        [
            "deform mesh.obj --cage cage.obj --weights a.npz --pose cage.obj -o a.obj",
            "deform - --cage cage.obj --weights a.npz --pose cage.obj --format=obj -o b.obj",
        ],
    ] {
        sandbox.run(files).success();
        sandbox.command(streams).write_stdin(mesh.clone()).assert().success();
        let [expected, written] = [files, streams].map(|args| sandbox.read(args.rsplit(' ').next().unwrap()));
        assert!(expected == written, "{streams}");
    }
    let to_stdout = sandbox.run("cage mesh.obj --vertices 20 -o - --format ply").success();
    let output = to_stdout.get_output();
    assert!(output.stdout == sandbox.read("a.ply"), "the report is not among the bytes");
    assert!(String::from_utf8_lossy(&output.stderr).contains("vertices"), "the report is on stderr");
    let weights = sandbox.run("bind mesh.obj --cage cage.obj --grid 16 --weights - --json").success();
    assert!(weights.get_output().stdout == sandbox.read("a.npz"));
    sandbox
        .command("info -")
        .write_stdin(sandbox.read("a.ply"))
        .assert()
        .success()
        .stdout(contains("18 unique positions"));
}

#[test]
fn misuse_of_streams_is_explained() {
    let sandbox = Sandbox::with_sphere_in_box();
    let mesh = sandbox.read("mesh.obj");
    let fails = |args: &str, says: &str| {
        sandbox.command(args).write_stdin(mesh.clone()).assert().failure().stderr(contains(says));
    };
    fails("cage mesh.obj -o -", "standard output needs a format, such as --format obj");
    fails("info - --format doc", "not the extension of a model's format");
    fails("bind - --format obj --cage -", "standard input can only be read once");
    fails(
        "bind mesh.obj --cage cage.obj --grid 16 -o - --weights - --format ply",
        "is given for two outputs",
    );
    fails("refit - --cage cage.obj --pose cage.obj -o out", "not standard input and output");
    sandbox.run("info - --format obj").failure().stderr(contains("-: standard input is empty"));
}

#[test]
fn quiet_leaves_out_notes_only() {
    let sandbox = Sandbox::with_sphere_in_box();
    // The reflected cage is inside out.
    sandbox.write("cage.obj", box_obj(&CORNERS.map(|[x, y, z]| [-x, y, z])));
    let bind = "bind mesh.obj --cage cage.obj -g 8";
    sandbox.run(bind).success().stdout(contains("note: "));
    let quiet = sandbox.run(&format!("{bind} --quiet")).success();
    quiet.stdout(contains("note: ").not().and(contains("vertices")));
    sandbox.run("info missing.obj -q").failure().stdout(is_empty()).stderr(contains("there is no such file"));
}
