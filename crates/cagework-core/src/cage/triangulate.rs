//! Ear clipping. The triangulation uses every corner, including straight ones. The triangles of neighbouring faces then
//! share whole edges, so the triangulated surface is closed, too.

use glam::DVec2;

use super::defects::FaceDefect;

/// Largest number of remaining corners for which the best-shaped ear is searched. With more corners, the first ear is
/// taken, because the search costs `n^3`.
const MAX_CORNERS_FOR_SEARCH: usize = 128;

/// An ear counts as degenerate (its corners are collinear) if twice its area is below this fraction of the polygon's
/// squared extent. The fraction is the rounding of f32 coordinates.
const MIN_EAR_AREA: f64 = 1e-7;

/// Twice the signed area of a triangle; positive if counter-clockwise.
pub(super) fn cross(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Triangulates a counter-clockwise polygon. Returns triangles as corner indices. `[n - 2]`
pub(super) fn ear_clip(outline: &[DVec2]) -> Result<Vec<[u32; 3]>, FaceDefect> {
    let extent = outline.iter().map(|p| p.length()).fold(0.0, f64::max);
    let straight = MIN_EAR_AREA * extent * extent;
    let mut left: Vec<usize> = (0..outline.len()).collect();
    let mut triangles = Vec::with_capacity(outline.len().saturating_sub(2));
    while left.len() > 3 {
        // Clip straight ears last, because they give triangles without area.
        let k = find_ear(outline, &left, straight)
            .or_else(|| find_ear(outline, &left, -straight))
            .ok_or(FaceDefect::CrossesItself)?;
        triangles.push(ear(&left, k));
        left.remove(k);
    }
    triangles.push([left[0], left[1], left[2]]);
    Ok(triangles.iter().map(|t| t.map(|k| k as u32)).collect())
}

/// Returns the triangle at the `k`-th remaining corner.
fn ear(left: &[usize], k: usize) -> [usize; 3] {
    let n = left.len();
    [left[(k + n - 1) % n], left[k], left[(k + 1) % n]]
}

/// Returns the position in `left` of the best-shaped ear whose doubled area exceeds `min_area` and which contains no
/// other corner. A corner on the ear's boundary counts as contained, unless straight ears are allowed.
fn find_ear(outline: &[DVec2], left: &[usize], min_area: f64) -> Option<usize> {
    let rim = -min_area;
    let mut best: Option<(f64, usize)> = None;
    for k in 0..left.len() {
        let corners = ear(left, k);
        let [a, b, c] = corners.map(|i| outline[i]);
        let area = cross(a, b, c);
        if area <= min_area {
            continue;
        }
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let quality = area / longest;
        if best.is_some_and(|(q, _)| q >= quality) {
            continue;
        }
        let blocked = left.iter().any(|&i| {
            let p = outline[i];
            !corners.contains(&i) && cross(a, b, p) > rim && cross(b, c, p) > rim && cross(c, a, p) > rim
        });
        if !blocked {
            best = Some((quality, k));
            if left.len() > MAX_CORNERS_FOR_SEARCH {
                break;
            }
        }
    }
    best.map(|(_, k)| k)
}
