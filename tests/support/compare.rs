//! Comparison of lists of numbers.

use cagework_core::Weights;

/// Finds the two numbers that differ most: their index, both values, and their distance; zeros if all are equal. A
/// difference that is NaN counts as infinite.
///
/// # Panics
/// If the slices differ in length.
#[must_use]
pub fn largest_difference(a: &[f32], b: &[f32]) -> (usize, f32, f32, f32) {
    assert_eq!(a.len(), b.len(), "both slices must have the same length");
    a.iter().zip(b).enumerate().fold((0, 0.0, 0.0, 0.0), |worst, (index, (&a, &b))| {
        let distance = if (a - b).is_nan() { f32::INFINITY } else { (a - b).abs() };
        if distance > worst.3 { (index, a, b, distance) } else { worst }
    })
}

/// Asserts that two lists of numbers differ by at most `tolerance` at each index.
///
/// # Panics
/// If they differ by more: with the index of the largest difference, both values and the tolerance.
#[track_caller]
pub fn assert_close(a: &[f32], b: &[f32], tolerance: f32) {
    let (index, x, y, distance) = largest_difference(a, b);
    assert!(distance <= tolerance, "at {index}: {x} and {y} differ by {distance:e}, more than {tolerance:e}");
}

/// Converts weights to a dense matrix in row-major order. `[n_rows * n_columns]`
#[must_use]
pub fn dense(weights: &Weights) -> Vec<f32> {
    let mut all = vec![0.0; weights.n_rows() * weights.n_columns()];
    for (row, (columns, values)) in weights.rows().enumerate() {
        for (&column, &value) in columns.iter().zip(values) {
            all[row * weights.n_columns() + column as usize] = value;
        }
    }
    all
}
