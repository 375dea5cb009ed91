//! Winding numbers of a triangle soup at many points.
//!
//! Source: Barill et al. 2018, "Fast winding numbers for soups and clouds", the first-order expansion. Change: the
//! clusters are the cells of a grid, not the nodes of a tree.

use std::cell::OnceCell;
use std::f64::consts::PI;
use std::ops::Range;

use cagework_core::geometry::winding_number;
use glam::{DVec3, Vec3};

/// Number of cells along the longest side of the soup's box.
const DIVISIONS: f64 = 32.0;

/// Distance from which a cell counts as one dipole, in radii of the cell. The error of the whole is about 0.01.
const FAR: f64 = 3.0;

/// Triangles without any order or topology.
pub(super) struct Soup<'a> {
    pub(super) positions: &'a [Vec3],
    pub(super) triangles: &'a [[u32; 3]],
    grid: OnceCell<Grid>,
}

/// The triangles of a soup, sorted by the cell of their first corner.
struct Grid {
    order: Vec<u32>,
    cells: Vec<Cell>,
}

/// The triangles in a cell of the grid.
struct Cell {
    /// Range in [`Grid::order`].
    range: Range<usize>,
    /// Mean of the triangles' centres, weighted by area.
    center: DVec3,
    /// Largest distance of a corner from the centre.
    radius: f64,
    /// Sum of the area vectors.
    area: DVec3,
}

impl<'a> Soup<'a> {
    pub(super) fn new(positions: &'a [Vec3], triangles: &'a [[u32; 3]]) -> Self {
        Self { positions, triangles, grid: OnceCell::new() }
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize].as_dvec3())
    }

    /// Computes the winding number around a point; see [`winding_number`]. Its error is about 0.01.
    pub(super) fn winding(&self, point: DVec3) -> f64 {
        let Grid { order, cells } = self.grid.get_or_init(|| self.sorted());
        let of_cell = |cell: &Cell| {
            let away = cell.center - point;
            let distance = away.length();
            if distance > FAR * cell.radius {
                cell.area.dot(away) / (4.0 * PI * distance.powi(3))
            } else {
                winding_number(point, order[cell.range.clone()].iter().map(|&t| self.corners(t)))
            }
        };
        cells.iter().map(of_cell).sum()
    }

    fn sorted(&self) -> Grid {
        let [min, max] = super::bounds_of(self.positions);
        let per_unit = DIVISIONS / (max - min).max_element().max(f64::MIN_POSITIVE);
        let dims = ((max - min) * per_unit).to_array().map(|side| side as usize + 1);
        let cell_of = |t: &[u32; 3]| {
            let [x, y, z] = ((self.positions[t[0] as usize].as_dvec3() - min) * per_unit).to_array();
            (z as usize * dims[1] + y as usize) * dims[0] + x as usize
        };
        // Counting sort.
        let mut starts = vec![0; dims.iter().product::<usize>() + 1];
        self.triangles.iter().for_each(|t| starts[cell_of(t) + 1] += 1);
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0; self.triangles.len()];
        for (k, t) in self.triangles.iter().enumerate() {
            let slot = &mut next[cell_of(t)];
            order[*slot] = k as u32;
            *slot += 1;
        }
        let ranges = starts.windows(2).map(|w| w[0]..w[1]).filter(|range| !range.is_empty());
        let cells = ranges.map(|range| self.cell(&order, range)).collect();
        Grid { order, cells }
    }

    fn cell(&self, order: &[u32], range: Range<usize>) -> Cell {
        let triangles = || order[range.clone()].iter().map(|&t| self.corners(t));
        let area_of = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a);
        let (mut area, mut size, mut moment) = (DVec3::ZERO, 0.0, DVec3::ZERO);
        for corners in triangles() {
            let of_triangle = area_of(corners);
            area += of_triangle;
            size += of_triangle.length();
            moment += of_triangle.length() * corners.iter().sum::<DVec3>() / 3.0;
        }
        let center = if size > 0.0 { moment / size } else { self.corners(order[range.start])[0] };
        let radius = triangles().flatten().map(|p| p.distance(center)).fold(0.0, f64::max);
        Cell { range, center, radius, area }
    }
}
