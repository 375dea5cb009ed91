//! The discrete Laplace operator of a level.
//!
//! Each unknown has an arm towards each of its six neighbours. A whole arm has weight a = 1. An arm that the cage cuts
//! ends there and has weight a >= 1, the inverse of its length in cells. For cell c,
//! `(A u)_c = (sum of a over all arms) u_c - sum of u over the neighbours at the ends of whole arms`. Arms that end on
//! the cage contribute to the right-hand side. A is symmetric positive definite, both with the cut arms of the embedded
//! method and with the whole arms of the classic one. Source: Gibou et al. 2002.

use super::rows::{Rhs, Row, ZERO, residual_plane};
use crate::levels::Level;
use crate::simd::dispatch;

/// Computes `out = A u`. `u`, `out`: `[n_rows]`; the placeholder rows of `u` for cells outside must contain zeros.
pub fn apply(level: &Level, u: &[Row], out: &mut [Row]) {
    residual(level, u, Rhs::Zero, out);
    for row in out {
        *row = row.map(|r| -r);
    }
}

/// Writes `out = f - A u` and returns the sum of squares of `out` per lane. `u`, `out`: `[n_rows]`; the placeholder
/// rows of `u` for cells outside must contain zeros.
pub fn residual(level: &Level, u: &[Row], f: Rhs<'_>, out: &mut [Row]) -> Row {
    dispatch(
        #[inline(always)]
        || {
            let mut squares = ZERO;
            for plane in 0..level.grid.dims[2] as usize {
                for colour in 0..2 {
                    let out = &mut out[level.first_row(colour)..];
                    residual_plane(level, colour, plane, u, f, out, &mut squares);
                }
            }
            squares
        },
    )
}
