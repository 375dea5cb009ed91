//! Deformation: `v' = sum_i w_i(v) c_i'`, and normals of the result.

use glam::{DVec3, Mat3, Vec3};

use crate::weights::Weights;

/// A mesh vertex outside the cage, inside of a control or next to it: where its weights put it, offset rigidly in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutsideVertex {
    /// Mesh vertex.
    pub vertex: u32,
    /// The frame's corners, three controls: of a plain cage the triangle with the closest point.
    pub corners: [u32; 3],
    /// Offset from the closest point in the frame (edge, in-plane normal to it, triangle normal), object units.
    pub offset: Vec3,
}

/// Positions of all mesh vertices for a posed cage: `v' = sum_i w_i(v) c_i'` (Joshi et al. 2007, Eq. 1).
///
/// `cage_positions`: `[n_cage]`, object units. Returns `[n_rows]`.
///
/// # Panics
/// If `cage_positions` has not one position per column.
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

/// [`deform_vertices`], and vertices outside the cage at their rigid offset from the closest point.
///
/// # Panics
/// If `cage_positions` has not one position per column, or an outside vertex is none of the rows.
#[must_use]
pub fn deform_bound(weights: &Weights, outside: &[OutsideVertex], cage_positions: &[Vec3]) -> Vec<Vec3> {
    let mut positions = deform_vertices(weights, cage_positions);
    for o in outside {
        let frame = triangle_frame(o.corners.map(|i| cage_positions[i as usize]));
        positions[o.vertex as usize] += frame * o.offset;
    }
    positions
}

/// How far each bound point moves with the cage: `sum_i w_i (c_i' - c_i)`, and of points outside what their offset turns. Exactly
/// zero where nothing near has moved, which the difference of two deformed shapes is not.
///
/// `rest`, `posed`: `[n_cage]`, object units. Returns `[n_rows]`.
///
/// # Panics
/// As [`deform_bound`].
#[must_use]
pub fn displacements(
    weights: &Weights,
    outside: &[OutsideVertex],
    rest: &[Vec3],
    posed: &[Vec3],
) -> Vec<DVec3> {
    assert_eq!(posed.len(), weights.n_columns(), "one position per column");
    let by: Vec<DVec3> = posed.iter().zip(rest).map(|(p, r)| p.as_dvec3() - r.as_dvec3()).collect();
    let of_row = |(indices, data): (&[u32], &[f32])| {
        indices.iter().zip(data).map(|(&i, &w)| f64::from(w) * by[i as usize]).sum()
    };
    let mut all: Vec<DVec3> = weights.rows().map(of_row).collect();
    for o in outside {
        all[o.vertex as usize] += turned_offset(o, rest, posed);
    }
    all
}

/// How far the offset of a vertex outside moves it, besides its row.
pub(crate) fn turned_offset(o: &OutsideVertex, rest: &[Vec3], posed: &[Vec3]) -> DVec3 {
    let [before, after] = [rest, posed].map(|at| triangle_frame(o.corners.map(|i| at[i as usize])));
    if before == after {
        return DVec3::ZERO;
    }
    (after * o.offset).as_dvec3() - (before * o.offset).as_dvec3()
}

/// Orthonormal frame of a triangle: first edge, in-plane normal to it, triangle normal, as columns. A triangle without
/// area, which a pose may make, gets the identity.
#[must_use]
pub fn triangle_frame([a, b, c]: [Vec3; 3]) -> Mat3 {
    let edge = (b - a).normalize_or_zero();
    let normal = (b - a).cross(c - a).normalize_or_zero();
    if edge == Vec3::ZERO || normal == Vec3::ZERO {
        return Mat3::IDENTITY;
    }
    Mat3::from_cols(edge, normal.cross(edge), normal)
}

/// Area-weighted unit vertex normals; a vertex of no triangle gets zero. `[n_vertices]`
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
    use glam::Quat;

    use super::*;

    /// Rounding of rotated f32 positions of size 1.
    const ROUNDED: f32 = 1e-6;

    fn weights() -> Weights {
        // The middle of an edge, and a corner.
        Weights::new(3, vec![0, 2, 3], vec![0, 2, 1], vec![0.5, 0.5, 1.0]).unwrap()
    }

    #[test]
    fn vertices_are_weighted_sums_of_the_cage() {
        let cage = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 2.0, 4.0)];
        assert_eq!(deform_vertices(&weights(), &cage), [Vec3::new(0.0, 1.0, 2.0), Vec3::X]);
    }

    #[test]
    fn vertex_outside_keeps_its_offset_in_the_triangles_frame() {
        let rest = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let offset = Vec3::new(0.1, -0.2, 0.3);
        let outside = [OutsideVertex { vertex: 1, corners: [0, 1, 2], offset }];
        // In rest pose the frame is the axes.
        assert_eq!(deform_bound(&weights(), &outside, &rest)[1], Vec3::X + offset);
        let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, -1.0).normalize(), 2.0);
        let posed = rest.map(|p| turn * p + Vec3::splat(5.0));
        let moved = deform_bound(&weights(), &outside, &posed)[1];
        assert!(moved.distance(turn * (Vec3::X + offset) + Vec3::splat(5.0)) <= 10.0 * ROUNDED);
        // Stretching the triangle moves the closest point, not the offset.
        let stretched = deform_bound(&weights(), &outside, &rest.map(|p| 3.0 * p))[1];
        assert!(stretched.distance(3.0 * Vec3::X + offset) <= ROUNDED);
    }

    #[test]
    fn frame_of_a_triangle_without_area_is_the_identity() {
        for flat in [[Vec3::ONE; 3], [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]] {
            assert_eq!(triangle_frame(flat), Mat3::IDENTITY);
        }
    }

    #[test]
    fn normals_of_a_cube_point_away_from_its_centre() {
        let cage = crate::Cage::new(&crate::cage::shapes::cube()).unwrap();
        let mut positions = cage.positions().to_vec();
        positions.push(Vec3::splat(9.0));
        let normals = vertex_normals(&positions, cage.triangles());
        for (p, n) in positions[..8].iter().zip(&normals) {
            // Two triangles of one face and one of another make a corner's sum lopsided, by a factor of 2 at most.
            let away = (p - Vec3::splat(0.5)).normalize();
            assert!((n.length() - 1.0).abs() <= ROUNDED && n.dot(away) > 0.9, "{n} at {p}");
        }
        assert_eq!(normals[8], Vec3::ZERO, "a vertex of no triangle has no normal");
    }
}
