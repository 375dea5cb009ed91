//! `cagework demo`: binds and deforms the built-in sample, and writes every kind of file that this produces.

use std::path::{Path, PathBuf};
use std::time::Instant;

use cagework_core::options::BindOptions;
use cagework_core::{BindReport, PolygonMesh};
use cagework_io::{Model, write_cage_obj, write_weights_npz};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::DemoArgs;
use crate::bind::{bind_model, deform};
use crate::card;
use crate::error::CliError;
use crate::files::{json, make_folder, print, shown_path, write};
use crate::load::{BuiltInSample, built_in};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct DemoSummary<'a> {
    folder: String,
    files: Vec<String>,
    total_ms: f64,
    report: &'a BindReport,
}

/// Runs `cagework demo`.
///
/// # Errors
/// If the folder cannot be written to or the bind is cancelled.
pub(crate) fn run(args: &DemoArgs, as_json: bool) -> Result<(), CliError> {
    let started = Instant::now();
    let folder = args.output.as_path();
    make_folder(folder)?;
    let mut files = Files { folder, written: Vec::new() };

    let BuiltInSample { name: sample, mesh, model, cage, poses: cage_poses } = built_in()?;
    let binding = bind_model(&model, &cage, &BindOptions::default())?;

    files.write(&format!("{sample}.obj"), &write_cage_obj(&mesh, DVec3::ZERO))?;
    files.write("cage.obj", &write_cage_obj(&cage.to_polygon_mesh(), DVec3::ZERO))?;
    files.write(
        "weights.npz",
        &write_weights_npz(&binding.weights, &binding.frames, &binding.outside, &[], &[]),
    )?;
    files.write("report.json", json(&binding.report).as_bytes())?;
    files.write_glb("rest.glb", &model, &deform(&binding, cage.positions()))?;
    let mut poses = Vec::new();
    let mut posed_cage = None;
    for (name, posed) in cage_poses {
        let deformed = deform(&binding, &posed);
        let stem = file_stem(&name);
        files.write_glb(&format!("{stem}.glb"), &model, &deformed)?;
        let cage = PolygonMesh { positions: posed, ..cage.to_polygon_mesh() };
        let file = format!("{stem}-cage.obj");
        files.write(&file, &write_cage_obj(&cage, DVec3::ZERO))?;
        posed_cage.get_or_insert(file);
        poses.push((name, deformed));
    }
    let animated = model.write_glb_poses(&model.positions, &poses).map_err(|e| CliError::file(folder, e))?;
    files.write("poses.glb", &animated)?;

    let total_ms = started.elapsed().as_secs_f64() * 1e3;
    if as_json {
        let written = files.written.iter().map(|path| path.display().to_string()).collect();
        let folder = folder.display().to_string();
        return print(&json(&DemoSummary { folder, files: written, total_ms, report: &binding.report }));
    }
    let posed_cage = posed_cage.unwrap_or_else(|| "cage.obj".to_owned());
    print(&text(folder, &sample, &posed_cage, &binding.report, &files.written, total_ms))
}

/// Returns the file name of a pose: its name as lower-case words joined by hyphens.
fn file_stem(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("-")
}

/// Writer of files into one folder, which records their paths.
struct Files<'a> {
    folder: &'a Path,
    written: Vec<PathBuf>,
}

impl Files<'_> {
    fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), CliError> {
        let path = self.folder.join(name);
        write(&path, bytes)?;
        self.written.push(path);
        Ok(())
    }

    fn write_glb(&mut self, name: &str, model: &Model, positions: &[Vec3]) -> Result<(), CliError> {
        let bytes = model.write_glb(positions).map_err(|e| CliError::file(&self.folder.join(name), e))?;
        self.write(name, &bytes)
    }
}

/// Name or path by which the running command was called.
fn command() -> String {
    std::env::args_os().next().map_or_else(|| "cagework".to_owned(), |path| shown_path(Path::new(&path)))
}

fn text(
    folder: &Path,
    sample: &str,
    posed_cage: &str,
    report: &BindReport,
    written: &[PathBuf],
    total_ms: f64,
) -> String {
    let at = |name: &str| folder.join(name).display().to_string();
    format!(
        "Cagework generated a {sample} of {} vertices with a cage of {} vertices, bound it by \
         harmonic coordinates in {}, and posed the cage. Total time: {}.\n\n\
         {}\n\
         {} shows all poses as an animation. Next, edit a pose in a 3-D program (keep its vertices) and apply it:\n  \
         {} deform {} --cage {} --weights {} --pose {} -o {}",
        report.vertices,
        report.cage_vertices,
        card::duration(report.timings_ms.total),
        card::duration(total_ms),
        card::of(report, &[], written),
        at("poses.glb"),
        command(),
        at(&format!("{sample}.obj")),
        at("cage.obj"),
        at("weights.npz"),
        at(posed_cage),
        at("mine.glb"),
    )
}
