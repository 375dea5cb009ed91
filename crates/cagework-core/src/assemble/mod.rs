//! Assembles sampled columns, in batches of [`LANES`], into one sparse row of weights per vertex, with statistics.

pub mod affine;
mod entries;
mod facts;

use std::ops::RangeInclusive;

use glam::{DVec3, Vec3};

use crate::controls::Controls;
use crate::simd::dispatch;
use crate::solve::rows::{LANES, Row, ZERO};
use crate::team::{Team, VERTEX_RUN};

pub use self::facts::{RawRow, RowFacts};

use self::entries::Entries;
use crate::weights::Weights;

use affine::{Columns, Sums};

/// A row whose error, as a fraction of the cage's diagonal, is at most this needs no further correction: about two
/// units in the last place of an f32 near 1.
const SUM_TOLERANCE: f64 = 2e-7;

/// Limit on the corrections of a row. One suffices unless the threshold dropped a large share of the weight.
const MAX_CORRECTIONS: usize = 3;

/// A row keeps its small weights if its error without them, as a fraction of the cage's diagonal, is above this even
/// after correction. Next to a face, the many small weights of cage vertices off the face determine the vertex's
/// distance from the face.
const MAX_ERROR: f64 = 1e-6;

/// A row keeps its small weights if correction would scale any of its weights by a factor outside this range.
const FACTOR_RANGE: RangeInclusive<f32> = 0.5..=2.0;

/// A row keeps its small weights if correction would change any of its weights by more than this many times the
/// threshold.
const MAX_CHANGE: f32 = 5.0;

/// Options of [`assemble`].
#[derive(Clone, Copy, Debug)]
pub struct RowOptions {
    /// Limit on the sum of the weights dropped from a row, smallest first; 0 keeps all non-zero weights. Correction
    /// then restores the row's sum and rest position. If that would change the row too much, the row keeps all its
    /// weights.
    pub threshold: f32,
    /// Whether to restore sum and rest position of every row. False for the classic method, which reproduces the method
    /// of K. Smith (`docs/method.md`, sources) with its errors.
    pub preserve_affine: bool,
}

/// A weight matrix with statistics of its rows.
#[derive(Clone, Debug, Default)]
pub struct AssembledWeights {
    /// The weights.
    pub weights: Weights,
    /// Statistics of each row. `[n_rows]`
    pub facts: Vec<RowFacts>,
}

/// A run of consecutive vertices in all batches: work item of a thread.
struct VertexRun<'a> {
    first: usize,
    points: &'a [Vec3],
    /// The rows of the run in each batch. `[n_batches]`
    blocks: Vec<&'a mut [Row]>,
    lengths: Vec<u32>,
    facts: Vec<RowFacts>,
    entries: Entries<'a>,
}

/// Assembles the weight matrix. `blocks[batch][vertex]`: sampled values, overwritten as scratch; `points`: rest
/// positions; `has_offset(vertex)`: whether an offset in [`Frames`](crate::frames::Frames) compensates the row's error,
/// so that the row is not corrected.
pub fn assemble(
    controls: Controls<'_>,
    blocks: &mut [Vec<Row>],
    points: &[Vec3],
    options: RowOptions,
    has_offset: impl Fn(usize) -> bool + Sync,
    team: &Team,
) -> AssembledWeights {
    let columns = Columns::new(controls);
    if team.n_threads() == 1 && options.threshold == 0.0 {
        return assemble_alone(controls, &columns, blocks, points, options, &has_offset);
    }
    let mut runs = runs_of(blocks, points, VERTEX_RUN);
    // Without a threshold all positive weights are stored, so rows are corrected while they are written. With a
    // threshold, the set of stored weights depends on the correction, so rows are corrected first.
    let corrected_first = options.threshold > 0.0;
    team.each_mut(&mut runs, |run| {
        dispatch(
            #[inline(always)]
            || {
                if corrected_first {
                    run.correct(&columns, options, &has_offset, |run, v, row| {
                        run.lengths.push(row.iter().flatten().map(|&w| u32::from(w != 0.0)).sum());
                        run.keep(v, row);
                    });
                } else {
                    run.count();
                }
            },
        );
    });

    let indptr = indptr_of(&runs);
    let end = indptr[points.len()] as usize;
    let (mut indices, mut data) = (vec![0u32; end], vec![0.0f32; end]);
    let (mut indices_left, mut data_left) = (indices.as_mut_slice(), data.as_mut_slice());
    for run in &mut runs {
        let n = run.lengths.iter().sum::<u32>() as usize;
        run.entries = Entries::Part {
            indices: indices_left.split_off_mut(..n).expect("allocated by the sum of lengths"),
            data: data_left.split_off_mut(..n).expect("allocated by the sum of lengths"),
        };
    }
    team.each_mut(&mut runs, |run| {
        dispatch(
            #[inline(always)]
            || {
                if corrected_first {
                    run.store_kept();
                } else {
                    run.correct(&columns, options, &has_offset, |run, v, row| {
                        run.entries.put_row(row, |batch| run.blocks[batch][v].map(|w| w > 0.0));
                    });
                }
            },
        );
    });
    let facts = runs.into_iter().flat_map(|run| run.facts).collect();
    AssembledWeights {
        weights: Weights::from_parts(controls.n_controls() as u32, indptr, indices, data),
        facts,
    }
}

/// Assembles the weight matrix, like [`assemble`], on one thread and without a threshold. Rows are nearly full and are
/// appended without counting first, which writes a third less memory.
fn assemble_alone(
    controls: Controls<'_>,
    columns: &Columns,
    blocks: &mut [Vec<Row>],
    points: &[Vec3],
    options: RowOptions,
    has_offset: &impl Fn(usize) -> bool,
) -> AssembledWeights {
    let mut runs = runs_of(blocks, points, points.len().max(1));
    let room = points.len() * controls.n_controls();
    for run in &mut runs {
        run.entries = Entries::All { indices: Vec::with_capacity(room), data: Vec::with_capacity(room) };
        dispatch(
            #[inline(always)]
            || {
                run.correct(columns, options, has_offset, |run, v, row| {
                    let length = run.entries.put_row(row, |batch| run.blocks[batch][v].map(|w| w > 0.0));
                    run.lengths.push(length);
                });
            },
        );
    }
    let indptr = indptr_of(&runs);
    let (indices, data, facts) = match runs.pop() {
        Some(VertexRun { entries: Entries::All { indices, data }, facts, .. }) => (indices, data, facts),
        _ => Default::default(),
    };
    AssembledWeights {
        weights: Weights::from_parts(controls.n_controls() as u32, indptr, indices, data),
        facts,
    }
}

fn indptr_of(runs: &[VertexRun<'_>]) -> Vec<u32> {
    let mut end = 0u32;
    let ends = runs.iter().flat_map(|run| &run.lengths).map(|length| {
        end += length;
        end
    });
    std::iter::once(0).chain(ends).collect()
}

fn runs_of<'a>(blocks: &'a mut [Vec<Row>], points: &'a [Vec3], length: usize) -> Vec<VertexRun<'a>> {
    let mut runs: Vec<VertexRun<'a>> = points
        .chunks(length)
        .enumerate()
        .map(|(number, points)| VertexRun {
            first: number * length,
            points,
            blocks: Vec::new(),
            lengths: Vec::with_capacity(points.len()),
            facts: Vec::with_capacity(points.len()),
            entries: Entries::Part { indices: &mut [], data: &mut [] },
        })
        .collect();
    for block in blocks {
        for (run, rows) in runs.iter_mut().zip(block.chunks_mut(length)) {
            run.blocks.push(rows);
        }
    }
    runs
}

impl VertexRun<'_> {
    /// Copies a vertex's sampled values to `row`, with 0 for values that are negative or below `least`. Returns the
    /// smallest sampled value.
    #[inline(always)]
    fn load(&self, v: usize, least: f32, row: &mut [Row]) -> f32 {
        let mut lows = [f32::INFINITY; LANES];
        for (row, block) in row.iter_mut().zip(&self.blocks) {
            *row = block[v];
            // Set negative values to zero: harmonic coordinates are not negative, but solver and rounding leave values
            // near -1e-8.
            for (w, low) in row.iter_mut().zip(&mut lows) {
                *low = if *w < *low { *w } else { *low };
                *w = if *w > 0.0 && *w >= least { *w } else { 0.0 };
            }
        }
        lows.iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a })
    }

    /// Counts the entries of each row if every positive weight is stored.
    #[inline(always)]
    fn count(&mut self) {
        for v in 0..self.points.len() {
            let mut positive = [0u32; LANES];
            for block in &self.blocks {
                for k in 0..LANES {
                    positive[k] += u32::from(block[v][k] > 0.0);
                }
            }
            self.lengths.push(positive.iter().sum());
        }
    }

    /// Drops small weights, corrects each row and computes statistics. Calls `take(run, vertex, row)` for each row.
    #[inline(always)]
    fn correct(
        &mut self,
        columns: &Columns,
        options: RowOptions,
        has_offset: &impl Fn(usize) -> bool,
        take: impl Fn(&mut Self, usize, &[Row]),
    ) {
        let mut row = vec![ZERO; self.blocks.len()];
        for (v, point) in self.points.iter().enumerate() {
            let target = columns.scale(point.as_dvec3());
            let has_offset = has_offset(self.first + v);
            let lowest = self.load(v, 0.0, &mut row);
            let (raw, stored) = if options.preserve_affine && !has_offset {
                self.restore_row(v, columns, options.threshold, &mut row, target)
            } else if options.threshold > 0.0 {
                // The offset compensates the row's error, so the goal is not the vertex. Dropping weights must not
                // change the position that the row reproduces.
                let raw = columns.sums(&row, target);
                let goal = columns.combined(&row).1;
                self.restore_row(v, columns, options.threshold, &mut row, goal);
                (raw, columns.sums(&row, target))
            } else {
                let raw = columns.sums(&row, target);
                (raw, raw)
            };
            let raw = (!has_offset).then_some(RawRow { sums: raw, lowest });
            self.facts.push(RowFacts::from_row(&row, stored, raw));
            take(self, v, &row);
        }
    }

    /// Stores a row in the blocks until all lengths are known.
    #[inline(always)]
    fn keep(&mut self, v: usize, row: &[Row]) {
        for (row, block) in row.iter().zip(&mut self.blocks) {
            block[v] = *row;
        }
    }

    #[inline(always)]
    fn store_kept(&mut self) {
        for v in 0..self.points.len() {
            let row: Vec<Row> = self.blocks.iter().map(|block| block[v]).collect();
            self.entries.put_row(&row, |batch| row[batch].map(|w| w != 0.0));
        }
    }

    /// Drops small weights and corrects the row, or keeps all weights if the correction is not acceptable. `row` holds
    /// the vertex's sampled values; `goal` is the position to reproduce. Returns the sums before and after.
    #[inline(always)]
    fn restore_row(
        &self,
        v: usize,
        columns: &Columns,
        threshold: f32,
        row: &mut [Row],
        goal: DVec3,
    ) -> (Sums, Sums) {
        if threshold == 0.0 {
            return restore(columns, row, goal);
        }
        let sampled = columns.sums(row, goal);
        self.load(v, least_kept(row, threshold), row);
        let (_, restored) = restore(columns, row, goal);
        let bounded = row.iter().zip(&self.blocks).all(|(row, block)| {
            row.iter().zip(&block[v]).all(|(&w, &was)| {
                w == 0.0 || (FACTOR_RANGE.contains(&(w / was)) && (w - was).abs() <= MAX_CHANGE * threshold)
            })
        });
        if bounded && restored.error() <= MAX_ERROR {
            return (sampled, restored);
        }
        self.load(v, 0.0, row);
        restore(columns, row, goal)
    }
}

/// Finds the largest threshold such that the weights below it sum to at most `most`. Bisects over the bit patterns of
/// f32, which, for positive numbers, have the order of the numbers.
fn least_kept(row: &[Row], most: f32) -> f32 {
    let (mut low, mut high) = (0, most.to_bits() + 1);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        let least = f32::from_bits(middle);
        let below: f32 = row.iter().flatten().map(|&w| if w < least { w } else { 0.0 }).sum();
        if below <= most { low = middle } else { high = middle }
    }
    f32::from_bits(low)
}

/// Corrects a row until it sums to 1 and reproduces `goal`. Returns the row's sums before (in f32 precision) and after.
// Inlined where callers are compiled for several instruction sets; wasm keeps one copy to save download size.
#[cfg_attr(not(target_family = "wasm"), inline(always))]
#[cfg_attr(target_family = "wasm", inline(never))]
fn restore(columns: &Columns, row: &mut [Row], goal: DVec3) -> (Sums, Sums) {
    let before = columns.restore_affine(row, goal);
    let mut after = columns.sums(row, goal);
    for _ in 1..MAX_CORRECTIONS {
        if after.error() <= SUM_TOLERANCE {
            break;
        }
        columns.restore_affine(row, goal);
        after = columns.sums(row, goal);
    }
    (before, after)
}
