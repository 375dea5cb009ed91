use super::*;
use crate::cage::shapes::{cube, prism, tetrahedron};

/// Tolerance for f32 rounding of rows.
const ROUNDING: f64 = 1e-6;

/// One subdivision step on quads by an independent formulation. Faces are split bilinearly; then each vertex moves
/// towards the mean of its quads' centroids by the factor 4 divided by its valence. Source: Warren and Schaefer 2004,
/// "A factored approach to subdivision surfaces".
fn factored(values: &[f64], faces: &[Vec<u32>]) -> (Vec<f64>, Vec<Vec<u32>>) {
    let mut split = values.to_vec();
    let mut middle_of: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for face in faces {
        for (k, &a) in face.iter().enumerate() {
            let b = face[(k + 1) % face.len()];
            middle_of.entry([a.min(b), a.max(b)]).or_default();
        }
    }
    for (edge, number) in &mut middle_of {
        *number = split.len() as u32;
        split.push(0.5 * (values[edge[0] as usize] + values[edge[1] as usize]));
    }
    let mut quads = Vec::new();
    for face in faces {
        let middle = split.len() as u32;
        split.push(face.iter().map(|&i| values[i as usize]).sum::<f64>() / face.len() as f64);
        for (k, &i) in face.iter().enumerate() {
            let to = |j: u32| middle_of[&[i.min(j), i.max(j)]];
            let (before, after) = (face[(k + face.len() - 1) % face.len()], face[(k + 1) % face.len()]);
            quads.push(vec![i, to(after), middle, to(before)]);
        }
    }
    let mut sums = vec![(0.0, 0.0); split.len()];
    for quad in &quads {
        let middle = quad.iter().map(|&i| split[i as usize]).sum::<f64>() / 4.0;
        for &i in quad {
            sums[i as usize].0 += middle;
            sums[i as usize].1 += 1.0;
        }
    }
    let averaged = split.iter().zip(sums).map(|(v, (sum, n))| v + 4.0 / n * (sum / n - v)).collect();
    (averaged, quads)
}

#[test]
fn rows_equal_those_of_the_factored_scheme() {
    let l_shape = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    // Quads with vertices of valence three to six.
    let of_quads = |mesh| subdivide(&mesh, 1).mesh;
    for mesh in [cube(), of_quads(tetrahedron()), of_quads(prism(&l_shape, 1.0))] {
        let made = subdivide(&mesh, 2);
        assert_eq!(made.rows.n_columns(), mesh.positions.len());
        for column in 0..mesh.positions.len() {
            let mut values: Vec<f64> = (0..mesh.positions.len()).map(|i| f64::from(i == column)).collect();
            let mut faces = mesh.faces.clone();
            for _ in 0..2 {
                (values, faces) = factored(&values, &faces);
            }
            assert_eq!(made.mesh.faces, faces);
            for (expected, actual) in values.iter().zip(made.rows.column(column as u32)) {
                assert!((expected - f64::from(actual)).abs() < ROUNDING, "{actual}, not {expected}");
                assert!(actual >= 0.0);
            }
        }
        for (_, row) in made.rows.rows() {
            assert!((row.iter().map(|&w| f64::from(w)).sum::<f64>() - 1.0).abs() < ROUNDING);
        }
    }
}

/// Positions along the diagonal of a cube, with the corner at 1: face centres are at 1/3 and edge midpoints at 2/3. The
/// corner, of valence 3, moves to (F + 2 R) / 3 = (1/3 + 4/3) / 3 = 5/9.
#[test]
fn corner_of_a_cube_moves_to_five_ninths() {
    let mesh = PolygonMesh { positions: cube().positions.iter().map(|p| 2.0 * p - 1.0).collect(), ..cube() };
    let made = subdivide(&mesh, 1);
    assert!(made.mesh.positions[7].distance(Vec3::splat(5.0 / 9.0)) < 1e-6, "{}", made.mesh.positions[7]);
    assert_eq!((made.mesh.positions.len(), made.mesh.faces.len()), (26, 24));
    assert_eq!(made.face_of, (0..24).map(|k| k / 4).collect::<Vec<u32>>());
}

/// The Catmull-Clark rules on triangles, evaluated by hand. A vertex of valence three moves to the mean of itself, of
/// its neighbours' mean and of its faces' centroids' mean. An edge point is the mean of two ends and two centroids.
#[test]
fn rows_of_a_tetrahedron_are_simple_fractions() {
    let rows = subdivide(&tetrahedron(), 1).rows;
    let expected = [
        (0, [12.0 / 27.0, 5.0 / 27.0, 5.0 / 27.0, 5.0 / 27.0]),
        // Row 4 is the first edge point, that of the edge between vertices 0 and 1.
        (4, [5.0 / 12.0, 5.0 / 12.0, 1.0 / 12.0, 1.0 / 12.0]),
        // Row 10 is the first face point; its face does not contain vertex 3.
        (10, [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.0]),
    ];
    for (row, expected) in expected {
        for (column, expected) in (0u32..).zip(expected) {
            let actual = rows.column(column).nth(row).unwrap();
            assert!((actual - expected).abs() < 1e-6, "row {row}, column {column}: {actual}, not {expected}");
        }
    }
}

#[test]
fn zero_steps_are_the_identity_and_unused_vertices_stay() {
    let mut mesh = tetrahedron();
    mesh.positions.push(Vec3::splat(9.0));
    assert_eq!(subdivide(&mesh, 0).mesh, mesh);
    assert_eq!(subdivide(&mesh, 2).mesh.positions[4], Vec3::splat(9.0));
}
