//! Smooth cages by Catmull-Clark subdivision.
//!
//! Each vertex of the subdivided mesh is a weighted mean of the cage's vertices: a row of B (see [`crate::controls`]).
//! Values on the surface are close to cubic B-splines, so that the cage's edges do not show in the model. The columns
//! of the weights remain the cage's vertices.
//!
//! Source: Catmull and Clark 1978, "Recursively generated B-spline surfaces on arbitrary topological meshes".

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use crate::mesh::PolygonMesh;
use crate::weights::Weights;

/// A subdivided mesh and its relation to the original.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdivision {
    /// Vertices of each step: the vertices of the previous mesh, then one per edge (ordered by its ends), then one per
    /// face. Faces: one per corner of each face of the previous mesh, in order.
    pub mesh: PolygonMesh,
    /// Weights of the original vertices, non-negative, row sums 1. `[n_subdivided, n_vertices]`
    pub rows: Weights,
    /// Face of the original mesh from which each face comes. `[n_subdivided_faces]`
    pub face_of: Vec<u32>,
}

/// A sparse row in f64, columns ascending.
type Row = BTreeMap<u32, f64>;

/// Subdivides a closed mesh (two faces per edge) `steps` times. Vertices without faces stay in place.
///
/// # Panics
/// If a face has an invalid index.
#[must_use]
pub fn subdivide(mesh: &PolygonMesh, steps: u32) -> Subdivision {
    let mut rows: Vec<Row> = (0..mesh.positions.len() as u32).map(|i| Row::from([(i, 1.0)])).collect();
    let mut faces = mesh.faces.clone();
    let mut face_of: Vec<u32> = (0..faces.len() as u32).collect();
    for _ in 0..steps {
        (rows, faces, face_of) = step(&rows, &faces, &face_of);
    }
    let place = |row: &Row| -> Vec3 {
        let sum: DVec3 = row.iter().map(|(&i, &share)| share * mesh.positions[i as usize].as_dvec3()).sum();
        sum.as_vec3()
    };
    let positions = rows.iter().map(place).collect();
    let mut indptr = vec![0];
    let (mut indices, mut data) = (Vec::new(), Vec::new());
    for row in &rows {
        indices.extend(row.keys());
        data.extend(row.values().map(|&share| share as f32));
        indptr.push(indices.len() as u32);
    }
    let rows = Weights::from_parts(mesh.positions.len() as u32, indptr, indices, data);
    Subdivision { mesh: PolygonMesh { positions, faces }, rows, face_of }
}

/// One subdivision step: rows of the new vertices, new faces, and the original face of each new face.
fn step(rows: &[Row], faces: &[Vec<u32>], face_of: &[u32]) -> (Vec<Row>, Vec<Vec<u32>>, Vec<u32>) {
    let n = rows.len();
    let mean = |of: &mut dyn Iterator<Item = &Row>| {
        let of: Vec<&Row> = of.collect();
        combined(of.iter().map(|row| (*row, 1.0 / of.len() as f64)))
    };
    let face_points: Vec<Row> =
        faces.iter().map(|face| mean(&mut face.iter().map(|&i| &rows[i as usize]))).collect();
    // Collect the faces around each edge and each vertex.
    let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); n];
    for (f, face) in faces.iter().enumerate() {
        for (k, &a) in face.iter().enumerate() {
            let b = face[(k + 1) % face.len()];
            edges.entry([a.min(b), a.max(b)]).or_default().push(f);
            around[a as usize].push(f);
        }
    }
    let ends = |[a, b]: [u32; 2]| [&rows[a as usize], &rows[b as usize]];
    let mut new: Vec<Row> = Vec::with_capacity(n + edges.len() + faces.len());
    let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); n];
    for [a, b] in edges.keys() {
        neighbours[*a as usize].push(*b);
        neighbours[*b as usize].push(*a);
    }
    for (v, row) in rows.iter().enumerate() {
        let (faces, edges) = (&around[v], &neighbours[v]);
        if faces.is_empty() {
            new.push(row.clone());
            continue;
        }
        // A vertex P of valence n moves to (F + 2 R + (n - 3) P) / n, with F the mean of the face points and R the mean
        // of the edges' midpoints. 2 R is P plus the mean of the neighbours, so the weight of P is (n - 2) / n in all.
        let valence = faces.len() as f64;
        let of_faces = faces.iter().map(|&f| (&face_points[f], 1.0 / (valence * valence)));
        let of_edges = edges.iter().map(|&w| (&rows[w as usize], 1.0 / (valence * edges.len() as f64)));
        let own = std::iter::once((row, (valence - 2.0) / valence));
        new.push(combined(of_faces.chain(of_edges).chain(own)));
    }
    let mut edge_point = BTreeMap::new();
    for (&edge, faces) in &edges {
        edge_point.insert(edge, new.len() as u32);
        let of_faces = faces.iter().map(|&f| &face_points[f]);
        new.push(mean(&mut ends(edge).into_iter().chain(of_faces)));
    }
    let first_face_point = new.len() as u32;
    let (mut new_faces, mut new_face_of) = (Vec::new(), Vec::new());
    for (f, face) in faces.iter().enumerate() {
        let point_of = |a: u32, b: u32| edge_point[&[a.min(b), a.max(b)]];
        for (k, &i) in face.iter().enumerate() {
            let (before, after) = (face[(k + face.len() - 1) % face.len()], face[(k + 1) % face.len()]);
            new_faces.push(vec![i, point_of(i, after), first_face_point + f as u32, point_of(before, i)]);
            new_face_of.push(face_of[f]);
        }
    }
    new.extend(face_points);
    (new, new_faces, new_face_of)
}

/// Linear combination of rows.
fn combined<'a>(parts: impl Iterator<Item = (&'a Row, f64)>) -> Row {
    let mut sum = Row::new();
    for (row, factor) in parts {
        for (&column, share) in row {
            *sum.entry(column).or_default() += factor * share;
        }
    }
    sum
}

#[cfg(test)]
mod tests;
