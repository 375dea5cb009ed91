//! `cagework deform --clip`: the cage follows the clip of a rig that is fitted to the model.

use std::path::{Path, PathBuf};

use cagework_core::BindOptions;
use cagework_core::bind::BindError;
use cagework_core::words::{counted, decimals};
use cagework_io::{Clip, Model, UpAxis, json_fault, shown, without_byte_order_mark};
use cagework_job::{
    BoundPoints, ClipRig, FigureSurface, Job, MAX_BEND, NamedPose, PoseTimes, Poses, Written,
};
use cagework_pose::figure::{BentJoint, Figure, Fit, FitSource, NamedJoints};
use glam::Vec3;
use serde::Serialize;

use super::{check_inputs, job_options};
use crate::args::{CageSource, ControlArgs, DeformArgs, ModelOutput, SmoothArgs};
use crate::bind::bind_job;
use crate::controls::rest_of;
use crate::error::CliError;
use crate::files::{check_outputs, is_newer, is_stream, json, print, read, refuse_files_read, write};
use crate::load::{load_any, load_cage, load_weights, load_with_clips, states_of};
use crate::progress::Bar;

/// Largest number of frames of a sequence.
const MAX_FRAMES: usize = 10_000;

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct ClipSummary {
    /// First file of the sequence, or the only file.
    output: String,
    clip: String,
    frames: usize,
    /// Number of frames that `--resume` skipped.
    skipped: usize,
    seconds: f32,
    /// What the joints were fitted by.
    fitted_by: FitSource,
    /// Factor by which the travel of the hips is scaled.
    travel: f64,
    /// Elbow or knee that bends most: the bone below it, its angle and its time.
    #[serde(skip_serializing_if = "Option::is_none")]
    most_bent: Option<MostBent>,
    /// Largest number of splats in a frame that bend too much for an ellipsoid.
    inexact_splats: usize,
    /// Largest number of splats in a frame that were split.
    split_splats: usize,
    notices: Vec<String>,
}

#[derive(Debug, Serialize)]
struct MostBent {
    bone: String,
    degrees: f64,
    seconds: f32,
}

fn surface_of(model: &Model) -> Result<FigureSurface, CliError> {
    let (points, triangles) = states_of(model, None)?;
    FigureSurface::new(points, triangles, &Bar::start()).map_err(|e| BindError::Cancelled(e).into())
}

/// Runs `cagework deform --clip`.
///
/// # Errors
/// If a file cannot be read or written, the rig is not a humanoid with this clip, or the bind fails.
pub(super) fn run(
    args: &DeformArgs,
    (name, rig): (&str, &Path),
    output: &ModelOutput,
    as_json: bool,
) -> Result<(), CliError> {
    let mut inputs = vec![args.mesh.as_path(), rig];
    inputs.extend(args.weights.as_deref());
    inputs.extend(args.clip.joints_in.as_deref());
    if let CageSource::File(path) = &args.cage {
        inputs.push(path);
    }
    let outputs = [Some(output.path.as_path()), args.clip.joints_out.as_deref()];
    check_outputs(&outputs.into_iter().flatten().collect::<Vec<_>>(), &inputs)?;

    let memory = args.read.memory;
    let (of_rig, of_output) = (|e| CliError::job(rig, e), |e| CliError::job(&output.path, e));
    let model = load_any(&args.mesh, args.read.axis(), memory)?;
    // glTF files have y up.
    let rig_model = load_with_clips(rig, UpAxis::Y, memory)?;
    let clips = ClipRig::new(&rig_model, &args.clip.bone).map_err(of_rig)?;
    let clip = Clip::named(clips.clips(), name).map_err(|e| CliError::file(rig, e))?;
    let seconds = clips.clips()[clip].seconds;
    let times = times(seconds, args.clip.fps)?;
    let job = Job::new(&model, output.format, &job_options(args, &model)?);
    let job = job.map_err(|e| CliError::job(&args.mesh, e))?;
    check_inputs(args, job.uses_field())?;
    let controls = ControlArgs { smooth: SmoothArgs { smooth: args.smooth }, ..ControlArgs::default() };
    let cage = load_cage(&args.cage, &model, memory, &controls)?;
    let saved = args.weights.as_deref().map(|path| load_weights(path, &model, &cage.cage, memory));
    let saved = saved.transpose()?;
    let rest = saved.as_ref().map_or_else(|| cage.controls().rest().to_vec(), |s| rest_of(&cage.cage, s));

    let mut notices = model.notices.clone();
    let surface = surface_of(&model)?;
    let own = if rig_model.n_faces() > 0 { surface_of(&rig_model)? } else { FigureSurface::default() };
    let (fit, notice) = clips.fit(&own, &surface);
    notices.extend(notice);
    let fit = with_given_joints(args, &model, fit)?;
    if let Some(path) = &args.clip.joints_out {
        let named = fit.figure.named(|p| model.up().vector_turned_back(p) + model.origin());
        write(path, json(&named).as_bytes())?;
    }
    let poses = clips.drive(&fit, &surface, &rest, cage.rings());

    let held = rig_model.bytes() + if args.split { job.bytes_to_split() } else { 0 };
    let options = BindOptions { memory_limit: memory.bytes(), held, ..BindOptions::default() };
    let at_rest = Poses::Shape(rest.clone());
    let bound = match saved {
        Some(saved) => BoundPoints::from_saved(saved, rest),
        None => bind_job(&job, cage.controls(), &at_rest, &options, &args.mesh)?,
    };
    let mut summary = ClipSummary {
        output: output.path.display().to_string(),
        clip: name.to_owned(),
        frames: times.len(),
        skipped: 0,
        seconds,
        fitted_by: fit.source,
        travel: poses.travel(),
        most_bent: None,
        inexact_splats: 0,
        split_splats: 0,
        notices,
    };
    let all: Vec<(Vec<Vec3>, Option<BentJoint>)> = times.iter().map(|&at| poses.at(clip, at)).collect();
    summary.set_most_bent(&times, &all);
    if job.uses_field() || !output.format.holds_poses() {
        inputs.retain(|path| path.exists());
        if is_stream(&output.path) {
            return Err(CliError::Mismatch {
                message: "a sequence of frames is several files: it cannot be written to standard output"
                    .to_owned(),
                hint: "give a file name, such as walk.ply",
            });
        }
        let paths: Vec<PathBuf> = (1..=times.len()).map(|k| numbered(&output.path, k, times.len())).collect();
        refuse_files_read(&paths.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        for (path, (pose, _)) in paths.iter().zip(all) {
            if args.clip.resume && is_newer(path, &inputs) {
                summary.skipped += 1;
                continue;
            }
            let of_frame = |e| CliError::job(path, e);
            let split = if args.split { job.split(&bound, &pose).map_err(of_frame)? } else { None };
            let own = split.as_ref().map_or(&job, |(job, _)| job);
            let written = own.deform(&bound, &Poses::Shape(pose)).and_then(|deformed| own.write(deformed));
            let mut written = written.map_err(of_frame)?;
            write(path, &written.bytes)?;
            if let Some((_, [n_bent, n_split])) = split {
                written.set_split(n_bent, n_split);
                summary.split_splats = summary.split_splats.max(n_split);
            }
            summary.count(&written);
        }
        summary.output = paths.first().map_or_else(String::new, |path| path.display().to_string());
    } else {
        let named = times
            .iter()
            .zip(all)
            .map(|(at, (positions, _))| NamedPose { name: format!("{} s", decimals(*at, 3)), positions });
        let keys = PoseTimes { keys: times.clone(), ..PoseTimes::default() };
        let poses = Poses::targets(named.collect(), &keys, false)?;
        job.check_memory_to_write(&poses, 0, memory.bytes()).map_err(of_output)?;
        let written =
            job.deform(&bound, &poses).and_then(|deformed| job.write(deformed)).map_err(of_output)?;
        write(&output.path, &written.bytes)?;
        summary.count(&written);
    }
    print(&if as_json { json(&summary) } else { summary.text() })
}

/// Times of the frames, seconds.
fn times(seconds: f32, fps: f32) -> Result<Vec<f32>, CliError> {
    // A clip of two seconds, give or take rounding, has a frame at its end.
    let n = (f64::from(seconds) * f64::from(fps) + 1e-3).floor() as usize + 1;
    if n > MAX_FRAMES {
        return Err(CliError::Mismatch {
            message: format!("{n} frames in {seconds} s, above the limit of {MAX_FRAMES}"),
            hint: "give a smaller --fps",
        });
    }
    Ok((0..n).map(|k| (k as f64 / f64::from(fps)).min(f64::from(seconds)) as f32).collect())
}

/// Path of a frame: `walk-0001.ply`. All frames of a sequence have the same number of digits, at least four.
fn numbered(path: &Path, frame: usize, n: usize) -> PathBuf {
    let digits = n.to_string().len().max(4);
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let name = format!("{}-{frame:0digits$}.{}", part(path.file_stem()), part(path.extension()));
    path.with_file_name(name)
}

/// Replaces fitted joints by those of `--joints-in`.
fn with_given_joints(args: &DeformArgs, model: &Model, fit: Fit) -> Result<Fit, CliError> {
    let Some(path) = &args.clip.joints_in else { return Ok(fit) };
    let bytes = read(path)?;
    let text = without_byte_order_mark(&bytes);
    let named: NamedJoints =
        serde_json::from_slice(text).map_err(|e| CliError::file(path, json_fault(text, &e)))?;
    let given = Figure::of_named(&named, |p| model.up().vector_turned(p - model.origin()));
    Ok(fit.with_joints(&given.map_err(|e| CliError::file(path, e))?))
}

impl ClipSummary {
    fn set_most_bent(&mut self, times: &[f32], frames: &[(Vec<Vec3>, Option<BentJoint>)]) {
        let bends = times.iter().zip(frames).filter_map(|(at, (_, bent))| Some((*at, (*bent)?)));
        let beyond = bends.clone().filter(|(_, bent)| bent.degrees > MAX_BEND).count();
        let most = bends.max_by(|a, b| a.1.degrees.total_cmp(&b.1.degrees));
        if beyond > 0 {
            self.notices.push(format!(
                "in {} an elbow or a knee bends by more than {MAX_BEND} degrees, where its inner side collapses",
                counted(beyond, "frame", "frames")
            ));
        }
        self.most_bent = most.map(|(seconds, bent)| MostBent {
            bone: bent.bone.to_string(),
            degrees: bent.degrees,
            seconds,
        });
    }

    /// Adds what was written.
    fn count(&mut self, written: &Written) {
        self.inexact_splats = self.inexact_splats.max(written.inexact_splats);
        for notice in &written.notices {
            // The counts of splats differ from frame to frame, and are in the summary.
            let is_known = self.notices.contains(notice) || notice.contains("10 % of the longest axis");
            if !is_known {
                self.notices.push(notice.clone());
            }
        }
    }

    fn text(&self) -> String {
        let by = match self.fitted_by {
            FitSource::Limbs => "the limbs of both models",
            FitSource::Bounds => "the height",
            FitSource::Given => "the file of --joints-in",
        };
        let mut out = format!(
            "clip {} ({} s), joints fitted by {by}, travel scaled by {}\n",
            shown(&self.clip),
            decimals(self.seconds, 2),
            decimals(self.travel as f32, 2),
        );
        if let Some(MostBent { bone, degrees, seconds }) = &self.most_bent {
            out += &format!("most bent: {bone}, by {degrees:.0} degrees at {} s\n", decimals(*seconds, 2));
        }
        if self.inexact_splats > 0 {
            out += &format!(
                "splats that bend by more than 10 %: up to {} in a frame{}\n",
                self.inexact_splats,
                if self.split_splats > 0 {
                    format!(", {} of them split", self.split_splats)
                } else {
                    String::new()
                }
            );
        }
        out += &format!(
            "wrote {}, from {}",
            counted(self.frames - self.skipped, "frame", "frames"),
            shown(&self.output)
        );
        if self.skipped > 0 {
            out += &format!("; {} were up to date", self.skipped);
        }
        out.push('\n');
        for notice in &self.notices {
            out += &format!("note: {notice}\n");
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_numbers_of_equal_length_and_the_ends_of_the_clip() {
        assert_eq!(numbered(Path::new("a/walk.ply"), 7, 49), Path::new("a/walk-0007.ply"));
        assert_eq!(numbered(Path::new("walk.x.spz"), 7, 10_000), Path::new("walk.x-00007.spz"));
        assert_eq!(times(2.0, 2.0).unwrap(), [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(times(0.0, 24.0).unwrap(), [0.0]);
        // 49 frames of 1/24 s, of a clip that ends within rounding of the last one.
        assert_eq!(times(1.999_999_9, 24.0).unwrap().len(), 49);
        let error = times(100.0, 120.0).unwrap_err().message();
        assert!(error.contains("12001 frames") && error.contains("10000"), "{error}");
    }
}
