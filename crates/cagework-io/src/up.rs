//! The up axis of a file, and conversion to Y up.

use std::borrow::Cow;

use cagework_core::{PolygonMesh, choice};
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
        /// -Y, as captures of Gaussian splats often have it.
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
