//! Planes between parts of different limbs.

use glam::DVec3;

use super::fit::{Fit, Target};

/// Smallest number of points of a part.
const MIN_POINTS: usize = 3;

/// Parts whose boxes are farther apart than this need no plane.
const MAX_BOX_GAP: f64 = 0.05;

/// Gap between parts above which they need no plane.
const MAX_GAP: f64 = 0.048;

/// Largest and smallest distance of a sleeve from a plane, and its largest share of the gap.
const MARGIN: f64 = 0.004;
const MIN_MARGIN: f64 = 1e-4;
const MARGIN_SHARE: f64 = 0.25;

/// Share of its distance from a plane that a point may keep as clearance.
const CLEARANCE_SHARE: f64 = 0.6;

/// Half the thickness of the slab in which parts without a common plane are separated ring by ring.
const SLAB: f64 = 0.045;

/// Shares of the points of overlapping parts that a plane leaves on the wrong side, and the largest share of points that
/// may change limbs.
const DIVIDED_SHARES: [f64; 3] = [0.05, 0.15, 0.4];
const MAX_DIVIDED: f64 = 0.25;

/// Steps of the search for a plane.
const GILBERT_STEPS: usize = 300;

/// A plane between two sets of points: `normal . a >= offset + gap / 2` on one side.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    offset: f64,
    gap: f64,
}

/// Points of a limb between two stops.
struct Part {
    limb: usize,
    segment: usize,
    points: Vec<usize>,
    bounds: [DVec3; 2],
}

impl Fit<'_> {
    /// Finds planes between parts of different limbs, constrains vertices to their sides, and reduces the clearance of
    /// points in narrow gaps.
    pub(super) fn separate(&mut self) {
        let plan = self.plan;
        for target in &mut self.targets {
            // Sleeves of a pair may share an edge on the mirror plane.
            if plan.limbs[target.limb].is_symmetric && plan.limbs[target.limb].mirror.is_some() {
                target.clearance = target.clearance.min(CLEARANCE_SHARE * target.at.x.abs());
            }
        }
        let mut parts = self.parts();
        for x in 0..parts.len() {
            for y in x + 1..parts.len() {
                let (a, b) = (&parts[x], &parts[y]);
                let [first, second] = [&plan.limbs[a.limb], &plan.limbs[b.limb]];
                // The first segment of a sleeve touches its parent.
                let is_beside = second.parent == Some(a.limb) && b.segment == 0
                    || first.parent == Some(b.limb) && a.segment == 0;
                let gap = (a.bounds[0] - b.bounds[1]).max(b.bounds[0] - a.bounds[1]).max_element();
                if a.limb == b.limb || is_beside || gap > MAX_BOX_GAP {
                    continue;
                }
                let share_edge = first.parent == second.parent && a.segment == 0 && b.segment == 0;
                let plane = if first.mirror == Some(b.limb) && first.is_symmetric {
                    Some(self.mirror_plane(a, b))
                } else {
                    separating_plane(&self.at(&a.points), &self.at(&b.points), 0.0)
                };
                if let Some(plane) = plane.filter(|plane| plane.gap >= MIN_MARGIN || share_edge) {
                    self.keep_apart(plane, a, b);
                } else if !share_edge {
                    let is_done = plane.is_none()
                        && [self.separate_locally(a, b), self.separate_locally(b, a)] == [true; 2];
                    if is_done {
                        continue;
                    }
                    let limbs = [a.limb, b.limb];
                    let dividing =
                        plane.or_else(|| self.dividing_plane(a, b).filter(|_| plan.remedies.may_divide));
                    match dividing.filter(|_| plan.remedies.may_divide) {
                        Some(plane) => self.divide(plane, &mut parts, [x, y]),
                        None => {
                            if let Some(plane) = plane {
                                self.keep_apart(plane, &parts[x], &parts[y]);
                            }
                            self.unseparated.push(limbs);
                        }
                    }
                }
            }
        }
    }

    /// Finds a plane that has all but a few points of two parts on their sides.
    fn dividing_plane(&self, a: &Part, b: &Part) -> Option<Plane> {
        let (a, b) = (self.at(&a.points), self.at(&b.points));
        DIVIDED_SHARES.into_iter().find_map(|share| separating_plane(&a, &b, share))
    }

    /// Keeps two parts on the sides of a plane. Points on the wrong side become points of the other limb, unless there
    /// are too many.
    fn divide(&mut self, plane: Plane, parts: &mut [Part], pair: [usize; 2]) {
        let is_wrong = |fit: &Self, k: usize, side: f64| {
            side * (plane.normal.dot(fit.targets[k].at) - plane.offset) < 0.0
        };
        let wrong: [Vec<usize>; 2] = [(pair[0], 1.0), (pair[1], -1.0)].map(|(part, side)| {
            parts[part].points.iter().copied().filter(|&k| is_wrong(self, k, side)).collect()
        });
        let limbs = pair.map(|part| parts[part].limb);
        let most = |part: usize| (MAX_DIVIDED * parts[part].points.len() as f64) as usize;
        if wrong[0].len() > most(pair[0]) || wrong[1].len() > most(pair[1]) {
            self.unseparated.push(limbs);
            return;
        }
        for side in [0, 1] {
            let (from, into) = (pair[side], pair[1 - side]);
            parts[from].points.retain(|k| !wrong[side].contains(k));
            for &k in &wrong[side] {
                let Target { at, clearance, .. } = self.targets[k];
                self.targets[k] = self.target(at, limbs[1 - side], clearance);
                parts[into].points.push(k);
            }
        }
        self.keep_apart(Plane { gap: 0.0, ..plane }, &parts[pair[0]], &parts[pair[1]]);
    }

    fn at(&self, points: &[usize]) -> Vec<DVec3> {
        points.iter().map(|&k| self.targets[k].at).collect()
    }

    fn parts(&self) -> Vec<Part> {
        let mut parts = Vec::new();
        for (i, limb) in self.plan.limbs.iter().enumerate() {
            let stops = limb.stops();
            let n = stops.len();
            let mut points = vec![Vec::new(); n - 1];
            for (k, target) in self.targets.iter().enumerate().filter(|(_, target)| target.limb == i) {
                let s = limb.project(target.at).s;
                points[stops[1..n - 1].partition_point(|&stop| stop <= s)].push(k);
            }
            for (segment, points) in
                points.into_iter().enumerate().filter(|(_, points)| points.len() >= MIN_POINTS)
            {
                let at = self.at(&points);
                let low = at.iter().copied().fold(DVec3::INFINITY, DVec3::min);
                let high = at.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
                parts.push(Part { limb: i, segment, points, bounds: [low, high] });
            }
        }
        parts
    }

    /// The mirror plane, as a plane between parts of a limb and of its mirror image.
    fn mirror_plane(&self, a: &Part, b: &Part) -> Plane {
        let limb = &self.plan.limbs[a.limb];
        let side = limb.at.iter().map(|p| p.x).sum::<f64>().signum();
        let least = |points: &[usize], side: f64| {
            self.at(points).iter().map(|p| side * p.x).fold(f64::INFINITY, f64::min)
        };
        let gap = 2.0 * least(&a.points, side).min(least(&b.points, -side));
        Plane { normal: side * DVec3::X, offset: 0.0, gap: gap.max(0.0) }
    }

    /// Rings of a part's sleeve at its two stops, without the base of the sleeve.
    fn rings_of(&self, part: &Part) -> Vec<usize> {
        let rings = &self.base.of_limb[part.limb];
        let first = if part.limb == 0 { part.segment as isize } else { part.segment as isize - 1 };
        [first, first + 1].iter().filter_map(|&k| rings.get(usize::try_from(k).ok()?).copied()).collect()
    }

    fn keep_apart(&mut self, plane: Plane, a: &Part, b: &Part) {
        let back = Plane { normal: -plane.normal, offset: -plane.offset, gap: plane.gap };
        for (plane, part) in [(plane, a), (back, b)] {
            self.keep_beside(plane, &self.rings_of(part), &part.points);
        }
    }

    /// Keeps the vertices of rings on one side of a plane, and reduces the clearance of points near it.
    fn keep_beside(&mut self, plane: Plane, rings: &[usize], points: &[usize]) {
        if plane.gap > MAX_GAP {
            return;
        }
        let margin = MARGIN.min((MARGIN_SHARE * plane.gap).max(MIN_MARGIN));
        for &ring in rings {
            let vertices = &self.base.rings[ring].vertices;
            self.halfspaces.extend(vertices.iter().map(|&v| (v, plane.normal, plane.offset + margin)));
        }
        for &k in points {
            let away = plane.normal.dot(self.targets[k].at) - plane.offset;
            let most = (CLEARANCE_SHARE * (away - margin)).max(0.0);
            self.targets[k].clearance = self.targets[k].clearance.min(most);
        }
    }

    /// Separates two parts near each ring of the first. Returns whether this is possible.
    fn separate_locally(&mut self, part: &Part, other: &Part) -> bool {
        let mut is_done = true;
        for r in self.rings_of(part) {
            let ring = &self.base.rings[r];
            let (center, along) = (ring.center, ring.along);
            let slab = |part: &Part| -> Vec<usize> {
                let is_near = |&&k: &&usize| (self.targets[k].at - center).dot(along).abs() < SLAB;
                part.points.iter().filter(is_near).copied().collect()
            };
            let (own, others) = (slab(part), slab(other));
            if others.len() < MIN_POINTS {
                continue;
            }
            let plane = separating_plane(&self.at(&own), &self.at(&others), 0.0);
            match plane.filter(|_| own.len() >= MIN_POINTS) {
                Some(plane) => self.keep_beside(plane, &[r], &own),
                None => is_done = false,
            }
        }
        is_done
    }
}

/// Finds the widest plane between two sets of points; `None` if their reduced convex hulls meet. `share`: share of the
/// points of each set that may lie beyond the plane; 0 reduces nothing.
///
/// Gilbert 1966, "An iterative procedure for computing the minimum of a quadratic form on a convex set", applied to the
/// differences of the points. Reduced convex hulls: Bennett and Bredensteiner 2000, "Duality and geometry in SVM
/// classifiers". Their support is the mean of the points that are furthest in a direction.
fn separating_plane(a: &[DVec3], b: &[DVec3], share: f64) -> Option<Plane> {
    let mean = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
    let least = |points: &[DVec3], way: DVec3| {
        let n = (share * points.len() as f64) as usize;
        let by_height = |p: &DVec3, q: &DVec3| p.dot(way).total_cmp(&q.dot(way));
        if n < 2 {
            return points.iter().copied().min_by(by_height);
        }
        let mut points = points.to_vec();
        points.select_nth_unstable_by(n - 1, by_height);
        Some(mean(&points[..n]))
    };
    let support = |way: DVec3| Some(least(a, way)? - least(b, -way)?);
    let mut z = support(mean(a) - mean(b))?;
    for _ in 0..GILBERT_STEPS {
        let squared = z.length_squared();
        if squared < 1e-18 {
            return None;
        }
        let s = support(z)?;
        if squared - z.dot(s) < 1e-6 * squared {
            break;
        }
        let way = s - z;
        z += way * (-z.dot(way) / way.length_squared()).clamp(0.0, 1.0);
    }
    let normal = z.try_normalize()?;
    let high = least(a, normal)?.dot(normal);
    let low = least(b, -normal)?.dot(normal);
    (high > low).then_some(Plane { normal, offset: 0.5 * (high + low), gap: high - low })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gap between two unit cubes whose nearest corners are (1, 1, 1) and (2, 2, 2) is the distance of the corners.
    #[test]
    fn the_widest_plane_between_cubes_is_found() {
        let cube = |low: f64| -> Vec<DVec3> {
            (0..8)
                .map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) + low)
                .collect()
        };
        let plane = separating_plane(&cube(2.0), &cube(0.0), 0.0).unwrap();
        assert!((plane.gap - 3.0_f64.sqrt()).abs() < 1e-3, "{plane:?}");
        assert!((plane.offset - 1.5 * 3.0_f64.sqrt()).abs() < 1e-3, "{plane:?}");
        assert!(separating_plane(&cube(0.0), &cube(0.5), 0.0).is_none());
    }

    /// Of two cubes of points, each has one point in the other: no plane has all of each on its side.
    #[test]
    fn a_few_points_may_lie_beyond_a_dividing_plane() {
        let side = |k: i32| f64::from(k) / 3.0;
        let cube = |low: f64| -> Vec<DVec3> {
            let points = (0..64).map(|k| DVec3::new(side(k & 3), side(k >> 2 & 3), side(k >> 4)) + low);
            points.chain([DVec3::splat(2.0 - low + 0.5)]).collect()
        };
        let (a, b) = (cube(2.0), cube(0.0));
        assert!(separating_plane(&a, &b, 0.0).is_none());
        let plane = separating_plane(&a, &b, 0.1).unwrap();
        let is_wrong = |p: &&DVec3, side: f64| side * (plane.normal.dot(**p) - plane.offset) < 0.0;
        let n_wrong =
            [(&a, 1.0), (&b, -1.0)].map(|(of, side)| of.iter().filter(|p| is_wrong(p, side)).count());
        assert_eq!(n_wrong, [1, 1], "{plane:?}");
    }
}
