//! Tests that runs, cut cells and boundary terms match the boundary's definition.

use super::plain::{cells, linear, on_two_levels};
use super::*;

/// Tolerance for f32 rounding of sums of at most six arm weights up to 1,000, relative to the diagonal.
const ROUNDING: f64 = 1e-6;

/// Neighbours that are unknowns, and the diagonal, of each row, from runs and cut cells.
fn tables(level: &Level) -> Vec<(u32, Vec<u32>, f64)> {
    let mut all = Vec::new();
    for (number, colour) in level.colours.iter().enumerate() {
        let (own, other) = (level.first_row(number) as u32, level.first_row(1 - number) as u32);
        let zero = other + level.colours[1 - number].n_cells;
        for run in &colour.runs {
            for j in 0..run.len {
                let mut neighbours = vec![run.x + j, run.x + j + 1];
                neighbours.extend(run.yz.map(|first| first + j));
                all.push((own + run.start + j, neighbours.iter().map(|n| other + n).collect(), 6.0));
            }
        }
        for cut in &colour.cut {
            let neighbours = cut.neighbours.iter().map(|n| other + n).filter(|&n| n != zero).collect();
            all.push((own + cut.cell, neighbours, f64::from(cut.diagonal)));
        }
    }
    all
}

#[test]
fn every_unknown_is_in_one_run_or_one_cut_cell() {
    on_two_levels(|_, level, _| {
        let mut rows: Vec<u32> = tables(level).into_iter().map(|(row, ..)| row).collect();
        rows.sort_unstable();
        let mut expected: Vec<u32> = level.row_of.iter().copied().filter(|&r| r != NO_CELL).collect();
        expected.sort_unstable();
        assert_eq!(rows, expected);
        assert!(level.colours.iter().all(|c| !c.runs.is_empty() && !c.cut.is_empty()), "both kinds occur");
        assert!(rows.windows(2).all(|w| w[0] < w[1]));
        assert!(!rows.contains(&level.zero_row()) && !rows.contains(&(level.n_rows() as u32 - 1)));
    });
}

#[test]
fn planes_list_their_own_cells() {
    on_two_levels(|_, level, _| {
        let mut cell_of = vec![[0; 3]; level.n_rows()];
        for cell in level.grid.cells().filter(|&c| level.row_of[level.grid.index(c)] != NO_CELL) {
            cell_of[level.row_of[level.grid.index(cell)] as usize] = cell;
        }
        for (number, colour) in level.colours.iter().enumerate() {
            assert_eq!(colour.planes.len(), level.grid.dims[2] as usize + 1);
            for (z, plane) in colour.planes.windows(2).enumerate() {
                let runs = &colour.runs[plane[0][0] as usize..plane[1][0] as usize];
                let cut = &colour.cut[plane[0][1] as usize..plane[1][1] as usize];
                for own in runs.iter().map(|r| r.start).chain(cut.iter().map(|c| c.cell)) {
                    let cell = cell_of[level.first_row(number) + own as usize];
                    assert_eq!((cell[2] as usize, Grid::colour(cell)), (z, number));
                }
            }
        }
    });
}

#[test]
fn tables_have_the_neighbours_and_diagonals_of_the_boundary() {
    on_two_levels(|_, level, boundary| {
        let mut tables = tables(level);
        tables.sort_by_key(|(row, ..)| *row);
        let mut plain = cells(level, boundary);
        plain.sort_by_key(|c| c.row);
        assert_eq!(tables.len(), plain.len());
        for ((row, mut neighbours, diagonal), mut plain) in tables.into_iter().zip(plain) {
            neighbours.sort_unstable();
            plain.neighbours.sort_unstable();
            assert_eq!((row, neighbours), (plain.row, plain.neighbours));
            assert!(
                (diagonal - plain.diagonal).abs() <= ROUNDING * diagonal,
                "{diagonal} {}",
                plain.diagonal
            );
        }
    });
}

#[test]
fn neighbours_are_mutual() {
    on_two_levels(|_, level, _| {
        let mut pairs: Vec<[u32; 2]> = tables(level)
            .into_iter()
            .flat_map(|(row, neighbours, _)| neighbours.into_iter().map(move |n| [row, n]))
            .collect();
        pairs.sort_unstable();
        assert!(pairs.iter().all(|&[a, b]| pairs.binary_search(&[b, a]).is_ok()), "the matrix is symmetric");
    });
}

/// Constants and linear functions solve the discrete equations: hats reproduce them on the cage, and their difference
/// quotients are equal on both sides of a centre.
#[test]
fn operator_annihilates_linear_functions() {
    on_two_levels(|cage, level, _| {
        let center = cage.bounds().center().as_dvec3();
        let at = |p: DVec3| linear((p - center) / f64::from(cage.diagonal()));
        let mut values = vec![[0.0; 4]; level.n_rows()];
        for cell in level.grid.cells().filter(|&c| level.row_of[level.grid.index(c)] != NO_CELL) {
            values[level.row_of[level.grid.index(cell)] as usize] = at(level.center(cell));
        }
        let mut hats = vec![[0.0; 4]; level.n_cut()];
        for term in &level.boundary {
            let corner = at(cage.positions()[term.column as usize].as_dvec3());
            for (sum, x) in hats[term.cut_cell as usize].iter_mut().zip(corner) {
                *sum += f64::from(term.value) * x;
            }
        }
        let first_black = level.first_row(1) as u32;
        let red = level.colours[0].cut.iter().map(|c| c.cell);
        let cut_rows: Vec<u32> =
            red.chain(level.colours[1].cut.iter().map(|c| first_black + c.cell)).collect();
        for (row, neighbours, diagonal) in tables(level) {
            let cut = cut_rows.iter().position(|&r| r == row);
            for f in 0..4 {
                let around: f64 = neighbours.iter().map(|&n| values[n as usize][f]).sum();
                let residual = around + cut.map_or(0.0, |c| hats[c][f]) - diagonal * values[row as usize][f];
                assert!(residual.abs() <= 2.0 * ROUNDING * diagonal, "function {f}, row {row}: {residual}");
            }
        }
    });
}

#[test]
fn boundary_terms_ascend_by_cell_and_column() {
    on_two_levels(|_, level, _| {
        let keys: Vec<(u32, u32)> = level.boundary.iter().map(|t| (t.cut_cell, t.column)).collect();
        assert!(keys.windows(2).all(|w| w[0] < w[1]), "sorted, each column once per cell");
    });
}
