//! Tests that both tables contain the weights of trilinear interpolation, of which restriction uses the transpose.

use std::collections::BTreeMap;

use super::*;
use crate::levels::plain::hierarchy;

/// Trilinear weight of a coarse centre at an offset in fine cells.
fn trilinear(offset: [i32; 3]) -> f32 {
    offset.iter().map(|o| 1.0 - 0.5 * o.abs() as f32).product()
}

/// Trilinear weight of each pair (fine row, coarse row) of unknowns, computed from cell positions.
fn expected(fine: &Level, coarse: &Level, colour: usize) -> BTreeMap<(u32, u32), f32> {
    let mut weights = BTreeMap::new();
    for cell in coarse.grid.cells() {
        let to = coarse.row_at(cell, [0; 3]);
        for number in 0..27 {
            let offset = [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1];
            let from = fine.row_at(cell.map(|x| 2 * x), offset);
            let is_colour = (offset.iter().sum::<i32>() & 1) as usize == colour;
            if is_colour && from != fine.zero_row() && to != coarse.zero_row() {
                weights.insert((from, to), trilinear(offset));
            }
        }
    }
    weights
}

#[test]
fn restriction_is_half_the_transpose_on_red_cells() {
    let hierarchy = hierarchy();
    for (levels, transfer) in hierarchy.levels.windows(2).zip(&hierarchy.transfers) {
        let (fine, coarse) = (&levels[0], &levels[1]);
        let mut weights = BTreeMap::new();
        for (colour, rows) in transfer.restrict_rows.iter().enumerate() {
            assert_eq!(rows.len(), coarse.colours[colour].n_cells as usize);
            for (number, around) in rows.iter().enumerate() {
                let to = (coarse.first_row(colour) + number) as u32;
                for (k, &from) in around.iter().enumerate().filter(|(_, from)| **from != fine.zero_row()) {
                    let weight = if k == 0 { RESTRICT_CENTRE } else { RESTRICT_EDGE };
                    assert_eq!(weights.insert((from, to), weight / 0.5), None, "each cell occurs once");
                }
            }
        }
        assert_eq!(weights, expected(fine, coarse, 0));
    }
}

#[test]
fn prolongation_is_trilinear_on_black_cells() {
    let hierarchy = hierarchy();
    for (levels, transfer) in hierarchy.levels.windows(2).zip(&hierarchy.transfers) {
        let (fine, coarse) = (&levels[0], &levels[1]);
        let mut weights = BTreeMap::new();
        let mut add = |cell: u32, ends: &[u32], mean: f32| {
            let known: Vec<u32> = ends.iter().copied().filter(|&to| to != coarse.zero_row()).collect();
            let expected = if known.is_empty() { 0.0 } else { 1.0 / known.len() as f32 };
            assert_eq!(mean, expected);
            for to in known {
                let from = fine.first_row(1) as u32 + cell;
                assert_eq!(
                    weights.insert((from, to), 1.0 / ends.len() as f32),
                    None,
                    "each cell occurs once"
                );
            }
        };
        for row in &transfer.faces {
            add(row.cell, &row.coarse, row.mean);
        }
        for row in &transfer.corners {
            add(row.cell, &row.coarse, row.mean);
        }
        assert_eq!(weights, expected(fine, coarse, 1));
        assert_eq!(transfer.faces.len() + transfer.corners.len(), fine.colours[1].n_cells as usize);
        assert_eq!(
            transfer.planes.last(),
            Some(&[transfer.faces.len() as u32, transfer.corners.len() as u32])
        );
    }
}

/// Away from the cage, a constant residual of 1 on the red cells alone gives `1/2 (1 + 12 / 4) = 2`. This is half of
/// the `8 / 2` that a constant on all 27 cells would give.
#[test]
fn restriction_of_a_constant_is_two() {
    assert_eq!(RESTRICT_CENTRE + 12.0 * RESTRICT_EDGE, 2.0);
    let whole: f32 = (0..27).map(|n| trilinear([n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1])).sum();
    assert_eq!(0.5 * whole, 4.0);
}
