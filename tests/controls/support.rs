//! Binds and points that these tests share.

use cagework_core::progress::Silent;
use cagework_core::{BindOptions, Binding, ControlSet, bind};
use glam::Vec3;

/// Binds points on the processor; `edit`ed options.
pub(crate) fn bound(points: &[Vec3], set: &ControlSet, edit: impl FnOnce(&mut BindOptions)) -> Binding {
    let mut options = BindOptions { tau: 1e-7, ..BindOptions::default() };
    edit(&mut options);
    bind(points, set, &options, &Silent).expect("points inside are bound")
}

/// Points inside a box, on no plane of symmetry.
pub(crate) fn scattered(n: usize, low: Vec3, high: Vec3) -> Vec<Vec3> {
    // The plastic number's powers fill a box evenly (Roberts 2018).
    const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_4];
    let share = |k: usize, axis: usize| ((k + 1) as f64 * STEPS[axis]).fract() as f32;
    (0..n).map(|k| low + (high - low) * Vec3::new(share(k, 0), share(k, 1), share(k, 2))).collect()
}
