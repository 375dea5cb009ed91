//! Tests that kernels match plain loops over the boundary's definition, on grids of odd dimensions.

use super::*;
use crate::grid::Grid;
use crate::grid::NO_CELL;
use crate::levels::plain::{cells, hierarchy, on_two_levels, some_field};
use crate::solve::operator;

/// Tolerance for f32 rounding of reordered sums of six values in [0, 1), over a diagonal of at least 3.
const ROUNDING: f32 = 1e-6;

/// Tolerance for f32 rounding of residuals, in which diagonals of up to a few thousand multiply values in [0, 1).
const RESIDUAL_ROUNDING: f32 = 1e-3;

/// The same right-hand side in both forms: per cut cell, and per cell.
fn rhs(level: &Level) -> (Vec<Row>, Vec<Row>) {
    let value = |number: usize, k: usize| ((number * 13 + k * 7) % 29) as f32 / 29.0;
    let cut: Vec<Row> = (0..level.n_cut()).map(|n| std::array::from_fn(|k| value(n, k))).collect();
    let mut dense = vec![ZERO; level.n_rows()];
    let [red, black] = &level.colours;
    let first_black = level.first_row(1);
    let rows = red.cut.iter().map(|c| c.cell as usize);
    let rows = rows.chain(black.cut.iter().map(|c| first_black + c.cell as usize));
    for (row, f) in rows.zip(&cut) {
        dense[row] = *f;
    }
    (cut, dense)
}

#[track_caller]
fn assert_rows_close(a: &[Row], b: &[Row], tolerance: f32) {
    assert_eq!(a.len(), b.len());
    for (row, (a, b)) in a.iter().zip(b).enumerate() {
        for k in 0..LANES {
            let distance = (a[k] - b[k]).abs();
            assert!(distance <= tolerance, "row {row}, lane {k}: {} and {} differ by {distance}", a[k], b[k]);
        }
    }
}

/// `(row, sum of neighbours + f, diagonal)` of each cell of a colour.
fn plain_sums(
    level: &Level,
    boundary: &dyn crate::levels::Boundary,
    colour: usize,
    u: &[Row],
    f: &[Row],
) -> Vec<(usize, [f64; LANES], f64)> {
    let of_colour = cells(level, boundary).into_iter().filter(|c| Grid::colour(c.cell) == colour);
    of_colour
        .map(|c| {
            let row = c.row as usize;
            let sum = std::array::from_fn(|k| {
                f64::from(f[row][k]) + c.neighbours.iter().map(|&n| f64::from(u[n as usize][k])).sum::<f64>()
            });
            (row, sum, c.diagonal)
        })
        .collect()
}

#[test]
fn sweeps_from_zero_match_sweeps_of_zeros() {
    on_two_levels(|_, level, _| {
        let (_, dense) = rhs(level);
        let mut expected = vec![ZERO; level.n_rows()];
        // The kernel must ignore stored values, except in the two zero rows.
        let mut u = some_field(level, 1);
        for plane in 0..level.grid.dims[2] as usize {
            relax_plane(level, 0, plane, &mut expected, Rhs::Dense(&dense));
            relax_zeros_plane(level, plane, &mut u, Rhs::Dense(&dense));
        }
        for plane in 0..level.grid.dims[2] as usize {
            over_relax_plane(level, 1, plane, 1.2, &mut expected, Rhs::Dense(&dense));
            over_relax_zeros_plane(level, 1, plane, 1.2, &mut u, Rhs::Dense(&dense));
        }
        assert_rows_close(&u, &expected, ROUNDING);
    });
}

#[test]
fn half_sweeps_match_plain_loops() {
    on_two_levels(|_, level, boundary| {
        let (cut, dense) = rhs(level);
        for colour in 0..2 {
            for omega in [1.0, 1.2] {
                let before = some_field(level, 1);
                let mut expected = before.clone();
                for (row, sum, diagonal) in plain_sums(level, boundary, colour, &before, &dense) {
                    for k in 0..LANES {
                        let old = f64::from(before[row][k]);
                        expected[row][k] = (old + f64::from(omega) * (sum[k] / diagonal - old)) as f32;
                    }
                }
                for f in [Rhs::Cut(&cut), Rhs::Dense(&dense)] {
                    let mut u = before.clone();
                    for plane in 0..level.grid.dims[2] as usize {
                        if omega == 1.0 {
                            relax_plane(level, colour, plane, &mut u, f);
                        } else {
                            over_relax_plane(level, colour, plane, omega, &mut u, f);
                        }
                    }
                    assert_rows_close(&u, &expected, ROUNDING);
                }
            }
        }
    });
}

#[test]
fn jacobi_sweep_matches_plain_loops() {
    on_two_levels(|_, level, boundary| {
        let (cut, dense) = rhs(level);
        let before = some_field(level, 2);
        let mut expected = before.clone();
        let mut squares = vec![0.0f32; level.n_rows()];
        for colour in 0..2 {
            for (row, sum, diagonal) in plain_sums(level, boundary, colour, &before, &dense) {
                for k in 0..LANES {
                    expected[row][k] = (sum[k] / diagonal) as f32;
                    let change = expected[row][k] - before[row][k];
                    squares[row] += change * change;
                }
            }
        }
        let mut new = before.clone();
        let mut changes = [vec![0.0f32; level.n_rows()], vec![0.0f32; level.n_rows()]];
        for plane in 0..level.grid.dims[2] as usize {
            for colour in 0..2 {
                let [a, b] = changes.each_mut().map(|c| &mut c[level.first_row(colour)..]);
                for (f, of_cells) in [(Rhs::Cut(&cut), a), (Rhs::Dense(&dense), b)] {
                    jacobi_plane(level, colour, plane, &before, &mut new, f, of_cells);
                }
            }
        }
        assert_rows_close(&new, &expected, ROUNDING);
        for (row, b) in squares.iter().enumerate() {
            let [cut, dense] = changes.each_ref().map(|c| c[row]);
            assert!(
                (cut - b).abs().max((dense - b).abs()) <= 10.0 * ROUNDING,
                "{row}: {cut}, {dense} and {b}"
            );
        }
    });
}

#[test]
fn operator_and_residual_match_plain_loops() {
    on_two_levels(|_, level, boundary| {
        let (cut, dense) = rhs(level);
        let (u, zeros) = (some_field(level, 3), vec![ZERO; level.n_rows()]);
        for (f, sums_of) in [(Rhs::Cut(&cut), &dense), (Rhs::Dense(&dense), &dense), (Rhs::Zero, &zeros)] {
            let mut expected = zeros.clone();
            let mut square = 0.0;
            for (row, sum, diagonal) in
                [0, 1].into_iter().flat_map(|colour| plain_sums(level, boundary, colour, &u, sums_of))
            {
                for k in 0..LANES {
                    let residual = sum[k] - diagonal * f64::from(u[row][k]);
                    expected[row][k] = residual as f32;
                    square += residual * residual;
                }
            }
            let mut residual = zeros.clone();
            let squares = operator::residual(level, &u, f, &mut residual);
            assert_rows_close(&residual, &expected, RESIDUAL_ROUNDING);
            let sum: f64 = squares.iter().map(|&s| f64::from(s)).sum();
            assert!((sum - square).abs() <= 1e-4 * square, "{sum} and {square}");
            if matches!(f, Rhs::Zero) {
                let mut image = zeros.clone();
                operator::apply(level, &u, &mut image);
                let negative: Vec<Row> = expected.iter().map(|row| row.map(|r| -r)).collect();
                assert_rows_close(&image, &negative, RESIDUAL_ROUNDING);
            }
        }
    });
}

/// Restriction is half the transpose of trilinear interpolation, see [`crate::transfer`].
#[test]
fn restriction_matches_plain_loops() {
    let hierarchy = hierarchy();
    for (levels, transfer) in hierarchy.levels.windows(2).zip(&hierarchy.transfers) {
        let [fine, coarse] = levels else { unreachable!("windows of two") };
        let residual = &some_field(fine, 4)[..fine.first_row(1)];
        let mut f = vec![ZERO; coarse.n_rows()];
        restrict_residual(coarse, transfer, residual, &mut f);
        let mut expected = vec![ZERO; coarse.n_rows()];
        for cell in coarse.grid.cells().filter(|&c| coarse.row_of[coarse.grid.index(c)] != NO_CELL) {
            let out = &mut expected[coarse.row_of[coarse.grid.index(cell)] as usize];
            for number in 0..27 {
                let offset = [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1];
                let row = fine.row_at(cell.map(|x| 2 * x), offset) as usize;
                let weight = 0.5 * 0.5f32.powi(offset.iter().map(|o| o.abs()).sum());
                // Black residuals are zero after a black half sweep.
                if row < residual.len() && offset.iter().sum::<i32>() % 2 == 0 {
                    for k in 0..LANES {
                        out[k] += weight * residual[row][k];
                    }
                }
            }
        }
        assert_rows_close(&f, &expected, ROUNDING);
    }
}

#[test]
fn prolongation_matches_plain_loops() {
    let hierarchy = hierarchy();
    for (levels, transfer) in hierarchy.levels.windows(2).zip(&hierarchy.transfers) {
        let [fine, coarse] = levels else { unreachable!("windows of two") };
        let (from, before) = (some_field(coarse, 5), some_field(fine, 6));
        for mode in [ProlongationMode::Correct, ProlongationMode::Replace] {
            let mut expected = before.clone();
            let black = fine.grid.cells().filter(|&c| Grid::colour(c) == 1);
            for cell in black.filter(|&c| fine.row_of[fine.grid.index(c)] != NO_CELL) {
                let (mut sum, mut known) = (ZERO, 0.0f32);
                let mut weight = 1.0;
                // An odd coordinate lies between two coarse centres, an even one coincides with one.
                let ends = cell.map(|x| if x % 2 == 1 { vec![x / 2, x / 2 + 1] } else { vec![x / 2] });
                for end in &ends {
                    weight /= end.len() as f32;
                }
                for &z in &ends[2] {
                    for &y in &ends[1] {
                        for &x in &ends[0] {
                            let row = coarse.row_at([x, y, z], [0; 3]);
                            known += f32::from(u8::from(row != coarse.zero_row()));
                            for k in 0..LANES {
                                sum[k] += from[row as usize][k];
                            }
                        }
                    }
                }
                let out = &mut expected[fine.row_of[fine.grid.index(cell)] as usize];
                for k in 0..LANES {
                    out[k] = match mode {
                        ProlongationMode::Correct => out[k] + weight * sum[k],
                        ProlongationMode::Replace => sum[k] / known.max(1.0),
                    };
                }
            }
            let mut u = before.clone();
            for plane in 0..fine.grid.dims[2] as usize {
                prolong_plane(fine, transfer, plane, &from, &mut u, mode);
            }
            assert_rows_close(&u, &expected, ROUNDING);
        }
    }
}

#[test]
fn kernels_leave_the_zero_rows_zero() {
    let hierarchy = hierarchy();
    let level = &hierarchy.levels[0];
    let (cut, _) = rhs(level);
    let mut u = some_field(level, 7);
    for colour in [0, 1, 0, 1] {
        for plane in 0..level.grid.dims[2] as usize {
            relax_plane(level, colour, plane, &mut u, Rhs::Cut(&cut));
        }
    }
    let coarse = some_field(&hierarchy.levels[1], 8);
    for plane in 0..level.grid.dims[2] as usize {
        prolong_plane(level, &hierarchy.transfers[0], plane, &coarse, &mut u, ProlongationMode::Correct);
    }
    assert_eq!((u[level.zero_row() as usize], u[level.n_rows() - 1]), (ZERO, ZERO));
}
