//! Verification of a sleeve cage in its final f32 coordinates.

use cagework_core::cage::Cage;
use cagework_core::contact::{Corners, meeting};
use cagework_core::enclosure::{Columns, Enclosure, MIN_INSIDE_WINDING};
use cagework_core::mesh::PolygonMesh;
use glam::{DVec3, Vec3};

use crate::generate::MIN_FOLD_COSINE;

/// Why a cage is not accepted.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Fault {
    /// Quads meet or are folded sharply.
    Quads(Faults),
    /// Indices of the points of the model that are outside.
    Outside(Vec<usize>),
    /// The surface is not closed, or a face has no area.
    Invalid,
}

/// Returns the triangles of both cuts of all quads: four for each, of three successive corners.
pub(super) fn halves(at: &[DVec3], quads: &[[u32; 4]]) -> Vec<Corners> {
    let triangle = |quad: &[u32; 4], k: usize| {
        let index = [0, 1, 2].map(|step| quad[(k + step) % 4]);
        Corners { index, at: index.map(|v| at[v as usize]) }
    };
    quads.iter().flat_map(|quad| (0..4).map(move |k| triangle(quad, k))).collect()
}

/// Faulty quads, possibly repeated.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Faults {
    /// Pairs of quads of which triangles of either cut meet.
    pub(super) meeting: Vec<[u32; 2]>,
    /// Quads that form a ridge with a neighbour whose mean normal is more than 120 degrees away. Grooves may be sharper:
    /// legs have a common edge at the crotch.
    pub(super) folded: Vec<u32>,
}

/// Finds the faulty quads of a closed surface.
pub(super) fn faults(at: &[DVec3], quads: &[[u32; 4]]) -> Faults {
    let mut faults = Faults::default();
    for pair in meeting(&halves(at, quads)) {
        let [a, b] = pair.map(|t| t / 4);
        if a != b {
            faults.meeting.push([a, b]);
        }
    }
    let corners = |quad: &[u32; 4]| quad.map(|v| at[v as usize]);
    let normal = |quad: &[u32; 4]| {
        let [a, b, c, d] = corners(quad);
        (c - a).cross(d - b).normalize_or_zero()
    };
    let middle = |quad: &[u32; 4]| corners(quad).iter().sum::<DVec3>() / 4.0;
    for (a, first) in quads.iter().enumerate() {
        for (b, second) in quads.iter().enumerate().skip(a + 1) {
            let n_shared = second.iter().filter(|v| first.contains(v)).count();
            let is_sharp = || normal(first).dot(normal(second)) < MIN_FOLD_COSINE;
            let is_ridge = || normal(first).dot(middle(second) - middle(first)) < 0.0;
            if n_shared >= 2 && is_sharp() && is_ridge() {
                faults.folded.extend([a as u32, b as u32]);
            }
        }
    }
    faults
}

/// Builds the cage if it is closed and manifold, and if for both cuts of all quads its surface does not meet itself,
/// has no ridge of more than 120 degrees, and encloses all points. The bent quads to which models are bound lie between
/// the cuts; they are checked as well. `points`: vertices of the model and points of its triangles, object units.
///
/// # Errors
/// [`Fault`].
pub(super) fn verify(positions: Vec<Vec3>, quads: &[[u32; 4]], points: &[Vec3]) -> Result<Cage, Fault> {
    let at: Vec<DVec3> = positions.iter().map(|p| p.as_dvec3()).collect();
    let mesh = PolygonMesh { positions, faces: quads.iter().map(|quad| quad.to_vec()).collect() };
    let cage = Cage::new(&mesh).map_err(|_| Fault::Invalid)?;
    let mut faults = faults(&at, quads);
    let facet =
        |index: &[u32; 3]| Corners { index: *index, at: index.map(|v| cage.facet_points()[v as usize]) };
    let facets: Vec<Corners> = cage.facets().iter().map(facet).collect();
    let of_facet = |pair: [u32; 2]| pair.map(|f| cage.face_of_facet()[f as usize]);
    faults.meeting.extend(meeting(&facets).into_iter().map(of_facet));
    if faults != Faults::default() {
        return Err(Fault::Quads(faults));
    }
    // `Cage::new` repairs inverted and separate surfaces, with a notice.
    if !cage.notices().is_empty() {
        return Err(Fault::Invalid);
    }
    let halves = halves(&at, quads);
    let mut outside: Vec<usize> =
        Enclosure::new(&cage, points).outside().into_iter().map(|v| v as usize).collect();
    for cut in [0, 1] {
        let corners: Vec<[DVec3; 3]> = halves.iter().skip(cut).step_by(2).map(|t| t.at).collect();
        let columns = Columns::new(&corners);
        let is_outside = |&i: &usize| columns.winding_number(points[i].as_dvec3()) <= MIN_INSIDE_WINDING;
        outside.extend((0..points.len()).filter(is_outside));
    }
    outside.sort_unstable();
    outside.dedup();
    if outside.is_empty() { Ok(cage) } else { Err(Fault::Outside(outside)) }
}
