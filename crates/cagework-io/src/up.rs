//! The up axis of a file, and conversion to Y up.

use std::borrow::Cow;

use cagework_core::splats::Splats;
use cagework_core::{Bounds, PolygonMesh, choice};
use glam::{DVec3, Mat4, Vec3, Vec4};

choice! {
    /// The up axis of a file. In memory Y is always up: files with another axis are rotated about x when
    /// they are read, and back when they are written. The rotations are exact.
    UpAxis {
        /// Y is up, as glTF prescribes.
        #[default]
        Y = "y",
        /// Z is up, as in CAD programs and in some OBJ files.
        Z = "z",
        /// -Y is up, as often in captures of Gaussian splats.
        YDown = "y_down",
    }
}

impl UpAxis {
    /// Converts positions from the file's axes to Y up.
    #[must_use]
    pub fn turned(self, positions: &[Vec3]) -> Cow<'_, [Vec3]> {
        match self {
            Self::Y => positions.into(),
            Self::Z => positions.iter().map(|p| Vec3::new(p.x, p.z, -p.y)).collect(),
            Self::YDown => positions.iter().map(|p| Vec3::new(p.x, -p.y, -p.z)).collect(),
        }
    }

    /// Converts positions from Y up to the file's axes.
    #[must_use]
    pub fn turned_back(self, positions: &[Vec3]) -> Cow<'_, [Vec3]> {
        match self {
            Self::Y => positions.into(),
            Self::Z => positions.iter().map(|p| Vec3::new(p.x, -p.z, p.y)).collect(),
            Self::YDown => self.turned(positions),
        }
    }

    /// Converts a vector from the file's axes to Y up.
    #[must_use]
    pub fn vector_turned(self, v: DVec3) -> DVec3 {
        match self {
            Self::Y => v,
            Self::Z => DVec3::new(v.x, v.z, -v.y),
            Self::YDown => DVec3::new(v.x, -v.y, -v.z),
        }
    }

    /// Converts a vector from Y up to the file's axes.
    #[must_use]
    pub fn vector_turned_back(self, v: DVec3) -> DVec3 {
        match self {
            Self::Y => v,
            Self::Z => DVec3::new(v.x, -v.z, v.y),
            Self::YDown => self.vector_turned(v),
        }
    }

    /// Rotation from the file's axes to Y up.
    #[must_use]
    pub fn turn(self) -> Mat4 {
        match self {
            Self::Y => Mat4::IDENTITY,
            Self::Z => Mat4::from_cols(Vec4::X, Vec4::NEG_Z, Vec4::Y, Vec4::W),
            Self::YDown => Mat4::from_cols(Vec4::X, Vec4::NEG_Y, Vec4::NEG_Z, Vec4::W),
        }
    }

    /// Converts a mesh from Y up to the file's axes.
    #[must_use]
    pub fn mesh_turned_back(self, mesh: &PolygonMesh) -> PolygonMesh {
        PolygonMesh { positions: self.turned_back(&mesh.positions).into_owned(), faces: mesh.faces.clone() }
    }
}

/// Ratio of the extents along z and y above which a model can lie on its back.
const MIN_LYING_RATIO: f32 = 1.2;
/// Distance from the lowest coordinate along an axis, as a fraction of the extent along z, within which a vertex counts
/// as lying on the flat side.
const MAX_FLAT_SIDE_DISTANCE: f32 = 0.01;
/// Minimum number of vertices on the flat side: as a fraction of all vertices, and as a multiple of the number of
/// vertices near the lowest y.
const MIN_FLAT_SIDE_SHARE: f32 = 0.005;
const MIN_FLAT_SIDE_RATIO: usize = 3;

/// Whether a model with y up seems to lie on its back: it is longer along z than along y, and stands on a flat side at
/// the lowest z rather than at the lowest y. This is a heuristic.
#[must_use]
pub fn lies_on_back(positions: &[Vec3]) -> bool {
    let Some(bounds) = Bounds::around(positions) else { return false };
    let extent = bounds.extent();
    let at = |axis: usize| {
        positions.iter().filter(|p| p[axis] - bounds.min[axis] <= MAX_FLAT_SIDE_DISTANCE * extent.z).count()
    };
    let [y, z] = [at(1), at(2)];
    extent.z > MIN_LYING_RATIO * extent.y
        && z as f32 >= MIN_FLAT_SIDE_SHARE * positions.len() as f32
        && z >= MIN_FLAT_SIDE_RATIO * y
}

/// Number of slabs into which a capture is divided along an axis.
const SLABS: usize = 64;
/// Number of slabs at each end in which a floor can lie.
const FLOOR_SLABS: usize = 8;
/// Smallest cosine of the angle between an axis and the normal of a splat that counts as a part of a floor.
const MIN_FLOOR_COSINE: f32 = 0.9;
/// Minimum area of a floor: as a multiple of the mean of all slabs, and as a fraction of all splats.
const MIN_FLOOR_RATIO: f32 = 10.0;
const MIN_FLOOR_SHARE: f32 = 0.02;
/// Minimum area of a floor as a multiple of the next largest floor, such as a ceiling.
const MIN_FLOOR_LEAD: f32 = 1.5;
/// Fraction of the splats at each end of an axis that are ignored, because captures contain stray splats.
const STRAY_SHARE: f32 = 0.01;

/// Finds the up axis of a capture by its floor, a thin slab at one end of an axis with many flat splats that are
/// perpendicular to the axis. `None` if no slab stands out. This is a heuristic. `splats` in the axes of the file.
#[must_use]
pub fn up_of_floor(splats: &Splats) -> Option<UpAxis> {
    let area = |i: usize| {
        let [x, y, z] = splats.scales[i].to_array();
        splats.opacities[i] * (x * y).max(y * z).max(z * x)
    };
    let total: f32 = (0..splats.len()).map(area).sum();
    let mut floors: Vec<(f32, Option<UpAxis>)> = Vec::new();
    for (axis, [at_low, at_high]) in
        [(1, [Some(UpAxis::Y), Some(UpAxis::YDown)]), (2, [Some(UpAxis::Z), None])]
    {
        let mut sorted: Vec<f32> = splats.positions.iter().map(|p| p[axis]).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let stray = (STRAY_SHARE * sorted.len() as f32) as usize;
        let (low, high) = (*sorted.get(stray)?, *sorted.get(sorted.len() - 1 - stray)?);
        let mut slabs = [0.0; SLABS];
        for (i, (p, rotation)) in splats.positions.iter().zip(&splats.rotations).enumerate() {
            let normal = *rotation * Vec3::AXES[splats.scales[i].min_position()];
            if normal[axis].abs() >= MIN_FLOOR_COSINE {
                let slab = SLABS as f32 * (p[axis] - low) / (high - low).max(f32::MIN_POSITIVE);
                slabs[(slab.max(0.0) as usize).min(SLABS - 1)] += area(i);
            }
        }
        let mean = slabs.iter().sum::<f32>() / SLABS as f32;
        let largest = |slabs: &[f32]| slabs.iter().copied().fold(0.0, f32::max);
        for (floor, up) in
            [(largest(&slabs[..FLOOR_SLABS]), at_low), (largest(&slabs[SLABS - FLOOR_SLABS..]), at_high)]
        {
            if floor >= MIN_FLOOR_RATIO * mean && floor >= MIN_FLOOR_SHARE * total && floor > 0.0 {
                floors.push((floor, up));
            }
        }
    }
    floors.sort_by(|a, b| b.0.total_cmp(&a.0));
    match floors[..] {
        [(_, up)] => up,
        [(largest, up), (next, _), ..] if largest >= MIN_FLOOR_LEAD * next => up,
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    /// A ball of round splats above a floor of flat splats at y = 0.
    fn ball_on_floor() -> Splats {
        let spread = |i: u16, n: f32| (f32::from(i) * n).fract();
        let ball = (0..2000_u16).map(|i| {
            let (z, angle) =
                (2.0 * spread(i, 0.754_877_7) - 1.0, std::f32::consts::TAU * spread(i, 0.569_840_3));
            let across = (1.0 - z * z).sqrt();
            (
                0.4 * Vec3::new(across * angle.cos(), across * angle.sin(), z) + 0.5 * Vec3::Y,
                Vec3::splat(0.02),
            )
        });
        let floor = (0..500_u16).map(|i| {
            let (x, z) = (spread(i, 0.754_877_7) - 0.5, spread(i, 0.569_840_3) - 0.5);
            (Vec3::new(x, 0.001 * f32::from(i % 5), z), Vec3::new(0.03, 0.001, 0.03))
        });
        let (positions, scales): (Vec<Vec3>, Vec<Vec3>) = ball.chain(floor).unzip();
        let n = positions.len();
        let (rotations, opacities) = (vec![Quat::IDENTITY; n], vec![0.9; n]);
        Splats { positions, scales, rotations, opacities, colors: vec![Vec3::ONE; n], ..Splats::default() }
    }

    #[test]
    fn floor_of_a_capture_tells_its_up_axis() {
        let standing = ball_on_floor();
        assert_eq!(up_of_floor(&standing), Some(UpAxis::Y));
        let turned = |up: UpAxis| standing.rotated(Quat::from_mat4(&up.turn()).inverse());
        for up in [UpAxis::Z, UpAxis::YDown] {
            assert_eq!(up_of_floor(&turned(up)), Some(up));
        }
        // A floor along x has no axis, and neither does a ball alone.
        assert_eq!(up_of_floor(&standing.rotated(Quat::from_rotation_z(1.0))), None);
        let mut ball = standing;
        ball.opacities[2000..].fill(0.0);
        assert_eq!(up_of_floor(&ball), None);
        assert_eq!(up_of_floor(&Splats::default()), None);
    }

    /// A cone of height 1 on the ground z = 0, with a base of radius 0.25.
    fn cone() -> Vec<Vec3> {
        let ring = |k: u16| {
            let (height, n) = (f32::from(k) / 20.0, 40_u16);
            (0..n).map(move |j| {
                let angle = std::f32::consts::TAU * f32::from(j) / f32::from(n);
                (0.25 * (1.0 - height) * Vec3::new(angle.cos(), angle.sin(), 0.0)).with_z(height)
            })
        };
        (0..=20).flat_map(ring).collect()
    }

    #[test]
    fn model_with_z_up_lies_on_its_back_until_it_is_turned() {
        assert!(lies_on_back(&cone()));
        assert!(!lies_on_back(&UpAxis::Z.turned(&cone())));
        assert!(!lies_on_back(&[]) && !lies_on_back(&[Vec3::ONE]));
    }

    /// An animal whose body is a cone along z stands on its feet, although it is longer than it is tall.
    #[test]
    fn animal_on_feet_stands() {
        let mut animal = cone();
        let feet = (0..40_u16).map(|k| {
            let along = if k < 20 { 0.2 } else { 0.6 };
            Vec3::new(0.1 * f32::from(k % 20) / 20.0, -0.6, along)
        });
        animal.extend(feet);
        assert!(!lies_on_back(&animal));
    }
}
