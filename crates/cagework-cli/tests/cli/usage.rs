use predicates::prelude::*;
use predicates::str::contains;

use crate::support::Sandbox;

#[test]
fn version_and_help_succeed() {
    let sandbox = Sandbox::new();
    sandbox.run("--version").success().stdout(contains(env!("CARGO_PKG_VERSION")));
    for command in ["", "info", "bind", "deform", "refit", "transfer", "cage", "bench", "demo"] {
        sandbox
            .run(&format!("{command} --help"))
            .success()
            .stdout(contains("Example").and(contains("cagework ")));
    }
}

/// Commands that need faces do not list the formats that only have splats.
#[test]
fn help_lists_the_formats_that_a_command_takes() {
    let sandbox = Sandbox::new();
    for (command, takes_splats) in [
        ("bind", false),
        ("refit", false),
        ("transfer", false),
        ("check", false),
        ("bench", false),
        ("deform", true),
        ("pull", true),
        ("info", true),
        ("cage", true),
        ("render", true),
    ] {
        let splats = contains(".splat, .spz");
        let help = sandbox.run(&format!("{command} --help")).success().stdout(contains(".stl"));
        if takes_splats {
            help.stdout(splats)
        } else {
            help.stdout(splats.not())
        };
    }
}

#[test]
fn invalid_command_line_exits_with_2() {
    let sandbox = Sandbox::with_sphere_in_box();
    for args in [
        "",
        "frobnicate",
        "info",
        "bind mesh.obj",
        "bind mesh.obj --cage cage.obj -g 7",
        "bind mesh.obj --cage cage.obj -g 513",
        "bind mesh.obj --cage cage.obj -g many",
        "bind mesh.obj --cage cage.obj --method quick",
        "bind mesh.obj --cage cage.obj --tau 0",
        "bind mesh.obj --cage cage.obj --tau NaN",
        "bind mesh.obj --cage cage.obj --sparsify 1",
        "bind mesh.obj --cage cage.obj --max-iterations 0",
        "bind mesh.obj --cage cage.obj --threads -1",
        "bind mesh.obj --cage box:0",
        "bind mesh.obj --cage box:many",
        "bind mesh.obj --cage cage.obj -o out.fbx",
        "bind mesh.obj --cage cage.obj --weights out.txt",
        "deform mesh.obj --cage cage.obj --weights w.npz -o out.glb",
        "cage mesh.obj -o cage2.fbx",
        "refit --cage cage.obj --pose cage.obj -o out",
        "bench mesh.obj",
    ] {
        sandbox.run(args).code(2).stdout("").stderr(contains("Usage").or(contains("--help")));
    }
}
