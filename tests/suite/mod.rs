//! Properties of solvers, each a function of a back end.

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
use cagework_core::progress::{Progress, Silent};
use cagework_core::{Cage, Weights};
use glam::{DVec3, Vec3};

/// Anything that binds a mesh to a cage.
pub(crate) type Bind = fn(&[Vec3], &Cage, &BindOptions, &dyn Progress) -> Result<Binding, BindError>;

/// A back end under test: how it is called, and the options that choose it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BackEnd {
    /// The call.
    pub(crate) bind: Bind,
    /// Method, solver and threads; properties set the rest.
    pub(crate) options: BindOptions,
}

/// Grid for properties that hold at any resolution.
pub(crate) const GRID: u32 = 16;

/// Threshold for delta at which what is left of the error is below [`SOLVED`]: at g = 16 a Jacobi sweep leaves
/// cos(pi / 16) = 0.98 of it, so that the changes to come add up to 50 deltas.
pub(crate) const TAU: f32 = 1e-7;

/// What [`TAU`] leaves of the error, and rounding: the bar of the brief for exact solutions.
pub(crate) const SOLVED: f32 = 1e-5;

impl BackEnd {
    /// Binds at [`GRID`] and [`TAU`], `edit`ed.
    pub(crate) fn try_bind(
        &self,
        points: &[Vec3],
        cage: &Cage,
        edit: impl FnOnce(&mut BindOptions),
    ) -> Result<Binding, BindError> {
        let mut options = BindOptions { grid: GRID, tau: TAU, ..self.options };
        edit(&mut options);
        (self.bind)(points, cage, &options, &Silent)
    }

    /// [`Self::try_bind`] that must succeed.
    pub(crate) fn bind_with(
        &self,
        points: &[Vec3],
        cage: &Cage,
        edit: impl FnOnce(&mut BindOptions),
    ) -> Binding {
        self.try_bind(points, cage, edit).expect("this input can be bound")
    }

    /// [`Self::bind_with`] nothing edited.
    pub(crate) fn bind(&self, points: &[Vec3], cage: &Cage) -> Binding {
        self.bind_with(points, cage, |_| ())
    }

    /// Whether weights are interpolated and reproduce linear functions.
    pub(crate) fn is_embedded(&self) -> bool {
        self.options.method == Method::Embedded
    }
}

/// Where the weights put each vertex, in f64.
pub(crate) fn combined(weights: &Weights, cage: &[Vec3]) -> Vec<DVec3> {
    weights
        .rows()
        .map(|(columns, row)| {
            columns.iter().zip(row).map(|(&i, &w)| f64::from(w) * cage[i as usize].as_dvec3()).sum()
        })
        .collect()
}

/// Asserts that the weights put every vertex where `expected` has it, to within `tolerance` (object units).
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
