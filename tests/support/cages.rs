//! Valid cages of simple shapes.

use std::collections::{BTreeMap, BTreeSet};

use cagework_core::{Cage, PolygonMesh};
use glam::Vec3;

/// Builds a cage from a mesh of this module.
///
/// # Panics
/// If the mesh is not a valid cage.
#[must_use]
pub fn cage(mesh: &PolygonMesh) -> Cage {
    Cage::new(mesh).expect("test cages are closed and not degenerate")
}

/// Creates a tetrahedron. The orientation may be inward: [`Cage::new`] flips it if needed.
#[must_use]
pub fn tetrahedron(corners: [Vec3; 4]) -> PolygonMesh {
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(Vec::from).to_vec();
    PolygonMesh { positions: corners.to_vec(), faces }
}

/// Creates a box of six quads. Bit k of a vertex index selects `min` or `max` on axis k.
#[must_use]
pub fn cuboid(min: Vec3, max: Vec3) -> PolygonMesh {
    let at = |v: u32, axis: usize| if v >> axis & 1 == 0 { min[axis] } else { max[axis] };
    PolygonMesh {
        positions: (0..8).map(|v| Vec3::new(at(v, 0), at(v, 1), at(v, 2))).collect(),
        faces: [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .map(Vec::from)
            .to_vec(),
    }
}

/// Creates the octahedron with vertices on the axes at distance 1 from the origin, in the order +x, -x, +y, -y, +z, -z.
#[must_use]
pub fn octahedron() -> PolygonMesh {
    let positions = Vec3::AXES.iter().flat_map(|&a| [a, -a]).collect();
    let faces = (0..8u32).map(|octant| {
        let [x, y, z] = [octant & 1, 2 + (octant >> 1 & 1), 4 + (octant >> 2 & 1)];
        // An odd number of reflected axes reverses the orientation.
        if octant.count_ones().is_multiple_of(2) { vec![x, y, z] } else { vec![x, z, y] }
    });
    PolygonMesh { positions, faces: faces.collect() }
}

/// Creates the regular icosahedron with vertices at distance 1 from the origin.
#[must_use]
pub fn icosahedron() -> PolygonMesh {
    let golden = f32::midpoint(1.0, 5.0_f32.sqrt());
    let corner = |k: usize| {
        let sign = |bit: usize| if k >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let mut at = [0.0, sign(0), sign(1) * golden];
        at.rotate_right(k / 4);
        Vec3::from(at)
    };
    let positions: Vec<Vec3> = (0..12).map(corner).collect();
    // Before normalisation, adjacent corners are at a distance of 2 from each other.
    let is_near = |a: usize, b: usize| (positions[a].distance(positions[b]) - 2.0).abs() < 1e-3;
    let mut faces = Vec::new();
    for (a, b, c) in (0..12).flat_map(|a| (a..12).flat_map(move |b| (b..12).map(move |c| (a, b, c)))) {
        if is_near(a, b) && is_near(b, c) && is_near(c, a) {
            let is_outward = positions[a].dot(positions[b].cross(positions[c])) > 0.0;
            let [b, c] = if is_outward { [b, c] } else { [c, b] };
            faces.push(vec![a as u32, b as u32, c as u32]);
        }
    }
    PolygonMesh { positions: positions.into_iter().map(Vec3::normalize).collect(), faces }
}

/// Subdivides an octahedron `times` times (each face into four) and projects it onto the unit sphere: 6, 18, 66, 258,
/// 1,026 vertices for 0 to 4.
#[must_use]
pub fn sphere(times: u32) -> PolygonMesh {
    rounded(octahedron(), times)
}

/// Subdivides an icosahedron `times` times (each face into four) and projects it onto the unit sphere: 12, 42, 162,
/// 642, 2,562 vertices for 0 to 4.
#[must_use]
pub fn icosphere(times: u32) -> PolygonMesh {
    rounded(icosahedron(), times)
}

fn rounded(mut mesh: PolygonMesh, times: u32) -> PolygonMesh {
    for _ in 0..times {
        let mut middles = BTreeMap::new();
        let mut positions = mesh.positions;
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let mut faces = Vec::new();
        for f in &mesh.faces {
            let [a, b, c] = [f[0], f[1], f[2]];
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            faces.extend([vec![a, ab, ca], vec![ab, b, bc], vec![ca, bc, c], vec![ab, bc, ca]]);
        }
        mesh = PolygonMesh { positions, faces };
    }
    mesh
}

/// Creates the prism over a counter-clockwise outline in x and y, from z = 0 to `height`: two polygons, and a quad per
/// side.
#[must_use]
pub fn prism(outline: &[[f32; 2]], height: f32) -> PolygonMesh {
    let n = outline.len() as u32;
    let level = |z: f32| outline.iter().map(move |&[x, y]| Vec3::new(x, y, z));
    let mut faces = vec![(0..n).rev().collect(), (n..2 * n).collect::<Vec<u32>>()];
    faces.extend((0..n).map(|k| vec![k, (k + 1) % n, (k + 1) % n + n, k + n]));
    PolygonMesh { positions: level(0.0).chain(level(height)).collect(), faces }
}

/// Creates the prism over a regular pentagon of radius 1, from z = 0 to 1.5.
#[must_use]
pub fn pentagonal_prism() -> PolygonMesh {
    let outline: Vec<[f32; 2]> = (0..5)
        .map(|k| (k as f32 * std::f32::consts::TAU / 5.0).sin_cos())
        .map(|(sin, cos)| [cos, sin])
        .collect();
    prism(&outline, 1.5)
}

/// Creates the surface of a union of unit cubes with these minimum corners: a quad per exposed side, with shared
/// vertices. No two cubes may touch only along an edge or at a corner.
#[must_use]
pub fn blocks(cubes: &[[i32; 3]]) -> PolygonMesh {
    let filled: BTreeSet<[i32; 3]> = cubes.iter().copied().collect();
    let mut vertices: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let mut mesh = PolygonMesh::default();
    for cube in &filled {
        for axis in 0..3 {
            // (u, v, axis) is right-handed, so a quad that is counter-clockwise in u and v faces in the positive
            // direction of the axis.
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for up in [false, true] {
                let mut beside = *cube;
                beside[axis] += if up { 1 } else { -1 };
                if filled.contains(&beside) {
                    continue;
                }
                let mut corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
                if !up {
                    corners.reverse();
                }
                let face = corners.map(|[du, dv]| {
                    let mut p = *cube;
                    p[u] += du;
                    p[v] += dv;
                    p[axis] += i32::from(up);
                    *vertices.entry(p).or_insert_with(|| {
                        mesh.positions.push(Vec3::from_array(p.map(|x| x as f32)));
                        mesh.positions.len() as u32 - 1
                    })
                });
                mesh.faces.push(face.to_vec());
            }
        }
    }
    mesh
}

/// Creates an L of three unit cubes: two arms of length 1 along x and y.
#[must_use]
pub fn l_shape() -> PolygonMesh {
    blocks(&[[0, 0, 0], [1, 0, 0], [0, 1, 0]])
}

/// Creates a C of unit cubes: arms `[1, 4] x [0, 1]` and `[1, 4] x [2, 3]` on a back `[0, 1] x [0, 3]`, from z = 0 to
/// 1.
#[must_use]
pub fn c_shape() -> PolygonMesh {
    let arms = (1..4).flat_map(|x| [[x, 0, 0], [x, 2, 0]]);
    blocks(&arms.chain((0..3).map(|y| [0, y, 0])).collect::<Vec<_>>())
}

/// Creates the shape of [`c_shape`] with one concave polygon for each of its two caps; 16 vertices.
#[must_use]
pub fn c_prism() -> PolygonMesh {
    const OUTLINE: [[f32; 2]; 8] =
        [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 2.0], [4.0, 2.0], [4.0, 3.0], [0.0, 3.0]];
    let n = OUTLINE.len() as u32;
    let level = |z: f32| OUTLINE.iter().map(move |&[x, y]| Vec3::new(x, y, z));
    let mut faces = vec![(0..n).rev().collect(), (n..2 * n).collect::<Vec<u32>>()];
    faces.extend((0..n).map(|k| vec![k, (k + 1) % n, (k + 1) % n + n, k + n]));
    PolygonMesh { positions: level(0.0).chain(level(1.0)).collect(), faces }
}

/// Creates a bar of length 4 with a square cross-section of side `thickness`, not aligned with an axis.
#[must_use]
pub fn thin_bar(thickness: f32) -> PolygonMesh {
    let long = blocks(&[[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]);
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    moved(&long, |p| turn * (p * Vec3::new(1.0, thickness, thickness)))
}

/// Maps every vertex of a mesh by `to`.
#[must_use]
pub fn moved(mesh: &PolygonMesh, to: impl Fn(Vec3) -> Vec3) -> PolygonMesh {
    PolygonMesh { positions: mesh.positions.iter().map(|&p| to(p)).collect(), faces: mesh.faces.clone() }
}

/// Creates the disjoint union of two meshes; the vertices of `a` come first.
#[must_use]
pub fn together(a: &PolygonMesh, b: &PolygonMesh) -> PolygonMesh {
    let n = a.positions.len() as u32;
    let mut both = a.clone();
    both.positions.extend(&b.positions);
    both.faces.extend(b.faces.iter().map(|f| f.iter().map(|i| i + n).collect::<Vec<u32>>()));
    both
}

/// Reverses all faces of a mesh.
#[must_use]
pub fn inside_out(mesh: &PolygonMesh) -> PolygonMesh {
    let mut turned = mesh.clone();
    for face in &mut turned.faces {
        face.reverse();
    }
    turned
}

/// Splits every polygon of a mesh into a fan of triangles at its first vertex.
#[must_use]
pub fn triangulated(mesh: &PolygonMesh) -> PolygonMesh {
    let faces = mesh.faces.iter().flat_map(|f| (2..f.len()).map(move |k| vec![f[0], f[k - 1], f[k]]));
    PolygonMesh { positions: mesh.positions.clone(), faces: faces.collect() }
}
