//! Composes the files of an evaluation: tables, plots, the report and reconstructed models.

#[cfg(test)]
mod tests;

use std::error::Error;
use std::fmt::Write as _;

use super::cases::{Evaluation, Files, Implementation, Input};
use super::{plots, words};

/// Composes all files except the pictures, which need a GPU. Figures 2 to 5 are GLB files: rest poses reconstructed
/// from weights.
///
/// # Errors
/// If a model cannot be written, or a plot cannot be drawn.
pub(super) fn all(input: &Input, evaluation: &Evaluation) -> Result<Files, Box<dyn Error>> {
    let mut files = Vec::new();
    for reconstruction in &evaluation.reconstructions {
        let rest = input.cage.positions();
        let positions = cagework_core::deform::deform_vertices(&reconstruction.weights, rest);
        files.push((format!("{}.glb", reconstruction.figure), input.model.write_glb(&positions)?));
    }
    let texts = [
        ("time.csv", time_csv(evaluation)),
        ("error.csv", error_csv(evaluation)),
        ("delta.csv", delta_csv(evaluation)),
        ("report.md", words::report(evaluation)),
    ];
    let texts = texts.map(|(name, text)| (name.to_owned(), text));
    let texts = texts.into_iter().chain(plots::all(evaluation)?);
    files.extend(texts.map(|(name, text)| (name, text.into_bytes())));
    Ok(files)
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
