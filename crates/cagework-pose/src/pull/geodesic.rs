//! Approximate geodesic distances: shortest paths along the model's edges (Dijkstra 1959).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::Vec3;

use cagework_core::disjoint::DisjointSets;
use cagework_core::mesh::weld;
use cagework_core::nearest::KdTree;

/// Lower limit on the lengths of the graph's edges, including bridges, as a fraction of the model's size.
const MIN_BRIDGE_LENGTH: f32 = 1e-9;

/// Graph of the model's edges. Vertices at equal positions are one node. A bridge joins each component to the largest
/// one, between their nearest nodes.
pub(super) struct Geodesic {
    /// Node at the position of each vertex. `[n_vertices]`
    unique_of: Vec<u32>,
    starts: Vec<u32>,
    neighbours: Vec<(u32, f32)>,
}

impl Geodesic {
    /// Builds the graph of a model. `size`: diagonal of the model's box.
    pub(super) fn new(positions: &[Vec3], triangles: &[[u32; 3]], size: f32) -> Self {
        let welded = weld(positions);
        let points: Vec<Vec3> = welded.first.iter().map(|&v| positions[v as usize]).collect();
        let unique_of = welded.unique_of;
        let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * triangles.len());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| unique_of[v as usize]);
            edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]));
        }
        edges.retain(|[a, b]| a != b);
        edges.sort_unstable();
        edges.dedup();
        edges.extend(bridges(&points, &edges));
        let length =
            |[a, b]: [u32; 2]| points[a as usize].distance(points[b as usize]).max(MIN_BRIDGE_LENGTH * size);
        let mut starts = vec![0_u32; points.len() + 1];
        for &[a, b] in &edges {
            starts[a as usize + 1] += 1;
            starts[b as usize + 1] += 1;
        }
        for i in 0..points.len() {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut neighbours = vec![(0, 0.0); 2 * edges.len()];
        for edge in edges {
            for [from, to] in [edge, [edge[1], edge[0]]] {
                neighbours[next[from as usize] as usize] = (to, length(edge));
                next[from as usize] += 1;
            }
        }
        Self { unique_of, starts, neighbours }
    }

    /// Computes the distance of each vertex from `seed` along edges, object units; infinite beyond `limit`.
    /// `[n_vertices]`
    pub(super) fn from(&self, seed: u32, limit: f32) -> Vec<f32> {
        let mut distance = vec![f32::INFINITY; self.starts.len() - 1];
        let first = self.unique_of[seed as usize];
        distance[first as usize] = 0.0;
        // Non-negative floats are ordered like their bit patterns.
        let mut heap = BinaryHeap::from([Reverse((0_u32, first))]);
        while let Some(Reverse((bits, at))) = heap.pop() {
            let here = f32::from_bits(bits);
            if here > distance[at as usize] {
                continue;
            }
            let [start, end] = [0, 1].map(|k| self.starts[at as usize + k] as usize);
            for &(to, length) in &self.neighbours[start..end] {
                let there = here + length;
                if there < distance[to as usize] && there < limit {
                    distance[to as usize] = there;
                    heap.push(Reverse((there.to_bits(), to)));
                }
            }
        }
        self.unique_of.iter().map(|&u| distance[u as usize]).collect()
    }
}

/// Finds one edge from each smaller component to the nearest node of the largest one.
fn bridges(points: &[Vec3], edges: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let mut sets = DisjointSets::new(points.len());
    for &[a, b] in edges {
        sets.join(a, b);
    }
    let roots: Vec<u32> = (0..points.len() as u32).map(|i| sets.root(i)).collect();
    let mut sizes = vec![0_u32; points.len()];
    for &r in &roots {
        sizes[r as usize] += 1;
    }
    let Some(largest) = (0..sizes.len()).max_by_key(|&r| (sizes[r], Reverse(r))) else { return Vec::new() };
    if sizes[largest] as usize == points.len() {
        return Vec::new();
    }
    let belongs = |i: &u32| roots[*i as usize] as usize == largest;
    let (inside, others): (Vec<u32>, Vec<u32>) = (0..points.len() as u32).partition(belongs);
    let nearest = KdTree::new(points, inside);
    let mut best: Vec<Option<([u32; 2], f32)>> = vec![None; points.len()];
    for i in others {
        let best = &mut best[roots[i as usize] as usize];
        let limit = best.map_or(f32::INFINITY, |(_, squared)| squared);
        if let Some((to, squared)) = nearest.find(points[i as usize], limit) {
            *best = Some(([to.min(i), to.max(i)], squared));
        }
    }
    best.into_iter().flatten().map(|(edge, _)| edge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_follow_edges_and_one_bridge() {
        // Two unit squares side by side, separated by a seam (vertices 1 and 4), and a triangle at a distance of 2.
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let positions = [
            at(0.0, 0.0),
            at(1.0, 0.0),
            at(1.0, 1.0),
            at(0.0, 1.0),
            at(1.0, 0.0),
            at(2.0, 0.0),
            at(4.0, 0.0),
            at(5.0, 0.0),
            at(5.0, 1.0),
        ];
        let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 2], [6, 7, 8]];
        let geodesic = Geodesic::new(&positions, &triangles, 5.0);
        let root2 = 2.0_f32.sqrt();
        let expected = [0.0, 1.0, root2, 1.0, 1.0, 2.0, 4.0, 5.0, 4.0 + root2];
        let found = geodesic.from(0, f32::INFINITY);
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
        assert_eq!(geodesic.from(0, 1.5)[5..], [f32::INFINITY; 4]);
    }
}
