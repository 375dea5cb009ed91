//! Tests that outputs are written atomically and overwrite no input.

use std::fs::{Permissions, hard_link, metadata, set_permissions};
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Command, Stdio};

use assert_cmd::cargo::cargo_bin;
use predicates::str::contains;
use rustix::process::{Pid, Signal, kill_process};

use crate::support::{Sandbox, sphere_obj};

/// Length of the comment in `mesh.obj`, bytes. `-o out.obj` copies the comment, so writing takes long enough to be
/// interrupted.
const COMMENT: usize = 32 << 20;

/// Number of runs that are killed. Run k is killed when the output has reached k / `N_KILLS` of its length.
const N_KILLS: u64 = 10;

/// A folder with a 32 MiB mesh that can be bound quickly, and an older `out.obj`.
fn with_large_mesh() -> Sandbox {
    let sandbox = Sandbox::with_sphere_in_box();
    let line = format!("# {}\n", "large ".repeat(1000));
    sandbox.write("mesh.obj", line.repeat(COMMENT / line.len()) + &sphere_obj(0.7));
    sandbox.write("out.obj", "older");
    sandbox
}

#[test]
fn killed_command_leaves_the_old_or_the_complete_new_file_and_no_temporary_file() {
    const ARGS: &str = "bind mesh.obj --cage cage.obj -g 8 -o out.obj";
    let sandbox = with_large_mesh();
    let before = sandbox.names();
    sandbox.run(ARGS).success();
    let whole = sandbox.read("out.obj");
    let mut killed = 0;
    for moment in 0..N_KILLS {
        sandbox.write("out.obj", "older");
        let mut child = Command::new(cargo_bin!("cagework"))
            .args(ARGS.split(' '))
            .current_dir(sandbox.path(""))
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        // Size of `out.obj` or of a new temporary file, ignoring the size 5 of the old content "older".
        let written = || {
            let sizes =
                sandbox.names().into_iter().filter(|name| name == "out.obj" || !before.contains(name));
            sizes.filter_map(|name| metadata(sandbox.path(&name)).ok()).map(|m| m.len()).find(|&n| n != 5)
        };
        let enough = whole.len() as u64 * moment / N_KILLS;
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            if written().is_some_and(|n| n >= enough) {
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
    assert!(killed > 0, "the command always ended before the signal");
}

#[test]
fn file_size_limit_is_an_error_and_keeps_the_older_file() {
    let sandbox = with_large_mesh();
    let before = sandbox.names();
    let output = Command::new("sh")
        .args(["-c", "ulimit -f 1000; exec \"$0\" bind mesh.obj --cage cage.obj -g 8 -o out.obj"])
        .arg(cargo_bin!("cagework"))
        .current_dir(sandbox.path(""))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{:?}", output.status);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("out.obj: cannot be written") && message.contains("ulimit"), "{message}");
    assert_eq!(sandbox.read("out.obj"), b"older");
    assert_eq!(sandbox.names(), before);
}

#[test]
fn replaced_file_keeps_its_permissions_and_a_new_one_gets_the_default() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("out.obj", "older");
    set_permissions(sandbox.path("out.obj"), Permissions::from_mode(0o604)).unwrap();
    sandbox.run("cage mesh.obj --kind box -o out.obj").success();
    sandbox.run("cage mesh.obj --kind box -o new.obj").success();
    let mode = |name| metadata(sandbox.path(name)).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode("out.obj"), 0o604);
    // This test created mesh.obj with the same umask.
    assert_eq!(mode("new.obj"), mode("mesh.obj"));
}

#[test]
fn symbolic_link_is_kept_and_its_target_is_written() {
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
    sandbox
        .run("cage mesh.obj --kind box -o circle.obj")
        .code(1)
        .stderr(contains("symbolic links form a circle"));
}

#[test]
fn devices_and_stdout_are_written_to_and_not_replaced() {
    let sandbox = Sandbox::with_sphere_in_box();
    symlink("/dev/null", sandbox.path("null.obj")).unwrap();
    sandbox.run("bind mesh.obj --cage cage.obj -g 8 --report /dev/null -o null.obj").success();
    assert!(!metadata("/dev/null").unwrap().is_file());
    sandbox
        .run("bind mesh.obj --cage cage.obj -g 8 --report /dev/stdout")
        .success()
        .stdout(contains("\"grid\": 8"));
    // If stdout is a file, the report must go to that open file, not to a new file of the same name.
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

#[test]
fn open_descriptors_are_appended_to_unless_they_are_inputs() {
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
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains("is an input and would be overwritten"), "{report}: {message}");
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

/// Temporary files of killed commands are deleted. The file of a running command is locked, so it is kept.
#[test]
fn temporary_files_of_killed_commands_are_removed() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write(".cagework-dead00.part", "half a file");
    sandbox.write(".cagework-alive0.part", "half a file");
    let alive = std::fs::File::open(sandbox.path(".cagework-alive0.part")).unwrap();
    alive.lock().unwrap();
    sandbox.run("cage mesh.obj --kind box -o out.obj").success();
    assert_eq!(sandbox.names(), [".cagework-alive0.part", "cage.obj", "mesh.obj", "out.obj"]);
}

#[test]
fn outputs_that_are_links_to_inputs_or_outputs_are_rejected() {
    let sandbox = Sandbox::with_sphere_in_box();
    hard_link(sandbox.path("mesh.obj"), sandbox.path("hard.obj")).unwrap();
    symlink("mesh.obj", sandbox.path("soft.obj")).unwrap();
    sandbox.write("a.obj", "older");
    hard_link(sandbox.path("a.obj"), sandbox.path("b.obj")).unwrap();
    symlink("missing.obj", sandbox.path("c.obj")).unwrap();
    for (args, message) in [
        ("cage mesh.obj -o hard.obj", "hard.obj: is an input"),
        ("cage mesh.obj -o soft.obj", "soft.obj: is an input"),
        ("bind mesh.obj --cage cage.obj -g 8 --report hard.obj", "hard.obj: is an input"),
        ("check cage.obj --mesh mesh.obj --repair weld -o hard.obj", "hard.obj: is an input"),
        ("bind mesh.obj --cage cage.obj -g 8 -o a.obj --save-cage b.obj", "b.obj: is given for two outputs"),
        ("bind mesh.obj --cage cage.obj -g 8 -o c.obj --save-cage missing.obj", "given for two outputs"),
    ] {
        sandbox.run(args).code(1).stderr(contains(message));
    }
    assert!(sandbox.read("mesh.obj").starts_with(b"v "));
    assert_eq!(sandbox.read("a.obj"), b"older");
}

#[test]
fn outputs_that_an_input_refers_to_are_rejected() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("mesh.obj", format!("mtllib look.mtl\n{}", sphere_obj(0.7)));
    sandbox.write("look.mtl", "newmtl skin\nmap_Kd skin.obj\n");
    sandbox.write("skin.obj", "a texture");
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
        // The command fails before it writes the first output.
        assert_eq!(sandbox.names(), before, "{args}");
    }
    assert_eq!(sandbox.read("buffer.obj"), triangle);
    assert_eq!(sandbox.read("skin.obj"), b"a texture");
}
