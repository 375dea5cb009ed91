//! Reference for tests: the stencil of each cell, computed from the boundary without the runs of equal stencils and the
//! tables that [`Level`] stores.

use glam::{DQuat, DVec3};

use super::*;
use crate::cage::{Cage, shapes};
use crate::solve::hierarchy::Hierarchy;
use crate::solve::rows::{LANES, Row};
use crate::voxelize::embedded::{EmbeddedCells, Embedding};

/// The equation of an unknown: `diagonal * u = sum of neighbours + sum of hats`.
pub(crate) struct PlainCell {
    pub(crate) cell: [u32; 3],
    pub(crate) row: u32,
    /// Rows of the neighbours reached without crossing the cage.
    pub(crate) neighbours: Vec<u32>,
    /// Dirichlet terms: `(column, hat value times arm weight)`.
    pub(crate) hats: Vec<(u32, f64)>,
    pub(crate) diagonal: f64,
}

/// Equations of all unknowns of a level, in grid order.
pub(crate) fn cells(level: &Level, boundary: &dyn Boundary) -> Vec<PlainCell> {
    let row = |cell| level.row_of[level.grid.index(cell)];
    let unknowns = level.grid.cells().filter(|&cell| row(cell) != NO_CELL);
    unknowns
        .map(|cell| {
            let mut plain =
                PlainCell { cell, row: row(cell), neighbours: Vec::new(), hats: Vec::new(), diagonal: 0.0 };
            for d in 0..6 {
                if boundary.cut_arms()[level.grid.index(cell)] >> d & 1 == 1 {
                    let mut hats = Vec::new();
                    let weight = boundary.arm(cell, d, &mut |column, value| hats.push((column, value)));
                    plain.hats.extend(hats.into_iter().map(|(column, value)| (column, weight * value)));
                    plain.diagonal += weight;
                } else if let Some(c) = level.grid.neighbour(cell, d).filter(|&c| row(c) != NO_CELL) {
                    plain.neighbours.push(row(c));
                    plain.diagonal += 1.0;
                }
            }
            plain
        })
        .collect()
}

/// A rotated C-shape in a grid of odd dimensions.
pub(crate) fn askew_c() -> (Cage, Grid) {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.3, -0.6);
    let mut mesh = shapes::c_shape();
    for p in &mut mesh.positions {
        *p = (turn * p.as_dvec3()).as_vec3();
    }
    let cage = Cage::new(&mesh).unwrap();
    let mut grid = Grid::cubic(cage.bounds(), 23);
    grid.dims = grid.dims.map(|d| d | 1);
    (cage, grid)
}

/// Runs `test` on the finest and the next coarser level of [`askew_c`].
pub(crate) fn on_two_levels(test: impl Fn(&Cage, &Level, &EmbeddedCells<'_>)) {
    let (cage, grid) = askew_c();
    for boundary in &Embedding::new(&cage, &grid, true).boundaries((&cage).into())[..2] {
        test(&cage, &Level::new(boundary), boundary);
    }
}

/// All levels of [`askew_c`].
pub(crate) fn hierarchy() -> Hierarchy {
    let (cage, grid) = askew_c();
    Hierarchy::new(&Embedding::new(&cage, &grid, true).boundaries((&cage).into()), cage.n_vertices())
}

/// A field of pseudo-random numbers in [0, 1), with zero rows.
pub(crate) fn some_field(level: &Level, seed: u32) -> Vec<Row> {
    let zero = level.zero_row() as usize;
    (0..level.n_rows())
        .map(|row| {
            std::array::from_fn(|k| {
                let number = (row * LANES + k) as f64 + f64::from(seed) * 0.37;
                let value = (number * 0.754_877_666).fract() as f32;
                if row == zero || row + 1 == level.n_rows() { 0.0 } else { value }
            })
        })
        .collect()
}

/// Values of the functions x, y, z and 1 at a cell's centre, which the operator must reproduce.
pub(crate) fn linear(center: DVec3) -> [f64; 4] {
    [center.x, center.y, center.z, 1.0]
}
