//! Opens folds above 120 degrees that remain after collapses, where the solid and the cage itself leave room.

use glam::DVec3;

use super::collapse::{MIN_QUALITY, quality};
use super::guarded::GuardedSurface;
use cagework_core::contact::Corners;

/// Number of rounds over all sharp folds.
const ROUNDS: usize = 4;

/// Lengths of the moves that are tried, as fractions of the mean length of the vertex's edges.
const STEP_SHARES: [f64; 4] = [0.1, 0.25, 0.5, 1.0];

/// Smallest decrease of [`GuardedSurface::excess`] for which a change is accepted.
const MIN_DECREASE: f64 = 1e-3;

/// Smallest allowed cosine between a triangle's normals before and after a move.
const MIN_MOVE_COSINE: f64 = 0.3;

/// Swaps edges and moves vertices so that fewer folds are above 120 degrees, and those that remain are less sharp.
/// `all_ways`: whether vertices at remaining folds are then also moved along each edge and against each normal.
pub(super) fn unfold(surface: &mut GuardedSurface<'_>, all_ways: bool) {
    run(surface, false);
    if all_ways {
        run(surface, true);
    }
}

fn run(surface: &mut GuardedSurface<'_>, all_ways: bool) {
    for _ in 0..ROUNDS {
        let mut changed = false;
        for t in 0..surface.triangles.len() as u32 {
            if !surface.is_alive(t) || surface.excess(&[surface.corners(t)], &[t]) <= 0.0 {
                continue;
            }
            changed |= (0..3).any(|k| swap(surface, t, k));
            for v in surface.triangles[t as usize] {
                changed |= shift(surface, v, all_ways);
            }
        }
        if !changed {
            return;
        }
    }
}

/// Swaps the edge from corner `k` of a triangle if that reduces the excess of the folds around the edge.
fn swap(surface: &mut GuardedSurface<'_>, t: u32, k: usize) -> bool {
    let Some((other, new)) = surface.swapped(t, k) else { return false };
    let before = [t, other].map(|t| surface.corners(t));
    let gone = [t, other];
    let is_better = new.iter().all(|t| quality(&t.at) >= MIN_QUALITY)
        && surface.excess(&new, &gone) < surface.excess(&before, &gone) - MIN_DECREASE;
    if is_better && surface.may_stand(&new, &gone) {
        surface.swap(gone, new.map(|t| t.index));
        return true;
    }
    false
}

/// Moves a vertex to a position with less excess of folds ([`GuardedSurface::excess`]) around its triangles, if one is
/// found. Returns whether the vertex has moved.
fn shift(surface: &mut GuardedSurface<'_>, v: u32, all_ways: bool) -> bool {
    let gone = surface.around[v as usize].clone();
    let star: Vec<Corners> = gone.iter().map(|&t| surface.corners(t)).collect();
    let limit = surface.excess(&star, &gone) - MIN_DECREASE;
    if limit <= 0.0 {
        return false;
    }
    let here = surface.positions[v as usize];
    let mut near = Vec::new();
    surface.neighbours(v, &mut near);
    let ways: Vec<DVec3> = near.iter().map(|&w| surface.positions[w as usize] - here).collect();
    let length = ways.iter().map(|way| way.length()).sum::<f64>() / ways.len() as f64;
    let outward = star.iter().map(Corners::normal).sum::<DVec3>();
    let mut directions = vec![outward, -outward, ways.iter().sum::<DVec3>()];
    directions.extend(DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]));
    directions.extend(star.iter().map(Corners::normal));
    if all_ways {
        directions.extend(star.iter().map(|t| -t.normal()));
        directions.extend(ways.iter().flat_map(|&way| [way, -way]));
    }
    let pinned = surface.on_mirror[v as usize];
    let mut better = Vec::new();
    for direction in directions {
        for step in STEP_SHARES {
            let at = pinned.project(here + step * length * direction.normalize_or_zero());
            let moved: Vec<Corners> = star.iter().map(|t| t.with_corner(v, at)).collect();
            let spoils = |(before, after): (&Corners, &Corners)| {
                let (m, n) = (before.normal(), after.normal());
                quality(&after.at) < MIN_QUALITY.min(quality(&before.at))
                    || m.dot(n) < MIN_MOVE_COSINE * m.length() * n.length()
            };
            let excess = surface.excess(&moved, &gone);
            if excess < limit && !surface.is_blocked(at) && !star.iter().zip(&moved).any(spoils) {
                better.push((excess, at, moved));
            }
        }
    }
    better.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, at, _)) = better.into_iter().find(|(.., moved)| surface.may_stand(moved, &gone)) else {
        return false;
    };
    surface.place(v, at);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::guarded::Obstacle;
    use crate::generate::mirrors::Mirrors;
    use crate::generate::surface::Surface;
    use crate::generate::voxels::Voxels;

    /// The fold at the rim of a square bipyramid of half height h and half side 2 is 180 degrees - 2 atan(h / 2): 163
    /// degrees for h = 0.3.
    #[test]
    fn a_flat_bipyramid_is_opened_to_120_degrees() {
        let positions =
            [[2, 2], [-2, 2], [-2, -2], [2, -2]].map(|[x, y]| DVec3::new(x.into(), y.into(), 0.0));
        let positions = positions.into_iter().chain([0.3, -0.3].map(|z| z * DVec3::Z)).collect();
        let triangles = (0..4).flat_map(|k| [[k, (k + 1) % 4, 4], [(k + 1) % 4, k, 5]]).collect();
        let surface =
            Surface { positions, triangles, on_mirror: vec![Mirrors::NONE; 6], mirrors: Mirrors::NONE };
        let obstacle = Obstacle { voxels: Voxels::new([16; 3]), clearance: 0.0, stretch: DVec3::ONE };
        let mut guarded = GuardedSurface::new(surface, &obstacle);
        let excess = |guarded: &GuardedSurface<'_>| {
            let of_triangle = |t: u32| guarded.excess(&[guarded.corners(t)], &[t]);
            (0..8).map(of_triangle).sum::<f64>()
        };
        let before = excess(&guarded);
        let of_rim = (180.0 - 2.0 * 0.15_f64.atan().to_degrees()).to_radians().cos();
        assert!((before - 8.0 * (-0.5 - of_rim)).abs() < 1e-9, "{before}");
        unfold(&mut guarded, false);
        assert!(excess(&guarded) < 1e-9, "{:?}", guarded.positions);
    }
}
