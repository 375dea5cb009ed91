//! What the figures say, in words: where the paper's findings hold and where they turn around.

use std::fmt::Write as _;

use super::cases::{ERROR_TAUS, Evaluation, Run, TIMED_TAUS, Way};
use super::spread::{Comparison, Spread};

/// The findings, a line each, from the numbers of this run. A time is called shorter only where the spreads lie apart.
pub(super) fn verdicts(evaluation: &Evaluation) -> String {
    let mut out = String::new();
    for grid in evaluation.grids.timed() {
        let run = |way| evaluation.timed(way, grid, 1e-5);
        if let (Some(one), Some(all)) = (run(Way::PaperOneThread), run(Way::PaperThreads)) {
            let _ = writeln!(
                out,
                "- \"Threaded smoothing is slower than one thread\" {} at g = {grid}: {} on one thread, {} on {}{}.",
                turned(all, one),
                times(one),
                times(all),
                evaluation.threads,
                factors(all, one)
            );
        }
        let beside = (run(Way::PaperOneThread), run(Way::CgOneThread), run(Way::MultigridOneThread));
        if let (Some(paper), Some(cg), Some(multigrid)) = beside {
            let needs = |run: &Run| format!("{} {}", run.report.iterations, run.way.iterations());
            let _ = writeln!(
                out,
                "- At g = {grid} the paper's algorithm needs {}, conjugate gradients in our cells {}, multigrid {}; on one thread \
                 they take {}, {} and {}.",
                needs(paper),
                needs(cg),
                needs(multigrid),
                times(paper),
                times(cg),
                times(multigrid)
            );
        }
        if let (Some(paper), Some(ours)) = (run(Way::PaperOneThread), run(Way::MultigridThreads)) {
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

/// What becomes of the paper's finding that `new` is slower than `old`.
fn turned(new: &Run, old: &Run) -> &'static str {
    match new.total_ms.against(old.total_ms) {
        Comparison::Faster { .. } => "turns around",
        Comparison::Slower => "holds here",
        Comparison::WithinSpread | Comparison::Unknown => "is not decided",
    }
}

/// A median with the shortest and the longest time.
fn times(run: &Run) -> String {
    let Spread { n, min, max } = run.total_ms;
    let median = run.report.timings_ms.total;
    if n < 2 { format!("{median:.1} ms") } else { format!("{median:.1} ms ({min:.1} to {max:.1})") }
}

/// How many times as fast `new` is, as far as the spreads allow to say.
fn factors(new: &Run, old: &Run) -> String {
    match new.total_ms.against(old.total_ms) {
        Comparison::Faster { least, most } => {
            let median = old.report.timings_ms.total / new.report.timings_ms.total;
            format!(": {} times as fast ({} to {})", digits(median), digits(least), digits(most))
        }
        Comparison::Slower => ", which is slower".to_owned(),
        Comparison::WithinSpread => ", which is within the spread of the runs".to_owned(),
        Comparison::Unknown => ", one measurement each, which may be within the spread".to_owned(),
    }
}

/// Two or three digits of a factor.
fn digits(factor: f64) -> String {
    if factor < 10.0 { format!("{factor:.2}") } else { format!("{factor:.0}") }
}

fn gpu_verdicts(evaluation: &Evaluation, out: &mut String) {
    let adapter = match &evaluation.adapter {
        Ok(adapter) => adapter,
        Err(reason) => {
            let _ = writeln!(out, "- No GPU, so nothing about the paper's third implementation: {reason}.");
            return;
        }
    };
    for grid in evaluation.grids.timed() {
        let run = |way| evaluation.timed(way, grid, 1e-5);
        let ways = (run(Way::PaperOneThread), run(Way::PaperGpu), run(Way::MultigridGpu));
        if let (Some(one), Some(gpu), Some(ours)) = ways {
            let _ = writeln!(
                out,
                "- \"GPU-based smoothing is slower than one thread\" {} at g = {grid} on {adapter}: {} against {}{}, with \
                 the field left on the GPU and one number read back every ten sweeps. Multigrid on the same GPU takes {}{}.",
                turned(gpu, one),
                times(gpu),
                times(one),
                factors(gpu, one),
                times(ours),
                factors(ours, one).replace("as fast", "as fast as the paper's algorithm on one thread")
            );
        }
    }
}

/// Largest ratio of two decay rates (logarithms of the factor for a sweep) that count as one.
const MAX_DECAY_RATIO: f64 = 1.25;

fn delta_verdict(evaluation: &Evaluation, out: &mut String) {
    let Some(run) = evaluation.delta_run(Way::PaperOneThread) else { return };
    let h = &run.report.delta_history;
    let rate = |from: usize, to: usize| {
        let quotient = f64::from(*h.get(to)?) / f64::from(*h.get(from)?);
        (to > from).then(|| quotient.powf(1.0 / (to - from) as f64))
    };
    let last = h.len().saturating_sub(1);
    if let (Some(third), Some(fourth)) = (rate(last / 2, 3 * last / 4), rate(3 * last / 4, last)) {
        let bend = third.ln() / fourth.ln();
        let straight = if bend < MAX_DECAY_RATIO && bend > 1.0 / MAX_DECAY_RATIO {
            "which is geometric decay: a straight line over the number of sweeps"
        } else {
            "which is no single geometric decay"
        };
        let _ = writeln!(
            out,
            "- \"Delta appears to decrease logarithmically\": it falls by the factor {third:.4} a sweep in the third \
             quarter of the solve and by {fourth:.4} in the last, {straight} (figure 7).",
        );
    }
}

/// Errors do not scatter: two binds with the same options give the same bits.
fn error_verdicts(evaluation: &Evaluation, out: &mut String) {
    let fine = evaluation.grids.fine;
    let paper = |tau| evaluation.mean_rel(Way::PaperThreads, fine, tau);
    if let (Some(a), Some(b)) = (paper(1e-4), paper(1e-5)) {
        let verdict = if a > b { "holds" } else { "does not hold here" };
        let _ = writeln!(
            out,
            "- \"A large mean error for grid size 64 and tau 1e-4\", because a finer grid needs a smaller tau, {verdict} at \
             g = {fine}: {a:.1e} of the diagonal at tau = 1e-4, {b:.1e} at 1e-5.",
        );
    }
    if let (Some(paper), Some(ours)) = (paper(1e-5), evaluation.mean_rel(Way::MultigridThreads, fine, 1e-5)) {
        let verdict = if ours < paper { "belongs to the method, not to the grid" } else { "holds here" };
        let _ = writeln!(
            out,
            "- \"Low values of g result in excessive quantization error\" {verdict}: at g = {fine} the paper's weights \
             miss the rest pose by {paper:.1e} of the diagonal on average, the embedded ones by {ours:.1e}.",
        );
    }
}

/// `report.md`.
pub(super) fn report(evaluation: &Evaluation) -> String {
    let mut out = format!(
        "# The paper's evaluation, run anew\n\n{}: {} vertices, {} cage vertices. {} threads, {} {}; GPU: {}. Each time is \
         {} (voxelize, solve, sample).\nMade by `cagework evaluate`, version {}.\n\n\
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
        "## Delta over time (figure 7)\n\nWhat is left to do while each solver runs: for the paper's the change of the last sweep, for the others \
         the error that is expected to remain.\n\n![delta over time](figure-7.svg)\n\n",
    );
    error_table(evaluation, &mut out);
    out.push_str(
        "## Reconstructions (figures 2 to 5)\n\n| file | what | mean error | largest |\n|---|---|---|---|\n",
    );
    for r in &evaluation.reconstructions {
        let e = &r.report.rest_error;
        let _ =
            writeln!(out, "| {}.glb | {} | {:.1e} | {:.1e} |", r.figure, r.caption, e.mean_rel, e.max_rel);
    }
    if evaluation.adapter.is_ok() {
        out.push_str(
            "\nThe base mesh is drawn as a wireframe, the reconstruction as a solid: where lines show, the mesh was \
             larger.\n\n",
        );
        for r in &evaluation.reconstructions {
            let _ = writeln!(out, "![{}]({}.png)\n", r.caption, r.figure);
        }
        out.push_str("## Deformation (figure 6)\n\n![the cage moved, the mesh follows](figure-6.png)\n");
    }
    out.push_str("\nErrors are over the diagonal of the cage's bounding box.\n");
    out
}

/// What a time in the report is.
fn measured(runs: u32) -> String {
    match runs {
        1 => "one whole bind, whose scatter nobody knows".to_owned(),
        _ => format!("the median of {runs} whole binds, with the shortest and the longest"),
    }
}

fn time_table(evaluation: &Evaluation, out: &mut String) {
    out.push_str(
        "## Time to completion (figures 8 to 11)\n\nA row is a grid of g cells along the cage and the threshold tau below which a solver \
         stops; a column is a way to the weights. In it: how long a whole bind takes, and how many iterations of the solver. \
         Conjugate gradients and multigrid solve our cells.\n\n| g | tau |",
    );
    for way in Way::ALL {
        let _ = write!(out, " {} |", way.name());
    }
    let _ = writeln!(out, "\n|---|---|{}", "---|".repeat(Way::ALL.len()));
    for grid in evaluation.grids.timed() {
        for tau in TIMED_TAUS {
            let _ = write!(out, "| {grid} | {tau:e} |");
            for way in Way::ALL {
                match evaluation.timed(way, grid, tau) {
                    Some(run) => {
                        let r = &run.report;
                        let _ = write!(out, " {}, {} {} |", times(run), r.iterations, way.iterations());
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
        "## Mean reconstruction error (figure 12)\n\nHow far the weights put a point of the model from where it is at rest, on average: 1e-2 \
         is a hundredth of the cage's diagonal.\n\n| g |",
    );
    for tau in ERROR_TAUS {
        let _ = write!(out, " paper, tau = {tau:e} |");
    }
    let _ = writeln!(out, " embedded multigrid |\n|---|{}---|", "---|".repeat(ERROR_TAUS.len()));
    for grid in evaluation.grids.all() {
        let _ = write!(out, "| {grid} |");
        for tau in ERROR_TAUS {
            let error = evaluation.mean_rel(Way::PaperThreads, grid, tau);
            let _ = write!(out, " {} |", error.map_or("-".to_owned(), |e| format!("{e:.1e}")));
        }
        let error = evaluation.mean_rel(Way::MultigridThreads, grid, 1e-5);
        let _ = writeln!(out, " {} |", error.map_or("-".to_owned(), |e| format!("{e:.1e}")));
    }
    out.push_str("\n![mean error](figure-12.svg)\n\n");
}
