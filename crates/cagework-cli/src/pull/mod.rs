//! `cagework pull`: points of the model are pulled, and the cage is solved for.

mod job;
mod measure;

use std::path::Path;
use std::time::Instant;

use cagework_core::deform::deform_bound;
use cagework_core::mesh::TriMesh;
use cagework_core::progress::Silent;
use cagework_core::pull::{Drag, DragOptions, Grip, Handle, Probes, Pull};
use cagework_core::{BindOptions, InnerControls, bind};
use cagework_io::{SavedWeights, shown, write_inner_controls};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::{CageSource, PullArgs};
use crate::deform::load_weights;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, shown_path, write};
use crate::load::{load_cage, load_model};
use job::Job;
use measure::{Stretches, far_mean, stretches};

/// What was done; its JSON is the output of `--json`. Lengths are shares of the model's size, but for `lag` and `far_mean`.
#[derive(Debug, Serialize)]
struct Pulled {
    output: String,
    samples: usize,
    groups: usize,
    cage: usize,
    /// Once per binding, with the bind of the probes.
    precompute_ms: f64,
    /// Once per grab.
    grab_ms: f64,
    /// Mean of a frame.
    frame_ms: f64,
    /// How far the drag reaches; null for the whole model.
    reach: Option<f64>,
    /// Largest distance of a grab or pin from its target.
    error: f64,
    /// How far the model still moved after the last target, at most, over the drag.
    lag: f64,
    /// Frames until it moved no more.
    settle_frames: u32,
    #[serde(flatten)]
    stretches: Stretches,
    /// Mean movement of what is farther than 1.2 times the reach, over the drag; null where there is none.
    far_mean: Option<f64>,
    notices: Vec<String>,
}

/// Runs `cagework pull`.
///
/// # Errors
/// When a file cannot be read or written, files do not belong together, or the job asks for what there is not.
pub(crate) fn run(args: &PullArgs, as_json: bool) -> Result<(), CliError> {
    let job = Job::read(&args.job)?;
    let mut inputs = vec![args.mesh.as_path(), args.weights.as_path(), args.job.as_path()];
    inputs.extend(job.start.as_deref());
    if let CageSource::File(path) = &args.cage {
        inputs.push(path);
    }
    inputs.extend(args.controls.controls.as_deref());
    let output = &args.output.path;
    let outputs: Vec<&Path> =
        std::iter::once(output).chain(&args.save_controls).map(std::path::PathBuf::as_path).collect();
    check_outputs(&outputs, &inputs)?;
    let model = load_model(&args.mesh, args.read.axis(), args.read.memory)?;
    let cage = load_cage(&args.cage, &model, args.read.memory, &args.controls)?;
    let controls = cage.controls();
    let SavedWeights { weights, outside, inner_controls, .. } =
        load_weights(&args.weights, &model, &cage.cage, args.read.memory)?.of_vertices();
    let inner = &controls.rest()[cage.cage.n_vertices()..];
    if inner_controls != inner {
        return Err(CliError::Mismatch {
            message: format!(
                "{}: was bound with {} controls inside the cage, but {} are given, or they are elsewhere",
                shown_path(&args.weights),
                inner_controls.len(),
                inner.len()
            ),
            hint: "give the --controls and --smooth of `cagework bind`",
        });
    }
    let start = match &job.start {
        Some(path) => [cage.load_pose(path)?.as_slice(), inner].concat(),
        None => controls.rest().to_vec(),
    };
    let wrong = |e| CliError::file(&args.job, e);

    let begun = Instant::now();
    let mesh = TriMesh { positions: model.positions.clone(), triangles: model.triangles.clone() };
    let probes = Probes::new(&mesh, controls).map_err(wrong)?;
    let options =
        BindOptions { grid: args.grid, memory_limit: args.read.memory.bytes(), ..BindOptions::default() };
    let of_probes = bind(probes.points(), controls, &options, &Silent)?.weights;
    let pull = Pull::new(&mesh, controls, probes, &of_probes).map_err(wrong)?;
    let precompute_ms = since(begun);

    let begun = Instant::now();
    let from: Vec<DVec3> = start.iter().copied().map(Vec3::as_dvec3).collect();
    let drag_options = DragOptions { reach: job.reach, relax: job.relax, symmetry: None };
    let grips = |handles: &[Handle]| {
        let grips = handles.iter().map(|&h| Grip::new(h, &pull, &model.triangles, &weights));
        grips.collect::<Result<Vec<_>, _>>().map_err(wrong)
    };
    let mut drag =
        Drag::new(&pull, &from, &grips(&job.grabs)?, &grips(&job.pins)?, drag_options).map_err(wrong)?;
    let grab_ms = since(begun);

    let pose = |drag: &Drag| drag.cage().iter().map(|p| p.as_vec3()).collect::<Vec<Vec3>>();
    let deformed = |cage: &[Vec3]| deform_bound(&weights, &outside, cage);
    let before = deformed(&start);
    let to = drag.targets(&job.grabs, &model.up().turned(&job.to), &before);
    let grabbed = drag.start().to_vec();
    let begun = Instant::now();
    drag.go(&to, job.frames);
    let frame_ms = since(begun) / f64::from(job.frames);
    let at_stop = deformed(&pose(&drag));
    let settle_frames = drag.settle(&to);
    let cage_pose = pose(&drag);
    let after = deformed(&cage_pose);
    let way = grabbed.iter().zip(&to).map(|(a, b)| a.distance(*b)).fold(f64::MIN_POSITIVE, f64::max);
    let apart = |(a, b): (&Vec3, &Vec3)| f64::from(a.distance(*b));
    let (of_cage, of_inner) = cage_pose.split_at(cage.cage.n_vertices());
    write(output, &cage.write_pose(of_cage, &args.output)?)?;
    if let (Some(path), Some(inner)) = (&args.save_controls, cage.inner()) {
        let positions = model.up().turned_back(of_inner).into_owned();
        write(path, &write_inner_controls(&InnerControls { positions, ..inner.clone() }))?;
    }
    let done = Pulled {
        output: output.display().to_string(),
        samples: pull.n_samples(),
        groups: pull.n_groups(),
        cage: pull.n_cage(),
        precompute_ms,
        grab_ms,
        frame_ms,
        reach: drag.reach().is_finite().then(|| drag.reach()),
        error: drag.error(),
        lag: after.iter().zip(&at_stop).map(apart).fold(0.0, f64::max) / way,
        settle_frames,
        stretches: stretches(&mesh, &after),
        far_mean: far_mean(&drag, &before, &after).map(|mean| mean / way),
        notices: model.notices,
    };
    print(&if as_json { json(&done) } else { text(&done, output) })
}

fn since(begun: Instant) -> f64 {
    begun.elapsed().as_secs_f64() * 1e3
}

fn text(done: &Pulled, output: &Path) -> String {
    let reach = done.reach.map_or_else(
        || "the whole model".to_owned(),
        |reach| format!("{:.0} % of the model's size", 100.0 * reach),
    );
    let mut out = format!(
        "pulled by {} samples and {} cage vertices: {:.2} ms a frame, {:.1} ms a grab, {:.0} ms once\n\
         reach {reach}; grabs within {:.1e} of the model's size; edges stretched to {:.2} (99 of 100 to at most {:.2}, \
         at least {:.2})\nwrote {}\n",
        done.samples,
        done.cage,
        done.frame_ms,
        done.grab_ms,
        done.precompute_ms,
        done.error,
        done.stretches.stretch_max,
        done.stretches.stretch_99,
        done.stretches.stretch_1,
        shown(&output.display().to_string()),
    );
    for notice in &done.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
