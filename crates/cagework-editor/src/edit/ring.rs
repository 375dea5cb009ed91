//! Rings of a cage: closed loops of edges, as around an arm.

use glam::Vec3;

use super::pick::Topology;

impl Topology {
    /// Finds the shortest ring that contains all the given vertices, in order around it. A ring is one side of a closed
    /// strip of quads, so it also exists at the end of a limb and where a limb leaves the trunk.
    ///
    /// `positions`: of all vertices, object units. `None` if there is no ring through the vertices.
    #[must_use]
    pub fn ring(&self, vertices: &[u32], positions: &[Vec3]) -> Option<Vec<u32>> {
        let &first = vertices.first()?;
        let rings =
            self.faces.iter().enumerate().filter(|(_, face)| face.contains(&first)).flat_map(|(f, face)| {
                let k = face.iter().position(|&v| v == first).unwrap_or(0);
                let neighbours = [face[(k + 1) % face.len()], face[(k + face.len() - 1) % face.len()]];
                neighbours.map(|next| self.ring_beside(f, [first, next]))
            });
        let has_all = |ring: &Vec<u32>| vertices.iter().all(|v| ring.contains(v));
        let length = |ring: &[u32]| -> f32 {
            let ends = ring.iter().zip(ring.iter().cycle().skip(1));
            ends.map(|(&a, &b)| positions[a as usize].distance(positions[b as usize])).sum()
        };
        rings.flatten().filter(has_all).min_by(|a, b| length(a).total_cmp(&length(b)))
    }

    /// The vertices along one side of the strip of quads that begins with a face, from an edge of this face on. `None`
    /// if the strip reaches a face that is not a quad, or does not close.
    fn ring_beside(&self, mut face: usize, [start, mut end]: [u32; 2]) -> Option<Vec<u32>> {
        let (first, mut ring, mut before) = (face, vec![start], start);
        loop {
            // The quad has the corners `before`, `end` and, behind `end`, the other end of the edge to the next quad.
            let across = self.beside(face, end, before)?;
            let is_next = |f: &usize| *f != face && [end, across].iter().all(|v| self.faces[*f].contains(v));
            face = (0..self.faces.len()).find(is_next)?;
            if face == first {
                return (end == start).then_some(ring);
            }
            if ring.contains(&end) {
                return None;
            }
            ring.push(end);
            (before, end) = (end, self.beside(face, end, across)?);
        }
    }

    /// The neighbour of `vertex` in a quad that is not `other`.
    fn beside(&self, face: usize, vertex: u32, other: u32) -> Option<u32> {
        let corners: [u32; 4] = self.faces[face].as_slice().try_into().ok()?;
        let k = corners.iter().position(|&v| v == vertex)?;
        [corners[(k + 1) % 4], corners[(k + 3) % 4]].into_iter().find(|&v| v != other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square tube of `n` segments along z, closed by quads; ring `k` has the vertices `4 k..4 k + 4`.
    fn tube(n: u32) -> (Vec<Vec3>, Vec<Vec<u32>>) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let positions = (0..=n).flat_map(|k| corners.map(|[x, y]| Vec3::new(x, y, k as f32))).collect();
        let side =
            |k: u32, c: u32| vec![4 * k + c, 4 * k + (c + 1) % 4, 4 * k + 4 + (c + 1) % 4, 4 * k + 4 + c];
        let mut faces: Vec<Vec<u32>> = (0..n).flat_map(|k| (0..4).map(move |c| side(k, c))).collect();
        faces.extend([vec![3, 2, 1, 0], vec![4 * n, 4 * n + 1, 4 * n + 2, 4 * n + 3]]);
        (positions, faces)
    }

    fn sorted(ring: Option<Vec<u32>>) -> Option<Vec<u32>> {
        ring.map(|mut ring| {
            ring.sort_unstable();
            ring
        })
    }

    #[test]
    fn the_ring_around_a_tube_is_found_from_each_vertex_and_edge() {
        let (positions, faces) = tube(5);
        let topology = Topology::new(&faces);
        for vertex in 0..24 {
            let around: Vec<u32> = (vertex / 4 * 4..vertex / 4 * 4 + 4).collect();
            assert_eq!(sorted(topology.ring(&[vertex], &positions)), Some(around.clone()), "{vertex}");
            let next = vertex / 4 * 4 + (vertex + 1) % 4;
            assert_eq!(sorted(topology.ring(&[vertex, next], &positions)), Some(around));
        }
        // An edge along the tube lies on the loops that run over both ends.
        assert_eq!(topology.ring(&[8, 12], &positions).map(|ring| ring.len()), Some(12));
        assert_eq!(topology.ring(&[0, 22], &positions), None);
        assert_eq!(topology.ring(&[], &positions), None);
    }

    /// A limb of two segments leaves the side `[9, 10, 14, 13]` of the tube.
    #[test]
    fn the_ring_at_the_base_of_a_limb_is_found() {
        let (mut positions, mut faces) = tube(5);
        let base = faces.iter().position(|f| *f == [9, 10, 14, 13]).unwrap();
        faces.remove(base);
        let mut ring = [9, 10, 14, 13];
        for x in [1.5, 2.0] {
            let first = positions.len() as u32;
            let outer =
                ring.map(|v| Vec3::new(x, 0.3 + 0.4 * positions[v as usize].y, positions[v as usize].z));
            positions.extend(outer);
            let next = [first, first + 1, first + 2, first + 3];
            faces.extend((0..4).map(|c| vec![ring[c], ring[(c + 1) % 4], next[(c + 1) % 4], next[c]]));
            ring = next;
        }
        faces.push(ring.to_vec());
        let topology = Topology::new(&faces);
        assert_eq!(sorted(topology.ring(&[9, 14], &positions)), Some(vec![9, 10, 13, 14]));
        assert_eq!(sorted(topology.ring(&[24], &positions)), Some(vec![24, 25, 26, 27]));
        // Beside the limb, the tube has a ring of its own again.
        assert_eq!(sorted(topology.ring(&[4], &positions)), Some(vec![4, 5, 6, 7]));
    }

    #[test]
    fn there_are_no_rings_through_triangles() {
        let faces = [vec![0, 2, 1], vec![0, 1, 3], vec![1, 2, 3], vec![2, 0, 3]];
        let topology = Topology::new(&faces);
        assert_eq!(topology.ring(&[0], &[Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]), None);
    }
}
