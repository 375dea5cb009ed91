//! Several passes over a level in one stream through memory.
//!
//! Each pass follows the one before it one z-plane behind: a half sweep of a plane reads the other colour in that plane and
//! in the two next to it, which the pass before has just left and the pass after has not yet reached. So a field is read
//! from memory once for a whole list of passes, and results are those of one pass after another.

use crate::levels::Level;
use crate::simd::dispatch;
use crate::solve::rows::{
    Prolong, Rhs, Row, ZERO, over_relax_plane, over_relax_zeros_plane, prolong_plane, relax_plane,
    relax_zeros_plane, residual_plane,
};
use crate::transfer::Transfer;

use super::OMEGA;

/// One pass over all planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pass {
    /// What comes from the coarser level, on black cells: a sweep overwrites red ones.
    Prolong(Prolong),
    /// Gauss-Seidel on red cells.
    Red,
    /// Gauss-Seidel on black cells.
    Black,
    /// The same, going [`OMEGA`] times as far.
    BlackFurther,
    /// [`Pass::Red`] where the whole field is zero, whatever its rows hold.
    RedFromZero,
    /// [`Pass::BlackFurther`] where black cells are zero, whatever their rows hold.
    BlackFurtherFromZero,
    /// Residual of the red cells; black ones have none after [`Pass::Black`].
    Residual,
}

use Pass::{Black, BlackFurther, BlackFurtherFromZero, Red, RedFromZero, Residual};

/// Before the coarse correction, from what the rows hold.
pub(super) const DOWN: &[Pass] = &[Red, BlackFurther, Red, Black, Residual];
/// The same from zero.
pub(super) const DOWN_FROM_ZERO: &[Pass] = &[RedFromZero, BlackFurtherFromZero, Red, Black, Residual];
/// The same from the coarser level's solution.
pub(super) const DOWN_FROM_COARSE: &[Pass] =
    &[Pass::Prolong(Prolong::Replace), Red, BlackFurther, Red, Black, Residual];
/// The coarse correction and the sweep after it.
pub(super) const UP: &[Pass] = &[Pass::Prolong(Prolong::Correct), Red, Black];
/// From one coarse correction of the finest level to the next, whose residual is injected.
pub(super) const BETWEEN: &[Pass] =
    &[Pass::Prolong(Prolong::Correct), Red, Black, Red, BlackFurther, Red, Black];
/// The same before a last cycle that has little to do: a sweep less.
pub(super) const BETWEEN_SHORT: &[Pass] = &[Pass::Prolong(Prolong::Correct), Red, BlackFurther, Red, Black];

/// Runs `passes` over a level's field `u`, `[n_rows]`. `coarse`: the coarser level's field, for [`Pass::Prolong`];
/// `residual`: `[n red cells + 1]`, for [`Pass::Residual`]. Returns the sum of the residual's squares.
pub(super) fn stream(
    passes: &[Pass],
    level: &Level,
    transfer: &Transfer,
    coarse: &[Row],
    u: &mut [Row],
    f: Rhs<'_>,
    residual: &mut [Row],
) -> f64 {
    dispatch(
        #[inline(always)]
        || {
            // The row for neighbours that are no unknowns.
            if let Some(zero) = residual.last_mut() {
                *zero = ZERO;
            }
            let n = level.grid.dims[2] as usize;
            let mut squares = ZERO;
            for step in 0..n + passes.len() - 1 {
                for (lag, pass) in passes.iter().enumerate() {
                    let Some(plane) = step.checked_sub(lag).filter(|&plane| plane < n) else { continue };
                    match *pass {
                        Pass::Prolong(mode) => prolong_plane(level, transfer, plane, coarse, u, mode),
                        Red => relax_plane(level, 0, plane, u, f),
                        Black => relax_plane(level, 1, plane, u, f),
                        BlackFurther => over_relax_plane(level, 1, plane, OMEGA, u, f),
                        RedFromZero => relax_zeros_plane(level, plane, u, f),
                        BlackFurtherFromZero => over_relax_zeros_plane(level, 1, plane, OMEGA, u, f),
                        Residual => residual_plane(level, 0, plane, u, f, residual, &mut squares),
                    }
                }
            }
            squares.iter().map(|&s| f64::from(s)).sum()
        },
    )
}
