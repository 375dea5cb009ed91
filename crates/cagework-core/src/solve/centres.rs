//! Restriction by half injection: takes the residual only at the centres of coarse cells.
//!
//! After a red-black sweep that ends with black, the residual is zero on black cells and, once errors are smooth,
//! nearly equal on neighbouring red cells. The red cell at a coarse cell's centre then represents all cells that full
//! weighting would gather, so a quarter of the red residuals suffices (measured in docs/notes/multigrid.md). This does
//! not hold for the residual of an initial guess, which is not smooth.

use crate::grid::NO_CELL;
use crate::levels::{CutCell, Level};
use crate::transfer::{RESTRICT_CENTRE, RESTRICT_EDGE, Transfer};

use super::rows::{LANES, Rhs, Row, ZERO, split, sum_around};

/// Total weight that full weighting gives to the red cells around a coarse cell: its centre and twelve edge
/// neighbours.
pub const INJECTION_WEIGHT: f32 = RESTRICT_CENTRE + 12.0 * RESTRICT_EDGE;

/// A red fine cell at the centre of a coarse cell.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Centre {
    /// Stencil of the cell, even if none of its arms is cut.
    stencil: CutCell,
    /// Index among the red cut cells; [`NO_CELL`] if none of the cell's arms is cut.
    cut: u32,
}

/// Fine cell at the centre of each coarse unknown: red coarse unknowns, then black ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Centres {
    stencils: [Vec<Centre>; 2],
}

impl Centres {
    /// Finds the fine cells at the centres of the coarse cells of `transfer`.
    #[must_use]
    pub fn new(fine: &Level, transfer: &Transfer) -> Self {
        let [red, black] = &fine.colours;
        // A coarse cell whose centre is not a fine unknown has no residual.
        let stencil = CutCell { cell: red.n_cells, neighbours: [black.n_cells; 6], diagonal: 1.0 };
        let none = Centre { stencil, cut: NO_CELL };
        let mut stencils = transfer.restrict_rows.each_ref().map(|rows| vec![none; rows.len()]);
        for (rows, stencils) in transfer.restrict_rows.iter().zip(&mut stencils) {
            // Centres are in ascending order, like runs and cut cells.
            let centres =
                || rows.iter().map(|around| around[0]).zip(0..).filter(|(cell, _)| *cell != red.n_cells);
            let mut next = centres().peekable();
            for run in &red.runs {
                while let Some((cell, k)) = next.next_if(|(cell, _)| *cell < run.start + run.len) {
                    let Some(j) = cell.checked_sub(run.start) else { continue };
                    let [my, py, mz, pz] = run.yz.map(|first| first + j);
                    let neighbours = [run.x + 1 + j, run.x + j, py, my, pz, mz];
                    stencils[k].stencil = CutCell { cell, neighbours, diagonal: 6.0 };
                }
            }
            let mut next = centres().peekable();
            for (number, cut) in (0u32..).zip(&red.cut) {
                while let Some((cell, k)) = next.next_if(|(cell, _)| *cell <= cut.cell) {
                    if cell == cut.cell {
                        stencils[k] = Centre { stencil: *cut, cut: number };
                    }
                }
            }
        }
        Self { stencils }
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.stencils.iter().map(|s| size_of_val(s.as_slice())).sum()
    }

    /// Writes the coarse right-hand side `out`, `[n_rows]` of the coarse level, from the residual of `u` at the
    /// centres. Returns half the mean squared residual at the centres, which are red cells. Half of all cells are black
    /// and have no residual after a black half sweep, so for smooth residuals this estimates the mean over all cells.
    #[inline(always)]
    pub fn inject(&self, fine: &Level, coarse: &Level, u: &mut [Row], rhs: Rhs<'_>, out: &mut [Row]) -> f64 {
        let (own, other) = split(fine, u, 0);
        let mut squares = ZERO;
        for (colour, centres) in self.stencils.iter().enumerate() {
            let out = &mut out[coarse.first_row(colour)..];
            for (out, Centre { stencil: centre, cut }) in out.iter_mut().zip(centres) {
                let mut sum = sum_around(other, &centre.neighbours);
                if let Some(f) = rhs.of_red(centre.cell, *cut) {
                    for k in 0..LANES {
                        sum[k] += f[k];
                    }
                }
                let old = &own[centre.cell as usize];
                for k in 0..LANES {
                    let residual = sum[k] - centre.diagonal * old[k];
                    squares[k] += residual * residual;
                    out[k] = INJECTION_WEIGHT * residual;
                }
            }
        }
        let n = self.stencils.iter().map(Vec::len).sum::<usize>();
        squares.iter().map(|&s| f64::from(s)).sum::<f64>() / (2 * n).max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::levels::plain::{hierarchy, some_field};
    use crate::solve::rows::residual_plane;

    /// Tolerance for f32 rounding of residuals, in which diagonals of up to a few thousand multiply values in [0, 1).
    const RESIDUAL_ROUNDING: f32 = 1e-3;

    #[test]
    fn injection_is_the_residual_at_the_centres() {
        let hierarchy = hierarchy();
        for (levels, transfer) in hierarchy.levels.windows(2).zip(&hierarchy.transfers) {
            let [fine, coarse] = levels else { unreachable!("windows of two") };
            let centres = Centres::new(fine, transfer);
            let mut u = some_field(fine, 3);
            let (cut, dense) = (some_field(fine, 4)[..fine.n_cut()].to_vec(), some_field(fine, 5));
            for rhs in [Rhs::Cut(&cut), Rhs::Dense(&dense)] {
                let (mut residual, mut squares) = (vec![ZERO; fine.first_row(1)], ZERO);
                for plane in 0..fine.grid.dims[2] as usize {
                    residual_plane(fine, 0, plane, &u, rhs, &mut residual, &mut squares);
                }
                let mut f = vec![ZERO; coarse.n_rows()];
                let mean = centres.inject(fine, coarse, &mut u, rhs, &mut f);
                let (mut sum, mut n) = (0.0, 0);
                for cell in coarse.grid.cells() {
                    let row = coarse.row_of[coarse.grid.index(cell)];
                    if row == NO_CELL {
                        continue;
                    }
                    let centre = fine.row_at(cell.map(|x| 2 * x), [0; 3]) as usize;
                    n += 1;
                    for k in 0..LANES {
                        let (r, injected) = (residual[centre][k], f[row as usize][k]);
                        assert!(
                            (2.0 * r - injected).abs() <= RESIDUAL_ROUNDING,
                            "{cell:?}: {r} and {injected}"
                        );
                        sum += f64::from(r).powi(2);
                    }
                }
                assert!(n > 0 && (mean * 2.0 * f64::from(n) - sum).abs() <= 1e-4 * sum, "{mean} and {sum}");
            }
        }
    }
}
