//! Tests that `cagework evaluate` writes all its files, and that the findings of the report agree with its tables.

use std::collections::HashMap;

use predicates::str::contains;

use crate::support::{Sandbox, glb_json};

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

#[test]
fn evaluation_writes_all_files_and_reports_what_it_measured() {
    let sandbox = Sandbox::with_sphere_in_box();
    // Run without a GPU: Jacobi sweeps on a software adapter would double the time of these tests.
    let mut command = sandbox.command("evaluate --mesh mesh.obj --cage cage.obj -g 32 --runs 3 -o out");
    command.env("CAGEWORK_ADAPTER", "no such adapter").assert().success().stdout(contains("out/report.md"));
    let report = String::from_utf8(sandbox.read("out/report.md")).unwrap();
    for number in 7..=12 {
        let name = format!("out/figure-{number}.svg");
        assert_well_formed(&name, &sandbox.read(&name));
        assert!(report.contains(&format!("(figure-{number}.svg)")), "{name} is not in the report");
    }
    for figure in ["figure-2", "figure-3", "figure-4", "figure-5-ours"] {
        glb_json(&sandbox.read(&format!("out/{figure}.glb")));
        assert!(report.contains(&format!("| {figure}.glb |")));
    }
    assert_times_agree(&report, &csv(&sandbox.read("out/time.csv")));
    assert_errors_agree(&report, &csv(&sandbox.read("out/error.csv")));
    let delta = csv(&sandbox.read("out/delta.csv"));
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
    let sandbox = Sandbox::with_sphere_in_box();
    let mut command = sandbox.command("evaluate --mesh mesh.obj --cage cage.obj -g 32 --runs 1 -o out");
    command.env("CAGEWORK_ADAPTER", "no such adapter").assert().success();
    let report = String::from_utf8(sandbox.read("out/report.md")).unwrap();
    assert!(!report.contains("times as fast") && !report.contains("is reversed"), "{report}");
    for g in &GRIDS[1..] {
        let threaded = line(&report, "Threaded smoothing", &format!("g = {g}:"));
        assert!(threaded.contains("is undecided") && threaded.contains("within the spread"), "{threaded}");
    }
}
