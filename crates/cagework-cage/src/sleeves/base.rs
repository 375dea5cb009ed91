//! The base mesh: a tube of rings along the trunk, from whose quads the sleeves of limbs are extruded.

use glam::DVec3;

use super::Plan;
use super::limb::Exit;
use super::rings::Ring;

/// Corners of rings of four and of six vertices. The vertices of six-cornered rings on the mirror plane have a first
/// coordinate of 0.
const FOUR: [[i8; 2]; 4] = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
const SIX: [[i8; 2]; 6] = [[-1, -1], [0, -1], [1, -1], [1, 1], [0, 1], [-1, 1]];

/// Weight of the distance of a quad from a limb's axis against the angle between them, when a limb chooses the quad
/// through which it leaves.
const QUAD_DISTANCE: f64 = 0.6;

/// Place of a quad in a sleeve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Between the rings `k` and `k + 1` of [`super::limb::Limb::stops`].
    Between(usize),
    /// At the closed start of the trunk.
    Start,
    /// At the closed end.
    End,
}

/// A quad of a sleeve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quad {
    pub(super) corners: [u32; 4],
    pub(super) limb: usize,
    pub(super) place: Place,
}

/// A closed mesh of quads.
#[derive(Clone, Debug, Default)]
pub(super) struct Base {
    pub(super) quads: Vec<Quad>,
    /// Rings in order of their vertices.
    pub(super) rings: Vec<Ring>,
    /// Indices of the rings of each limb, from its base. `[n_limbs]`
    pub(super) of_limb: Vec<Vec<usize>>,
    /// Vertices of the parent's sleeve from which each limb starts; those of the first ring for the trunk. `[n_limbs]`
    pub(super) loops: Vec<Vec<u32>>,
    pub(super) positions: Vec<DVec3>,
    /// Whether a vertex is in the middle of a long side of a ring of six. `[n_vertices]`
    pub(super) is_middle: Vec<bool>,
}

impl Base {
    fn add_ring(&mut self, mut ring: Ring, corners: Vec<[i8; 2]>) -> Vec<u32> {
        let [a, b, c, d] = ring.extents;
        let pick = |k: i8, [low, high]: [f64; 2]| match k {
            -1 => low,
            0 => 0.5 * (low + high),
            _ => high,
        };
        let n = self.positions.len() as u32;
        ring.vertices = (n..n + corners.len() as u32).collect();
        for &[i, j] in &corners {
            self.positions
                .push(ring.center + pick(i, [a, b]) * ring.across[0] + pick(j, [c, d]) * ring.across[1]);
        }
        self.is_middle.extend(corners.iter().map(|corner| corner[0] == 0));
        ring.corners = corners;
        self.of_limb[ring.limb].push(self.rings.len());
        let vertices = ring.vertices.clone();
        self.rings.push(ring);
        vertices
    }

    fn normal(&self, quad: &Quad) -> DVec3 {
        let [a, b, c, d] = self.at(quad);
        (c - a).cross(d - b).normalize_or_zero()
    }

    fn at(&self, quad: &Quad) -> [DVec3; 4] {
        quad.corners.map(|v| self.positions[v as usize])
    }
}

impl Plan<'_> {
    /// Builds the base mesh.
    ///
    /// # Errors
    /// Index of a limb for which its parent has no quad left.
    pub(super) fn base(&self) -> Result<Base, usize> {
        let n = self.limbs.len();
        let mut base = Base { of_limb: vec![Vec::new(); n], loops: vec![Vec::new(); n], ..Base::default() };
        let stops = self.limbs[0].stops();
        let mut before: Vec<u32> = Vec::new();
        for j in 0..stops.len() {
            let vertices = base.add_ring(self.ring(0, &stops, j), SIX.to_vec());
            if j > 0 {
                add_tube(&mut base, &before, &vertices, 0, j - 1);
            }
            before = vertices;
        }
        let first = base.rings[0].vertices.clone();
        base.loops[0].clone_from(&first);
        for (v, order, place) in [
            (&first, [[0, 5, 4, 1], [1, 4, 3, 2]], Place::Start),
            (&before, [[0, 1, 4, 5], [1, 2, 3, 4]], Place::End),
        ] {
            base.quads.extend(order.map(|o| Quad { corners: o.map(|k: usize| v[k]), limb: 0, place }));
        }
        // Parents come before their children, and limbs of the same parent stay in order.
        for i in 1..n {
            self.attach(&mut base, i)?;
        }
        Ok(base)
    }

    /// Extrudes the sleeve of a limb from a quad of its parent's sleeve, or from two across the mirror plane.
    fn attach(&self, base: &mut Base, i: usize) -> Result<(), usize> {
        let limb = &self.limbs[i];
        let parent = limb.parent.unwrap_or(0);
        let start = limb.point(limb.first);
        let stops = self.limbs[parent].stops();
        let place = match limb.exit {
            Exit::Start => Place::Start,
            Exit::End => Place::End,
            Exit::Side => {
                let middle = 0.5 * (limb.segment[0] + limb.segment[1]);
                Place::Between(stops.partition_point(|&s| s < middle).clamp(1, stops.len() - 1) - 1)
            }
        };
        let score = |quad: &Quad| {
            let off = base.at(quad).iter().sum::<DVec3>() / 4.0 - start;
            match limb.exit {
                Exit::Side => {
                    let beside = (off - limb.side * off.dot(limb.side)).length() / (0.1);
                    base.normal(quad).dot(limb.side) - QUAD_DISTANCE * beside
                }
                _ => -off.length(),
            }
        };
        let mut chosen: Option<(usize, f64)> = None;
        for (k, quad) in base.quads.iter().enumerate().filter(|(_, q)| q.limb == parent && q.place == place) {
            let value = score(quad);
            if chosen.is_none_or(|best| value > best.1) {
                chosen = Some((k, value));
            }
        }
        let mut region = vec![chosen.ok_or(i)?.0];
        let is_middle = |v: u32| base.is_middle[v as usize];
        let middles =
            |k: usize| -> Vec<u32> { base.quads[k].corners.into_iter().filter(|&v| is_middle(v)).collect() };
        if limb.is_hexagonal {
            let shared = middles(region[0]);
            let is_partner = |&k: &usize| {
                let quad = &base.quads[k];
                let other = middles(k);
                k != region[0]
                    && quad.limb == parent
                    && quad.place == place
                    && shared.len() == 2
                    && other.len() == 2
                    && shared.iter().all(|v| other.contains(v))
            };
            region.push((0..base.quads.len()).find(is_partner).ok_or(i)?);
        }
        let outline = outline(&region.iter().map(|&k| base.quads[k].corners).collect::<Vec<_>>());
        let shift = match outline.len() {
            6 => (0..6)
                .find(|&k| is_middle(outline[(k + 1) % 6]) && is_middle(outline[(k + 4) % 6]))
                .ok_or(i)?,
            _ => 0,
        };
        let outline: Vec<u32> = (0..outline.len()).map(|k| outline[(k + shift) % outline.len()]).collect();
        let removed: Vec<Quad> = region.iter().map(|&k| base.quads[k]).collect();
        region.sort_unstable();
        region.iter().rev().for_each(|&k| {
            base.quads.remove(k);
        });
        base.loops[i].clone_from(&outline);
        let stops = limb.stops();
        let mut before = outline.clone();
        for j in 1..stops.len() {
            let ring = self.ring(i, &stops, j);
            let corners = matched(base, &before, &ring);
            let vertices = base.add_ring(ring, corners);
            add_tube(base, &before, &vertices, i, j - 1);
            before = vertices;
        }
        let moved = |v: u32| outline.iter().position(|&o| o == v).map_or(v, |k| before[k]);
        base.quads.extend(removed.iter().map(|q| Quad {
            corners: q.corners.map(moved),
            limb: i,
            place: Place::End,
        }));
        Ok(())
    }
}

fn add_tube(base: &mut Base, from: &[u32], to: &[u32], limb: usize, k: usize) {
    let n = from.len();
    for i in 0..n {
        let j = (i + 1) % n;
        base.quads.push(Quad { corners: [from[i], from[j], to[j], to[i]], limb, place: Place::Between(k) });
    }
}

/// The closed boundary of one quad, or of two with a common edge, in their order of corners.
fn outline(quads: &[[u32; 4]]) -> Vec<u32> {
    let edges: Vec<[u32; 2]> = quads.iter().flat_map(|q| (0..4).map(|k| [q[k], q[(k + 1) % 4]])).collect();
    let border: Vec<[u32; 2]> = edges.iter().copied().filter(|&[a, b]| !edges.contains(&[b, a])).collect();
    let mut outline = vec![border[0][0]];
    while outline.len() < border.len() {
        let last = outline[outline.len() - 1];
        let Some(edge) = border.iter().find(|edge| edge[0] == last) else { break };
        outline.push(edge[1]);
    }
    outline
}

/// Numbers the corners of a ring so that they point in the same directions as the corners of the loop before it.
fn matched(base: &Base, before: &[u32], ring: &Ring) -> Vec<[i8; 2]> {
    let shape: &[[i8; 2]] = if before.len() == 4 { &FOUR } else { &SIX };
    let n = shape.len();
    let at: Vec<DVec3> = before.iter().map(|&v| base.positions[v as usize]).collect();
    let center = at.iter().sum::<DVec3>() / n as f64;
    let flat: Vec<[f64; 2]> = at.iter().map(|p| ring.across.map(|axis| axis.dot(*p - center))).collect();
    let size = [0, 1].map(|k| flat.iter().fold(1e-12, |most: f64, q| most.max(q[k].abs())));
    let mut best = (f64::NEG_INFINITY, shape.to_vec());
    for turn in 0..n {
        for is_reversed in [false, true] {
            let step = |i: usize| if is_reversed { n - i } else { i };
            let corners: Vec<[i8; 2]> = (0..n).map(|i| shape[(turn + step(i)) % n]).collect();
            // The vertices on the mirror plane stay there.
            if n == 6 && corners[1][0] != 0 {
                continue;
            }
            let products = flat.iter().zip(&corners);
            let score: f64 = products
                .map(|(q, c)| q[0] / size[0] * f64::from(c[0]) + q[1] / size[1] * f64::from(c[1]))
                .sum();
            if score > best.0 {
                best = (score, corners);
            }
        }
    }
    best.1
}
