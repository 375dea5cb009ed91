//! Properties that every solver has, each a function of a back end.

pub(crate) mod agreement;
pub(crate) mod any_cage;
pub(crate) mod errors;
pub(crate) mod exact;
pub(crate) mod outside;
pub(crate) mod principles;
pub(crate) mod progress;
pub(crate) mod raw;
pub(crate) mod reference;
pub(crate) mod rows;
pub(crate) mod shapes;

use cagework_core::bind::{BindError, Binding};
use cagework_core::options::{BindOptions, Method};
use cagework_core::progress::{NoProgress, Progress};
use cagework_core::{Cage, Weights};
use glam::{DVec3, Vec3};

/// A function that binds a mesh to a cage.
pub(crate) type Bind = fn(&[Vec3], &Cage, &BindOptions, &dyn Progress) -> Result<Binding, BindError>;

/// A solver under test: a bind function, and the options that select the solver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BackEnd {
    pub(crate) bind: Bind,
    /// Method, solver and threads. The properties choose the other options.
    pub(crate) options: BindOptions,
}

/// Number of grid cells along the cage's longest side, for properties that hold at any resolution.
pub(crate) const GRID: u32 = 16;

/// Threshold for delta ([`BindOptions::tau`]) at which the remaining error is below [`WEIGHT_TOLERANCE`]. At g = 16, a
/// Jacobi sweep multiplies the error by cos(pi / 16) = 0.98, so the error is about 50 times the change per sweep,
/// delta.
pub(crate) const TAU: f32 = 1e-7;

/// Largest allowed error of weights solved to [`TAU`], including rounding.
pub(crate) const WEIGHT_TOLERANCE: f32 = 1e-5;

impl BackEnd {
    /// Binds at [`GRID`] and [`TAU`], with options changed by `edit`.
    pub(crate) fn try_bind(
        &self,
        points: &[Vec3],
        cage: &Cage,
        edit: impl FnOnce(&mut BindOptions),
    ) -> Result<Binding, BindError> {
        let mut options = BindOptions { grid: GRID, tau: TAU, ..self.options };
        edit(&mut options);
        (self.bind)(points, cage, &options, &NoProgress)
    }

    /// Like [`Self::try_bind`], but panics on errors.
    pub(crate) fn bind_with(
        &self,
        points: &[Vec3],
        cage: &Cage,
        edit: impl FnOnce(&mut BindOptions),
    ) -> Binding {
        self.try_bind(points, cage, edit).expect("this input can be bound")
    }

    /// Like [`Self::bind_with`], without changes of the options.
    pub(crate) fn bind(&self, points: &[Vec3], cage: &Cage) -> Binding {
        self.bind_with(points, cage, |_| ())
    }

    /// Whether the method is the embedded one, which interpolates weights and reproduces linear functions.
    pub(crate) fn is_embedded(&self) -> bool {
        self.options.method == Method::Embedded
    }
}

/// Computes the positions that weights w and cage vertices c give the mesh vertices: `sum w c`, in f64. `[n_vertices]`
pub(crate) fn combined(weights: &Weights, cage: &[Vec3]) -> Vec<DVec3> {
    weights
        .rows()
        .map(|(columns, row)| {
            columns.iter().zip(row).map(|(&i, &w)| f64::from(w) * cage[i as usize].as_dvec3()).sum()
        })
        .collect()
}

/// Asserts that the weights reproduce the expected positions to within `tolerance` (object units).
#[track_caller]
pub(crate) fn assert_combined(weights: &Weights, cage: &[Vec3], expected: &[Vec3], tolerance: f64) {
    let got = combined(weights, cage);
    assert_eq!(got.len(), expected.len());
    for (v, (got, expected)) in got.iter().zip(expected).enumerate() {
        let distance = got.distance(expected.as_dvec3());
        assert!(
            distance <= tolerance,
            "vertex {v}: {got} is {distance:e} off {expected}, more than {tolerance:e}"
        );
    }
}
