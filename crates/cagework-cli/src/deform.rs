//! `cagework deform`: deforms a bound mesh by poses of its cage.

use std::path::Path;
use std::time::Instant;

use cagework_core::Cage;
use cagework_core::deform::{deform_bound, displacements, outside_in_words};
use cagework_core::words::counted;
use cagework_io::{
    MemoryError, Model, ModelFormat, ReshapeOptions, ReshapeReport, SavedWeights, Timeline, read_weights_npz,
    shown,
};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::{CageSource, ControlArgs, DeformArgs, MemoryArgs, ModelOutput};
use crate::bind::export;
use crate::controls::{inner_controls_text, rest_of, with_inner};
use crate::error::CliError;
use crate::field::{self, LatticeSummary};
use crate::files::{check_outputs, json, print, read, shown_path, write};
use crate::load::{load_any, load_cage};
use crate::{capture, dynamic, rig};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct DeformSummary {
    output: String,
    vertices: usize,
    cage_vertices: usize,
    inner_controls: usize,
    outside_vertices: usize,
    /// Number of vertices outside the cage that do not follow it at all.
    staying_vertices: usize,
    poses: Vec<String>,
    /// Whether the poses are expressions of a VRM.
    #[serde(skip)]
    expressions: bool,
    /// Length of the animation; `None` without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    animation_seconds: Option<f32>,
    /// Changes to skeleton, morph targets and clips; `None` if the model has no rig or `--static` drops it.
    #[serde(flatten)]
    rig: Option<ReshapeReport>,
    /// Time to compute all poses, without reading and writing files, ms.
    deform_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    lattice: Option<LatticeSummary>,
    notices: Vec<String>,
}

/// Runs `cagework deform`.
///
/// # Errors
/// If a file cannot be read or written, or files do not match.
pub(crate) fn run(args: &DeformArgs, as_json: bool) -> Result<(), CliError> {
    if let (Some(clip), Some(output)) = (&args.dynamic, &args.output) {
        return dynamic::run(args, clip, output, as_json);
    }
    let mut inputs = vec![args.mesh.as_path()];
    inputs.extend(args.weights.as_deref());
    inputs.extend(args.pose.iter().chain(&args.pose_controls).map(AsRef::<Path>::as_ref));
    if let CageSource::File(path) = &args.cage {
        inputs.push(path);
    }
    let outputs = args.output.iter().map(|output| output.path.as_path()).chain(args.lattice.as_deref());
    check_outputs(&outputs.collect::<Vec<_>>(), &inputs)?;
    let model = load_any(&args.mesh, args.read.axis(), args.read.memory)?;
    let is_capture = model.n_faces() == 0;
    if args.smooth > 0 && args.lattice.is_none() && !is_capture {
        return Err(CliError::Mismatch {
            message: "--smooth applies to --dynamic, --lattice, splats and points only: weights contain their steps"
                .into(),
            hint: "leave out --smooth",
        });
    }
    if is_capture {
        let why = "this option needs a mesh: splats and points have neither joints nor parts";
        args.rig.refuse(true, why, "leave the option out")?;
    }
    if args.lattice.is_some() {
        let why = "this option changes a model, but a lattice stores how the space inside the cage moves";
        let hint = "leave the option out, or write the model and the lattice in two runs";
        args.rig.refuse(args.output.is_none(), why, hint)?;
    }
    let lattice = args.lattice.as_deref().map(|path| field::write_lattice(args, path, &model)).transpose()?;
    match (&args.output, &args.weights, &lattice) {
        (Some(output), _, _) if is_capture => {
            // Fails if --times or --interpolation is given.
            timeline(args, &[], 1)?;
            if args.expression || !args.name.is_empty() {
                return Err(CliError::Mismatch {
                    message: "--name and --expression need a mesh, but the model has no faces".into(),
                    hint: "leave them out",
                });
            }
            capture::deform(args, &model, output, lattice, as_json)
        }
        (Some(output), Some(weights), _) => deform(args, &model, weights, output, lattice, as_json),
        (None, _, Some(lattice)) => print(&if as_json { json(lattice) } else { lattice.text() }),
        _ => Err(CliError::Mismatch {
            message: "the mesh can only be deformed with its weights".into(),
            hint: "give --weights, which `cagework bind` writes",
        }),
    }
}

/// Deforms the mesh by all poses with the given weights, and writes the result and a summary.
fn deform(
    args: &DeformArgs,
    model: &Model,
    weights: &Path,
    output_file: &ModelOutput,
    lattice: Option<LatticeSummary>,
    as_json: bool,
) -> Result<(), CliError> {
    let (output, format) = (&output_file.path, output_file.format);
    let require_room = |n_poses: usize| {
        if format.holds_poses() || n_poses <= 1 {
            return Ok(());
        }
        Err(CliError::Mismatch {
            message: format!(
                "{}: format {} stores one pose, but there are {n_poses}",
                shown_path(output),
                format.name(),
            ),
            hint: "write a .glb, which stores one morph target per pose, or run the command once per pose",
        })
    };
    require_room(args.pose.len())?;
    check_names(args)?;
    if args.expression && (model.vrm().is_none() || format != ModelFormat::Gltf) {
        return Err(CliError::Mismatch {
            message: format!(
                "--expression needs a VRM to read and to write, but {}",
                match model.vrm() {
                    None => format!("{} has no VRM data", shown_path(&args.mesh)),
                    Some(_) => format!("{} is none", shown_path(output)),
                }
            ),
            hint: "leave it out: several poses are written as morph targets to a .glb",
        });
    }

    let cage = load_cage(&args.cage, model, args.read.memory, &ControlArgs::default())?;
    let saved = load_weights(weights, model, &cage.cage, args.read.memory)?;
    let n_vertices = model.positions.len();
    let (n_cage, n_inner) = (cage.cage.n_vertices(), saved.inner_controls.len());
    let (mut names, mut poses, mut seconds) = (Vec::new(), Vec::new(), Vec::new());
    for (k, path) in args.pose.iter().enumerate() {
        let name = args.name.get(k).cloned().unwrap_or_else(|| pose_name(path));
        for state in cage.load_states(path)? {
            names.push(format!("{name} {}", state.name).trim_end().to_owned());
            seconds.extend(state.seconds);
            poses.push(state.positions);
        }
    }
    require_room(poses.len())?;
    args.rig.check_clips(model, &args.mesh, poses.len())?;
    let to_write = model.bytes_to_write(format) + model.bytes_of_poses(poses.len());
    MemoryError::check(model.bytes() + saved.weights.bytes() as u64 + to_write, args.read.memory.bytes())
        .map_err(|e| CliError::file(output, format!("for {} poses {e}", poses.len())))?;
    let poses = with_inner(
        poses,
        &args.pose_controls,
        &saved.inner_controls,
        (model.up(), model.origin()),
        args.read.memory,
    )?;
    let timeline = timeline(args, &seconds, poses.len())?;
    let rest = rest_of(&cage.cage, &saved);
    let animation_seconds = timeline.as_ref().map(Timeline::seconds);
    let expressions = args.expression;
    let (of_rig, of_names) = args.rig.options(model, &args.mesh)?;
    let options = ReshapeOptions { timeline, expressions, ..of_rig };
    let outside = || saved.outside.iter().filter(|o| (o.vertex as usize) < n_vertices);
    let outside_vertices = outside().count();
    let staying_vertices = outside().filter(|o| o.share == 0.0).count();
    let mut notices = model.notices.clone();
    notices.extend(of_names);
    notices.extend(outside_in_words(outside(), cage.cage.diagonal()));
    let misfit = misfit(&saved, model, &cage.cage) / f64::from(cage.cage.diagonal());
    if misfit > MAX_MISFIT {
        notices.push(format!(
            "at rest the weights miss the mesh by up to {:.2} % of the cage's size: they are those of another mesh or \
             cage, or of the classic method",
            100.0 * misfit
        ));
    }
    let poses = Poses { names, rest, positions: poses };
    let started = Instant::now();
    let deformation = Deformation::new(model, saved, &poses, format, (&options, args.rig.shape_only));
    let deform_ms = started.elapsed().as_secs_f64() * 1e3;
    let (bytes, rig) = deformation.into_file(model, &poses.names, output_file, &options)?;
    notices.extend(rig.iter().flat_map(ReshapeReport::notices));
    notices.extend(model.lost_in(format));
    notices.extend(model.copies_in(format, &bytes));
    write(output, &bytes)?;

    let summary = DeformSummary {
        output: output.display().to_string(),
        vertices: n_vertices,
        cage_vertices: n_cage,
        inner_controls: n_inner,
        outside_vertices,
        staying_vertices,
        poses: poses.names,
        expressions,
        animation_seconds,
        rig,
        deform_ms,
        lattice,
        notices,
    };
    print(&if as_json { json(&summary) } else { text(&summary) })
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

/// Returns the times at which the animation shows the poses; `None` if the output gets no animation: for a single pose,
/// and for expressions without `--times` and `--interpolation`. `seconds`: key times of the poses that are keyframes.
fn timeline(args: &DeformArgs, seconds: &[f32], n_poses: usize) -> Result<Option<Timeline>, CliError> {
    let DeformArgs { times, interpolation, .. } = args;
    let is_plain = times.is_empty() && interpolation.is_none();
    if args.expression && is_plain {
        return Ok(None);
    }
    if n_poses < 2 && !args.expression {
        return if is_plain {
            Ok(None)
        } else {
            Err(CliError::Mismatch {
                message:
                    "--times and --interpolation need an animation, but one pose gives the deformed model"
                        .into(),
                hint: "leave them out, or give the cage at rest as another pose",
            })
        };
    }
    let timeline = if times.is_empty() {
        // Key times of several files are unrelated, so they are used only if all poses are in one file.
        let is_clip = args.pose.len() == 1 && seconds.len() == n_poses;
        if is_clip { Timeline::at_keys(seconds) } else { Timeline::every_second(n_poses) }
    } else if times.len() == n_poses {
        let hint = "give the poses in the order of their times";
        Timeline::new(times, None)
            .map_err(|e| CliError::Mismatch { message: format!("--times: {e}"), hint })?
    } else {
        return Err(CliError::Mismatch {
            message: format!("--times: {} for {n_poses} poses", counted(times.len(), "time", "times")),
            hint: "give one time per pose; each keyframe of a clip and each shape key in a file is a pose",
        });
    };
    Ok(Some(timeline.with(interpolation.unwrap_or_default())))
}

/// Poses of the cage and its inner controls.
pub(crate) struct Poses {
    pub(crate) names: Vec<String>,
    /// Positions of the controls at rest. `[n_controls]`, object units
    pub(crate) rest: Vec<Vec3>,
    /// Positions of the controls in each pose. `[n_poses][n_controls]`, object units
    pub(crate) positions: Vec<Vec<Vec3>>,
}

/// A model deformed by all poses.
pub(crate) enum Deformation {
    /// A rigged model: displacements of all bound points, `[n_poses][n_points]`, object units, and indices of the
    /// points outside the cage.
    Rig { by: Vec<Vec<DVec3>>, outside: Vec<u32> },
    /// A model that is written without a rig: vertex positions in each pose. `[n_poses][n_vertices]`, object units
    Shape(Vec<Vec<Vec3>>),
}

impl Deformation {
    /// Deforms a model by all poses. Its rig is ignored if `shape_only` is set or `format` is not glTF.
    pub(crate) fn new(
        model: &Model,
        saved: SavedWeights,
        poses: &Poses,
        format: ModelFormat,
        (options, shape_only): (&ReshapeOptions, bool),
    ) -> Self {
        if format == ModelFormat::Gltf && model.is_rigged() && !shape_only {
            let by = |pose: &Vec<Vec3>| displacements(&saved.weights, &saved.frames, &poses.rest, pose);
            let by = poses.positions.iter().map(by).collect();
            return Self::Rig { by, outside: saved.outside.iter().map(|o| o.vertex).collect() };
        }
        let saved = saved.of_vertices();
        let bound = (&saved.weights, &saved.frames);
        let posed = |pose: &Vec<Vec3>| model.deformed(bound, (&poses.rest, pose), options);
        Self::Shape(poses.positions.iter().map(posed).collect())
    }

    /// Encodes the model: deformed by one pose, or at rest with the poses as morph targets if there are several or if
    /// they become expressions of a VRM. Also returns a report of the changes to its rig.
    ///
    /// # Errors
    /// If the weights lack the rig's points, or the model cannot be written in that format.
    pub(crate) fn into_file(
        self,
        model: &Model,
        names: &[String],
        output: &ModelOutput,
        options: &ReshapeOptions,
    ) -> Result<(Vec<u8>, Option<ReshapeReport>), CliError> {
        match self {
            Self::Rig { by, outside } => {
                let (bytes, report) = rig::write(model, &outside, names, by, (&output.path, options))?;
                Ok((bytes, Some(report)))
            }
            Self::Shape(posed) => {
                let bytes = if let [only] = posed.as_slice() {
                    export(model, only, output)?
                } else {
                    let named: Vec<(String, Vec<Vec3>)> = names.iter().cloned().zip(posed).collect();
                    let glb = match &options.timeline {
                        None => model.write_glb_poses(&model.positions, &named),
                        Some(timeline) => model.write_glb_poses_at(&model.positions, &named, timeline),
                    };
                    glb.map_err(|e| CliError::file(&output.path, e))?
                };
                Ok((bytes, None))
            }
        }
    }
}

/// Largest distance of a vertex from its position by the weights, at rest, as a fraction of the cage's diagonal. Weights
/// of this mesh and this cage are off by rounding only, except those of the classic method, which restores no rows.
const MAX_MISFIT: f64 = 1e-3;

/// Reads weights, and checks that they match the mesh and the cage.
///
/// # Errors
/// If the file cannot be read, or its numbers of vertices differ from those of mesh and cage.
pub(crate) fn load_weights(
    path: &Path,
    model: &Model,
    cage: &Cage,
    memory: MemoryArgs,
) -> Result<SavedWeights, CliError> {
    let saved = read_weights_npz(&read(path)?, memory.bytes()).map_err(|e| CliError::file(path, e))?;
    let (n_vertices, n_cage) = (model.positions.len(), cage.n_vertices());
    let n_bound =
        (saved.weights.n_columns() - saved.frames.n_columns()).saturating_sub(saved.inner_controls.len());
    if (saved.n_vertices(), n_bound) == (n_vertices, n_cage) {
        return Ok(saved);
    }
    Err(CliError::Mismatch {
        message: format!(
            "{}: has weights of {} mesh vertices for {} cage vertices, but the mesh has {n_vertices} vertices and \
             the cage {n_cage}",
            shown_path(path),
            saved.n_vertices(),
            n_bound,
        ),
        hint: "use the mesh and the cage that were bound, or bind these again",
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

fn text(summary: &DeformSummary) -> String {
    let poses = match summary.poses.as_slice() {
        [only] if !summary.expressions => format!("pose {}", shown(only)),
        all => {
            let kind = if summary.expressions { "VRM expressions" } else { "morph targets" };
            let names = shown(&all.join(", "));
            let clip = summary.animation_seconds.map(|s| format!(" and an animation of {s} s"));
            let n = counted(all.len(), "pose", "poses");
            format!("{n} as {kind} ({names}){}", clip.unwrap_or_default())
        }
    };
    let mut out = format!(
        "deformed {} vertices by {} cage vertices{} in {:.1} ms\nwrote {}: {poses}\n",
        summary.vertices,
        summary.cage_vertices,
        inner_controls_text(summary.inner_controls),
        summary.deform_ms,
        shown(&summary.output)
    );
    out += &summary.lattice.as_ref().map_or_else(String::new, LatticeSummary::text);
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
