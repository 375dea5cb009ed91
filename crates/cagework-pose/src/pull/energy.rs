//! What a pull needs once per binding: samples, gradients, the quadratic part of the energy.

use glam::{DVec3, Vec3};
use nalgebra::DMatrix;

use super::PullError;
use super::geodesic::Geodesic;
use super::grip::{Grip, check};
use super::samples::Probes;
use cagework_core::controls::Controls;
use cagework_core::mesh::{Bounds, TriMesh};
use cagework_core::weights::Weights;

/// A model and its cage, ready to be pulled.
pub struct Pull {
    /// Diagonal of the model's box, object units: every length below is a share of it.
    pub(super) size: f64,
    pub(super) n_vertices: usize,
    /// The cage at rest. `[n]`
    pub(super) cage: Vec<DVec3>,
    pub(super) geodesic: Geodesic,
    pub(super) probes: Probes,
    /// Rows of the weights at the samples. `[n_samples, n]`
    pub(super) sample_rows: DMatrix<f64>,
    /// Gradients of the weights at the samples: row `3 s + x`. `[3 n_samples, n]`
    gradients: DMatrix<f64>,
    /// Each edge of the cage, and of controls inside, in both directions.
    edges: Vec<[u32; 2]>,
    /// Weight of each of them: together they are as heavy as the model's part.
    edge_weight: f64,
    /// Matrices of the two parts: `sum_e w_e D_e^T D_e`. `[n, n]`
    of_model: DMatrix<f64>,
    of_cage: DMatrix<f64>,
}

impl Pull {
    /// `weights`: of [`Probes::points`], bound to the controls.
    ///
    /// # Errors
    /// [`PullError::Shape`] when they do not belong together.
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
            return Err(PullError::Shape { rows, columns, vertices, cage: n });
        }
        let size = Bounds::of(&mesh.positions).ok_or(PullError::Empty)?.diagonal();
        // A model of one point has no size of its own.
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
            probes,
            sample_rows,
            gradients,
            edges,
            edge_weight,
            of_model,
            of_cage,
        })
    }

    /// Cage vertices and controls inside.
    #[must_use]
    pub fn n_cage(&self) -> usize {
        self.cage.len()
    }

    /// Samples of the model.
    #[must_use]
    pub fn n_samples(&self) -> usize {
        self.probes.samples.len()
    }

    /// Groups with a rotation each: samples, then cage vertices.
    #[must_use]
    pub fn n_groups(&self) -> usize {
        self.n_samples() + self.n_cage()
    }

    /// The quadratic part of the energy with the cage's own part `gamma` times as heavy. `[n, n]`
    pub(super) fn matrix(&self, gamma: f64) -> DMatrix<f64> {
        &self.of_model + gamma * &self.of_cage
    }

    /// References `d_e` of all rows for a cage: its gradients, then its edges.
    pub(super) fn references(&self, cage: &[DVec3]) -> Vec<DVec3> {
        let gradient = |e: usize| {
            let row = self.gradients.row(e);
            row.iter().zip(cage).map(|(&w, &c)| w * c).sum::<DVec3>()
        };
        let edge = |&[a, b]: &[u32; 2]| cage[a as usize] - cage[b as usize];
        (0..self.gradients.nrows()).map(gradient).chain(self.edges.iter().map(edge)).collect()
    }

    /// The group of each row.
    pub(super) fn groups(&self) -> impl Iterator<Item = usize> {
        let samples = self.n_samples();
        (0..3 * samples).map(|e| e / 3).chain(self.edges.iter().map(move |[a, _]| samples + *a as usize))
    }

    /// `sum_e w_e D_e^T d_e` by groups: row i, columns `3 r` to `3 r + 2` are cage vertex i's part in group r. `[n, 3 n_groups]`,
    /// one row after the other.
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

    /// A handle on a vertex of the cage.
    ///
    /// # Errors
    /// [`PullError::Missing`].
    pub fn on_cage(&self, vertex: u32) -> Result<Grip, PullError> {
        check("vertex of the cage", vertex, self.n_cage())?;
        let mut row = vec![0.0; self.n_cage()];
        row[vertex as usize] = 1.0;
        // Walks begin at the sample that follows it most.
        let nearest = self.sample_rows.column(vertex as usize).imax();
        Ok(Grip { row, seed: self.probes.samples[nearest], is_cage: true })
    }
}
