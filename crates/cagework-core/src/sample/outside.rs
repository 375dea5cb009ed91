//! Weights of points outside the cage.
//!
//! Near the cage, the weights of a point x are extrapolated linearly through the closest point p of the cage:
//! `w(x) = (1 + t) w(p) - t w(q)`, with t = 1 and q the mirror image of x about p. The rows w(p) and w(q) reproduce
//! positions, and therefore so does w(x). If the cage is thin, q moves at most to the middle of the cage. Beside a
//! sharp edge, q may lie outside the cage. The row is then w(p), and an offset that moves with the whole cage
//! (`bind/offsets.rs`) accounts for the displacement from p to x. The weights and the offset fade out with distance
//! from the cage.

use glam::DVec3;

use super::{OutsidePoint, Stencil};
use crate::cage::CAGE_TOLERANCE;
use crate::closest::{ClosestPoint, FaceBoxes};
use crate::controls::Controls;
use crate::geometry::distance_along;
use crate::options::OutsidePolicy;

/// Distances, as fractions of the cage's diagonal, between which a point's share fades from 1 to 0.
const FADE_RANGE: [f64; 2] = [0.05, 0.15];

#[derive(Debug)]
pub(super) struct OutsideSampler<'a> {
    controls: Controls<'a>,
    closest: FaceBoxes<'a>,
    policy: OutsidePolicy,
}

impl<'a> OutsideSampler<'a> {
    pub(super) fn new(controls: Controls<'a>, policy: OutsidePolicy) -> Self {
        Self { controls, closest: FaceBoxes::new(controls.surface()), policy }
    }

    /// Computes the stencil of a point outside the surface. A point inside a ball or tube takes the values of the
    /// closest point on the axes of balls and tubes, even if the ball or tube reaches through the cage. `inside(q,
    /// stencil)` computes the stencil of a point q inside, or returns false. The result has `vertex` 0.
    pub(super) fn fill(
        &self,
        point: DVec3,
        stencil: &mut Stencil,
        inside: impl FnOnce(DVec3, &mut Stencil) -> bool,
    ) -> OutsidePoint {
        let surface = self.controls.surface();
        let ClosestPoint { facet, barycentric, distance } = self.closest.find(point);
        let of_cage = self.controls.cage_face(surface.face_of_facet()[facet as usize]).is_some();
        let is_held = !of_cage;
        let mut found =
            OutsidePoint { vertex: 0, triangle: facet, barycentric, distance, is_held, share: 1.0 };
        stencil.clear();
        self.controls.values_at(found.triangle, found.barycentric, &mut |column, value| {
            stencil.add_hat(column, value);
        });
        let diagonal = f64::from(surface.diagonal());
        if distance <= CAGE_TOLERANCE * diagonal {
            return found;
        }
        // Where tubes meet, the closest facet may lie inside another tube, and where a tube is near the cage, it may be
        // one of the cage: use the closest point on the axes of the tubes.
        let foot = self.controls.inner().and_then(|inner| inner.foot(point));
        let radius = self.controls.inner_radius().map_or(0.0, f64::from);
        if let Some((_, shares)) = foot.filter(|(away, _)| is_held || *away < radius) {
            stencil.clear();
            let first = self.controls.cage().n_vertices() as u32;
            shares.into_iter().for_each(|(control, share)| stencil.add_hat(first + control, share));
            found.is_held = true;
        }
        if found.is_held {
            return found;
        }
        found.share = self.share(distance / diagonal);
        if found.share == 0.0 {
            stencil.clear();
            return found;
        }
        let corners = surface.facet_corners(found.triangle);
        let at: DVec3 = corners.iter().zip(found.barycentric).map(|(&c, b)| b * c).sum();
        let inwards = (at - point) / distance;
        let walls = (0..surface.facets().len() as u32)
            .filter_map(|facet| distance_along(at, inwards, surface.facet_corners(facet)));
        let open = walls.filter(|&s| s > CAGE_TOLERANCE * diagonal).fold(f64::INFINITY, f64::min);
        let step = distance.min(0.5 * open);
        let (at, mut other) = (at + step * inwards, Stencil::default());
        if inside(at, &mut other) {
            // If q (the point `at`) is close to another wall, w(q) consists of that wall's values: reduce t. With
            // t = 0, the row is w(p), as beside a sharp edge.
            let depth = self.closest.find(at).distance;
            let t = distance.min(open) / step * (2.0 * depth / step).min(1.0);
            for (_, w) in stencil.nodes.iter_mut().chain(&mut stencil.hats) {
                *w *= 1.0 + t;
            }
            other.nodes.iter().for_each(|&(row, w)| stencil.add_node(row, -t * w));
            other.hats.iter().for_each(|&(column, w)| stencil.add_hat(column, -t * w));
        }
        for (_, w) in stencil.nodes.iter_mut().chain(&mut stencil.hats) {
            *w *= found.share;
        }
        found
    }

    /// Share of the cage's motion that a point at a `distance` from the cage (fraction of the cage's diagonal) follows.
    fn share(&self, distance: f64) -> f64 {
        if self.policy == OutsidePolicy::Stay {
            return 0.0;
        }
        let far = ((distance - FADE_RANGE[0]) / (FADE_RANGE[1] - FADE_RANGE[0])).clamp(0.0, 1.0);
        1.0 - far * far * (3.0 - 2.0 * far)
    }
}
