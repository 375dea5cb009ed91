//! Correction of interpolation beside balls, the points inside a cage.
//!
//! Beside a ball of radius R, a harmonic function is `a + b/r` plus terms that vary less, where r is the distance from
//! the ball's centre. Interpolation along axes is exact for `a`. Its error for `1/r` is known: `δ` is the value of `1/r`
//! at the vertex minus its interpolated value. `b` follows from two values of the function, that of the ball and the
//! mean of the stencil's nodes: `b = (u_ball - u_nodes) / (1/R - (1/r)_nodes)`. To add `b δ`, the part
//! `δ / (1/R - (1/r)_nodes)` of the stencil's weight moves from its nodes to the ball.

use glam::DVec3;

use crate::controls::Controls;
use crate::grid::Grid;

use super::Stencil;
use super::triangles::Blocks;

/// Distance from a ball, in cells, at which its correction starts to fade, and at which it ends.
const FADE: [f64; 2] = [2.0, 4.0];

/// The balls of a bind by blocks of cells.
#[derive(Debug)]
pub(super) struct Balls<'a> {
    grid: &'a Grid,
    /// Centre, object units, and column of each ball.
    balls: Vec<(DVec3, u32)>,
    /// Radius, object units.
    radius: f64,
    blocks: Blocks,
}

/// A ball near a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearBall {
    index: u32,
    /// `1/r` interpolated by the stencil.
    sum: f64,
    /// The part of `sum` that comes from the stencil's nodes.
    of_nodes: f64,
}

impl<'a> Balls<'a> {
    pub(super) fn new(controls: Controls<'_>, grid: &'a Grid) -> Self {
        let first = controls.cage().n_vertices() as u32;
        let balls: Vec<(DVec3, u32)> = controls.inner().map_or_else(Vec::new, |inner| {
            inner.balls().map(|i| (inner.positions[i as usize].as_dvec3(), first + i)).collect()
        });
        let radius = controls.inner_radius().map_or(0.0, f64::from);
        let reach = DVec3::splat(radius) / grid.cell + FADE[1];
        let blocks =
            Blocks::new(grid, balls.iter().map(|(c, _)| grid.to_grid(*c)).map(|c| (c - reach, c + reach)));
        Self { grid, balls, radius, blocks }
    }

    /// Lists the balls that may be near the cube between centre `low` and centre `low + 1`.
    pub(super) fn near(&self, low: [u32; 3], found: &mut Vec<NearBall>) {
        found.clear();
        if self.balls.is_empty() {
            return;
        }
        self.blocks.near(low, |index| {
            if found.iter().all(|ball| ball.index != index) {
                found.push(NearBall { index, sum: 0.0, of_nodes: 0.0 });
            }
        });
    }

    /// Adds an entry of a stencil, a node or a point of the surface at `p` (cell coordinates), to the interpolated `1/r`.
    pub(super) fn add(&self, near: &mut [NearBall], p: DVec3, weight: f64, is_node: bool) {
        for ball in near {
            let term = weight * self.potential(ball.index, p);
            ball.sum += term;
            ball.of_nodes += if is_node { term } else { 0.0 };
        }
    }

    /// Corrects the stencil of the vertex at `p`, cell coordinates.
    pub(super) fn correct(&self, near: &[NearBall], p: DVec3, stencil: &mut Stencil) {
        let of_nodes: f64 = stencil.nodes.iter().map(|(_, w)| w).sum();
        let mut left = 1.0;
        for ball in near {
            let (center, column) = self.balls[ball.index as usize];
            let cells = ((p - self.grid.to_grid(center)) * self.grid.cell).length() - self.radius;
            let fade =
                ((FADE[1] - cells / self.grid.cell.max_element()) / (FADE[1] - FADE[0])).clamp(0.0, 1.0);
            let slope = of_nodes / self.radius - ball.of_nodes;
            if fade > 0.0 && slope > 0.0 {
                let share = fade * (self.potential(ball.index, p) - ball.sum) / slope;
                left -= share;
                stencil.add_hat(column, share * of_nodes);
            }
        }
        stencil.nodes.iter_mut().for_each(|(_, w)| *w *= left);
    }

    /// `1/r`, and `1/R` inside the ball. `p` in cell coordinates.
    fn potential(&self, index: u32, p: DVec3) -> f64 {
        let (center, _) = self.balls[index as usize];
        let place = self.grid.origin + p * self.grid.cell;
        1.0 / place.distance(center).max(self.radius)
    }
}
