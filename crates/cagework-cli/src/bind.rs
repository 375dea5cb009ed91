//! `cagework bind`: computes the weights of a mesh in a cage, a report, and the reconstructed rest pose.

use std::path::{Path, PathBuf};

use cagework_core::bind::{Binding, weights_bytes};
use cagework_core::deform::deform_bound;
use cagework_core::field::Field;
use cagework_core::options::BindOptions;
use cagework_core::{Cage, Controls, bind};
use cagework_gpu::bind_on;
use cagework_io::{Model, ModelFormat, ReshapeOptions, write_weights_npz};
use cagework_job::{BoundPoints, Follow, Job, JobError, Poses, require_memory};
use cagework_pose::parts::Parts;
use glam::{DVec3, Vec3};

use crate::args::{BindArgs, CageSource, ModelOutput};
use crate::card;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, refuse_files_read, write};
use crate::gpu;
use crate::load::{load_cage, load_model};
use crate::progress::Bar;

/// Runs `cagework bind`.
///
/// # Errors
/// If a file cannot be read or written, the cage is invalid, or the bind fails or is cancelled.
pub(crate) fn run(args: &BindArgs, as_json: bool) -> Result<(), CliError> {
    let report_file = args.report.as_deref().filter(|path| *path != Path::new("-"));
    let report_to_stdout = as_json || (args.report.is_some() && report_file.is_none());
    let output = args.output.as_ref().map(|output| output.path.as_path());
    let outputs: Vec<&Path> = [output, args.weights.as_deref(), report_file, args.save_cage.as_deref()]
        .into_iter()
        .flatten()
        .collect();
    let mut inputs = vec![args.mesh.as_path()];
    if let CageSource::File(path) = &args.cage {
        inputs.push(path);
    }
    inputs.extend(args.controls.controls.as_deref());
    check_outputs(&outputs, &inputs)?;

    let model = load_model(&args.mesh, args.read.axis(), args.read.memory)?;
    let loaded = load_cage(&args.cage, &model, args.read.memory, &args.controls)?;
    let (cage, controls) = (&loaded.cage, loaded.controls());
    refuse_files_read(&outputs)?;
    let of_mesh = |e| CliError::job(&args.mesh, e);
    // Weights contain the points of the rig whatever the format of the output, because `deform` may write a GLB.
    let job = Job::from_resolved(&model, ModelFormat::Gltf, ReshapeOptions::default(), args.shape_only);
    let job = job.map_err(of_mesh)?;
    let (points, extra_points) = job.all_points().map_err(of_mesh)?;
    let options =
        BindOptions { held: model.bytes(), extra_points, ..args.solve.options(args.grid, args.read.memory) };
    let weights = weights_bytes(points.len(), controls.n_controls());
    let npz = if args.weights.is_some() { weights } else { 0 };
    let output = args.output.as_ref().map_or(0, |output| model.bytes_to_write(output.format));
    let to_write = require_memory(&options, points.len(), controls, npz.max(output))?;
    let mut binding = bind_positions(&points, controls, args.solve.on_gpu(), &options)?;
    let memory = &mut binding.report.memory_bytes;
    memory.estimated = memory.estimated.max(to_write);

    if let Some(path) = &args.weights {
        let extra_points = &points[model.positions.len()..];
        let inner = &controls.rest()[cage.n_vertices()..];
        write(
            path,
            &write_weights_npz(&binding.weights, &binding.frames, &binding.outside, extra_points, inner),
        )?;
    }
    if let Some(output) = &args.output {
        let restored = Restored { points: &points, binding: &binding, rest: controls.rest() };
        let job = Job::from_resolved(&model, output.format, ReshapeOptions::default(), args.shape_only);
        let job = job.map_err(of_mesh)?;
        let deformed = job.deform(&restored, &Poses::Shape(Vec::new())).map_err(of_mesh)?;
        let written = job.write(deformed).map_err(|e| CliError::job(&output.path, e))?;
        write(&output.path, &written.bytes)?;
        binding.report.notices.extend(written.notices);
    }
    save_cage(args.save_cage.as_deref(), cage, &model)?;
    let report = json(&binding.report);
    if let Some(path) = report_file {
        write(path, report.as_bytes())?;
    }
    if report_to_stdout {
        return print(&report);
    }
    let written: Vec<PathBuf> = outputs.iter().map(|path| path.to_path_buf()).collect();
    print(&card::of(&binding.report, &model.notices, &written))
}

/// The rest pose as the weights restore it.
struct Restored<'a> {
    /// Bound points at rest. `[n_points]`, object units
    points: &'a [Vec3],
    binding: &'a Binding,
    /// Positions of the controls at rest. `[n_controls]`, object units
    rest: &'a [Vec3],
}

impl Follow for Restored<'_> {
    type Error = JobError;

    fn displacements(&self, _: &Model, _: &[Vec3]) -> Result<Vec<DVec3>, JobError> {
        let restored = deform(self.binding, self.rest);
        Ok(restored.iter().zip(self.points).map(|(a, b)| a.as_dvec3() - b.as_dvec3()).collect())
    }

    fn vertices(&self, model: &Model, _: &[Vec3], _: &Parts) -> Result<Vec<Vec3>, JobError> {
        let mut restored = deform(self.binding, self.rest);
        restored.truncate(model.positions.len());
        Ok(restored)
    }

    fn field(&self, _: &[Vec3]) -> Result<Option<Field>, JobError> {
        Ok(None)
    }

    fn outside(&self) -> Result<Vec<u32>, JobError> {
        Ok(self.binding.outside.iter().map(|o| o.vertex).collect())
    }
}

/// Binds what a job needs, with a progress bar. `mesh`: file of the model.
///
/// # Errors
/// If the bind fails or is cancelled, or the memory limit is exceeded.
pub(crate) fn bind_job(
    job: &Job<'_>,
    controls: Controls<'_>,
    poses: &Poses,
    options: &BindOptions,
    mesh: &Path,
) -> Result<BoundPoints, CliError> {
    let points = job.points(controls, poses, options).map_err(|e| CliError::job(mesh, e))?;
    let Some(points) = points else { return Ok(BoundPoints::nothing(controls.rest().to_vec())) };
    let binding = bind_positions(&points.positions, controls, false, &points.options)?;
    Ok(points.bound(binding, controls))
}

/// Binds all vertices of a model, with a progress bar.
///
/// # Errors
/// If the bind fails or is cancelled.
pub(crate) fn bind_model(model: &Model, cage: &Cage, options: &BindOptions) -> Result<Binding, CliError> {
    let bar = Bar::start();
    Ok(bind(&model.positions, cage, options, &bar)?)
}

/// Writes a cage in the axes of the model's file, if a path is given.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn save_cage(path: Option<&Path>, cage: &Cage, model: &Model) -> Result<(), CliError> {
    let Some(path) = path else { return Ok(()) };
    let mesh = model.up().mesh_turned_back(&cage.to_polygon_mesh());
    let made = Model::of_mesh("cage.obj", &mesh, model.origin())?;
    write(path, &made.write(ModelFormat::Obj, &mesh.positions).map_err(|e| CliError::file(path, e))?)
}

/// Binds positions on the GPU or the processor, with a progress bar.
///
/// # Errors
/// If the bind fails or is cancelled, or no GPU is available.
pub(crate) fn bind_positions(
    positions: &[Vec3],
    controls: Controls<'_>,
    on_gpu: bool,
    options: &BindOptions,
) -> Result<Binding, CliError> {
    if on_gpu {
        let context = gpu::open()?;
        let bar = Bar::start();
        return Ok(pollster::block_on(bind_on(positions, controls, options, &bar, &context))?);
    }
    let bar = Bar::start();
    Ok(bind(positions, controls, options, &bar)?)
}

/// Deforms the bound points by posed controls. `[n_points]`, object units.
pub(crate) fn deform(binding: &Binding, cage_positions: &[Vec3]) -> Vec<Vec3> {
    deform_bound(&binding.weights, &binding.frames, cage_positions)
}

/// Encodes the model's file with new vertex positions, in the output's format.
///
/// # Errors
/// If the model cannot be written in that format.
pub(crate) fn export(model: &Model, positions: &[Vec3], output: &ModelOutput) -> Result<Vec<u8>, CliError> {
    model.write(output.format, positions).map_err(|e| CliError::file(&output.path, e))
}
