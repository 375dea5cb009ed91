//! Precomputation once per bind: samples, gradients and the matrix of the energy E (notation: [`super`]).

use glam::{DVec3, Vec3};
use nalgebra::DMatrix;

use super::PullError;
use super::geodesic::Geodesic;
use super::grip::{Grip, check};
use super::samples::Probes;
use crate::symmetry::Symmetry;
use cagework_core::controls::Controls;
use cagework_core::mesh::{Bounds, TriMesh};
use cagework_core::weights::Weights;

/// A model and its cage, ready for pulling and fitting.
pub struct Pull {
    /// Diagonal of the model's box, object units. Lengths that are given as fractions are multiples of this size.
    pub(super) size: f64,
    pub(super) n_vertices: usize,
    /// Rest positions of cage vertices and inner controls. `[n]`
    pub(super) cage: Vec<DVec3>,
    /// Mirror images of the cage's vertices at rest.
    pub(super) symmetry: Symmetry,
    pub(super) geodesic: Geodesic,
    pub(super) probes: Probes,
    /// Weights at the samples. `[n_samples, n]`
    pub(super) sample_rows: DMatrix<f64>,
    /// Gradients of the weights at the samples; row `3 s + x` is d/dx at sample s. `[3 n_samples, n]`
    gradients: DMatrix<f64>,
    /// Edges of the cage and of inner controls, in both directions.
    edges: Vec<[u32; 2]>,
    /// Weight of each edge, such that the weighted sum of squared edge lengths at rest is 3, the same as for the
    /// samples' gradients.
    edge_weight: f64,
    /// The sum `sum_e w_e D_e^T D_e` over the model's rows, and the same sum over the cage's edges. `[n, n]`
    of_model: DMatrix<f64>,
    of_cage: DMatrix<f64>,
}

impl Pull {
    /// Prepares a model and its cage. `weights`: weights of the controls at [`Probes::points`].
    ///
    /// # Errors
    /// [`PullError::Shape`] if `weights` do not have one row per probe and one column per control.
    pub fn new<'a>(
        mesh: &TriMesh,
        controls: impl Into<Controls<'a>>,
        mut probes: Probes,
        weights: &Weights,
    ) -> Result<Self, PullError> {
        let controls = controls.into();
        let (n, cage) = (controls.n_controls(), controls.cage());
        let (rows, columns, vertices) = (weights.n_rows(), weights.n_columns(), probes.points().len());
        if (rows, columns) != (vertices, n) {
            return Err(PullError::Shape { rows, columns, vertices, controls: n });
        }
        let size = Bounds::around(&mesh.positions).ok_or(PullError::Empty)?.diagonal();
        // A model that is a single point has no size: use the cage's.
        let size = if size > 0.0 { size } else { cage.diagonal() };
        let rest: Vec<DVec3> = controls.rest().iter().copied().map(Vec3::as_dvec3).collect();
        let sample_rows = probes.rows(weights);
        let rows = probes.gradients(weights, &rest);
        let gradients = DMatrix::from_fn(rows.len(), n, |e, i| rows[e][i]);
        let mut edges: Vec<[u32; 2]> =
            cage.triangles().iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        edges.extend(controls.inner_edges());
        edges.extend(edges.clone().into_iter().map(|[a, b]| [b, a]));
        edges.sort_unstable();
        edges.dedup();
        let squared = |[a, b]: &[u32; 2]| rest[*a as usize].distance_squared(rest[*b as usize]);
        let edge_weight = 3.0 / edges.iter().map(squared).sum::<f64>();
        let mut heavy = gradients.clone();
        for (e, mut row) in heavy.row_iter_mut().enumerate() {
            row *= probes.shares[e / 3];
        }
        let of_model = gradients.transpose() * heavy;
        let mut of_cage = DMatrix::zeros(n, n);
        for &[a, b] in &edges {
            let [a, b] = [a as usize, b as usize];
            for (i, j, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
                of_cage[(i, j)] += sign * edge_weight;
            }
        }
        Ok(Self {
            size: f64::from(size),
            n_vertices: mesh.positions.len(),
            geodesic: Geodesic::new(&mesh.positions, &mesh.triangles, size),
            cage: rest,
            symmetry: Symmetry::new(controls.rest()),
            probes,
            sample_rows,
            gradients,
            edges,
            edge_weight,
            of_model,
            of_cage,
        })
    }

    /// Number of cage vertices and inner controls.
    #[must_use]
    pub fn n_cage(&self) -> usize {
        self.cage.len()
    }

    /// Number of sample points on the model ([`Probes`]).
    #[must_use]
    pub fn n_samples(&self) -> usize {
        self.probes.samples.len()
    }

    /// Number of groups that rotate as one: a group per sample, then a group per cage vertex.
    #[must_use]
    pub fn n_groups(&self) -> usize {
        self.n_samples() + self.n_cage()
    }

    /// Matrix of the energy E, with the terms of the cage's edges weighted by `gamma`. `[n, n]`
    pub(super) fn matrix(&self, gamma: f64) -> DMatrix<f64> {
        &self.of_model + gamma * &self.of_cage
    }

    /// Computes the vectors `d_e` of a reference cage: gradients at the samples, then edges. E measures how far the
    /// vectors `D_e c` of a pose are from rotations of `d_e`.
    pub(super) fn references(&self, cage: &[DVec3]) -> Vec<DVec3> {
        let gradient = |e: usize| {
            let row = self.gradients.row(e);
            row.iter().zip(cage).map(|(&w, &c)| w * c).sum::<DVec3>()
        };
        let edge = |&[a, b]: &[u32; 2]| cage[a as usize] - cage[b as usize];
        (0..self.gradients.nrows()).map(gradient).chain(self.edges.iter().map(edge)).collect()
    }

    pub(super) fn groups(&self) -> impl Iterator<Item = usize> {
        let samples = self.n_samples();
        (0..3 * samples).map(|e| e / 3).chain(self.edges.iter().map(move |[a, _]| samples + *a as usize))
    }

    /// Computes the sum `sum_e w_e D_e^T d_e` of each group: columns `3 r` to `3 r + 2` of row i are the moment of cage
    /// vertex i and group r. `[n, 3 n_groups]`, row-major.
    pub(super) fn moments(&self, references: &[DVec3], gamma: f64) -> Vec<f64> {
        let width = 3 * self.n_groups();
        let mut moments = vec![0.0; self.n_cage() * width];
        let mut add = |vertex: usize, group: usize, d: DVec3| {
            let at = vertex * width + 3 * group;
            moments[at..at + 3].iter_mut().zip(d.to_array()).for_each(|(m, d)| *m += d);
        };
        let (model, cage) = references.split_at(self.gradients.nrows());
        for (e, &d) in model.iter().enumerate() {
            for (i, &w) in self.gradients.row(e).iter().enumerate() {
                add(i, e / 3, w * self.probes.shares[e / 3] * d);
            }
        }
        for (&[a, b], &d) in self.edges.iter().zip(cage) {
            let d = gamma * self.edge_weight * d;
            let group = self.n_samples() + a as usize;
            add(a as usize, group, d);
            add(b as usize, group, -d);
        }
        moments
    }

    /// Creates a grip on a control: a cage vertex or, if the index is at least the number of cage vertices, an inner
    /// control.
    ///
    /// # Errors
    /// [`PullError::Missing`] if there is no such control.
    pub fn on_cage(&self, vertex: u32) -> Result<Grip, PullError> {
        check("vertex of the cage", vertex, self.n_cage())?;
        let mut row = vec![0.0; self.n_cage()];
        row[vertex as usize] = 1.0;
        // Surface distances start at the sample with the largest weight of this vertex.
        let nearest = self.sample_rows.column(vertex as usize).imax();
        Ok(Grip { row, seed: self.probes.samples[nearest], is_cage: true })
    }
}
