//! From a signed distance function to triangles.

use fast_surface_nets::ndshape::RuntimeShape;
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::{UVec3, Vec3};

use super::sdf::Body;
use crate::mesh::TriMesh;

/// Samples along the edge of a block that is skipped if the surface is far.
const BLOCK: u32 = 8;

/// Newton steps from the net's vertex to the surface: two leave less than a thousandth of a cell.
const STEPS: usize = 2;

/// The surface of a body, meshed on cells of this size, with the colour of every vertex.
///
/// Source: Gibson 1998 (surface nets), by the crate `fast-surface-nets`; the vertices are then laid onto the surface.
pub(super) fn mesh(body: &Body, cell: f32) -> (TriMesh, Vec<[u8; 4]>) {
    let [min, max] = body.bounds();
    let origin = min - 2.0 * cell;
    let n = ((max - min) / cell).ceil().as_uvec3() + 5;
    let samples = sample(body, origin, cell, n);
    let mut net = SurfaceNetsBuffer::default();
    let shape = RuntimeShape::<u32, 3>::new(n.to_array());
    surface_nets(&samples, &shape, [0; 3], (n - 1).to_array(), &mut net);

    let positions: Vec<Vec3> =
        net.positions.iter().map(|&p| on_surface(body, origin + cell * Vec3::from_array(p), cell)).collect();
    let mut triangles: Vec<[u32; 3]> = net.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    let at = |i: u32| positions[i as usize];
    let volume: f32 = triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c)))).sum();
    if volume < 0.0 {
        for t in &mut triangles {
            t.swap(1, 2);
        }
    }
    let colours = positions.iter().map(|&p| body.colour(p)).collect();
    (TriMesh { positions, triangles }, colours)
}

/// Distances at the lattice's points, x fastest. Blocks that the surface cannot reach get one distance for all.
fn sample(body: &Body, origin: Vec3, cell: f32, n: UVec3) -> Vec<f32> {
    let mut samples = vec![0.0; (n.x * n.y * n.z) as usize];
    let at = |p: UVec3| origin + cell * p.as_vec3();
    // From the middle of a block to its farthest sample and the samples beyond.
    let reach = 1.05 * cell * 3.0_f32.sqrt() * (0.5 * BLOCK as f32 + 1.0);
    for z in (0..n.z).step_by(BLOCK as usize) {
        for y in (0..n.y).step_by(BLOCK as usize) {
            for x in (0..n.x).step_by(BLOCK as usize) {
                let first = UVec3::new(x, y, z);
                let last = (first + BLOCK).min(n);
                let middle = body.distance(at(first) + 0.5 * cell * (BLOCK - 1) as f32);
                for k in first.z..last.z {
                    for j in first.y..last.y {
                        let row = (k * n.y + j) * n.x;
                        for i in first.x..last.x {
                            let near = middle.abs() <= reach;
                            let d = if near { body.distance(at(UVec3::new(i, j, k))) } else { middle };
                            samples[(row + i) as usize] = d;
                        }
                    }
                }
            }
        }
    }
    samples
}

/// The point of the surface that Newton's method finds from a point near it.
fn on_surface(body: &Body, start: Vec3, cell: f32) -> Vec3 {
    let h = 0.05 * cell;
    // Four corners of a tetrahedron: their weighted sum is the gradient, their mean the distance.
    let corners =
        [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::ONE];
    let mut p = start;
    for _ in 0..STEPS {
        let distances = corners.map(|c| body.distance(p + h * c));
        let gradient: Vec3 = corners.iter().zip(distances).map(|(&c, d)| c * d).sum::<Vec3>() / (4.0 * h);
        let distance = distances.iter().sum::<f32>() / 4.0;
        p -= gradient * (distance / gradient.length_squared().max(0.25)).clamp(-0.5 * cell, 0.5 * cell);
    }
    p
}
