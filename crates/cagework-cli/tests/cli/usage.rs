use predicates::prelude::*;
use predicates::str::contains;

use crate::support::Sandbox;

#[test]
fn version_and_help_succeed() {
    let sandbox = Sandbox::new();
    sandbox.run("--version").success().stdout(contains(env!("CARGO_PKG_VERSION")));
    for command in ["", "info", "bind", "deform", "refit", "transfer", "cage", "demo"] {
        sandbox
            .run(&format!("{command} --help"))
            .success()
            .stdout(contains("Example").and(contains("cagework ")));
    }
}

#[test]
fn errors_are_json_objects_on_request() {
    let sandbox = Sandbox::new();
    let ran = sandbox.run("info nothing.glb --json").code(1).stdout("");
    let error: serde_json::Value = serde_json::from_slice(&ran.get_output().stderr).unwrap();
    assert!(error["error"].as_str().unwrap().contains("nothing.glb"), "{error}");
    assert!(error["hint"].is_null(), "{error}");
}

#[test]
fn completions_and_manual_pages_are_written() {
    let sandbox = Sandbox::new();
    sandbox.run("shell-files out").success();
    let out = sandbox.path("out");
    let bash = std::fs::read_to_string(out.join("completions/cagework.bash")).unwrap();
    assert!(bash.contains("--outside") && bash.contains("proportions"));
    for name in ["completions/_cagework", "completions/cagework.fish", "completions/_cagework.ps1"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let page = std::fs::read_to_string(out.join("man/cagework-deform.1")).unwrap();
    assert!(page.starts_with(".") && page.contains("cage"), "{page}");
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
        ("fit", false),
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
fn a_format_that_is_only_read_is_refused_as_an_output() {
    let sandbox = Sandbox::with_sphere_in_box();
    let message = "this format is read, but not written: the name must end in .glb or .obj or .ply";
    sandbox.run("deform mesh.obj --cage cage.obj --pose cage.obj -o x.sog").code(2).stderr(contains(message));
}

/// The message names the option of the command, not that of the library.
#[test]
fn number_out_of_range_is_refused_with_the_range() {
    let sandbox = Sandbox::with_sphere_in_box();
    for (args, message) in [
        (
            "cage mesh.obj --vertices 500 -o c.obj",
            "invalid value '500' for '--vertices <N>': it must be a whole number from 8 to 400",
        ),
        (
            "bind mesh.obj --cage cage.obj --sparsify 0.1",
            "invalid value '0.1' for '--sparsify <WEIGHT>': it must be 0 (keep all weights) or a threshold below 0.1",
        ),
        (
            "bind mesh.obj --cage auto:500",
            "invalid value 'auto:500' for '--cage <CAGE>': VERTICES must be a whole number from 8 to 400",
        ),
    ] {
        sandbox.run(args).code(2).stderr(contains(message));
    }
}

/// Options that `refit` refuses are not in its help.
#[test]
fn help_of_refit_does_not_offer_the_gpu() {
    let help = Sandbox::new().run("refit --help").success();
    help.stdout(contains("--backend").not().and(contains("several poses").not()).and(contains("--static")));
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
    ] {
        sandbox.run(args).code(2).stdout("").stderr(contains("Usage").or(contains("--help")));
    }
}
