//! The simplest cage: a box of quads around the model.

use glam::{UVec3, Vec3};

use crate::mesh::{Bounds, PolygonMesh};

/// Minimum thickness of the box, as a fraction of the model's diagonal, so that a flat model gets a cage with a volume.
const MIN_THICKNESS: f32 = 0.01;

/// Builds a box around `bounds` with shared vertices and outward faces. `divisions`: number of quads along x, y and z,
/// at least one. `margin`: distance from the bounds, as a fraction of their diagonal; negative values count as 0.
#[must_use]
pub fn subdivided_box(bounds: Bounds, margin: f32, divisions: [u32; 3]) -> PolygonMesh {
    // A single point has no diagonal: use one object unit.
    let diagonal = if bounds.diagonal() > 0.0 { bounds.diagonal() } else { 1.0 };
    let half = (0.5 * bounds.extent() + Vec3::splat(margin.max(0.0) * diagonal))
        .max(Vec3::splat(0.5 * MIN_THICKNESS * diagonal));
    let min = bounds.center() - half;
    let n = UVec3::from(divisions).max(UVec3::ONE);

    let mut positions = Vec::new();
    let mut vertex_at = vec![u32::MAX; ((n.x + 1) * (n.y + 1) * (n.z + 1)) as usize];
    let slot = |p: UVec3| (p.x + (n.x + 1) * (p.y + (n.y + 1) * p.z)) as usize;
    let mut faces = Vec::new();
    for axis in 0..3 {
        // (u, v, axis) is right-handed, so a face that is counter-clockwise in u and v has its normal along the axis.
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for at in [0, n[axis]] {
            for j in 0..n[v] {
                for i in 0..n[u] {
                    let mut corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
                    if at == 0 {
                        corners.reverse();
                    }
                    let face = corners.map(|[du, dv]| {
                        let mut p = UVec3::ZERO;
                        (p[u], p[v], p[axis]) = (i + du, j + dv, at);
                        let vertex = &mut vertex_at[slot(p)];
                        if *vertex == u32::MAX {
                            *vertex = positions.len() as u32;
                            positions.push(min + 2.0 * half * (p.as_vec3() / n.as_vec3()));
                        }
                        *vertex
                    });
                    faces.push(face.to_vec());
                }
            }
        }
    }
    PolygonMesh { positions, faces }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cage::Cage;

    const MODEL: Bounds = Bounds { min: Vec3::new(-1.0, 2.0, 0.0), max: Vec3::new(1.0, 5.0, 6.0) };

    #[test]
    fn box_is_a_valid_cage_at_the_margin() {
        // The model's diagonal is 7, so a margin of 0.1 is a distance of 0.7.
        for [x, y, z] in [[1, 1, 1], [2, 3, 4], [5, 1, 2]] {
            let mesh = subdivided_box(MODEL, 0.1, [x, y, z]);
            let cage = Cage::new(&mesh).unwrap();
            assert_eq!(cage.notices(), []);
            assert_eq!(mesh.faces.len() as u32, 2 * (x * y + y * z + z * x));
            // The vertices are the lattice points minus the inner ones.
            assert_eq!(
                mesh.positions.len() as u32,
                (x + 1) * (y + 1) * (z + 1) - (x - 1) * (y - 1) * (z - 1)
            );
            assert!(cage.bounds().min.abs_diff_eq(MODEL.min - 0.7, 1e-6));
            assert!(cage.bounds().max.abs_diff_eq(MODEL.max + 0.7, 1e-6));
        }
    }

    #[test]
    fn flat_and_point_models_get_a_box_with_a_volume() {
        let flat = Bounds { min: Vec3::ZERO, max: Vec3::new(3.0, 0.0, 4.0) };
        let point = Bounds { min: Vec3::ONE, max: Vec3::ONE };
        for (bounds, thickness) in [(flat, 0.05), (point, 0.01)] {
            let cage = Cage::new(&subdivided_box(bounds, 0.0, [2, 2, 2])).unwrap();
            assert!((cage.bounds().extent().y - thickness).abs() < 1e-6);
        }
    }

    #[test]
    fn zero_divisions_count_as_one() {
        assert_eq!(subdivided_box(MODEL, 0.0, [0; 3]), subdivided_box(MODEL, -1.0, [1; 3]));
    }
}
