//! `cagework deform`: deforms a model by poses of its cage.

mod clip;
mod report;

use std::path::Path;
use std::time::Instant;

use cagework_core::deform::{deform_bound, outside_in_words};
use cagework_core::enclosure::Enclosure;
use cagework_core::words::counted;
use cagework_core::{BindOptions, Cage};
use cagework_io::{
    Clip, Model, ModelFormat, SavedWeights, Timeline, fbx_displacements, shown, write_displacements_json,
    write_displacements_npz,
};
use cagework_job::{BoundPoints, Job, JobError, JobOptions, NamedPose, PoseTimes, Poses, Written};
use glam::Vec3;

use crate::args::{CageSource, ControlArgs, DeformArgs, SmoothArgs};
use crate::bind::bind_job;
use crate::controls::{rest_of, with_inner};
use crate::error::{CliError, shown_path};
use crate::field::{LatticeSummary, write_lattice};
use crate::files::{check_outputs, json, print, write};
use crate::load::{LoadedCage, load_any, load_cage, load_weights};
use report::{DeformSummary, Subject, text};

/// Largest distance of a vertex from its position by the weights, at rest, as a fraction of the cage's diagonal. Weights
/// of this mesh and this cage are off by rounding only, except those of the classic method, which restores no rows.
const MAX_MISFIT: f64 = 1e-3;

/// Runs `cagework deform`.
///
/// # Errors
/// If a file cannot be read or written, files do not match, or a bind fails.
pub(crate) fn run(args: &DeformArgs, as_json: bool) -> Result<(), CliError> {
    if let (Some(clip), Some(rig), Some(output)) = (&args.clip.clip, &args.clip.rig, &args.output) {
        return clip::run(args, (clip, rig), output, as_json);
    }
    let mut inputs = vec![args.mesh.as_path()];
    inputs.extend(args.weights.as_deref());
    inputs.extend(args.pose.iter().chain(&args.pose_controls).map(AsRef::<Path>::as_ref));
    if let CageSource::File(path) = &args.cage {
        inputs.push(path);
    }
    let models = args.output.iter().map(|output| output.path.as_path());
    let outputs = models.chain(args.lattice.as_deref()).chain(args.displacements.as_deref());
    check_outputs(&outputs.collect::<Vec<_>>(), &inputs)?;
    check_names(args)?;
    let model = load_any(&args.mesh, args.read.axis(), args.read.memory)?;
    let lattice = args.lattice.as_deref().map(|path| lattice(args, path, &model)).transpose()?;
    if args.output.is_some() || args.displacements.is_some() {
        let summary = deform(args, &model, lattice)?;
        return print(&if as_json { json(&summary) } else { text(&summary) });
    }
    lattice.map_or(Ok(()), |lattice| print(&if as_json { json(&lattice) } else { lattice.text() }))
}

/// Writes the lattice of `--lattice`.
fn lattice(args: &DeformArgs, path: &Path, model: &Model) -> Result<LatticeSummary, CliError> {
    let options = args.rig.job_options(false);
    // Options of rigs apply to the model that is written beside the lattice.
    let is_alone = args.output.is_none() && args.displacements.is_none();
    let of_rig = options.first_for_rigs().filter(|_| is_alone);
    match options.first_for_parts().or(of_rig) {
        Some(option) => Err(CliError::Mismatch {
            message: format!(
                "--{option}: this option changes a model, but a lattice stores how the space inside the cage moves"
            ),
            hint: "leave the option out, or write the model and the lattice in two runs",
        }),
        None => write_lattice(args, path, model),
    }
}

/// Deforms the model by all poses, and writes it.
fn deform(
    args: &DeformArgs,
    model: &Model,
    lattice: Option<LatticeSummary>,
) -> Result<DeformSummary, CliError> {
    let path = args.output.as_ref().map(|output| &output.path).or(args.displacements.as_ref());
    let (memory, path) = (args.read.memory, path.unwrap_or(&args.mesh));
    let of_output = |e| CliError::job(path, e);
    let format = args.output.as_ref().map_or(ModelFormat::Gltf, |output| output.format);
    let options = job_options(args, model)?;
    let of_mesh = |e| CliError::job(&args.mesh, e);
    let job = Job::new(model, format, &options).map_err(of_mesh)?;
    check_inputs(args, job.uses_field())?;
    let controls = ControlArgs { smooth: SmoothArgs { smooth: args.smooth }, ..ControlArgs::default() };
    let cage = load_cage(&args.cage, model, memory, &controls)?;
    let saved = args.weights.as_deref().map(|path| load_weights(path, model, &cage.cage, memory));
    let saved = saved.transpose()?;
    let inner = saved.as_ref().map_or(&[][..], |saved| &saved.inner_controls);
    let (names, poses) = load_poses(args, &cage, inner)?;
    job.check(&poses).map_err(of_output)?;

    let (mut notices, mut subject) = (model.notices.clone(), subject(args, model, &cage, saved.as_ref()));
    let bound = match saved {
        Some(saved) => {
            job.check_memory_to_write(&poses, saved.weights.bytes() as u64, memory.bytes())
                .map_err(of_output)?;
            let outside = saved.outside.iter().filter(|o| (o.vertex as usize) < model.positions.len());
            notices.extend(outside_in_words(outside, cage.cage.diagonal()));
            notices.extend(misfit_in_words(&saved, model, &cage.cage));
            let rest = rest_of(&cage.cage, &saved);
            BoundPoints::from_saved(saved, rest)
        }
        None => {
            let held = if args.split { job.bytes_to_split() } else { 0 };
            let options = BindOptions { memory_limit: memory.bytes(), held, ..BindOptions::default() };
            bind_job(&job, cage.controls(), &poses, &options, &args.mesh)?
        }
    };
    let started = Instant::now();
    let mut split = None;
    if let (true, Poses::Shape(pose)) = (args.split, &poses) {
        split = job.split(&bound, pose).map_err(of_output)?;
    }
    let job = split.as_ref().map_or(&job, |(job, _)| job);
    let mut displaced = None;
    if let Some(path) = &args.displacements {
        let job = Job::new(model, ModelFormat::Gltf, &options).map_err(of_mesh)?;
        displaced = Some((path, displacements(args, path, &job, &bound, (&names, &poses))?));
    }
    let (mut written, mut deform_ms) = (Written::default(), started.elapsed().as_secs_f64() * 1e3);
    if let Some(output) = &args.output {
        let started = Instant::now();
        let deformed = job.deform(&bound, &poses).map_err(of_output)?;
        deform_ms = started.elapsed().as_secs_f64() * 1e3;
        written = job.write(deformed).map_err(of_output)?;
        write(&output.path, &written.bytes)?;
    }
    if let Some((path, bytes)) = &displaced {
        write(path, bytes)?;
    }
    if let Some((_, [n_bent, n_split])) = split {
        written.set_split(n_bent, n_split);
    }
    subject.set_poses(names, poses.timeline().map(Timeline::seconds));
    subject.count(&written);
    notices.extend(subject.outside_in_words());
    notices.extend(written.notices);
    let output = args.output.as_ref().map(|output| output.path.display().to_string());
    let displacements = args.displacements.as_ref().map(|path| path.display().to_string());
    Ok(DeformSummary { output, displacements, subject, rig: written.rig, deform_ms, lattice, notices })
}

/// Computes the file of `--displacements`: each pose as a morph target of the model at rest, by control points.
fn displacements(
    args: &DeformArgs,
    path: &Path,
    job: &Job<'_>,
    bound: &BoundPoints,
    (names, poses): (&[String], &Poses),
) -> Result<Vec<u8>, CliError> {
    let of_output = |e| CliError::job(path, e);
    let all = match poses {
        Poses::Shape(positions) => {
            vec![NamedPose { name: names[0].clone(), positions: positions.clone() }]
        }
        Poses::Targets { all, .. } => all.clone(),
    };
    let targets = Poses::Targets { base: None, all, timeline: None };
    job.check_memory_to_write(&targets, 0, args.read.memory.bytes()).map_err(of_output)?;
    let written = job.deform(bound, &targets).and_then(|deformed| job.write(deformed)).map_err(of_output)?;
    let meshes = fbx_displacements(&written.bytes, names.len(), args.read.memory.bytes())
        .map_err(|e| CliError::file(&args.mesh, e))?;
    if meshes.is_empty() {
        return Err(CliError::Mismatch {
            message: format!("{}: --displacements needs a model from an FBX file", shown_path(&args.mesh)),
            hint: "give the FBX file, or leave out --displacements",
        });
    }
    Ok(if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) {
        write_displacements_json(names, &meshes)
    } else {
        write_displacements_npz(names, &meshes)
    })
}

/// Options of the job that the arguments describe.
fn job_options(args: &DeformArgs, model: &Model) -> Result<JobOptions, CliError> {
    let clip = args.dynamic.as_deref().map(|name| Clip::named(&model.clips(), name)).transpose();
    let clip = clip.map_err(|e| CliError::file(&args.mesh, e))?;
    if args.split && model.splats().is_none() {
        return Err(CliError::job(&args.mesh, JobError::NeedsSplats));
    }
    let mut options = JobOptions { clip, cells: Some(args.lattice_cells), ..args.rig.job_options(false) };
    options.reshape.expressions = args.expression;
    Ok(options)
}

/// Checks that the arguments fit the kind of model. `uses_field`: whether it is deformed without weights.
fn check_inputs(args: &DeformArgs, uses_field: bool) -> Result<(), CliError> {
    let (message, hint) = match &args.weights {
        Some(_) if uses_field => {
            ("the file has no faces, so it is deformed without weights", "leave out --weights")
        }
        None if !uses_field => {
            ("the mesh can only be deformed with its weights", "give --weights, which `cagework bind` writes")
        }
        _ if uses_field && !args.name.is_empty() => {
            ("--name needs a mesh, but the model has no faces", "leave it out")
        }
        _ if uses_field && !args.pose_controls.is_empty() => (
            "splats, points and the frames of a clip do not take --pose-controls",
            "`cagework map` takes controls inside the cage",
        ),
        _ if !uses_field && args.smooth > 0 && args.lattice.is_none() => (
            "--smooth applies to --dynamic, --lattice, splats and points only: the weights file already says how far the cage is smoothed",
            "leave out --smooth",
        ),
        _ => return Ok(()),
    };
    Err(CliError::Mismatch { message: message.into(), hint })
}

/// Reads all poses and their names. `inner`: rest positions of the bound controls inside the cage.
fn load_poses(
    args: &DeformArgs,
    cage: &LoadedCage,
    inner: &[Vec3],
) -> Result<(Vec<String>, Poses), CliError> {
    let (mut names, mut positions, mut keys) = (Vec::new(), Vec::new(), Vec::new());
    for (k, path) in args.pose.iter().enumerate() {
        let name = args.name.get(k).cloned().unwrap_or_else(|| pose_name(path));
        for state in cage.load_states(path)? {
            names.push(format!("{name} {}", state.name).trim_end().to_owned());
            keys.extend(state.seconds);
            positions.push(state.positions);
        }
    }
    // Key times of several files are unrelated.
    if args.pose.len() > 1 {
        keys.clear();
    }
    let axes = (args.read.axis(), cage.origin());
    let mut positions = with_inner(positions, &args.pose_controls, inner, axes, args.read.memory)?;
    let given = Some(args.times.clone()).filter(|times| !times.is_empty());
    let times = PoseTimes { times: given, keys, interpolation: args.interpolation };
    let poses = if positions.len() == 1 && !args.expression {
        Poses::shape(positions.remove(0), &times, false)
    } else {
        let named = names.iter().cloned().zip(positions);
        let named = named.map(|(name, positions)| NamedPose { name, positions });
        Poses::targets(named.collect(), &times, args.expression)
    };
    Ok((names, poses?))
}

/// Describes what is deformed, without the counts that are known after writing.
fn subject(args: &DeformArgs, model: &Model, cage: &LoadedCage, saved: Option<&SavedWeights>) -> Subject {
    let vertices = model.positions.len();
    if let Some(saved) = saved {
        let outside = || saved.outside.iter().filter(|o| (o.vertex as usize) < vertices);
        return Subject::Mesh {
            vertices,
            cage_vertices: cage.cage.n_vertices(),
            inner_controls: saved.inner_controls.len(),
            outside_vertices: outside().count(),
            staying_vertices: outside().filter(|o| o.share == 0.0).count(),
            poses: Vec::new(),
            expressions: args.expression,
            animation_seconds: None,
        };
    }
    if let Some(clip) = &args.dynamic {
        let clips = model.clips();
        let seconds = Clip::named(&clips, clip).map_or(0.0, |number| clips[number].seconds);
        return Subject::Clip { clip: clip.clone(), frames: 0, seconds, vertices };
    }
    Subject::Capture {
        points: vertices,
        is_splats: model.splats().is_some(),
        outside_points: Enclosure::new(cage.controls().surface(), &model.positions).outside().len(),
        inexact_splats: 0,
    }
}

/// Checks that `--name` is given once per `--pose` or not at all, with different names.
fn check_names(args: &DeformArgs) -> Result<(), CliError> {
    let (names, n_poses) = (&args.name, args.pose.len());
    if !names.is_empty() && names.len() != n_poses {
        return Err(CliError::Mismatch {
            message: format!(
                "--name: {} for {}",
                counted(names.len(), "name", "names"),
                counted(n_poses, "file of poses", "files of poses")
            ),
            hint: "give one --name per --pose, in the same order",
        });
    }
    match names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)) {
        None => Ok(()),
        Some((_, name)) => Err(CliError::Mismatch {
            message: format!("--name: '{}' is given twice", shown(name)),
            hint: "give each pose a name of its own",
        }),
    }
}

/// Says by how much the weights miss the mesh at rest; `None` within rounding.
fn misfit_in_words(saved: &SavedWeights, model: &Model, cage: &Cage) -> Option<String> {
    let misfit = misfit(saved, model, cage) / f64::from(cage.diagonal());
    (misfit > MAX_MISFIT).then(|| {
        format!(
            "at rest the weights miss the mesh by up to {:.2} % of the cage's size: they are those of another mesh or \
             cage, or of the classic method",
            100.0 * misfit
        )
    })
}

/// Finds the largest distance between a vertex inside the cage and its position by the weights, at rest, object units.
fn misfit(saved: &SavedWeights, model: &Model, cage: &Cage) -> f64 {
    let mut by_weights = deform_bound(&saved.weights, &saved.frames, &rest_of(cage, saved));
    for outside in &saved.outside {
        if let (Some(at), Some(p)) =
            (by_weights.get_mut(outside.vertex as usize), model.positions.get(outside.vertex as usize))
        {
            *at = *p;
        }
    }
    let distance = |(at, p): (&Vec3, &Vec3)| at.as_dvec3().distance(p.as_dvec3());
    by_weights.iter().zip(&model.positions).map(distance).fold(0.0, f64::max)
}

/// Returns the name of a pose: its file name without folder and extension.
pub(crate) fn pose_name(path: &Path) -> String {
    path.file_stem().map_or_else(|| "pose".into(), |stem| stem.to_string_lossy().into_owned())
}
