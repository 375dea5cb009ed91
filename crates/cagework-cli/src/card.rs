//! Summary of a bind as text: about a dozen lines from its report.

use std::fmt::Write as _;
use std::path::PathBuf;

use cagework_core::BindReport;
use cagework_core::options::Solver;

use crate::controls::inner_controls_text;
use crate::files::shown_path;

/// Formats a bind report. `model_notices`: notices from reading the mesh; `written`: paths of the files that were
/// written.
pub(crate) fn of(report: &BindReport, model_notices: &[String], written: &[PathBuf]) -> String {
    let mut out = format!(
        "bound {} vertices to {} cage vertices{}\n",
        report.vertices,
        report.cage_vertices,
        inner_controls_text(report.inner_controls as usize)
    );
    let mut row = |name: &str, value: String| {
        let _ = writeln!(out, "  {name:<14}{value}");
    };
    let threads = if report.threads == 1 { "1 thread".into() } else { format!("{} threads", report.threads) };
    let place = report.adapter.clone().unwrap_or(threads);
    row("method", format!("{}, {}, {} ({place})", report.method, solver(report), report.backend));
    let [x, y, z] = report.dims;
    row("grid", format!("{} ({x} x {y} x {z} cells)", report.grid));
    if let Some(reason) = &report.grid_reason {
        row("", reason.clone());
    }
    let cells = report.cells;
    row(
        "cells",
        format!("{} interior, {} boundary, {} exterior", cells.interior, cells.boundary, cells.exterior),
    );
    let unit = match report.solver {
        Solver::Jacobi => "sweeps",
        Solver::Multigrid => "V-cycles",
        Solver::ConjugateGradient => "steps",
    };
    let delta = report.delta_history.last().map_or(String::new(), |d| format!(", delta {d:.1e}"));
    let state = match (report.converged, report.at_round_off) {
        (true, false) => "converged",
        (true, true) => "converged to f32 precision",
        _ => "NOT converged",
    };
    row("solve", format!("{} {unit}, {state}{delta}", report.iterations));
    let t = report.timings_ms;
    row(
        "time",
        format!(
            "{} (voxelize {}, solve {}, sample {})",
            duration(t.total),
            duration(t.voxelize),
            duration(t.solve),
            duration(t.sample)
        ),
    );
    let memory = report.memory_bytes;
    row("memory", format!("{} (estimated {})", mebibytes(memory.peak), mebibytes(memory.estimated)));
    let error = report.rest_error;
    row(
        "rest error",
        format!("mean {:.1e}, max {:.1e} of the cage's diagonal", error.mean_rel, error.max_rel),
    );
    if let Some(raw) = report.raw_error {
        row(
            "solver error",
            format!(
                "mean {:.1e}, max {:.1e} of the diagonal, |sum - 1| at most {:.1e}, before the rows were restored",
                raw.point_rel.mean, raw.point_rel.max, raw.sum.max
            ),
        );
    }
    let weights = report.weights;
    row(
        "weights",
        format!(
            "{} stored ({:.1} per vertex), min {:.1e}, |sum - 1| at most {:.1e}",
            weights.nonzeros,
            weights.nonzeros as f64 / report.vertices.max(1) as f64,
            weights.min,
            weights.max_sum_error
        ),
    );
    row("outside", format!("{} vertices outside the cage", report.outside_vertices));
    if report.smooth > 0 {
        row("smooth", format!("{} steps of subdivision", report.smooth));
    }
    if report.held_vertices > 0 {
        row("held", format!("{} vertices attached to controls inside", report.held_vertices));
    }

    if !report.converged {
        let _ = writeln!(
            out,
            "warning: the bind stopped before it was accurate: delta did not fall below {:e} within {} iterations: raise --max-iterations or --tau",
            report.tau, report.iterations
        );
    }
    if report.ambiguous_cells > 0 {
        let _ = writeln!(
            out,
            "note: grid lines along x, y and z disagree whether {} cells are inside",
            report.ambiguous_cells
        );
    }
    for notice in model_notices.iter().chain(&report.notices) {
        let _ = writeln!(out, "note: {notice}");
    }
    for path in written {
        let _ = writeln!(out, "wrote {}", shown_path(path));
    }
    out
}

fn solver(report: &BindReport) -> &'static str {
    match report.solver {
        Solver::Jacobi => "Jacobi",
        Solver::Multigrid => "multigrid",
        Solver::ConjugateGradient => "conjugate gradients",
    }
}

/// Formats a time, with the unit that suits its size.
pub(crate) fn duration(ms: f64) -> String {
    if ms < 10.0 {
        format!("{ms:.1} ms")
    } else if ms < 1000.0 {
        format!("{ms:.0} ms")
    } else {
        format!("{:.2} s", ms / 1000.0)
    }
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn durations_have_a_suitable_unit() {
        assert_eq!(duration(0.44), "0.4 ms");
        assert_eq!(duration(46.2), "46 ms");
        assert_eq!(duration(12_345.0), "12.35 s");
    }
}
