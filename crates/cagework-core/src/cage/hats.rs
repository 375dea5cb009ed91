//! Barycentric coordinates of planar polygons, robust on sides and corners: the hats' values on faces.
//!
//! Sources: Meyer, Lee, Barr, Desbrun 2002, "Generalized barycentric coordinates on irregular polygons" (Wachspress
//! coordinates), and Hormann, Floater 2006, "Mean value coordinates for arbitrary planar polygons".
//!
//! Changes versus the papers: Meyer's quotients are multiplied by all distances, so that nothing is divided by zero on
//! a side; of the two formulas for the tangent of half an angle, the one without cancellation is used.

use glam::DVec2;

use super::triangulate::cross;

/// Distances below this fraction of the polygon are zero: on the corner or side. A few roundings of f64.
const ON_OUTLINE: f64 = 1e-15;

/// Coordinates of `point` in a strictly convex counter-clockwise polygon. `values`: `[n]`, non-negative, sum 1; `areas`:
/// `[n]`, scratch space. Outside by rounding, a point is treated as if on the side.
pub(super) fn wachspress(outline: &[DVec2], point: DVec2, values: &mut [f64], areas: &mut [f64]) {
    let n = outline.len();
    let before = |k: usize| if k == 0 { n - 1 } else { k - 1 };
    let after = |k: usize| if k + 1 == n { 0 } else { k + 1 };
    // Doubled areas of the triangles between the point and each side, relative to the largest, so that their product
    // neither overflows nor underflows. Comparisons: wasm has no instruction for `max`.
    let mut largest = f64::MIN_POSITIVE;
    for (k, area) in areas.iter_mut().enumerate() {
        *area = cross(outline[k], outline[after(k)], point);
        largest = if *area > largest { *area } else { largest };
    }
    let scale = 1.0 / largest;
    for area in areas.iter_mut() {
        *area = if *area > 0.0 { *area * scale } else { 0.0 };
    }
    for (k, value) in values.iter_mut().enumerate() {
        let (first, next) = (before(k), after(k));
        // All sides but the two that meet in the corner.
        let mut product = cross(outline[first], outline[k], outline[next]);
        let mut side = next;
        while side != first {
            product *= areas[side];
            side = after(side);
        }
        *value = product;
    }
    normalize(values);
}

/// Mean value coordinates of `point` in a simple counter-clockwise polygon; defined in the whole plane.
/// `values`: `[n]`, sum 1, possibly negative if the polygon is not convex.
pub(super) fn mean_value(outline: &[DVec2], point: DVec2, values: &mut [f64]) {
    let n = outline.len();
    let extent = outline.iter().map(|q| q.length()).fold(0.0, f64::max);
    values.fill(0.0);
    if let Some(k) = outline.iter().position(|&q| q.distance(point) <= ON_OUTLINE * extent) {
        values[k] = 1.0;
        return;
    }
    for k in 0..n {
        let next = if k + 1 == n { 0 } else { k + 1 };
        let (s, t) = (outline[k] - point, outline[next] - point);
        let (r, q) = (s.length(), t.length());
        let (sine, cosine) = (s.perp_dot(t), s.dot(t));
        if cosine < 0.0 && sine.abs() <= ON_OUTLINE * (r + q) * (r + q) {
            values.fill(0.0);
            values[k] = q / (r + q);
            values[next] = r / (r + q);
            return;
        }
        // tan(angle / 2), where r q is the product of the lengths in sine and cosine.
        let tangent = if cosine < 0.0 { (r * q - cosine) / sine } else { sine / (r * q + cosine) };
        values[k] += tangent / r;
        values[next] += tangent / q;
    }
    normalize(values);
}

/// Scales `values` to the sum 1.
fn normalize(values: &mut [f64]) {
    let scale = 1.0 / values.iter().sum::<f64>();
    for value in values {
        *value *= scale;
    }
}
