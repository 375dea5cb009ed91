//! Coloured signed distance functions: smooth unions of round solids.
//!
//! Source: Inigo Quilez, "distance functions" and "smooth minimum" (polynomial).

use glam::{Quat, Vec3};

#[derive(Clone, Copy, Debug)]
pub(super) enum Solid {
    /// All points within a radius of the segment from `a` to `b`. The radius varies linearly from `ra` to `rb`.
    Cone { a: Vec3, b: Vec3, ra: f32, rb: f32 },
    /// An ellipsoid. Its distance function is an approximation, exact on the surface.
    Ellipsoid { center: Vec3, radii: Vec3, turn: Quat },
    /// A box with rounded edges; `half` includes the rounding.
    Block { center: Vec3, half: Vec3, round: f32 },
}

/// A solid with its colour and the width over which it blends into the preceding solids.
#[derive(Clone, Copy, Debug)]
struct Layer {
    solid: Solid,
    blend: f32,
    colour: [u8; 3],
}

/// Solids, united in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Body {
    parts: Vec<Layer>,
}

impl Solid {
    fn distance(&self, p: Vec3) -> f32 {
        match *self {
            Self::Cone { a, b, ra, rb } => {
                let (axis, way) = (b - a, p - a);
                let share = (way.dot(axis) / axis.length_squared().max(1e-12)).clamp(0.0, 1.0);
                (way - axis * share).length() - (ra + (rb - ra) * share)
            }
            Self::Ellipsoid { center, radii, turn } => {
                let q = turn.inverse() * (p - center);
                let (k0, k1) = ((q / radii).length(), (q / (radii * radii)).length());
                if k1 > 0.0 { k0 * (k0 - 1.0) / k1 } else { -radii.min_element() }
            }
            Self::Block { center, half, round } => {
                let q = (p - center).abs() - (half - round);
                q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - round
            }
        }
    }

    /// Returns the Lipschitz constant of the distance function.
    fn steepness(&self) -> f32 {
        match *self {
            Self::Cone { a, b, ra, rb } => 1.0 + (rb - ra).abs() / a.distance(b).max(1e-6),
            // The distance function is only an approximation; a test checks this Lipschitz constant.
            Self::Ellipsoid { .. } => 2.0,
            Self::Block { .. } => 1.0,
        }
    }

    fn bounds(&self) -> [Vec3; 2] {
        match *self {
            Self::Cone { a, b, ra, rb } => [(a - ra).min(b - rb), (a + ra).max(b + rb)],
            Self::Ellipsoid { center, radii, .. } => {
                let reach = Vec3::splat(radii.max_element());
                [center - reach, center + reach]
            }
            Self::Block { center, half, .. } => [center - half, center + half],
        }
    }
}

impl Body {
    /// Adds a solid that blends into the previous solids over the distance `blend`.
    pub(super) fn add(&mut self, solid: Solid, blend: f32, colour: [u8; 3]) {
        self.parts.push(Layer { solid, blend, colour });
    }

    /// Adds a solid and its mirror image about x = 0.
    pub(super) fn add_both(&mut self, solid: Solid, blend: f32, colour: [u8; 3]) {
        let turned = |v: Vec3| Vec3::new(-v.x, v.y, v.z);
        let image = match solid {
            Solid::Cone { a, b, ra, rb } => Solid::Cone { a: turned(a), b: turned(b), ra, rb },
            Solid::Ellipsoid { center, radii, turn } => Solid::Ellipsoid {
                center: turned(center),
                radii,
                turn: Quat::from_xyzw(turn.x, -turn.y, -turn.z, turn.w),
            },
            Solid::Block { center, half, round } => Solid::Block { center: turned(center), half, round },
        };
        self.add(solid, blend, colour);
        self.add(image, blend, colour);
    }

    /// Adds cones along a polyline of points with radii.
    pub(super) fn add_chain(&mut self, chain: &[(Vec3, f32)], blend: f32, colour: [u8; 3]) {
        for pair in chain.windows(2) {
            let [(a, ra), (b, rb)] = [pair[0], pair[1]];
            self.add(Solid::Cone { a, b, ra, rb }, blend, colour);
        }
    }

    /// Adds a chain and its mirror image about x = 0.
    pub(super) fn add_chain_both(&mut self, chain: &[(Vec3, f32)], blend: f32, colour: [u8; 3]) {
        for pair in chain.windows(2) {
            let [(a, ra), (b, rb)] = [pair[0], pair[1]];
            self.add_both(Solid::Cone { a, b, ra, rb }, blend, colour);
        }
    }

    /// Computes the signed distance to the surface, negative inside; approximate away from the surface.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        self.parts.iter().fold(f32::MAX, |d, part| smooth_min(d, part.solid.distance(p), part.blend).0)
    }

    /// Selects the solids that affect distance and colour within `reach` of a point. There, their union gives the same
    /// results as the whole body.
    pub(super) fn near(&self, p: Vec3, reach: f32) -> Self {
        let mut parts = Vec::new();
        let (mut distance, mut steepest) = (f32::MAX, 0.0_f32);
        for part in &self.parts {
            let d = part.solid.distance(p);
            // Bound on how much the difference between the distances to this solid and to the previous ones changes
            // within `reach`.
            let slack = reach * (steepest + part.solid.steepness());
            steepest = steepest.max(part.solid.steepness());
            if d - distance >= part.blend + slack {
                continue;
            }
            if distance - d >= part.blend + slack {
                parts.clear();
            }
            parts.push(*part);
            distance = smooth_min(distance, d, part.blend).0;
        }
        Self { parts }
    }

    pub(super) fn colour(&self, p: Vec3) -> [u8; 4] {
        let mut colour = Vec3::ZERO;
        let mut distance = f32::MAX;
        for part in &self.parts {
            let (d, share) = smooth_min(distance, part.solid.distance(p), part.blend);
            colour = colour.lerp(Vec3::from_array(part.colour.map(f32::from)), share);
            distance = d;
        }
        let [r, g, b] = colour.to_array().map(|c| c.round() as u8);
        [r, g, b, 255]
    }

    pub(super) fn bounds(&self) -> [Vec3; 2] {
        let far = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        self.parts.iter().fold(far, |[min, max], part| {
            let [low, high] = part.solid.bounds();
            [min.min(low - part.blend), max.max(high + part.blend)]
        })
    }
}

/// Computes the polynomial smooth minimum of two distances, and the share of the second distance in it.
fn smooth_min(a: f32, b: f32, blend: f32) -> (f32, f32) {
    if blend <= 0.0 || a - b >= blend {
        return if b < a { (b, 1.0) } else { (a, 0.0) };
    }
    if b - a >= blend {
        return (a, 0.0);
    }
    let share = 0.5 + 0.5 * (a - b) / blend;
    (a + (b - a) * share - blend * share * (1.0 - share), share)
}
