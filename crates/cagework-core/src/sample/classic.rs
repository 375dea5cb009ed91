//! Sampling as in K. Smith's paper (`docs/method.md`, sources): a mesh vertex takes the weights of the cell that
//! contains it.
//!
//! The paper does not define weights in exterior cells: a vertex there counts as outside the cage.

use std::cell::LazyCell;

use glam::DVec3;

use crate::controls::Controls;
use crate::levels::Level;
use crate::options::OutsidePolicy;
use crate::voxelize::classic::{CellKind, ClassicCells};

use super::outside::OutsideSampler;
use super::{Stencil, Stencils};

/// Stencils of points (object units). A point in an interior or boundary cell takes the weights of this cell.
#[must_use]
pub fn stencils(
    controls: Controls<'_>,
    cells: &ClassicCells,
    level: &Level,
    policy: OutsidePolicy,
    points: impl Iterator<Item = DVec3>,
) -> Stencils {
    let inside = |point: DVec3, stencil: &mut Stencil| {
        stencil.clear();
        let p = level.grid.to_grid(point).round();
        let in_grid = (0..3).all(|a| p[a] >= 0.0 && p[a] < f64::from(level.grid.dims[a]));
        let cell = in_grid.then(|| level.grid.index(p.to_array().map(|x| x as u32)));
        match cell.map(|c| (c, cells.kinds[c])) {
            Some((cell, CellKind::Interior)) => stencil.add_node(level.row_of[cell], 1.0),
            Some((cell, CellKind::Boundary)) => {
                let row = cells.boundary.row_of(cell as u32).expect("every boundary cell has values");
                let (columns, values) = cells.boundary.row(row);
                for (&column, &value) in columns.iter().zip(values) {
                    stencil.add_hat(column, f64::from(value));
                }
            }
            _ => return false,
        }
        true
    };
    let (mut stencils, mut stencil) = (Stencils::new(), Stencil::default());
    let beyond = LazyCell::new(|| OutsideSampler::new(controls, policy));
    for point in points {
        if inside(point, &mut stencil) {
            stencils.push(&stencil);
        } else {
            let found = beyond.fill(point, &mut stencil, inside);
            stencils.push_outside(controls, found, &stencil);
        }
    }
    stencils
}
