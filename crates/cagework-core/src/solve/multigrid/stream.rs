//! Several passes over a level in one stream through memory.
//!
//! Each pass follows the one before it one z-plane behind: a half sweep of a plane reads the other colour in that plane and
//! in the two next to it, which the pass before has just left and the pass after has not yet reached. So a field is read
//! from memory once for a whole list of passes, and results are those of one pass after another.

use std::ops::Range;

use crate::levels::Level;
use crate::simd::dispatch;
use crate::solve::rows::{
    LANES, Part, Prolong, Rhs, Row, ZERO, over_relax_plane, over_relax_zeros_plane, prolong_plane,
    relax_plane, relax_zeros_plane, residual_plane, split,
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
/// After the last cycle, around right-hand sides that are not the cage's. Red cells were the last that were swept.
pub(super) const AROUND: &[Pass] = &[Black, Red, Black, Red];

/// What a solve does from one coarse correction to the next.
#[derive(Debug)]
pub(super) struct Ways {
    /// The coarse correction and the sweep after it, and [`DOWN`] of the next cycle, whose residual is injected.
    pub(super) between: &'static [Pass],
    /// The same before a last cycle that has little to do.
    pub(super) before_little: &'static [Pass],
    /// The last coarse correction and what comes after it.
    pub(super) last: &'static [Pass],
    /// The same where the correction is little ([`BatchReport::leaves_little`](super::BatchReport)).
    pub(super) last_of_little: &'static [Pass],
}

/// For columns, which start from the coarser level's solution; one sweep less for a last cycle with little to do.
pub(super) const OF_COLUMNS: Ways = Ways {
    between: &[Pass::Prolong(Prolong::Correct), Red, Black, Red, BlackFurther, Red, Black],
    before_little: &[Pass::Prolong(Prolong::Correct), Red, BlackFurther, Red, Black],
    last: UP,
    last_of_little: UP,
};

/// For right-hand sides that start from zero. At last a half sweep more, which halves the largest error: little
/// smooths again what two or three cycles leave next to the cage ([`AROUND`], where that is much).
pub(super) const FROM_ZERO: Ways = Ways {
    between: &[Pass::Prolong(Prolong::Further), Red, Black, Red, BlackFurther, Red, Black],
    before_little: &[Pass::Prolong(Prolong::Further), Red, Black, Red, BlackFurther, Red, Black],
    last: &[Pass::Prolong(Prolong::Further), Red, BlackFurther, Red],
    last_of_little: &[Pass::Prolong(Prolong::Further), Red],
};

/// Where a level's right-hand side is, if it is not the cage's.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent<'a> {
    /// The lines along x of each plane outside which each pass leaves rows as they are: for passes from zero, if the rows hold
    /// zeros, and for [`AROUND`].
    /// `[n_passes][nz]`
    pub(super) reach: Option<&'a [Vec<Range<usize>>]>,
    /// Black cells with whole stencils that have some, ascending, within their colour: the rows after all cut cells'.
    pub(super) whole: &'a [u32],
}

/// Runs `passes` over a level's field `u`, `[n_rows]`. `coarse`: the coarser level's field, for [`Pass::Prolong`];
/// `residual`: `[n red cells + 1]`, for [`Pass::Residual`]. Returns the sum of the residual's squares.
pub(super) fn stream(
    passes: &[Pass],
    level: &Level,
    extent: Extent<'_>,
    (transfer, coarse): (&Transfer, &[Row]),
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
                    let mut part = Part::from(plane);
                    if let Some(reach) = extent.reach {
                        let ys = &reach[lag][plane];
                        if *pass == Residual {
                            let cells = level.cells_of_plane(0, plane);
                            let reached = level.cells_of_lines(0, plane, ys);
                            residual[cells.start..reached.start].fill(ZERO);
                            residual[reached.end..cells.end].fill(ZERO);
                        }
                        part = Part::lines(plane, ys.clone());
                    }
                    match *pass {
                        Pass::Prolong(mode) => prolong_plane(level, transfer, plane, coarse, u, mode),
                        Red => relax_plane(level, 0, part, u, f),
                        Black => relax_plane(level, 1, part, u, f),
                        BlackFurther => over_relax_plane(level, 1, plane, OMEGA, u, f),
                        RedFromZero => relax_zeros_plane(level, part, u, f),
                        BlackFurtherFromZero => over_relax_zeros_plane(level, 1, part, OMEGA, u, f),
                        Residual => residual_plane(level, part, u, f, residual, &mut squares),
                    }
                    let omega = match *pass {
                        Black => 1.0,
                        BlackFurther | BlackFurtherFromZero => OMEGA,
                        _ => continue,
                    };
                    if !extent.whole.is_empty() {
                        add_whole(level, plane, omega, u, extent.whole, f);
                    }
                }
            }
            squares.iter().map(|&s| f64::from(s)).sum()
        },
    )
}

/// Adds what right-hand sides of the black cells `whole` ([`Extent::whole`]) add to a half sweep of a plane that goes `omega`
/// times as far.
#[inline(never)]
pub(super) fn add_whole(level: &Level, plane: usize, omega: f32, u: &mut [Row], whole: &[u32], f: Rhs<'_>) {
    let Rhs::Cut(rows) = f else { return };
    let rows = &rows[level.n_cut()..];
    let cells = level.cells_of_plane(1, plane);
    let [first, end] = [cells.start, cells.end].map(|end| whole.partition_point(|&c| (c as usize) < end));
    let (black, _) = split(level, u, 1);
    for (&cell, f) in whole[first..end].iter().zip(&rows[first..end]) {
        let row = &mut black[cell as usize];
        for k in 0..LANES {
            row[k] += omega / 6.0 * f[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::NO_CELL;
    use crate::levels::plain::{hierarchy, some_field};
    use crate::solve::multigrid::Places;

    #[test]
    fn lines_that_no_right_hand_side_reaches_need_not_be_gone_through() {
        let hierarchy = hierarchy();
        let (level, transfer) = (&hierarchy.levels[0], &hierarchy.transfers[0]);
        let cells: Vec<u32> = (0u32..)
            .zip(level.row_of.iter())
            .filter(|(_, row)| **row != NO_CELL)
            .map(|(cell, _)| cell)
            .collect();
        let (n, some) = (cells.len(), some_field(level, 1));
        // One at either end, one in the middle, two far apart, and none.
        for of in [&[0][..], &[n - 1], &[n / 2], &[n / 3, 2 * n / 3], &[]] {
            let (mut f, of) = (vec![ZERO; level.n_rows()], of.iter().map(|&k| cells[k]).collect::<Vec<_>>());
            let places = Places::new(level, &of);
            for cell in &of {
                let row = level.row_of[*cell as usize] as usize;
                f[row] = some[row];
            }
            let run = |reach: Option<&[Vec<Range<usize>>]>| {
                let (mut u, mut residual) =
                    (vec![ZERO; level.n_rows()], vec![[7.0; LANES]; level.first_row(1)]);
                if reach.is_none() {
                    // What it holds must not count then.
                    u = some_field(level, 2);
                    u[level.zero_row() as usize] = ZERO;
                }
                let coarse = (transfer, &[] as &[Row]);
                let extent = Extent { reach, whole: &[] };
                let squares =
                    stream(DOWN_FROM_ZERO, level, extent, coarse, &mut u, Rhs::Dense(&f), &mut residual);
                (u, residual, squares)
            };
            let (all, few) = (run(None), run(places.extent(0, DOWN_FROM_ZERO).reach));
            assert!(all == few, "{of:?}");
            assert_eq!(all.2 > 0.0, !of.is_empty());
        }
    }
}
