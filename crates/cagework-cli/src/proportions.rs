//! `cagework proportions`: changes the proportions of a humanoid through its cage.

use std::collections::BTreeMap;
use std::path::Path;

use cagework_core::deform::outside_in_words;
use cagework_core::words::counted;
use cagework_io::{ReshapeReport, shown};
use cagework_job::{Job, JobOptions, Poses};
use cagework_pose::humanoid::{BoneJoint, BoneSource};
use cagework_pose::proportions::{HumanoidCage, PRESETS, Preset, ProportionRange};
use glam::Vec3;
use serde::Serialize;

use crate::args::{CageSource, ControlArgs, ProportionsArgs};
use crate::bind::{bind_positions, save_cage};
use crate::error::CliError;
use crate::files::{check_outputs, json, print, refuse_files_read, write};
use crate::load::{LoadedCage, load_cage, load_model};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Summary {
    #[serde(skip_serializing_if = "Option::is_none")]
    output: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<String>,
    /// Factors other than 1, by name.
    factors: BTreeMap<String, f64>,
    vertices: usize,
    cage_vertices: usize,
    /// What told which joint is which bone.
    bones_by: BoneSource,
    bones: Vec<BoneJoint>,
    /// Factors beyond which parts of the model fold; `None` without `--ranges`.
    #[serde(skip_serializing_if = "Option::is_none")]
    ranges: Option<Vec<ProportionRange>>,
    #[serde(flatten)]
    rig: Option<ReshapeReport>,
    notices: Vec<String>,
}

/// Runs `cagework proportions`.
///
/// # Errors
/// If a file cannot be read or written, the model is not a humanoid, or the bind fails.
pub(crate) fn run(args: &ProportionsArgs, as_json: bool) -> Result<(), CliError> {
    let Some(mesh) = args.mesh.as_deref().filter(|_| !args.presets) else {
        return print(&if as_json { json(&PRESETS) } else { PRESETS.iter().map(preset_text).collect() });
    };
    let outputs = args.output.iter().chain(&args.pose_out).map(|output| output.path.as_path());
    let outputs: Vec<&Path> = outputs.chain(args.save_cage.as_deref()).collect();
    let mut inputs = vec![mesh];
    if let CageSource::File(path) = &args.cage {
        inputs.push(path);
    }
    inputs.extend(args.pose.as_deref());
    check_outputs(&outputs, &inputs)?;

    let model = load_model(mesh, args.read.axis(), args.read.memory)?;
    let (rig, humanoid) = model.humanoid(&args.bone).map_err(|e| CliError::file(mesh, e))?;
    let loaded = load_cage(&args.cage, &model, args.read.memory, &ControlArgs::default())?;
    if let Some(output) = &args.pose_out {
        loaded.require_order_in(output)?;
    }
    refuse_files_read(&outputs)?;
    let mut options = args.rig.job_options(false);
    options.reshape.ground = true;
    if args.output.is_none() {
        // Only the vertices are bound, for the pose of the cage.
        options = JobOptions { shape_only: true, ..JobOptions::default() };
    }
    let format = args.output.as_ref().map_or_else(|| model.format(), |output| output.format);
    let of_mesh = |e| CliError::job(mesh, e);
    let job = Job::new(&model, format, &options).map_err(of_mesh)?;
    let at_rest = Poses::Shape(loaded.cage.positions().to_vec());
    let bind_options = args.solve.options(args.grid, args.read.memory);
    let points = job.points(loaded.controls(), &at_rest, &bind_options).map_err(of_mesh)?;
    let points = points.ok_or_else(|| CliError::file(mesh, "has no vertices"))?;
    let bound = bind_positions(&points.positions, loaded.controls(), args.solve.on_gpu(), &points.options)?;
    let rest = loaded.cage.positions();
    let cage = HumanoidCage::new(rest, loaded.rings(), &model.positions, &rig, &humanoid);
    let cage = cage.with_bind(&bound.weights, &model.positions, &rig, &humanoid);
    let pose = pose_of(args, &loaded, &cage)?;
    let ranges = || cage.ranges(&bound.weights, &bound.frames, &model.positions, &model.triangles);
    let mut summary = Summary {
        output: args.output.as_ref().map(|output| output.path.display().to_string()),
        pose: args.pose_out.as_ref().map(|output| output.path.display().to_string()),
        factors: args.factors.0.named(),
        vertices: model.positions.len(),
        cage_vertices: rest.len(),
        bones_by: humanoid.source(),
        bones: humanoid.named(&rig),
        ranges: args.ranges.then(ranges),
        rig: None,
        notices: model.notices.clone(),
    };
    if let Some(output) = &args.pose_out {
        write(&output.path, &loaded.write_pose(&pose, output)?)?;
    }
    save_cage(args.save_cage.as_deref(), &loaded.cage, &model)?;
    if let Some(output) = &args.output {
        let of_model = bound.outside.iter().filter(|o| (o.vertex as usize) < model.positions.len());
        summary.notices.extend(outside_in_words(of_model, loaded.cage.diagonal()));
        let deformed = job.deform(&points.bound(bound, loaded.controls()), &Poses::Shape(pose));
        let written = job.write(deformed.map_err(of_mesh)?).map_err(|e| CliError::job(&output.path, e))?;
        write(&output.path, &written.bytes)?;
        summary.notices.extend(written.notices);
        summary.rig = written.rig;
    }
    print(&if as_json { json(&summary) } else { text(&summary) })
}

/// Pose of the cage: the proportions, added to the pose of `--pose`.
fn pose_of(args: &ProportionsArgs, loaded: &LoadedCage, cage: &HumanoidCage) -> Result<Vec<Vec3>, CliError> {
    let pose = cage.pose(&args.factors.0);
    let Some(path) = &args.pose else { return Ok(pose) };
    let pulled = loaded.load_pose(path)?;
    let by = pose.iter().zip(loaded.cage.positions()).map(|(&own, &rest)| own - rest);
    Ok(pulled.iter().zip(by).map(|(&pulled, by)| pulled + by).collect())
}

fn preset_text(preset: &Preset) -> String {
    let factors: Vec<String> =
        preset.factors.iter().map(|(name, factor)| format!("{name} {factor}")).collect();
    format!("{:<12} {}\n", preset.name, factors.join(", "))
}

fn text(summary: &Summary) -> String {
    let by = match summary.bones_by {
        BoneSource::Vrm => "the VRM's own data",
        BoneSource::Names => "the names of the joints",
        BoneSource::Shape => "the shape of the skeleton",
    };
    let mut out = format!("{} by {by}:\n", counted(summary.bones.len(), "bone", "bones"));
    for BoneJoint { bone, joint } in &summary.bones {
        out += &format!("  {:<14} {}\n", bone.to_string(), shown(joint));
    }
    let factors: Vec<String> =
        summary.factors.iter().map(|(name, factor)| format!("{name} {factor}")).collect();
    if let Some(output) = &summary.output {
        out += &format!(
            "wrote {}: {} vertices by {} cage vertices, {}\n",
            shown(output),
            summary.vertices,
            summary.cage_vertices,
            if factors.is_empty() { "all factors 1".to_owned() } else { factors.join(", ") }
        );
    }
    if let Some(pose) = &summary.pose {
        out += &format!("wrote {}: the pose of the cage\n", shown(pose));
    }
    for range in summary.ranges.iter().flatten() {
        out +=
            &format!("  {:<9} {} to {} without folds\n", range.proportion.to_string(), range.min, range.max);
    }
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
