//! Small valid cages for tests, oriented outward.

use glam::Vec3;

use crate::mesh::PolygonMesh;

fn mesh(positions: &[[f32; 3]], faces: &[&[u32]]) -> PolygonMesh {
    PolygonMesh {
        positions: positions.iter().map(|&p| p.into()).collect(),
        faces: faces.iter().map(|f| f.to_vec()).collect(),
    }
}

/// A tetrahedron with a corner at the origin and edges of length 1 along the axes.
pub(crate) fn tetrahedron() -> PolygonMesh {
    mesh(
        &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        &[&[0, 2, 1], &[0, 1, 3], &[0, 3, 2], &[1, 2, 3]],
    )
}

/// An octahedron with corners at distance 1 on the axes.
pub(crate) fn octahedron() -> PolygonMesh {
    let mut positions = Vec::new();
    for axis in Vec3::AXES {
        positions.extend([axis, -axis]);
    }
    let mut faces = Vec::new();
    for (i, j, k) in [(0, 2, 4), (1, 4, 2), (3, 4, 0), (5, 2, 0), (1, 3, 5), (1, 2, 5), (3, 0, 5), (3, 1, 4)]
    {
        let corners = [i, j, k].map(|v: u32| positions[v as usize]);
        let outward = corners[0].dot(corners[1].cross(corners[2])) > 0.0;
        faces.push(if outward { vec![i, j, k] } else { vec![i, k, j] });
    }
    PolygonMesh { positions, faces }
}

/// A box of quads. Its vertex `x + 2 y + 4 z` is at `min` along axes with the digit 0 and at `max` along axes with 1.
pub(crate) fn cuboid(min: Vec3, max: Vec3) -> PolygonMesh {
    let at = |v: u32, axis: usize| if v >> axis & 1 == 0 { min[axis] } else { max[axis] };
    PolygonMesh {
        positions: (0..8).map(|v| Vec3::new(at(v, 0), at(v, 1), at(v, 2))).collect(),
        faces: [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .iter()
            .map(|f: &[u32; 4]| f.to_vec())
            .collect(),
    }
}

/// The cube `[0, 1]^3`.
pub(crate) fn cube() -> PolygonMesh {
    cuboid(Vec3::ZERO, Vec3::ONE)
}

/// The prism of a counter-clockwise outline in x and y, from z = 0 to `height`.
pub(crate) fn prism(outline: &[[f32; 2]], height: f32) -> PolygonMesh {
    let n = outline.len() as u32;
    let level = |z: f32| outline.iter().map(move |&[x, y]| Vec3::new(x, y, z));
    let mut faces = vec![(0..n).rev().collect(), (n..2 * n).collect::<Vec<u32>>()];
    faces.extend((0..n).map(|k| vec![k, (k + 1) % n, (k + 1) % n + n, k + n]));
    PolygonMesh { positions: level(0.0).chain(level(height)).collect(), faces }
}

/// An L-shape: `[0, 2]^2` without `(1, 2]^2`, from z = 0 to 1.
pub(crate) fn l_shape() -> PolygonMesh {
    prism(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]], 1.0)
}

/// A C-shape: arms `[1, 3] x [0, 1]` and `[1, 3] x [2, 3]` on a back `[0, 1] x [0, 3]`, from z = 0 to 1.
pub(crate) fn c_shape() -> PolygonMesh {
    let outline =
        [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [3.0, 2.0], [3.0, 3.0], [0.0, 3.0]];
    prism(&outline, 1.0)
}

pub(crate) fn together(a: &PolygonMesh, b: &PolygonMesh) -> PolygonMesh {
    let n = a.positions.len() as u32;
    let mut both = a.clone();
    both.positions.extend(&b.positions);
    both.faces.extend(b.faces.iter().map(|f| f.iter().map(|i| i + n).collect::<Vec<u32>>()));
    both
}

pub(crate) fn inside_out(mut mesh: PolygonMesh) -> PolygonMesh {
    for face in &mut mesh.faces {
        face.reverse();
    }
    mesh
}
