//! Tests that the correction restores the sums and keeps zeros and signs.

use proptest::prelude::*;

use super::*;
use crate::cage::Cage;
use crate::cage::shapes;

/// Tolerance for f32 rounding of a row of about ten weights.
const ROUNDING: f64 = 1e-6;

/// A row of weights in batches of lanes. Lanes without a weight are 0.
fn rows_of(weights: &[f32]) -> Vec<Row> {
    weights.chunks(LANES).map(|w| std::array::from_fn(|k| w.get(k).copied().unwrap_or(0.0))).collect()
}

proptest! {
    #[test]
    fn correction_restores_sums_and_keeps_zeros_and_signs(
        weights in proptest::collection::vec(0.01..1.0f32, 16),
        dropped in proptest::collection::vec(any::<bool>(), 16),
        noise in proptest::collection::vec(-0.02..0.02f32, 16),
    ) {
        let cage = Cage::new(&shapes::c_shape()).unwrap();
        let columns = Columns::new((&cage).into());
        // Always keep five corners that do not lie in one plane, so that a correction can move the sum in every
        // direction.
        let kept = |i: usize| [0, 1, 6, 7, 8].contains(&i) || !dropped[i];
        let mut exact: Vec<f32> = (0..16).map(|i| if kept(i) { weights[i] } else { 0.0 }).collect();
        let sum: f32 = exact.iter().sum();
        exact.iter_mut().for_each(|w| *w /= sum);
        // The exact weights define the target; the input is off by a few per cent.
        let target: DVec3 =
            exact.iter().zip(cage.positions()).map(|(&w, p)| f64::from(w) * p.as_dvec3()).sum();
        let off: Vec<f32> = exact.iter().zip(&noise).map(|(w, n)| w * (1.0 + n)).collect();
        let mut row = rows_of(&off);
        columns.restore_affine(&mut row, columns.scale(target));
        let Sums { sum, miss } = columns.sums(&row, columns.scale(target));
        prop_assert!((sum - 1.0).abs() <= ROUNDING && miss <= ROUNDING, "sum {}, off by {}", sum, miss);
        for (i, w) in row.iter().flatten().take(16).enumerate() {
            prop_assert_eq!(*w == 0.0, off[i] == 0.0);
            prop_assert!(*w >= 0.0, "weight {} changed from {} to {}", i, off[i], w);
        }
    }
}

#[test]
fn exact_row_is_unchanged() {
    let cage = Cage::new(&shapes::cube()).unwrap();
    let columns = Columns::new((&cage).into());
    let mut row = rows_of(&[0.125; 8]);
    columns.restore_affine(&mut row, columns.scale(DVec3::splat(0.5)));
    assert!(row[0].iter().all(|w| (w - 0.125).abs() <= 1e-7), "{row:?}");
}

#[test]
fn row_on_a_face_is_corrected_within_its_plane() {
    let cage = Cage::new(&shapes::cube()).unwrap();
    let columns = Columns::new((&cage).into());
    // Only the bottom corners have weights, so the system is singular normal to the face.
    let mut row = rows_of(&[0.3, 0.2, 0.3, 0.1, 0.0, 0.0, 0.0, 0.0]);
    let target = columns.scale(DVec3::new(0.4, 0.5, 0.0));
    columns.restore_affine(&mut row, target);
    let Sums { sum, miss } = columns.sums(&row, target);
    assert!((sum - 1.0).abs() <= ROUNDING && miss <= ROUNDING, "sum {sum}, off by {miss}");
    assert!(row[0].iter().all(|w| *w >= 0.0) && row[0][4..].iter().all(|w| *w == 0.0));
}

#[test]
fn empty_row_stays_empty() {
    let cage = Cage::new(&shapes::cube()).unwrap();
    let columns = Columns::new((&cage).into());
    let mut row = rows_of(&[0.0; 8]);
    columns.restore_affine(&mut row, DVec3::ZERO);
    assert_eq!(row, rows_of(&[0.0; 8]));
}

#[test]
fn combined_is_the_weighted_sum_of_positions() {
    let cage = Cage::new(&shapes::cube()).unwrap();
    let columns = Columns::new((&cage).into());
    let row = rows_of(&[0.0, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.75]);
    // Vertex 1 is (1, 0, 0), vertex 7 is (1, 1, 1).
    let expected = columns.scale(DVec3::new(1.0, 0.75, 0.75));
    assert!(columns.combined(&row).1.distance(expected) <= 1e-12);
}
