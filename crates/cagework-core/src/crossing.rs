//! Faces of a mesh that go through each other: where, and in a sentence. A bind says so, and so does a check of a cage.

use std::collections::HashMap;
use std::ops::ControlFlow;

use glam::DVec3;

use crate::cage::{Cage, face_triangles};
use crate::contact::{Corners, each_meeting};
use crate::mesh::PolygonMesh;
use crate::words::{counted, grouped};

/// Most places that are listed of each kind; a count is the full number.
pub const MAX_PLACES: usize = 2000;

/// Vertices nearer than this fraction of the diagonal are at one place: the rounding of six decimals in a file.
const WELD_DISTANCE: f64 = 2e-6;

/// Faces that go through each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossings {
    /// The faces, ascending.
    pub faces: Vec<u32>,
    /// Where pairs of their triangles meet, object units; up to [`MAX_PLACES`].
    pub points: Vec<[f32; 3]>,
    /// Pairs of triangles.
    pub count: usize,
    /// A sentence.
    pub message: String,
}

/// What a user should know of a cage that is bound, a sentence each: what was mended, and where it goes through itself.
#[must_use]
pub fn notices(cage: &Cage) -> Vec<String> {
    let crossing = crossings_of(cage).map(|found| found.message);
    cage.notices().iter().map(ToString::to_string).chain(crossing).collect()
}

/// Faces of a cage that go through each other.
#[must_use]
pub fn crossings_of(cage: &Cage) -> Option<Crossings> {
    let all: Vec<u32> = (0..cage.faces().len() as u32).collect();
    crossings(&cage.to_polygon_mesh(), Some(cage.component_of_face()), &all)
}

/// Faces among `sound` ones that go through each other; `parts`: the part of each face of a cage.
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
    // A search that ended early and found nothing says nothing.
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

/// Sound faces as triangles with the face that each was cut from.
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
    // Vertices at one place count as one, so that neighbours across a seam do not seem to meet; but not the corners of one
    // triangle, as where the mesh is that small against its diagonal.
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

/// A point near where two triangles meet: the middle of where their boxes overlap.
fn between(a: &Corners, b: &Corners) -> DVec3 {
    0.5 * (a.min().max(b.min()) + a.max().min(b.max()))
}

/// For each vertex the first one at the same place, and how many have an earlier one.
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
            // Coordinates of a mesh without extent saturate: they may wrap, equal places still meet.
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

/// Pairs of triangles meet: so many are listed, so many there are (at least, if not `complete`); the first one's faces and where.
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
            "What it encloses twice counts as inside; move their vertices apart.",
        )
    };
    format!("{what}: {listed} meet{more}, the first of faces {f} and {g} near {at:?}. {then}")
}
