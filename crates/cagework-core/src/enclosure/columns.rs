//! Winding numbers of many points by counting crossings of a ray, almost along z, with the surface.
//!
//! The winding number is the number of crossings at which the ray leaves the closed surface minus those at which it
//! enters. Faces are sorted into columns, so that each ray is tested against few of them. If rounding could matter,
//! because the ray passes near an edge or the point lies near a face, the angles of all triangles are summed instead.

use std::borrow::Cow;

use glam::{DVec2, DVec3};

use crate::geometry::winding_number;

/// Tolerance of lengths, as a fraction of the surface's extent (of areas: of the square of the extent): 1e7 times f64
/// rounding.
const TOLERANCE: f64 = 1e-9;

/// Largest number of columns along x and along y. A table of this size fits in the processor's cache.
const MAX_COLUMNS: f64 = 64.0;

/// Slope of the rays in x and y. Rays along z would pass edges of the surface for all points in a mirror plane of a
/// symmetric model, or between vertices at the same x or y.
const SLOPE: DVec2 = DVec2::new(0.011_803_7, 0.027_917_3);

/// Coordinates in which the rays are vertical. The map keeps orientations, hence winding numbers.
fn sheared(p: DVec3) -> DVec3 {
    (p.truncate() - p.z * SLOPE).extend(p.z)
}

/// Faces of a closed surface, sorted into columns along the rays.
#[derive(Clone, Debug)]
pub struct Columns<'a> {
    triangles: Cow<'a, [[DVec3; 3]]>,
    /// Corner of the first column in x and y, object units, in the coordinates of the rays.
    low: DVec2,
    /// Number of columns per object unit along x and y.
    per_unit: DVec2,
    side: usize,
    extent: f64,
    /// Triangles over each column. `[side * side]`
    over: Vec<Vec<u32>>,
}

impl<'a> Columns<'a> {
    /// Sorts the triangles of a closed surface, counter-clockwise seen from outside.
    #[must_use]
    pub fn new(triangles: impl Into<Cow<'a, [[DVec3; 3]]>>) -> Self {
        let triangles = triangles.into();
        let corners = || triangles.iter().flatten().map(|&p| sheared(p).truncate());
        let low = corners().fold(DVec2::INFINITY, DVec2::min);
        let high = corners().fold(DVec2::NEG_INFINITY, DVec2::max);
        let all = || triangles.iter().flatten();
        let extent = (all().fold(DVec3::NEG_INFINITY, |a, p| a.max(*p))
            - all().fold(DVec3::INFINITY, |a, p| a.min(*p)))
        .length();
        let side = (2.0 * (triangles.len() as f64).sqrt()).clamp(1.0, MAX_COLUMNS).floor();
        let per_unit = DVec2::splat(side) / (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
        let side = side as usize;
        let over = vec![Vec::new(); side * side];
        let mut columns = Self { triangles, low, per_unit, side, extent, over };
        for number in 0..columns.triangles.len() as u32 {
            let triangle = columns.triangles[number as usize];
            let corners = triangle.map(|q| sheared(q).truncate());
            let near = DVec2::splat(TOLERANCE * extent);
            let [first, last] = [
                columns.column(corners[0].min(corners[1]).min(corners[2]) - near),
                columns.column(corners[0].max(corners[1]).max(corners[2]) + near),
            ];
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    columns.over[y * side + x].push(number);
                }
            }
        }
        columns
    }

    /// Returns the column of a point, clamped to the outermost ones.
    fn column(&self, p: DVec2) -> [usize; 2] {
        let last = (self.side - 1) as f64;
        ((p - self.low) * self.per_unit).clamp(DVec2::ZERO, DVec2::splat(last)).to_array().map(|x| x as usize)
    }

    /// Computes the winding number of a point, as [`crate::geometry::winding_number`] does.
    #[must_use]
    pub fn winding_number(&self, point: DVec3) -> f64 {
        let summed = || winding_number(point, self.triangles.iter().copied());
        self.counted(point).unwrap_or_else(summed)
    }

    /// Counts the crossings above a point; `None` if rounding could matter.
    pub(super) fn counted(&self, point: DVec3) -> Option<f64> {
        let p = sheared(point).truncate();
        let [x, y] = self.column(p);
        let mut leaves = 0;
        for &number in &self.over[y * self.side + x] {
            let corners = self.triangles[number as usize];
            let [a, b, c] = corners.map(|q| sheared(q).truncate() - p);
            // Twice the signed areas of the triangles that the point forms with the sides.
            let areas = [b.perp_dot(c), c.perp_dot(a), a.perp_dot(b)];
            let near = TOLERANCE * self.extent * self.extent;
            if areas.iter().any(|&area| area > near) && areas.iter().any(|&area| area < -near) {
                continue;
            }
            if areas.iter().any(|area| area.abs() <= near) {
                let distance = TOLERANCE * self.extent;
                let is_beside = a.min(b).min(c).cmpgt(DVec2::splat(distance)).any()
                    || a.max(b).max(c).cmplt(DVec2::splat(-distance)).any();
                if is_beside {
                    continue;
                }
                return None;
            }
            let total: f64 = areas.iter().sum();
            let height: f64 = areas.iter().zip(corners).map(|(area, q)| area * q.z).sum::<f64>() / total;
            if (height - point.z).abs() <= TOLERANCE * self.extent {
                return None;
            }
            if height > point.z {
                leaves += if total > 0.0 { 1 } else { -1 };
            }
        }
        Some(f64::from(leaves))
    }
}
