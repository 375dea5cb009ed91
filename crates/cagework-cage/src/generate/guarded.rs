//! A surface that tests whether an edit would make it meet the solid or itself ([`GuardedSurface::may_stand`]).

use glam::DVec3;

use super::buckets::Buckets;
use super::footprint::any_run;
use super::mirrors::Mirrors;
use super::surface::Surface;
use super::voxels::Voxels;
use cagework_core::contact::{Corners, meet};

/// Smallest allowed distance between triangles that share no vertex, in voxels.
const MIN_GAP: f64 = 0.05;

/// Amount by which each voxel of a gap sheet is shrunk on all sides, in voxels, so that walls of the cage beside a
/// sheet may graze it.
const SHEET_SHRINKAGE: f64 = 0.4;

/// Smallest allowed distance of vertices from the mirror plane, in voxels; vertices on the plane are excepted.
const MIN_MIRROR_DISTANCE: f64 = 0.1;

/// Smallest allowed cosine between the normals of neighbouring triangles: folds of up to 120 degrees. Deforming a cage
/// with a sharper fold would turn the model inside out there.
pub(crate) const MIN_FOLD_COSINE: f64 = -0.5;

/// A solid that the surface must not meet.
#[derive(Debug)]
pub(super) struct Obstacle {
    pub(super) voxels: Voxels,
    /// Smallest allowed Chebyshev distance of triangles from the voxels, in voxels.
    pub(super) clearance: f64,
    /// Longest edge of a voxel divided by its edge along each axis.
    pub(super) stretch: DVec3,
}

impl Obstacle {
    /// Whether a triangle (centred coordinates) keeps the clearance from the voxels.
    pub(super) fn is_clear(&self, triangle: [DVec3; 3]) -> bool {
        !overlaps(&self.voxels, triangle, self.clearance)
    }

    /// Scales a triangle (centred coordinates) so that its angles are those in object units.
    pub(super) fn unstretched(&self, triangle: &Corners) -> Corners {
        Corners { at: triangle.at.map(|p| p / self.stretch), ..*triangle }
    }
}

/// Whether a triangle (centred coordinates) overlaps a voxel of a set. Each voxel is enlarged by `grow` on all sides.
fn overlaps(voxels: &Voxels, triangle: [DVec3; 3], grow: f64) -> bool {
    let half = DVec3::from_array(voxels.dims.map(|n| 0.5 * n as f64));
    any_run(triangle.map(|p| p + half), grow, voxels.dims, |y, z, first, last| {
        voxels.has_run(y, z, first, last)
    })
}

/// An editable surface. Removed triangles and vertices leave unused indices.
#[derive(Debug)]
pub(super) struct GuardedSurface<'a> {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Triangles around each vertex; empty for removed vertices.
    pub(super) around: Vec<Vec<u32>>,
    pub(super) on_mirror: Vec<Mirrors>,
    pub(super) mirrors: Mirrors,
    /// Whether folds sharper than [`MIN_FOLD_COSINE`] are allowed.
    pub(super) may_fold: bool,
    obstacle: &'a Obstacle,
    /// Voxels that no triangle may overlap: the solid and everything outside the band, if there is one
    /// ([`Self::set_band`]).
    keep_out: Voxels,
    has_band: bool,
    /// Sheets of gaps ([`super::gaps`]), which no triangle may cross, with the corners of their box (centred
    /// coordinates).
    sheets: Option<(Voxels, [DVec3; 2])>,
    buckets: Buckets,
    bounds: Vec<Option<(DVec3, DVec3)>>,
    near: Vec<u32>,
    /// Index, in the latest list of new triangles, of the triangle that was not clear.
    last_unclear: usize,
}

impl<'a> GuardedSurface<'a> {
    /// Wraps a surface, which must be clear of the obstacle and of itself.
    pub(super) fn new(surface: Surface, obstacle: &'a Obstacle) -> Self {
        let half = DVec3::from_array(obstacle.voxels.dims.map(|n| 0.5 * n as f64));
        let n = surface.triangles.len();
        let mut guarded = Self {
            around: vec![Vec::new(); surface.positions.len()],
            positions: surface.positions,
            triangles: surface.triangles,
            on_mirror: surface.on_mirror,
            mirrors: surface.mirrors,
            may_fold: false,
            obstacle,
            keep_out: obstacle.voxels.clone(),
            has_band: false,
            sheets: None,
            buckets: Buckets::new(half, n),
            bounds: vec![None; n],
            near: Vec::new(),
            last_unclear: 0,
        };
        for t in 0..n {
            for i in guarded.triangles[t] {
                guarded.around[i as usize].push(t as u32);
            }
            guarded.note(t as u32);
        }
        guarded
    }

    /// Sets the band to which triangles are confined; `None` removes the limit.
    pub(super) fn set_band(&mut self, band: Option<&Voxels>) {
        self.has_band = band.is_some();
        self.keep_out = self.obstacle.voxels.clone();
        if let Some(band) = band {
            self.keep_out.unite(&band.complement());
        }
    }

    pub(super) fn set_sheets(&mut self, sheets: Option<Voxels>) {
        self.sheets = sheets.map(|sheets| {
            let half = DVec3::from_array(sheets.dims.map(|n| 0.5 * n as f64));
            let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            sheets.for_each(|v| {
                let corner = DVec3::from_array(v.map(|x| x as f64)) - half;
                (min, max) = (min.min(corner), max.max(corner + 1.0));
            });
            (sheets, [min, max])
        });
    }

    /// Whether a triangle is clear of the solid, lies in the band and crosses no sheet.
    fn is_clear(&self, triangle: [DVec3; 3]) -> bool {
        let half = DVec3::from_array(self.keep_out.dims.map(|n| 0.5 * n as f64));
        let leaves = self.has_band && triangle.iter().any(|p| p.abs().cmpge(half).any());
        let [a, b, c] = triangle;
        let crosses = |(sheets, [min, max]): &(Voxels, [DVec3; 2])| {
            let is_beside = a.max(b).max(c).cmplt(*min).any() || a.min(b).min(c).cmpgt(*max).any();
            !is_beside && overlaps(sheets, triangle, -SHEET_SHRINKAGE)
        };
        !leaves
            && !overlaps(&self.keep_out, triangle, self.obstacle.clearance)
            && !self.sheets.as_ref().is_some_and(crosses)
    }

    /// Whether no triangle may have a corner at a point, because the point's voxel belongs to the solid or lies outside
    /// the band.
    pub(super) fn is_blocked(&self, p: DVec3) -> bool {
        let dims = self.keep_out.dims.map(|n| n as f64);
        let at = p + 0.5 * DVec3::from_array(dims);
        if at.cmplt(DVec3::ZERO).any() || at.cmpge(DVec3::from_array(dims)).any() {
            return self.has_band;
        }
        self.keep_out.has(at.to_array().map(|x| x as usize))
    }

    pub(super) fn has_band(&self) -> bool {
        self.has_band
    }

    /// Returns the current surface without unused indices.
    pub(super) fn surface(&self) -> Surface {
        let mut number = vec![u32::MAX; self.positions.len()];
        let mut surface = Surface { mirrors: self.mirrors, ..Surface::default() };
        for (v, _) in self.around.iter().enumerate().filter(|(_, around)| !around.is_empty()) {
            number[v] = surface.positions.len() as u32;
            surface.positions.push(self.positions[v]);
            surface.on_mirror.push(self.on_mirror[v]);
        }
        let alive = self.triangles.iter().zip(&self.bounds).filter(|(_, bounds)| bounds.is_some());
        surface.triangles = alive.map(|(t, _)| t.map(|i| number[i as usize])).collect();
        surface
    }

    /// Work of the searches for near triangles until now ([`Buckets::visits`]).
    pub(super) fn visits(&self) -> u64 {
        self.buckets.visits
    }

    pub(super) fn is_alive(&self, triangle: u32) -> bool {
        self.bounds[triangle as usize].is_some()
    }

    pub(super) fn corners(&self, triangle: u32) -> Corners {
        let index = self.triangles[triangle as usize];
        Corners { index, at: index.map(|i| self.positions[i as usize]) }
    }

    fn note(&mut self, triangle: u32) {
        let corners = self.corners(triangle);
        let (min, max) = (corners.min(), corners.max());
        self.bounds[triangle as usize] = Some((min, max));
        self.buckets.add(triangle, min, max);
    }

    /// Returns the smallest cosine between the normals of neighbours: among `triangles`, between them and `others`, and
    /// across the mirror.
    fn sharpest(&self, triangles: &[Corners], others: &[Corners]) -> f64 {
        self.folds(triangles, others).into_iter().fold(1.0, f64::min)
    }

    /// Sums the amounts by which the fold cosines around `triangles` fall below [`MIN_FOLD_COSINE`]. The triangles are
    /// in the surface or would replace the triangles with the indices `gone`.
    pub(super) fn excess(&self, triangles: &[Corners], gone: &[u32]) -> f64 {
        let around = triangles.iter().flat_map(|t| t.index).flat_map(|i| &self.around[i as usize]);
        let mut others: Vec<u32> = around.copied().filter(|t| !gone.contains(t)).collect();
        others.sort_unstable();
        others.dedup();
        let others: Vec<Corners> = others.into_iter().map(|t| self.corners(t)).collect();
        self.folds(triangles, &others).into_iter().map(|cosine| (MIN_FOLD_COSINE - cosine).max(0.0)).sum()
    }

    /// Computes the cosines between the normals of `triangles` and those of their neighbours, which are found among
    /// `triangles`, `others` and the mirror images.
    fn folds(&self, triangles: &[Corners], others: &[Corners]) -> Vec<f64> {
        let real = |t: &Corners| self.obstacle.unstretched(t);
        let triangles: Vec<Corners> = triangles.iter().map(real).collect();
        let others: Vec<Corners> = others.iter().map(real).collect();
        let across = |t: &Corners| {
            let (index, normal) = (t.index, t.normal().normalize_or_zero());
            let is_in = move |axis: usize, i: u32| self.on_mirror[i as usize].has(axis);
            let beside = move |&axis: &usize| index.iter().filter(|&&i| is_in(axis, i)).count() == 2;
            self.mirrors.axes().filter(beside).map(move |axis| 1.0 - 2.0 * normal[axis].powi(2))
        };
        let folds = triangles.iter().enumerate().flat_map(|(k, t)| {
            let beside = triangles[..k].iter().chain(&others);
            beside.filter_map(|other| t.fold_cosine(other)).chain(across(t))
        });
        folds.collect()
    }

    /// Whether the triangles `new` may replace those with the indices `gone`: they must keep clear of the obstacle, of
    /// sheets, of the mirror plane, of the rest of the surface and of each other, and lie in the band. Unless
    /// [`Self::may_fold`], they must not be folded more sharply than both [`MIN_FOLD_COSINE`] and the replaced
    /// triangles.
    pub(super) fn may_stand(&mut self, new: &[Corners], gone: &[u32]) -> bool {
        let is_beside = |i: u32, p: DVec3| {
            let mut off = self.mirrors.without(self.on_mirror[i as usize]).axes();
            off.all(|axis| p[axis] >= MIN_MIRROR_DISTANCE)
        };
        if new.iter().any(|t| t.index.iter().zip(t.at).any(|(&i, p)| !is_beside(i, p))) {
            return false;
        }
        // Candidate positions of one vertex mostly fail at the same triangle: test that triangle first.
        let mut order = (0..new.len()).map(|k| (k + self.last_unclear) % new.len());
        if let Some(k) = order.find(|&k| !self.is_clear(new[k].at)) {
            self.last_unclear = k;
            return false;
        }
        if new.iter().enumerate().any(|(k, a)| new[..k].iter().any(|b| meet(a, b, MIN_GAP))) {
            return false;
        }
        let min = new.iter().fold(DVec3::INFINITY, |m, t| m.min(t.min())) - MIN_GAP;
        let max = new.iter().fold(DVec3::NEG_INFINITY, |m, t| m.max(t.max())) + MIN_GAP;
        let mut near = std::mem::take(&mut self.near);
        let bounds = &self.bounds;
        self.buckets.near(min, max, |t| bounds[t as usize], &mut near);
        let others: Vec<Corners> =
            near.iter().filter(|t| !gone.contains(t)).map(|&t| self.corners(t)).collect();
        let clear = others.iter().all(|other| {
            let (low, high) = (other.min() - MIN_GAP, other.max() + MIN_GAP);
            new.iter().all(|corners| {
                let apart = corners.min().cmpgt(high).any() || corners.max().cmplt(low).any();
                apart || !meet(corners, other, MIN_GAP)
            })
        });
        self.near = near;
        if !clear || self.may_fold {
            return clear;
        }
        let fold = self.sharpest(new, &others);
        let before = || gone.iter().map(|&t| self.corners(t)).collect::<Vec<_>>();
        fold >= MIN_FOLD_COSINE || fold >= self.sharpest(&before(), &others)
    }

    /// Finds the vertices of triangles that intersect other triangles, or come closer to them than [`MIN_GAP`].
    pub(super) fn offenders(&mut self) -> Vec<u32> {
        let mut offenders = Vec::new();
        for t in 0..self.triangles.len() as u32 {
            let corners = self.corners(t);
            let mut near = std::mem::take(&mut self.near);
            let bounds = &self.bounds;
            self.buckets.near(corners.min(), corners.max(), |t| bounds[t as usize], &mut near);
            for &other in near.iter().filter(|&&other| other > t) {
                let other = self.corners(other);
                if meet(&corners, &other, MIN_GAP) {
                    offenders.extend(corners.index);
                    offenders.extend(other.index);
                }
            }
            self.near = near;
        }
        offenders.sort_unstable();
        offenders.dedup();
        offenders
    }

    pub(super) fn place(&mut self, vertex: u32, at: DVec3) {
        self.positions[vertex as usize] = at;
        for k in 0..self.around[vertex as usize].len() {
            self.note(self.around[vertex as usize][k]);
        }
    }

    pub(super) fn merge(&mut self, kept: u32, gone: u32, at: DVec3) {
        for t in std::mem::take(&mut self.around[gone as usize]) {
            let corners = &mut self.triangles[t as usize];
            if corners.contains(&kept) {
                for i in *corners {
                    self.around[i as usize].retain(|&other| other != t);
                }
                self.bounds[t as usize] = None;
            } else {
                for i in corners.iter_mut().filter(|i| **i == gone) {
                    *i = kept;
                }
                self.around[kept as usize].push(t);
            }
        }
        self.place(kept, at);
    }

    /// Computes the flip of the edge `a`-`b` that starts at corner `k` of triangle `t`, without changing the surface.
    /// Returns the triangle on the other side of the edge, and the two new triangles `[a, d, c]` and `[d, b, c]`, which
    /// share the edge between the opposite corners `c` and `d`. `None` if the flipped surface would not be a manifold
    /// (with a mirror, half of one).
    pub(super) fn swapped(&self, t: u32, k: usize) -> Option<(u32, [Corners; 2])> {
        let first = self.triangles[t as usize];
        let (a, b, c) = (first[k], first[(k + 1) % 3], first[(k + 2) % 3]);
        let mut around = self.around[a as usize].iter().copied();
        let other = around.find(|&u| u != t && self.triangles[u as usize].contains(&b))?;
        let d = self.triangles[other as usize].into_iter().find(|&i| i != a && i != b)?;
        let joined = self.around[c as usize].iter().any(|&u| self.triangles[u as usize].contains(&d));
        if c == d || joined || !self.common(c, d).is_empty() || self.needs_all(a) || self.needs_all(b) {
            return None;
        }
        let corners = |index: [u32; 3]| Corners { index, at: index.map(|i| self.positions[i as usize]) };
        Some((other, [[a, d, c], [d, b, c]].map(corners)))
    }

    /// The mirror planes on which both vertices lie.
    pub(super) fn common(&self, a: u32, b: u32) -> Mirrors {
        self.on_mirror[a as usize].and(self.on_mirror[b as usize])
    }

    /// Whether a vertex has only as many triangles as the corner of a solid needs: three, and one less for each mirror
    /// plane on which it lies.
    pub(super) fn needs_all(&self, v: u32) -> bool {
        self.around[v as usize].len() <= 3 - self.on_mirror[v as usize].len() as usize
    }

    /// Flips the common edge of the two triangles `pair`, which become `new`.
    pub(super) fn swap(&mut self, pair: [u32; 2], new: [[u32; 3]; 2]) {
        for t in pair {
            for i in self.triangles[t as usize] {
                self.around[i as usize].retain(|&other| other != t);
            }
        }
        for (t, corners) in pair.into_iter().zip(new) {
            self.triangles[t as usize] = corners;
            for i in corners {
                self.around[i as usize].push(t);
            }
            self.note(t);
        }
    }

    /// Writes to `out` the vertices that share an edge with `vertex`, sorted.
    pub(super) fn neighbours(&self, vertex: u32, out: &mut Vec<u32>) {
        out.clear();
        for &t in &self.around[vertex as usize] {
            out.extend(self.triangles[t as usize].iter().filter(|&&i| i != vertex));
        }
        out.sort_unstable();
        out.dedup();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that open by an angle of 2 atan(0.2); the cosine of the fold is -(1 - 0.2^2) / (1 + 0.2^2).
    #[test]
    fn a_fold_is_measured_in_object_units() {
        let stretch = DVec3::new(3.0, 1.0, 1.0);
        let obstacle = Obstacle { voxels: Voxels::new([8; 3]), clearance: 0.0, stretch };
        let guarded = GuardedSurface::new(Surface::default(), &obstacle);
        let points = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.0, 1.0], [-0.2, 0.0, 1.0]];
        let triangle = |index: [u32; 3]| {
            let at = index.map(|i| stretch * DVec3::from_array(points[i as usize]));
            Corners { index, at }
        };
        let fold = guarded.sharpest(&[triangle([0, 1, 2])], &[triangle([1, 0, 3])]);
        assert!((fold + 0.96 / 1.04).abs() < 1e-12, "{fold}");
    }
}
