//! The up axis of a file, and conversion to Y up.

use std::borrow::Cow;

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

#[cfg(test)]
mod tests {
    use super::*;

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
