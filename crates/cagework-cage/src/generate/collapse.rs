//! Edge collapses, cheapest first, down to the target or until the obstacle blocks every edge.
//!
//! Source: Garland and Heckbert 1997 for the cost. Changes: the merged vertex goes to the minimum of the quadric or, if
//! the solid is in the way, outward along the normal until its triangles are clear. A coarse cage therefore bulges
//! around the model like a progressive hull (Sander et al. 2000). An edge whose merged vertex costs more than expected
//! returns to the heap at that cost.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::guarded::GuardedSurface;
use super::mirrors::Mirrors;
use super::quadric::Quadric;
use super::shell::Spacing;
use cagework_core::contact::Corners;
use cagework_core::progress::Cancellation;

/// Offsets along the normal that are tried for the merged vertex, voxels.
const NORMAL_OFFSETS: [f64; 8] = [0.0, 0.3, 0.6, 1.0, 1.5, 2.1, 2.8, 3.6];

/// Smallest allowed cosine between the normals of a triangle before and after a collapse.
const MIN_COLLAPSE_COSINE: f64 = 0.15;

/// Smallest allowed [`quality`] of a triangle that a collapse changes.
pub(super) const MIN_QUALITY: f64 = 0.12;

/// Largest allowed number of triangles around a vertex.
const MAX_VALENCE: usize = 11;

/// An edge whose collapse costs more than this factor times the expected cost returns to the heap, unless it is still
/// the cheapest.
const MAX_COST_RATIO: f64 = 1.2;

/// Number of collapses between polls for cancellation.
const COLLAPSES_PER_CHECK: usize = 64;

/// An edge in the heap of collapses.
#[derive(Debug, PartialEq)]
struct HeapEdge {
    cost: f64,
    edge: [u32; 2],
    /// Versions of both vertices when the cost was computed. The cost is out of date if either version has changed.
    version: [u32; 2],
}

impl Eq for HeapEdge {}

impl PartialOrd for HeapEdge {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for HeapEdge {
    /// Orders by descending cost, so that the heap pops the cheapest edge first. Equal costs are ordered by vertex
    /// indices, so that runs are deterministic.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.edge.cmp(&self.edge))
    }
}

#[derive(Debug)]
pub(super) struct Collapser<'g, 'a> {
    pub(super) surface: &'g mut GuardedSurface<'a>,
    pub(super) quadrics: Vec<Quadric>,
    /// Quadrics of the planes without the point term of [`Quadric::of_corner`]: squared distance of a vertex from the
    /// part of the hull that the vertex replaces.
    planes: Vec<Quadric>,
    /// Limit on the RMS of the distance in `planes`, voxels; `None` for no limit.
    pub(super) budget: Option<f64>,
    /// Whether to limit the spacing of vertices on plates (thin flat parts; see [`Spacing`]).
    pub(super) keeps_plates: bool,
    /// Limit on [`GuardedSurface::visits`], at which no more edges are collapsed.
    pub(super) max_visits: u64,
    /// Limit on the distance of each vertex from its neighbours, if it lies on a limb or plate.
    pub(super) spacings: Vec<Option<Spacing>>,
    version: Vec<u32>,
    heap: BinaryHeap<HeapEdge>,
    /// Number of vertices of the whole surface, including the mirror image.
    count: usize,
    scratch: Scratch,
}

#[derive(Debug, Default)]
struct Scratch {
    near_a: Vec<u32>,
    near_b: Vec<u32>,
    /// Triangles that a collapse changes, with their current corners and normals.
    star: Vec<(Corners, DVec3)>,
    gone: Vec<u32>,
    new: Vec<Corners>,
}

/// Computes the quality of a triangle, `4 sqrt(3) area / sum of squared edges`: 1 if equilateral, 0 if degenerate.
pub(super) fn quality(t: &[DVec3; 3]) -> f64 {
    let edges =
        (t[1] - t[0]).length_squared() + (t[2] - t[1]).length_squared() + (t[0] - t[2]).length_squared();
    2.0 * 3.0_f64.sqrt() * (t[1] - t[0]).cross(t[2] - t[0]).length() / edges.max(1e-300)
}

impl<'g, 'a> Collapser<'g, 'a> {
    pub(super) fn new(surface: &'g mut GuardedSurface<'a>, spacings: Vec<Option<Spacing>>) -> Self {
        let n = surface.positions.len();
        let mut quadrics = vec![Quadric::default(); n];
        let mut planes = quadrics.clone();
        for t in 0..surface.triangles.len() as u32 {
            let corners = surface.corners(t);
            let normal = corners.normal();
            for (&i, &p) in corners.index.iter().zip(&corners.at) {
                let quadric = &mut quadrics[i as usize];
                *quadric = quadric.plus(&Quadric::of_corner(p, normal));
                let plane = &mut planes[i as usize];
                *plane = plane.plus(&Quadric::of_plane(p, normal));
            }
        }
        let count = surface.surface().n_whole();
        Self {
            surface,
            quadrics,
            planes,
            budget: None,
            keeps_plates: false,
            max_visits: u64::MAX,
            spacings,
            version: vec![0; n],
            heap: BinaryHeap::new(),
            count,
            scratch: Scratch::default(),
        }
    }

    fn wait_for_all(&mut self) {
        let mut near = Vec::new();
        for v in 0..self.surface.positions.len() as u32 {
            self.surface.neighbours(v, &mut near);
            for &w in near.iter().filter(|&&w| w > v) {
                self.wait([v, w]);
            }
        }
    }

    /// Collapses edges until `target` vertices are left, no edge can be collapsed, or the searches reach
    /// [`Self::max_visits`]. Returns the number of vertices.
    ///
    /// # Errors
    /// If `go_on`, called with the completed share, cancels.
    pub(super) fn run(
        &mut self,
        target: usize,
        go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
    ) -> Result<usize, Cancellation> {
        self.heap.clear();
        self.wait_for_all();
        let before = self.count;
        let (mut steps, mut count_then) = (0, before);
        while self.count > target && !self.is_exhausted() {
            let Some(waiting) = self.heap.pop() else {
                if self.count == count_then || self.surface.has_band() {
                    break;
                }
                // Blocked edges may be free now that the triangles around them have changed, so try all edges again.
                // With a band, this is not needed, because the next, wider band tries all edges.
                count_then = self.count;
                self.wait_for_all();
                continue;
            };
            let [a, b] = waiting.edge;
            if [a, b].map(|v| self.version[v as usize]) != waiting.version || !self.is_allowed(a, b) {
                continue;
            }
            steps += 1;
            if steps % COLLAPSES_PER_CHECK == 0 {
                go_on((before - self.count) as f32 / (before - target) as f32)?;
            }
            let Some((at, cost)) = self.place_of(a, b) else { continue };
            if self.is_over_budget(a, b, at) {
                continue;
            }
            let next = self.heap.peek().map_or(f64::INFINITY, |next| next.cost);
            if cost > MAX_COST_RATIO * waiting.cost + 1e-9 && cost > next {
                self.heap.push(HeapEdge { cost, ..waiting });
                continue;
            }
            self.collapse(a, b, at);
        }
        Ok(self.count)
    }

    /// Whether the searches have reached [`Self::max_visits`].
    pub(super) fn is_exhausted(&self) -> bool {
        self.surface.visits() >= self.max_visits
    }

    /// Returns the vertex that remains when the edge is collapsed, then the vertex that is removed. The vertex on more
    /// mirror planes remains.
    fn ordered(&self, a: u32, b: u32) -> (u32, u32) {
        let n_planes = |v: u32| self.surface.on_mirror[v as usize].len();
        if n_planes(b) >= n_planes(a) && n_planes(b) > 0 { (b, a) } else { (a, b) }
    }

    /// Returns the mirror planes on which the merged vertex must lie.
    fn pinned(&self, kept: u32) -> Mirrors {
        self.surface.on_mirror[kept as usize]
    }

    fn merged_quadric(&self, a: u32, b: u32) -> Quadric {
        self.quadrics[a as usize].plus(&self.quadrics[b as usize])
    }

    /// Returns the point at which an edge's quadric is minimal if it is near the edge, otherwise the middle of the
    /// edge.
    fn optimum(&self, a: u32, b: u32) -> DVec3 {
        let (kept, _) = self.ordered(a, b);
        let pinned = self.pinned(kept);
        let [p, q] = [a, b].map(|v| self.surface.positions[v as usize]);
        let middle = pinned.project(0.5 * (p + q));
        let reach = 1.5 * (p - q).length() + 0.5;
        self.merged_quadric(a, b).minimum(pinned).filter(|o| o.distance(middle) < reach).unwrap_or(middle)
    }

    /// Pushes an edge to the heap with the cost of a merged vertex at [`Self::optimum`]. Whether the edge can be
    /// collapsed is tested later.
    fn wait(&mut self, edge: [u32; 2]) {
        let [a, b] = edge;
        let cost = self.merged_quadric(a, b).cost(self.optimum(a, b));
        let version = edge.map(|v| self.version[v as usize]);
        self.heap.push(HeapEdge { cost, edge, version });
    }

    /// Whether the surface remains a manifold (and, with mirrors, part of one) when the edge is collapsed: the link
    /// condition (Dey et al. 1999).
    fn is_allowed(&mut self, a: u32, b: u32) -> bool {
        let swapped = self.ordered(a, b).0 == b;
        let Scratch { near_a, near_b, .. } = &mut self.scratch;
        let surface = &*self.surface;
        surface.neighbours(a, near_a);
        surface.neighbours(b, near_b);
        let around = surface.around[a as usize].iter().map(|&t| surface.triangles[t as usize]);
        let sides: Vec<u32> = around
            .filter(|t| t.contains(&b))
            .filter_map(|t| t.into_iter().find(|&i| i != a && i != b))
            .collect();
        let common = near_a.iter().filter(|v| near_b.binary_search(v).is_ok()).count();
        if sides.is_empty() || common != sides.len() {
            return false;
        }
        if near_a.len() + near_b.len() - 2 - common > MAX_VALENCE {
            return false;
        }
        // Each vertex opposite the edge loses a triangle.
        if sides.iter().any(|&tip| surface.needs_all(tip)) {
            return false;
        }
        let (kept, gone) = if swapped { (b, a) } else { (a, b) };
        let [on_kept, on_gone] = [kept, gone].map(|v| surface.on_mirror[v as usize]);
        // A vertex may not leave its mirror planes, and only an edge of the border lies in one.
        if !on_gone.without(on_kept).is_empty() || (!on_gone.is_empty() && sides.len() != 1) {
            return false;
        }
        // The collapse must not create an inner edge between two vertices of a mirror plane: its image would be the same
        // edge.
        let (near_kept, near_gone) = if swapped { (&*near_b, &*near_a) } else { (&*near_a, &*near_b) };
        let is_new = |v: u32| v != kept && near_kept.binary_search(&v).is_err();
        if near_gone.iter().any(|&v| is_new(v) && surface.common(v, kept) != surface.common(v, gone)) {
            return false;
        }
        // A triangle may not lie in a mirror plane.
        surface.around[gone as usize].iter().map(|&t| surface.triangles[t as usize]).all(|t| {
            let others = t.iter().filter(|&&i| i != gone);
            t.contains(&kept)
                || others.fold(on_kept, |on, &i| on.and(surface.on_mirror[i as usize])).is_empty()
        })
    }

    fn place_of(&mut self, a: u32, b: u32) -> Option<(DVec3, f64)> {
        let (kept, gone) = self.ordered(a, b);
        let surface = &*self.surface;
        let Scratch { star, gone: removed, .. } = &mut self.scratch;
        star.clear();
        removed.clear();
        let mut outward = DVec3::ZERO;
        for (v, other) in [(kept, gone), (gone, kept)] {
            for &t in &surface.around[v as usize] {
                let corners = surface.corners(t);
                let normal = corners.normal();
                outward += normal;
                if !corners.index.contains(&other) {
                    let index = corners.index.map(|i| if i == gone { kept } else { i });
                    star.push((Corners { index, ..corners }, normal));
                    removed.push(t);
                } else if v == kept {
                    removed.push(t);
                }
            }
        }
        let quadric = self.merged_quadric(a, b);
        let pinned = self.pinned(kept);
        let outward = pinned.project(outward).normalize_or_zero();
        let optimum = self.optimum(a, b);
        let [p, q] = [kept, gone].map(|v| self.surface.positions[v as usize]);
        let is_movable = pinned == self.surface.on_mirror[gone as usize];
        let middle = if is_movable { 0.5 * (p + q) } else { p };
        let mut candidates = Vec::with_capacity(2 * NORMAL_OFFSETS.len() + 2);
        for push in NORMAL_OFFSETS {
            candidates.push(optimum + push * outward);
            candidates.push(middle + push * outward);
        }
        candidates.push(p);
        if is_movable {
            candidates.push(q);
        }
        candidates.retain(|&c| !self.surface.is_blocked(c));
        let mut priced: Vec<(f64, DVec3)> = candidates.into_iter().map(|c| (quadric.cost(c), c)).collect();
        // Test candidates from the cheapest up. The first one is usually valid, so sorting all would cost more.
        while let Some(k) = (0..priced.len()).min_by(|&x, &y| priced[x].0.total_cmp(&priced[y].0)) {
            let (cost, place) = priced.remove(k);
            if self.is_place(kept, place) {
                return Some((place, cost));
            }
        }
        None
    }

    /// Whether the triangles that [`Self::place_of`] collected are valid with the vertex `kept` at `p`.
    fn is_place(&mut self, kept: u32, p: DVec3) -> bool {
        let Scratch { star, gone, new, .. } = &mut self.scratch;
        new.clear();
        for (corners, before) in star.iter() {
            let mut moved = *corners;
            for (i, at) in moved.index.iter().zip(&mut moved.at) {
                if *i == kept {
                    *at = p;
                }
            }
            let after = moved.normal();
            if quality(&moved.at) < MIN_QUALITY
                || before.dot(after) < MIN_COLLAPSE_COSINE * before.length() * after.length()
            {
                return false;
            }
            new.push(moved);
        }
        self.surface.may_stand(new, gone)
    }

    /// Whether the merged vertex at `at` exceeds its limits: the RMS distance to the planes of the hull (weighted by
    /// area), or the distance from its neighbours on a limb or plate. The distance along limbs is limited only while
    /// `budget` is set.
    fn is_over_budget(&self, a: u32, b: u32, at: DVec3) -> bool {
        let planes = self.planes[a as usize].plus(&self.planes[b as usize]);
        let is_off = |budget: f64| (planes.at(at) / planes.area.max(1e-12)).sqrt() > budget;
        let is_too_far = |spacing: &Spacing| {
            let star = self.scratch.star.iter().flat_map(|(corners, _)| corners.index.iter().zip(corners.at));
            star.filter(|&(&i, _)| i != a && i != b).any(|(_, p)| spacing.is_below(p - at))
        };
        let spacings = || [a, b].into_iter().filter_map(|v| self.spacings[v as usize].as_ref());
        self.budget.is_some_and(is_off)
            || (self.budget.is_some() && self.spacing_of(a, b).as_ref().is_some_and(is_too_far))
            || (self.keeps_plates && spacings().filter(|spacing| spacing.along.is_none()).any(is_too_far))
    }

    /// Returns the stricter spacing limit of two vertices: the one on a plate, which limits all directions, otherwise
    /// the smaller one.
    fn spacing_of(&self, a: u32, b: u32) -> Option<Spacing> {
        let spacings = [a, b].into_iter().filter_map(|v| self.spacings[v as usize]);
        spacings
            .min_by(|x, y| x.along.is_some().cmp(&y.along.is_some()).then(x.distance.total_cmp(&y.distance)))
    }

    fn collapse(&mut self, a: u32, b: u32, at: DVec3) {
        let (kept, gone) = self.ordered(a, b);
        self.planes[kept as usize] = self.planes[a as usize].plus(&self.planes[b as usize]);
        self.spacings[kept as usize] = self.spacing_of(a, b);
        self.count -= 1 << self.surface.mirrors.without(self.surface.on_mirror[gone as usize]).len();
        self.surface.merge(kept, gone, at);
        self.quadrics[kept as usize] = self.merged_quadric(a, b);
        self.version[kept as usize] += 1;
        self.version[gone as usize] += 1;
        let mut near = std::mem::take(&mut self.scratch.near_a);
        self.surface.neighbours(kept, &mut near);
        for &v in &near {
            self.wait([kept.min(v), kept.max(v)]);
        }
        self.scratch.near_a = near;
    }
}
