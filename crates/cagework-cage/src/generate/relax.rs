//! Improves the triangles of a [`GuardedSurface`]: moves vertices towards the mean of their neighbours and back to the
//! hull, and swaps edges.

use glam::DVec3;

use super::collapse::quality;
use super::guarded::GuardedSurface;
use super::quadric::Quadric;
use cagework_core::contact::Corners;
use cagework_core::progress::Cancellation;

/// Number of rounds over all vertices and edges; more than six do not visibly change the result.
const ROUNDS: usize = 6;

/// Weight of the mean squared distance from the hull (voxels squared) against the inverse quality of triangles.
const DISTANCE_WEIGHT: f64 = 1.5;

/// Step lengths that are tried for a move, as shares of the full step.
const STEP_SHARES: [f64; 3] = [0.8, 0.4, 0.15];

/// Smallest decrease of [`fit`] plus [`shape`] (dimensionless) for which a change is accepted.
const MIN_DECREASE: f64 = 1e-3;

/// Smallest allowed cosine between the normals of a triangle before and after a move.
const MIN_MOVE_COSINE: f64 = 0.5;

/// Smallest allowed cosine between the normals of a triangle before and after an edge swap.
const MIN_SWAP_COSINE: f64 = 0.6;

/// Largest allowed number of triangles around a vertex after a swap.
const MAX_VALENCE: usize = 9;

/// Improves the shape of triangles by moves and swaps that [`GuardedSurface::may_stand`] allows.
///
/// # Errors
/// If `go_on`, called with the completed share, cancels.
pub(super) fn relax(
    surface: &mut GuardedSurface<'_>,
    quadrics: &[Quadric],
    go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
) -> Result<(), Cancellation> {
    for round in 0..ROUNDS {
        go_on(round as f32 / ROUNDS as f32)?;
        for v in 0..surface.positions.len() as u32 {
            if !surface.around[v as usize].is_empty() {
                slide(surface, quadrics, v);
            }
        }
        for t in 0..surface.triangles.len() as u32 {
            for k in 0..3 {
                if surface.is_alive(t) {
                    swap(surface, quadrics, t, k);
                }
            }
        }
    }
    Ok(())
}

fn fit(quadric: &Quadric, p: DVec3) -> f64 {
    DISTANCE_WEIGHT * quadric.at(p) / quadric.area.max(1e-12)
}

fn shape<'t>(triangles: impl Iterator<Item = &'t Corners>) -> f64 {
    triangles.map(|t| 1.0 / quality(&t.at).max(1e-6)).sum()
}

fn slide(surface: &mut GuardedSurface<'_>, quadrics: &[Quadric], v: u32) {
    let gone = surface.around[v as usize].clone();
    let star: Vec<Corners> = gone.iter().map(|&t| surface.corners(t)).collect();
    let p = surface.positions[v as usize];
    let quadric = &quadrics[v as usize];
    let normal = star.iter().map(Corners::normal).sum::<DVec3>().normalize_or_zero();
    let mut near = Vec::new();
    surface.neighbours(v, &mut near);
    let mean = near.iter().map(|&w| surface.positions[w as usize]).sum::<DVec3>() / near.len() as f64;
    let tangential = (mean - p) - normal * normal.dot(mean - p);
    let pinned = surface.on_mirror[v as usize];
    let home = quadric.minimum(pinned).map_or(DVec3::ZERO, |o| (o - p).clamp_length_max(2.0));
    let energy = fit(quadric, p) + shape(star.iter());
    for direction in [home + tangential, tangential, home, normal * normal.dot(home), mean - p] {
        for step in STEP_SHARES {
            let q = pinned.project(p + step * direction);
            let moved: Vec<Corners> = star.iter().map(|t| t.with_corner(v, q)).collect();
            if fit(quadric, q) + shape(moved.iter()) > energy - MIN_DECREASE {
                continue;
            }
            let turned = star.iter().zip(&moved).any(|(before, after)| {
                let (m, n) = (before.normal(), after.normal());
                m.dot(n) < MIN_MOVE_COSINE * m.length() * n.length()
            });
            if !turned && surface.may_stand(&moved, &gone) {
                surface.place(v, q);
                return;
            }
        }
    }
}

/// Swaps the edge from corner `k` of a triangle if that lowers [`fit`] of its midpoint plus [`shape`] of its triangles.
fn swap(surface: &mut GuardedSurface<'_>, quadrics: &[Quadric], t: u32, k: usize) {
    let Some((other, after)) = surface.swapped(t, k) else { return };
    let [a, d, c] = after[0].index;
    let b = after[1].index[1];
    if a > b || [c, d].iter().any(|&v| surface.around[v as usize].len() >= MAX_VALENCE) {
        return;
    }
    let at = |v: u32| surface.positions[v as usize];
    let before = [[a, b, c], [b, a, d]].map(|index| Corners { index, at: index.map(at) });
    let edge = |v: u32, w: u32| {
        let quadric = quadrics[v as usize].plus(&quadrics[w as usize]);
        fit(&quadric, 0.5 * (at(v) + at(w)))
    };
    if edge(c, d) + shape(after.iter()) > edge(a, b) + shape(before.iter()) - MIN_DECREASE {
        return;
    }
    let bent = before.iter().any(|m| {
        after.iter().any(|n| {
            let (m, n) = (m.normal(), n.normal());
            m.dot(n) < MIN_SWAP_COSINE * m.length() * n.length()
        })
    });
    if !bent && surface.may_stand(&after, &[t, other]) {
        surface.swap([t, other], after.map(|t| t.index));
    }
}
