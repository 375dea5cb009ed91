//! Finds the boundary loops of holes, and triangulates them.

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::DVec3;

/// Largest number of edges of a hole that is filled. Triangulation costs the cube of this number, and larger holes are
/// usually intended.
pub const MAX_EDGES: usize = 64;

/// Finds the closed loops of edges. Each loop has the direction of the majority of its edges. Ignores edges that are in
/// no loop.
pub fn loops(edges: &[[u32; 2]]) -> Vec<Vec<u32>> {
    // Store edges without direction, as a face next to the hole may be inverted.
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[from, to] in edges {
        next.entry(from).or_default().push(to);
        next.entry(to).or_default().push(from);
    }
    let mut found = Vec::new();
    let starts: Vec<u32> = next.keys().copied().collect();
    for start in starts {
        while !next[&start].is_empty() {
            let mut path = vec![start];
            while let Some(from) = path.last().copied()
                && let Some(to) = next.get_mut(&from).and_then(Vec::pop)
            {
                if let Some(back) = next.get_mut(&to)
                    && let Some(k) = back.iter().position(|&v| v == from)
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
    let directed: HashSet<[u32; 2]> = edges.iter().copied().collect();
    for outline in &mut found {
        let n = outline.len();
        let ahead = (0..n).filter(|&k| directed.contains(&[outline[k], outline[(k + 1) % n]])).count();
        if 2 * ahead < n {
            outline.reverse();
        }
    }
    found
}

/// Cost of a triangle that folds back onto the face behind one of its sides, as a multiple of the triangle's area, for
/// each such side. It decides between triangulations of equal area: of the two that close a missing corner of a cube,
/// one lies on the remaining faces.
const FOLD_COST: f64 = 1.0;

/// Cosine of the angle between two faces above which they are folded onto each other (8 degrees).
const MAX_FOLD_COSINE: f64 = 0.99;

/// Computes a minimum-area triangulation of an outline, with the outline's orientation. It avoids folding onto the
/// `faces` around the hole. `None` if the outline has too many corners.
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
    let mut cost = vec![vec![0.0_f64; n]; n];
    let mut split = vec![vec![0; n]; n];
    for length in 2..n {
        for i in 0..n - length {
            let k = i + length;
            cost[i][k] = f64::INFINITY;
            for m in i + 1..k {
                let area = (p(m) - p(i)).cross(p(k) - p(i)).length();
                let mut folded = 0.0;
                for (is_side, side, opposite) in
                    [(m == i + 1, i, k), (k == m + 1, m, i), (length == n - 1, n - 1, m)]
                {
                    if is_side {
                        folded += folds(side, opposite);
                    }
                }
                let total = cost[i][m] + cost[m][k] + area * (1.0 + FOLD_COST * folded);
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
            let corners = face.iter().zip(face.iter().cycle().skip(1));
            // Newell's normal. The result does not depend on the face's orientation, which reverses both normal and
            // side.
            let normal: DVec3 =
                corners.map(|(&c, &d)| (point(c) - point(a)).cross(point(d) - point(a))).sum();
            across[side] = normal.cross(point(b) - point(a)).normalize_or_zero();
        }
    }
    across
}
