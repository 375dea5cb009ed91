//! Pairs triangles into quads: a maximum-weight matching by simulated annealing.
//!
//! Seven times [`MOVES`] moves give no more quads; see `docs/notes/cage-generator.md`.

use glam::DVec3;

use super::guarded::GuardedSurface;
use super::mirrors::Mirrors;
use cagework_core::contact::Corners;

/// Corners of a quad: a vertex, and the planes in which it is mirrored.
pub(super) type Quad = [(u32, Mirrors); 4];

/// Smallest allowed cosine between the normals of a quad's two triangles, for either diagonal. A sharper crease is
/// therefore a border between quads.
const MIN_FOLD_COSINE: f64 = 0.0;
/// Largest [`badness`] for which a quad is allowed.
const MAX_BADNESS: f64 = 4.0;
/// Number of moves of the annealing.
const MOVES: usize = 15_000;
/// Initial temperature of the annealing, in units of the quads' weights, which are about 1.
const TEMPERATURE: f64 = 0.25;
/// Seed of the pseudo-random moves.
const SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// The triangle with which a triangle forms a quad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Partner {
    /// No partner.
    #[default]
    None,
    /// The triangle's own image in the mirror plane normal to an axis, which the quad crosses.
    Image(usize),
    /// Another triangle.
    Triangle(u32),
}

/// Partner of every triangle, and the weight of the quad that the two triangles form.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairing {
    pub(super) partner: Vec<Partner>,
    weight: Vec<f64>,
}

pub(super) fn places(surface: &GuardedSurface<'_>, quad: &Quad) -> [DVec3; 4] {
    quad.map(|(v, image)| image.reflect(surface.positions[v as usize]))
}

/// Computes the deviation of a quad from a plane: the distance between its diagonals, divided by its mean side.
pub(super) fn warp(p: &[DVec3; 4]) -> f64 {
    let normal = (p[2] - p[0]).cross(p[3] - p[1]).normalize_or_zero();
    let side = 0.25 * (0..4).map(|k| p[k].distance(p[(k + 1) % 4])).sum::<f64>();
    normal.dot(p[0] - p[1] + p[2] - p[3]).abs() / (2.0 * side.max(1e-12))
}

/// Computes the shape penalty of a quad: 0 for a rectangle; larger if bent, slanted, tapered or not convex.
pub(super) fn badness(p: &[DVec3; 4]) -> f64 {
    let normal = (p[2] - p[0]).cross(p[3] - p[1]).normalize_or_zero();
    let (mut slant, mut dent) = (0.0, 0.0);
    for k in 0..4 {
        let [next, before] = [(k + 1) % 4, (k + 3) % 4].map(|other| (p[other] - p[k]).normalize_or_zero());
        slant += 0.25 * next.dot(before).powi(2);
        dent += 4.0 * (0.35 - next.cross(before).dot(normal)).max(0.0).powi(2);
    }
    let side = |k: usize| p[k].distance(p[(k + 1) % 4]).max(1e-9);
    let taper = (side(0) / side(2)).ln().powi(2) + (side(1) / side(3)).ln().powi(2);
    1.5 * slant + 3.0 * warp(p).powi(2) + dent + 0.15 * taper
}

/// Returns the quad of a triangle and its partner; `None` if they do not share exactly one edge.
pub(super) fn quad_of(surface: &GuardedSurface<'_>, t: u32, partner: Partner) -> Option<Quad> {
    let x = surface.triangles[t as usize];
    let edge = |is_shared: &dyn Fn(u32, u32, u32) -> bool| {
        (0..3).map(|k| [x[k], x[(k + 1) % 3], x[(k + 2) % 3]]).find(|&[a, b, c]| is_shared(a, b, c))
    };
    match partner {
        Partner::None => None,
        Partner::Image(axis) => {
            let [a, b, c] = edge(&|a, b, _| surface.common(a, b).has(axis))?;
            let image = Mirrors::of_axis(axis);
            Some([(a, Mirrors::NONE), (c, image), (b, Mirrors::NONE), (c, Mirrors::NONE)])
        }
        Partner::Triangle(u) => {
            let y = surface.triangles[u as usize];
            let [a, b, c] = edge(&|a, b, _| y.contains(&a) && y.contains(&b))?;
            let d = y.into_iter().find(|&i| i != a && i != b)?;
            Some([a, d, b, c].map(|v| (v, Mirrors::NONE)))
        }
    }
}

/// Returns the two triangles of a quad when it is cut along its other diagonal; `None` if `t` and `u` do not form a
/// quad.
pub(super) fn other_cut(surface: &GuardedSurface<'_>, t: u32, u: u32) -> Option<[Corners; 2]> {
    let [a, b, c, d] = quad_of(surface, t, Partner::Triangle(u))?.map(|corner| corner.0);
    let corners = |index: [u32; 3]| Corners { index, at: index.map(|i| surface.positions[i as usize]) };
    Some([[a, b, d], [b, c, d]].map(corners))
}

/// Whether the surface allows the other diagonal of a quad; true if the partner is not a second triangle.
pub(super) fn is_free(surface: &mut GuardedSurface<'_>, t: u32, partner: Partner) -> bool {
    let Partner::Triangle(u) = partner else { return true };
    other_cut(surface, t, u).is_some_and(|cut| surface.may_stand(&cut, &[t, u]))
}

/// Computes the weight of a quad in the matching; 0 if the quad is not allowed.
pub(super) fn worth(surface: &GuardedSurface<'_>, t: u32, partner: Partner) -> f64 {
    let Some(quad) = quad_of(surface, t, partner) else { return 0.0 };
    let [_, (b, _), _, (d, _)] = quad;
    let joined =
        |v: u32| surface.around[b as usize].iter().any(|&t| surface.triangles[t as usize].contains(&v));
    // The other diagonal must not be an edge already.
    if !matches!(partner, Partner::Image(_)) && (joined(d) || !surface.common(b, d).is_empty()) {
        return 0.0;
    }
    let p = places(surface, &quad);
    let half = |k: usize| {
        let [a, b, c] = [0, 1, 2].map(|step| p[(k + step) % 4]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let fold = half(0).dot(half(2)).min(half(1).dot(half(3)));
    let badness = badness(&p);
    if fold < MIN_FOLD_COSINE || badness > MAX_BADNESS {
        return 0.0;
    }
    let worth = 0.25 + 1.0 / (1.0 + badness) + 0.3 * fold;
    // The quad lies in both halves of the surface, so each half counts half of its weight.
    if matches!(partner, Partner::Image(_)) { 0.5 * worth } else { worth }
}

/// Pairs triangles to maximise the total weight, starting from `before`. `strict`: allows only quads that may be cut
/// along either diagonal.
pub(super) fn pair(surface: &mut GuardedSurface<'_>, before: &Pairing, strict: bool) -> Pairing {
    let n = surface.triangles.len();
    let mut near: Vec<Vec<(Partner, f64)>> = vec![Vec::new(); n];
    let mut options: Vec<(u32, Partner, f64)> = Vec::new();
    for t in 0..n as u32 {
        let x = surface.triangles[t as usize];
        for k in 0..if surface.is_alive(t) { 3 } else { 0 } {
            let (a, b) = (x[k], x[(k + 1) % 3]);
            let mut others = surface.around[a as usize].iter().copied();
            let other = others.find(|&u| u != t && surface.triangles[u as usize].contains(&b));
            let across = || surface.common(a, b).axes().next().map_or(Partner::None, Partner::Image);
            let partner = other.map_or_else(across, Partner::Triangle);
            let worth = worth(surface, t, partner);
            if worth > 0.0 && (!strict || is_free(surface, t, partner)) {
                near[t as usize].push((partner, worth));
                if other.is_none_or(|u| u > t) {
                    options.push((t, partner, worth));
                }
            }
        }
    }
    let mut pairing = Pairing { partner: vec![Partner::None; n], weight: vec![0.0; n] };
    for (t, &partner) in before.partner.iter().enumerate() {
        if let Some(&(_, worth)) = near[t].iter().find(|option| option.0 == partner) {
            (pairing.partner[t], pairing.weight[t]) = (partner, worth);
        }
    }
    let mut random = SEED;
    let mut undo = Vec::new();
    for k in 0..if options.is_empty() { 0 } else { MOVES } {
        let temperature = TEMPERATURE * (1.0 - k as f64 / MOVES as f64).powi(2) + 1e-4;
        let (t, partner, worth) = options[(next(&mut random) % options.len() as u64) as usize];
        if pairing.partner[t as usize] == partner {
            continue;
        }
        undo.clear();
        let gain = pairing.exchange(t, partner, worth, &near, &mut undo);
        let chance = (next(&mut random) >> 11) as f64 / (1_u64 << 53) as f64;
        if gain < 0.0 && (gain / temperature).exp() < chance {
            for &(t, partner, weight) in undo.iter().rev() {
                (pairing.partner[t as usize], pairing.weight[t as usize]) = (partner, weight);
            }
        }
    }
    pairing.part_doubles(surface);
    pairing
}

/// Advances an xorshift pseudo-random number generator (Marsaglia 2003) and returns its next number.
fn next(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

impl Pairing {
    fn set(&mut self, t: u32, partner: Partner, weight: f64, undo: &mut Vec<(u32, Partner, f64)>) {
        undo.push((t, self.partner[t as usize], self.weight[t as usize]));
        (self.partner[t as usize], self.weight[t as usize]) = (partner, weight);
    }

    /// Adds a quad, and pairs the triangles that lose their partner with others if possible. Returns the gain in
    /// weight.
    fn exchange(
        &mut self,
        t: u32,
        partner: Partner,
        worth: f64,
        near: &[Vec<(Partner, f64)>],
        undo: &mut Vec<(u32, Partner, f64)>,
    ) -> f64 {
        let mut gain = worth;
        let mut left = Vec::new();
        let both = match partner {
            Partner::Triangle(u) => vec![t, u],
            Partner::Image(_) | Partner::None => vec![t],
        };
        for &x in &both {
            let old = self.partner[x as usize];
            if old != Partner::None {
                gain -= self.weight[x as usize];
                self.set(x, Partner::None, 0.0, undo);
            }
            if let Partner::Triangle(y) = old {
                self.set(y, Partner::None, 0.0, undo);
                left.push(y);
            }
        }
        for (k, &x) in both.iter().enumerate() {
            let other = if k == 0 { partner } else { Partner::Triangle(t) };
            self.set(x, other, worth, undo);
        }
        for x in left {
            if self.partner[x as usize] != Partner::None {
                continue;
            }
            let is_free = |partner: Partner| match partner {
                Partner::Triangle(y) => self.partner[y as usize] == Partner::None,
                Partner::Image(_) | Partner::None => true,
            };
            let free = near[x as usize].iter().copied().filter(|option| is_free(option.0));
            if let Some((other, worth)) = free.max_by(|a, b| a.1.total_cmp(&b.1)) {
                gain += worth;
                self.set(x, other, worth, undo);
                if let Partner::Triangle(y) = other {
                    self.set(y, Partner::Triangle(x), worth, undo);
                }
            }
        }
        gain
    }

    /// Splits a quad if an earlier quad has the same unused diagonal: another program may cut both quads along it, and
    /// four triangles would then share this edge. Such quads occur at a vertex with only two edges.
    fn part_doubles(&mut self, surface: &GuardedSurface<'_>) {
        let mut taken = Vec::new();
        for t in 0..self.partner.len() as u32 {
            let partner = self.partner[t as usize];
            if matches!(partner, Partner::Triangle(u) if u < t) {
                continue;
            }
            let Some([_, (b, _), _, (d, _)]) = quad_of(surface, t, partner) else { continue };
            let diagonal = [b.min(d), b.max(d)];
            if taken.contains(&diagonal) {
                self.part(t);
            }
            taken.push(diagonal);
        }
    }

    /// Whether an edge is a side of a face, not the diagonal of a quad.
    pub(super) fn is_side(&self, surface: &GuardedSurface<'_>, v: u32, w: u32) -> bool {
        let has_both = |t: u32| [v, w].iter().all(|i| surface.triangles[t as usize].contains(i));
        let mut around = surface.around[v as usize].iter().filter(|&&t| has_both(t));
        around.all(|&t| !matches!(self.partner[t as usize], Partner::Triangle(u) if has_both(u)))
    }

    pub(super) fn part(&mut self, t: u32) {
        if let Partner::Triangle(u) = std::mem::take(&mut self.partner[t as usize]) {
            self.partner[u as usize] = Partner::None;
        }
    }
}
