//! Fields and streaming kernels: optimised versions of the plain loops in [`crate::stencil`].
//!
//! A field holds one *batch* of controls: a row of [`LANES`] values per cell, in the level's order (`[red .., 0, black
//! .., 0]`). Every kernel works on one z-plane of one colour, so that callers can run several half sweeps a plane apart
//! and read the field from memory once.

use crate::levels::Level;
use crate::transfer::{ProlongRow, RESTRICT_CENTRE, RESTRICT_EDGE, RestrictRow, Transfer};

mod rhs;

use rhs::ColourRhs;
pub use rhs::Rhs;

/// Number of columns per batch: one AVX register, two of SSE, NEON or wasm. With 16, the Armadillo's solve takes 25 %
/// less time at g = 64, where a batch fits into the second-level cache, and 40 % more at g = 128, where it does not.
pub const LANES: usize = 8;

/// Values of a cell for the columns of a batch.
pub type Row = [f32; LANES];

/// A row of zeros.
pub const ZERO: Row = [0.0; LANES];

/// Changes of a weight below this count as zero. The limit has a margin over 1e-19, below which the square of a change
/// is denormal in f32. `shaders/change_norms.wgsl` has the same constant.
pub(crate) const MIN_CHANGE: f32 = 1e-18;

/// Splits a field by colour. Returns the rows of `colour`, then the rows of the other colour.
#[inline(always)]
pub fn split<'a>(level: &Level, field: &'a mut [Row], colour: usize) -> (&'a mut [Row], &'a mut [Row]) {
    let (red, black) = field.split_at_mut(level.first_row(1));
    if colour == 0 { (red, black) } else { (black, red) }
}

#[inline(always)]
fn halves<'a>(level: &Level, field: &'a [Row], colour: usize) -> Halves<'a> {
    let (red, black) = field.split_at(level.first_row(1));
    if colour == 0 { Halves { own: red, other: black } } else { Halves { own: black, other: red } }
}

#[inline(always)]
fn add(sum: &mut Row, row: &Row) {
    for k in 0..LANES {
        sum[k] += row[k];
    }
}

/// Sum of the rows of a cell's neighbours.
#[inline(always)]
pub(super) fn sum_around(field: &[Row], neighbours: &[u32; 6]) -> Row {
    let mut sum = ZERO;
    for &n in neighbours {
        add(&mut sum, &field[n as usize]);
    }
    sum
}

/// Values that a kernel reads at a cell.
struct Visit {
    /// Index of the cell among the cells of its colour.
    cell: usize,
    /// Value of the cell before the kernel changes it; zero unless requested.
    old: Row,
    /// Sum of the neighbours' values and the right-hand side.
    sum: Row,
    diagonal: f32,
}

/// A field split by colour.
#[derive(Clone, Copy)]
struct Halves<'a> {
    /// Values of the visited colour; may be empty if old values are not requested.
    own: &'a [Row],
    /// Values of the neighbours' colour.
    other: &'a [Row],
}

/// Calls `each` for each cell of one colour in a plane, with the cell's row of `out` and the values that a kernel reads
/// there. With `OLD`, these include the cell's own value ([`Visit::old`]); otherwise [`Halves::own`] may be empty.
///
/// Takes slices once per run of cells, so that the loop over the cells needs no bounds checks.
#[inline(always)]
fn visit_plane<const OLD: bool>(
    level: &Level,
    colour: usize,
    plane: usize,
    field: Halves<'_>,
    rhs: ColourRhs<'_>,
    out: &mut [Row],
    mut each: impl FnMut(&mut Row, Visit),
) {
    let Halves { own: old, other } = field;
    let colour = &level.colours[colour];
    let [runs, cut] = colour.of_plane(plane);
    for run in &colour.runs[runs] {
        let (start, n) = (run.start as usize, run.len as usize);
        let part = |first: u32, n: usize| &other[first as usize..first as usize + n];
        let (low, high) = (part(run.x, n), part(run.x + 1, n));
        let [my, py, mz, pz] = run.yz.map(|first| part(first, n));
        let out = &mut out[start..start + n];
        let old = if OLD { &old[start..start + n] } else { &[] };
        let f = match rhs {
            ColourRhs::Cut(_) | ColourRhs::Zero => None,
            ColourRhs::Dense(rows) => Some(&rows[start..start + n]),
        };
        for j in 0..n {
            let mut sum = ZERO;
            for k in 0..LANES {
                sum[k] = (low[j][k] + high[j][k]) + (my[j][k] + py[j][k]) + (mz[j][k] + pz[j][k]);
            }
            if let Some(f) = f {
                add(&mut sum, &f[j]);
            }
            let old = if OLD { old[j] } else { ZERO };
            each(&mut out[j], Visit { cell: start + j, old, sum, diagonal: 6.0 });
        }
    }
    for (number, cut) in (cut.start..).zip(&colour.cut[cut]) {
        let cell = cut.cell as usize;
        let mut sum = match rhs {
            ColourRhs::Cut(rows) => rows[number],
            ColourRhs::Dense(rows) => rows[cell],
            ColourRhs::Zero => ZERO,
        };
        for n in cut.neighbours {
            add(&mut sum, &other[n as usize]);
        }
        let old = if OLD { old[cell] } else { ZERO };
        each(&mut out[cell], Visit { cell, old, sum, diagonal: cut.diagonal });
    }
}

/// Applies Gauss-Seidel to one plane of one colour: `u = (sum of neighbours + f) / diagonal`.
///
/// The kernel divides instead of multiplying by the inverse: f32 rounds 1/6 up by 3e-8, so a product would bias each
/// cell in the same direction, and the sum of the weights of a point would differ from 1 by 2.7e-5 at g = 128
/// ([`BindReport::raw_error`](crate::BindReport)).
#[inline(always)]
pub fn relax_plane(level: &Level, colour: usize, plane: usize, u: &mut [Row], rhs: Rhs<'_>) {
    over_relax_zeros_plane(level, colour, plane, 1.0, u, rhs);
}

/// Like [`over_relax_plane`], with zeros for the cells of this colour instead of their stored values.
#[inline(always)]
pub fn over_relax_zeros_plane(
    level: &Level,
    colour: usize,
    plane: usize,
    omega: f32,
    u: &mut [Row],
    rhs: Rhs<'_>,
) {
    let (own, other) = split(level, u, colour);
    visit_plane::<false>(
        level,
        colour,
        plane,
        Halves { own: &[], other },
        rhs.of(level, colour),
        own,
        #[inline(always)]
        |row, visit| {
            *row = visit.sum.map(|s| omega * (s / visit.diagonal));
        },
    );
}

/// Like [`relax_plane`] for red cells, with zeros for all cells instead of their stored values: `u = f / diagonal`.
#[inline(always)]
pub fn relax_zeros_plane(level: &Level, plane: usize, u: &mut [Row], rhs: Rhs<'_>) {
    let red = &level.colours[0];
    let rhs = rhs.of(level, 0);
    let [runs, cut] = red.of_plane(plane);
    for run in &red.runs[runs] {
        let cells = run.start as usize..(run.start + run.len) as usize;
        match rhs {
            ColourRhs::Cut(_) | ColourRhs::Zero => u[cells].fill(ZERO),
            ColourRhs::Dense(rows) => {
                for (row, f) in u[cells.clone()].iter_mut().zip(&rows[cells]) {
                    *row = f.map(|f| f * (1.0 / 6.0));
                }
            }
        }
    }
    for (number, cut) in (cut.start..).zip(&red.cut[cut]) {
        let f = match rhs {
            ColourRhs::Cut(rows) => rows[number],
            ColourRhs::Dense(rows) => rows[cut.cell as usize],
            ColourRhs::Zero => ZERO,
        };
        let inverse = 1.0 / cut.diagonal;
        u[cut.cell as usize] = f.map(|f| f * inverse);
    }
}

/// Applies Gauss-Seidel to one plane of one colour, with the over-relaxation factor `omega`.
#[inline(always)]
pub fn over_relax_plane(level: &Level, colour: usize, plane: usize, omega: f32, u: &mut [Row], rhs: Rhs<'_>) {
    let (own, other) = split(level, u, colour);
    visit_plane::<false>(
        level,
        colour,
        plane,
        Halves { own: &[], other },
        rhs.of(level, colour),
        own,
        #[inline(always)]
        |row, visit| {
            let old = *row;
            for k in 0..LANES {
                row[k] = old[k] + omega * (visit.sum[k] / visit.diagonal - old[k]);
            }
        },
    );
}

/// Writes the residual `f + sum of neighbours - diagonal u` of one plane of one colour to that colour's rows
/// `residual`, and adds its squares to `squares`.
#[inline(always)]
pub fn residual_plane(
    level: &Level,
    colour: usize,
    plane: usize,
    u: &[Row],
    rhs: Rhs<'_>,
    residual: &mut [Row],
    squares: &mut Row,
) {
    let mut sum_squares = *squares;
    visit_plane::<true>(
        level,
        colour,
        plane,
        halves(level, u, colour),
        rhs.of(level, colour),
        residual,
        #[inline(always)]
        |out, Visit { old, sum, diagonal, .. }| {
            let mut r = ZERO;
            for k in 0..LANES {
                r[k] = sum[k] - diagonal * old[k];
            }
            for k in 0..LANES {
                sum_squares[k] += r[k] * r[k];
            }
            *out = r;
        },
    );
    *squares = sum_squares;
}

/// Applies Jacobi to one plane of one colour, from `old` to `new`, both `[n_rows]`. Adds each cell's
/// squared change, summed over the lanes, to `changes`, which has one number per cell of the colour.
#[inline(always)]
pub fn jacobi_plane(
    level: &Level,
    colour: usize,
    plane: usize,
    old: &[Row],
    new: &mut [Row],
    rhs: Rhs<'_>,
    changes: &mut [f32],
) {
    let (new, _) = split(level, new, colour);
    visit_plane::<true>(
        level,
        colour,
        plane,
        halves(level, old, colour),
        rhs.of(level, colour),
        new,
        #[inline(always)]
        |out, Visit { cell, old, sum, diagonal }| {
            let (mut new, mut change) = (ZERO, ZERO);
            for k in 0..LANES {
                new[k] = sum[k] / diagonal;
                let d = (new[k] - old[k]).abs();
                // Each sweep spreads values from the cage by one cell, and at the front they decay by a factor of 6 per
                // cell. Squares below 1e-38 are denormal, which makes sweeps three times slower for changes without
                // effect on delta.
                let d = if d > MIN_CHANGE { d } else { 0.0 };
                change[k] = d * d;
            }
            *out = new;
            changes[cell] += tree_sum(change);
        },
    );
}

/// Sum of a row in a fixed order that the compiler vectorises.
#[inline(always)]
fn tree_sum(mut row: Row) -> f32 {
    let mut n = LANES / 2;
    while n > 0 {
        for k in 0..n {
            row[k] += row[k + n];
        }
        n /= 2;
    }
    row[0]
}

/// Restriction: computes the coarse right-hand side from the red residuals around each coarse cell.
#[inline(always)]
pub fn restrict_residual(coarse: &Level, transfer: &Transfer, residual: &[Row], f: &mut [Row]) {
    for (colour, rows) in transfer.restrict_rows.iter().enumerate() {
        let first = coarse.first_row(colour);
        for (out, around) in f[first..].iter_mut().zip(rows) {
            *out = gather_edges(residual, around);
        }
    }
}

#[inline(always)]
fn gather_edges(residual: &[Row], around: &RestrictRow) -> Row {
    let mut edges = ZERO;
    for &row in &around[1..] {
        add(&mut edges, &residual[row as usize]);
    }
    let centre = &residual[around[0] as usize];
    let mut sum = ZERO;
    for k in 0..LANES {
        sum[k] = RESTRICT_CENTRE * centre[k] + RESTRICT_EDGE * edges[k];
    }
    sum
}

/// How prolongation combines the interpolated value with a black cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProlongationMode {
    /// Adds the coarse correction, which is zero outside the cage.
    Correct,
    /// Replaces the value by the mean of those coarse cells that are unknowns, if any.
    Replace,
}

/// Prolongs `coarse` to the black cells of one plane of `u`.
#[inline(always)]
pub fn prolong_plane(
    level: &Level,
    transfer: &Transfer,
    plane: usize,
    coarse: &[Row],
    u: &mut [Row],
    mode: ProlongationMode,
) {
    let (black, _) = split(level, u, 1);
    let ([face, corner], [face_end, corner_end]) = (transfer.planes[plane], transfer.planes[plane + 1]);
    prolong_rows(&transfer.faces[face as usize..face_end as usize], coarse, black, mode);
    prolong_rows(&transfer.corners[corner as usize..corner_end as usize], coarse, black, mode);
}

#[inline(always)]
fn prolong_rows<const N: usize>(
    rows: &[ProlongRow<N>],
    coarse: &[Row],
    black: &mut [Row],
    mode: ProlongationMode,
) {
    for row in rows {
        let mut sum = ZERO;
        for from in row.coarse {
            add(&mut sum, &coarse[from as usize]);
        }
        let out = &mut black[row.cell as usize];
        match mode {
            ProlongationMode::Replace => *out = sum.map(|s| s * row.mean),
            ProlongationMode::Correct => add(out, &sum.map(|s| s * (1.0 / N as f32))),
        }
    }
}

#[cfg(test)]
mod tests;
