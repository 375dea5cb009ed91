//! Reads models from the contents of files.

use glam::DVec3;

use super::{Document, Model, ModelFormat, ReadError};
use crate::counts::Counts;
use crate::origin::origin_near;
use crate::polygons::{Encoding, Polygons, PolygonsError};
use crate::siblings::Resolve;
use crate::up::UpAxis;
use crate::{gltf, obj};

/// A file to read.
pub(super) struct Source<'a, 'b> {
    pub(super) name: &'a str,
    pub(super) bytes: &'a [u8],
    pub(super) resolve: &'a mut Resolve<'b>,
    pub(super) memory_limit: u64,
    /// Whether to store positions relative to an origin near them.
    pub(super) near: bool,
}

impl Source<'_, '_> {
    pub(super) fn gltf(self) -> Result<Model, ReadError> {
        let origin = (!self.near).then_some(DVec3::ZERO);
        let model = gltf::read(self.name, self.bytes, self.resolve, self.memory_limit, origin)
            .map_err(|source| ReadError::Gltf { name: self.name.into(), source })?;
        Ok(Model {
            name: self.name.into(),
            positions: model.positions,
            triangles: model.triangles,
            counts: model.counts,
            notices: model.notices,
            up: UpAxis::Y,
            origin: model.origin,
            bytes: model.document.bytes,
            format: ModelFormat::Gltf,
            encoding: Encoding::default(),
            has_normals: false,
            document: Document::Gltf(Box::new(model.document)),
        })
    }

    pub(super) fn obj(self) -> Result<Model, ReadError> {
        let model = obj::read(self.bytes, self.resolve, self.memory_limit)
            .map_err(|source| ReadError::Obj { name: self.name.into(), source })?;
        let corner = |c: u32| model.document.corners[c as usize].v;
        let origin = if self.near { origin_near(&model.positions) } else { DVec3::ZERO };
        let positions = if origin == DVec3::ZERO {
            model.positions
        } else {
            obj::positions_near(&model.document.bytes, origin)
        };
        Ok(Model {
            name: self.name.into(),
            triangles: model.document.triangles.iter().map(|t| t.map(corner)).collect(),
            positions,
            counts: Counts {
                nodes: model.groups,
                meshes: 1,
                primitives: 1,
                materials: model.document.materials.len(),
                ..Counts::default()
            },
            notices: model.notices,
            up: UpAxis::Y,
            origin,
            bytes: model.bytes,
            format: ModelFormat::Obj,
            encoding: Encoding::default(),
            has_normals: false,
            document: Document::Obj(Box::new(model.document)),
        })
    }

    /// Reads a file of polygons (PLY, STL or OFF).
    pub(super) fn polygons(
        self,
        format: ModelFormat,
        read: fn(&[u8], u64, bool) -> Result<Polygons, PolygonsError>,
    ) -> Result<Model, ReadError> {
        let fault = |source| ReadError::Polygons { name: self.name.into(), source };
        let mut read = read(self.bytes, self.memory_limit, self.near).map_err(fault)?;
        let document = read.document().map_err(fault)?;
        let corner = |c: u32| document.corners[c as usize].v;
        let (vertices, corners) = (read.positions.len() as u64, document.corners.len() as u64);
        Ok(Model {
            name: self.name.into(),
            triangles: document.triangles.iter().map(|t| t.map(corner)).collect(),
            counts: Counts {
                nodes: document.groups.len().max(1),
                meshes: 1,
                primitives: 1,
                ..Counts::default()
            },
            notices: read.notices,
            up: UpAxis::Y,
            origin: read.origin,
            bytes: Polygons::check_memory(0, vertices, corners, u64::MAX).unwrap_or(u64::MAX),
            format,
            encoding: read.encoding,
            has_normals: read.has_normals,
            positions: read.positions,
            document: Document::Obj(Box::new(document)),
        })
    }
}
