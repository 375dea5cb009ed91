//! A job: what one model needs to be deformed and written.

use std::sync::Arc;

use cagework_core::bind::{BindError, weights_bytes};
use cagework_core::field::{CELLS, CLIP_CELLS, Field, Lattice, bend_vertices};
use cagework_core::words::counted;
use cagework_core::{BindOptions, Controls};
use cagework_io::{
    Feet, MemoryError, Model, ModelFormat, ReshapeOptions, ReshapeReport, Skeleton, Timeline, WriteError,
};
use glam::{DVec3, Vec3};

use crate::error::JobError;
use crate::follow::{Follow, JobPoints};
use crate::options::{JobOptions, ResolvedOptions};
use crate::poses::{NamedPose, Poses};

/// How a model follows the cage, and what of its file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A mesh: its vertices follow.
    Mesh,
    /// A glTF that keeps its rig: vertices, joints, morph targets and clips follow.
    Rig,
    /// A glTF of clips without a mesh: its joints follow the skeleton of a body.
    Clips,
    /// Splats or points: they follow the deformation of space.
    Capture,
    /// A mesh whose clip with this index moves it before space is deformed.
    Frames(usize),
}

/// The model of a job, borrowed or shared.
#[derive(Clone, Debug)]
pub enum JobModel<'a> {
    /// A model that outlives the job.
    Borrowed(&'a Model),
    /// A model that the job keeps alive.
    Shared(Arc<Model>),
}

impl<'a> From<&'a Model> for JobModel<'a> {
    fn from(model: &'a Model) -> Self {
        Self::Borrowed(model)
    }
}

impl From<Arc<Model>> for JobModel<'_> {
    fn from(model: Arc<Model>) -> Self {
        Self::Shared(model)
    }
}

impl From<Model> for JobModel<'_> {
    fn from(model: Model) -> Self {
        Self::Shared(Arc::new(model))
    }
}

/// The deformation of one model, and the format in which it is written.
#[derive(Clone, Debug)]
pub struct Job<'m> {
    model: JobModel<'m>,
    format: ModelFormat,
    kind: Kind,
    options: ResolvedOptions,
    cells: u32,
    ignores_unused: bool,
}

/// A deformed model that has not been written yet.
#[derive(Clone, Debug)]
pub struct Deformed {
    shape: Shape,
    /// When an animation shows the morph targets.
    timeline: Option<Timeline>,
}

#[derive(Clone, Debug)]
enum Shape {
    /// Vertices, and morph targets beside them. `[n_vertices]` each, object units
    Mesh { vertices: Vec<Vec3>, targets: Vec<(String, Vec<Vec3>)> },
    /// Displacements of the vertices and of the points of the rig, and those of morph targets. `[n_points]` each, object
    /// units
    Rig { by: Vec<DVec3>, targets: Vec<(String, Vec<DVec3>)>, outside: Vec<u32> },
    /// The deformation of space; `None` at rest.
    Space(Option<Field>),
}

/// A written file, and what the user should know about it.
#[derive(Clone, Debug, Default)]
pub struct Written {
    /// Contents of the file.
    pub bytes: Vec<u8>,
    /// Changes to skeleton, morph targets and clips; `None` if the file keeps none.
    pub rig: Option<ReshapeReport>,
    /// Number of splats for which the deformation differs from its first-order approximation by more than 10 % of half
    /// the longest axis, at an end of this axis.
    pub inexact_splats: usize,
    /// Number of frames of a clip that became morph targets.
    pub frames: usize,
    /// What changed beside the shape, and what the format loses, one sentence each.
    pub notices: Vec<String>,
}

/// Part of the notice about splats that bend.
const BENDS: &str = "which an ellipsoid cannot show";

impl Written {
    /// Replaces the number of splats that bend, and the notice about them, after [`Job::split`].
    pub fn set_split(&mut self, n_bent: usize, n_split: usize) {
        self.inexact_splats = n_bent;
        self.notices.retain(|notice| !notice.contains(BENDS));
        self.notices.push(format!(
            "{} by more than 10 % of the longest axis; {n_split} became rows of shorter ones.",
            counted(n_bent, "splat bends", "splats bend")
        ));
    }
}

/// Returns the memory in use while a bound model is written, bytes: `options.held`, the weights of `points` points, and
/// `to_write`, the memory for writing.
///
/// # Errors
/// [`BindError::WeightsMemory`] if the memory limit is exceeded.
pub fn require_memory(
    options: &BindOptions,
    points: usize,
    controls: Controls<'_>,
    to_write: u64,
) -> Result<u64, BindError> {
    let (limit, columns) = (options.memory_limit, controls.n_controls());
    let needed = options.held + weights_bytes(points, columns) + to_write;
    if needed > limit { Err(BindError::WeightsMemory { needed, limit, points, columns }) } else { Ok(needed) }
}

impl<'m> Job<'m> {
    /// Prepares the deformation of a model that is written as `format`.
    ///
    /// # Errors
    /// If the model lacks what an option needs, or its rig cannot be read.
    pub fn new(
        model: impl Into<JobModel<'m>>,
        format: ModelFormat,
        options: &JobOptions,
    ) -> Result<Self, JobError> {
        let mut job = Self::of_kind(model.into(), format, options.shape_only);
        if let Some(clip) = options.clip {
            job = job.with_clip(clip);
        }
        if !options.ignores_unused {
            job.require_effect(options)?;
        }
        job.options = match job.kind {
            Kind::Capture => ResolvedOptions { reshape: options.reshape.clone(), ..job.options },
            _ => options.resolve(job.model(), job.keeps_rig())?,
        };
        let cells = options.cells.unwrap_or(job.cells);
        Ok(Self { cells, ignores_unused: options.ignores_unused, ..job })
    }

    /// Prepares a body whose skeleton other models share ([`Self::skeleton`]). Options that have no effect on it are
    /// ignored, and so are parts that it lacks.
    ///
    /// # Errors
    /// [`JobError::NoSkeleton`] if the model has none, or if its rig cannot be read.
    pub fn of_body(model: impl Into<JobModel<'m>>, options: &JobOptions) -> Result<Self, JobError> {
        let options = JobOptions { shape_only: false, clip: None, ignores_unused: true, ..options.clone() };
        let job = Self::new(model, ModelFormat::Gltf, &options)?;
        if job.kind == Kind::Rig { Ok(job) } else { Err(JobError::NoSkeleton) }
    }

    /// Prepares the deformation of a model whose parts are already selected. Options that have no effect on it are
    /// ignored, such as names in `rigid` that no attachment of its skeleton has.
    ///
    /// # Errors
    /// If its rig cannot be read.
    pub fn from_resolved(
        model: impl Into<JobModel<'m>>,
        format: ModelFormat,
        mut options: ReshapeOptions,
        shape_only: bool,
    ) -> Result<Self, JobError> {
        let job = Self::of_kind(model.into(), format, shape_only);
        if job.keeps_rig() && !options.rigid.is_empty() {
            let props = job.model().props()?;
            options.rigid.retain(|name| props.contains(name));
        }
        Ok(Self { options: ResolvedOptions { reshape: options, ..ResolvedOptions::default() }, ..job })
    }

    /// A job with default options.
    fn of_kind(model: JobModel<'m>, format: ModelFormat, shape_only: bool) -> Self {
        let options = ResolvedOptions::default();
        let mut job = Self { model, format, kind: Kind::Mesh, options, cells: CELLS, ignores_unused: true };
        let own = job.model();
        job.kind = if own.positions.is_empty() {
            Kind::Clips
        } else if own.n_faces() == 0 {
            Kind::Capture
        } else if format == ModelFormat::Gltf && own.is_rigged() && !shape_only {
            Kind::Rig
        } else {
            Kind::Mesh
        };
        job
    }

    /// Checks that every option has an effect on the model.
    fn require_effect(&self, options: &JobOptions) -> Result<(), JobError> {
        let of_mesh = options.first_for_parts().or_else(|| options.first_for_rigs());
        if let (Kind::Capture, Some(option)) = (self.kind, of_mesh) {
            return Err(JobError::NeedsMesh { option });
        }
        if let (Kind::Frames(_), true) = (self.kind, self.format != ModelFormat::Gltf) {
            return Err(JobError::ClipFormat { format: self.format });
        }
        if options.reshape.feet == Feet::Lock && !self.keeps_rig() {
            return Err(JobError::NoFeet);
        }
        let reads_vrm = self.model().vrm().is_some();
        if options.reshape.expressions && !(reads_vrm && self.keeps_rig()) {
            return Err(JobError::NoVrm { reads_vrm });
        }
        Ok(())
    }

    /// Deforms the frames of a clip, which become morph targets, instead of the model with its rig. Captures have no
    /// clips. `clip`: index of the clip.
    #[must_use]
    pub fn with_clip(self, clip: usize) -> Self {
        let kind = match self.kind {
            Kind::Mesh | Kind::Rig => Kind::Frames(clip),
            Kind::Clips | Kind::Capture | Kind::Frames(_) => self.kind,
        };
        Self { kind, ..self }
    }

    /// The model.
    pub fn model(&self) -> &Model {
        match &self.model {
            JobModel::Borrowed(model) => model,
            JobModel::Shared(model) => model,
        }
    }

    /// Format of the file to write.
    pub fn format(&self) -> ModelFormat {
        self.format
    }

    /// Names of parts that the model lacks.
    pub fn missing_parts(&self) -> &[String] {
        &self.options.missing
    }

    /// Notices about names that several parts share, one sentence each. They are also in [`Written::notices`].
    pub fn part_notices(&self) -> &[String] {
        &self.options.notices
    }

    /// Whether the job deforms space instead of bound points, for splats, points and the frames of a clip.
    pub fn uses_field(&self) -> bool {
        matches!(self.kind, Kind::Capture | Kind::Frames(_))
    }

    /// Whether the file keeps skeleton, morph targets and clips.
    pub fn keeps_rig(&self) -> bool {
        matches!(self.kind, Kind::Rig | Kind::Clips)
    }

    /// Lists the model's vertices, and the points of its rig if the file keeps it. Also returns the number of points of
    /// the rig. Object units
    ///
    /// # Errors
    /// If the rig cannot be read.
    pub fn all_points(&self) -> Result<(Vec<Vec3>, usize), JobError> {
        let model = self.model();
        let extra = if self.keeps_rig() { model.extra_points()? } else { Vec::new() };
        let n_extra = extra.len();
        Ok(([model.positions.as_slice(), &extra].concat(), n_extra))
    }

    /// Lists the points to bind to `controls`, which then take `poses`; `None` if there are none. `options`: options of
    /// the bind, where `held` is the memory in use beside the model.
    ///
    /// # Errors
    /// Those of [`Self::check`]; if the rig cannot be read; if the weights, and writing the file, exceed the memory
    /// limit.
    pub fn points<'a>(
        &self,
        controls: impl Into<Controls<'a>>,
        poses: &Poses,
        options: &BindOptions,
    ) -> Result<Option<JobPoints>, JobError> {
        self.check(poses)?;
        let controls = controls.into();
        let options = BindOptions { held: options.held + self.model().bytes(), ..*options };
        let to_write = self.bytes_to_write(poses)?;
        let cells = match self.kind {
            Kind::Clips => return Ok(None),
            Kind::Mesh | Kind::Rig => {
                let (positions, extra_points) = self.all_points()?;
                require_memory(&options, positions.len(), controls, to_write)?;
                let options = BindOptions { extra_points, ..options };
                return Ok(Some(JobPoints { positions, options, lattice: None }));
            }
            Kind::Capture => self.cells,
            Kind::Frames(_) => CLIP_CELLS,
        };
        let options = BindOptions { held: options.held + to_write, ..options };
        let (lattice, options) = Lattice::within(controls.surface(), cells, &options)?;
        Ok(Some(JobPoints { positions: lattice.points(), options, lattice: Some(lattice) }))
    }

    /// Checks that a model with weights of `weights_bytes` bytes can be written within a memory limit, bytes.
    ///
    /// # Errors
    /// [`JobError::Memory`] if it cannot.
    pub fn check_memory_to_write(
        &self,
        poses: &Poses,
        weights_bytes: u64,
        limit: u64,
    ) -> Result<(), JobError> {
        let needed = self.model().bytes() + weights_bytes + self.bytes_to_write(poses)?;
        MemoryError::check(needed, limit)
            .map_err(|source| JobError::Memory { targets: poses.n_targets(), source })
    }

    fn bytes_to_write(&self, poses: &Poses) -> Result<u64, JobError> {
        let n_targets = match self.kind {
            Kind::Frames(clip) => self.model().n_frames(clip)?,
            Kind::Mesh | Kind::Rig | Kind::Clips | Kind::Capture => poses.n_targets(),
        };
        Ok(self.model().bytes_to_write(self.format) + self.model().bytes_of_poses(n_targets))
    }

    /// Checks that the model can take these poses in its format.
    ///
    /// # Errors
    /// If it cannot: several poses need a format with morph targets, and a model that can have them.
    pub fn check(&self, poses: &Poses) -> Result<(), JobError> {
        let Poses::Targets { all, .. } = poses else { return Ok(()) };
        let ReshapeOptions { ground, feet, skeleton, .. } = &self.options.reshape;
        let one = |what| poses.require_shape(what).map(drop);
        match self.kind {
            _ if all.is_empty() => Err(JobError::NoPoses),
            Kind::Capture => one("a capture of splats or points"),
            Kind::Clips => one("a file of clips"),
            Kind::Frames(_) => one("a clip that the cage bends"),
            Kind::Mesh | Kind::Rig if !self.format.holds_poses() => {
                Err(JobError::FormatPoses { format: self.format, n: all.len() })
            }
            Kind::Mesh | Kind::Rig if self.ignores_unused => Ok(()),
            Kind::Mesh | Kind::Rig if *ground => one("the option ground"),
            Kind::Mesh | Kind::Rig if *feet == Feet::Lock => one("the option feet = lock"),
            Kind::Mesh | Kind::Rig if skeleton.is_some() => one("a shared skeleton"),
            Kind::Mesh | Kind::Rig => Ok(()),
        }
    }

    /// Splits the splats that a pose bends by more than 10 % of their longest axis, see `Splats::split` of cagework-core.
    /// Returns the job of the model with their parts, and the numbers of splats that bend and that were split; `None` if
    /// none bends. That model has at most twice as many splats ([`Self::bytes_to_split`]).
    ///
    /// # Errors
    /// [`JobError::NeedsSplats`] if the model is not a capture; those of `follow`.
    pub fn split<F: Follow>(
        &self,
        follow: &F,
        pose: &[Vec3],
    ) -> Result<Option<(Job<'static>, [usize; 2])>, F::Error> {
        let splats = self.model().splats().ok_or(JobError::NeedsSplats)?;
        let split = follow.field(pose)?.and_then(|field| splats.split(&field));
        let Some(split) = split else { return Ok(None) };
        let counts = [split.n_bent, split.n_split];
        let model = self.model().with_splats(split.splats).map_err(JobError::from)?.into();
        let Self { format, kind, options, cells, ignores_unused, .. } = self.clone();
        Ok(Some((Job { model, format, kind, options, cells, ignores_unused }, counts)))
    }

    /// Memory of the job that [`Self::split`] returns, and for writing it, beside this job, bytes.
    #[must_use]
    pub fn bytes_to_split(&self) -> u64 {
        2 * self.model().bytes() + self.model().bytes_to_write(self.format)
    }

    /// Deforms the model by poses of the controls.
    ///
    /// # Errors
    /// As [`Self::check`], and if a pose belongs to another cage.
    pub fn deform<F: Follow>(&self, follow: &F, poses: &Poses) -> Result<Deformed, F::Error> {
        self.check(poses)?;
        let (model, options) = (self.model(), &self.options.reshape);
        let shape = match (self.kind, poses) {
            (Kind::Rig | Kind::Clips, Poses::Shape(pose)) => {
                let by = follow.displacements(model, pose)?;
                Shape::Rig { by, targets: Vec::new(), outside: follow.outside()? }
            }
            (Kind::Rig | Kind::Clips, Poses::Targets { base, all, .. }) => {
                let targets = named(all, |pose| follow.displacements(model, pose))?;
                let by = match base {
                    Some(base) => follow.displacements(model, base)?,
                    None => vec![DVec3::ZERO; targets.first().map_or(0, |(_, by)| by.len())],
                };
                Shape::Rig { by, targets, outside: follow.outside()? }
            }
            (Kind::Mesh, Poses::Shape(pose)) => {
                let mut vertices = follow.vertices(model, pose, &options.parts)?;
                model.lift(&mut vertices, options);
                Shape::Mesh { vertices, targets: Vec::new() }
            }
            (Kind::Mesh, Poses::Targets { base, all, .. }) => {
                let mut targets = named(all, |pose| follow.vertices(model, pose, &options.parts))?;
                let mut vertices = model.positions.clone();
                if let Some(base) = base {
                    vertices = follow.vertices(model, base, &options.parts)?;
                    let low = vertices.first().map_or(0.0, |p| p.y);
                    model.lift(&mut vertices, options);
                    let lift = vertices.first().map_or(0.0, |p| p.y) - low;
                    targets.iter_mut().flat_map(|(_, target)| target).for_each(|p| p.y += lift);
                }
                Shape::Mesh { vertices, targets }
            }
            (Kind::Capture | Kind::Frames(_), poses) => {
                Shape::Space(follow.field(poses.require_shape("space")?)?)
            }
        };
        let timeline = poses.timeline().cloned();
        Ok(Deformed { shape, timeline })
    }

    /// Computes how the joints of the model move in a pose, for clothes and files of clips with the same joints.
    ///
    /// # Errors
    /// [`JobError::NoSkeleton`] if the file keeps no rig, or if it cannot be read; those of `follow`.
    pub fn skeleton<F: Follow>(&self, follow: &F, pose: &[Vec3]) -> Result<Skeleton, F::Error> {
        if self.kind != Kind::Rig {
            return Err(JobError::NoSkeleton.into());
        }
        let by = follow.displacements(self.model(), pose)?;
        let skeleton = self.model().skeleton(&by, &follow.outside()?, &self.options.reshape);
        Ok(skeleton.map_err(|e| self.of_write(e))?)
    }

    /// Adds morph targets to a written file with a moved rig. `targets`: displacements from the shape at rest; the morph
    /// targets are their differences from `by`, the displacements that the file contains.
    fn with_targets(
        &self,
        bytes: &[u8],
        by: &[DVec3],
        mut targets: Vec<(String, Vec<DVec3>)>,
        outside: &[u32],
        options: &ReshapeOptions,
    ) -> Result<Vec<u8>, JobError> {
        for (_, target) in &mut targets {
            target.iter_mut().zip(by).for_each(|(target, by)| *target -= *by);
        }
        let mut moved =
            Model::read("moved.glb", bytes, &mut |_| None).map_err(|e| JobError::Read(Box::new(e)))?;
        moved.set_up(self.model().up());
        moved.set_origin(self.model().origin());
        let ReshapeOptions { timeline, rigid, parts, expressions, .. } = options.clone();
        let options = ReshapeOptions { timeline, rigid, parts, expressions, ..ReshapeOptions::default() };
        let still = vec![DVec3::ZERO; by.len()];
        let written = moved.write_reshaped(&still, outside, &targets, &options);
        Ok(written.map_err(|e| self.of_write(e))?.0)
    }

    /// Writes the deformed model.
    ///
    /// # Errors
    /// If the weights lack points of the rig, or the file cannot be written in this format.
    pub fn write(&self, deformed: Deformed) -> Result<Written, JobError> {
        let (model, format) = (self.model(), self.format);
        let mut written = Written { notices: self.options.notices.clone(), ..Written::default() };
        let Deformed { shape, timeline } = deformed;
        match shape {
            Shape::Rig { by, targets, outside } => {
                let options = ReshapeOptions { timeline, ..self.options.reshape.clone() };
                let is_moved = by.iter().any(|by| *by != DVec3::ZERO);
                let first = if is_moved { &[] } else { &*targets };
                let reshaped = model.write_reshaped(&by, &outside, first, &options);
                let (bytes, report) = reshaped.map_err(|e| self.of_write(e))?;
                written.bytes = if is_moved && !targets.is_empty() {
                    self.with_targets(&bytes, &by, targets, &outside, &options)?
                } else {
                    bytes
                };
                written.notices.extend(report.notices());
                written.rig = Some(report);
            }
            Shape::Mesh { vertices, targets } if targets.is_empty() => {
                written.bytes = model.write(format, &vertices)?;
            }
            Shape::Mesh { vertices, targets } => {
                written.bytes = match &timeline {
                    None => model.write_glb_poses(&vertices, &targets)?,
                    Some(timeline) => model.write_glb_poses_at(&vertices, &targets, timeline)?,
                };
            }
            Shape::Space(field) => {
                if let Kind::Frames(clip) = self.kind {
                    return self.write_frames(clip, field.as_ref(), written);
                }
                written.bytes = match &field {
                    Some(field) => model.write_in_field(format, field)?,
                    None => model.write(format, &model.positions)?,
                };
                let splats = model.splats().zip(field.as_ref());
                written.inexact_splats = splats.map_or(0, |(splats, field)| splats.n_inexact(field));
                if written.inexact_splats > 0 {
                    written.notices.push(format!(
                        "{} by more than 10 % of the longest axis, {BENDS}.",
                        counted(written.inexact_splats, "splat bends", "splats bend")
                    ));
                }
            }
        }
        written.notices.extend(model.lost_in(format));
        written.notices.extend(model.copies_in(format, &written.bytes));
        Ok(written)
    }

    /// Writes the frames of a clip as morph targets, each deformed with the space around it.
    fn write_frames(
        &self,
        clip: usize,
        field: Option<&Field>,
        written: Written,
    ) -> Result<Written, JobError> {
        let model = self.model();
        let (mut frames, mut rest) = (model.frames(clip)?, model.positions.clone());
        if let Some(field) = field {
            frames.iter_mut().chain([&mut rest]).for_each(|frame| bend_vertices(field, frame));
        }
        let n = frames.len();
        let became = if n == 1 { "frame became a morph target" } else { "frames became morph targets" };
        let mut notices = written.notices;
        notices.push(format!("{n} {became}; the skeleton is left out"));
        let bytes = model.write_baked(clip, &rest, frames)?;
        Ok(Written { bytes, frames: n, notices, ..Written::default() })
    }

    /// Names what is missing if the weights do not include the points of the rig.
    fn of_write(&self, error: WriteError) -> JobError {
        let n = self.model().positions.len();
        match error {
            WriteError::Count { given, expected } if self.kind == Kind::Rig => {
                JobError::RigPoints { given: given.saturating_sub(n), expected: expected - n }
            }
            error => JobError::Write(error),
        }
    }
}

/// Applies a function to each pose, and keeps the names.
fn named<T, E>(
    poses: &[NamedPose],
    mut deform: impl FnMut(&[Vec3]) -> Result<T, E>,
) -> Result<Vec<(String, T)>, E> {
    poses.iter().map(|pose| Ok((pose.name.clone(), deform(&pose.positions)?))).collect()
}
