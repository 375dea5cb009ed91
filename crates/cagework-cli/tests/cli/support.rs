//! Folders of generated files in which the tests run the command.

use std::fmt::Write as _;
use std::path::PathBuf;

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;
use tempfile::TempDir;

/// Corners of a box cage from -1 to 1. x varies fastest, then y, then z.
pub(crate) const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [1.0, 1.0, 1.0],
];

/// Faces of the box with these corners, counter-clockwise seen from outside, numbered from 1 as in OBJ.
const QUADS: &str = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

/// A temporary folder, which is deleted on drop.
pub(crate) struct Sandbox {
    folder: TempDir,
}

impl Sandbox {
    /// Creates an empty folder.
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// Creates a folder with a sphere, `mesh.obj`, and a box around it, `cage.obj`.
    pub(crate) fn with_sphere_in_box() -> Self {
        let sandbox = Self::new();
        sandbox.write("mesh.obj", sphere_obj(0.7));
        sandbox.write("cage.obj", box_obj(&CORNERS));
        sandbox
    }

    /// The path of a file in the folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file into the folder.
    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    /// Reads a file of the folder.
    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    /// Names of all files and folders in the folder, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// The command `cagework` with the folder as its working directory, not yet started. `args` are separated by
    /// whitespace.
    pub(crate) fn command(&self, args: &str) -> Command {
        let mut command = cargo_bin_cmd!("cagework");
        command.current_dir(self.folder.path()).args(args.split_whitespace());
        command
    }

    /// Runs `cagework` in the folder until it ends. `args` are separated by whitespace.
    pub(crate) fn run(&self, args: &str) -> Assert {
        self.command(args).assert()
    }

    /// Runs `cagework`, asserts success, and parses its stdout as JSON.
    pub(crate) fn json(&self, args: &str) -> Value {
        let output = self.run(args).success().get_output().stdout.clone();
        serde_json::from_slice(&output).unwrap()
    }
}

/// A sphere of quads, with triangles at both poles, as OBJ.
pub(crate) fn sphere_obj(radius: f64) -> String {
    const RINGS: usize = 12;
    const SEGMENTS: usize = 16;
    let mut text = String::new();
    for ring in 1..RINGS {
        let (sin_t, cos_t) = (std::f64::consts::PI * ring as f64 / RINGS as f64).sin_cos();
        for segment in 0..SEGMENTS {
            let (sin_p, cos_p) = (std::f64::consts::TAU * segment as f64 / SEGMENTS as f64).sin_cos();
            let p = [sin_t * cos_p, cos_t, -sin_t * sin_p].map(|x| radius * x);
            writeln!(text, "v {} {} {}", p[0], p[1], p[2]).unwrap();
        }
    }
    let (top, bottom) = ((RINGS - 1) * SEGMENTS + 1, (RINGS - 1) * SEGMENTS + 2);
    writeln!(text, "v 0 {radius} 0\nv 0 -{radius} 0").unwrap();
    let vertex = |ring: usize, segment: usize| (ring - 1) * SEGMENTS + segment % SEGMENTS + 1;
    for s in 0..SEGMENTS {
        writeln!(text, "f {top} {} {}", vertex(1, s), vertex(1, s + 1)).unwrap();
        writeln!(text, "f {bottom} {} {}", vertex(RINGS - 1, s + 1), vertex(RINGS - 1, s)).unwrap();
        for r in 1..RINGS - 1 {
            let quad = [vertex(r, s), vertex(r + 1, s), vertex(r + 1, s + 1), vertex(r, s + 1)];
            writeln!(text, "f {} {} {} {}", quad[0], quad[1], quad[2], quad[3]).unwrap();
        }
    }
    text
}

/// A box with these corners, in the order of [`CORNERS`], as OBJ.
pub(crate) fn box_obj(corners: &[[f64; 3]; 8]) -> String {
    let vertices = corners.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
    vertices + QUADS
}

/// Positions in the `v` lines of an OBJ file.
pub(crate) fn obj_positions(bytes: &[u8]) -> Vec<[f64; 3]> {
    std::str::from_utf8(bytes)
        .unwrap()
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| {
            let numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
            [numbers[0], numbers[1], numbers[2]]
        })
        .collect()
}

/// The JSON chunk of a GLB file.
pub(crate) fn glb_json(bytes: &[u8]) -> Value {
    assert_eq!(&bytes[..4], b"glTF");
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

/// Asserts that corresponding coordinates differ by at most `tolerance`.
pub(crate) fn assert_close(actual: &[[f64; 3]], expected: &[[f64; 3]], tolerance: f64) {
    assert_eq!(actual.len(), expected.len());
    for (v, (a, e)) in actual.iter().zip(expected).enumerate() {
        for axis in 0..3 {
            let distance = (a[axis] - e[axis]).abs();
            assert!(distance <= tolerance, "vertex {v}: {a:?} instead of {e:?}, off by {distance:e}");
        }
    }
}
