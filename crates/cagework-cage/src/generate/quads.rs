//! Turns a collapsed triangle surface into quads: pairs triangles, moves vertices to make quads rectangular, and cuts
//! quads along the diagonal that the cage will use.

use glam::DVec3;

use super::collapse::quality;
use super::guarded::GuardedSurface;
use super::mirrors::Mirrors;
use super::pairing::{
    Pairing, Partner, Quad, badness, is_free, other_cut, pair, places, quad_of, warp, worth,
};
use super::quadric::Quadric;
use super::shell::Spacing;
use super::unfold::unfold;
use cagework_core::contact::Corners;
use cagework_core::progress::Cancellation;

/// Number of rounds of vertex moves after each pairing.
const ROUNDS: [usize; 3] = [2, 2, 3];
/// Weight of the mean squared distance from the hull (voxels squared) against [`badness`].
const DISTANCE_WEIGHT: f64 = 0.6;
/// Weight of the inverse quality of unpaired triangles against [`badness`].
const TRIANGLE_WEIGHT: f64 = 0.3;
/// Weight of the inverse quality of all triangles, including the halves of quads, against [`badness`].
const HALF_WEIGHT: f64 = 0.01;
/// Penalty of a quad that can be cut along one diagonal only.
const SINGLE_CUT_PENALTY: f64 = 6.0;
/// Step lengths that are tried for a move, as shares of the full step.
const STEP_SHARES: [f64; 3] = [1.0, 0.5, 0.2];
/// Length of the outward step that is tried, as a multiple of the mean distance between a vertex and its neighbours.
const OUTWARD_STEP: f64 = 0.3;
/// Smallest decrease of [`Star::energy`] plus [`Star::penalty`], which have no unit, for which a move is accepted.
const MIN_DECREASE: f64 = 1e-3;
/// Largest [`warp`] of a quad that counts as planar.
const MAX_PLANAR_WARP: f64 = 1e-2;
/// Smallest allowed cosine between the normals of a triangle before and after a move.
const MIN_MOVE_COSINE: f64 = 0.3;

/// Pairs the triangles of a surface and moves its vertices to improve the quads.
///
/// # Errors
/// If `go_on`, called with the completed share, cancels.
pub(super) fn quads(
    surface: &mut GuardedSurface<'_>,
    quadrics: &[Quadric],
    go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
) -> Result<Pairing, Cancellation> {
    let mut pairing = Pairing::default();
    for (k, rounds) in ROUNDS.into_iter().enumerate() {
        pairing = pair(surface, &pairing, false);
        go_on((k + 1) as f32 / (ROUNDS.len() + 1) as f32)?;
        for _ in 0..rounds {
            for v in 0..surface.positions.len() as u32 {
                straighten(surface, &pairing, quadrics, v);
            }
        }
    }
    unfold(surface, true);
    pairing = pair(surface, &pairing, true);
    settle(surface, &mut pairing);
    Ok(pairing)
}

/// Faces around a vertex: quads, unpaired triangles, and all triangles.
struct Star {
    quads: Vec<Quad>,
    /// The two triangles of each quad that does not cross the mirror plane.
    pairs: Vec<[u32; 2]>,
    alone: Vec<u32>,
    all: Vec<u32>,
}

impl Star {
    fn new(surface: &GuardedSurface<'_>, pairing: &Pairing, v: u32) -> Self {
        let all = surface.around[v as usize].clone();
        let (mut quads, mut pairs, mut alone) = (Vec::new(), Vec::new(), Vec::new());
        for &t in &all {
            let partner = pairing.partner[t as usize];
            // Count a quad once if both of its triangles touch the vertex.
            let is_second = matches!(partner, Partner::Triangle(u) if u < t && all.contains(&u));
            match quad_of(surface, t, partner) {
                Some(quad) if !is_second => {
                    quads.push(quad);
                    if let Partner::Triangle(u) = partner {
                        pairs.push([t, u]);
                    }
                }
                Some(_) => {}
                None => alone.push(t),
            }
        }
        Self { quads, pairs, alone, all }
    }

    fn energy(&self, surface: &GuardedSurface<'_>, quadric: &Quadric, v: u32) -> f64 {
        let inverse = |t: &u32| 1.0 / quality(&surface.corners(*t).at).max(1e-6);
        DISTANCE_WEIGHT * quadric.at(surface.positions[v as usize]) / quadric.area.max(1e-12)
            + self.quads.iter().map(|quad| badness(&places(surface, quad))).sum::<f64>()
            + TRIANGLE_WEIGHT * self.alone.iter().map(inverse).sum::<f64>()
            + HALF_WEIGHT * self.all.iter().map(inverse).sum::<f64>()
    }

    /// Computes the penalty of quads that may not be cut along the other diagonal.
    fn penalty(&self, surface: &mut GuardedSurface<'_>) -> f64 {
        let bound = self.pairs.iter().filter(|[t, u]| !is_free(surface, *t, Partner::Triangle(*u)));
        SINGLE_CUT_PENALTY * bound.count() as f64
    }

    /// Lists candidate positions of the vertex: those that make each quad planar, the mean of those that make each quad
    /// a parallelogram, the mean of the neighbours, the minimum of the quadric, the mean of these candidates, and a
    /// step outward.
    fn goals(&self, surface: &GuardedSurface<'_>, quadric: &Quadric, v: u32) -> Vec<DVec3> {
        let here = surface.positions[v as usize];
        let mut goals = Vec::new();
        let mut corners = Vec::new();
        for quad in &self.quads {
            let Some(k) = quad.iter().position(|&corner| corner == (v, Mirrors::NONE)) else { continue };
            let p = places(surface, quad);
            let [before, next, opposite] = [3, 1, 2].map(|step| p[(k + step) % 4]);
            corners.push(before + next - opposite);
            let normal = (before - opposite).cross(next - opposite).normalize_or_zero();
            goals.push(here - normal * normal.dot(here - opposite));
        }
        if !corners.is_empty() {
            goals.push(corners.iter().sum::<DVec3>() / corners.len() as f64);
        }
        let mut near = Vec::new();
        surface.neighbours(v, &mut near);
        goals.push(near.iter().map(|&w| surface.positions[w as usize]).sum::<DVec3>() / near.len() as f64);
        let pinned = surface.on_mirror[v as usize];
        if let Some(home) = quadric.minimum(pinned) {
            goals.push(here + (home - here).clamp_length_max(2.0));
        }
        goals.push(goals.iter().sum::<DVec3>() / goals.len() as f64);
        let normals = self.all.iter().map(|&t| surface.corners(t).normal());
        let side = near.iter().map(|&w| surface.positions[w as usize].distance(here)).sum::<f64>();
        let outward = normals.sum::<DVec3>().normalize_or_zero();
        goals.push(here + OUTWARD_STEP * side / near.len() as f64 * outward);
        goals
    }
}

fn straighten(surface: &mut GuardedSurface<'_>, pairing: &Pairing, quadrics: &[Quadric], v: u32) {
    if surface.around[v as usize].is_empty() {
        return;
    }
    let star = Star::new(surface, pairing, v);
    let (quadric, here) = (&quadrics[v as usize], surface.positions[v as usize]);
    let pinned = surface.on_mirror[v as usize];
    let limit = star.energy(surface, quadric, v) + star.penalty(surface) - MIN_DECREASE;
    let before: Vec<Corners> = star.all.iter().map(|&t| surface.corners(t)).collect();
    let mut better: Vec<(f64, DVec3)> = Vec::new();
    for goal in star.goals(surface, quadric, v) {
        for step in STEP_SHARES {
            let at = pinned.project(here + step * (goal - here));
            surface.positions[v as usize] = at;
            let energy = star.energy(surface, quadric, v);
            if energy < limit {
                better.push((energy, at));
            }
        }
    }
    surface.positions[v as usize] = here;
    better.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (energy, at) in better {
        let moved: Vec<Corners> = before.iter().map(|t| t.with_corner(v, at)).collect();
        let turned = before.iter().zip(&moved).any(|(before, after)| {
            let (m, n) = (before.normal(), after.normal());
            m.dot(n) < MIN_MOVE_COSINE * m.length() * n.length()
        });
        if !turned && surface.may_stand(&moved, &star.all) {
            surface.positions[v as usize] = at;
            if energy + star.penalty(surface) < limit {
                surface.place(v, at);
                return;
            }
            surface.positions[v as usize] = here;
        }
    }
}

/// Cuts the quads of two triangles along their shorter diagonals, as [`Cage`](cagework_core::cage::Cage) does. Splits a
/// quad into its triangles if the surface does not allow this cut, or if moves have made the quad invalid.
fn settle(surface: &mut GuardedSurface<'_>, pairing: &mut Pairing) {
    for t in 0..surface.triangles.len() as u32 {
        let partner = pairing.partner[t as usize];
        let Partner::Triangle(u) = partner else { continue };
        let Some(quad) = quad_of(surface, t, partner).filter(|_| u > t) else { continue };
        let p = places(surface, &quad);
        if worth(surface, t, partner) <= 0.0 {
            // Moves of vertices have made the quad invalid.
            pairing.part(t);
            continue;
        }
        if p[0].distance(p[2]) <= p[1].distance(p[3]) {
            continue;
        }
        let cut = other_cut(surface, t, u).filter(|cut| surface.may_stand(cut, &[t, u]));
        match cut {
            Some(cut) => surface.swap([t, u], cut.map(|half| half.index)),
            None => pairing.part(t),
        }
    }
}

/// Faces of the whole surface, including all images.
pub(super) struct Faces {
    pub(super) positions: Vec<DVec3>,
    pub(super) faces: Vec<Vec<u32>>,
    /// For each face, one of the triangles of the guarded surface that the face was made from. `[n_faces]`
    pub(super) first: Vec<u32>,
}

/// Corners of a face, and the mirror planes that it crosses, in which it is its own image.
struct Face {
    corners: Vec<(u32, Mirrors)>,
    crossed: Mirrors,
}

impl Face {
    /// Merges a quad that has one side in a mirror plane with its image, and so removes the two corners in the plane. A
    /// face without corner in the plane is returned as it is; `None` if another face has one.
    fn merged(mut self, surface: &GuardedSurface<'_>, axis: usize) -> Option<Self> {
        let is_in = |k: usize| surface.on_mirror[self.corners[k % self.corners.len()].0 as usize].has(axis);
        let n = self.corners.len();
        let count = (0..n).filter(|&k| is_in(k)).count();
        if count > 0 {
            let k = (0..n).find(|&k| (n, count) == (4, 2) && is_in(k) && is_in(k + 1))?;
            let [q, p] = [2, 3].map(|step| self.corners[(k + step) % n]);
            let plane = Mirrors::of_axis(axis);
            let [q_image, p_image] = [q, p].map(|(v, image)| (v, image.xor(plane)));
            self = Self { corners: vec![q, p, p_image, q_image], crossed: self.crossed.or(plane) };
        }
        Some(self)
    }
}

/// Finds the mirror planes whose vertices are not needed: all faces around them are quads that can be merged with their
/// images ([`Face::merged`]), and the edges across the plane are within `budget` (voxels) of these vertices and no longer
/// than `spacings` allow.
pub(super) fn needless_planes(
    surface: &GuardedSurface<'_>,
    pairing: &Pairing,
    budget: f64,
    spacings: &[Option<Spacing>],
) -> Mirrors {
    let is_needed = |axis: usize, v: u32| {
        let mut near = Vec::new();
        surface.neighbours(v, &mut near);
        let beside = near.iter().filter(|&&w| !surface.on_mirror[w as usize].has(axis));
        let is_far = |&w: &u32| {
            let p = surface.positions[w as usize];
            let foot = Mirrors::of_axis(axis).project(p);
            let spacings = [v, w].into_iter().filter_map(|v| spacings[v as usize]);
            foot.distance(surface.positions[v as usize]) > budget
                || spacings.into_iter().any(|spacing| spacing.is_below(2.0 * (p - foot)))
        };
        beside.copied().filter(|w| pairing.is_side(surface, v, *w)).any(|w| is_far(&w))
    };
    surface.mirrors.axes().fold(Mirrors::NONE, |planes, axis| {
        let wider = planes.or(Mirrors::of_axis(axis));
        let on =
            |v: &u32| surface.on_mirror[*v as usize].has(axis) && !surface.around[*v as usize].is_empty();
        let is_needless = (0..surface.positions.len() as u32).filter(on).all(|v| !is_needed(axis, v));
        if is_needless && merged_faces(surface, pairing, wider).is_some() { wider } else { planes }
    })
}

/// Builds the faces of the guarded surface, with quads for paired triangles, each with the triangle it was made from.
/// Faces at the planes `needless` are merged with their images; `None` if one cannot.
fn merged_faces(
    surface: &GuardedSurface<'_>,
    pairing: &Pairing,
    needless: Mirrors,
) -> Option<Vec<(Face, u32)>> {
    let mut faces = Vec::new();
    for t in (0..surface.triangles.len() as u32).filter(|&t| surface.is_alive(t)) {
        let partner = pairing.partner[t as usize];
        let quad = quad_of(surface, t, partner).filter(|quad| {
            let p = places(surface, quad);
            // The other diagonal of a quad across a mirror has not been checked; in a planar quad, both diagonals give
            // the same surface.
            let is_guarded =
                !matches!(partner, Partner::Image(_)) || p[0].distance(p[2]) <= p[1].distance(p[3]);
            is_guarded || warp(&p) <= MAX_PLANAR_WARP
        });
        let (corners, crossed) = match (quad, partner) {
            // The quad was added with the first of its triangles.
            (Some(_), Partner::Triangle(u)) if u < t => continue,
            (Some(quad), Partner::Image(axis)) => (quad.to_vec(), Mirrors::of_axis(axis)),
            (Some(quad), _) => (quad.to_vec(), Mirrors::NONE),
            (None, _) => (surface.triangles[t as usize].map(|v| (v, Mirrors::NONE)).to_vec(), Mirrors::NONE),
        };
        let face = Face { corners, crossed };
        faces.push((needless.axes().try_fold(face, |face, axis| face.merged(surface, axis))?, t));
    }
    Some(faces)
}

/// Builds the faces of the whole surface, without the vertices on the planes `needless`. `None` if they are needed.
pub(super) fn faces(surface: &GuardedSurface<'_>, pairing: &Pairing, needless: Mirrors) -> Option<Faces> {
    let mut positions = Vec::new();
    // New indices of the images of each vertex, one for each subset of the mirror planes.
    let mut number = vec![[u32::MAX; 8]; surface.positions.len()];
    for (v, &p) in surface.positions.iter().enumerate() {
        if surface.around[v].is_empty() || !surface.on_mirror[v].and(needless).is_empty() {
            continue;
        }
        for image in surface.mirrors.without(surface.on_mirror[v]).subsets() {
            number[v][image.0 as usize] = positions.len() as u32;
            positions.push(image.reflect(p));
        }
    }
    let of = |corners: &[(u32, Mirrors)], image: Mirrors| {
        let numbers = corners.iter().map(|&(v, of)| {
            let image = of.xor(image).without(surface.on_mirror[v as usize]);
            number[v as usize][image.0 as usize]
        });
        let mut face: Vec<u32> = numbers.collect();
        if image.len() % 2 == 1 {
            face.reverse();
        }
        face
    };
    let (mut faces, mut first) = (Vec::new(), Vec::new());
    for (face, t) in merged_faces(surface, pairing, needless)? {
        for image in surface.mirrors.without(face.crossed).subsets() {
            faces.push(of(&face.corners, image));
            first.push(t);
        }
    }
    Some(Faces { positions, faces, first })
}
