//! Outputs appear whole or not at all, and destroy nothing.

use std::fs::{Permissions, hard_link, metadata, set_permissions};
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Command, Stdio};

use assert_cmd::cargo::cargo_bin;
use predicates::str::contains;
use rustix::process::{Pid, Signal, kill_process};

use crate::support::{Sandbox, sphere_obj};

/// Length of the comment that makes `mesh.obj` and what is made of it large, bytes.
const COMMENT: usize = 32 << 20;

/// Moments of a write at which the command is killed.
const MOMENTS: u64 = 10;

/// A folder whose mesh is of tens of megabytes and quickly bound, with what `out.obj` was before.
fn with_large_mesh() -> Sandbox {
    let sandbox = Sandbox::with_sphere_in_box();
    let line = format!("# {}\n", "large ".repeat(1000));
    sandbox.write("mesh.obj", line.repeat(COMMENT / line.len()) + &sphere_obj(0.7));
    sandbox.write("out.obj", "older");
    sandbox
}

/// A signal in the middle of a write left half a file in the place of the older one.
#[test]
fn command_killed_while_it_writes_leaves_the_older_file_or_the_whole_new_one_and_no_litter() {
    const ARGS: &str = "bind mesh.obj --cage cage.obj -g 8 -o out.obj";
    let sandbox = with_large_mesh();
    let before = sandbox.names();
    sandbox.run(ARGS).success();
    let whole = sandbox.read("out.obj");
    let mut killed = 0;
    for moment in 0..MOMENTS {
        sandbox.write("out.obj", "older");
        let mut child = Command::new(cargo_bin!("cagework"))
            .args(ARGS.split(' '))
            .current_dir(sandbox.path(""))
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        // The file grows in its place or under a new name.
        let grown = || {
            let sizes =
                sandbox.names().into_iter().filter(|name| name == "out.obj" || !before.contains(name));
            sizes.filter_map(|name| metadata(sandbox.path(&name)).ok()).map(|m| m.len()).find(|&n| n != 5)
        };
        let enough = whole.len() as u64 * moment / MOMENTS;
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            if grown().is_some_and(|n| n >= enough) {
                let signals =
                    [Signal::TERM, Signal::INT, Signal::HUP, Signal::USR1, Signal::QUIT, Signal::XCPU];
                let signal = signals[moment as usize % signals.len()];
                kill_process(Pid::from_child(&child), signal).unwrap();
                break child.wait().unwrap();
            }
        };
        killed += u32::from(status.signal().is_some());
        let now = sandbox.read("out.obj");
        assert!(now == b"older" || now == whole, "moment {moment}: {} of {} bytes", now.len(), whole.len());
        assert_eq!(sandbox.names(), before, "moment {moment}");
    }
    assert!(killed > 0, "no signal came before the command was done");
}

/// The process was killed by SIGXFSZ and left as much of the file as may be.
#[test]
fn file_size_limit_is_an_error_and_leaves_the_older_file() {
    let sandbox = with_large_mesh();
    let before = sandbox.names();
    let output = Command::new("sh")
        .args(["-c", "ulimit -f 1000; exec \"$0\" bind mesh.obj --cage cage.obj -g 8 -o out.obj"])
        .arg(cargo_bin!("cagework"))
        .current_dir(sandbox.path(""))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{:?}", output.status);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("out.obj: cannot be written") && said.contains("ulimit"), "{said}");
    assert_eq!(sandbox.read("out.obj"), b"older");
    assert_eq!(sandbox.names(), before);
}

#[test]
fn permissions_of_the_older_file_are_kept_and_a_new_one_gets_those_of_any_file() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("out.obj", "older");
    set_permissions(sandbox.path("out.obj"), Permissions::from_mode(0o604)).unwrap();
    sandbox.run("cage mesh.obj --kind box -o out.obj").success();
    sandbox.run("cage mesh.obj --kind box -o new.obj").success();
    let mode = |name| metadata(sandbox.path(name)).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode("out.obj"), 0o604);
    // Made by the test, with the same umask.
    assert_eq!(mode("new.obj"), mode("mesh.obj"));
}

#[test]
fn symbolic_link_stays_and_its_target_is_written() {
    let sandbox = Sandbox::with_sphere_in_box();
    std::fs::create_dir(sandbox.path("elsewhere")).unwrap();
    sandbox.write("elsewhere/old.obj", "older");
    for (link, target) in [("old-link.obj", "elsewhere/old.obj"), ("new-link.obj", "elsewhere/new.obj")] {
        symlink(target, sandbox.path(link)).unwrap();
        sandbox.run(&format!("cage mesh.obj --kind box -o {link}")).success();
        assert_eq!(std::fs::read_link(sandbox.path(link)).unwrap().to_str(), Some(target));
        assert!(sandbox.read(target).starts_with(b"v "), "{target}");
    }
    symlink("circle.obj", sandbox.path("circle.obj")).unwrap();
    sandbox.run("cage mesh.obj --kind box -o circle.obj").code(1).stderr(contains("circle"));
}

#[test]
fn devices_and_stdout_are_written_to_and_stay() {
    let sandbox = Sandbox::with_sphere_in_box();
    symlink("/dev/null", sandbox.path("null.obj")).unwrap();
    sandbox.run("bind mesh.obj --cage cage.obj -g 8 --report /dev/null -o null.obj").success();
    assert!(!metadata("/dev/null").unwrap().is_file());
    sandbox
        .run("bind mesh.obj --cage cage.obj -g 8 --report /dev/stdout")
        .success()
        .stdout(contains("\"grid\": 8"));
    // A file as stdout: what holds it open must find the report in it.
    let file = std::fs::File::create(sandbox.path("stdout.txt")).unwrap();
    let status = Command::new(cargo_bin!("cagework"))
        .args("bind mesh.obj --cage cage.obj -g 8 --report /dev/stdout --save-cage c.obj".split(' '))
        .current_dir(sandbox.path(""))
        .stdout(file.try_clone().unwrap())
        .status()
        .unwrap();
    assert!(status.success());
    assert!(file.metadata().unwrap().len() > 0, "the report went to another file of that name");
}

/// A report to a descriptor opened the file again: it overwrote an input, and cut off what a log already had.
#[test]
fn descriptors_are_written_to_where_they_are_and_are_no_inputs() {
    let sandbox = Sandbox::with_sphere_in_box();
    let run = |shell: &str| {
        let mut sh = Command::new("sh");
        sh.args(["-c", shell]).arg(cargo_bin!("cagework")).current_dir(sandbox.path("")).output().unwrap()
    };
    let bind = "\"$0\" bind mesh.obj --cage cage.obj -g 8 --weights w.npz";
    let mesh = sandbox.read("mesh.obj");
    symlink("/dev/fd/3", sandbox.path("link.json")).unwrap();
    for report in ["/dev/fd/3", "/proc/self/fd/3", "link.json"] {
        let output = run(&format!("{bind} --report {report} 3<>mesh.obj"));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("is an input and would be overwritten"), "{report}: {said}");
        assert_eq!(sandbox.read("mesh.obj"), mesh, "{report}");
    }
    for (name, shell) in [
        ("fd.log", format!("exec 3>fd.log; echo before >&3; {bind} --report /dev/fd/3; echo after >&3")),
        (
            "out.log",
            format!("echo before >out.log; {bind} --report /dev/stdout >>out.log; echo after >>out.log"),
        ),
    ] {
        assert!(run(&shell).status.success(), "{shell}");
        let log = String::from_utf8(sandbox.read(name)).unwrap();
        assert!(
            log.starts_with("before\n") && log.ends_with("after\n") && log.contains("\"grid\": 8"),
            "{log}"
        );
    }
}

/// What a killed command leaves is removed by the next one; what a running one writes is not.
#[test]
fn litter_of_killed_commands_is_removed() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write(".cagework-dead00.part", "half a file");
    sandbox.write(".cagework-alive0.part", "half a file");
    let alive = std::fs::File::open(sandbox.path(".cagework-alive0.part")).unwrap();
    alive.lock().unwrap();
    sandbox.run("cage mesh.obj --kind box -o out.obj").success();
    assert_eq!(sandbox.names(), [".cagework-alive0.part", "cage.obj", "mesh.obj", "out.obj"]);
}

/// Only names were compared: a hard link was overwritten, and with it the input.
#[test]
fn output_is_no_input_and_no_other_output_under_another_name() {
    let sandbox = Sandbox::with_sphere_in_box();
    hard_link(sandbox.path("mesh.obj"), sandbox.path("hard.obj")).unwrap();
    symlink("mesh.obj", sandbox.path("soft.obj")).unwrap();
    sandbox.write("a.obj", "older");
    hard_link(sandbox.path("a.obj"), sandbox.path("b.obj")).unwrap();
    symlink("missing.obj", sandbox.path("c.obj")).unwrap();
    for (args, said) in [
        ("cage mesh.obj -o hard.obj", "hard.obj: is an input"),
        ("cage mesh.obj -o soft.obj", "soft.obj: is an input"),
        ("bind mesh.obj --cage cage.obj -g 8 --report hard.obj", "hard.obj: is an input"),
        ("check cage.obj --mesh mesh.obj --repair weld -o hard.obj", "hard.obj: is an input"),
        ("bind mesh.obj --cage cage.obj -g 8 -o a.obj --save-cage b.obj", "b.obj: is named for two outputs"),
        ("bind mesh.obj --cage cage.obj -g 8 -o c.obj --save-cage missing.obj", "named for two outputs"),
    ] {
        sandbox.run(args).code(1).stderr(contains(said));
    }
    assert!(sandbox.read("mesh.obj").starts_with(b"v "));
    assert_eq!(sandbox.read("a.obj"), b"older");
}

/// Files that a model names were overwritten by an output of the same name, and the model was lost with them.
#[test]
fn output_is_no_file_that_an_input_names() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("mesh.obj", format!("mtllib look.mtl\n{}", sphere_obj(0.7)));
    sandbox.write("look.mtl", "newmtl skin\nmap_Kd skin.obj\n");
    sandbox.write("skin.obj", "a texture, whatever its name");
    let triangle: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.5, 0.0].into_iter().flat_map(f32::to_le_bytes).collect();
    sandbox.write("buffer.obj", &triangle);
    sandbox.write(
        "triangle.gltf",
        r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"buffer.obj","byteLength":36}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[0.5,0.5,0]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0}"#,
    );
    hard_link(sandbox.path("look.mtl"), sandbox.path("hard.obj")).unwrap();
    std::fs::create_dir(sandbox.path("out")).unwrap();
    let before = sandbox.names();
    for (args, output) in [
        ("bind mesh.obj --cage cage.obj -g 8 --weights w.npz --report look.mtl", "look.mtl"),
        ("bind mesh.obj --cage cage.obj -g 8 --weights w.npz -o hard.obj", "hard.obj"),
        ("bind mesh.obj --cage cage.obj -g 8 --weights w.npz --save-cage skin.obj", "skin.obj"),
        ("bind triangle.gltf --cage cage.obj -g 8 --weights w.npz --report buffer.obj", "buffer.obj"),
        ("cage triangle.gltf --kind box -o buffer.obj", "buffer.obj"),
        ("check cage.obj --mesh mesh.obj --repair weld -o skin.obj", "skin.obj"),
    ] {
        sandbox.run(args).code(1).stderr(contains(format!("{output}: is an input")));
        // Found before the first output was written.
        assert_eq!(sandbox.names(), before, "{args}");
    }
    assert_eq!(sandbox.read("buffer.obj"), triangle);
    assert_eq!(sandbox.read("skin.obj"), b"a texture, whatever its name");
}
