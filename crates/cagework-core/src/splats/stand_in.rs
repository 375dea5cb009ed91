//! Surface mesh of a capture of Gaussian splats: the outer boundary of the grid cells that opaque splats reach. It is
//! used for picking and pulling, and its depths hide handles behind the capture.

use std::collections::HashMap;

use glam::{UVec3, Vec3};

use super::Splats;
use crate::mesh::TriMesh;

/// Number of cells along the longest side of the capture.
const CELLS: f32 = 64.0;
/// Opacity from which a splat is part of the surface.
const MIN_OPACITY: f32 = 0.3;
/// Half axis of the ellipsoid that a splat fills, standard deviations.
const REACH: f32 = 1.5;
/// Share of the centres that is ignored at each end of each axis when the grid is placed, because floaters (stray
/// splats) can be far away.
const FAR_SHARE: f64 = 0.005;
/// Margin of the grid around the centres that determine it, as a fraction of the longest side of their bounds.
const MARGIN: f32 = 0.05;

impl Splats {
    /// The outer surface of the cells of a grid that opaque splats reach. Faces share vertices and point outwards.
    #[must_use]
    pub fn stand_in(&self) -> TriMesh {
        let is_solid = |&s: &usize| self.opacities[s] >= MIN_OPACITY;
        let mut solid: Vec<usize> = (0..self.len()).filter(is_solid).collect();
        if solid.is_empty() {
            solid = (0..self.len()).collect();
        }
        if solid.is_empty() {
            return TriMesh::default();
        }
        let (low, high) = near_bounds(self, &solid);
        let size = (high - low).max_element().max(f32::MIN_POSITIVE.sqrt());
        let low = low - MARGIN * size;
        let cell = size * 2.0_f32.mul_add(MARGIN, 1.0) / CELLS;
        // Add an empty cell on each side of the grid: the flood fill of the outside starts there.
        let dims = ((high + MARGIN * size - low) / cell).ceil().as_uvec3().max(UVec3::ONE) + 2;
        let mut grid = Grid { dims, kinds: vec![Kind::Empty; dims.element_product() as usize] };
        for splat in solid {
            let (center, axes) = (self.positions[splat], self.axes(splat));
            for axis in [axes.x_axis, axes.y_axis, axes.z_axis] {
                let half = (REACH * axis).clamp_length_max(size);
                let n = (half.length() / (0.5 * cell)).ceil().min(2.0 * CELLS);
                for k in 0..=2 * n as u32 {
                    let along = if n > 0.0 { k as f32 / n - 1.0 } else { 0.0 };
                    let at = ((center + along * half - low) / cell).floor();
                    if at.cmpge(Vec3::ZERO).all() && at.cmplt((dims - 2).as_vec3()).all() {
                        let k = grid.index(at.as_uvec3() + 1);
                        grid.kinds[k] = Kind::Solid;
                    }
                }
            }
        }
        grid.fill_outside();
        grid.surface(low - cell, cell)
    }
}

/// Bounds of the centres of the `solid` splats, without the share [`FAR_SHARE`] at each end of each axis.
fn near_bounds(splats: &Splats, solid: &[usize]) -> (Vec3, Vec3) {
    let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
    let last = solid.len() - 1;
    let skipped = (FAR_SHARE * last as f64) as usize;
    for axis in 0..3 {
        let mut along: Vec<f32> = solid.iter().map(|&s| splats.positions[s][axis]).collect();
        low[axis] = *along.select_nth_unstable_by(skipped, f32::total_cmp).1;
        high[axis] = *along.select_nth_unstable_by(last - skipped, f32::total_cmp).1;
    }
    (low, high)
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Empty,
    Solid,
    Outside,
}

struct Grid {
    dims: UVec3,
    /// Kind of each cell, x fastest. `[dims.z, dims.y, dims.x]`
    kinds: Vec<Kind>,
}

impl Grid {
    fn index(&self, cell: UVec3) -> usize {
        (cell.x + self.dims.x * (cell.y + self.dims.y * cell.z)) as usize
    }

    /// Neighbour of a cell along an axis; `None` outside the grid.
    fn neighbour(&self, cell: UVec3, axis: usize, is_after: bool) -> Option<UVec3> {
        let mut next = cell;
        next[axis] = if is_after { cell[axis] + 1 } else { cell[axis].checked_sub(1)? };
        (next[axis] < self.dims[axis]).then_some(next)
    }

    /// Flood fill from the first cell. Cells that it does not reach are solid or enclosed.
    fn fill_outside(&mut self) {
        let mut reached = vec![UVec3::ZERO];
        self.kinds[0] = Kind::Outside;
        while let Some(cell) = reached.pop() {
            for k in 0..6 {
                let Some(next) = self.neighbour(cell, k / 2, k % 2 == 1) else { continue };
                let index = self.index(next);
                if self.kinds[index] == Kind::Empty {
                    self.kinds[index] = Kind::Outside;
                    reached.push(next);
                }
            }
        }
    }

    /// Faces between outside cells and all other cells.
    fn surface(&self, origin: Vec3, edge: f32) -> TriMesh {
        let mut mesh = TriMesh::default();
        let mut numbers: HashMap<UVec3, u32> = HashMap::new();
        let is_outside = |cell: UVec3| self.kinds[self.index(cell)] == Kind::Outside;
        for z in 0..self.dims.z {
            for y in 0..self.dims.y {
                for cell in (0..self.dims.x).map(|x| UVec3::new(x, y, z)).filter(|&cell| !is_outside(cell)) {
                    for k in 0..6 {
                        let (axis, is_after) = (k / 2, k % 2 == 1);
                        if !self.neighbour(cell, axis, is_after).is_some_and(is_outside) {
                            continue;
                        }
                        let (u, v) = (UVec3::AXES[(axis + 1) % 3], UVec3::AXES[(axis + 2) % 3]);
                        let first = if is_after { cell + UVec3::AXES[axis] } else { cell };
                        let around = [first, first + u, first + u + v, first + v];
                        let [a, b, c, d] = around.map(|corner| {
                            *numbers.entry(corner).or_insert_with(|| {
                                mesh.positions.push(origin + edge * corner.as_vec3());
                                mesh.positions.len() as u32 - 1
                            })
                        });
                        let triangles =
                            if is_after { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                        mesh.triangles.extend(triangles);
                    }
                }
            }
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    /// Splats on a sphere of radius 1, denser than the cells, and a floater.
    fn sphere() -> Splats {
        let n = 20_000;
        let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
        let on_sphere = |k: usize| {
            let y = 1.0 - 2.0 * (k as f32 + 0.5) / n as f32;
            let (sin, cos) = (golden * k as f32).sin_cos();
            Vec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin)
        };
        let positions: Vec<Vec3> = (0..n).map(on_sphere).chain([Vec3::splat(100.0)]).collect();
        let count = positions.len();
        Splats {
            positions,
            scales: vec![Vec3::splat(0.02); count],
            rotations: vec![Quat::IDENTITY; count],
            opacities: vec![0.9; count],
            colors: vec![Vec3::ONE; count],
            ..Splats::default()
        }
    }

    /// The surface is closed, and at most the size of a splat plus a cell's diagonal away from the sphere. An inner
    /// surface would reduce the volume.
    #[test]
    fn the_surface_of_a_sphere_is_a_closed_shell() {
        let mesh = sphere().stand_in();
        let cell = 2.0 * 1.1 / CELLS;
        for p in &mesh.positions {
            assert!((p.length() - 1.0).abs() < 0.03 + 1.8 * cell, "{p}");
        }
        let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
        let mut volume = 0.0;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            volume += a.dot(b.cross(c)) / 6.0;
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&n| n == 0), "each edge has both directions");
        let of_sphere = 4.0 / 3.0 * std::f32::consts::PI;
        assert!(volume > of_sphere && volume < 1.3 * of_sphere, "{volume}");
    }

    #[test]
    fn captures_without_solid_splats_have_a_surface() {
        assert_eq!(Splats::default().stand_in(), TriMesh::default());
        let mut one = sphere();
        one.opacities.fill(0.1);
        assert!(!one.stand_in().triangles.is_empty());
    }
}
