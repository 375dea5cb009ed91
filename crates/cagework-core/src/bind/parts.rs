//! A bind in parts, for many processes or machines: each solves some of the columns, one puts them together.
//!
//! Columns are independent but for two things. Rows are restored (sum, rest position, small weights dropped) over all
//! columns: so a part holds raw samples, and [`Merge`] makes rows of them by the code of every bind. And a batch of
//! columns stops as one: so batches are solved whole, and those of eight that lie in two parts are solved twice.

use std::ops::Range;

use glam::Vec3;
use thiserror::Error;

use super::pipeline::{FieldsOn, Prepared, Solved};
use super::solving::solve_and_sample;
use super::{BindError, Binding, Watch};
use crate::controls::Controls;
use crate::options::{BindOptions, Solver};
use crate::progress::Progress;
use crate::solve::rows::{LANES, Row, ZERO};
use crate::solve::stop::SolveReport;

/// Samples of some columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Controls, as they are numbered in the whole.
    pub columns: Range<u32>,
    /// Values at the mesh's different positions, in the order of their first occurrence, nothing restored yet.
    /// `[n_points][columns.len()]`
    pub samples: Vec<f32>,
    /// How the solve of these columns went.
    pub report: SolveReport,
}

/// Why columns cannot be bound apart, or parts not be put together.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PartError {
    /// When this solver is done depends on all columns.
    #[error(
        "columns cannot be solved apart by Jacobi's method, whose stop rule looks at all of them: use multigrid or cg"
    )]
    Coupled,
    /// No range of the controls.
    #[error(
        "columns {begin}:{end} are no range of the {n} controls: give A:B with A below B and B not above {n}"
    )]
    Range {
        /// First column.
        begin: usize,
        /// The one after the last.
        end: usize,
        /// Columns there are.
        n: usize,
    },
    /// A part is of another mesh.
    #[error("has {given} samples; {columns} columns of {points} different positions are {}", columns * points)]
    Samples {
        /// Samples.
        given: usize,
        /// Columns of the part.
        columns: usize,
        /// Positions of the mesh.
        points: usize,
    },
    /// Two parts have a column.
    #[error("column {column} is in another part already: give each column once")]
    Twice {
        /// The first such column.
        column: usize,
    },
    /// No part has some columns.
    #[error("columns {begin}:{end} are in no part: bind them with `--columns {begin}:{end}`")]
    Missing {
        /// The first such column.
        begin: usize,
        /// The next one that a part has, or the number of all.
        end: usize,
    },
    /// The bind.
    #[error(transparent)]
    Bind(#[from] BindError),
}

/// Solves `columns` of a bind and samples them.
///
/// # Errors
/// [`PartError`]: Jacobi's method, no such columns, or the bind.
pub fn bind_columns<'a>(
    positions: &[Vec3],
    controls: impl Into<Controls<'a>>,
    options: &BindOptions,
    columns: Range<usize>,
    progress: &dyn Progress,
) -> Result<Part, PartError> {
    if options.solver == Solver::Jacobi {
        return Err(PartError::Coupled);
    }
    let controls = controls.into();
    check_range(&columns, controls.n_controls())?;
    let watch = Watch::new(progress);
    // No row is made: all samples are kept, whatever will be dropped.
    let options = BindOptions { sparsify: 0.0, ..*options };
    let batches = columns.start / LANES..columns.end.div_ceil(LANES);
    let first = batches.start * LANES;
    let n_solved = batches.len() * LANES;
    let prepared = Prepared::for_columns(positions, controls, &options, FieldsOn::Host, n_solved, &watch)?;
    let (stencils, team) = (prepared.stencils(), &prepared.gridded.team);
    let solved = solve_and_sample(prepared.hierarchy(), batches, stencils, &options, team, &watch)
        .map_err(BindError::from)?;
    let mut samples = Vec::with_capacity(stencils.len() * columns.len());
    for point in 0..stencils.len() {
        let lane = |column: usize| solved.blocks[(column - first) / LANES][point][column % LANES];
        samples.extend(columns.clone().map(lane));
    }
    Ok(Part { columns: columns.start as u32..columns.end as u32, samples, report: solved.report })
}

fn check_range(columns: &Range<usize>, n: usize) -> Result<(), PartError> {
    if columns.start < columns.end && columns.end <= n {
        return Ok(());
    }
    Err(PartError::Range { begin: columns.start, end: columns.end, n })
}

/// Parts of one bind on their way to its weights, which are those of the bind in one piece, to the bit.
pub struct Merge<'a> {
    prepared: Prepared<'a>,
    watch: Watch<'a>,
    /// `[n_batches][n_points]`
    blocks: Vec<Vec<Row>>,
    /// Which columns are there. `[n_controls]`
    has: Vec<bool>,
    reports: Vec<SolveReport>,
}

impl<'a> Merge<'a> {
    /// Makes room for all columns. The cage is laid into its grid anew, which is cheap beside a solve: which vertices are
    /// outside follows from it. All arguments: those of the parts.
    ///
    /// # Errors
    /// [`BindError`], memory above the limit among them.
    pub fn new(
        positions: &'a [Vec3],
        controls: Controls<'a>,
        options: &'a BindOptions,
        progress: &'a dyn Progress,
    ) -> Result<Self, BindError> {
        let watch = Watch::new(progress);
        // As if the fields were elsewhere: they were.
        let prepared = Prepared::new(positions, controls, options, FieldsOn::Device, &watch)?;
        let n_batches = prepared.hierarchy().n_batches();
        let blocks = vec![vec![ZERO; prepared.stencils().len()]; n_batches];
        Ok(Self { prepared, watch, blocks, has: vec![false; controls.n_controls()], reports: Vec::new() })
    }

    /// Takes a part.
    ///
    /// # Errors
    /// [`PartError`] when it has columns that are not there or that another part has, or not a value for each position.
    pub fn add(&mut self, part: &Part) -> Result<(), PartError> {
        let columns = part.columns.start as usize..part.columns.end as usize;
        check_range(&columns, self.has.len())?;
        let (given, points) = (part.samples.len(), self.prepared.stencils().len());
        if given != columns.len() * points {
            return Err(PartError::Samples { given, columns: columns.len(), points });
        }
        if let Some(column) = columns.clone().find(|&column| self.has[column]) {
            return Err(PartError::Twice { column });
        }
        for (k, column) in columns.clone().enumerate() {
            self.has[column] = true;
            let values = part.samples[k..].iter().step_by(columns.len());
            for (row, value) in self.blocks[column / LANES].iter_mut().zip(values) {
                row[column % LANES] = *value;
            }
        }
        self.reports.push(part.report.clone());
        Ok(())
    }

    /// The weights. Of the report's times, the solve's are those of the parts and not here.
    ///
    /// # Errors
    /// [`PartError::Missing`], or cancelled.
    pub fn finish(self) -> Result<Binding, PartError> {
        if let Some(begin) = self.has.iter().position(|has| !has) {
            let length = self.has[begin..].iter().position(|&has| has);
            let end = length.map_or(self.has.len(), |length| begin + length);
            return Err(PartError::Missing { begin, end });
        }
        let report = SolveReport::together(&self.reports);
        let (iterations, blocks) = (report.latest().0, self.blocks);
        let solved = Solved { blocks, report, iterations, delta_interval: 1, ..Solved::default() };
        Ok(self.prepared.finish(solved, &self.watch)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bind::bind;
    use crate::cage::Cage;
    use crate::cage_gen::subdivided_box;
    use crate::mesh::Bounds;
    use crate::options::Method;
    use crate::progress::Silent;

    /// 26 columns, and points of a line through the cage that ends outside, one of them twice.
    fn case() -> (Cage, Vec<Vec3>) {
        let cube = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let cage = Cage::new(&subdivided_box(cube, 0.0, [2, 2, 2])).unwrap();
        let mut points: Vec<Vec3> = (0..200)
            .map(|k| Vec3::new(0.3, 0.11, -0.9) + 0.01 * k as f32 * Vec3::new(-0.4, 0.3, 1.0))
            .collect();
        points.push(points[3]);
        (cage, points)
    }

    #[test]
    fn parts_put_together_are_the_whole_bind_to_the_bit() {
        let (cage, points) = case();
        let usual = BindOptions { grid: 12, ..BindOptions::default() };
        for options in [
            usual,
            BindOptions { sparsify: 1e-3, threads: 1, ..usual },
            BindOptions { solver: Solver::ConjugateGradient, ..usual },
            BindOptions { method: Method::Classic, ..usual },
        ] {
            let whole = bind(&points, &cage, &options, &Silent).unwrap();
            // In another order, with a batch of eight in three parts, by other numbers of threads.
            let mut merge = Merge::new(&points, Controls::from(&cage), &options, &Silent).unwrap();
            for (columns, threads) in [(10..12, 1), (12..26, 2), (0..10, 1)] {
                let options = BindOptions { threads, ..options };
                merge.add(&bind_columns(&points, &cage, &options, columns, &Silent).unwrap()).unwrap();
            }
            let merged = merge.finish().unwrap();
            assert!(merged.weights == whole.weights && merged.frames == whole.frames, "{options:?}");
            let said = |b: &Binding| (b.report.iterations, b.report.converged, b.report.rest_error);
            assert_eq!(said(&merged), said(&whole));
        }
    }

    #[test]
    fn what_is_no_whole_is_refused() {
        let (cage, points) = case();
        let options = BindOptions { grid: 8, ..BindOptions::default() };
        let part = |columns| bind_columns(&points, &cage, &options, columns, &Silent);
        for (begin, end) in [(5, 5), (0, 27), (9, 3)] {
            assert_eq!(part(begin..end).unwrap_err(), PartError::Range { begin, end, n: 26 });
        }
        let jacobi = BindOptions { solver: Solver::Jacobi, ..options };
        let refused = bind_columns(&points, &cage, &jacobi, 0..8, &Silent).unwrap_err();
        assert_eq!(refused, PartError::Coupled);

        let mut merge = Merge::new(&points, Controls::from(&cage), &options, &Silent).unwrap();
        let first = part(0..8).unwrap();
        merge.add(&first).unwrap();
        assert_eq!(merge.add(&part(7..16).unwrap()).unwrap_err(), PartError::Twice { column: 7 });
        let cut = Part { samples: vec![0.0; 9], columns: 16..24, ..first };
        let expected = PartError::Samples { given: 9, columns: 8, points: 200 };
        assert_eq!(merge.add(&cut).unwrap_err(), expected);
        merge.add(&part(20..26).unwrap()).unwrap();
        assert_eq!(merge.finish().unwrap_err(), PartError::Missing { begin: 8, end: 20 });
    }
}
