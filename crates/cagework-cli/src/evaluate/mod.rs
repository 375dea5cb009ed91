//! `cagework evaluate`: repeats the evaluation of K. Smith's paper *CSC 473 Harmonic Coordinates*, and adds the
//! embedded method for comparison. "The paper" in this module means Smith's.
//!
//! Figures are numbered as in the paper: 2 to 5 are reconstructions, 6 is a deformation, 7 shows the solver's delta
//! (`BindReport::delta_history`) over time, 8 to 11 show times to completion, 12 shows the error at rest.

mod cases;
mod pictures;
mod plots;
mod spread;
mod words;

use std::fmt::Write as _;
use std::path::Path;

use cagework_core::Cage;
use cagework_io::{Model, UpAxis};

use crate::args::{ControlArgs, EvaluateArgs, MemoryArgs};
use crate::error::CliError;
use crate::files::{json, make_folder, print, shown_path, write};
use crate::gpu;
use crate::load::{BuiltInSample, built_in, load_cage, load_model};

use cases::{Evaluation, Implementation};

/// Runs `cagework evaluate`.
///
/// # Errors
/// If a file cannot be read or written, or a bind fails or is cancelled.
pub(crate) fn run(args: &EvaluateArgs, as_json: bool) -> Result<(), CliError> {
    let (name, model, cage) = input(args)?;
    make_folder(&args.output)?;
    let gpu = gpu::open();
    let evaluation = Evaluation::run(&name, &model, &cage, args, gpu.as_ref())?;
    let directory = args.output.as_path();
    reconstructions(&model, &cage, &evaluation, directory)?;
    if let Ok(context) = gpu {
        for (file, picture) in pictures::all(context, &model, &cage, &evaluation)? {
            write(&directory.join(file), &picture)?;
        }
    }
    write(&directory.join("time.csv"), time_csv(&evaluation).as_bytes())?;
    write(&directory.join("error.csv"), error_csv(&evaluation).as_bytes())?;
    write(&directory.join("delta.csv"), delta_csv(&evaluation).as_bytes())?;
    for (file, svg) in plots::all(&evaluation)? {
        write(&directory.join(file), svg.as_bytes())?;
    }
    let report = words::report(&evaluation);
    write(&directory.join("report.md"), report.as_bytes())?;
    print(&if as_json {
        json(&evaluation.summary())
    } else {
        format!("{}\nwrote {}\n", words::verdicts(&evaluation), shown_path(&directory.join("report.md")))
    })
}

fn input(args: &EvaluateArgs) -> Result<(String, Model, Cage), CliError> {
    if let (Some(mesh), Some(cage)) = (&args.mesh, &args.cage) {
        let model = load_model(mesh, UpAxis::Y, MemoryArgs::default())?;
        let cage = load_cage(cage, &model, MemoryArgs::default(), &ControlArgs::default())?.cage;
        return Ok((mesh.display().to_string(), model, cage));
    }
    let BuiltInSample { name, model, cage: own, .. } = built_in()?;
    let cage = match &args.cage {
        Some(source) => load_cage(source, &model, MemoryArgs::default(), &ControlArgs::default())?.cage,
        None => own,
    };
    Ok((format!("built-in sample, {name}"), model, cage))
}

/// Writes figures 2 to 5 as GLB files: rest poses reconstructed from weights.
fn reconstructions(
    model: &Model,
    cage: &Cage,
    evaluation: &Evaluation,
    directory: &Path,
) -> Result<(), CliError> {
    for reconstruction in &evaluation.reconstructions {
        let positions = cagework_core::deform::deform_vertices(&reconstruction.weights, cage.positions());
        let path = directory.join(format!("{}.glb", reconstruction.figure));
        write(&path, &model.write_glb(&positions).map_err(|e| CliError::file(&path, e))?)?;
    }
    Ok(())
}

fn time_csv(evaluation: &Evaluation) -> String {
    let mut csv = String::from(
        "implementation,g,tau,threads,iterations,converged,solve_ms,total_ms,runs,min_ms,max_ms\n",
    );
    for run in &evaluation.timed {
        let r = &run.report;
        let _ = writeln!(
            csv,
            "{},{},{:e},{},{},{},{:.3},{:.3},{},{:.3},{:.3}",
            run.implementation.id(),
            r.grid,
            r.tau,
            r.threads,
            r.iterations,
            r.converged,
            r.timings_ms.solve,
            r.timings_ms.total,
            run.total_ms.n,
            run.total_ms.min,
            run.total_ms.max
        );
    }
    csv
}

fn error_csv(evaluation: &Evaluation) -> String {
    let mut csv = String::from("implementation,g,tau,iterations,mean_error,mean_rel,max_rel\n");
    for run in &evaluation.errors {
        let (r, e) = (&run.report, &run.report.rest_error);
        let _ = writeln!(
            csv,
            "{},{},{:e},{},{:e},{:e},{:e}",
            run.implementation.id(),
            r.grid,
            r.tau,
            r.iterations,
            e.mean,
            e.mean_rel,
            e.max_rel
        );
    }
    csv
}

fn delta_csv(evaluation: &Evaluation) -> String {
    let mut csv = String::from("implementation,iteration,time_ms,delta\n");
    for implementation in [
        Implementation::PaperOneThread,
        Implementation::PaperGpu,
        Implementation::CgThreads,
        Implementation::MultigridThreads,
    ] {
        if let Some(run) = evaluation.delta_run(implementation) {
            for (k, (time, delta)) in run.delta_over_time().enumerate() {
                let iteration = (k as u32 + 1) * run.report.delta_interval;
                let _ = writeln!(csv, "{},{iteration},{time:.4},{delta:e}", implementation.id());
            }
        }
    }
    csv
}
