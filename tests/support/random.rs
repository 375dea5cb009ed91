//! Random numbers that do not depend on the machine or on library versions.

use glam::{Quat, Vec3};

/// A generator of 64 random bits at a time.
///
/// Source: Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators" (SplitMix64).
#[derive(Clone, Debug)]
pub struct RandomGenerator {
    state: u64,
}

impl RandomGenerator {
    /// Creates a generator with this seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Returns the next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number that is uniformly distributed in `[0, 1)`.
    pub fn unit(&mut self) -> f32 {
        // 24 bits, so that the value is exact in f32.
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Returns a number that is uniformly distributed in `[low, high)`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Returns a point that is uniformly distributed in the box from `min` to `max`.
    pub fn point(&mut self, min: Vec3, max: Vec3) -> Vec3 {
        let t = Vec3::new(self.unit(), self.unit(), self.unit());
        min + t * (max - min)
    }

    /// Returns a rotation by a random angle about a random axis.
    pub fn rotation(&mut self) -> Quat {
        let axis = loop {
            let p = self.point(Vec3::splat(-1.0), Vec3::ONE);
            if (0.01..=1.0).contains(&p.length_squared()) {
                break p.normalize();
            }
        };
        Quat::from_axis_angle(axis, self.between(0.0, std::f32::consts::TAU))
    }
}
