//! The grid: conversion between cells, indices and points.

use glam::DVec3;

use crate::mesh::Bounds;

/// Offset of the cell centres, in cells. It is small and irregular, so that grid lines do not run along edges and
/// vertices of axis-aligned cages.
const SHIFT: DVec3 = DVec3::new(0.003_713_7, 0.002_071_1, 0.004_318_5);

/// Value that stands for "no cell" or "no row" in tables of indices.
pub const NO_CELL: u32 = u32::MAX;

/// A box of equal cells with unknowns at their centres; x runs fastest, then y, then z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Numbers of cells along x, y and z.
    pub dims: [u32; 3],
    /// Centre of cell (0, 0, 0), object units.
    pub origin: DVec3,
    /// Edge lengths of a cell, object units.
    pub cell: DVec3,
}

impl Grid {
    /// Creates a grid of cubic cells around `bounds`: `g` along the longest side of `bounds`, plus one layer of cells
    /// on all sides.
    #[must_use]
    pub fn cubic(bounds: Bounds, g: u32) -> Self {
        let (min, extent) = (bounds.min.as_dvec3(), bounds.extent().as_dvec3());
        let h = extent.max_element() / f64::from(g);
        // The cells cover the cage symmetrically, so that a cage that is turned by 90 degrees or mirrored gets nearly the
        // same centres.
        // A side of whole cells can come out a rounding error longer.
        let over = (extent / h).map(|x| 0.5 * ((x - 1e-9).ceil() - x).max(0.0));
        // The first and the last layer of centres lie outside the cage.
        let first = SHIFT - 0.5 - over;
        let dims = [0, 1, 2].map(|a| (extent[a] / h - first[a]).ceil().max(1.0) as u32 + 1);
        Self { dims, origin: min + h * first, cell: DVec3::splat(h) }
    }

    /// Returns the grid of every second centre along each axis: its cell (x, y, z) has the centre of this grid's cell
    /// (2x, 2y, 2z).
    #[must_use]
    pub fn coarsened(&self) -> Self {
        Self { dims: self.dims.map(|d| (d - 1) / 2 + 1), origin: self.origin, cell: 2.0 * self.cell }
    }

    /// Number of cells, inside and outside the cage.
    #[must_use]
    pub fn n_cells(&self) -> usize {
        self.dims.iter().map(|&d| d as usize).product()
    }

    /// Index of a cell in arrays over the grid, x fastest.
    #[inline]
    #[must_use]
    pub fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        debug_assert!(x < self.dims[0] && y < self.dims[1] && z < self.dims[2]);
        (z as usize * self.dims[1] as usize + y as usize) * self.dims[0] as usize + x as usize
    }

    /// Cell with this index: the inverse of [`Self::index`].
    #[inline]
    #[must_use]
    pub fn cell(&self, index: usize) -> [u32; 3] {
        let [nx, ny] = [self.dims[0] as usize, self.dims[1] as usize];
        [index % nx, index / nx % ny, index / (nx * ny)].map(|x| x as u32)
    }

    /// The neighbour in a `direction` (+x, -x, +y, -y, +z, -z), if it is in the grid.
    #[inline]
    #[must_use]
    pub fn neighbour(&self, mut cell: [u32; 3], direction: usize) -> Option<[u32; 3]> {
        let axis = direction / 2;
        cell[axis] = if direction.is_multiple_of(2) { cell[axis] + 1 } else { cell[axis].checked_sub(1)? };
        (cell[axis] < self.dims[axis]).then_some(cell)
    }

    /// The cell at `cell + offset`, if it is in the grid.
    #[inline]
    #[must_use]
    pub fn offset(&self, cell: [u32; 3], offset: [i32; 3]) -> Option<[u32; 3]> {
        let mut moved = cell;
        for axis in 0..3 {
            moved[axis] = cell[axis].checked_add_signed(offset[axis]).filter(|&x| x < self.dims[axis])?;
        }
        Some(moved)
    }

    /// Index difference between neighbours along each axis.
    #[must_use]
    pub fn strides(&self) -> [usize; 3] {
        let (nx, ny) = (self.dims[0] as usize, self.dims[1] as usize);
        [1, nx, nx * ny]
    }

    /// Index of the first cell of a line along `axis`, given the coordinates along the next two axes in cyclic order.
    #[inline]
    #[must_use]
    pub fn line_start(&self, axis: usize, [u, v]: [u32; 2]) -> usize {
        let strides = self.strides();
        u as usize * strides[(axis + 1) % 3] + v as usize * strides[(axis + 2) % 3]
    }

    /// All cells in index order.
    pub fn cells(&self) -> impl Iterator<Item = [u32; 3]> + use<> {
        let [nx, ny, nz] = self.dims;
        (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])))
    }

    /// Cell coordinates of a point, in which cell centres are integers.
    #[inline]
    #[must_use]
    pub fn to_grid(&self, p: DVec3) -> DVec3 {
        (p - self.origin) / self.cell
    }

    /// Centre of a cell, object units.
    #[must_use]
    pub fn center(&self, cell: [u32; 3]) -> DVec3 {
        self.origin + self.cell * DVec3::from_array(cell.map(f64::from))
    }

    /// Colour of a cell in red-black order: 0 red, 1 black.
    #[inline]
    #[must_use]
    pub fn colour(cell: [u32; 3]) -> usize {
        ((cell[0] + cell[1] + cell[2]) & 1) as usize
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn longest_side_has_g_centres_inside() {
        let bounds = Bounds { min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(3.0, 1.0, 4.0) };
        for g in [8, 16, 33, 64] {
            let grid = Grid::cubic(bounds, g);
            for axis in 0..3 {
                let inside = (0..grid.dims[axis])
                    .map(|x| grid.center([x; 3])[axis])
                    .filter(|&x| x > f64::from(bounds.min[axis]) && x < f64::from(bounds.max[axis]))
                    .count() as f64;
                let expected =
                    f64::from(g) * f64::from(bounds.extent()[axis] / bounds.extent().max_element());
                assert!((inside - expected).abs() <= 1.0, "g {g}, axis {axis}: {inside} centres inside");
            }
        }
    }

    #[test]
    fn outermost_layers_lie_outside() {
        let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::new(1.0, 0.7, 0.33) };
        for g in 8..80 {
            let grid = Grid::cubic(bounds, g);
            for axis in 0..3 {
                assert!(grid.center([0; 3])[axis] < f64::from(bounds.min[axis]));
                assert!(grid.center(grid.dims.map(|d| d - 1))[axis] > f64::from(bounds.max[axis]));
            }
        }
    }

    #[test]
    fn cells_come_in_index_order() {
        let grid = Grid { dims: [5, 3, 4], origin: DVec3::ZERO, cell: DVec3::ONE };
        for (index, cell) in grid.cells().enumerate() {
            assert_eq!((grid.index(cell), grid.cell(index)), (index, cell));
        }
    }

    #[test]
    fn coarse_centres_are_fine_centres() {
        let grid = Grid { dims: [9, 6, 3], origin: DVec3::new(0.5, -1.0, 2.0), cell: DVec3::splat(0.25) };
        let coarse = grid.coarsened();
        assert_eq!(coarse.dims, [5, 3, 2]);
        for cell in coarse.cells() {
            assert_eq!(coarse.center(cell), grid.center(cell.map(|x| 2 * x)));
        }
    }
}
