//! `cagework refit`: many models follow one cage, which is solved for once.

use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use cagework_core::bind::{BindError, SolvedCage};
use cagework_core::options::BindOptions;
use cagework_core::{Binding, Controls};
use cagework_io::{ModelFormat, ReshapeReport, SavedWeights, shown};
use glam::Vec3;
use serde::Serialize;

use crate::args::{ModelOutput, RefitArgs};
use crate::bind::{bind_positions, check_memory};
use crate::card::duration;
use crate::controls::with_inner;
use crate::deform::{Poses, follow, pose_name};
use crate::error::CliError;
use crate::files::{check_outputs, is_newer, json, make_folder, print, read, shown_path, write};
use crate::load::{load_cage_file, load_model};
use crate::progress::Bar;
use crate::signals::{self, Asking};
use crate::{rig, say};

/// What was done; its JSON is the output of `--json`.
#[derive(Debug, Serialize)]
struct Refitted {
    /// The folder.
    output: String,
    cage_vertices: usize,
    /// Controls inside the cage.
    inner_controls: usize,
    /// Voxelizing and solving once for all models; none if no model asked for it, or if each was bound on its own.
    solve_ms: Option<f64>,
    written: usize,
    skipped: usize,
    failed: usize,
    notices: Vec<String>,
    models: Vec<Entry>,
}

/// One model.
#[derive(Debug, Serialize)]
struct Entry {
    input: String,
    output: String,
    #[serde(flatten)]
    outcome: Outcome,
}

/// What became of it.
#[derive(Debug, Serialize)]
#[serde(tag = "state", rename_all = "snake_case")]
enum Outcome {
    Written(Box<Written>),
    /// It is newer than its inputs.
    Skipped,
    Failed {
        error: String,
        hint: Option<&'static str>,
    },
}

#[derive(Debug, Serialize)]
struct Written {
    vertices: usize,
    outside_vertices: usize,
    /// Its samples and weights, without the solve that all models share.
    bind_ms: f64,
    deform_ms: f64,
    /// All of it, reading and writing included.
    total_ms: f64,
    #[serde(flatten)]
    rig: Option<ReshapeReport>,
    notices: Vec<String>,
}

/// A model to be read and the file to be written.
struct Job {
    model: PathBuf,
    output: ModelOutput,
}

/// What binds models to one cage.
struct Binder<'a> {
    args: &'a RefitArgs,
    controls: Controls<'a>,
    /// Made for the first model that is not skipped; none if its fields are too large to be kept.
    solved: OnceCell<Option<SolvedCage<'a>>>,
    /// Names of parts that no model had so far.
    unnamed: RefCell<Vec<String>>,
}

/// Runs `cagework refit`.
///
/// # Errors
/// When cage or pose cannot be used, two models would be written to one file, a model failed, or the work was cancelled.
pub(crate) fn run(args: &RefitArgs, as_json: bool) -> Result<(), CliError> {
    if args.solve.on_gpu() {
        return Err(CliError::Mismatch {
            message: "the cage is solved for once on the processor only".into(),
            hint: "leave out `--backend gpu`",
        });
    }
    let jobs = jobs(args)?;
    make_folder(&args.output)?;
    let shared =
        [Some(&args.cage), Some(&args.pose), args.pose_controls.as_ref(), args.controls.controls.as_ref()];
    let shared: Vec<&Path> = shared.into_iter().flatten().map(AsRef::as_ref).collect();
    let outputs: Vec<&Path> = jobs.iter().map(|job| job.output.path.as_path()).collect();
    let models = jobs.iter().map(|job| job.model.as_path());
    let inputs: Vec<&Path> = shared.iter().copied().chain(models).chain(args.manifest.as_deref()).collect();
    check_outputs(&outputs, &inputs)?;

    // From here on Ctrl-C ends the work after what is being written.
    let _asking = Asking::start();
    let (up, memory) = (args.read.axis(), args.read.memory);
    let cage = load_cage_file(&args.cage, up, memory, &args.controls)?;
    let controls = cage.controls();
    let inner = &controls.rest()[cage.cage.n_vertices()..];
    let pose = cage.load_pose(&args.pose)?;
    let poses = Poses {
        names: vec![pose_name(&args.pose)],
        rest: controls.rest().to_vec(),
        positions: with_inner(vec![pose], args.pose_controls.as_slice(), inner, up, memory)?,
    };
    let unnamed = RefCell::new(args.rig.part_names().cloned().collect());
    let binder = Binder { args, controls, solved: OnceCell::new(), unnamed };
    let mut models = Vec::with_capacity(jobs.len());
    let mut cancelled = None;
    for job in &jobs {
        let inputs: Vec<&Path> = shared.iter().copied().chain([job.model.as_path()]).collect();
        let outcome = if args.resume && is_newer(&job.output.path, &inputs) {
            Outcome::Skipped
        } else {
            match binder.refit(job, &poses, inner) {
                Ok(written) => Outcome::Written(Box::new(written)),
                Err(error) if signals::cancelled() => {
                    cancelled = Some(error);
                    break;
                }
                Err(error) => Outcome::Failed { error: named(&error, &job.model), hint: error.hint() },
            }
        };
        let text = |path: &Path| path.display().to_string();
        let entry = Entry { input: text(&job.model), output: text(&job.output.path), outcome };
        tell(&entry, as_json)?;
        models.push(entry);
    }
    let done = binder.report(models);
    print(&if as_json { json(&done) } else { text(&done, jobs.len()) })?;
    let unnamed = binder.unnamed.borrow();
    match (cancelled, unnamed.first()) {
        (Some(error), _) => Err(error),
        _ if done.failed > 0 => Err(CliError::Mismatch {
            message: format!("{} of {} models failed", done.failed, jobs.len()),
            hint: "when they are mended, run it again with --resume: what is done is left as it is",
        }),
        // Those that were skipped were not asked.
        (None, Some(name)) if done.skipped == 0 => Err(CliError::Mismatch {
            message: format!("no model has a part that is called '{}'", shown(name)),
            hint: "what was written is without it: mend the name and run it again, without --resume",
        }),
        _ => Ok(()),
    }
}

/// All models and where they are written.
///
/// # Errors
/// When the manifest cannot be read, there is no model, or two would be written to one file.
fn jobs(args: &RefitArgs) -> Result<Vec<Job>, CliError> {
    let mut models = args.models.clone();
    if let Some(path) = &args.manifest {
        let text = String::from_utf8(read(path)?).map_err(|e| CliError::file(path, e))?;
        let lines = text.strip_prefix('\u{feff}').unwrap_or(&text).lines().map(str::trim);
        models.extend(lines.filter(|line| !line.is_empty() && !line.starts_with('#')).map(PathBuf::from));
        if models.is_empty() {
            return Err(CliError::file(path, "names no model"));
        }
    }
    let mut by_output: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    let mut jobs = Vec::with_capacity(models.len());
    for model in &models {
        let name = Path::new(model.file_name().ok_or_else(|| CliError::file(model, "is no name of a file"))?);
        let output = match ModelFormat::of_export(&name.to_string_lossy()) {
            Some(format) => ModelOutput { path: args.output.join(name), format },
            None => ModelOutput {
                path: args.output.join(name).with_extension(ModelFormat::Gltf.export_extension()),
                format: ModelFormat::Gltf,
            },
        };
        if let Some(other) = by_output.insert(output.path.clone(), model) {
            return Err(CliError::Mismatch {
                message: format!(
                    "{} and {} would both be written to {}",
                    shown_path(other),
                    shown_path(model),
                    shown_path(&output.path)
                ),
                hint: "rename one of them, or run the command once for each with another -o",
            });
        }
        jobs.push(Job { model: model.clone(), output });
    }
    Ok(jobs)
}

impl Binder<'_> {
    /// One model, from file to file; nothing of it stays.
    fn refit(&self, job: &Job, poses: &Poses, inner: &[Vec3]) -> Result<Written, CliError> {
        let started = Instant::now();
        let Self { args, controls, .. } = self;
        let model = load_model(&job.model, args.read.axis(), args.read.memory)?;
        let is_static = args.rig.plain || job.output.format != ModelFormat::Gltf;
        let (points, extra_points) =
            if is_static { (model.positions.clone(), 0) } else { rig::points(&model, &job.model)? };
        let (options, missing) = args.rig.options_of_one(&model, &job.model)?;
        let held = model.bytes();
        let binding = self.bind(&points, held, extra_points)?;
        let bound = BindOptions { held: held + self.held(), ..self.options() };
        check_memory(&bound, points.len(), *controls, model.bytes_to_write(job.output.format))?;
        let Binding { weights, outside, report } = binding;
        let saved = SavedWeights {
            weights,
            outside,
            extra_points: points[model.positions.len()..].to_vec(),
            inner_controls: inner.to_vec(),
        };
        let (bytes, rig, deform_ms) = follow(&model, saved, poses, &job.output, (&options, args.rig.plain))?;
        write(&job.output.path, &bytes)?;
        let mut notices = model.notices.clone();
        notices.extend(missing.iter().map(|name| format!("no part is called '{}' here", shown(name))));
        self.unnamed.borrow_mut().retain(|name| missing.contains(name));
        notices.extend(rig.iter().flat_map(ReshapeReport::notices));
        if !report.converged {
            notices.push(format!(
                "the solve did not converge within {} iterations: raise --max-iterations or --tau",
                report.iterations
            ));
        }
        Ok(Written {
            vertices: model.positions.len(),
            outside_vertices: report.outside_vertices as usize,
            bind_ms: report.timings_ms.total,
            deform_ms,
            total_ms: started.elapsed().as_secs_f64() * 1e3,
            rig,
            notices,
        })
    }

    fn options(&self) -> BindOptions {
        self.args.solve.options(self.args.grid, self.args.read.memory)
    }

    /// Bytes of the fields that are kept.
    fn held(&self) -> u64 {
        self.solved.get().and_then(Option::as_ref).map_or(0, SolvedCage::bytes)
    }

    fn bind(&self, points: &[Vec3], held: u64, extra_points: usize) -> Result<Binding, CliError> {
        let options = self.options();
        if self.solved.get().is_none() {
            let solved = match SolvedCage::new(self.controls, &options, &Bar::start()) {
                Err(BindError::Memory { .. }) => None,
                solved => Some(solved?),
            };
            // It is not there yet.
            let _ = self.solved.set(solved);
        }
        match self.solved.get() {
            Some(Some(solved)) => Ok(solved.bind(points, (held, extra_points), &Bar::start())?),
            _ => bind_positions(points, self.controls, false, &BindOptions { held, extra_points, ..options }),
        }
    }

    fn report(&self, models: Vec<Entry>) -> Refitted {
        let count = |is: fn(&Outcome) -> bool| models.iter().filter(|entry| is(&entry.outcome)).count();
        let n_cage = self.controls.cage().n_vertices();
        let mut notices: Vec<String> =
            self.controls.cage().notices().iter().map(ToString::to_string).collect();
        if matches!(self.solved.get(), Some(None)) {
            notices.push(format!(
                "The fields of this grid are too large to be kept in half of {} MiB: the cage was solved for anew for each \
                 model. A smaller --grid or a larger --memory-limit avoids that.",
                self.options().memory_limit >> 20
            ));
        }
        Refitted {
            output: self.args.output.display().to_string(),
            cage_vertices: n_cage,
            inner_controls: self.controls.n_controls() - n_cage,
            solve_ms: self.solved.get().and_then(Option::as_ref).map(SolvedCage::elapsed_ms),
            written: count(|o| matches!(o, Outcome::Written(_))),
            skipped: count(|o| matches!(o, Outcome::Skipped)),
            failed: count(|o| matches!(o, Outcome::Failed { .. })),
            notices,
            models,
        }
    }
}

/// An error with the name of the model, unless it says it.
fn named(error: &CliError, model: &Path) -> String {
    let (message, name) = (error.message(), shown_path(model));
    if message.contains(&name) { message } else { format!("{name}: {message}") }
}

/// Says what became of a model, at once; for JSON, only on stderr what failed.
fn tell(entry: &Entry, as_json: bool) -> Result<(), CliError> {
    let output = shown_path(entry.output.as_ref());
    match &entry.outcome {
        Outcome::Failed { error, hint } => {
            say(error, *hint);
            Ok(())
        }
        _ if as_json => Ok(()),
        Outcome::Skipped => print(&format!("skipped {output}: newer than its inputs")),
        Outcome::Written(done) => {
            let outside = match done.outside_vertices {
                0 => String::new(),
                n => format!(", {n} outside the cage"),
            };
            let mut line =
                format!("wrote {output}: {} vertices{outside}, {}", done.vertices, duration(done.total_ms));
            for notice in &done.notices {
                line += &format!("\nnote: {notice}");
            }
            print(&line)
        }
    }
}

fn text(done: &Refitted, n: usize) -> String {
    let solve = done.solve_ms.map_or(String::new(), |ms| format!("; one solve of {}", duration(ms)));
    let mut out = format!(
        "refitted {} of {n} models, {} skipped, {} failed{solve}\n",
        done.written, done.skipped, done.failed
    );
    for notice in &done.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
