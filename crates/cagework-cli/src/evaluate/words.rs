//! What the figures say, in words: where the paper's findings hold and where they turn around.

use std::fmt::Write as _;

use super::cases::{ERROR_GRIDS, ERROR_TAUS, Evaluation, TIMED_GRIDS, TIMED_TAUS, Way};

/// The findings, a line each, from the numbers of this run.
pub(super) fn verdicts(evaluation: &Evaluation) -> String {
    let mut out = String::new();
    let time = |way, g, tau| evaluation.timed(way, g, tau).map(|run| run.report.timings_ms.total);
    for grid in TIMED_GRIDS {
        if let (Some(one), Some(all)) =
            (time(Way::PaperOneThread, grid, 1e-5), time(Way::PaperThreads, grid, 1e-5))
        {
            let verdict = if all < one { "turns around" } else { "holds" };
            let _ = writeln!(
                out,
                "- \"Threaded smoothing is slower than one thread\" {verdict} at g = {grid}: {one:.0} ms on one thread, \
                 {all:.0} ms on {} ({:.2} times as fast).",
                evaluation.threads,
                one / all
            );
        }
        if let (Some(paper), Some(ours)) =
            (time(Way::PaperOneThread, grid, 1e-5), time(Way::MultigridThreads, grid, 1e-5))
        {
            let _ = writeln!(
                out,
                "- Embedded multigrid on all threads takes {ours:.1} ms at g = {grid}: {:.0} times as fast as the \
                 paper's algorithm on one thread.",
                paper / ours
            );
        }
    }
    gpu_verdicts(evaluation, &mut out);
    if let Some(run) = evaluation.delta_run(Way::PaperOneThread) {
        let h = &run.report.delta_history;
        if let (Some(first), Some(last)) = (h.get(h.len() / 2), h.last()) {
            let rate =
                (f64::from(*last) / f64::from(*first)).powf(1.0 / (h.len() - h.len() / 2).max(1) as f64);
            let _ = writeln!(
                out,
                "- \"Delta appears to decrease logarithmically\": over its second half it falls by the factor {rate:.4} a \
                 sweep, which is geometric decay: a straight line over the number of sweeps (figure 7).",
            );
        }
    }
    error_verdicts(evaluation, &mut out);
    out
}

fn gpu_verdicts(evaluation: &Evaluation, out: &mut String) {
    let adapter = match &evaluation.adapter {
        Ok(adapter) => adapter,
        Err(reason) => {
            let _ = writeln!(out, "- No GPU, so nothing about the paper's third implementation: {reason}.");
            return;
        }
    };
    let time = |way, g| evaluation.timed(way, g, 1e-5).map(|run| run.report.timings_ms.total);
    for grid in TIMED_GRIDS {
        if let (Some(one), Some(gpu), Some(ours)) =
            (time(Way::PaperOneThread, grid), time(Way::PaperGpu, grid), time(Way::MultigridGpu, grid))
        {
            let verdict = if gpu < one { "turns around" } else { "holds here for the paper's own algorithm" };
            let _ = writeln!(
                out,
                "- \"GPU-based smoothing is slower than one thread\" {verdict} at g = {grid} on {adapter}: {gpu:.0} ms \
                 against {one:.0} ms ({:.2} times as fast), with the field left on the GPU and one number read back \
                 every ten sweeps. By multigrid the same GPU takes {ours:.0} ms, {:.0} times as fast as the paper's \
                 algorithm on one thread.",
                one / gpu,
                one / ours
            );
        }
    }
}

fn error_verdicts(evaluation: &Evaluation, out: &mut String) {
    let paper = |g, tau| evaluation.mean_rel(Way::PaperThreads, g, tau);
    if let (Some(a), Some(b)) = (paper(64, 1e-4), paper(64, 1e-5)) {
        let verdict = if a > b { "holds" } else { "does not hold here" };
        let _ = writeln!(
            out,
            "- \"A large mean error for grid size 64 and tau 1e-4\", because a finer grid needs a smaller tau, {verdict}: \
             {a:.1e} of the diagonal at tau = 1e-4, {b:.1e} at 1e-5.",
        );
    }
    if let (Some(paper), Some(ours)) = (paper(64, 1e-5), evaluation.mean_rel(Way::MultigridThreads, 64, 1e-5))
    {
        let _ = writeln!(
            out,
            "- \"Low values of g result in excessive quantization error\" belongs to the method, not to the grid: at \
             g = 64 the paper's weights miss the rest pose by {paper:.1e} of the diagonal on average, the embedded \
             ones by {ours:.1e}.",
        );
    }
}

/// `report.md`.
pub(super) fn report(evaluation: &Evaluation) -> String {
    let mut out = format!(
        "# The paper's evaluation, run anew\n\n{}: {} vertices, {} cage vertices. {} threads, {} {}; GPU: {}. Each time is \
         the median of {} whole binds (voxelize, solve, sample).\nMade by `cagework evaluate`, version {}.\n\n\
         ## Findings\n\n{}\n",
        evaluation.mesh,
        evaluation.n_vertices,
        evaluation.n_cage,
        evaluation.threads,
        std::env::consts::OS,
        std::env::consts::ARCH,
        evaluation.adapter.as_deref().unwrap_or("none"),
        evaluation.runs,
        env!("CARGO_PKG_VERSION"),
        verdicts(evaluation)
    );
    time_table(evaluation, &mut out);
    out.push_str("## Delta over time (figure 7)\n\n![delta over time](figure-7.svg)\n\n");
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

fn time_table(evaluation: &Evaluation, out: &mut String) {
    out.push_str("## Time to completion (figures 8 to 11)\n\n| g | tau |");
    for way in Way::ALL {
        let _ = write!(out, " {} |", way.name());
    }
    let _ = writeln!(out, "\n|---|---|{}", "---|".repeat(Way::ALL.len()));
    for grid in TIMED_GRIDS {
        for tau in TIMED_TAUS {
            let _ = write!(out, "| {grid} | {tau:e} |");
            for way in Way::ALL {
                match evaluation.timed(way, grid, tau) {
                    Some(run) => {
                        let r = &run.report;
                        let unit = if way.is_paper() { "sweeps" } else { "cycles" };
                        let _ = write!(out, " {:.1} ms, {} {unit} |", r.timings_ms.total, r.iterations);
                    }
                    None => out.push_str(" - |"),
                }
            }
            out.push('\n');
        }
    }
    for number in 8..8 + TIMED_GRIDS.len() * TIMED_TAUS.len() {
        let _ = write!(out, "\n![figure {number}](figure-{number}.svg)\n");
    }
    out.push('\n');
}

fn error_table(evaluation: &Evaluation, out: &mut String) {
    out.push_str("## Mean reconstruction error (figure 12)\n\n| g |");
    for tau in ERROR_TAUS {
        let _ = write!(out, " paper, tau = {tau:e} |");
    }
    let _ = writeln!(out, " embedded multigrid |\n|---|{}---|", "---|".repeat(ERROR_TAUS.len()));
    for grid in ERROR_GRIDS {
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
