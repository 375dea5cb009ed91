//! Controls: the columns of the weights and their boundary values.
//!
//! Each *control* is a column, with a rest position `c_j`, that the user moves. The *surface* is the closed polygon
//! mesh on which values are prescribed and where grid lines and rays end; its vertices are `s_k`. The *rows* are a
//! matrix B, `[n_surface, n_controls]`, non-negative with row sums 1: at a point of the surface, control j has the
//! value `sum_k hat_k B_kj` with the hats of [`Cage::hats_at`]. Weights reproduce positions, `sum_j w_j c_j = x`,
//! wherever `s_k = sum_j B_kj c_j`. For a plain cage the controls are the surface's vertices and B is the identity.

mod inner;
mod set;
mod shapes;

use glam::{DVec3, Vec3};

use crate::cage::Cage;
use crate::weights::Weights;

pub use inner::{ControlError, InnerControls, InnerElement, MAX_RADIUS};
pub use set::ControlSet;

/// The controls of a bind.
#[derive(Clone, Copy, Debug)]
pub struct Controls<'a> {
    cage: &'a Cage,
    rest: &'a [Vec3],
    surface: &'a Cage,
    /// Matrix B; `None` for the identity.
    rows: Option<&'a Weights>,
    /// Cage face of each face of the surface, `None` for an inner wall. The outer option is `None` if the surface is
    /// the cage.
    origins: Option<&'a [Option<u32>]>,
    set: Option<&'a ControlSet>,
}

impl<'a> From<&'a Cage> for Controls<'a> {
    /// A plain cage: each of its vertices is a control.
    fn from(cage: &'a Cage) -> Self {
        Self { cage, rest: cage.positions(), surface: cage, rows: None, origins: None, set: None }
    }
}

impl<'a> Controls<'a> {
    /// Copies these controls into an owned set.
    #[must_use]
    pub fn to_set(&self) -> ControlSet {
        self.set.cloned().unwrap_or_else(|| ControlSet::plain(self.cage))
    }

    /// Number of controls, which are the first columns of the weights.
    #[must_use]
    pub fn n_controls(&self) -> usize {
        self.rest.len()
    }

    /// Rest positions: the cage's vertices, then the inner controls. `[n_controls]`, object units.
    #[must_use]
    pub fn rest(&self) -> &'a [Vec3] {
        self.rest
    }

    /// The cage whose vertices are the first controls.
    #[must_use]
    pub fn cage(&self) -> &'a Cage {
        self.cage
    }

    /// The surface on which values are prescribed.
    #[must_use]
    pub fn surface(&self) -> &'a Cage {
        self.surface
    }

    /// Steps of subdivision from the cage to the surface.
    #[must_use]
    pub fn smooth(&self) -> u32 {
        self.set.map_or(0, ControlSet::smooth)
    }

    /// Inner controls, if any.
    #[must_use]
    pub fn inner(&self) -> Option<&'a InnerControls> {
        self.set.map(ControlSet::inner).filter(|inner| !inner.positions.is_empty())
    }

    /// As [`ControlSet::reaching`].
    pub(crate) fn reaching(&self) -> &'a [u32] {
        self.set.map_or(&[], ControlSet::reaching)
    }

    /// As [`ControlSet::distance_of_reaching`]; infinite if nothing reaches through.
    pub(crate) fn distance_of_reaching(&self) -> f64 {
        self.set.map_or(f64::INFINITY, ControlSet::distance_of_reaching)
    }

    /// Radius of balls and tubes, object units; `None` without inner controls.
    #[must_use]
    pub fn inner_radius(&self) -> Option<f32> {
        self.inner().map(|inner| inner.radius_in(self.surface.bounds().extent().max_element()))
    }

    /// Returns the edges of the inner controls, and three edges from each inner control to the nearest cage triangle,
    /// so that all controls are connected.
    #[must_use]
    pub fn inner_edges(&self) -> Vec<[u32; 2]> {
        let Some(inner) = self.inner() else { return Vec::new() };
        let first = self.cage.n_vertices() as u32;
        let mut edges: Vec<[u32; 2]> = inner
            .elements
            .iter()
            .flat_map(|e| e.corners().windows(2))
            .map(|w| [first + w[0], first + w[1]])
            .collect();
        for (number, p) in (first..).zip(&inner.positions) {
            edges.extend(set::nearest_triangle(self.cage, p.as_dvec3()).map(|i| [number, i]));
        }
        edges
    }

    /// Cage face of a face of the surface; `None` for an inner wall.
    #[must_use]
    pub fn cage_face(&self, face: u32) -> Option<u32> {
        self.origins.map_or(Some(face), |origins| origins[face as usize])
    }

    /// Center of the ball to which a facet of the surface belongs, object units.
    pub(crate) fn ball_center(&self, facet: u32) -> Option<DVec3> {
        let inner = self
            .inner()
            .filter(|_| self.cage_face(self.surface.face_of_facet()[facet as usize]).is_none())?;
        let mut control = None;
        // All corners of a ball have the value 1 of its control.
        self.values_at(facet, [1.0, 0.0, 0.0], &mut |column, value| {
            control = (value == 1.0).then_some(column).or(control);
        });
        let ball = control?.checked_sub(self.cage.n_vertices() as u32)?;
        inner.balls().any(|b| b == ball).then(|| inner.positions[ball as usize].as_dvec3())
    }

    /// Computes the Dirichlet values at a point of the surface, given by one of the surface's facets (`triangle`, see
    /// [`Cage::facets`]) and barycentric coordinates in it. Calls `each(control, value)` for non-zero values, possibly
    /// several times per control. All values sum to 1.
    ///
    /// # Panics
    /// If there is no such facet.
    #[inline]
    pub fn values_at(&self, triangle: u32, barycentric: [f64; 3], each: &mut dyn FnMut(u32, f64)) {
        let Some(rows) = self.rows else { return self.surface.hats_at(triangle, barycentric, each) };
        self.surface.hats_at(triangle, barycentric, &mut |vertex, hat| {
            let (controls, shares) = rows.row(vertex as usize);
            for (&control, &share) in controls.iter().zip(shares) {
                each(control, hat * f64::from(share));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bind::bind;
    use crate::cage::subdivided_box;
    use crate::mesh::Bounds;
    use crate::options::BindOptions;
    use crate::progress::NoProgress;

    /// Largest error that f32 rounding and the solver's tolerance cause together.
    const ROUNDING: f32 = 2e-5;

    /// Trilinear coordinates of a point in the unit cube: 8 corners, x fastest.
    fn trilinear(p: Vec3) -> [f32; 8] {
        std::array::from_fn(|corner| {
            (0..3).map(|a| if corner >> a & 1 == 1 { p[a] } else { 1.0 - p[a] }).product()
        })
    }

    /// A box with nine quads on each side, whose surface takes the values of the eight corners by rows of B. The
    /// harmonic function with these values is trilinear. On the small quads it is bilinear, as their hats are.
    #[test]
    fn rows_mix_the_values_of_the_surface() {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let surface = Cage::new(&subdivided_box(bounds, 0.0, [3, 3, 3])).unwrap();
        let rest: Vec<Vec3> =
            (0..8).map(|c| Vec3::new((c & 1) as f32, (c >> 1 & 1) as f32, (c >> 2) as f32)).collect();
        let n = surface.n_vertices() as u32;
        let indptr = (0..=n).map(|row| 8 * row).collect();
        let data = surface.positions().iter().flat_map(|&p| trilinear(p)).collect();
        let rows = Weights::new(8, indptr, (0..n).flat_map(|_| 0..8).collect(), data).unwrap();
        let cage = Cage::new(&subdivided_box(bounds, 0.0, [1, 1, 1])).unwrap();
        let origins = vec![Some(0); surface.faces().len()];
        let controls = Controls {
            cage: &cage,
            rest: &rest,
            surface: &surface,
            rows: Some(&rows),
            origins: Some(&origins),
            set: None,
        };

        let points: Vec<Vec3> = (1..60)
            .map(|k| {
                let k = k as f32;
                Vec3::new(0.5 + 0.45 * k.sin(), 0.5 + 0.45 * (2.0 * k).cos(), k / 60.0)
            })
            .collect();
        let options = BindOptions { grid: 16, tau: 1e-7, ..BindOptions::default() };
        let binding = bind(&points, controls, &options, &NoProgress).unwrap();
        assert_eq!(binding.weights.n_columns(), 8);
        assert!(binding.report.raw_error.unwrap().point_rel.max < f64::from(ROUNDING));
        for (v, p) in points.iter().enumerate() {
            let (columns, weights) = binding.weights.row(v);
            for (c, expected) in trilinear(*p).into_iter().enumerate() {
                let w = columns.iter().position(|&k| k as usize == c).map_or(0.0, |k| weights[k]);
                assert!((w - expected).abs() < ROUNDING, "vertex {v}, control {c}: {w}, not {expected}");
            }
        }
    }
}
