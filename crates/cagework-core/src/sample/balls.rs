//! Correction of interpolation beside balls, the points inside a cage.
//!
//! Beside a ball of radius R, a harmonic function is `a + b/r` plus terms that vary less, where r is the distance from
//! the ball's centre. Interpolation along axes is exact for `a`. Its error for `1/r` is known: `δ` is the value of `1/r`
//! at the vertex minus its interpolated value. `b` follows from two values of the function, that of the ball and the
//! mean of the stencil's nodes: `b = (u_ball - u_nodes) / (1/R - (1/r)_nodes)`. To add `b δ`, the part
//! `δ / (1/R - (1/r)_nodes)` of the stencil's weight moves from its nodes to the ball.
//!
//! At the nodes, the solution is not a multiple of `1/r` but of the solution of the seven-point equations for the cell
//! size h. Their error, h²/12 times the sum of the fourth derivatives, is `105/12 h² Y / r^5`, with
//! `Y = n_x^4 + n_y^4 + n_z^4 - 3/5` for the direction n from the centre. Y is a spherical harmonic of degree 4, so
//! that the discrete solution with the value 1/R at r = R is `1/r + 5/8 h² Y (1/r^3 - R²/r^5)` up to higher powers of h.

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
        let near = self.blocks.near(DVec3::from_array(low.map(f64::from)));
        found.extend(near.iter().map(|&index| NearBall { index, sum: 0.0, of_nodes: 0.0 }));
    }

    /// Adds an entry of a stencil, a node or a point of the surface at `p` (cell coordinates), to the interpolated `1/r`.
    pub(super) fn add(&self, near: &mut [NearBall], p: DVec3, weight: f64, is_node: bool) {
        for ball in near {
            let error = if is_node { self.error_at_node(ball.index, p) } else { 0.0 };
            let term = weight * (self.potential(ball.index, p) + error);
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

    /// Difference between the discrete solution and `1/r` at a node. `p` in cell coordinates.
    fn error_at_node(&self, index: u32, p: DVec3) -> f64 {
        let (center, _) = self.balls[index as usize];
        let from_center = self.grid.origin + p * self.grid.cell - center;
        let r = from_center.length();
        if r <= self.radius {
            return 0.0;
        }
        let squares = (from_center / r) * (from_center / r);
        let harmonic = squares.dot(squares) - 0.6;
        let decay = (1.0 - (self.radius / r).powi(2)) / r.powi(3);
        0.625 * self.grid.cell.max_element().powi(2) * harmonic * decay
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use crate::bind::{Binding, bind};
    use crate::cage::Cage;
    use crate::cage::shapes::cube;
    use crate::controls::{ControlSet, Controls, InnerControls, InnerElement};
    use crate::options::BindOptions;
    use crate::progress::NoProgress;

    const CENTER: Vec3 = Vec3::new(0.4, 0.55, 0.6);

    /// Binds points to the unit cube with a ball of the default radius, 1/32.
    fn bound(points: &[Vec3], grid: u32) -> Binding {
        let elements = vec![InnerElement::Point(0)];
        let inner = InnerControls { positions: vec![CENTER], elements, radius: None };
        let set = ControlSet::new(&Cage::new(&cube()).unwrap(), 0, inner).unwrap();
        let options = BindOptions { grid, ..BindOptions::default() };
        bind(points, Controls::from(&set), &options, &NoProgress).unwrap()
    }

    /// Weights of a ball of two cells, half a radius from it, are those of 2 million walks on spheres from each of six
    /// such points, 0.6458 to 0.6466, within 9e-3 in each direction. With equations that are not exact for `1/r`, they
    /// miss by up to 1.6e-2.
    #[test]
    fn weights_beside_a_ball_of_two_cells_match_walks_on_spheres() {
        let direction = |k: u8| {
            let (sin, cos) = (2.4 * f32::from(k)).sin_cos();
            let z = (f32::from(k) + 0.5) / 24.0 - 1.0;
            Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
        };
        let mut directions: Vec<Vec3> = (0..48).map(direction).collect();
        directions.extend([Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::ONE.normalize()]);
        let points: Vec<Vec3> = directions.iter().map(|d| CENTER + 1.5 / 32.0 * d).collect();
        let off = bound(&points, 64).weights.column(8).map(|w| (w - 0.6462).abs()).fold(0.0, f32::max);
        assert!(off < 9e-3, "{off}");
    }

    #[test]
    fn balls_below_two_cells_have_a_notice() {
        let notice = |grid: u32| {
            let notices = bound(&[CENTER], grid).report.notices;
            notices.into_iter().find(|said| said.contains("The radius of the controls inside"))
        };
        let coarse = notice(48).unwrap();
        assert!(coarse.contains("below two cells of this grid") && coarse.contains("grid of 64"), "{coarse}");
        assert_eq!(notice(64), None);
    }
}
