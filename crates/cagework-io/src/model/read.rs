//! Reads models from the contents of files.

use std::borrow::Cow;
use std::sync::Arc;

use cagework_core::splats::Splats;
use glam::{DVec3, Vec3};

use super::{Document, Model, ModelFormat, ReadError};
use crate::counts::Counts;
use crate::gltf::GltfContent;
use crate::origin::origin_near;
use crate::polygons::{Encoding, Polygons, PolygonsError};
use crate::siblings::Resolve;
use crate::splats::{self, Capture, RawSplats, ReadSplats, Records, SplatError};
use crate::up::UpAxis;
use crate::{fbx, gltf, obj, ply};

/// A file to read.
pub(super) struct Source<'a, 'b> {
    pub(super) name: &'a str,
    pub(super) bytes: Cow<'a, [u8]>,
    pub(super) resolve: &'a mut Resolve<'b>,
    pub(super) memory_limit: u64,
    /// Whether to store positions relative to an origin near them.
    pub(super) near: bool,
    /// Whether a glTF without triangles is accepted if it has clips.
    pub(super) clips_alone: bool,
}

impl<'a, 'b> Source<'a, 'b> {
    /// An empty file for a mesh or capture that the program has made, with positions as given.
    pub(super) fn of_made(name: &'a str, resolve: &'a mut Resolve<'b>) -> Self {
        Self { name, bytes: Cow::default(), resolve, memory_limit: u64::MAX, near: false, clips_alone: false }
    }
}

impl Source<'_, '_> {
    /// Reads the file in its format.
    ///
    /// # Errors
    /// If the format is not known, or the file is damaged or above a limit.
    pub(super) fn read(self) -> Result<Model, ReadError> {
        let format = ModelFormat::of_file(self.name, &self.bytes)?;
        (format.facts().read)(self)
    }

    pub(super) fn gltf(self) -> Result<Model, ReadError> {
        let origin = (!self.near).then_some(DVec3::ZERO);
        let (limit, clips_alone) = (self.memory_limit, self.clips_alone);
        let content = gltf::read(self.name, &self.bytes, self.resolve, limit, origin, clips_alone)
            .map_err(|source| ReadError::Gltf { name: self.name.into(), source })?;
        let model = match content {
            GltfContent::Model(model) => model,
            GltfContent::Splats { splats, color_space, mut notices } => {
                if color_space == gltf::LINEAR_SPLATS {
                    notices.push("the colours of the splats are linear: drawn too dark".to_owned());
                }
                let records = Records::Gltf(color_space);
                let mut read = splats.finish(self.near, records).map_err(|e| self.splat_fault(e))?;
                read.notices.append(&mut notices);
                return Ok(self.capture(ModelFormat::Gltf, read));
            }
        };
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
            capture: None,
        })
    }

    /// Converts an FBX file to a GLB, and reads that.
    pub(super) fn fbx(mut self) -> Result<Model, ReadError> {
        let fault = |source| ReadError::Fbx { name: self.name.into(), source };
        let fbx::Converted { glb, notices } = fbx::convert(&self.bytes, self.memory_limit).map_err(fault)?;
        self.bytes = glb.into();
        let mut model = self.gltf()?;
        model.notices.splice(0..0, notices);
        Ok(model)
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
            document: Document::Polygons(Box::new(model.document)),
            capture: None,
        })
    }

    /// Reads a PLY: splats, polygons or points.
    pub(super) fn ply(self) -> Result<Model, ReadError> {
        if splats::ply::is_splats(&self.bytes) {
            return self.splats(ModelFormat::Ply, splats::ply::read);
        }
        self.polygons(ModelFormat::Ply, ply::read)
    }

    /// Reads a format of splats.
    pub(super) fn splats(
        self,
        format: ModelFormat,
        read: fn(&[u8], u64, bool) -> Result<ReadSplats, SplatError>,
    ) -> Result<Model, ReadError> {
        let read = read(&self.bytes, self.memory_limit, self.near).map_err(|e| self.splat_fault(e))?;
        Ok(self.capture(format, read))
    }

    /// Reads a SOG: an archive, or a `meta.json` with its images beside it.
    pub(super) fn sog(mut self) -> Result<Model, ReadError> {
        let bytes = std::mem::take(&mut self.bytes);
        let archive = splats::sog::archive_of(bytes, self.resolve, self.memory_limit);
        self.bytes = archive.map_err(|e| self.splat_fault(e))?;
        self.splats(ModelFormat::Sog, splats::sog::read)
    }

    fn splat_fault(&self, source: SplatError) -> ReadError {
        ReadError::Splats { name: self.name.into(), source }
    }

    fn capture(self, format: ModelFormat, read: ReadSplats) -> Model {
        let splats = read.splats;
        let file = self.bytes.into_owned();
        let each = Splats::bytes_per_splat(splats.degree) + size_of::<Vec3>() as u64;
        Model {
            name: self.name.into(),
            positions: splats.positions.clone(),
            triangles: Vec::new(),
            counts: Counts { nodes: 1, meshes: 1, primitives: 1, ..Counts::default() },
            notices: read.notices,
            up: UpAxis::Y,
            origin: read.origin,
            bytes: 2 * file.len() as u64 + each * splats.len() as u64,
            format,
            encoding: Encoding::default(),
            has_normals: false,
            document: Document::Polygons(Box::default()),
            capture: Some(Arc::new(Capture { splats, file, records: read.records })),
        }
    }

    /// Makes a capture that was not read from a file.
    pub(super) fn new_capture(self, splats: Splats, origin: DVec3) -> Result<Model, ReadError> {
        let positions = splats.positions.iter().map(|p| p.as_dvec3()).collect();
        let read =
            RawSplats { splats, positions }.finish(false, Records::New).map_err(|e| self.splat_fault(e))?;
        Ok(self.capture(ModelFormat::Ply, ReadSplats { origin, ..read }))
    }

    /// Reads a file of polygons (PLY, STL, OFF or 3MF).
    pub(super) fn polygons(
        self,
        format: ModelFormat,
        read: fn(&[u8], u64, bool) -> Result<Polygons, PolygonsError>,
    ) -> Result<Model, ReadError> {
        let fault = |source| ReadError::Polygons { name: self.name.into(), source };
        let mut read = read(&self.bytes, self.memory_limit, self.near).map_err(fault)?;
        // Only a 3MF is patched when it is exported.
        let file = Some(self.bytes).filter(|_| format == ModelFormat::ThreeMf);
        let mut document = read.document().map_err(fault)?;
        document.bytes = file.map_or_else(Vec::new, Cow::into_owned);
        let corner = |c: u32| document.corners[c as usize].v;
        let (vertices, corners) = (read.positions.len() as u64, document.corners.len() as u64);
        Ok(Model {
            name: self.name.into(),
            triangles: document.triangles.iter().map(|t| t.map(corner)).collect(),
            counts: Counts {
                nodes: document.groups.len().max(1),
                meshes: 1,
                primitives: 1,
                materials: document.materials.len(),
                ..Counts::default()
            },
            notices: read.notices,
            up: UpAxis::Y,
            origin: read.origin,
            bytes: Polygons::check_memory(read.bytes_of_file, vertices, corners, u64::MAX)
                .unwrap_or(u64::MAX),
            format,
            encoding: read.encoding,
            has_normals: read.has_normals,
            positions: read.positions,
            document: Document::Polygons(Box::new(document)),
            capture: None,
        })
    }
}
