//! Geometry as flat arrays of numbers: input of the GPU kernels and of their CPU counterparts.

use std::ops::Range;

use crate::grid::NO_CELL;
use crate::levels::Level;
use crate::sample::Stencils;
use crate::transfer::{ProlongRow, RestrictRow, Transfer};
use crate::weights::Weights;

/// Number of values at the start of an entry of a prolongation table, before the coarse rows.
pub const ENTRY_HEAD: usize = 2;

/// Number of vertices that one invocation of the deformation kernel computes. The invocation reads each control once
/// for all of these vertices. Shortest measured frame time on lavapipe with 50,000 vertices, 112 weights each and
/// normals: 16.3 ms with one vertex per invocation, 9.0 ms with four.
pub const BUNDLE: usize = 4;

/// Number of bundles per slice of [`SlicedWeights`]. The weights of eight bundles at one list position, 16 bytes each,
/// fill a memory transaction of 128 bytes; more bundles would need more padding.
pub const SLICE: usize = 8;

/// Stencils of a level as arrays with one entry per row, including zero rows.
#[derive(Clone, Debug, Default)]
pub struct LevelTable {
    /// Rows of the six neighbours; a zero row where the arm is cut. A zero row has itself as neighbours. `[n_rows]`
    pub neighbours: Vec<[u32; 6]>,
    /// Sum of the arm weights; 1 for zero rows. `[n_rows]`
    pub diagonal: Vec<f32>,
    /// Row of the right-hand side that belongs to each row. Finest level: index of the cut cell, or `NO_CELL` for other
    /// cells. Coarse levels: the row itself. `[n_rows]`
    pub rhs_of_row: Vec<u32>,
}

/// Restriction and prolongation between a level and the next coarser one.
#[derive(Clone, Debug, Default)]
pub struct TransferTable {
    /// Fine rows around each coarse row. `[n coarse rows]`
    pub around: Vec<RestrictRow>,
    /// Black cells between two coarse cells. An entry consists of the fine row, 1 / (number of these coarse cells that
    /// are unknowns) as the bits of an f32, and the 2 coarse rows.
    pub faces: Vec<u32>,
    /// Black cells between eight coarse cells. An entry consists of the fine row, 1 / (number of these coarse cells
    /// that are unknowns) as the bits of an f32, and the 8 coarse rows.
    pub corners: Vec<u32>,
}

/// Sampling stencils of all vertices as arrays.
#[derive(Clone, Debug, Default)]
pub struct SamplingTable {
    /// First entry of each vertex in `nodes` and `hats`. `[n_vertices + 1]`
    pub starts: Vec<[u32; 2]>,
    /// Field entries of the stencils: `(row of the field, bits of its weight)`.
    pub nodes: Vec<[u32; 2]>,
    /// Dirichlet entries of the stencils: `(control, bits of its weight)`.
    pub hats: Vec<[u32; 2]>,
}

/// Weights in bundles of [`BUNDLE`] rows with a common list of columns. [`SLICE`] bundles form a slice, padded to its
/// longest list and stored column by column, so that neighbouring GPU invocations read neighbouring entries (sliced
/// ELLPACK).
#[derive(Clone, Debug, Default)]
pub struct SlicedWeights {
    /// Start of each slice in `columns` and `weights`, divided by [`SLICE`]. `[n_slices + 1]`
    pub slices: Vec<u32>,
    /// Columns of the entries; short lists are padded with weights of 0. `[slice][k][lane]`, with `k` the position in a
    /// bundle's list and `lane` the bundle's number in the slice.
    pub columns: Vec<u32>,
    /// Weights of the bundle's rows for the entry's column. `[slice][k][lane]`
    pub weights: Vec<[f32; BUNDLE]>,
}

/// For each vertex, the triangles around it, from which its normal is computed.
#[derive(Clone, Debug, Default)]
pub struct NormalTable {
    /// First triangle of each vertex in `others`. `[n_vertices + 1]`
    pub starts: Vec<u32>,
    /// The other two vertices of each triangle, counter-clockwise. The triangles of a vertex are in ascending order.
    pub others: Vec<[u32; 2]>,
}

impl LevelTable {
    /// Creates the table of a level. On the `finest` level, the right-hand side has one row per cut cell.
    #[must_use]
    pub fn new(level: &Level, finest: bool) -> Self {
        let n_rows = level.n_rows();
        let itself = |row: usize| if finest { NO_CELL } else { row as u32 };
        let mut table = Self {
            neighbours: (0..n_rows as u32).map(|row| [row; 6]).collect(),
            diagonal: vec![1.0; n_rows],
            rhs_of_row: (0..n_rows).map(itself).collect(),
        };
        let mut number = 0;
        for (colour, other) in [(0, 1), (1, 0)] {
            let (own, first) = (level.first_row(colour), level.first_row(other) as u32);
            for run in &level.colours[colour].runs {
                for k in 0..run.len {
                    let row = own + (run.start + k) as usize;
                    let [my, py, mz, pz] = run.yz.map(|n| first + n + k);
                    let x = first + run.x + k;
                    table.neighbours[row] = [x + 1, x, py, my, pz, mz];
                    table.diagonal[row] = 6.0;
                }
            }
            for cut in &level.colours[colour].cut {
                let row = own + cut.cell as usize;
                table.neighbours[row] = cut.neighbours.map(|n| first + n);
                table.diagonal[row] = cut.diagonal;
                if finest {
                    table.rhs_of_row[row] = number;
                }
                number += 1;
            }
        }
        table
    }
}

impl TransferTable {
    /// Creates the table of the transfer between `fine` and `coarse`.
    #[must_use]
    pub fn new(fine: &Level, coarse: &Level, transfer: &Transfer) -> Self {
        let mut around = vec![[fine.zero_row(); 13]; coarse.n_rows()];
        for (colour, rows) in transfer.restrict_rows.iter().enumerate() {
            let first = coarse.first_row(colour);
            around[first..first + rows.len()].copy_from_slice(rows);
        }
        let first_black = fine.first_row(1) as u32;
        Self {
            around,
            faces: entries(first_black, &transfer.faces),
            corners: entries(first_black, &transfer.corners),
        }
    }
}

fn entries<const N: usize>(first_black: u32, rows: &[ProlongRow<N>]) -> Vec<u32> {
    let mut entries = Vec::with_capacity(rows.len() * (ENTRY_HEAD + N));
    for row in rows {
        entries.extend([first_black + row.cell, row.mean.to_bits()]);
        entries.extend(row.coarse);
    }
    entries
}

impl SamplingTable {
    /// Creates the table of sampling stencils.
    #[must_use]
    pub fn new(stencils: &Stencils) -> Self {
        let mut table = Self { starts: vec![[0; 2]], ..Self::default() };
        for (nodes, hats) in stencils.iter() {
            table.nodes.extend(nodes.iter().map(|&(row, w)| [row, w.to_bits()]));
            table.hats.extend(hats.iter().map(|&(column, w)| [column, w.to_bits()]));
            table.starts.push([table.nodes.len() as u32, table.hats.len() as u32]);
        }
        table
    }
}

impl SlicedWeights {
    /// Slices a matrix of weights.
    #[must_use]
    pub fn new(weights: &Weights) -> Self {
        Self::of_rows(weights, 0..weights.n_rows())
    }

    /// Slices a range of rows of a matrix of weights.
    #[must_use]
    pub fn of_rows(weights: &Weights, range: Range<usize>) -> Self {
        let n_slices = range.len().div_ceil(BUNDLE * SLICE);
        let mut sliced = Self { slices: vec![0], ..Self::default() };
        // For each column, the last bundle with this column in its list, and the column's position in the list.
        let mut listed = vec![(u32::MAX, 0); weights.n_columns()];
        let mut lists: [Vec<u32>; SLICE] = Default::default();
        let rows = |slice: usize, lane: usize| {
            let first = range.start + (slice * SLICE + lane) * BUNDLE;
            let end = range.end;
            (0..BUNDLE).map(move |j| first + j).take_while(move |&row| row < end)
        };
        for slice in 0..n_slices {
            for (lane, list) in lists.iter_mut().enumerate() {
                let bundle = (slice * SLICE + lane) as u32;
                list.clear();
                for &column in rows(slice, lane).flat_map(|row| weights.row(row).0) {
                    if listed[column as usize].0 != bundle {
                        listed[column as usize] = (bundle, 0);
                        list.push(column);
                    }
                }
                // Sort into the column order of the matrix, which determines the order of additions.
                list.sort_unstable();
            }
            let begin = sliced.columns.len();
            let width = lists.iter().map(Vec::len).max().unwrap_or(0);
            sliced.columns.resize(begin + width * SLICE, 0);
            sliced.weights.resize(begin + width * SLICE, [0.0; BUNDLE]);
            for (lane, list) in lists.iter().enumerate() {
                for (k, &column) in list.iter().enumerate() {
                    sliced.columns[begin + k * SLICE + lane] = column;
                    listed[column as usize].1 = begin + k * SLICE + lane;
                }
                for (j, row) in rows(slice, lane).enumerate() {
                    let (columns, data) = weights.row(row);
                    for (&column, &weight) in columns.iter().zip(data) {
                        sliced.weights[listed[column as usize].1][j] = weight;
                    }
                }
            }
            sliced.slices.push((sliced.columns.len() / SLICE) as u32);
        }
        sliced
    }
}

impl NormalTable {
    /// Creates the table of a mesh; ignores triangles with indices beyond `n_vertices`.
    #[must_use]
    pub fn new(n_vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let whole = || triangles.iter().filter(|t| t.iter().all(|&v| (v as usize) < n_vertices));
        let mut starts = vec![0u32; n_vertices + 1];
        for v in whole().flatten() {
            starts[*v as usize + 1] += 1;
        }
        for v in 0..n_vertices {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut others = vec![[0; 2]; starts[n_vertices] as usize];
        for &[a, b, c] in whole() {
            for (v, other) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
                others[next[v as usize] as usize] = other;
                next[v as usize] += 1;
            }
        }
        Self { starts, others }
    }
}
