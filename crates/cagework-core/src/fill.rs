//! Finds the boundary loops of holes, and triangulates them.

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::DVec3;

/// Largest number of edges of a hole that is filled. Triangulation costs the cube of this number, and larger holes are
/// usually intended.
pub const MAX_EDGES: usize = 64;

/// Finds the closed loops of edges. Each edge has the direction in which a face that fills the hole traverses it, unless
/// the face next to it is inverted; each loop has the direction of the majority of its edges. Ignores edges that are in
/// no loop. `faces`: the faces around the holes, of vertices at `at`.
pub fn loops(edges: &[[u32; 2]], at: &[DVec3], faces: &[Vec<u32>]) -> Vec<Vec<u32>> {
    // Store edges without direction, as a face next to the hole may be inverted.
    // A way from a vertex is the vertex at its other end, and whether the edge has the opposite direction only.
    let directed: HashSet<[u32; 2]> = edges.iter().copied().collect();
    let mut next: BTreeMap<u32, Vec<(u32, bool)>> = BTreeMap::new();
    for &[from, to] in edges {
        next.entry(from).or_default().push((to, false));
        next.entry(to).or_default().push((from, !directed.contains(&[to, from])));
    }
    let normals = normals_where_holes_meet(&next, at, faces);
    let mut found = Vec::new();
    let starts: Vec<u32> = next.keys().copied().collect();
    for start in starts {
        while !next[&start].is_empty() {
            let mut path = vec![start];
            while let Some(from) = path.last().copied()
                && let Some(ways) = next.get_mut(&from)
                && !ways.is_empty()
            {
                let before = path.len().checked_sub(2).map(|k| path[k]);
                // Looked up once: thousands of edges may meet at a vertex, and each visit ranks all of them.
                let normal = normals.get(&from).copied();
                let angle = |to: u32| match (before, normal) {
                    (Some(before), Some(normal)) => {
                        let [back, ahead] = [before, to].map(|v| at[v as usize] - at[from as usize]);
                        clockwise(back, ahead, normal)
                    }
                    _ => 0.0,
                };
                // At a vertex where holes meet, the loop continues with the next edge around the vertex: the faces that
                // fill the hole lie in between.
                let ranked = ways.iter().map(|&(to, is_opposite)| (is_opposite, angle(to)));
                let best = (0..).zip(ranked).min_by(|(_, a), (_, b)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
                let (to, _) = ways.swap_remove(best.map_or(0, |(k, _)| k));
                if let Some(back) = next.get_mut(&to)
                    && let Some(k) = back.iter().position(|&(v, _)| v == from)
                {
                    back.swap_remove(k);
                }
                if let Some(k) = path.iter().position(|&v| v == to) {
                    // Holes that touch in a vertex close the path early: split the loop off and continue.
                    found.push(path.split_off(k));
                }
                path.push(to);
            }
        }
    }
    found.retain(|outline| outline.len() >= 3);
    for outline in &mut found {
        let n = outline.len();
        let ahead = (0..n).filter(|&k| directed.contains(&[outline[k], outline[(k + 1) % n]])).count();
        if 2 * ahead < n {
            outline.reverse();
        }
    }
    found
}

/// Sums of the unit normals of the faces around each vertex where holes meet.
fn normals_where_holes_meet(
    next: &BTreeMap<u32, Vec<(u32, bool)>>,
    at: &[DVec3],
    faces: &[Vec<u32>],
) -> HashMap<u32, DVec3> {
    let meeting = next.iter().filter(|(_, ways)| ways.len() > 2);
    let mut normals: HashMap<u32, DVec3> = meeting.map(|(&v, _)| (v, DVec3::ZERO)).collect();
    if normals.is_empty() {
        return normals;
    }
    for face in faces {
        let normal = area_normal(face, at).normalize_or_zero();
        for v in face {
            if let Some(sum) = normals.get_mut(v) {
                *sum += normal;
            }
        }
    }
    normals
}

/// Angle from one direction to another about a normal, clockwise as seen from its tip, in (0, 2 pi].
fn clockwise(from: DVec3, to: DVec3, normal: DVec3) -> f64 {
    let normal = normal.normalize_or(DVec3::Z);
    let [flat_from, flat_to] = [from, to].map(|way| way.reject_from_normalized(normal));
    let angle = normal.dot(to.cross(from)).atan2(flat_from.dot(flat_to));
    if angle > 0.0 { angle } else { angle + std::f64::consts::TAU }
}

/// Newell's normal of a face, of twice its area. Its corners may not exist, as faces to be checked can have wrong
/// indices.
fn area_normal(face: &[u32], at: &[DVec3]) -> DVec3 {
    let point = |i: u32| at.get(i as usize).copied().unwrap_or_default();
    let Some(&first) = face.first() else { return DVec3::ZERO };
    let corners = face.iter().zip(face.iter().cycle().skip(1));
    corners.map(|(&c, &d)| (point(c) - point(first)).cross(point(d) - point(first))).sum()
}

/// Cost of a triangle that folds back onto the face behind one of its sides, as a multiple of the triangle's area, for
/// each such side. It decides between triangulations of equal area: of the two that close a missing corner of a cube,
/// one lies on the remaining faces.
const FOLD_COST: f64 = 1.0;

/// Smallest area of a triangle without corners in line, as a fraction of the square of its longest side.
const MIN_AREA: f64 = 1e-6;

/// Cosine of the angle between two faces above which they are folded onto each other (8 degrees).
const MAX_FOLD_COSINE: f64 = 0.99;

/// Computes a minimum-area triangulation of an outline, with the outline's orientation. It avoids triangles without area
/// and folding onto the `faces` around the hole. `None` if the outline has too many corners.
///
/// Source: Barequet and Sharir 1995, "Filling gaps in the boundary of a polyhedron" (dynamic programming).
pub fn triangulate(outline: &[u32], at: &[DVec3], faces: &[Vec<u32>]) -> Option<Vec<[u32; 3]>> {
    let n = outline.len();
    if !(3..=MAX_EDGES).contains(&n) {
        return None;
    }
    let p = |k: usize| at[outline[k] as usize];
    let behind = behind(outline, at, faces);
    let folds = |side: usize, opposite: usize| {
        let (from, to) = (p(side), p((side + 1) % n));
        let across = (p(opposite) - from).reject_from((to - from).normalize_or(DVec3::X));
        f64::from(u8::from(across.normalize_or_zero().dot(behind[side]) > MAX_FOLD_COSINE))
    };
    // Cost of a triangle without area, larger than the area of a triangulation without one.
    let avoided = (0..n).map(|k| p(k).distance(p((k + 1) % n))).sum::<f64>().powi(2);
    let mut cost = vec![vec![0.0_f64; n]; n];
    let mut split = vec![vec![0; n]; n];
    for length in 2..n {
        for i in 0..n - length {
            let k = i + length;
            cost[i][k] = f64::INFINITY;
            for m in i + 1..k {
                let area = (p(m) - p(i)).cross(p(k) - p(i)).length();
                let longest = [(m, i), (k, i), (m, k)].map(|(a, b)| p(a).distance_squared(p(b))).into_iter();
                let is_flat = area <= MIN_AREA * longest.fold(0.0, f64::max);
                let mut folded = 0.0;
                for (is_side, side, opposite) in
                    [(m == i + 1, i, k), (k == m + 1, m, i), (length == n - 1, n - 1, m)]
                {
                    if is_side {
                        folded += folds(side, opposite);
                    }
                }
                let flat = if is_flat { avoided } else { 0.0 };
                let total = cost[i][m] + cost[m][k] + area * (1.0 + FOLD_COST * folded) + flat;
                if total < cost[i][k] {
                    cost[i][k] = total;
                    split[i][k] = m;
                }
            }
        }
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut spans = vec![(0, n - 1)];
    while let Some((i, k)) = spans.pop() {
        if k - i < 2 {
            continue;
        }
        let m = split[i][k];
        triangles.push([outline[i], outline[m], outline[k]]);
        spans.extend([(i, m), (m, k)]);
    }
    Some(triangles)
}

/// Returns, for each side of an outline, the unit direction from the side across the neighbouring face. Zero if the
/// side has no such face.
fn behind(outline: &[u32], at: &[DVec3], faces: &[Vec<u32>]) -> Vec<DVec3> {
    let n = outline.len();
    let key = |a: u32, b: u32| [a.min(b), a.max(b)];
    let sides: HashMap<[u32; 2], usize> =
        (0..n).map(|k| (key(outline[k], outline[(k + 1) % n]), k)).collect();
    let mut across = vec![DVec3::ZERO; n];
    for face in faces {
        for (k, &a) in face.iter().enumerate() {
            let b = face[(k + 1) % face.len()];
            let Some(&side) = sides.get(&key(a, b)) else { continue };
            let point = |i: u32| at.get(i as usize).copied().unwrap_or_default();
            // The result does not depend on the face's orientation, which reverses both normal and side.
            let normal = area_normal(face, at);
            across[side] = normal.cross(point(b) - point(a)).normalize_or_zero();
        }
    }
    across
}
