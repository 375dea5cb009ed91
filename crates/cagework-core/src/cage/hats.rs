//! Barycentric coordinates of planar polygons, robust on sides and at corners. They are the values of the hats on
//! faces.
//!
//! Sources: Meyer, Lee, Barr and Desbrun 2002, "Generalized barycentric coordinates on irregular polygons" (Wachspress
//! coordinates); Gordon and Wixom 1974, "Pseudo-harmonic interpolation on convex domains"; Manson, Li and Schaefer
//! 2011, "Positive Gordon-Wixom coordinates".
//!
//! Changes: the quotients of Meyer et al. are multiplied by the areas of the triangles of the point and all sides,
//! which avoids division by zero on a side. Each chord ends at the nearest sides, which a sweep finds. The weights of
//! chords differ from those in the sources. The mean over chords is taken by quadrature; on each chord, values sum to
//! 1, are not negative and reproduce linear functions, so their mean does, too.

use std::f64::consts::PI;

use glam::DVec2;

use super::triangulate::cross;

/// Distances below this fraction of the polygon's size count as zero: a few roundings of f64.
const OUTLINE_TOLERANCE: f64 = 1e-15;

/// Nodes of Gauss quadrature on `[0, 1]`: `(1 ± 1 / sqrt(3)) / 2`.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Computes the Wachspress coordinates of `point` in a strictly convex counter-clockwise polygon. `values`: `[n]`,
/// non-negative, sum 1; `areas`: `[n]`, scratch. If rounding puts the point outside, it is treated as a point of the
/// side that it crossed.
pub(super) fn wachspress(outline: &[DVec2], point: DVec2, values: &mut [f64], areas: &mut [f64]) {
    let n = outline.len();
    let before = |k: usize| if k == 0 { n - 1 } else { k - 1 };
    let after = |k: usize| if k + 1 == n { 0 } else { k + 1 };
    // Doubled areas of the triangles of the point and each side, divided by the largest, so that their product neither
    // overflows nor underflows. Comparisons instead of `max`, which has no single wasm instruction.
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
        // Weight of corner k: area of the triangle at the corner, times the areas of all sides that do not end there.
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

/// Computes the pseudo-harmonic coordinates of `point` in a simple counter-clockwise polygon that contains it: the mean
/// over all chords through the point of the linear interpolation between the chord's ends, weighted by
/// `1 / (r s sqrt(r + s))` with the distances r and s to the ends. The weight `1 / (r s)` would make them harmonic on a
/// circle; the root reduces the influence of distant corners. `values`: `[n]`, non-negative, sum 1. `O(n (log n + c))`
/// if a line through the point crosses `c` sides.
pub(super) fn pseudo_harmonic(outline: &[DVec2], point: DVec2, values: &mut [f64]) {
    let n = outline.len();
    let next = |k: usize| if k + 1 == n { 0 } else { k + 1 };
    let to = |k: usize| outline[k] - point;
    let side = |k: usize| outline[next(k)] - outline[k];
    let extent = outline.iter().map(|q| q.length()).fold(0.0, f64::max);
    values.fill(0.0);
    let mut nearest = (f64::INFINITY, 0, 0.0);
    for k in 0..n {
        let share = (-to(k).dot(side(k)) / side(k).length_squared()).clamp(0.0, 1.0);
        let distance = (to(k) + share * side(k)).length();
        if distance < nearest.0 {
            nearest = (distance, k, share);
        }
    }
    let on_side = |values: &mut [f64]| {
        values.fill(0.0);
        values[nearest.1] = 1.0 - nearest.2;
        values[next(nearest.1)] = nearest.2;
    };
    if nearest.0 <= OUTLINE_TOLERANCE * extent {
        return on_side(values);
    }
    // Rotate a line about the point by half a turn. While the line turns from one corner to the next, it crosses the
    // same sides.
    let is_above = |k: usize| to(k).y > 0.0 || to(k).y == 0.0 && to(k).x > 0.0;
    let angle = |k: usize| if is_above(k) { to(k).y.atan2(to(k).x) } else { (-to(k).y).atan2(-to(k).x) };
    let mut corners: Vec<(f64, usize)> = (0..n).map(|k| (angle(k), k)).collect();
    corners.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut crossed: Vec<usize> = (0..n).filter(|&k| is_above(k) != is_above(next(k))).collect();
    for (rank, &(start, corner)) in corners.iter().enumerate() {
        for side in [if corner == 0 { n - 1 } else { corner - 1 }, corner] {
            match crossed.iter().position(|&k| k == side) {
                Some(place) => drop(crossed.swap_remove(place)),
                None => crossed.push(side),
            }
        }
        let end = corners.get(rank + 1).map_or(corners[0].0 + PI, |&(end, _)| end);
        let width = end - start;
        let ways = GAUSS.map(|node| DVec2::from_angle(start + node * width));
        // Nearest side of the polygon ahead of the point, and behind it.
        let (mut ends, mut distances) = ([None; 2], [f64::INFINITY; 2]);
        for &k in &crossed {
            let distance = to(k).perp_dot(side(k)) / ways[0].perp_dot(side(k));
            let which = usize::from(distance < 0.0);
            if distance.abs() < distances[which] {
                (ends[which], distances[which]) = (Some(k), distance.abs());
            }
        }
        let [Some(ahead), Some(behind)] = ends else { continue };
        for way in ways {
            let hits = [ahead, behind].map(|k| {
                let share = (to(k).perp_dot(way) / way.perp_dot(side(k))).clamp(0.0, 1.0);
                (k, share, (to(k) + share * side(k)).length())
            });
            let chord = hits[0].2 + hits[1].2;
            for (k, share, distance) in hits {
                let weight = width / (distance * chord * chord.sqrt());
                // The share is NaN if the direction is parallel to the side, which happens in a sector of zero width.
                if weight * share >= 0.0 {
                    values[k] += weight * (1.0 - share);
                    values[next(k)] += weight * share;
                }
            }
        }
    }
    // A point that is outside by rounding may have no chord.
    if values.iter().sum::<f64>().is_normal() { normalize(values) } else { on_side(values) }
}

fn normalize(values: &mut [f64]) {
    let scale = 1.0 / values.iter().sum::<f64>();
    for value in values {
        *value *= scale;
    }
}
