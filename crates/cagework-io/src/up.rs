//! Which axis of a file points up.

use std::borrow::Cow;

use cagework_core::PolygonMesh;
use glam::{DVec3, Mat4, Vec3, Vec4};

/// The axis that points up in a file. Everything that is not in a file has Y up: a file with Z up is turned by 90
/// degrees about x when it is read, and back when it is written. Both are exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum UpAxis {
    /// Y, as glTF prescribes.
    #[default]
    Y,
    /// Z, as CAD programs and some OBJ files have it.
    Z,
}

impl UpAxis {
    /// The axis as files and the page call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// The axis of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        [Self::Y, Self::Z].into_iter().find(|up| up.name() == name)
    }

    /// Positions of a file with Y up.
    #[must_use]
    pub fn turned(self, positions: &[Vec3]) -> Cow<'_, [Vec3]> {
        match self {
            Self::Y => positions.into(),
            Self::Z => positions.iter().map(|p| Vec3::new(p.x, p.z, -p.y)).collect(),
        }
    }

    /// Positions with Y up as they are in a file.
    #[must_use]
    pub fn turned_back(self, positions: &[Vec3]) -> Cow<'_, [Vec3]> {
        match self {
            Self::Y => positions.into(),
            Self::Z => positions.iter().map(|p| Vec3::new(p.x, -p.z, p.y)).collect(),
        }
    }

    /// A vector of a file with Y up.
    #[must_use]
    pub fn vector_turned(self, v: DVec3) -> DVec3 {
        match self {
            Self::Y => v,
            Self::Z => DVec3::new(v.x, v.z, -v.y),
        }
    }

    /// A vector with Y up as it is in a file.
    pub(crate) fn vector_turned_back(self, v: DVec3) -> DVec3 {
        match self {
            Self::Y => v,
            Self::Z => DVec3::new(v.x, -v.z, v.y),
        }
    }

    /// From a file's axes to Y up.
    #[must_use]
    pub fn turn(self) -> Mat4 {
        match self {
            Self::Y => Mat4::IDENTITY,
            Self::Z => Mat4::from_cols(Vec4::X, Vec4::NEG_Z, Vec4::Y, Vec4::W),
        }
    }

    /// A mesh with Y up as it is in a file.
    #[must_use]
    pub fn mesh_turned_back(self, mesh: &PolygonMesh) -> PolygonMesh {
        PolygonMesh { positions: self.turned_back(&mesh.positions).into_owned(), faces: mesh.faces.clone() }
    }
}
