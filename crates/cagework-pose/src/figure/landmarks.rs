//! Landmarks of a figure: its limbs, and heights that joints are placed by.

use std::cmp::Ordering;

use cagework_core::Bounds;
use glam::{DVec3, Vec3};

use crate::humanoid::Bone;

/// A foot's tip is at most this share of the height above the lowest point.
const FOOT: f64 = 0.2;
/// Least length of an arm or a leg, from the middle of the trunk to its tip, in heights.
const LIMB: f64 = 0.15;
/// Least horizontal distance between shin and tip of a foot that shows where the figure faces, in heights.
const TOE: f64 = 0.02;
/// Share of the height below which a crotch is not looked for: long skirts.
const LOW: f64 = 0.15;
/// The legs part where they are this share of their distance at half their height apart, if the surface does not show it.
const PART: f64 = 0.75;
/// Number of slices in which the middle of the trunk is measured.
const SLICES: usize = 24;
/// Distance from the spine up to which points belong to the trunk, in heights.
const TRUNK: f64 = 0.1;

/// A limb of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Limb {
    /// Points from the trunk's axis to the tip. At least two.
    pub line: Vec<DVec3>,
    /// Index of its chain in the list that the landmarks were found in.
    pub chain: usize,
}

/// Limbs and axes of a figure that stands upright, y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Landmarks {
    /// Corners of the figure's box, object units.
    pub bounds: [DVec3; 2],
    /// From the middle of the trunk to the top of the head.
    pub spine: Limb,
    /// Left and right arm.
    pub arms: [Limb; 2],
    /// Left and right leg.
    pub legs: [Limb; 2],
    /// Direction to the figure's left, horizontal.
    pub left: DVec3,
    /// Height at which the legs part, object units.
    crotch: f64,
    /// Offset of the trunk's middle from the spine at the centre of each slice of the height; horizontal, object units.
    middles: Vec<DVec3>,
}

impl Landmarks {
    /// Finds the limbs of a figure among the chains of its curve skeleton.
    ///
    /// `points`, `triangles`: surface of the figure, any soup with valid indices. `chains`: the trunk first, then polylines
    /// from the trunk's axis to a tip. Object units, y up. The two chains with the lowest tips are legs, the one with the highest tip ends at the head, and the
    /// two longest of the others are arms. Nothing but the legs reaches the ground. The feet show where the figure faces; if they do not, it faces +z.
    ///
    /// `None` unless all five are found.
    #[must_use]
    pub fn find(points: &[Vec3], triangles: &[[u32; 3]], chains: &[Vec<DVec3>]) -> Option<Self> {
        let bounds = Bounds::around(points).map(|bounds| [bounds.min.as_dvec3(), bounds.max.as_dvec3()])?;
        let height = bounds[1].y - bounds[0].y;
        let (trunk, others) = chains.split_first()?;
        let mut all: Vec<Limb> =
            (1..).zip(others).map(|(chain, line)| Limb { line: line.clone(), chain }).collect();
        all.retain(|limb| limb.line.len() > 1 && length(&limb.line) > LIMB * height);
        // Without a mirror plane the trunk may continue into a leg: it is cut where most limbs leave it.
        let bases = all.iter().map(|limb| limb.line[0]).sum::<DVec3>() / all.len().max(1) as f64;
        let cut = (0..trunk.len()).min_by(|&a, &b| by_distance(bases, trunk[a], trunk[b]))?;
        let ends = [trunk[cut..].to_vec(), trunk[..=cut].iter().rev().copied().collect()];
        all.extend(ends.into_iter().filter(|line| line.len() > 1).map(|line| Limb { line, chain: 0 }));

        let tip = |limb: &Limb| limb.line[limb.line.len() - 1];
        let stands = |limb: &Limb| tip(limb).y < bounds[0].y + FOOT * height;
        let standing: Vec<DVec3> = all.iter().filter(|limb| stands(limb)).map(tip).collect();
        let mut take = |better: &dyn Fn(&Limb, &Limb) -> Ordering| {
            let best = (0..all.len()).max_by(|&a, &b| better(&all[a], &all[b]))?;
            Some(all.remove(best))
        };
        let lower = |a: &Limb, b: &Limb| tip(b).y.total_cmp(&tip(a).y);
        let longer = |a: &Limb, b: &Limb| length(&a.line).total_cmp(&length(&b.line));
        let mut legs = [take(&lower)?, take(&lower)?];
        let spine = take(&|a, b| lower(b, a))?;
        let mut arms = [take(&longer)?, take(&longer)?];
        let is_short = |limb: &Limb| length(&limb.line) < LIMB * height;
        // A figure with a tip on the ground away from both feet stands on more than two legs.
        let is_foot = |at: &DVec3| legs.iter().any(|leg| tip(leg).distance(*at) < FOOT * height);
        if !standing.iter().all(is_foot)
            || !legs.iter().all(stands)
            || arms.iter().any(stands)
            || legs.iter().chain(&arms).any(is_short)
        {
            return None;
        }
        let flat = |v: DVec3| DVec3::new(v.x, 0.0, v.z);
        let of_arms = flat(tip(&arms[0]) - tip(&arms[1]));
        let of_legs = flat(tip(&legs[0]) - tip(&legs[1]));
        let across = if of_arms.dot(of_legs) < 0.0 { of_arms - of_legs } else { of_arms + of_legs };
        let toes = |leg: &Limb| flat(tip(leg) - at_height(&leg.line, bounds[0].y + 0.5 * FOOT * height));
        let forward = legs.iter().map(toes).sum::<DVec3>();
        let forward = if forward.length() > 2.0 * TOE * height { forward } else { DVec3::Z };
        let left = across.try_normalize()?;
        let left = if DVec3::Y.cross(forward).dot(left) < 0.0 { -left } else { left };
        for pair in [&mut arms, &mut legs] {
            if tip(&pair[0]).dot(left) < tip(&pair[1]).dot(left) {
                pair.swap(0, 1);
            }
        }
        let middles = vec![DVec3::ZERO; SLICES];
        let mut landmarks = Self { bounds, spine, arms, legs, left, crotch: 0.0, middles };
        landmarks.middles = landmarks.middles_of(points);
        landmarks.crotch = landmarks.lowest_crossing(points, triangles).unwrap_or(landmarks.crotch_of_legs());
        Some(landmarks)
    }

    /// Mean offset of the points near the spine from it, in each slice; as in the nearest slice where there are none.
    fn middles_of(&self, points: &[Vec3]) -> Vec<DVec3> {
        let mut sums = vec![(DVec3::ZERO, 0_u32); SLICES];
        for p in points.iter().map(|p| p.as_dvec3()) {
            let by = p - at_height(&self.spine.line, p.y).with_y(p.y);
            if by.dot(self.left).abs() < TRUNK * self.height() {
                let slice = &mut sums[(self.slice(p.y).max(0.0) as usize).min(SLICES - 1)];
                *slice = (slice.0 + by, slice.1 + 1);
            }
        }
        let known: Vec<usize> = (0..SLICES).filter(|&k| sums[k].1 > 0).collect();
        let nearest = |k: usize| known.iter().min_by_key(|&&other| other.abs_diff(k));
        let mean = |k: usize| nearest(k).map_or(DVec3::ZERO, |&k| sums[k].0 / f64::from(sums[k].1));
        (0..SLICES).map(mean).collect()
    }

    /// Number of the slice at a height; its fraction is the place in the slice.
    fn slice(&self, height: f64) -> f64 {
        SLICES as f64 * (height - self.bounds[0].y) / self.height()
    }

    /// Lowest point where the surface crosses the plane between left and right; `None` if that is too low for a crotch, as
    /// under a skirt.
    fn lowest_crossing(&self, points: &[Vec3], triangles: &[[u32; 3]]) -> Option<f64> {
        let crossing = |[a, b]: [u32; 2]| {
            let [a, b] = [a, b].map(|v| points[v as usize].as_dvec3());
            let [from, to] = [self.aside(a), self.aside(b)];
            (from * to <= 0.0 && from != to).then(|| a.lerp(b, from / (from - to)).y)
        };
        let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let lowest = edges.filter_map(crossing).fold(f64::INFINITY, f64::min);
        Some(lowest).filter(|low| *low > self.bounds[0].y + LOW * self.height() && low.is_finite())
    }

    /// Tip of the part that a bone ends: of a hand, a foot, toes or the head; `None` for other bones. Object units.
    #[must_use]
    pub fn end(&self, bone: Bone) -> Option<DVec3> {
        let limb = match bone {
            Bone::Head => &self.spine,
            Bone::LeftHand => &self.arms[0],
            Bone::RightHand => &self.arms[1],
            Bone::LeftFoot | Bone::LeftToes => &self.legs[0],
            Bone::RightFoot | Bone::RightToes => &self.legs[1],
            _ => return None,
        };
        limb.line.last().copied()
    }

    /// Direction in which the figure faces, horizontal.
    #[must_use]
    pub fn forward(&self) -> DVec3 {
        self.left.cross(DVec3::Y)
    }

    /// Height of the figure, object units.
    pub(super) fn height(&self) -> f64 {
        self.bounds[1].y - self.bounds[0].y
    }

    /// Point of the trunk's middle at a height.
    pub(super) fn middle(&self, height: f64) -> DVec3 {
        let slice = (self.slice(height) - 0.5).clamp(0.0, (SLICES - 1) as f64);
        let first = (slice as usize).min(SLICES - 2);
        let offset = self.middles[first].lerp(self.middles[first + 1], slice - first as f64);
        (at_height(&self.spine.line, height) + offset).with_y(height)
    }

    /// Distance of a point from the middle of the trunk, to the left.
    pub(super) fn aside(&self, p: DVec3) -> f64 {
        (p - self.middle(p.y)).dot(self.left)
    }

    /// Height at which the legs part, object units.
    pub(super) fn crotch(&self) -> f64 {
        self.crotch
    }

    /// Height at which the lines of the legs part.
    fn crotch_of_legs(&self) -> f64 {
        let of_leg = |leg: &Limb| {
            let aside = |p: DVec3| (p - self.middle(p.y)).dot(self.left).abs();
            let half = 0.5 * (self.bounds[0].y + leg.line[0].y);
            let least = PART * aside(at_height(&leg.line, half));
            first_point(&leg.line, &|p| aside(p) - least).y
        };
        0.5 * (of_leg(&self.legs[0]) + of_leg(&self.legs[1]))
    }

    /// Height of the arms where they are at a distance from the trunk's middle.
    pub(super) fn arm_height(&self, aside: f64) -> f64 {
        let of_arm = |arm: &Limb| first_point(&arm.line, &|p| self.aside(p).abs() - aside).y;
        0.5 * (of_arm(&self.arms[0]) + of_arm(&self.arms[1]))
    }
}

fn by_distance(to: DVec3, a: DVec3, b: DVec3) -> Ordering {
    a.distance_squared(to).total_cmp(&b.distance_squared(to))
}

/// Length of a polyline.
pub(super) fn length(line: &[DVec3]) -> f64 {
    line.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

/// First point of a polyline where a function that is linear on its segments is not negative; the last point if it is
/// negative everywhere.
pub(super) fn first_point(line: &[DVec3], value: &dyn Fn(DVec3) -> f64) -> DVec3 {
    let crossing = |pair: &[DVec3]| {
        let [a, b] = [value(pair[0]), value(pair[1])];
        if a >= 0.0 {
            return Some(pair[0]);
        }
        (b >= 0.0).then(|| pair[0].lerp(pair[1], a / (a - b)))
    };
    line.windows(2).find_map(crossing).or(line.last().copied()).unwrap_or_default()
}

/// First point of a polyline at a height; the end that is closer in height if there is none.
fn at_height(line: &[DVec3], height: f64) -> DVec3 {
    let crossing = |pair: &[DVec3]| {
        let [a, b] = [pair[0].y - height, pair[1].y - height];
        (a * b <= 0.0 && a != b).then(|| pair[0].lerp(pair[1], a / (a - b)))
    };
    let closest =
        || line.iter().copied().min_by(|a, b| (a.y - height).abs().total_cmp(&(b.y - height).abs()));
    line.windows(2).find_map(crossing).or_else(closest).unwrap_or_default()
}
