//! Boundary surface of a voxel set, and its smoothing.

use glam::DVec3;

use super::mirrors::Mirrors;
use super::voxels::Voxels;

/// Limit on the movement of a smoothed vertex along each axis, in voxels. The hull is one voxel away from the solid;
/// with less than half a voxel of movement, more than half a voxel of distance remains.
pub(super) const SMOOTHING_REACH: f64 = 0.45;

/// Number of smoothing rounds; eight flatten the stairs of a slanted plane.
const SMOOTHING_ROUNDS: usize = 8;

/// A closed, outward surface in centred voxel units; or, with mirror planes, its part on their positive sides, which
/// they bound. The images of this part in all subsets of the planes make up the whole surface.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The mirror planes on which each vertex lies. `[n_vertices]`
    pub(super) on_mirror: Vec<Mirrors>,
    pub(super) mirrors: Mirrors,
}

impl Surface {
    /// Extracts the boundary of a well-composed voxel set.
    pub(super) fn of(voxels: &Voxels, mirrors: Mirrors) -> Self {
        let dims = voxels.dims;
        let corners = dims.map(|n| n + 1);
        let half = DVec3::from_array(dims.map(|n| 0.5 * n as f64));
        let mut number = vec![u32::MAX; corners.iter().product()];
        let mut surface = Self { mirrors, ..Self::default() };
        voxels.for_each(|voxel| {
            if mirrors.axes().any(|axis| voxel[axis] < dims[axis] / 2) {
                return;
            }
            for side in 0..6 {
                let (axis, up) = (side / 2, side % 2 == 1);
                let mut next = voxel;
                // The outermost layer is empty, so the neighbouring voxel always exists.
                next[axis] = if up { voxel[axis] + 1 } else { voxel[axis] - 1 };
                if voxels.has(next) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut quad = [[0, 0], [1, 0], [1, 1], [0, 1]];
                if !up {
                    quad.reverse();
                }
                let quad = quad.map(|[du, dv]| {
                    let mut corner = voxel;
                    corner[axis] += usize::from(up);
                    corner[u] += du;
                    corner[v] += dv;
                    corner
                });
                // Cut along the diagonal between corners with an even coordinate sum. This is mirror-symmetric because
                // the dimensions are even.
                let even = quad[0].iter().sum::<usize>() % 2 == 0;
                let [a, b, c, d] = quad.map(|corner| {
                    let slot = &mut number[(corner[2] * corners[1] + corner[1]) * corners[0] + corner[0]];
                    if *slot == u32::MAX {
                        *slot = surface.positions.len() as u32;
                        let p = DVec3::from_array(corner.map(|x| x as f64)) - half;
                        surface.positions.push(p);
                        let on = (0..3).filter(|&axis| p[axis] == 0.0).fold(0, |on, axis| on | 1 << axis);
                        surface.on_mirror.push(mirrors.and(Mirrors(on)));
                    }
                    *slot
                });
                surface.triangles.extend(if even { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] });
            }
        });
        surface
    }

    /// Applies Laplacian smoothing. Each vertex moves by at most [`SMOOTHING_REACH`] along each axis.
    pub(super) fn smooth(&mut self) {
        let stairs = self.positions.clone();
        let mut sum = vec![DVec3::ZERO; stairs.len()];
        let mut count = vec![0.0_f64; stairs.len()];
        for _ in 0..SMOOTHING_ROUNDS {
            sum.fill(DVec3::ZERO);
            count.fill(0.0);
            for t in &self.triangles {
                for k in 0..3 {
                    let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
                    for (v, w) in [(a, b), (b, a)] {
                        sum[v] += self.positions[w];
                        count[v] += 1.0;
                    }
                }
            }
            for (v, p) in self.positions.iter_mut().enumerate() {
                let reach = DVec3::splat(SMOOTHING_REACH);
                let moved = (sum[v] / count[v].max(1.0)).clamp(stairs[v] - reach, stairs[v] + reach);
                *p = self.on_mirror[v].project(moved);
            }
        }
    }

    /// Number of vertices of the whole surface, including the images.
    pub(super) fn n_whole(&self) -> usize {
        self.on_mirror.iter().map(|&on| 1 << self.mirrors.without(on).len()).sum()
    }

    /// The whole surface: all images, joined at the mirror planes.
    pub(super) fn whole(&self) -> Self {
        let mut whole = Self { mirrors: Mirrors::NONE, ..self.clone() };
        for axis in self.mirrors.axes() {
            let mut image = Vec::with_capacity(whole.positions.len());
            for v in 0..whole.positions.len() {
                if whole.on_mirror[v].has(axis) {
                    image.push(v as u32);
                } else {
                    image.push(whole.positions.len() as u32);
                    whole.positions.push(Mirrors::of_axis(axis).reflect(whole.positions[v]));
                    whole.on_mirror.push(whole.on_mirror[v]);
                }
            }
            let images = whole.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|i| image[i as usize]));
            let images: Vec<_> = images.collect();
            whole.triangles.extend(images);
        }
        whole
    }
}
