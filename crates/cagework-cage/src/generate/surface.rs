//! Boundary surface of a voxel set, and its smoothing.

use glam::DVec3;

use super::voxels::Voxels;

/// Limit on the movement of a smoothed vertex along each axis, in voxels. The hull is one voxel away from the solid;
/// with less than half a voxel of movement, more than half a voxel of distance remains.
pub(super) const SMOOTHING_REACH: f64 = 0.45;

/// Number of smoothing rounds; eight flatten the stairs of a slanted plane.
const SMOOTHING_ROUNDS: usize = 8;

/// A closed, outward surface in centred voxel units; or, with a mirror, its half on the positive side, bounded by the
/// mirror plane.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Whether each vertex lies on the mirror plane.
    pub(super) on_mirror: Vec<bool>,
    pub(super) mirror: Option<usize>,
}

impl Surface {
    /// Extracts the boundary of a well-composed voxel set.
    pub(super) fn of(voxels: &Voxels, mirror: Option<usize>) -> Self {
        let dims = voxels.dims;
        let corners = dims.map(|n| n + 1);
        let half = DVec3::from_array(dims.map(|n| 0.5 * n as f64));
        let mut number = vec![u32::MAX; corners.iter().product()];
        let mut surface = Self { mirror, ..Self::default() };
        voxels.for_each(|voxel| {
            if mirror.is_some_and(|axis| voxel[axis] < dims[axis] / 2) {
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
                        surface.on_mirror.push(mirror.is_some_and(|axis| p[axis] == 0.0));
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
                let mut moved = (sum[v] / count[v].max(1.0)).clamp(stairs[v] - reach, stairs[v] + reach);
                if let (Some(axis), true) = (self.mirror, self.on_mirror[v]) {
                    moved[axis] = 0.0;
                }
                *p = moved;
            }
        }
    }

    /// Number of vertices of the whole surface, including the mirror image.
    pub(super) fn n_whole(&self) -> usize {
        let on_mirror = self.on_mirror.iter().filter(|&&on| on).count();
        if self.mirror.is_some() { 2 * self.positions.len() - on_mirror } else { self.positions.len() }
    }

    /// The whole surface: both halves joined at the mirror plane.
    pub(super) fn whole(&self) -> Self {
        let Some(axis) = self.mirror else { return self.clone() };
        let mut whole = Self { mirror: None, ..self.clone() };
        let mut image = Vec::with_capacity(self.positions.len());
        for (v, &p) in self.positions.iter().enumerate() {
            if self.on_mirror[v] {
                image.push(v as u32);
            } else {
                image.push(whole.positions.len() as u32);
                let mut q = p;
                q[axis] = -q[axis];
                whole.positions.push(q);
            }
        }
        whole.on_mirror = vec![false; whole.positions.len()];
        whole.triangles.extend(self.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|i| image[i as usize])));
        whole
    }
}
