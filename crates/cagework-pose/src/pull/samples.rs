//! Samples of the model at which a pull measures the deformation, and probe points for gradients of the weights there.

use glam::{DMat3, DVec3, Vec3};
use nalgebra::DMatrix;

use super::{MAX_CONTROLS, PullError};
use cagework_core::controls::Controls;
use cagework_core::mesh::{Bounds, TriMesh};
use cagework_core::weights::Weights;

/// Number of samples. With 300, the energy of a pull ([`super`]) differs by at most 1 % from its value with 600.
const N_SAMPLES: usize = 300;

/// Longest side of the cage's box divided by the distance of a probe from its sample.
const STEPS_PER_EXTENT: f32 = 64.0;

/// Number of probe points per sample, including the sample.
const PROBES_PER_SAMPLE: usize = 7;

/// A sample is used if no entry of its Jacobian differs by more than this from the identity. A probe far outside the
/// cage does not move with the cage, which makes the Jacobian wrong.
const MAX_JACOBIAN_ERROR: f64 = 0.5;

/// Samples of a model with probe points for central differences.
#[derive(Clone, Debug)]
pub struct Probes {
    /// Farthest-point samples: vertices of the model. `[n_samples]`
    pub(super) samples: Vec<u32>,
    /// Share of the model's area that is nearer to each sample than to the others; 0 for samples that are not used
    /// ([`Self::gradients`]). `[n_samples]`
    pub(super) shares: Vec<f64>,
    /// Share of the model's area at each vertex; sums to 1. `[n_vertices]`
    pub(super) areas: Vec<f64>,
    /// Distance of a probe from its sample, object units.
    step: f32,
    /// Each sample followed by six probes: +x, +y, +z, -x, -y, -z. `[7 * n_samples]`
    points: Vec<Vec3>,
}

impl Probes {
    /// Samples `mesh`. `controls`: the controls at rest.
    ///
    /// # Errors
    /// [`PullError::Empty`], [`PullError::Controls`], or [`PullError::Missing`] if a triangle has an invalid corner.
    pub fn new<'a>(mesh: &TriMesh, controls: impl Into<Controls<'a>>) -> Result<Self, PullError> {
        let controls = controls.into();
        if controls.n_controls() > MAX_CONTROLS {
            return Err(PullError::Controls { controls: controls.n_controls() });
        }
        let cage = controls.cage();
        let positions = &mesh.positions;
        let last = positions.len().checked_sub(1).ok_or(PullError::Empty)?;
        if let Some(&index) = mesh.triangles.as_flattened().iter().find(|&&v| v as usize > last) {
            return Err(PullError::Missing { what: "vertex", index, last });
        }
        let areas = areas(mesh);
        let (samples, nearest) = farthest_points(positions).ok_or(PullError::Empty)?;
        let mut shares = vec![0.0; samples.len()];
        for (area, sample) in areas.iter().zip(nearest) {
            shares[sample as usize] += area;
        }
        let step = cage.bounds().extent().max_element() / STEPS_PER_EXTENT;
        let around = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        let points =
            samples.iter().flat_map(|&s| around.map(|way| positions[s as usize] + step * way)).collect();
        Ok(Self { samples, shares, areas, step, points })
    }

    /// Points to bind for [`super::Pull::new`]. `[7 * n_samples]`
    #[must_use]
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// Weights at the samples. `[n_samples, n]`
    pub(super) fn rows(&self, weights: &Weights) -> DMatrix<f64> {
        let rows: Vec<_> = (0..self.samples.len()).map(|s| dense(weights, PROBES_PER_SAMPLE * s)).collect();
        DMatrix::from_fn(rows.len(), weights.n_columns(), |s, i| rows[s][i])
    }

    /// Computes the gradients of the weights at the samples by central differences, corrected so that the positions
    /// `cage` (`[n]`, at rest) have the identity as their Jacobian. Row `3 s + x` is d/dx at sample s. If a probe is
    /// too far outside the cage, the sample's rows and share are zero. `[3 * n_samples, n]`
    pub(super) fn gradients(&mut self, weights: &Weights, cage: &[DVec3]) -> Vec<Vec<f64>> {
        let n = cage.len();
        let scale = 0.5 / f64::from(self.step);
        let mut all = Vec::with_capacity(3 * self.samples.len());
        for s in 0..self.samples.len() {
            let raw = [0, 1, 2].map(|x| {
                let [after, before] = [1, 4].map(|first| dense(weights, PROBES_PER_SAMPLE * s + first + x));
                after.iter().zip(before).map(|(a, b)| scale * (a - b)).collect::<Vec<f64>>()
            });
            // Row x of the Jacobian: derivative of the position with respect to x.
            let jacobian = raw.each_ref().map(|g| g.iter().zip(cage).map(|(&w, &c)| w * c).sum::<DVec3>());
            let off = jacobian.iter().zip(DMat3::IDENTITY.to_cols_array_2d());
            let is_near =
                |(a, b): (&DVec3, [f64; 3])| (*a - DVec3::from(b)).abs().max_element() <= MAX_JACOBIAN_ERROR;
            if !off.into_iter().all(is_near) {
                self.shares[s] = 0.0;
                all.extend([const { Vec::new() }; 3].map(|_: Vec<f64>| vec![0.0; n]));
                continue;
            }
            let inverse = DMat3::from_cols(jacobian[0], jacobian[1], jacobian[2]).transpose().inverse();
            // Replace the gradients G by (G C)^-1 G, with the rest positions C.
            all.extend([0, 1, 2].map(|x| {
                let mix = inverse.row(x);
                (0..n)
                    .map(|i| mix.x * raw[0][i] + mix.y * raw[1][i] + mix.z * raw[2][i])
                    .collect::<Vec<f64>>()
            }));
        }
        all
    }
}

/// A row of the weights as a dense vector. `[n]`
pub(super) fn dense(weights: &Weights, row: usize) -> Vec<f64> {
    let mut dense = vec![0.0; weights.n_columns()];
    let (columns, values) = weights.row(row);
    columns.iter().zip(values).for_each(|(&c, &w)| dense[c as usize] = f64::from(w));
    dense
}

/// Computes the share of the area at each vertex: a third of the area of the vertex's triangles. Uniform if the model
/// has no area.
fn areas(mesh: &TriMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
        let area = (b - a).cross(c - a).length();
        triangle.iter().for_each(|&v| areas[v as usize] += area);
    }
    let most = areas.iter().copied().fold(0.0, f64::max);
    let least = if most > 0.0 { 1e-12 * most } else { 1.0 };
    areas.iter_mut().for_each(|area| *area += least);
    let sum: f64 = areas.iter().sum();
    areas.iter_mut().for_each(|area| *area /= sum);
    areas
}

/// Samples vertices by farthest-point sampling (Gonzalez 1985). Returns the samples, and the nearest sample of each
/// vertex. `None` without vertices.
fn farthest_points(positions: &[Vec3]) -> Option<(Vec<u32>, Vec<u32>)> {
    let center = Bounds::around(positions)?.center();
    let farthest = |distances: &[f32]| {
        distances.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0))).map(|(i, _)| i)
    };
    let mut distances: Vec<f32> = positions.iter().map(|p| p.distance_squared(center)).collect();
    let mut next = farthest(&distances)?;
    distances.fill(f32::INFINITY);
    let mut nearest = vec![0; positions.len()];
    let mut samples = Vec::with_capacity(N_SAMPLES);
    while samples.len() < N_SAMPLES && distances[next] > 0.0 {
        let (number, at) = (samples.len() as u32, positions[next]);
        samples.push(next as u32);
        for ((p, distance), nearest) in positions.iter().zip(&mut distances).zip(&mut nearest) {
            let squared = p.distance_squared(at);
            if squared < *distance {
                (*distance, *nearest) = (squared, number);
            }
        }
        next = farthest(&distances)?;
    }
    Some((samples, nearest))
}
