//! Closest point on triangles, by a tree of bounding boxes around halves of them.

use glam::{DVec3, Vec3};

use crate::geometry::closest_point_on_triangle;
use crate::mesh::TriMesh;

/// Largest number of triangles of a leaf.
const LEAF: usize = 4;

pub(crate) struct TriangleTree<'a> {
    mesh: &'a TriMesh,
    /// Triangles. Each inner node splits its range in the middle.
    order: Vec<u32>,
    /// Corners of the nodes' boxes. The children of node `k` are `2k + 1` and `2k + 2`.
    boxes: Vec<[DVec3; 2]>,
}

/// The closest point on a mesh.
#[derive(Clone, Copy)]
pub(crate) struct Hit {
    pub(super) corners: [u32; 3],
    pub(super) triangle: u32,
    /// Barycentric coordinates.
    pub(super) shares: [f64; 3],
    pub(crate) distance: f64,
}

impl<'a> TriangleTree<'a> {
    pub(crate) fn new(mesh: &'a TriMesh) -> Self {
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let mut tree = Self { mesh, order: Vec::new(), boxes: Vec::new() };
        tree.split(&mut order, 0);
        Self { order, ..tree }
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.triangles[triangle as usize].map(|v| self.mesh.positions[v as usize].as_dvec3())
    }

    fn split(&mut self, order: &mut [u32], node: usize) {
        let corners = || order.iter().flat_map(|&t| self.corners(t));
        let [low, high] =
            [corners().fold(DVec3::INFINITY, DVec3::min), corners().fold(DVec3::NEG_INFINITY, DVec3::max)];
        self.boxes.resize(self.boxes.len().max(node + 1), [DVec3::ZERO; 2]);
        self.boxes[node] = [low, high];
        if order.len() > LEAF {
            let axis = (high - low).max_position();
            let middle = |&t: &u32| self.corners(t).iter().map(|p| p[axis]).sum::<f64>();
            let half = order.len() / 2;
            order.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
            let (first, second) = order.split_at_mut(half);
            self.split(first, 2 * node + 1);
            self.split(second, 2 * node + 2);
        }
    }

    /// Closest point to `point`; `None` without triangles.
    pub(crate) fn closest(&self, point: Vec3) -> Option<Hit> {
        let mut best = None;
        self.search((&self.order, 0), point.as_dvec3(), &mut best);
        best
    }

    fn search(&self, (order, node): (&[u32], usize), point: DVec3, best: &mut Option<Hit>) {
        let distance = |node: usize| {
            let [low, high] = self.boxes[node];
            point.distance(point.clamp(low, high))
        };
        if best.is_some_and(|best| distance(node) >= best.distance) {
            return;
        }
        if order.len() > LEAF {
            let (first, second) = order.split_at(order.len() / 2);
            let mut children = [(first, 2 * node + 1), (second, 2 * node + 2)];
            children.sort_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
            return children.into_iter().for_each(|child| self.search(child, point, best));
        }
        for &triangle in order {
            let hit = closest_point_on_triangle(point, self.corners(triangle));
            let distance = hit.point.distance(point);
            if best.is_none_or(|best| distance < best.distance) {
                let corners = self.mesh.triangles[triangle as usize];
                *best = Some(Hit { corners, triangle, shares: hit.barycentric, distance });
            }
        }
    }
}

impl Hit {
    /// Interpolates values of the vertices.
    pub(super) fn blend<T>(&self, value: impl Fn(usize) -> T) -> T
    where
        f32: std::ops::Mul<T, Output = T>,
        T: std::ops::Add<Output = T>,
    {
        let ([a, b, c], [u, v, w]) =
            (self.corners.map(|v| value(v as usize)), self.shares.map(|share| share as f32));
        u * a + v * b + w * c
    }
}
