//! Self-intersections of a mesh: locations, and messages for binds and checks.

use std::collections::HashMap;
use std::ops::ControlFlow;

use glam::DVec3;

use crate::cage::{Cage, face_triangles};
use crate::contact::{Corners, each_meeting};
use crate::mesh::PolygonMesh;
use crate::words::{counted, grouped};

/// Limit on the number of locations in each list of a report. Counts include locations that are not listed.
pub const MAX_PLACES: usize = 2000;

/// Distance, as a fraction of the mesh's diagonal, up to which vertices count as being at the same position. It is
/// larger than the rounding of coordinates to six decimals in a file.
pub const WELD_DISTANCE: f64 = 2e-6;

/// Intersecting faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossings {
    /// Indices of the intersecting faces, ascending.
    pub faces: Vec<u32>,
    /// Locations of intersecting pairs of triangles, object units; at most [`MAX_PLACES`].
    pub points: Vec<[f32; 3]>,
    /// Number of intersecting pairs of triangles.
    pub count: usize,
    /// Description, one sentence.
    pub message: String,
}

/// Returns notices about a cage, one sentence each: repairs and self-intersections.
#[must_use]
pub fn notices(cage: &Cage) -> Vec<String> {
    let crossing = crossings_of(cage).map(|found| found.message);
    cage.notices().iter().map(ToString::to_string).chain(crossing).collect()
}

/// Finds the intersecting faces of a cage; `None` if none are found.
#[must_use]
pub fn crossings_of(cage: &Cage) -> Option<Crossings> {
    let all: Vec<u32> = (0..cage.faces().len() as u32).collect();
    crossings(&cage.to_polygon_mesh(), Some(cage.component_of_face()), &all)
}

/// Finds the intersecting faces among the faces with the indices `sound`, which must be valid. `parts`: component of
/// each face of a cage. `None` if none are found.
#[must_use]
pub fn crossings(mesh: &PolygonMesh, parts: Option<&[u32]>, sound: &[u32]) -> Option<Crossings> {
    let mut of_parts = parts.is_some();
    let (triangles, face_of) = triangles(mesh, sound);
    let mut pairs = Vec::new();
    let mut count = 0;
    let complete = each_meeting(&triangles, |[a, b]| {
        let [f, g] = [a, b].map(|t| face_of[t as usize] as usize);
        if f != g {
            of_parts = of_parts && parts.is_some_and(|part| part[f] != part[g]);
            count += 1;
            if pairs.len() < MAX_PLACES {
                pairs.push([a, b]);
            }
        }
        ControlFlow::Continue(())
    });
    pairs.sort_unstable();
    // No pair found, possibly because the search reached its limit: report nothing.
    let first = *pairs.first()?;
    let mut faces: Vec<u32> = pairs.iter().flatten().map(|&t| face_of[t as usize]).collect();
    faces.sort_unstable();
    faces.dedup();
    let point =
        |&[a, b]: &[u32; 2]| between(&triangles[a as usize], &triangles[b as usize]).as_vec3().to_array();
    let place = (first.map(|t| face_of[t as usize]), point(&first));
    Some(Crossings {
        faces,
        points: pairs.iter().map(point).collect(),
        count,
        message: sentence([pairs.len(), count], complete, of_parts, place),
    })
}

/// Triangulates the valid faces. Also returns the face of each triangle.
fn triangles(mesh: &PolygonMesh, sound: &[u32]) -> (Vec<Corners>, Vec<u32>) {
    let diagonal = mesh.diagonal();
    let (mut triangles, mut face_of) = (Vec::new(), Vec::new());
    for &f in sound {
        let face = &mesh.faces[f as usize];
        let corners: Vec<DVec3> = face.iter().map(|&i| mesh.positions[i as usize].as_dvec3()).collect();
        for t in face_triangles(&corners, diagonal).unwrap_or_default() {
            triangles
                .push(Corners { index: t.map(|k| face[k as usize]), at: t.map(|k| corners[k as usize]) });
            face_of.push(f);
        }
    }
    // Merge vertices within `WELD_DISTANCE` (relative to the diagonal) of each other, so that neighbours across a seam
    // do not count as intersecting. Exception: the corners of one triangle stay separate, as they may coincide in parts
    // that are tiny relative to the diagonal.
    let (mut first, _) = same_places(mesh);
    for Corners { index, .. } in &triangles {
        let named = index.map(|i| first[i as usize]);
        for (k, &i) in index.iter().enumerate() {
            if named[(k + 1) % 3] == named[k] || named[(k + 2) % 3] == named[k] {
                first[i as usize] = i;
            }
        }
    }
    for corners in &mut triangles {
        corners.index = corners.index.map(|i| first[i as usize]);
    }
    (triangles, face_of)
}

/// Returns a point near the intersection of two triangles: the centre of the overlap of their bounding boxes.
fn between(a: &Corners, b: &Corners) -> DVec3 {
    0.5 * (a.min().max(b.min()) + a.max().min(b.max()))
}

/// Returns, for each vertex, the first vertex at the same position, and the number of vertices at the position of an
/// earlier vertex.
#[must_use]
pub fn same_places(mesh: &PolygonMesh) -> (Vec<u32>, usize) {
    let reach = WELD_DISTANCE * mesh.diagonal();
    let size = (2.0 * reach).max(f64::MIN_POSITIVE);
    let mut at_place: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut first: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let mut joined = 0;
    for (v, p) in mesh.positions.iter().enumerate() {
        if !p.is_finite() {
            continue;
        }
        let p = p.as_dvec3();
        let cell = (p / size).floor().to_array().map(|x| x as i64);
        let mut found = None;
        for k in 0..27 {
            // Keys of a mesh without extent saturate and may wrap; equal positions still get equal keys.
            let key = [0, 1, 2].map(|a| cell[a].wrapping_add(k / [1, 3, 9][a] % 3 - 1));
            let near = at_place.get(&key).into_iter().flatten();
            for &w in near {
                if mesh.positions[w as usize].as_dvec3().distance(p) <= reach && found.is_none_or(|f| w < f) {
                    found = Some(w);
                }
            }
        }
        match found {
            Some(w) => {
                first[v] = w;
                joined += 1;
            }
            None => at_place.entry(cell).or_default().push(v as u32),
        }
    }
    (first, joined)
}

/// Composes the message about intersecting pairs of triangles. `listed`: pairs in the list; `all`: pairs found, a lower
/// bound unless `complete`. The last argument holds the faces and the location of the first pair.
fn sentence(
    [listed, all]: [usize; 2],
    complete: bool,
    of_parts: bool,
    ([f, g], at): ([u32; 2], [f32; 3]),
) -> String {
    let more = match (all - listed, complete) {
        (0, true) => String::new(),
        (n, true) => format!(", and {} more", grouped(n)),
        (n, false) => format!(", and at least {} more", grouped(n)),
    };
    let listed = counted(listed, "pair of triangles", "pairs of triangles");
    let (what, then) = if of_parts {
        (
            "Parts of the cage overlap or touch",
            "Where they overlap they are bound as one, without the walls inside.",
        )
    } else {
        (
            "The cage goes through itself",
            "Space that it encloses twice counts as inside; move the vertices apart.",
        )
    };
    format!("{what}: {listed} meet{more}, the first of faces {f} and {g} near {at:?}. {then}")
}
