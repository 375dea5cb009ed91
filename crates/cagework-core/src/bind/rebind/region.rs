//! The cells around an edit.

use glam::DVec3;

use crate::cage_gen::footprint::Footprint;
use crate::grid::{Grid, NO_CELL};

/// Cells near moved faces.
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
        let dims = grid.dims.map(|n| n as usize);
        let mut region = Self { number: vec![NO_CELL; grid.n_cells()], cells: Vec::new(), dims };
        for triangle in triangles {
            // A footprint's voxels have their centres half a unit further on, and half a unit of reach.
            let footprint = Footprint::new(triangle.map(|p| p + 0.5), reach - 0.5);
            footprint.for_each_run(dims, |y, z, first, last| {
                let row = (z * dims[1] + y) * dims[0];
                for cell in row + first..=row + last {
                    if region.number[cell] == NO_CELL {
                        region.number[cell] = region.cells.len() as u32;
                        region.cells.push(cell as u32);
                    }
                }
            });
        }
        region
    }

    /// Whether the cell below a point (grid coordinates) along all axes is one of them.
    pub(super) fn holds(&self, p: DVec3) -> bool {
        let cell = p.floor();
        let [nx, ny, nz] = self.dims;
        let inside =
            cell.cmpge(DVec3::ZERO).all() && cell.cmplt(DVec3::new(nx as f64, ny as f64, nz as f64)).all();
        inside && {
            let [x, y, z] = cell.to_array().map(|x| x as usize);
            self.number[(z * ny + y) * nx + x] != NO_CELL
        }
    }
}
