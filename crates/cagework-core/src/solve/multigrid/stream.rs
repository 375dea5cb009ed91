//! Streaming of several passes over a level through memory.
//!
//! Each pass runs one z-plane behind the previous one: a half sweep of a plane reads the other colour in that plane and
//! its two neighbours, which the previous pass has finished and the next pass has not reached. A field is thus read
//! from memory once per list of passes, with the same results as if the passes ran one after another.

use crate::levels::Level;
use crate::simd::dispatch;
use crate::solve::rows::{
    ProlongationMode, Rhs, Row, ZERO, over_relax_plane, over_relax_zeros_plane, prolong_plane, relax_plane,
    relax_zeros_plane, residual_plane,
};
use crate::transfer::Transfer;

use super::OMEGA;

/// A pass over all planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pass {
    /// Prolongation from the coarser level to black cells. The next sweep overwrites the red cells.
    Prolongation(ProlongationMode),
    /// Gauss-Seidel on red cells.
    Red,
    /// Gauss-Seidel on black cells.
    Black,
    /// Over-relaxation of black cells by [`OMEGA`].
    BlackFurther,
    /// As [`Pass::Red`], with zeros for all cells instead of their stored values.
    RedFromZero,
    /// As [`Pass::BlackFurther`], with zeros for the black cells instead of their stored values.
    BlackFurtherFromZero,
    /// Residual of the red cells. The residual of black cells is zero after [`Pass::Black`].
    Residual,
}

use Pass::{Black, BlackFurther, BlackFurtherFromZero, Red, RedFromZero, Residual};

/// Pre-smoothing and residual, starting from the stored values.
pub(super) const DOWN_PASSES: &[Pass] = &[Red, BlackFurther, Red, Black, Residual];
/// Pre-smoothing and residual, starting from zero.
pub(super) const DOWN_PASSES_FROM_ZERO: &[Pass] = &[RedFromZero, BlackFurtherFromZero, Red, Black, Residual];
/// Pre-smoothing and residual, starting from the coarser level's solution.
pub(super) const DOWN_PASSES_FROM_COARSE: &[Pass] =
    &[Pass::Prolongation(ProlongationMode::Replace), Red, BlackFurther, Red, Black, Residual];
/// Coarse correction and post-smoothing.
pub(super) const UP_PASSES: &[Pass] = &[Pass::Prolongation(ProlongationMode::Correct), Red, Black];
/// Passes on the finest level between two coarse corrections. The residual after the last pass is injected.
pub(super) const MIDDLE_PASSES: &[Pass] =
    &[Pass::Prolongation(ProlongationMode::Correct), Red, Black, Red, BlackFurther, Red, Black];
/// [`MIDDLE_PASSES`] with one sweep fewer, before a short last cycle.
pub(super) const SHORT_MIDDLE_PASSES: &[Pass] =
    &[Pass::Prolongation(ProlongationMode::Correct), Red, BlackFurther, Red, Black];

/// Runs `passes` over a level's field `u`, `[n_rows]`. `coarse`: the coarser level's field, for [`Pass::Prolongation`];
/// `residual`: `[n red cells + 1]`, for [`Pass::Residual`]. Returns the sum of squared residuals.
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
            // The zero row stands for cells that are not unknowns.
            if let Some(zero) = residual.last_mut() {
                *zero = ZERO;
            }
            let n = level.grid.dims[2] as usize;
            let mut squares = ZERO;
            for step in 0..n + passes.len() - 1 {
                for (lag, pass) in passes.iter().enumerate() {
                    let Some(plane) = step.checked_sub(lag).filter(|&plane| plane < n) else { continue };
                    match *pass {
                        Pass::Prolongation(mode) => prolong_plane(level, transfer, plane, coarse, u, mode),
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
