//! `cagework bind --columns` and `cagework merge`: one bind on many machines.

use std::ops::Range;
use std::path::Path;
use std::time::Instant;

use cagework_core::bind::{Merge, PartError, bind_columns};
use cagework_core::mesh::weld;
use cagework_core::options::BindOptions;
use cagework_core::{Cage, ControlSet, Controls};
use cagework_io::{PartOf, read_part_npz, write_part_npz, write_weights_npz};
use glam::Vec3;
use serde::Serialize;

use crate::args::{BindArgs, MergeArgs};
use crate::card;
use crate::error::CliError;
use crate::files::{MAX_FILE_BYTES, check_outputs, json, print, read, shown_path, write};
use crate::load::LoadedCage;
use crate::progress::Bar;

/// What a file of a part takes while it is read, as a multiple of its length: the file, its array, and the array's values.
const READ_SHARE: u64 = 3;

/// What was done; its JSON is the output of `--json`.
#[derive(Debug, Serialize)]
struct Bound {
    output: String,
    /// First column, and the one after the last.
    columns: [usize; 2],
    controls: usize,
    vertices: usize,
    iterations: u32,
    converged: bool,
    elapsed_ms: f64,
}

/// Binds some columns and writes them. Returns what there is to say.
///
/// # Errors
/// When there are no such columns, the solver cannot solve them apart, the file would be too large, or the bind fails.
pub(crate) fn bind(
    args: &BindArgs,
    loaded: &LoadedCage,
    points: &[Vec3],
    options: &BindOptions,
    columns: Range<usize>,
    as_json: bool,
) -> Result<String, CliError> {
    // The command line asks for it together with columns.
    let Some(output) = &args.weights else { return Ok(String::new()) };
    if args.solve.on_gpu() {
        return Err(CliError::Mismatch {
            message: "columns are bound apart on the processor only".into(),
            hint: "leave out `--backend gpu`",
        });
    }
    let controls = loaded.controls();
    let bytes = 4 * (weld(points).first.len() * columns.len()) as u64;
    if bytes > MAX_FILE_BYTES {
        return Err(CliError::Mismatch {
            message: format!(
                "columns {}:{} would be a file of {} MiB, but at most {} MiB are read",
                columns.start,
                columns.end,
                bytes >> 20,
                MAX_FILE_BYTES >> 20
            ),
            hint: "bind fewer columns at a time",
        });
    }
    let started = Instant::now();
    let part = bind_columns(points, controls, options, columns.clone(), &Bar::start())?;
    let elapsed_ms = started.elapsed().as_secs_f64() * 1e3;
    let own = BindOptions::default();
    let of = PartOf {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        options: BindOptions {
            threads: own.threads,
            memory_limit: own.memory_limit,
            held: own.held,
            extra_points: own.extra_points,
            ..*options
        },
        extra_points: options.extra_points,
        cage: loaded.mesh(),
        smooth: controls.smooth(),
        inner: controls.inner().cloned().unwrap_or_default(),
        positions: points.to_vec(),
    };
    write(output, &write_part_npz(&of, &part))?;
    let done = Bound {
        output: output.display().to_string(),
        columns: [columns.start, columns.end],
        controls: controls.n_controls(),
        vertices: points.len() - options.extra_points,
        iterations: part.report.latest().0,
        converged: part.report.converged,
        elapsed_ms,
    };
    Ok(if as_json { json(&done) } else { text(&done) })
}

fn text(done: &Bound) -> String {
    let [begin, end] = done.columns;
    let mut out = format!(
        "bound {} vertices to columns {begin}:{end} of {} in {}\n",
        done.vertices,
        done.controls,
        card::duration(done.elapsed_ms)
    );
    if !done.converged {
        out += &format!(
            "warning: NOT converged within {} iterations: raise --max-iterations or --tau\n",
            done.iterations
        );
    }
    out + &format!("wrote {}: a part for cagework merge\n", shown_path(done.output.as_ref()))
}

/// Runs `cagework merge`.
///
/// # Errors
/// When a file cannot be read or written, or the parts are not all of one bind.
pub(crate) fn merge(args: &MergeArgs, as_json: bool) -> Result<(), CliError> {
    let parts: Vec<&Path> = args.parts.iter().map(AsRef::as_ref).collect();
    check_outputs(&[&args.output], &parts)?;
    let limit = args.memory.bytes();
    let read_part = |path: &Path| {
        let bytes = read(path)?;
        let (of, part) = read_part_npz(&bytes, limit).map_err(|e| CliError::file(path, e))?;
        Ok::<_, CliError>((of, part, bytes.len() as u64))
    };
    // The command line asks for one at least.
    let Some((first, others)) = parts.split_first() else { return Ok(()) };
    let (of, part, file_bytes) = read_part(first)?;
    let options = BindOptions {
        threads: args.threads,
        memory_limit: limit,
        held: READ_SHARE * file_bytes,
        extra_points: of.extra_points,
        ..of.options
    };
    let cage = Cage::new(&of.cage)
        .map_err(|source| CliError::Cage { name: format!("cage of {}", first.display()), source })?;
    let set = ControlSet::new(&cage, of.smooth, of.inner.clone()).map_err(|e| CliError::file(first, e))?;
    let controls = Controls::from(&set);
    let bar = Bar::start();
    let mut merge = Merge::new(&of.positions, controls, &options, &bar)?;
    merge.add(&part).map_err(|e| CliError::file(first, e))?;
    drop(part);
    for path in others {
        let (other, part, _) = read_part(path)?;
        if let Some(what) = of.difference(&other) {
            return Err(CliError::Mismatch {
                message: format!(
                    "{}: is a part of another bind than {}: its {what} differs",
                    shown_path(path),
                    shown_path(first)
                ),
                hint: "bind all parts from the same files with the same options, but for --columns",
            });
        }
        merge.add(&part).map_err(|e| CliError::file(path, e))?;
    }
    let binding = merge.finish()?;
    drop(bar);
    let (_, extra_points) = of.positions.split_at(of.positions.len() - of.extra_points);
    let inner = &controls.rest()[cage.n_vertices()..];
    write(
        &args.output,
        &write_weights_npz(&binding.weights, &binding.frames, &binding.outside, extra_points, inner),
    )?;
    if as_json {
        return print(&json(&binding.report));
    }
    let card = card::of(&binding.report, &[], std::slice::from_ref(&args.output));
    print(&format!("merged {} parts\n{card}", parts.len()))
}

impl From<PartError> for CliError {
    fn from(error: PartError) -> Self {
        match error {
            PartError::Bind(error) => error.into(),
            error => Self::Part(error),
        }
    }
}
