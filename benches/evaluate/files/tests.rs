//! Tests that an evaluation makes all files, and that the findings of the report agree with its tables.

use std::collections::HashMap;

use cagework_core::{Bounds, Cage, PolygonMesh, subdivided_box};
use cagework_gpu::GpuError;
use cagework_io::Model;
use cagework_tests::creature::creature;
use glam::DVec3;

use super::*;

/// Grids that an evaluation with `-g 32` runs.
const GRIDS: [u32; 3] = [8, 16, 32];

/// Rows of a CSV file, each a map from column name to value.
type Table = Vec<HashMap<String, String>>;

fn csv(bytes: &[u8]) -> Table {
    let text = std::str::from_utf8(bytes).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let head = lines.next().unwrap();
    lines
        .map(|row| {
            assert_eq!(row.len(), head.len(), "{row:?}");
            head.iter().cloned().zip(row).collect()
        })
        .collect()
}

/// The single row of an implementation for one grid and tau.
fn row<'a>(table: &'a Table, implementation: &str, g: u32, tau: &str) -> &'a HashMap<String, String> {
    let g = g.to_string();
    let mut found =
        table.iter().filter(|r| r["implementation"] == implementation && r["g"] == g && r["tau"] == tau);
    let row = found.next().unwrap_or_else(|| panic!("no row of {implementation} at g = {g}, tau = {tau}"));
    assert!(found.next().is_none(), "two rows of {implementation} at g = {g}, tau = {tau}");
    row
}

fn number(row: &HashMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} is '{}'", row[column]))
}

/// The lines of the report that contain `words`.
fn lines<'a>(report: &'a str, words: &'a str) -> impl Iterator<Item = &'a str> {
    report.lines().filter(move |line| line.contains(words))
}

/// The first line of the report that contains both `words` and `also`.
fn line<'a>(report: &'a str, words: &'a str, also: &str) -> &'a str {
    lines(report, words)
        .find(|line| line.contains(also))
        .unwrap_or_else(|| panic!("no line contains '{words}' and '{also}' in\n{report}"))
}

/// Asserts that every element of an SVG file is closed, and that the file has text.
fn assert_well_formed(name: &str, bytes: &[u8]) {
    let text = std::str::from_utf8(bytes).unwrap();
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').unwrap_or_else(|| panic!("{name}: '{tag}' does not end"));
        if tag.starts_with('?') || tag.starts_with('!') || tag.ends_with('/') {
            continue;
        }
        match tag.strip_prefix('/') {
            Some(closed) => assert_eq!(open.pop(), Some(closed.trim()), "{name}"),
            None => open.push(tag.split_whitespace().next().unwrap()),
        }
        assert!(open.first() == Some(&"svg") || open.is_empty(), "{name}: {open:?}");
    }
    assert!(open.is_empty(), "{name}: {open:?} is not closed");
    assert!(text.contains("<text") && text.len() > 1000, "{name} has no content");
}

/// Evaluates the animal in a box with 32 cells. Runs without a GPU: Jacobi sweeps on a software adapter would double the
/// time of these tests.
fn evaluated(runs: u32) -> HashMap<String, Vec<u8>> {
    let animal = creature();
    let bounds = Bounds::around(&animal.positions).unwrap();
    let faces = animal.triangles.iter().map(|t| t.to_vec()).collect();
    let mesh = PolygonMesh { positions: animal.positions, faces };
    let model = Model::of_mesh("animal.obj", &mesh, DVec3::ZERO).unwrap();
    let cage = Cage::new(&subdivided_box(bounds, 0.1, [1; 3])).unwrap();
    let input = Input { name: "animal".to_owned(), model, cage };
    let gpu = Err(GpuError::NoAdapter { reason: "not used by this test".to_owned() });
    let evaluation = Evaluation::run(&input, (32, runs), gpu.as_ref()).unwrap();
    all(&input, &evaluation).unwrap().into_iter().collect()
}

#[test]
fn evaluation_makes_all_files_and_reports_what_it_measured() {
    let files = evaluated(3);
    let report = String::from_utf8(files["report.md"].clone()).unwrap();
    for number in 7..=12 {
        let name = format!("figure-{number}.svg");
        assert_well_formed(&name, &files[&name]);
        assert!(report.contains(&format!("({name})")), "{name} is not in the report");
    }
    for figure in ["figure-2", "figure-3", "figure-4", "figure-5-ours"] {
        let name = format!("{figure}.glb");
        Model::read(&name, &files[&name], &mut |_| None).unwrap();
        assert!(report.contains(&format!("| {name} |")));
    }
    assert_times_agree(&report, &csv(&files["time.csv"]));
    assert_errors_agree(&report, &csv(&files["error.csv"]));
    let delta = csv(&files["delta.csv"]);
    let deltas: Vec<f64> = delta
        .iter()
        .filter(|r| r["implementation"] == "paper-one-thread")
        .map(|r| number(r, "delta"))
        .collect();
    assert!(deltas.len() > 10 && deltas.iter().all(|d| *d > 0.0));
    assert!(deltas.first() > deltas.last(), "delta decreases");
    assert!(report.contains("GPU implementation was not run"));
    assert!(!report.contains("GPU-based smoothing"), "no finding about the GPU");
}

fn assert_times_agree(report: &str, table: &Table) {
    for g in &GRIDS[1..] {
        for tau in ["1e-4", "1e-5"] {
            for implementation in [
                "paper-one-thread",
                "paper-threads",
                "cg-one-thread",
                "cg-threads",
                "multigrid-one-thread",
                "multigrid-threads",
            ] {
                let row = row(table, implementation, *g, tau);
                assert_eq!(row["runs"], "3");
                assert_eq!(row["converged"], "true", "{implementation}, g = {g}, tau = {tau}");
                let [min, median, max] = ["min_ms", "total_ms", "max_ms"].map(|c| number(row, c));
                assert!(
                    0.0 < min && min <= median && median <= max,
                    "{implementation}: {min} {median} {max}"
                );
            }
        }
        let times = |implementation| {
            let row = row(table, implementation, *g, "1e-5");
            (number(row, "min_ms"), number(row, "max_ms"))
        };
        let (one, all) = (times("paper-one-thread"), times("paper-threads"));
        let threaded = line(report, "Threaded smoothing", &format!("g = {g}:"));
        let verdicts = ["is reversed", "holds here", "is undecided"];
        let expected = if all.1 < one.0 {
            0
        } else if all.0 > one.1 {
            1
        } else {
            2
        };
        for (k, verdict) in verdicts.iter().enumerate() {
            assert_eq!(threaded.contains(verdict), k == expected, "{one:?} {all:?}: {threaded}");
        }
        assert_eq!(threaded.contains("within the spread"), expected == 2, "{threaded}");
        let needs =
            line(report, "conjugate gradients in the embedded method's cells", &format!("At g = {g} "));
        for (implementation, unit) in
            [("paper-one-thread", "sweeps"), ("cg-one-thread", "steps"), ("multigrid-one-thread", "cycles")]
        {
            let n = &row(table, implementation, *g, "1e-5")["iterations"];
            assert!(needs.contains(&format!("{n} {unit}")), "{implementation} needs {n}: {needs}");
        }
        let ours = times("multigrid-threads");
        let factor = line(report, "Embedded multigrid on all threads", &format!("g = {g},"));
        assert_eq!(factor.contains("times as fast"), ours.1 < one.0, "{one:?} {ours:?}: {factor}");
    }
}

fn assert_errors_agree(report: &str, table: &Table) {
    let error = |implementation, g, tau| number(row(table, implementation, g, tau), "mean_rel");
    for g in GRIDS {
        for tau in ["1e-3", "1e-4", "1e-5"] {
            assert!(error("paper-threads", g, tau) > 0.0);
        }
    }
    let (paper, ours) = (error("paper-threads", 32, "1e-5"), error("multigrid-threads", 32, "1e-5"));
    let quantised = line(report, "quantization", "g = 32");
    assert_eq!(quantised.contains("is due to the method"), ours < paper, "{paper} {ours}: {quantised}");
    for value in [paper, ours] {
        assert!(quantised.contains(&format!("{value:.1e}")), "{value:e} is not in: {quantised}");
    }
    let coarse_tau = error("paper-threads", 32, "1e-4");
    let smoothed = line(report, "needs a smaller tau", "g = 32");
    assert_eq!(smoothed.contains(", holds at"), coarse_tau > paper, "{smoothed}");
}

#[test]
fn report_of_a_single_run_calls_no_time_shorter() {
    let report = String::from_utf8(evaluated(1).remove("report.md").unwrap()).unwrap();
    assert!(!report.contains("times as fast") && !report.contains("is reversed"), "{report}");
    for g in &GRIDS[1..] {
        let threaded = line(&report, "Threaded smoothing", &format!("g = {g}:"));
        assert!(threaded.contains("is undecided") && threaded.contains("within the spread"), "{threaded}");
    }
}
