//! Chains of a model without a rig: centred shortest paths through its voxels.

use cagework_core::Bounds;
use cagework_core::nearest::KdTree;
use cagework_core::progress::{Cancellation, Progress, ProgressEvent, Stage};
use glam::{DVec3, Vec3};

use super::mirror::MirrorPlane;
use super::paths::Solid;
use super::{Chain, Skeleton, SkeletonError};
use crate::generate::solid::solid_voxels;

/// Voxels along the longest side.
const VOXELS: f64 = 72.0;

/// A path covers the voxels within this multiple of the local radius, plus [`COVER_VOXELS`].
const COVER: f64 = 1.3;
const COVER_VOXELS: f64 = 2.0;

/// Shortest limb outside the ball of its parent, as a share of the diagonal.
const MIN_LIMB: f64 = 0.06;

/// Allowed distance of a chain from its path, as a share of the diagonal.
const BEND: f64 = 0.018;

/// A path belongs to the trunk if its tip is at most this share of the diagonal from the mirror plane.
const TIP_ON_PLANE: f64 = 0.035;

/// A tip moves to the mirror plane by at most this share of the diagonal.
const TIP_REACH: f64 = 0.06;

/// Limit on the number of paths; those of symmetric pairs count once.
const MAX_PATHS: usize = 16;

/// Rounds of smoothing of a path.
const SMOOTHING: usize = 12;

/// Cosine between a leg and the spine below which the model is a biped.
const BIPED_COSINE: f64 = -0.75;

/// Share of a chain's median radius by which its vertices may be further from its path than from other paths.
const RADIUS_SHARE: f64 = 0.8;

/// Voxels of a model with its mirror plane.
struct Figure {
    solid: Solid,
    plane: MirrorPlane,
    /// Corner of the box of voxels, and edge of a voxel, object units.
    origin: DVec3,
    cell: f64,
    root: u32,
}

/// A path from the tree to a tip, and whether the tip lies on the mirror plane.
struct Path {
    voxels: Vec<u32>,
    is_mid: bool,
}

/// See [`Skeleton::of_surface`].
pub(super) fn of_surface(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    progress: &dyn Progress,
) -> Result<Skeleton, SkeletonError> {
    let go_on = || {
        let event = ProgressEvent { stage: Stage::Voxelize, fraction: 0.0, iteration: 0, delta: None };
        if progress.report(event).is_break() { Err(Cancellation) } else { Ok(()) }
    };
    let bounds = Bounds::around(positions).filter(|_| !triangles.is_empty()).ok_or(SkeletonError::NoFaces)?;
    let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
    let cell = (max - min).max_element() / VOXELS;
    if !(cell.is_normal() && (max - min).min_element() > cell) {
        return Err(SkeletonError::Flat);
    }
    go_on()?;
    let plane = MirrorPlane::of(positions, &[]);
    let mut origin = min - 2.5 * cell;
    let mut dims = ((max - min) / cell).to_array().map(|n| n.ceil() as usize + 5);
    let axis = plane.axis;
    if plane.is_symmetric {
        // One layer of voxels lies on the plane.
        let side = (max[axis] - plane.offset).max(plane.offset - min[axis]);
        let n = (side / cell).ceil() as usize + 3;
        (origin[axis], dims[axis]) = (plane.offset - (n as f64 + 0.5) * cell, 2 * n + 1);
    }
    let points: Vec<DVec3> = positions.iter().map(|p| (p.as_dvec3() - origin) / cell).collect();
    let mirror = plane.is_symmetric.then_some(axis);
    let voxels = solid_voxels(&points, triangles, dims, mirror, &go_on)?.ok_or(SkeletonError::Soup)?;
    if voxels.is_empty() {
        return Err(SkeletonError::Flat);
    }
    let solid = Solid::new(dims, voxels);
    let mut figure = Figure { solid, plane, origin, cell, root: 0 };
    figure.root = figure.deepest();
    let paths = figure.paths(&go_on)?;
    let (chains, seeds, is_biped) = figure.chains(paths);
    let owner = figure.owners(&seeds);
    let centres: Vec<Vec3> = (0..owner.len() as u32).map(|v| figure.centre(v).as_vec3()).collect();
    let nearest = KdTree::new(&centres, (0..owner.len() as u32).collect());
    let chain = |(p, place): (&Vec3, &DVec3)| {
        let own = figure.solid.find(place.floor().to_array().map(|x| x as usize));
        let voxel = own.or_else(|| Some(nearest.find(*p, f32::INFINITY)?.0));
        voxel.map_or(0, |v| owner[v as usize])
    };
    let chain_of: Vec<u32> = positions.iter().zip(&points).map(chain).collect();
    let mut skeleton = Skeleton {
        chains,
        bone_of: chain_of.clone(),
        chain_of,
        axis,
        offset: plane.offset,
        is_symmetric: plane.is_symmetric,
        is_biped,
        is_rigged: false,
    };
    if plane.is_symmetric {
        skeleton.chains.iter_mut().for_each(|chain| chain.is_symmetric = true);
    } else {
        plane.mark_symmetry(&mut skeleton, positions);
    }
    Ok(skeleton)
}

impl Figure {
    /// Centre of a voxel, object units.
    fn centre(&self, v: u32) -> DVec3 {
        let place = DVec3::from_array(self.solid.voxels[v as usize].map(|x| x as f64 + 0.5));
        self.origin + self.cell * place
    }

    fn radius(&self, v: u32) -> f64 {
        self.solid.radius[v as usize]
    }

    /// Distance of a voxel from the mirror plane on its positive side, object units.
    fn side(&self, v: u32) -> f64 {
        self.centre(v)[self.plane.axis] - self.plane.offset
    }

    /// The voxel furthest from the surface, on the mirror plane if the model is symmetric.
    fn deepest(&self) -> u32 {
        let all = || 0..self.solid.voxels.len() as u32;
        let deeper = |best: u32, v: u32| if self.radius(v) > self.radius(best) { v } else { best };
        let is_mid = |v: &u32| self.plane.is_symmetric && self.side(*v).abs() < 0.6 * self.cell;
        all().filter(is_mid).reduce(deeper).or_else(|| all().reduce(deeper)).unwrap_or(0)
    }

    /// Finds the paths of a tree that covers the solid, or of one half of it if the model is symmetric.
    fn paths(&self, go_on: &dyn Fn() -> Result<(), Cancellation>) -> Result<Vec<Path>, Cancellation> {
        let (solid, plane) = (&self.solid, &self.plane);
        let n = solid.voxels.len();
        let (mut is_covered, mut is_on_tree) = (vec![false; n], vec![false; n]);
        let cover = |is_covered: &mut Vec<bool>, v: u32| {
            let radius = COVER * self.radius(v) + COVER_VOXELS;
            solid.for_each_near(v, radius, |near| is_covered[near as usize] = true);
        };
        cover(&mut is_covered, self.root);
        is_on_tree[self.root as usize] = true;
        let from_root = solid.search([(self.root, 0.0)], false, |_| false).distance;
        let mut paths: Vec<Path> = Vec::new();
        while paths.len() < MAX_PATHS {
            go_on()?;
            let is_left = |v: &u32| {
                let is_half = !plane.is_symmetric || self.side(*v) >= -0.6 * self.cell;
                !is_covered[*v as usize] && is_half && from_root[*v as usize].is_finite()
            };
            let further =
                |best: u32, v: u32| if from_root[v as usize] > from_root[best as usize] { v } else { best };
            let Some(tip) = (0..n as u32).filter(is_left).reduce(further) else { break };
            let tip = self.tip_on_plane(tip, &from_root, is_left);
            let voxels = solid.search([(tip, 0.0)], true, |v| is_on_tree[v as usize]).path();
            // The path covers its tip at least, so that the loop ends.
            voxels.iter().for_each(|&v| cover(&mut is_covered, v));
            let start = voxels[0];
            let outside = voxels.iter().filter(|&&v| solid.distance(v, start) > self.radius(start)).count();
            if !paths.is_empty() && (outside as f64) * self.cell < MIN_LIMB * plane.diagonal {
                continue;
            }
            voxels.iter().for_each(|&v| is_on_tree[v as usize] = true);
            let is_mid = plane.is_symmetric && self.side(tip).abs() < TIP_ON_PLANE * plane.diagonal;
            if plane.is_symmetric && !is_mid {
                for image in voxels.iter().filter_map(|&v| solid.image(v, plane.axis)) {
                    is_on_tree[image as usize] = true;
                    cover(&mut is_covered, image);
                }
            }
            paths.push(Path { voxels, is_mid });
        }
        Ok(paths)
    }

    /// Replaces a tip beside the mirror plane by the furthest voxel on the plane, if both are almost as far from the root:
    /// the rim of a hat.
    fn tip_on_plane(&self, tip: u32, from_root: &[f64], is_left: impl Fn(&u32) -> bool) -> u32 {
        if !self.plane.is_symmetric {
            return tip;
        }
        let reach = TIP_REACH * self.plane.diagonal / self.cell;
        let mut best: Option<u32> = None;
        self.solid.for_each_near(tip, reach, |v| {
            let is_mid = self.side(v).abs() < 0.6 * self.cell && is_left(&v);
            let is_further = best.is_none_or(|best| from_root[v as usize] > from_root[best as usize]);
            if is_mid && is_further {
                best = Some(v);
            }
        });
        let is_as_far = |v: &u32| from_root[*v as usize] > from_root[tip as usize] - 0.5 * reach;
        best.filter(is_as_far).unwrap_or(tip)
    }

    /// Length of a path, object units.
    fn length(&self, path: &[u32]) -> f64 {
        self.cell * path.windows(2).map(|pair| self.solid.distance(pair[0], pair[1])).sum::<f64>()
    }

    /// Smoothed centres of a path. `on_plane`: whether they are moved into the mirror plane.
    fn smoothed(&self, path: &[u32], on_plane: bool) -> Vec<DVec3> {
        let mut line: Vec<DVec3> = path.iter().map(|&v| self.centre(v)).collect();
        for _ in 0..SMOOTHING {
            let old = line.clone();
            for (p, around) in line.iter_mut().skip(1).zip(old.windows(3)) {
                *p = 0.5 * around[1] + 0.25 * (around[0] + around[2]);
            }
        }
        if on_plane && self.plane.is_symmetric {
            line.iter_mut().for_each(|p| p[self.plane.axis] = self.plane.offset);
        }
        line
    }

    /// Makes the chains of the paths. Returns them with the voxels of their paths, and whether the model is a biped.
    fn chains(&self, paths: Vec<Path>) -> (Vec<Chain>, Vec<Vec<u32>>, bool) {
        // Without a mirror plane, the trunk consists of the two paths with the largest length times radius.
        let bulk = |path: &Path| {
            let sum: f64 = path.voxels.iter().map(|&v| self.radius(v)).sum();
            self.length(&path.voxels) * sum / path.voxels.len().max(1) as f64
        };
        let (mut mids, mut limbs): (Vec<Path>, Vec<Path>) = if self.plane.is_symmetric {
            paths.into_iter().partition(|path| path.is_mid)
        } else {
            let mut sorted = paths;
            sorted.sort_by(|a, b| bulk(b).total_cmp(&bulk(a)));
            let limbs = sorted.split_off(sorted.len().min(2));
            (sorted, limbs)
        };
        mids.sort_by(|a, b| self.length(&b.voxels).total_cmp(&self.length(&a.voxels)));
        let mut ends = Vec::new();
        for _ in 0..2 {
            if let Some(k) = mids.iter().position(|path| path.voxels.first() == Some(&self.root)) {
                ends.push(mids.remove(k).voxels);
            }
        }
        if ends.is_empty() && !mids.is_empty() {
            ends.push(mids.remove(0).voxels);
        }
        let mut ends = ends.into_iter();
        let (head, tail) = (ends.next().unwrap_or_else(|| vec![self.root]), ends.next());
        let has_tail = tail.is_some();
        let line: Vec<u32> = match tail {
            Some(tail) => tail.into_iter().rev().chain(head.into_iter().skip(1)).collect(),
            None => head,
        };
        let (at, is_biped) = self.trunk(&line, has_tail, &limbs);
        let mut chains = vec![Chain {
            name: "trunk".to_owned(),
            bones: vec![0; at.len() - 1],
            own_bones: vec![0],
            at,
            parent: None,
            is_midline: true,
            mirror: None,
            is_symmetric: false,
        }];
        let mut seeds = vec![line];
        limbs.append(&mut mids);
        for (k, Path { voxels, is_mid }) in limbs.into_iter().enumerate() {
            let at = self.limb(&voxels, is_mid, &chains[0]);
            let start = voxels[0];
            let is_inside = |&v: &u32| self.solid.distance(v, start) <= self.radius(start);
            let (inside, own): (Vec<u32>, Vec<u32>) = voxels.into_iter().partition(is_inside);
            seeds[0].extend(inside);
            let image = |v: &u32| self.solid.image(*v, self.plane.axis);
            let images: Vec<u32> = own.iter().filter_map(image).collect();
            let mirrored = at.iter().map(|&p| self.plane.image(p)).collect();
            let is_pair = self.plane.is_symmetric && !is_mid;
            let number = chains.len();
            let mut add = |name: String, at: Vec<DVec3>, mirror: Option<usize>, own: Vec<u32>| {
                let bone = chains.len() as u32;
                chains.push(Chain {
                    name,
                    bones: vec![bone; at.len() - 1],
                    own_bones: vec![bone],
                    at,
                    parent: Some(0),
                    is_midline: is_mid,
                    mirror,
                    is_symmetric: false,
                });
                seeds.push(own);
            };
            if is_pair {
                add(format!("limb {k} +"), at, Some(number + 1), own);
                add(format!("limb {k} -"), mirrored, Some(number), images);
            } else {
                add(format!("limb {k}"), at, None, own);
            }
        }
        (chains, seeds, is_biped)
    }

    /// Joints of the trunk, and whether the model is a biped.
    fn trunk(&self, line: &[u32], has_tail: bool, limbs: &[Path]) -> (Vec<DVec3>, bool) {
        let diagonal = self.plane.diagonal;
        let mut trunk = self.smoothed(line, true);
        let mut is_biped = false;
        // Without a tail, the trunk goes back to the limbs that leave last.
        if !has_tail && !limbs.is_empty() {
            let way =
                |trunk: &[DVec3], n: usize| (trunk[n.min(trunk.len() - 1)] - trunk[0]).normalize_or_zero();
            let back = way(&trunk, 6);
            let behind = limbs.iter().map(|limb| (self.centre(limb.voxels[0]) - trunk[0]).dot(back));
            let behind = behind.fold(0.0, f64::min);
            if behind < -self.cell {
                trunk.insert(0, trunk[0] + back * behind);
            }
            let spine = way(&trunk, 12);
            is_biped = limbs.iter().any(|limb| {
                let tip = self.centre(limb.voxels[limb.voxels.len() - 1]) - trunk[0];
                tip.dot(spine) < BIPED_COSINE * tip.length()
            });
        }
        let mut at: Vec<DVec3> = simplify(&trunk, BEND * diagonal).into_iter().map(|k| trunk[k]).collect();
        if at.len() < 3 {
            let (first, mut last) = (at[0], at[at.len() - 1]);
            if first == last {
                let axis = if self.plane.axis == 1 { DVec3::Z } else { DVec3::Y };
                last += self.cell * self.radius(self.root).max(1.0) * axis;
            }
            at = vec![first, first.midpoint(last), last];
        }
        if !is_biped || at[1].distance(at[0]) > 0.04 * diagonal {
            at.insert(0, at[0] - 0.01 * diagonal * (at[1] - at[0]).normalize_or_zero());
        }
        (at, is_biped)
    }

    /// Joints of a limb, from the trunk's axis to its tip.
    fn limb(&self, path: &[u32], is_mid: bool, trunk: &Chain) -> Vec<DVec3> {
        let diagonal = self.plane.diagonal;
        let line = self.smoothed(path, is_mid);
        let mut at: Vec<DVec3> = simplify(&line, BEND * diagonal).into_iter().map(|k| line[k]).collect();
        let base = closest_on_line(&trunk.at, at[0]);
        if base.distance(at[0]) > 0.01 * diagonal || at.len() < 2 {
            at.insert(0, base);
        }
        if let ([.., before, last], false) = (&mut at[..], is_mid) {
            let reach = self.cell * self.radius(path[path.len() - 1]);
            *last += reach * (*last - *before).normalize_or_zero();
        }
        at
    }

    /// Returns the chain of each voxel: the one whose path is nearest through the solid, minus a share of its radius.
    fn owners(&self, seeds: &[Vec<u32>]) -> Vec<u32> {
        let n = self.solid.voxels.len();
        let mut owner = vec![u32::MAX; n];
        let mut starts = Vec::new();
        let mut nearest = vec![f64::INFINITY; n];
        for (chain, seeds) in (0..).zip(seeds) {
            let mut radii: Vec<f64> = seeds.iter().map(|&v| self.radius(v)).collect();
            radii.sort_unstable_by(f64::total_cmp);
            let Some(&median) = radii.get(radii.len() / 2) else { continue };
            for &v in seeds {
                let bonus = -RADIUS_SHARE * median;
                starts.push((v, bonus));
                if bonus < nearest[v as usize] {
                    (nearest[v as usize], owner[v as usize]) = (bonus, chain);
                }
            }
        }
        self.solid.search(starts, false, |_| false).spread(&mut owner);
        owner
    }
}

/// The point of a polyline that is closest to `p`.
fn closest_on_line(line: &[DVec3], p: DVec3) -> DVec3 {
    let on = line.windows(2).map(|ends| {
        let way = ends[1] - ends[0];
        let share = (p - ends[0]).dot(way) / way.length_squared().max(f64::MIN_POSITIVE);
        ends[0] + share.clamp(0.0, 1.0) * way
    });
    on.min_by(|a, b| a.distance(p).total_cmp(&b.distance(p))).unwrap_or(p)
}

/// Indices of the corners of a polyline that stays within `tolerance` of the line.
///
/// Source: Douglas and Peucker 1973, "Algorithms for the reduction of the number of points required to represent a
/// digitized line or its caricature".
fn simplify(line: &[DVec3], tolerance: f64) -> Vec<usize> {
    let mut keep = vec![0];
    let mut waiting = vec![(0, line.len() - 1)];
    while let Some((first, last)) = waiting.pop() {
        let way = line[last] - line[first];
        let distance = |k: usize| {
            let p = line[k] - line[first];
            let share = p.dot(way) / way.length_squared().max(f64::MIN_POSITIVE);
            (p - share.clamp(0.0, 1.0) * way).length()
        };
        let furthest = (first + 1..last).rev().max_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        match furthest.filter(|&k| distance(k) >= tolerance) {
            Some(k) => waiting.extend([(k, last), (first, k)]),
            None if last > first => keep.push(last),
            None => {}
        }
    }
    keep
}
