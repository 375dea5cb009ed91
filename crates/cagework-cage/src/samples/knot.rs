//! A trefoil knot of Gaussian splats, made by formula. The splats are long and lie along the strand, so that a
//! deformation visibly stretches them. Their colours depend on the direction of view and turn with the deformation.

use std::f64::consts::TAU;

use cagework_core::splats::Splats;
use glam::{Mat3, Quat, Vec3};

/// Number of splats: enough to overlap, few enough for the page to open them in less than a second.
const N_SPLATS: usize = 24_000;
/// Factor that makes the knot two units wide.
const SIZE: f32 = 1.0 / 3.0;
/// Radius of the strand, object units: thin enough that a cage with default options closes no gap between strands.
const RADIUS: f32 = 0.32 * SIZE;
/// Standard deviations of a splat along the strand, around it, and along the normal of the strand's surface, object
/// units.
const SCALES: Vec3 = Vec3::new(0.06 * SIZE, 0.035 * SIZE, 0.008 * SIZE);
/// Angle around the strand between successive splats: the golden angle, which spreads them evenly.
const TURN: f64 = 2.399_963_229_728_653;
/// The two colours of the stripes, sRGB.
const STRIPES: [Vec3; 2] = [Vec3::new(0.95, 0.85, 0.65), Vec3::new(0.85, 0.35, 0.25)];
/// Increase of red, green and blue if the splat is seen from the channel's brightest direction. From the opposite
/// direction, the channel decreases by as much.
const SHEEN: [f32; 3] = [0.3, 0.15, 0.4];
/// Largest value of the spherical harmonics of band 1: sqrt(3 / (4 pi)).
const BAND_1: f32 = 0.488_602_5;

/// Creates the splats of the knot. y is up. The knot lies in the plane of x and y and is two units wide.
#[must_use]
pub fn knot() -> Splats {
    let mut splats = Splats { degree: 1, ..Splats::default() };
    for k in 0..N_SPLATS {
        let t = TAU * (k as f64 + 0.5) / N_SPLATS as f64;
        let (center, along, out) = strand(t as f32);
        let angle = (TURN * k as f64 % TAU) as f32;
        let normal = angle.cos() * out + angle.sin() * along.cross(out);
        splats.positions.push(center + RADIUS * normal);
        splats.scales.push(SCALES);
        splats.rotations.push(Quat::from_mat3(&Mat3::from_cols(along, normal.cross(along), normal)));
        splats.opacities.push(0.95);
        let stripe = (2.0 * angle + 9.0 * t as f32).cos();
        splats.colors.push(STRIPES[0].lerp(STRIPES[1], (0.5 + 2.0 * stripe).clamp(0.0, 1.0)));
        // All channels are brightest from outside the strand: red from a direction tilted forward along it, blue
        // backward.
        let brightest = [(normal + along).normalize(), normal, (normal - along).normalize()];
        let by_channel: [Vec3; 3] = std::array::from_fn(|c| SHEEN[c] / BAND_1 * brightest[c]);
        // The basis is -y, z and -x of the direction from the eye, times BAND_1.
        let [x, y, z] = Mat3::from_cols_array_2d(&by_channel.map(Vec3::into)).transpose().to_cols_array_2d();
        splats.harmonics.extend([Vec3::from(y), -Vec3::from(z), Vec3::from(x)]);
    }
    splats
}

/// Returns the centre of the strand at a parameter from 0 to 2 pi, its direction, and the normal of the torus that it
/// winds around.
fn strand(t: f32) -> (Vec3, Vec3, Vec3) {
    let ((sin_2, cos_2), (sin_3, cos_3)) = ((2.0 * t).sin_cos(), (3.0 * t).sin_cos());
    let ring = 2.0 + cos_3;
    let along = Vec3::new(
        -3.0 * sin_3 * cos_2 - 2.0 * ring * sin_2,
        -3.0 * sin_3 * sin_2 + 2.0 * ring * cos_2,
        3.0 * cos_3,
    );
    let normal = Vec3::new(cos_3 * cos_2, cos_3 * sin_2, sin_3);
    (SIZE * Vec3::new(ring * cos_2, ring * sin_2, sin_3), along.normalize(), normal)
}
