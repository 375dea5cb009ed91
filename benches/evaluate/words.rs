//! Writes the report: which findings of the paper hold in this run. The parent module names the paper.

use std::fmt::Write as _;

use super::cases::{ERROR_TAUS, Evaluation, Implementation, Run, TIMED_TAUS};
use super::spread::{Comparison, Spread};

/// Composes the findings about each claim of the paper, one per line. A time is called shorter only if the ranges of
/// times do not overlap.
pub(super) fn verdicts(evaluation: &Evaluation) -> String {
    let mut out = String::new();
    for grid in evaluation.grids.timed() {
        let run = |implementation| evaluation.timed(implementation, grid, 1e-5);
        if let (Some(one), Some(all)) =
            (run(Implementation::PaperOneThread), run(Implementation::PaperThreads))
        {
            let _ = writeln!(
                out,
                "- \"Threaded smoothing is slower than one thread\" {} at g = {grid}: {} on one thread, {} on {}{}.",
                verdict_of_slower(all, one),
                times(one),
                times(all),
                evaluation.threads,
                factors(all, one)
            );
        }
        let beside = (
            run(Implementation::PaperOneThread),
            run(Implementation::CgOneThread),
            run(Implementation::MultigridOneThread),
        );
        if let (Some(paper), Some(cg), Some(multigrid)) = beside {
            let needs = |run: &Run| format!("{} {}", run.report.iterations, run.implementation.iterations());
            let _ = writeln!(
                out,
                "- At g = {grid} the paper's algorithm needs {}, conjugate gradients in the embedded method's cells {}, multigrid {}; on one thread \
                 they take {}, {} and {}.",
                needs(paper),
                needs(cg),
                needs(multigrid),
                times(paper),
                times(cg),
                times(multigrid)
            );
        }
        if let (Some(paper), Some(ours)) =
            (run(Implementation::PaperOneThread), run(Implementation::MultigridThreads))
        {
            let _ = writeln!(
                out,
                "- Embedded multigrid on all threads takes {} at g = {grid}, the paper's algorithm on one thread {}{}.",
                times(ours),
                times(paper),
                factors(ours, paper)
            );
        }
    }
    gpu_verdicts(evaluation, &mut out);
    delta_verdict(evaluation, &mut out);
    error_verdicts(evaluation, &mut out);
    out
}

/// Says whether the paper's finding that `new` is slower than `old` holds.
fn verdict_of_slower(new: &Run, old: &Run) -> &'static str {
    match new.total_ms.against(old.total_ms) {
        Comparison::Faster { .. } => "is reversed",
        Comparison::Slower => "holds here",
        Comparison::WithinSpread | Comparison::Unknown => "is undecided",
    }
}

/// Formats the median time, followed by the range if there are several measurements.
fn times(run: &Run) -> String {
    let Spread { n, min, max } = run.total_ms;
    let median = run.report.timings_ms.total;
    if n < 2 { format!("{median:.1} ms") } else { format!("{median:.1} ms ({min:.1} to {max:.1})") }
}

/// Formats the end of a sentence that compares the times of `new` and `old`: the factor if `new` is faster, otherwise
/// that `new` is slower or that the difference is not certain.
fn factors(new: &Run, old: &Run) -> String {
    match new.total_ms.against(old.total_ms) {
        Comparison::Faster { least, most } => {
            let median = old.report.timings_ms.total / new.report.timings_ms.total;
            format!(": {} times as fast ({} to {})", digits(median), digits(least), digits(most))
        }
        Comparison::Slower => ", which is slower".to_owned(),
        Comparison::WithinSpread => ", a difference within the spread of the runs".to_owned(),
        Comparison::Unknown => {
            ", from one measurement each, a difference that may be within the spread".to_owned()
        }
    }
}

/// Formats a factor: two decimals below 10, none from 10.
fn digits(factor: f64) -> String {
    if factor < 10.0 { format!("{factor:.2}") } else { format!("{factor:.0}") }
}

fn gpu_verdicts(evaluation: &Evaluation, out: &mut String) {
    let adapter = match &evaluation.adapter {
        Ok(adapter) => adapter,
        Err(reason) => {
            let _ = writeln!(out, "- The paper's GPU implementation was not run: {reason}.");
            return;
        }
    };
    for grid in evaluation.grids.timed() {
        let run = |implementation| evaluation.timed(implementation, grid, 1e-5);
        let implementations = (
            run(Implementation::PaperOneThread),
            run(Implementation::PaperGpu),
            run(Implementation::MultigridGpu),
        );
        if let (Some(one), Some(gpu), Some(ours)) = implementations {
            let _ = writeln!(
                out,
                "- \"GPU-based smoothing is slower than one thread\" {} at g = {grid} on {adapter}: {} on one thread, {} on the GPU{}; \
                 the field stays on the GPU, and one number is read back every ten sweeps. Multigrid on the same GPU takes {}{}.",
                verdict_of_slower(gpu, one),
                times(one),
                times(gpu),
                factors(gpu, one),
                times(ours),
                factors(ours, one).replace("as fast", "as fast as the paper's algorithm on one thread")
            );
        }
    }
}

/// Two decay rates of delta count as equal if their ratio lies between this value and its reciprocal. A decay rate is
/// the logarithm of the factor by which delta falls per sweep.
const MAX_DECAY_RATIO: f64 = 1.25;

fn delta_verdict(evaluation: &Evaluation, out: &mut String) {
    let Some(run) = evaluation.delta_run(Implementation::PaperOneThread) else { return };
    let h = &run.report.delta_history;
    let rate = |from: usize, to: usize| {
        let quotient = f64::from(*h.get(to)?) / f64::from(*h.get(from)?);
        (to > from).then(|| quotient.powf(1.0 / (to - from) as f64))
    };
    let last = h.len().saturating_sub(1);
    if let (Some(third), Some(fourth)) = (rate(last / 2, 3 * last / 4), rate(3 * last / 4, last)) {
        let bend = third.ln() / fourth.ln();
        let straight = if bend < MAX_DECAY_RATIO && bend > 1.0 / MAX_DECAY_RATIO {
            "a geometric decay. Over the number of sweeps, this is a straight line if the axis of delta is logarithmic; in figure 7, \
             the axis of time is logarithmic too"
        } else {
            "so the decay is not geometric (figure 7)"
        };
        let _ = writeln!(
            out,
            "- \"Delta appears to decrease logarithmically\": it falls by the factor {third:.4} per sweep in the third \
             quarter of the solve and by {fourth:.4} in the last quarter, {straight}.",
        );
    }
}

/// Writes the findings about errors to `out`. Binds with the same options give identical bits, so one bind per case is
/// enough.
fn error_verdicts(evaluation: &Evaluation, out: &mut String) {
    let fine = evaluation.grids.fine;
    let paper = |tau| evaluation.mean_rel(Implementation::PaperThreads, fine, tau);
    if let (Some(a), Some(b)) = (paper(1e-4), paper(1e-5)) {
        let verdict = if a > b { "holds" } else { "does not hold here" };
        let _ = writeln!(
            out,
            "- \"A large mean error for grid size 64 and tau 1e-4\", because a finer grid needs a smaller tau, {verdict} at \
             g = {fine}: {a:.1e} of the diagonal at tau = 1e-4, {b:.1e} at 1e-5.",
        );
    }
    if let (Some(paper), Some(ours)) =
        (paper(1e-5), evaluation.mean_rel(Implementation::MultigridThreads, fine, 1e-5))
    {
        let verdict = if ours < paper { "is due to the method, not to the grid" } else { "holds here" };
        let _ = writeln!(
            out,
            "- \"Low values of g result in excessive quantization error\" {verdict}: at g = {fine} the paper's weights \
             reconstruct the rest pose with a mean error of {paper:.1e} of the diagonal, the embedded ones with {ours:.1e}.",
        );
    }
}

/// Composes the contents of `report.md`.
pub(super) fn report(evaluation: &Evaluation) -> String {
    let mut out = format!(
        "# The evaluation of K. Smith's paper, repeated\n\n{}: {} vertices, {} cage vertices. {} threads, {} {}; GPU: {}. Each time is \
         {} (voxelize, solve, sample).\nMade by the program `evaluate` of cagework-benches, version {}.\n\n\
         ## Findings\n\n{}\n",
        evaluation.mesh,
        evaluation.n_vertices,
        evaluation.n_cage,
        evaluation.threads,
        std::env::consts::OS,
        std::env::consts::ARCH,
        evaluation.adapter.as_deref().unwrap_or("none"),
        measured(evaluation.runs),
        env!("CARGO_PKG_VERSION"),
        verdicts(evaluation)
    );
    time_table(evaluation, &mut out);
    out.push_str(
        "## Delta over time (figure 7)\n\nDelta is the average change of the last sweep for the paper's solver, and the estimated \
         remaining error for the other solvers.\n\n![delta over time](figure-7.svg)\n\n",
    );
    error_table(evaluation, &mut out);
    out.push_str(
        "## Reconstructions (figures 2 to 5)\n\n| file | case | mean error | largest error |\n|---|---|---|---|\n",
    );
    for r in &evaluation.reconstructions {
        let e = &r.report.rest_error;
        let _ =
            writeln!(out, "| {}.glb | {} | {:.1e} | {:.1e} |", r.figure, r.caption, e.mean_rel, e.max_rel);
    }
    if evaluation.adapter.is_ok() {
        out.push_str(
            "\nThe wireframe is the base mesh, the solid its reconstruction: where lines are visible, the reconstruction is \
             smaller.\n\n",
        );
        for r in &evaluation.reconstructions {
            let _ = writeln!(out, "![{}]({}.png)\n", r.caption, r.figure);
        }
        out.push_str("## Deformation (figure 6)\n\n![the mesh deformed by the bent cage](figure-6.png)\n");
    }
    out.push_str("\nErrors are relative to the diagonal of the cage's bounding box.\n");
    out
}

/// Returns the phrase of the report that says how a time was measured.
fn measured(runs: u32) -> String {
    match runs {
        1 => "a single bind, without a range".to_owned(),
        _ => format!("the median of {runs} binds, with the shortest and the longest"),
    }
}

fn time_table(evaluation: &Evaluation, out: &mut String) {
    out.push_str(
        "## Time to completion (figures 8 to 11)\n\nEach row is a grid of g cells along the cage and a threshold tau at which the solver \
         stops; each column is an implementation. Cells give the time of a whole bind and the number of iterations. \
         Conjugate gradients and multigrid use the embedded method.\n\n| g | tau |",
    );
    for implementation in Implementation::ALL {
        let _ = write!(out, " {} |", implementation.name());
    }
    let _ = writeln!(out, "\n|---|---|{}", "---|".repeat(Implementation::ALL.len()));
    for grid in evaluation.grids.timed() {
        for tau in TIMED_TAUS {
            let _ = write!(out, "| {grid} | {tau:e} |");
            for implementation in Implementation::ALL {
                match evaluation.timed(implementation, grid, tau) {
                    Some(run) => {
                        let r = &run.report;
                        let _ = write!(
                            out,
                            " {}, {} {} |",
                            times(run),
                            r.iterations,
                            implementation.iterations()
                        );
                    }
                    None => out.push_str(" - |"),
                }
            }
            out.push('\n');
        }
    }
    for number in 8..8 + evaluation.grids.timed().len() * TIMED_TAUS.len() {
        let _ = write!(out, "\n![figure {number}](figure-{number}.svg)\n");
    }
    out.push('\n');
}

fn error_table(evaluation: &Evaluation, out: &mut String) {
    out.push_str(
        "## Mean reconstruction error (figure 12)\n\nMean distance between the reconstructed and the true rest position, relative to the \
         cage's diagonal.\n\n| g |",
    );
    for tau in ERROR_TAUS {
        let _ = write!(out, " paper, tau = {tau:e} |");
    }
    let _ = writeln!(out, " embedded multigrid |\n|---|{}---|", "---|".repeat(ERROR_TAUS.len()));
    for grid in evaluation.grids.all() {
        let _ = write!(out, "| {grid} |");
        for tau in ERROR_TAUS {
            let error = evaluation.mean_rel(Implementation::PaperThreads, grid, tau);
            let _ = write!(out, " {} |", error.map_or("-".to_owned(), |e| format!("{e:.1e}")));
        }
        let error = evaluation.mean_rel(Implementation::MultigridThreads, grid, 1e-5);
        let _ = writeln!(out, " {} |", error.map_or("-".to_owned(), |e| format!("{e:.1e}")));
    }
    out.push_str("\n![mean error](figure-12.svg)\n\n");
}
