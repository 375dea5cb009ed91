//! `cagework refit`: deforms many models with one cage. The harmonic fields of the cage are solved once.

mod report;

use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::ScopedJoinHandle;
use std::time::Instant;

use cagework_core::bind::{BindError, SolvedCage};
use cagework_core::options::BindOptions;
use cagework_core::progress::Cancellation;
use cagework_core::{BindReport, Controls};
use cagework_io::{Model, ModelFormat, Skeleton, shown, without_byte_order_mark};
use cagework_job::{BoundPoints, Deformed, Job, Poses, require_memory};
use glam::{DVec3, Vec3};

use crate::args::{ModelOutput, RefitArgs};
use crate::bind::bind_positions;
use crate::controls::with_inner;
use crate::error::CliError;
use crate::files::{
    check_outputs, is_newer, is_stream, json, make_folder, models_of_folders, print, read, read_beside,
    refuse_files_named, shown_path, write,
};
use crate::load::{load_cage_file, load_model, load_with_clips};
use crate::progress::Bar;
use crate::signals::{self, CancelGuard};

use report::{ModelEntry, ModelReport, Outcome, RefitSummary, print_entry, text};

/// A model to read, and the file to write it to.
struct Refit {
    model: PathBuf,
    output: ModelOutput,
}

/// State for binding models to one cage.
struct Binder<'a> {
    args: &'a RefitArgs,
    controls: Controls<'a>,
    /// Origin of the cage's positions, to which the models' positions are relative as well.
    origin: DVec3,
    /// Solved fields of the cage, computed at the first bind; `None` if they do not fit in half of the memory limit.
    solved: OnceCell<Option<SolvedCage<'a>>>,
    /// Skeleton that all models share; see [`Binder::skeleton_of`].
    skeleton: Option<Arc<Skeleton>>,
    /// Names of `--rigid` and `--mask` that no model so far contains.
    unnamed: RefCell<Vec<String>>,
}

/// A deformed model that is ready to be written.
struct DeformedModel<'a> {
    refit: &'a Refit,
    job: Job<'static>,
    deformed: Deformed,
    /// Report of the model. The total time and the report of its rig are added after writing.
    report: ModelReport,
    started: Instant,
}

/// The job that another thread is writing, and the handle of that thread; `None` if no job is being written.
type Writing<'scope, 'a> = Option<(&'a Refit, ScopedJoinHandle<'scope, Outcome>)>;

/// A model is written while the next one is read, unless writing it needs more than the memory limit divided by this.
const PARALLEL_MEMORY_DIVISOR: u64 = 16;

/// Runs `cagework refit`.
///
/// # Errors
/// If the cage or pose is invalid, two models have the same output, a model failed, or the work was cancelled.
pub(crate) fn run(args: &RefitArgs, as_json: bool) -> Result<(), CliError> {
    if args.solve.on_gpu() {
        return Err(CliError::Mismatch {
            message: "refit solves on the processor only".into(),
            hint: "leave out `--backend gpu`",
        });
    }
    let shared = [
        Some(&args.cage),
        Some(&args.pose),
        args.pose_controls.as_ref(),
        args.controls.controls.as_ref(),
        args.skeleton.as_ref(),
    ];
    let shared: Vec<&Path> = shared.into_iter().flatten().map(AsRef::as_ref).collect();
    let jobs = jobs(args, &shared)?;
    make_folder(&args.output)?;
    let outputs: Vec<&Path> = jobs.iter().map(|job| job.output.path.as_path()).collect();
    let models: Vec<&Path> = jobs.iter().map(|job| job.model.as_path()).collect();
    let named = shared.iter().chain(&models).copied();
    let inputs: Vec<&Path> = named.clone().chain(args.manifest.as_deref()).collect();
    check_outputs(&outputs, &inputs)?;
    refuse_files_named(&named.collect::<Vec<_>>(), &outputs, args.read.memory.bytes())?;

    // From here on, the first Ctrl-C ends the command after the write in progress instead of immediately.
    let _guard = CancelGuard::start();
    let (up, memory) = (args.read.axis(), args.read.memory);
    let cage = load_cage_file(&args.cage, up, None, memory, &args.controls)?;
    let controls = cage.controls();
    let inner = &controls.rest()[cage.cage.n_vertices()..];
    let pose = cage.load_pose(&args.pose)?;
    let files = args.pose_controls.as_slice();
    let pose = with_inner(vec![pose], files, inner, (up, cage.origin()), memory)?.remove(0);
    let unnamed = RefCell::new(args.rig.part_names().cloned().collect());
    let mut binder =
        Binder { args, controls, origin: cage.origin(), solved: OnceCell::new(), skeleton: None, unnamed };
    binder.skeleton = binder.skeleton_of(&jobs, &pose)?.map(Arc::new);
    let poses = Poses::Shape(pose);
    let mut models = Vec::with_capacity(jobs.len());
    let mut settle = |job: &Refit, outcome: Outcome| -> Result<(), CliError> {
        // If a signal cancelled a model, do not report it as failed.
        if matches!(outcome, Outcome::Failed { .. }) && signals::cancelled() {
            return Ok(());
        }
        let text = |path: &Path| path.display().to_string();
        let entry = ModelEntry { input: text(&job.model), output: text(&job.output.path), outcome };
        print_entry(&entry, as_json)?;
        models.push(entry);
        Ok(())
    };
    std::thread::scope(|scope| {
        let mut writing = None;
        for job in jobs.iter().take_while(|_| !signals::cancelled()) {
            let inputs: Vec<&Path> = shared.iter().copied().chain([job.model.as_path()]).collect();
            let is_done = args.resume && is_newer(&job.output.path, &inputs);
            let deformed = if is_done { None } else { Some(binder.refit(job, &poses)) };
            settle_one(&mut writing, &mut settle)?;
            match deformed {
                None => settle(job, Outcome::Skipped)?,
                Some(Err(error)) => settle(job, Outcome::of_error(&error, &job.model))?,
                Some(Ok(deformed)) => {
                    let is_large = deformed.bytes() > args.read.memory.bytes() / PARALLEL_MEMORY_DIVISOR;
                    writing = Some((job, scope.spawn(move || deformed.write())));
                    if is_large {
                        settle_one(&mut writing, &mut settle)?;
                    }
                }
            }
        }
        settle_one(&mut writing, &mut settle)
    })?;
    let summary = binder.summary(models);
    print(&if as_json { json(&summary) } else { text(&summary, jobs.len()) })?;
    let unnamed = binder.unnamed.borrow();
    match unnamed.first() {
        _ if signals::cancelled() => Err(BindError::Cancelled(Cancellation).into()),
        _ if summary.failed > 0 => Err(CliError::Mismatch {
            message: format!("{} of {} models failed", summary.failed, jobs.len()),
            hint: "repair them and run the command again with --resume, which skips finished models",
        }),
        // A skipped model is not read, so it may contain the part.
        Some(name) if summary.skipped == 0 => Err(CliError::Mismatch {
            message: format!("no model has a part called '{}'", shown(name)),
            hint: "all models were written without it: correct the name and run the command again, without --resume",
        }),
        _ => Ok(()),
    }
}

/// Lists all models to read, and the files to write them to. `shared`: files of the cage and the pose. A folder of
/// models may contain them; they are not listed as models.
///
/// # Errors
/// If the manifest cannot be read or names no model, or two models have the same output.
fn jobs(args: &RefitArgs, shared: &[&Path]) -> Result<Vec<Refit>, CliError> {
    let mut models = args.models.clone();
    if let Some(path) = &args.manifest {
        let bytes = read(path)?;
        let text = str::from_utf8(without_byte_order_mark(&bytes)).map_err(|e| CliError::file(path, e))?;
        let lines = text.lines().map(str::trim);
        models.extend(lines.filter(|line| !line.is_empty() && !line.starts_with('#')).map(PathBuf::from));
        if models.is_empty() {
            return Err(CliError::file(path, "names no model"));
        }
    }
    if models.iter().chain([&args.output]).any(|path| is_stream(path)) {
        return Err(CliError::Mismatch {
            message: "refit reads and writes files, not standard input and output".to_owned(),
            hint: "`cagework deform` takes one model from standard input",
        });
    }
    let models = models_of_folders(&models, shared)?;
    let mut by_output: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    let mut jobs = Vec::with_capacity(models.len());
    for model in &models {
        let name =
            Path::new(model.file_name().ok_or_else(|| CliError::file(model, "is not the name of a file"))?);
        let output = match ModelFormat::of_export(&name.to_string_lossy()) {
            Some(format) => ModelOutput { path: args.output.join(name), format },
            None => ModelOutput {
                path: args.output.join(name).with_extension(ModelFormat::Gltf.export_extension()),
                format: ModelFormat::Gltf,
            },
        };
        if let Some(other) = by_output.insert(output.path.clone(), model) {
            if other == model {
                return Err(CliError::Mismatch {
                    message: format!("{} is given twice", shown_path(model)),
                    hint: "give each model once, as an argument or in the manifest",
                });
            }
            return Err(CliError::Mismatch {
                message: format!(
                    "{} and {} would both be written to {}",
                    shown_path(other),
                    shown_path(model),
                    shown_path(&output.path)
                ),
                hint: "rename one of them, or run the command once for each, with different -o",
            });
        }
        jobs.push(Refit { model: model.clone(), output });
    }
    Ok(jobs)
}

impl Binder<'_> {
    /// Reads, binds and deforms a model.
    fn refit<'j>(&self, refit: &'j Refit, poses: &Poses) -> Result<DeformedModel<'j>, CliError> {
        let started = Instant::now();
        let Self { args, .. } = self;
        let (path, format) = (&refit.model, refit.output.format);
        // Joints of files of clips without a mesh take their moves from the body.
        let can_be_clips = args.skeleton.is_some() && format == ModelFormat::Gltf;
        let load = if can_be_clips { load_with_clips } else { load_model };
        let mut model = load(path, args.read.axis(), args.read.memory)?;
        model.set_origin(self.origin);
        let mut report = ModelReport {
            vertices: model.positions.len(),
            notices: model.notices.clone(),
            ..ModelReport::default()
        };
        let mut options = args.rig.job_options(true);
        options.reshape.skeleton.clone_from(&self.skeleton);
        let wrong = |e| CliError::job(path, e);
        let job = Job::new(model, format, &options).map_err(wrong)?;
        let (bound, of_bind) = self.bind(&job, poses, path)?;
        let deform_start = Instant::now();
        let deformed = job.deform(&bound, poses).map_err(wrong)?;
        report.deform_ms = elapsed_ms(deform_start);
        if let Some(of_bind) = of_bind {
            let missing = job.missing_parts();
            let lacks = |name: &String| format!("this model has no part called '{}'", shown(name));
            report.notices.extend(missing.iter().map(lacks));
            self.unnamed.borrow_mut().retain(|name| missing.contains(name));
            report.outside_vertices = of_bind.outside_vertices as usize;
            report.bind_ms = of_bind.timings_ms.total;
            if !of_bind.converged {
                report.notices.push(format!(
                    "the solve did not converge within {} iterations: raise --max-iterations or --tau",
                    of_bind.iterations
                ));
            }
        }
        Ok(DeformedModel { refit, job, deformed, report, started })
    }

    /// Builds the skeleton that all models share, with joints identified by name: how the joints of the `--skeleton`
    /// body move, or, without `--skeleton`, which joints carry vertices in any of the models. `None` if the joints of
    /// each model depend on that model alone.
    fn skeleton_of(&self, jobs: &[Refit], pose: &[Vec3]) -> Result<Option<Skeleton>, CliError> {
        let Self { args, .. } = self;
        let (up, memory) = (args.read.axis(), args.read.memory);
        if let Some(path) = &args.skeleton {
            let mut model = load_model(path, up, memory)?;
            model.set_origin(self.origin);
            let wrong = |e| CliError::job(path, e);
            let job = Job::of_body(model, &args.rig.job_options(true)).map_err(wrong)?;
            let (bound, _) = self.bind(&job, &Poses::Shape(pose.to_vec()), path)?;
            return Ok(Some(job.skeleton(&bound, pose).map_err(wrong)?));
        }
        if args.rig.ground && jobs.len() > 1 {
            return Err(CliError::Mismatch {
                message: "--ground would lift each model by a different height".into(),
                hint: "give the body that stands on the ground with --skeleton, which lifts all models by the same height",
            });
        }
        let of_rigs = || jobs.iter().filter(|job| job.output.format == ModelFormat::Gltf);
        if args.rig.shape_only || args.rig.stays() || of_rigs().nth(1).is_none() {
            return Ok(None);
        }
        let mut all = Skeleton::default();
        for job in of_rigs() {
            // A model that cannot be read is reported when it is refitted.
            let Ok(bytes) = read(&job.model) else { continue };
            let name = job.model.display().to_string();
            let mut beside = |relative: &str| read_beside(&job.model, relative);
            all.add(Model::joints_with_vertices_in(&name, &bytes, &mut beside, memory.bytes()));
        }
        Ok(Some(all))
    }

    fn options(&self) -> BindOptions {
        self.args.solve.options(self.args.grid, self.args.read.memory)
    }

    /// Memory of the solved fields, bytes; 0 if they are not stored.
    fn field_bytes(&self) -> u64 {
        self.solved.get().and_then(Option::as_ref).map_or(0, SolvedCage::bytes)
    }

    /// Binds what a job needs. Also returns the report of the bind; `None` if there is nothing to bind.
    fn bind(
        &self,
        job: &Job<'_>,
        poses: &Poses,
        path: &Path,
    ) -> Result<(BoundPoints, Option<BindReport>), CliError> {
        let points = job.points(self.controls, poses, &self.options());
        let Some(points) = points.map_err(|e| CliError::job(path, e))? else {
            return Ok((BoundPoints::nothing(self.controls.rest().to_vec()), None));
        };
        if self.solved.get().is_none() {
            let solved = match SolvedCage::new(self.controls, &self.options(), &Bar::start()) {
                Err(BindError::Memory { .. }) => None,
                solved => Some(solved?),
            };
            // Cannot fail: the cell is empty.
            let _ = self.solved.set(solved);
        }
        let BindOptions { held, extra_points, .. } = points.options;
        let binding = match self.solved.get() {
            Some(Some(solved)) => solved.bind(&points.positions, held, extra_points, &Bar::start())?,
            _ => bind_positions(&points.positions, self.controls, false, &points.options)?,
        };
        let with_fields = BindOptions { held: held + self.field_bytes(), ..points.options };
        let to_write = job.model().bytes_to_write(job.format());
        require_memory(&with_fields, points.positions.len(), self.controls, to_write)?;
        let report = binding.report.clone();
        Ok((points.bound(binding, self.controls), Some(report)))
    }

    fn summary(&self, models: Vec<ModelEntry>) -> RefitSummary {
        let count = |is: fn(&Outcome) -> bool| models.iter().filter(|entry| is(&entry.outcome)).count();
        let n_cage = self.controls.cage().n_vertices();
        let mut notices = cagework_core::crossing::notices(self.controls.cage());
        if matches!(self.solved.get(), Some(None)) {
            notices.push(format!(
                "The fields of this grid do not fit in half of {} MiB, so the cage was solved again for each model. \
                 A smaller --grid or a larger --memory-limit avoids that.",
                self.options().memory_limit >> 20
            ));
        }
        let is_own = |outcome: &Outcome| {
            let Outcome::Written(report) = outcome else { return false };
            report.rig.as_ref().is_some_and(|rig| self.args.rig.depends_on_vertices(rig))
        };
        let n_own = models.iter().filter(|entry| is_own(&entry.outcome)).count();
        if self.args.skeleton.is_none() && n_own > 1 {
            notices.push(format!(
                "in {n_own} models clips may travel different distances and joints may turn differently: if they share \
                 a rig, give its body with --skeleton"
            ));
        }
        RefitSummary {
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

impl DeformedModel<'_> {
    /// Memory that the model occupies until it has been written, bytes.
    fn bytes(&self) -> u64 {
        self.job.model().bytes() + self.job.model().bytes_to_write(self.job.format())
    }

    fn write(self) -> Outcome {
        let Self { refit, job, deformed, mut report, started } = self;
        let path = &refit.output.path;
        let written = job.write(deformed).map_err(|e| CliError::job(path, e));
        match written.and_then(|written| write(path, &written.bytes).map(|()| written)) {
            Err(error) => Outcome::of_error(&error, &refit.model),
            Ok(written) => {
                report.notices.extend(written.notices);
                report.total_ms = elapsed_ms(started);
                Outcome::Written(Box::new(ModelReport { rig: written.rig, ..report }))
            }
        }
    }
}

/// Waits until the model that is being written, if any, is finished, and passes its outcome to `settle`.
fn settle_one<'a>(
    writing: &mut Writing<'_, 'a>,
    settle: &mut impl FnMut(&'a Refit, Outcome) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let Some((job, thread)) = writing.take() else { return Ok(()) };
    match thread.join() {
        Ok(outcome) => settle(job, outcome),
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

fn elapsed_ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
