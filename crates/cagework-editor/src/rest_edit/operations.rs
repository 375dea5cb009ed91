//! The edit operations.

use std::collections::{BTreeSet, HashMap, HashSet};

use glam::{DVec3, Vec3};

use super::{CageEdit, RestEditError, finish};
use cagework_core::PolygonMesh;
use cagework_core::fill::{loops, triangulate};

/// Moves vertices. `moves`: pairs of a vertex and its new position, object units.
///
/// # Errors
/// [`RestEditError`]: a vertex does not exist, a position is not finite, or the cage would become invalid.
pub fn move_vertices(mesh: &PolygonMesh, moves: &[(u32, Vec3)]) -> Result<CageEdit, RestEditError> {
    let mut edited = unchanged(mesh);
    for &(v, p) in moves {
        if !p.is_finite() {
            return Err(RestEditError::NotFinite { what: "the new position" });
        }
        let slot = edited.mesh.positions.get_mut(v as usize);
        *slot.ok_or_else(|| missing("vertex", &[v]))? = p;
        edited.touched.push(v);
    }
    finish("moving", mesh, edited)
}

/// Splits an edge at `share` of its length from the first end (clamped to 0.05 to 0.95). Adjacent triangles are
/// divided; larger faces get an additional corner. The new vertex is the last one.
///
/// # Errors
/// [`RestEditError`]: the edge does not exist, `share` is not finite, or the cage would become invalid.
pub fn split_edge(mesh: &PolygonMesh, edge: [u32; 2], share: f32) -> Result<CageEdit, RestEditError> {
    let [p, q] = ends(mesh, edge)?;
    if !share.is_finite() {
        return Err(RestEditError::NotFinite { what: "the position on the edge" });
    }
    let mut edited = unchanged(mesh);
    let new = mesh.positions.len() as u32;
    edited.mesh.positions.push(p.lerp(q, share.clamp(0.05, 0.95)));
    edited.touched.push(new);
    edited.made_from.push(edge);
    edited.mesh.faces.clear();
    for face in &mesh.faces {
        let Some(k) = side(face, edge) else {
            edited.mesh.faces.push(face.clone());
            continue;
        };
        let (a, b) = (face[k], face[(k + 1) % face.len()]);
        if let &[_, _, _] = face.as_slice() {
            let tip = face[(k + 2) % 3];
            edited.mesh.faces.push(vec![a, new, tip]);
            edited.mesh.faces.push(vec![new, b, tip]);
        } else {
            let mut longer = face.clone();
            longer.insert(k + 1, new);
            edited.mesh.faces.push(longer);
        }
    }
    finish("splitting", mesh, edited)
}

/// Merges the ends of an edge into the first one, at `share` of the edge's length from it (clamped to 0 to 1). Faces
/// left with two corners are removed.
///
/// # Errors
/// [`RestEditError`]: the edge does not exist, `share` is not finite, or the cage would become invalid.
pub fn collapse_edge(mesh: &PolygonMesh, edge: [u32; 2], share: f32) -> Result<CageEdit, RestEditError> {
    let [p, q] = ends(mesh, edge)?;
    if !share.is_finite() {
        return Err(RestEditError::NotFinite { what: "the position on the edge" });
    }
    let [kept, gone] = edge;
    let mut edited = unchanged(mesh);
    edited.mesh.positions[kept as usize] = p.lerp(q, share.clamp(0.0, 1.0));
    for face in &mut edited.mesh.faces {
        for i in face.iter_mut().filter(|i| **i == gone) {
            *i = kept;
        }
        face.dedup();
        if face.len() > 1 && face.first() == face.last() {
            face.pop();
        }
    }
    edited.mesh.faces.retain(|face| face.len() > 2);
    edited.vertex_of[gone as usize] = Some(kept);
    edited.touched.push(kept);
    drop_unused(mesh, &mut edited);
    finish("collapsing", mesh, edited)
}

/// Moves faces along their normals by `distance` (object units, negative: into the cage) and connects them by quads to
/// their old positions. Faces with a common edge stay connected: their outline gets the quads, and a corner of several of
/// them moves along the mean of their normals, weighted by area. Corners on an outline are copied, and the copies are
/// the last vertices; other corners keep their index, and so do all faces.
///
/// # Errors
/// [`RestEditError`]: a face does not exist, `distance` is not finite, or the cage would become invalid.
pub fn extrude_faces(mesh: &PolygonMesh, faces: &[u32], distance: f32) -> Result<CageEdit, RestEditError> {
    if let Some(&face) = faces.iter().find(|&&face| face as usize >= mesh.faces.len()) {
        return Err(missing("face", &[face]));
    }
    if !distance.is_finite() {
        return Err(RestEditError::NotFinite { what: "the distance" });
    }
    let mut edited = unchanged(mesh);
    for region in regions(mesh, faces) {
        let normals: Vec<DVec3> = region.iter().map(|&f| area_normal(mesh, f)).collect();
        let all: HashSet<[u32; 2]> = region.iter().flat_map(|&f| sides(&mesh.faces[f])).collect();
        let outline: Vec<[u32; 2]> = region
            .iter()
            .flat_map(|&f| sides(&mesh.faces[f]))
            .filter(|&[a, b]| !all.contains(&[b, a]))
            .collect();
        let is_copied = |v: u32| outline.iter().any(|side| side.contains(&v));
        let mut moved: HashMap<u32, u32> = HashMap::new();
        for &v in region.iter().flat_map(|&f| &mesh.faces[f]) {
            if moved.contains_key(&v) {
                continue;
            }
            let around = region.iter().zip(&normals).filter(|(f, _)| mesh.faces[**f].contains(&v));
            let normal: DVec3 = around.map(|(_, normal)| *normal).sum();
            let at =
                mesh.positions[v as usize] + (normal.normalize_or_zero() * f64::from(distance)).as_vec3();
            let new = if is_copied(v) {
                edited.mesh.positions.push(at);
                edited.made_from.push([v; 2]);
                edited.mesh.positions.len() as u32 - 1
            } else {
                edited.mesh.positions[v as usize] = at;
                v
            };
            edited.touched.push(new);
            moved.insert(v, new);
        }
        for &f in &region {
            edited.mesh.faces[f].iter_mut().for_each(|v| *v = moved[v]);
        }
        edited.mesh.faces.extend(outline.iter().map(|[a, b]| vec![*a, *b, moved[b], moved[a]]));
    }
    finish("extruding", mesh, edited)
}

/// Groups faces that are connected by common edges. Faces are ascending in each group.
fn regions(mesh: &PolygonMesh, faces: &[u32]) -> Vec<Vec<usize>> {
    let mut left: BTreeSet<usize> = faces.iter().map(|&f| f as usize).collect();
    let mut regions = Vec::new();
    while let Some(first) = left.pop_first() {
        let (mut region, mut next) = (vec![first], 0);
        while let Some(&face) = region.get(next) {
            let is_beside =
                |f: &usize| sides(&mesh.faces[face]).any(|edge| side(&mesh.faces[*f], edge).is_some());
            let (beside, others) = left.into_iter().partition(is_beside);
            left = others;
            region.extend(beside);
            next += 1;
        }
        region.sort_unstable();
        regions.push(region);
    }
    regions
}

/// Newell's normal, twice as long as the face's area; valid also for faces that are not planar or not convex.
fn area_normal(mesh: &PolygonMesh, face: usize) -> DVec3 {
    let at: Vec<DVec3> = mesh.faces[face].iter().map(|&i| mesh.positions[i as usize].as_dvec3()).collect();
    let n = at.len();
    let center = at.iter().sum::<DVec3>() / n as f64;
    (0..n).map(|k| (at[k] - center).cross(at[(k + 1) % n] - center)).sum()
}

/// Sides of a face, as pairs of corners in its direction.
fn sides(face: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..face.len()).map(|k| [face[k], face[(k + 1) % face.len()]])
}

/// Deletes faces, fills the holes by minimum-area triangulations, and drops vertices that lose their last face.
///
/// # Errors
/// [`RestEditError`]: a face does not exist, a hole has more than 64 edges, or the cage would become invalid.
pub fn delete_faces(mesh: &PolygonMesh, faces: &[u32]) -> Result<CageEdit, RestEditError> {
    let mut keep = vec![true; mesh.faces.len()];
    for &f in faces {
        *keep.get_mut(f as usize).ok_or_else(|| missing("face", &[f]))? = false;
    }
    let mut edited = unchanged(mesh);
    let mut kept = keep.iter();
    edited.mesh.faces.retain(|_| kept.next().is_some_and(|k| *k));
    if edited.mesh.faces.is_empty() {
        return Err(RestEditError::NothingLeft);
    }
    // The boundary consists of the sides of deleted faces whose neighbouring face is not deleted. The filling has the
    // orientation of the deleted faces.
    let sides = |f: usize| sides(&mesh.faces[f]);
    let deleted: Vec<usize> = (0..keep.len()).filter(|&f| !keep[f]).collect();
    let inner: HashSet<[u32; 2]> = deleted.iter().flat_map(|&f| sides(f)).collect();
    let rim: Vec<[u32; 2]> =
        deleted.iter().flat_map(|&f| sides(f)).filter(|&[a, b]| !inner.contains(&[b, a])).collect();
    let at: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    for outline in loops(&rim, &at, &edited.mesh.faces) {
        let triangles = triangulate(&outline, &at, &edited.mesh.faces)
            .ok_or(RestEditError::LargeHole { edges: outline.len() })?;
        edited.touched.extend(&outline);
        edited.mesh.faces.extend(triangles.into_iter().map(|t| t.to_vec()));
    }
    edited.touched.sort_unstable();
    edited.touched.dedup();
    drop_unused(mesh, &mut edited);
    finish("deleting", mesh, edited)
}

fn unchanged(mesh: &PolygonMesh) -> CageEdit {
    CageEdit {
        mesh: mesh.clone(),
        vertex_of: (0..mesh.positions.len() as u32).map(Some).collect(),
        made_from: Vec::new(),
        touched: Vec::new(),
    }
}

/// Drops vertices that have lost their last face, and compacts the indices.
fn drop_unused(before: &PolygonMesh, edited: &mut CageEdit) {
    let n = edited.mesh.positions.len();
    let used = |faces: &[Vec<u32>]| {
        let mut used = vec![false; n];
        for &i in faces.iter().flatten() {
            used[i as usize] = true;
        }
        used
    };
    let (was, is) = (used(&before.faces), used(&edited.mesh.faces));
    let mut number = vec![None; n];
    let mut positions = Vec::with_capacity(n);
    for v in 0..n {
        if is[v] || !was[v] {
            number[v] = Some(positions.len() as u32);
            positions.push(edited.mesh.positions[v]);
        }
    }
    edited.mesh.positions = positions;
    for i in edited.mesh.faces.iter_mut().flatten() {
        *i = number[*i as usize].unwrap_or(*i);
    }
    for v in &mut edited.vertex_of {
        *v = v.and_then(|v| number[v as usize]);
    }
    edited.touched = edited.touched.iter().filter_map(|&v| number[v as usize]).collect();
}

/// Positions of the ends of an edge, which must belong to a face.
fn ends(mesh: &PolygonMesh, edge: [u32; 2]) -> Result<[Vec3; 2], RestEditError> {
    if !mesh.faces.iter().any(|face| side(face, edge).is_some()) {
        return Err(missing("edge", &edge));
    }
    Ok(edge.map(|i| mesh.positions[i as usize]))
}

/// Index of the corner of a face at which an edge starts, in either direction.
fn side(face: &[u32], [a, b]: [u32; 2]) -> Option<usize> {
    (0..face.len()).find(|&k| {
        let (p, q) = (face[k], face[(k + 1) % face.len()]);
        (p, q) == (a, b) || (p, q) == (b, a)
    })
}

fn missing(kind: &str, indices: &[u32]) -> RestEditError {
    let numbers: Vec<String> = indices.iter().map(u32::to_string).collect();
    RestEditError::Missing { what: format!("{kind} {}", numbers.join("-")) }
}
