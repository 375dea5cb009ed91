//! A slice through the grid for display: cell kinds, and harmonic coordinates at the cell centres.
//!
//! Values come from a bind ([`crate::bind()`]) with [`Slice::centers`] as mesh, so they equal the weights of a mesh
//! vertex at the same place.

use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::bind::{fineness, updates};
use crate::controls::Controls;
use crate::grid::Grid;
use crate::levels::Boundary as _;
use crate::narrow::NarrowPlaces;
use crate::options::{BindOptions, Method};
use crate::voxelize::CellKind;
use crate::voxelize::classic::{place_grid, voxelize_classic};
use crate::voxelize::embedded::{Cells, shoot_lines, votes};
use crate::weights::Weights;

/// A layer of cells normal to an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Axis to which the layer is normal: 0 is x, 1 is y, 2 is z.
    pub axis: usize,
    /// Index of the layer along [`Self::axis`], from 0 at the lower end of the grid.
    pub layer: u32,
    /// Numbers of cells along [`Self::u`] and [`Self::v`].
    pub dims: [u32; 2],
    /// Corner at which the first cell of the slice begins, in the plane of the cell centres, object units.
    pub corner: Vec3,
    /// Edge vector of a cell along the axis that follows [`Self::axis`] in cyclic order (y after x, z after y, x after
    /// z), object units.
    pub u: Vec3,
    /// Edge vector of a cell along the remaining axis.
    pub v: Vec3,
    /// Kind of each cell, u fastest; no cell is [`CellKind::Untyped`]. `[dims[1], dims[0]]`
    pub kinds: Vec<CellKind>,
    /// Indices of the cells that are not exterior, ascending: the rows of [`Self::weights`].
    pub cells: Vec<u32>,
    /// Harmonic coordinates at the centres of [`Self::cells`]; `None` before [`Self::set_weights`]. `[n_cells, n_cage]`
    pub weights: Option<Weights>,
}

/// The weights have the wrong number of rows for the slice.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the slice has {cells} cells inside the cage, but there are {rows} rows of weights")]
pub struct SliceError {
    /// Number of cells of the slice.
    pub cells: usize,
    /// Number of rows of the weights.
    pub rows: usize,
}

impl Slice {
    /// Creates the layer at `fraction` (0 to 1) of the length along `axis`, in the grid of a bind with `options`.
    ///
    /// # Panics
    /// If `axis` is above 2.
    #[must_use]
    pub fn new<'a>(
        controls: impl Into<Controls<'a>>,
        options: &BindOptions,
        axis: usize,
        fraction: f32,
    ) -> Self {
        let controls = controls.into();
        let cage = controls.surface();
        let work = |options: &BindOptions| updates(controls, options);
        let cells = fineness::choose(options, &NarrowPlaces::new(controls), |_| true, work).cells;
        match options.method {
            Method::Embedded => {
                let grid = Grid::cubic(cage.bounds(), cells);
                let lines = shoot_lines(cage, &grid);
                let cells = Cells::finest(&lines, grid, &votes(&lines, &grid));
                let cells = cells.with(controls, &lines);
                Self::of(&grid, axis, fraction, |cell| match cells.unknowns()[grid.index(cell)] {
                    false => CellKind::Exterior,
                    true if cells.cut_arms()[grid.index(cell)] != 0 => CellKind::Boundary,
                    true => CellKind::Interior,
                })
            }
            Method::Classic => {
                let (dims, origin, cell) = place_grid(cage, cells);
                let grid = Grid { dims: dims.to_array(), origin, cell };
                let cells = voxelize_classic(controls, cells);
                Self::of(&grid, axis, fraction, |cell| cells.kinds[grid.index(cell)])
            }
        }
    }

    fn of(grid: &Grid, axis: usize, fraction: f32, kind: impl Fn([u32; 3]) -> CellKind) -> Self {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let last = grid.dims[axis] - 1;
        let layer = (fraction.clamp(0.0, 1.0) * grid.dims[axis] as f32).min(last as f32) as u32;
        let dims = [grid.dims[u], grid.dims[v]];
        let at = |i: u32, j: u32| {
            let mut cell = [layer; 3];
            (cell[u], cell[v]) = (i, j);
            cell
        };
        let kinds: Vec<CellKind> = (0..dims[1])
            .flat_map(|j| (0..dims[0]).map(move |i| (i, j)))
            .map(|(i, j)| kind(at(i, j)))
            .collect();
        let edge = |axis: usize| {
            DVec3::from_array(std::array::from_fn(|a| f64::from(u8::from(a == axis)))) * grid.cell
        };
        let cells = (0..kinds.len() as u32).filter(|&c| kinds[c as usize] != CellKind::Exterior).collect();
        Self {
            axis,
            layer,
            dims,
            corner: (grid.center(at(0, 0)) - 0.5 * (edge(u) + edge(v))).as_vec3(),
            u: edge(u).as_vec3(),
            v: edge(v).as_vec3(),
            kinds,
            cells,
            weights: None,
        }
    }

    /// Centres of [`Self::cells`], object units: the mesh to bind.
    #[must_use]
    pub fn centers(&self) -> Vec<Vec3> {
        let n = self.dims[0];
        let center =
            |&c: &u32| self.corner + ((c % n) as f32 + 0.5) * self.u + ((c / n) as f32 + 0.5) * self.v;
        self.cells.iter().map(center).collect()
    }

    /// Stores the weights of a bind of [`Self::centers`].
    ///
    /// # Errors
    /// [`SliceError`] if there is not one row per cell.
    pub fn set_weights(&mut self, weights: Weights) -> Result<(), SliceError> {
        if weights.n_rows() != self.cells.len() {
            return Err(SliceError { cells: self.cells.len(), rows: weights.n_rows() });
        }
        self.weights = Some(weights);
        Ok(())
    }

    /// Values of a column, 0 in exterior cells; `None` without weights. `[dims[1], dims[0]]`
    #[must_use]
    pub fn values(&self, column: u32) -> Option<Vec<f32>> {
        let weights = self.weights.as_ref()?;
        let mut values = vec![0.0; self.kinds.len()];
        for (&cell, value) in self.cells.iter().zip(weights.column(column)) {
            values[cell as usize] = value;
        }
        Some(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cage::Cage;
    use crate::cage::subdivided_box;
    use crate::mesh::Bounds;
    use crate::progress::NoProgress;

    fn box_cage() -> Cage {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 2.0, 4.0) };
        Cage::new(&subdivided_box(bounds, 0.0, [1, 1, 1])).unwrap()
    }

    fn options(method: Method) -> BindOptions {
        BindOptions { grid: 16, method, ..BindOptions::default() }
    }

    #[test]
    fn middle_of_a_box_is_interior_within_one_ring_of_boundary() {
        let slice = Slice::new(&box_cage(), &options(Method::Embedded), 0, 0.5);
        // g = 16 along z gives cells of 1/4: 8 x 16 of them inside, minus the ring next to the cage.
        let count = |kind| slice.kinds.iter().filter(|&&k| k == kind).count();
        assert_eq!((count(CellKind::Interior), count(CellKind::Boundary)), (6 * 14, 8 * 16 - 6 * 14));
        assert_eq!((slice.cells.len(), slice.u, slice.v), (8 * 16, 0.25 * Vec3::Y, 0.25 * Vec3::Z));
    }

    #[test]
    fn centres_lie_in_the_plane_of_the_layer_and_inside() {
        for method in [Method::Embedded, Method::Classic] {
            for axis in 0..3 {
                let slice = Slice::new(&box_cage(), &options(method), axis, 0.3);
                let centers = slice.centers();
                assert!(!centers.is_empty());
                let size = Vec3::new(1.0, 2.0, 4.0);
                assert!(centers.iter().all(|p| p[axis] == slice.corner[axis]));
                assert!(centers.iter().all(|p| p.min_element() > -0.02 && (size - *p).min_element() > -0.02));
            }
        }
    }

    #[test]
    fn ends_are_the_first_and_the_last_layer() {
        let at = |fraction| Slice::new(&box_cage(), &options(Method::Embedded), 2, fraction).layer;
        assert_eq!((at(-1.0), at(0.0)), (0, 0));
        assert!(at(1.0) == at(2.0) && at(1.0) >= 16);
    }

    /// Harmonic coordinates of a box are trilinear: products of three fractions.
    #[test]
    fn values_are_the_harmonic_coordinates() {
        let cage = box_cage();
        let options = options(Method::Embedded);
        let mut slice = Slice::new(&cage, &options, 1, 0.4);
        assert_eq!(slice.values(0), None);
        let centers = slice.centers();
        let weights = crate::bind(&centers, &cage, &options, &NoProgress).unwrap().weights;
        assert!(slice.set_weights(weights.with_rows(&[0])).is_err());
        slice.set_weights(weights).unwrap();
        for column in [0, 5] {
            let corner = cage.positions()[column as usize] / Vec3::new(1.0, 2.0, 4.0);
            let values = slice.values(column).unwrap();
            for (&cell, p) in slice.cells.iter().zip(&centers) {
                let t = *p / Vec3::new(1.0, 2.0, 4.0);
                let expected = (Vec3::ONE - (t - corner).abs()).to_array().iter().product::<f32>();
                // tau = 1e-5 bounds the RMS error over cells; the error of a single cell may be larger.
                assert!((values[cell as usize] - expected).abs() < 1e-4);
            }
            let outside = (0..slice.kinds.len()).filter(|&c| slice.kinds[c] == CellKind::Exterior);
            assert!(outside.map(|c| values[c]).all(|v| v == 0.0));
        }
    }
}
