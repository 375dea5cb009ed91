//! Cells of the grid: those around an edit.

use glam::DVec3;

use crate::cage_gen::footprint::Footprint;
use crate::grid::{Grid, NO_CELL};

/// Some cells, such as those near moved faces.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// For each cell of the grid its place in `cells`; [`NO_CELL`] if it is none of them.
    pub(super) number: Vec<u32>,
    /// Indices of the cells in the grid.
    pub(super) cells: Vec<u32>,
    dims: [usize; 3],
}

impl Region {
    /// All cells whose centre is within `reach` cells, along each axis, of a triangle (grid coordinates).
    pub(super) fn around(triangles: &[[DVec3; 3]], reach: f64, grid: &Grid) -> Self {
        let mut region = Self::none(grid);
        let dims = region.dims;
        for triangle in triangles {
            // A footprint's voxels have their centres half a unit further on, and half a unit of reach.
            let footprint = Footprint::new(triangle.map(|p| p + 0.5), reach - 0.5);
            footprint.for_each_run(dims, |y, z, first, last| {
                let row = (z * dims[1] + y) * dims[0];
                (row + first..=row + last).for_each(|cell| region.add(cell));
            });
        }
        region
    }

    /// No cells of the grid yet.
    pub(super) fn none(grid: &Grid) -> Self {
        let dims = grid.dims.map(|n| n as usize);
        Self { number: vec![NO_CELL; grid.n_cells()], cells: Vec::new(), dims }
    }

    /// Adds a cell, if there is one of that index.
    pub(super) fn add(&mut self, cell: usize) {
        if self.number.get(cell) == Some(&NO_CELL) {
            self.number[cell] = self.cells.len() as u32;
            self.cells.push(cell as u32);
        }
    }

    /// Whether the lowest and the highest cell of the cube of centres around a point (grid coordinates) are among them.
    pub(super) fn holds_cube(&self, p: DVec3) -> bool {
        let cell = p.floor();
        let [nx, ny, nz] = self.dims;
        let highest = DVec3::new(nx as f64, ny as f64, nz as f64) - 1.0;
        cell.cmpge(DVec3::ZERO).all() && cell.cmplt(highest).all() && {
            let [x, y, z] = cell.to_array().map(|x| x as usize);
            let lowest = (z * ny + y) * nx + x;
            [lowest, lowest + (ny + 1) * nx + 1].iter().all(|&cell| self.number[cell] != NO_CELL)
        }
    }
}
