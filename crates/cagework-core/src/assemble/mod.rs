//! From batches of sampled columns to one sparse row per vertex, with the statistics of what is stored.

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

/// Rows whose sums miss by less than this (of the cage's diagonal) are good: two units in the last place of an f32
/// near 1.
const GOOD_ENOUGH: f64 = 2e-7;

/// Corrections are repeated until the sums hold, at most this often: once is enough but for rows in which the
/// threshold dropped a large share of the weight.
const MAX_CORRECTIONS: usize = 3;

/// A row that misses by more (of the cage's diagonal) after small weights were dropped keeps them all: next to a face,
/// the many small weights of the vertices off the face are what holds the vertex away from it.
const NOT_RESTORED: f64 = 1e-6;

/// So does a row of which a weight would change by a factor outside this range,
const FACTORS: RangeInclusive<f32> = 0.5..=2.0;

/// or by more than this many times the threshold.
const CHANGE: f32 = 5.0;

/// How rows are made from sampled values.
#[derive(Clone, Copy, Debug)]
pub struct RowOptions {
    /// The smallest weights of a row are dropped as long as their sum is not above it; 0 keeps all that are not zero. What
    /// is dropped changes neither a row's sum nor where it puts its vertex.
    pub threshold: f32,
    /// Restore sum and rest position of every row. Off for the classic method, which shows its errors.
    pub preserve_affine: bool,
}

/// A matrix of weights and what was found out about its rows.
#[derive(Clone, Debug, Default)]
pub struct Assembled {
    /// The matrix.
    pub weights: Weights,
    /// `[n_rows]`
    pub facts: Vec<RowFacts>,
}

/// The rows of one run of vertices in all batches, and what is found out about them.
struct Run<'a> {
    first: usize,
    points: &'a [Vec3],
    /// `[n_batches]` slices of the batches' blocks.
    blocks: Vec<&'a mut [Row]>,
    lengths: Vec<u32>,
    facts: Vec<RowFacts>,
    entries: Entries<'a>,
}

/// Makes the matrix of weights. `blocks[batch][vertex]`: sampled values (used up as scratch space); `points`: rest
/// positions; `has_offset(vertex)`: whether an offset makes up for what its row misses, so that it stays as it is sampled.
pub fn assemble(
    controls: Controls<'_>,
    blocks: &mut [Vec<Row>],
    points: &[Vec3],
    options: RowOptions,
    has_offset: impl Fn(usize) -> bool + Sync,
    team: &Team,
) -> Assembled {
    let columns = Columns::new(controls);
    if team.n_threads() == 1 && options.threshold == 0.0 {
        return assemble_alone(controls, &columns, blocks, points, options, &has_offset);
    }
    let mut runs = runs_of(blocks, points, VERTEX_RUN);
    // Without a threshold it is known beforehand which weights are stored: rows are corrected on their way into the
    // result. With one, it depends on the correction.
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
            indices: indices_left.split_off_mut(..n).expect("the lengths' sum was allocated"),
            data: data_left.split_off_mut(..n).expect("the lengths' sum was allocated"),
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
    Assembled { weights: Weights::from_parts(controls.n_controls() as u32, indptr, indices, data), facts }
}

/// The same on one thread without a threshold, where rows are nearly full and can be put one after the other without counting
/// them first: a third less memory is written.
fn assemble_alone(
    controls: Controls<'_>,
    columns: &Columns,
    blocks: &mut [Vec<Row>],
    points: &[Vec3],
    options: RowOptions,
    has_offset: &impl Fn(usize) -> bool,
) -> Assembled {
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
        Some(Run { entries: Entries::All { indices, data }, facts, .. }) => (indices, data, facts),
        _ => Default::default(),
    };
    Assembled { weights: Weights::from_parts(controls.n_controls() as u32, indptr, indices, data), facts }
}

/// Where each row starts, and where the last one ends.
fn indptr_of(runs: &[Run<'_>]) -> Vec<u32> {
    let mut end = 0u32;
    let ends = runs.iter().flat_map(|run| &run.lengths).map(|length| {
        end += length;
        end
    });
    std::iter::once(0).chain(ends).collect()
}

fn runs_of<'a>(blocks: &'a mut [Vec<Row>], points: &'a [Vec3], length: usize) -> Vec<Run<'a>> {
    let mut runs: Vec<Run<'a>> = points
        .chunks(length)
        .enumerate()
        .map(|(number, points)| Run {
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

impl Run<'_> {
    /// Copies a vertex's sampled values, those that are positive and not below `least`. Returns the lowest of all.
    #[inline(always)]
    fn load(&self, v: usize, least: f32, row: &mut [Row]) -> f32 {
        let mut lows = [f32::INFINITY; LANES];
        for (row, block) in row.iter_mut().zip(&self.blocks) {
            *row = block[v];
            // Solver and rounding leave some -1e-8: a harmonic coordinate is never negative.
            for (w, low) in row.iter_mut().zip(&mut lows) {
                *low = if *w < *low { *w } else { *low };
                *w = if *w > 0.0 && *w >= least { *w } else { 0.0 };
            }
        }
        lows.iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a })
    }

    /// Lengths of the rows if every positive weight is stored.
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

    /// Drops small weights, restores the rows' sums, measures them, and hands them on: `take(run, vertex, row)`.
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
                // Errors, and what an offset makes up for, are not sparsification's to change.
                let raw = columns.sums(&row, target);
                let goal = columns.combined(&row).1;
                self.restore_row(v, columns, options.threshold, &mut row, goal);
                (raw, columns.sums(&row, target))
            } else {
                let raw = columns.sums(&row, target);
                (raw, raw)
            };
            let raw = (!has_offset).then_some(RawRow { sums: raw, lowest });
            self.facts.push(RowFacts::of(&row, stored, raw));
            take(self, v, &row);
        }
    }

    /// Keeps a row in the blocks until all lengths are known.
    #[inline(always)]
    fn keep(&mut self, v: usize, row: &[Row]) {
        for (row, block) in row.iter().zip(&mut self.blocks) {
            block[v] = *row;
        }
    }

    /// Writes the kept rows into the result.
    #[inline(always)]
    fn store_kept(&mut self) {
        for v in 0..self.points.len() {
            let row: Vec<Row> = self.blocks.iter().map(|block| block[v]).collect();
            self.entries.put_row(&row, |batch| row[batch].map(|w| w != 0.0));
        }
    }

    /// Drops small weights and restores the row, or keeps all if that cannot be had. `row` holds the
    /// vertex's sampled values. Returns what the sampled row and this one add up to.
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
                w == 0.0 || (FACTORS.contains(&(w / was)) && (w - was).abs() <= CHANGE * threshold)
            })
        });
        if bounded && restored.error() <= NOT_RESTORED {
            return (sampled, restored);
        }
        self.load(v, 0.0, row);
        restore(columns, row, goal)
    }
}

/// A weight such that the sum of all below is at most `most`: the largest one, found by halving the bits of positive
/// numbers, which ascend as they do.
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

/// Corrects a row until it sums to 1 and puts its vertex at `goal`; returns its sums before (to f32) and after.
// Part of its callers where they are compiled for several instruction sets; elsewhere four copies would be downloaded.
#[cfg_attr(not(target_family = "wasm"), inline(always))]
#[cfg_attr(target_family = "wasm", inline(never))]
fn restore(columns: &Columns, row: &mut [Row], goal: DVec3) -> (Sums, Sums) {
    let before = columns.restore_affine(row, goal);
    let mut after = columns.sums(row, goal);
    for _ in 1..MAX_CORRECTIONS {
        if after.error() <= GOOD_ENOUGH {
            break;
        }
        columns.restore_affine(row, goal);
        after = columns.sums(row, goal);
    }
    (before, after)
}
