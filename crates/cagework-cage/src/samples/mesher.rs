//! Meshes a signed distance function.

use fast_surface_nets::ndshape::RuntimeShape;
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::{UVec3, Vec3};

use super::sdf::Body;
use cagework_core::mesh::TriMesh;

/// Number of lattice points along the edge of a block. Whole blocks far from the surface are not sampled.
const BLOCK: u32 = 4;

/// Number of Newton steps from a vertex of the net to the surface; after two, the distance from the surface is less
/// than 1e-3 of a cell.
const STEPS: usize = 2;

/// Meshes a body's surface on cells of edge `cell`. Also returns vertex colours.
///
/// Source: surface nets (Gibson 1998) from the crate `fast-surface-nets`; vertices are then projected onto the surface.
pub(super) fn mesh(body: &Body, cell: f32) -> (TriMesh, Vec<[u8; 4]>) {
    let [min, max] = body.bounds();
    let origin = min - 2.0 * cell;
    let n = ((max - min) / cell).ceil().as_uvec3() + 5;
    let blocks = Blocks::new(body, origin, cell, n);
    let samples = blocks.sample();
    let mut net = SurfaceNetsBuffer::default();
    let shape = RuntimeShape::<u32, 3>::new(n.to_array());
    surface_nets(&samples, &shape, [0; 3], (n - 1).to_array(), &mut net);

    let (mut positions, mut colours) = (Vec::new(), Vec::new());
    for &p in &net.positions {
        let p = Vec3::from_array(p);
        let near = blocks.at(p).unwrap_or(body);
        let position = on_surface(near, origin + cell * p, cell);
        positions.push(position);
        colours.push(near.colour(position));
    }
    let mut triangles: Vec<[u32; 3]> = net.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    let at = |i: u32| positions[i as usize];
    let volume: f32 = triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c)))).sum();
    if volume < 0.0 {
        for t in &mut triangles {
            t.swap(1, 2);
        }
    }
    (TriMesh { positions, triangles }, colours)
}

/// Blocks of the lattice, x fastest, each with the part of the body near it.
struct Blocks {
    origin: Vec3,
    cell: f32,
    /// Numbers of lattice points along x, y and z.
    n: UVec3,
    /// Numbers of blocks along x, y and z.
    n_blocks: UVec3,
    /// Distance at the centre of each block. If the surface may pass through the block, also the solids that affect it.
    blocks: Vec<(f32, Option<Body>)>,
}

impl Blocks {
    fn new(body: &Body, origin: Vec3, cell: f32, n: UVec3) -> Self {
        let n_blocks = (n + (BLOCK - 1)) / BLOCK;
        // Upper bound on the distance of a block's centre from points up to one cell outside the block.
        let reach = 1.05 * cell * 3.0_f32.sqrt() * (0.5 * BLOCK as f32 + 1.0);
        let mut blocks = Vec::with_capacity((n_blocks.x * n_blocks.y * n_blocks.z) as usize);
        for z in 0..n_blocks.z {
            for y in 0..n_blocks.y {
                for x in 0..n_blocks.x {
                    let first = BLOCK * UVec3::new(x, y, z);
                    let middle = origin + cell * first.as_vec3() + 0.5 * cell * (BLOCK - 1) as f32;
                    let distance = body.distance(middle);
                    // Projection moves a vertex by a little more than a cell.
                    let near = || body.near(middle, reach + 2.0 * cell);
                    blocks.push((distance, (distance.abs() <= reach).then(near)));
                }
            }
        }
        Self { origin, cell, n, n_blocks, blocks }
    }

    fn number(&self, block: UVec3) -> usize {
        ((block.z * self.n_blocks.y + block.y) * self.n_blocks.x + block.x) as usize
    }

    /// Returns the body near a point in lattice coordinates; `None` far from the surface.
    fn at(&self, p: Vec3) -> Option<&Body> {
        let block = (p.as_uvec3() / BLOCK).min(self.n_blocks - 1);
        self.blocks[self.number(block)].1.as_ref()
    }

    /// Samples the distance at the lattice points, x fastest. A block that the surface cannot reach gets its centre's
    /// distance.
    fn sample(&self) -> Vec<f32> {
        let n = self.n;
        let mut samples = Vec::with_capacity((n.x * n.y * n.z) as usize);
        for k in 0..n.z {
            for j in 0..n.y {
                for i in 0..n.x {
                    let p = UVec3::new(i, j, k);
                    let (distance, near) = &self.blocks[self.number(p / BLOCK)];
                    let at = || self.origin + self.cell * p.as_vec3();
                    samples.push(near.as_ref().map_or(*distance, |body| body.distance(at())));
                }
            }
        }
        samples
    }
}

/// Projects a point near the surface onto it by Newton's method.
fn on_surface(body: &Body, start: Vec3, cell: f32) -> Vec3 {
    let h = 0.05 * cell;
    // Corners of a tetrahedron. The sum of the corners, weighted by the distances there, gives the gradient; the mean
    // of these distances approximates the distance at the centre.
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
