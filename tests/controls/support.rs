//! Helpers for the tests of controls.

use cagework_core::bind::Watch;
use cagework_core::bind::pipeline::{FieldStorage, PreparedBind};
use cagework_core::progress::NoProgress;
use cagework_core::solve::rows::LANES;
use cagework_core::{BindOptions, Binding, ControlSet, Controls, bind};
use glam::Vec3;

/// Binds points on the processor with tau = 1e-7 and otherwise default options, changed by `edit`.
pub(crate) fn bound(points: &[Vec3], set: &ControlSet, edit: impl FnOnce(&mut BindOptions)) -> Binding {
    let mut options = BindOptions { tau: 1e-7, ..BindOptions::default() };
    edit(&mut options);
    bind(points, set, &options, &NoProgress).expect("points inside are bound")
}

/// Samples weights before each point's row is corrected to sum to 1 and to reproduce the point at rest.
/// `[n_controls][n_points]`; all points must be different and inside.
pub(crate) fn samples(points: &[Vec3], controls: Controls<'_>, options: &BindOptions) -> Vec<Vec<f32>> {
    let watch = Watch::new(&NoProgress);
    let mut prepared =
        PreparedBind::new(points, controls, options, FieldStorage::Host, &watch).expect("they are inside");
    let blocks = prepared.solve_on_host(&watch).expect("NoProgress never cancels").blocks;
    let lanes = blocks
        .iter()
        .flat_map(|block| (0..LANES).map(move |lane| block.iter().map(|row| row[lane]).collect()));
    lanes.take(controls.n_controls()).collect()
}

/// Creates evenly distributed points in a box, none of them in a plane of symmetry of the box.
pub(crate) fn scattered(n: usize, low: Vec3, high: Vec3) -> Vec<Vec3> {
    // Inverse powers of 1.2207, the root of x^4 = x + 1: the R3 sequence (Roberts 2018).
    const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_4];
    let share = |k: usize, axis: usize| ((k + 1) as f64 * STEPS[axis]).fract() as f32;
    (0..n).map(|k| low + (high - low) * Vec3::new(share(k, 0), share(k, 1), share(k, 2))).collect()
}
