//! Deformation, `v' = sum_i w_i(v) c_i'`, and normals.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::frames::Frames;
use crate::weights::Weights;
use crate::words::{counted, decimals, grouped};

/// A mesh vertex outside the cage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct OutsideVertex {
    /// Index of the mesh vertex.
    pub vertex: u32,
    /// Distance from the cage, object units.
    pub distance: f32,
    /// Share of the cage's motion that the vertex follows: 1 near the cage, 0 if the vertex stays in place.
    pub share: f32,
}

/// Describes in one sentence the vertices outside a cage with this diagonal (object units): number, distance, and how
/// many stay in place. `None` if `outside` is empty.
#[must_use]
pub fn outside_in_words<'a>(
    outside: impl Iterator<Item = &'a OutsideVertex>,
    diagonal: f32,
) -> Option<String> {
    let (mut n, mut n_staying, mut distance) = (0, 0, 0.0_f32);
    for o in outside {
        n += 1;
        n_staying += usize::from(o.share == 0.0);
        distance = distance.max(o.distance);
    }
    if n == 0 {
        return None;
    }
    let is = if n == 1 { "is" } else { "are" };
    let most = 100.0 * distance / diagonal;
    let staying = match n_staying {
        0 => String::new(),
        1 => "; 1 of them stays where it is".into(),
        n => format!("; {} of them stay where they are", grouped(n)),
    };
    Some(format!(
        "{} {is} outside the cage, up to {} % of its diagonal{staying}.",
        counted(n, "vertex", "vertices"),
        decimals(most, 2)
    ))
}

/// Computes the positions of all mesh vertices for a posed cage: `v' = sum_i w_i(v) c_i'` (Joshi et al. 2007, Eq. 1).
///
/// `cage_positions`: `[n_cage]`, object units. Returns `[n_rows]`.
///
/// # Panics
/// If `cage_positions` does not have one position per column.
#[must_use]
pub fn deform_vertices(weights: &Weights, cage_positions: &[Vec3]) -> Vec<Vec3> {
    assert_eq!(cage_positions.len(), weights.n_columns(), "one position per column");
    weights
        .rows()
        .map(|(indices, data)| {
            let sum = indices.iter().zip(data).fold(DVec3::ZERO, |sum, (&i, &w)| {
                sum + f64::from(w) * cage_positions[i as usize].as_dvec3()
            });
            sum.as_vec3()
        })
        .collect()
}

/// Computes the positions of bound points, like [`deform_vertices`], from the weights of a bind, whose columns are the
/// controls and then `frames`.
///
/// `controls`: `[n_controls]`, object units. Returns `[n_rows]`.
///
/// # Panics
/// If `controls` does not have one position per control.
#[must_use]
pub fn deform_bound(weights: &Weights, frames: &Frames, controls: &[Vec3]) -> Vec<Vec3> {
    deform_vertices(weights, &frames.columns(controls))
}

/// Error of a pose that moves a point beyond the range of 32-bit floats.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("the pose moves point {point} to {:?}{}", .to.to_array(), range_in_words(*.to))]
pub struct NonFinitePoint {
    /// Index of the point.
    pub point: usize,
    /// Position with a coordinate that is infinite or NaN.
    pub to: Vec3,
}

/// What follows a position that is not finite in the message of [`NonFinitePoint`].
fn range_in_words(to: Vec3) -> String {
    if to.to_array().iter().any(|x| x.is_infinite()) {
        format!(", but 32-bit floats end at {:e}: use smaller coordinates", f32::MAX)
    } else {
        ": the coordinates of the pose must be finite numbers".to_owned()
    }
}

/// Computes the positions of bound points, like [`deform_bound`], and checks that they are finite. Meant for poses that
/// come from outside the program.
///
/// # Errors
/// [`NonFinitePoint`] for the first point whose position is not finite.
///
/// # Panics
/// As [`deform_bound`].
pub fn deform_finite(
    weights: &Weights,
    frames: &Frames,
    controls: &[Vec3],
) -> Result<Vec<Vec3>, NonFinitePoint> {
    let points = deform_bound(weights, frames, controls);
    match points.iter().position(|p| !p.is_finite()) {
        Some(point) => Err(NonFinitePoint { point, to: points[point] }),
        None => Ok(points),
    }
}

/// Computes the displacement of each bound point: `sum_i w_i (c_i' - c_i)` over all columns. It is exactly zero if no
/// column with a weight of the point has moved, unlike the difference of two deformed shapes.
///
/// `rest`, `posed`: `[n_controls]`, object units. Returns `[n_rows]`.
///
/// # Panics
/// As [`deform_bound`].
#[must_use]
pub fn displacements(weights: &Weights, frames: &Frames, rest: &[Vec3], posed: &[Vec3]) -> Vec<DVec3> {
    let [rest, posed] = [frames.columns(rest), frames.columns(posed)];
    assert_eq!(posed.len(), weights.n_columns(), "one position per column");
    let by: Vec<DVec3> = posed.iter().zip(&*rest).map(|(p, r)| p.as_dvec3() - r.as_dvec3()).collect();
    let of_row = |(indices, data): (&[u32], &[f32])| {
        indices.iter().zip(data).map(|(&i, &w)| f64::from(w) * by[i as usize]).sum()
    };
    weights.rows().map(of_row).collect()
}

/// Computes area-weighted unit vertex normals; zero for a vertex without triangles. `[n_vertices]`
#[must_use]
pub fn vertex_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| positions[i as usize]);
        let normal = (b - a).cross(c - a);
        for &i in triangle {
            normals[i as usize] += normal;
        }
    }
    for normal in &mut normals {
        *normal = normal.normalize_or_zero();
    }
    normals
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tolerance for f32 rounding of rotated positions of size 1.
    const ROUNDING: f32 = 1e-6;

    fn weights() -> Weights {
        // Row 0 is the midpoint of an edge, row 1 a corner.
        Weights::new(3, vec![0, 2, 3], vec![0, 2, 1], vec![0.5, 0.5, 1.0]).unwrap()
    }

    #[test]
    fn vertices_outside_are_summarised_in_a_sentence() {
        let at = |distance, share| OutsideVertex { vertex: 0, distance, share };
        let said = |outside: &[OutsideVertex]| outside_in_words(outside.iter(), 4.0);
        assert_eq!(said(&[]), None);
        let one = "1 vertex is outside the cage, up to 2.50 % of its diagonal.";
        assert_eq!(said(&[at(0.1, 1.0)]).unwrap(), one);
        let some =
            "2 vertices are outside the cage, up to 25.00 % of its diagonal; 1 of them stays where it is.";
        assert_eq!(said(&[at(0.1, 1.0), at(1.0, 0.0)]).unwrap(), some);
    }

    #[test]
    fn vertices_are_weighted_sums_of_the_cage() {
        let cage = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 2.0, 4.0)];
        assert_eq!(deform_vertices(&weights(), &cage), [Vec3::new(0.0, 1.0, 2.0), Vec3::X]);
    }

    #[test]
    fn points_moved_beyond_the_range_of_floats_are_errors() {
        let far = |x: f32| deform_finite(&weights(), &Frames::default(), &[Vec3::ZERO, Vec3::X * x, Vec3::X]);
        assert_eq!(far(f32::MAX).unwrap()[1], Vec3::X * f32::MAX);
        let message = "the pose moves point 1 to [inf, NaN, NaN], but 32-bit floats end at 3.4028235e38: use smaller coordinates";
        assert_eq!(far(f32::INFINITY).unwrap_err().to_string(), message);
        let message =
            "the pose moves point 1 to [NaN, NaN, NaN]: the coordinates of the pose must be finite numbers";
        assert_eq!(far(f32::NAN).unwrap_err().to_string(), message);
    }

    #[test]
    fn normals_of_a_cube_point_away_from_its_centre() {
        let cage = crate::Cage::new(&crate::cage::shapes::cube()).unwrap();
        let mut positions = cage.positions().to_vec();
        positions.push(Vec3::splat(9.0));
        let normals = vertex_normals(&positions, cage.triangles());
        for (p, n) in positions[..8].iter().zip(&normals) {
            // A corner has one or two triangles of each of its faces, so the weights of the faces' normals differ by a
            // factor of at most 2.
            let away = (p - Vec3::splat(0.5)).normalize();
            assert!((n.length() - 1.0).abs() <= ROUNDING && n.dot(away) > 0.9, "{n} at {p}");
        }
        assert_eq!(normals[8], Vec3::ZERO, "a vertex without triangles has no normal");
    }
}
