//! Cell kinds and boundary values of the classic method: cells that the cage touches take the cage's values.
//!
//! Source: Smith, "CSC 473 Harmonic Coordinates", section 3.1, Algorithms 1 and 2.
//!
//! Differences from the paper:
//! - A triangle is tested only against the cells that its part in each row of the grid spans (the paper proposes all
//!   cells of its bounding box). Slices of the grid are independent, so they run in parallel, and the result does not
//!   depend on the number of threads.
//! - A cell's values are taken at the triangle's point closest to its centre. Barycentric coordinates of the centre
//!   itself can be negative or exceed 1, as it need not lie over the triangle.
//! - Of several triangles in a cell, the one closest to the cell's centre gives the values (the first one in a tie). In
//!   the paper each triangle overwrites the values of its own vertices, and the sum of a cell's values can exceed 1.
//! - Faces may be polygons of any size, with the values of [`Cage::hats_at`].
//! - The grid extends 1/1000 cell beyond the cage's box, so that no face lies on its outermost plane.
//! - The exterior is flooded from all outermost cells (as the paper proposes), row by row, without recursion.

use glam::{DVec3, UVec3};

use crate::cage::Cage;
use crate::controls::Controls;
use crate::geometry::{closest_point_on_triangle, triangle_box_overlaps};
use crate::team::map_indices;

/// Distance between the cage's box and the border of the grid, in cells.
const PADDING: f64 = 1e-3;

/// Enlargement of ranges of cells against rounding, in cells. An exact overlap test follows.
const RANGE_WIDENING: f64 = 1e-6;

/// Position of a cell relative to the cage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum CellKind {
    /// Not yet classified.
    #[default]
    Untyped,
    /// The cage passes through the cell.
    Boundary,
    /// Enclosed by boundary cells.
    Interior,
    /// Connected to the border of the grid without passing a boundary cell.
    Exterior,
}

/// Dirichlet values of boundary cells, in compressed rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoundaryValues {
    /// The boundary cells, ascending. `[n_boundary]`
    pub cells: Vec<u32>,
    /// Index of the first value of each cell. `[n_boundary + 1]`
    pub indptr: Vec<u32>,
    /// Control to which each value belongs. `[n_values]`
    pub indices: Vec<u32>,
    /// Dirichlet values; those of a cell sum to 1. `[n_values]`
    pub values: Vec<f32>,
}

impl BoundaryValues {
    /// Row of a cell, if it is a boundary cell.
    #[must_use]
    pub fn row_of(&self, cell: u32) -> Option<usize> {
        self.cells.binary_search(&cell).ok()
    }

    /// Controls and values of the boundary cell in a row.
    #[must_use]
    pub fn row(&self, row: usize) -> (&[u32], &[f32]) {
        let range = self.indptr[row] as usize..self.indptr[row + 1] as usize;
        (&self.indices[range.clone()], &self.values[range])
    }
}

/// Cell kinds and boundary values of the classic method.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassicCells {
    /// Numbers of cells along x, y and z.
    pub dims: [u32; 3],
    /// Centre of cell (0, 0, 0), object units.
    pub origin: DVec3,
    /// Edge lengths of a cell, object units.
    pub cell_size: DVec3,
    /// Kinds, x fastest, then y, z; no cell is untyped. `[nz, ny, nx]`
    pub kinds: Vec<CellKind>,
    /// Values of the boundary cells.
    pub boundary: BoundaryValues,
}

/// Classifies all cells of a grid around the cage and assigns values to boundary cells. `grid`: cells along each axis
/// of the cage's box, 1 to 1,024.
#[must_use]
pub fn voxelize_classic(controls: Controls<'_>, grid: u32) -> ClassicCells {
    let cage = controls.surface();
    debug_assert!((1..=1024).contains(&grid), "cells are counted in u32");
    let (dims, origin, cell_size) = place_grid(cage, grid);
    let slices = triangles_of_slices(cage, dims, origin, cell_size);
    let marked =
        map_indices(dims.z as usize, |z| mark_slice(controls, dims, origin, cell_size, z as u32, &slices[z]));

    let slice = (dims.x * dims.y) as usize;
    let mut kinds = vec![CellKind::Untyped; slice * dims.z as usize];
    let mut boundary = BoundaryValues { indptr: vec![0], ..BoundaryValues::default() };
    for (z, part) in marked.into_iter().enumerate() {
        for &cell in &part.cells {
            kinds[z * slice + cell as usize] = CellKind::Boundary;
            boundary.cells.push((z * slice) as u32 + cell);
        }
        let before = boundary.indices.len() as u32;
        boundary.indptr.extend(part.indptr[1..].iter().map(|&end| before + end));
        boundary.indices.extend(part.indices);
        boundary.values.extend(part.values);
    }
    fill_exterior(&mut kinds, dims);
    for kind in &mut kinds {
        if *kind == CellKind::Untyped {
            *kind = CellKind::Interior;
        }
    }
    ClassicCells { dims: dims.into(), origin, cell_size, kinds, boundary }
}

/// Dimensions of the classic grid, centre of its first cell, and cell size: `grid` rectangular cells along each axis of
/// the cage's box, as in the paper.
pub(crate) fn place_grid(cage: &Cage, grid: u32) -> (UVec3, DVec3, DVec3) {
    let (min, max) = (cage.bounds().min.as_dvec3(), cage.bounds().max.as_dvec3());
    let (dims, cell_size) = (UVec3::splat(grid), (max - min) / (f64::from(grid) - 2.0 * PADDING));
    let corner = 0.5 * (min + max) - 0.5 * dims.as_dvec3() * cell_size;
    (dims, corner + 0.5 * cell_size, cell_size)
}

/// Cells that overlap an interval of coordinates, which are measured in cells from the grid's corner.
fn cell_range(low: f64, high: f64, n: u32) -> std::ops::RangeInclusive<u32> {
    // A cast to u32 clamps negative values to 0.
    (low - RANGE_WIDENING) as u32..=((high + RANGE_WIDENING) as u32).min(n - 1)
}

/// Triangles that may meet each slice of constant z, ascending. `[nz]`
fn triangles_of_slices(cage: &Cage, dims: UVec3, origin: DVec3, cell_size: DVec3) -> Vec<Vec<u32>> {
    let mut slices = vec![Vec::new(); dims.z as usize];
    for t in 0..cage.facets().len() as u32 {
        let [a, b, c] = cage.facet_corners(t).map(|p| (p.z - origin.z) / cell_size.z + 0.5);
        for z in cell_range(a.min(b).min(c), a.max(b).max(c), dims.z) {
            slices[z as usize].push(t);
        }
    }
    slices
}

/// Boundary cells of a slice (indices within the slice) and their values.
fn mark_slice(
    controls: Controls<'_>,
    dims: UVec3,
    origin: DVec3,
    cell_size: DVec3,
    z: u32,
    triangles: &[u32],
) -> BoundaryValues {
    #[derive(Clone, Copy)]
    struct ClosestTriangle {
        distance_squared: f64,
        triangle: u32,
        barycentric: [f64; 3],
    }
    let cage = controls.surface();
    let mut closest: Vec<Option<ClosestTriangle>> = vec![None; (dims.x * dims.y) as usize];
    let half = 0.5 * cell_size;
    let (mut in_slice, mut in_row, mut scratch) = (Vec::new(), Vec::new(), Vec::new());
    for &t in triangles {
        let triangle = cage.facet_corners(t);
        // Cell coordinates, measured from the grid's corner: cell x spans [x, x + 1].
        let in_cells = triangle.map(|p| (p - origin) / cell_size + DVec3::splat(0.5));
        in_slice.clear();
        in_slice.extend(in_cells);
        clip(&mut in_slice, &mut scratch, 2, z);
        let Some((low, high)) = range(&in_slice, 1) else { continue };
        for y in cell_range(low, high, dims.y) {
            in_row.clone_from(&in_slice);
            clip(&mut in_row, &mut scratch, 1, y);
            let Some((low, high)) = range(&in_row, 0) else { continue };
            for x in cell_range(low, high, dims.x) {
                let center = origin + UVec3::new(x, y, z).as_dvec3() * cell_size;
                if !triangle_box_overlaps(center, half, triangle) {
                    continue;
                }
                let found = closest_point_on_triangle(center, triangle);
                let distance_squared = found.point.distance_squared(center);
                let best = &mut closest[(x + dims.x * y) as usize];
                if best.is_none_or(|b| distance_squared < b.distance_squared) {
                    let barycentric = found.barycentric;
                    *best = Some(ClosestTriangle { distance_squared, triangle: t, barycentric });
                }
            }
        }
    }
    let mut marked = BoundaryValues { indptr: vec![0], ..BoundaryValues::default() };
    for (cell, best) in closest.iter().enumerate() {
        if let Some(best) = best {
            let first = marked.indices.len();
            controls.values_at(
                best.triangle,
                best.barycentric,
                &mut |i, value| match marked.indices[first..].iter().position(|&other| other == i) {
                    Some(k) => marked.values[first + k] += value as f32,
                    None => {
                        marked.indices.push(i);
                        marked.values.push(value as f32);
                    }
                },
            );
            marked.cells.push(cell as u32);
            marked.indptr.push(marked.indices.len() as u32);
        }
    }
    marked
}

/// Clips a convex polygon to the layer of cells `at` along `axis`, slightly enlarged.
fn clip(polygon: &mut Vec<DVec3>, scratch: &mut Vec<DVec3>, axis: usize, at: u32) {
    let low = f64::from(at) - RANGE_WIDENING;
    let high = f64::from(at) + 1.0 + RANGE_WIDENING;
    for (sign, limit) in [(1.0, low), (-1.0, -high)] {
        let depth = |p: DVec3| sign * p[axis] - limit;
        scratch.clear();
        for (k, &p) in polygon.iter().enumerate() {
            let q = polygon[if k + 1 == polygon.len() { 0 } else { k + 1 }];
            let (from, to) = (depth(p), depth(q));
            if from >= 0.0 {
                scratch.push(p);
            }
            if from * to < 0.0 {
                scratch.push(p.lerp(q, from / (from - to)));
            }
        }
        std::mem::swap(polygon, scratch);
    }
}

/// Smallest and largest coordinate along `axis`; `None` without points.
fn range(points: &[DVec3], axis: usize) -> Option<(f64, f64)> {
    let coordinates = || points.iter().map(|p| p[axis]);
    (!points.is_empty()).then(|| {
        (coordinates().fold(f64::INFINITY, f64::min), coordinates().fold(f64::NEG_INFINITY, f64::max))
    })
}

/// Marks all untyped cells connected to an outermost one as exterior.
fn fill_exterior(kinds: &mut [CellKind], dims: UVec3) {
    let [nx, ny, nz] = dims.to_array().map(|n| n as usize);
    let untyped = |kinds: &[CellKind], cell: usize| kinds[cell] == CellKind::Untyped;
    // Stack of cells; each starts the fill of a run of untyped cells along x.
    let mut runs = Vec::new();
    for row in 0..ny * nz {
        let (y, z) = (row % ny, row / ny);
        let outermost = y == 0 || y == ny - 1 || z == 0 || z == nz - 1;
        let seeds: &mut dyn Iterator<Item = usize> =
            if outermost { &mut (0..nx) } else { &mut [0, nx - 1].into_iter() };
        for x in seeds {
            runs.push(row * nx + x);
            while let Some(cell) = runs.pop() {
                if !untyped(kinds, cell) {
                    continue;
                }
                let row = cell / nx;
                let (first, end) = (row * nx, row * nx + nx);
                let from = (first..cell).rev().take_while(|&c| untyped(kinds, c)).last().unwrap_or(cell);
                let to = (cell..end).take_while(|&c| untyped(kinds, c)).last().unwrap_or(cell);
                kinds[from..=to].fill(CellKind::Exterior);
                let (y, z) = (row % ny, row / ny);
                let neighbours = [
                    (y > 0).then(|| row - 1),
                    (y + 1 < ny).then_some(row + 1),
                    (z > 0).then(|| row - ny),
                    (z + 1 < nz).then_some(row + ny),
                ];
                for other in neighbours.into_iter().flatten() {
                    let shifted = other * nx + (from - first)..=other * nx + (to - first);
                    let mut in_run = false;
                    for c in shifted {
                        let is_untyped = untyped(kinds, c);
                        if is_untyped && !in_run {
                            runs.push(c);
                        }
                        in_run = is_untyped;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
