//! A model: vertices and triangles, and the document they came from.

mod cage;
mod write;

pub use cage::PoseState;

use std::borrow::Cow;

use cagework_core::{PolygonMesh, TriMesh};
use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::counts::Counts;
use crate::format::{FormatError, ModelFormat};
use crate::gltf::{self, GltfDocument, GltfError};
use crate::look::Look;
use crate::obj::{self, ObjDocument, ObjError};
use crate::origin::{far_notice, origin_near, relative};
use crate::polygons::{Encoding, Polygons, PolygonsError};
use crate::shown::shown;
use crate::siblings::Resolve;
use crate::up::UpAxis;
use crate::{off, ply, stl};

/// Why bytes could not be read as a model.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ReadError {
    /// The content is no format that is read here.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Vertices, but no faces, where faces are needed.
    #[error(
        "{} has {vertices} vertices but no faces: export it with faces (a file of positions only works as a pose)",
        shown(name)
    )]
    NoFaces {
        /// Name of the model.
        name: String,
        /// Vertices it has.
        vertices: usize,
    },
    /// A fault in an OBJ file.
    #[error("{}: {source}", shown(name))]
    Obj {
        /// Name the caller gave.
        name: String,
        /// The fault.
        source: ObjError,
    },
    /// A fault in a PLY, STL or OFF file.
    #[error("{}: {source}", shown(name))]
    Polygons {
        /// Name the caller gave.
        name: String,
        /// The fault.
        source: PolygonsError,
    },
    /// A fault in a glTF file.
    #[error("{}: {source}", shown(name))]
    Gltf {
        /// Name the caller gave.
        name: String,
        /// The fault.
        source: GltfError,
    },
}

/// A model that was read from bytes.
#[derive(Clone, Debug)]
pub struct Model {
    /// Name the caller gave.
    pub name: String,
    /// World-space position of every vertex, Y up, in the order of the input (see the crate's root), not welded; as seen from
    /// [`Self::origin`].
    pub positions: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from outside; polygons are triangulated.
    pub triangles: Vec<[u32; 3]>,
    /// How much of everything there is.
    pub counts: Counts,
    /// What the user should know: each a sentence.
    pub notices: Vec<String>,
    /// What points up in the document.
    pub(crate) up: UpAxis,
    /// Origin of the positions, in the file's axes.
    pub(crate) origin: DVec3,
    bytes: u64,
    format: ModelFormat,
    /// Of a PLY, STL or OFF: how its numbers are written; whether its vertices have normals.
    encoding: Encoding,
    has_normals: bool,
    pub(crate) document: Document,
}

#[derive(Clone, Debug)]
pub(crate) enum Document {
    Obj(Box<ObjDocument>),
    Gltf(Box<GltfDocument>),
}

impl Model {
    /// Takes the compressed file that this model was decoded from before it was read: where nothing has moved it is what is written.
    pub fn set_packed(&mut self, file: Vec<u8>) {
        if let Document::Gltf(document) = &mut self.document {
            document.set_packed(file);
        }
    }

    /// Names of the files that [`Self::read`] asks `resolve` for. Only materials of an OBJ are asked for here, with their textures;
    /// a file that cannot be read names none.
    pub fn named_files(
        name: &str,
        bytes: &[u8],
        resolve: &mut Resolve<'_>,
        memory_limit: u64,
    ) -> Vec<String> {
        match ModelFormat::of_file(name, bytes) {
            Ok(ModelFormat::Gltf) => gltf::named_files(bytes, memory_limit),
            Ok(ModelFormat::Obj) => obj::named_files(bytes, resolve, memory_limit),
            _ => Vec::new(),
        }
    }

    /// Reads an OBJ, glTF, GLB, PLY, STL or OFF file; the content decides which, `name` helps with the error if it is none of them.
    /// A model far from the world's origin has its positions from an [`Self::origin`] near it, without loss.
    ///
    /// `resolve` is asked for sibling files (buffers and textures of a `.gltf`, materials and textures of an OBJ) by
    /// relative path, each once; `data:` URIs are decoded here. A buffer that is not read is an error, anything else a
    /// notice. A file of vertices without faces is read: it may be a pose. Memory is limited by what there is.
    ///
    /// # Errors
    /// [`ReadError`], which names the line, accessor, node or file at fault.
    pub fn read(name: &str, bytes: &[u8], resolve: &mut Resolve<'_>) -> Result<Self, ReadError> {
        Self::read_within(name, bytes, resolve, u64::MAX)
    }

    /// As [`Self::read`], within `memory_limit` bytes: `bytes` and what they become, up to the table of different
    /// positions.
    ///
    /// # Errors
    /// [`ReadError`]; of memory, before it is allocated.
    pub fn read_within(
        name: &str,
        bytes: &[u8],
        resolve: &mut Resolve<'_>,
        memory_limit: u64,
    ) -> Result<Self, ReadError> {
        Self::read_from(name, bytes, resolve, memory_limit, true)
    }

    /// A mesh that was made, its positions as seen from an origin, as the model that its OBJ file would be.
    ///
    /// # Errors
    /// [`ReadError`] when it has no vertices.
    pub fn of_mesh(name: &str, mesh: &PolygonMesh, origin: DVec3) -> Result<Self, ReadError> {
        let text = obj::write_cage_obj(mesh, DVec3::ZERO);
        let model = Self::read_from(name, &text, &mut |_| None, u64::MAX, false)?;
        Ok(Self { origin, ..model })
    }

    fn read_from(
        name: &str,
        bytes: &[u8],
        resolve: &mut Resolve<'_>,
        memory_limit: u64,
        near: bool,
    ) -> Result<Self, ReadError> {
        let format = ModelFormat::of_file(name, bytes)?;
        match format {
            ModelFormat::Gltf => {
                let fault = |source| ReadError::Gltf { name: name.into(), source };
                let model = gltf::read(name, bytes, resolve, memory_limit, (!near).then_some(DVec3::ZERO))
                    .map_err(fault)?;
                Ok(Self {
                    name: name.into(),
                    positions: model.positions,
                    triangles: model.triangles,
                    counts: model.counts,
                    notices: model.notices,
                    up: UpAxis::Y,
                    origin: model.origin,
                    bytes: model.document.bytes,
                    format,
                    encoding: Encoding::default(),
                    has_normals: false,
                    document: Document::Gltf(Box::new(model.document)),
                })
            }
            ModelFormat::Obj => {
                let model = obj::read(bytes, resolve, memory_limit)
                    .map_err(|source| ReadError::Obj { name: name.into(), source })?;
                let corner = |c: u32| model.document.corners[c as usize].v;
                let origin = if near { origin_near(&model.positions) } else { DVec3::ZERO };
                let positions = if origin == DVec3::ZERO {
                    model.positions
                } else {
                    obj::positions_near(&model.document.bytes, origin)
                };
                Ok(Self {
                    name: name.into(),
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
                    format,
                    encoding: Encoding::default(),
                    has_normals: false,
                    document: Document::Obj(Box::new(model.document)),
                })
            }
            ModelFormat::Ply | ModelFormat::Stl | ModelFormat::Off => {
                let read = match format {
                    ModelFormat::Ply => ply::read,
                    ModelFormat::Stl => stl::read,
                    _ => off::read,
                };
                let fault = |source| ReadError::Polygons { name: name.into(), source };
                let mut read = read(bytes, memory_limit, near).map_err(fault)?;
                let document = read.document().map_err(fault)?;
                let corner = |c: u32| document.corners[c as usize].v;
                let (vertices, corners) = (read.positions.len() as u64, document.corners.len() as u64);
                Ok(Self {
                    name: name.into(),
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
    }

    /// Bytes that the model takes with the document it came from, about.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes that writing it takes besides, at once, about.
    #[must_use]
    pub fn bytes_to_write(&self, format: ModelFormat) -> u64 {
        /// Normals before and after, the new positions, and the file; an OBJ may be without normals.
        const VERTEX_BYTES: u64 = 300;
        const TRIANGLE_BYTES: u64 = 60;
        /// New accessors and buffer views as JSON.
        const PRIMITIVE_BYTES: u64 = 6000;
        let n = |count: usize| count as u64;
        let shape = VERTEX_BYTES * n(self.positions.len()) + TRIANGLE_BYTES * n(self.triangles.len());
        match format {
            ModelFormat::Gltf => shape + PRIMITIVE_BYTES * n(self.counts.primitives) + self.bytes,
            ModelFormat::Obj => shape / 3 + self.bytes,
            ModelFormat::Ply | ModelFormat::Stl | ModelFormat::Off => shape,
        }
    }

    /// Bytes in use while so many poses are written as morph targets, besides [`Self::bytes_to_write`].
    #[must_use]
    pub fn bytes_of_poses(&self, n_poses: usize) -> u64 {
        /// Position and normal of a vertex: how far they move, and in the file, twice each. 103 measured.
        const POSED_VERTEX_BYTES: u64 = 130;
        POSED_VERTEX_BYTES.saturating_mul(n_poses as u64 * self.positions.len() as u64)
    }

    /// What points up in the file; Y unless said otherwise.
    #[must_use]
    pub fn up(&self) -> UpAxis {
        self.up
    }

    /// Says what points up in the file, and turns the model to it. Files written later have the file's axes.
    pub fn set_up(&mut self, up: UpAxis) {
        self.positions = up.turned(&self.positions_in_file()).into_owned();
        self.up = up;
    }

    /// What the positions are seen from, in the file's axes: zero unless the model is far away.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Sees the positions from another origin, in the file's axes: a cage and its poses from that of their model. Adds a notice
    /// if the model is so far from it that positions are rounded.
    pub fn see_from(&mut self, origin: DVec3) {
        if origin != self.origin {
            let from = |p: &Vec3| relative(self.origin + p.as_dvec3(), origin);
            let positions: Vec<Vec3> = self.positions_in_file().iter().map(from).collect();
            self.positions = self.up.turned(&positions).into_owned();
            self.origin = origin;
            self.notices.extend(far_notice(&self.positions));
        }
    }

    /// Positions at rest as they are in the file, as seen from the origin.
    pub(crate) fn positions_in_file(&self) -> Cow<'_, [Vec3]> {
        self.up.turned_back(&self.positions)
    }

    /// How the model looks: texture coordinates, colours, materials, undecoded images.
    #[must_use]
    pub fn look(&self) -> Look {
        match &self.document {
            Document::Obj(document) => obj::look(document, &self.positions),
            Document::Gltf(document) => gltf::look(document, &self.positions, &self.triangles),
        }
    }

    /// Format of the document.
    #[must_use]
    pub fn format(&self) -> ModelFormat {
        self.format
    }

    /// Number of faces: polygons of an OBJ, triangles of a glTF.
    #[must_use]
    pub fn n_faces(&self) -> usize {
        match &self.document {
            Document::Obj(document) => document.face_materials.len(),
            Document::Gltf(_) => self.triangles.len(),
        }
    }

    /// # Errors
    /// [`ReadError::NoFaces`] for a file of vertices only, which is fit for a pose but not for a mesh or a cage.
    pub fn require_faces(&self) -> Result<(), ReadError> {
        if self.n_faces() > 0 {
            return Ok(());
        }
        Err(ReadError::NoFaces { name: self.name.clone(), vertices: self.positions.len() })
    }

    /// Vertices and triangles as the core takes them.
    #[must_use]
    pub fn tri_mesh(&self) -> TriMesh {
        TriMesh { positions: self.positions.clone(), triangles: self.triangles.clone() }
    }
}
