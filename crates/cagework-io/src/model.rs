//! A model: vertices and triangles, and the document they came from.

use std::borrow::Cow;

use cagework_core::mesh::weld;
use cagework_core::{PolygonMesh, TriMesh};
use glam::Vec3;
use thiserror::Error;

use crate::counts::Counts;
use crate::error::{PoseError, WriteError};
use crate::format::{FormatError, ModelFormat};
use crate::gltf::{self, GltfDocument, GltfError, Played, Pose, Rest};
use crate::look::Look;
use crate::obj::{self, ObjDocument, ObjError};
use crate::polygons::{Encoding, Polygons, PolygonsError};
use crate::shown::shown;
use crate::siblings::Resolve;
use crate::up::UpAxis;
use crate::{ply, stl};

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
    /// A fault in a PLY or STL file.
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
    /// World-space position of every vertex, Y up, in the order of the input (see the crate's root), not welded.
    pub positions: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from outside; polygons are triangulated.
    pub triangles: Vec<[u32; 3]>,
    /// How much of everything there is.
    pub counts: Counts,
    /// What the user should know: each a sentence.
    pub notices: Vec<String>,
    /// What points up in the document.
    pub(crate) up: UpAxis,
    bytes: u64,
    format: ModelFormat,
    /// Of a PLY or STL: how its numbers are written; whether its vertices have normals.
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
    /// Reads an OBJ, glTF, GLB, PLY or STL file; the content decides which, `name` helps with the error if it is none of them.
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
        let format = ModelFormat::of_file(name, bytes)?;
        match format {
            ModelFormat::Gltf => {
                let fault = |source| ReadError::Gltf { name: name.into(), source };
                let model = gltf::read(name, bytes, resolve, memory_limit).map_err(fault)?;
                Ok(Self {
                    name: name.into(),
                    positions: model.positions,
                    triangles: model.triangles,
                    counts: model.counts,
                    notices: model.notices,
                    up: UpAxis::Y,
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
                Ok(Self {
                    name: name.into(),
                    triangles: model.document.triangles.iter().map(|t| t.map(corner)).collect(),
                    positions: model.positions,
                    counts: Counts {
                        nodes: model.groups,
                        meshes: 1,
                        primitives: 1,
                        materials: model.document.materials.len(),
                        ..Counts::default()
                    },
                    notices: model.notices,
                    up: UpAxis::Y,
                    bytes: model.bytes,
                    format,
                    encoding: Encoding::default(),
                    has_normals: false,
                    document: Document::Obj(Box::new(model.document)),
                })
            }
            ModelFormat::Ply | ModelFormat::Stl => {
                let read = if format == ModelFormat::Ply { ply::read } else { stl::read };
                let fault = |source| ReadError::Polygons { name: name.into(), source };
                let mut read = read(bytes, memory_limit).map_err(fault)?;
                let document = read.document().map_err(fault)?;
                let corner = |c: u32| document.corners[c as usize].v;
                let (vertices, corners) = (read.positions.len() as u64, document.corners.len() as u64);
                Ok(Self {
                    name: name.into(),
                    triangles: document.triangles.iter().map(|t| t.map(corner)).collect(),
                    counts: Counts { nodes: 1, meshes: 1, primitives: 1, ..Counts::default() },
                    notices: read.notices,
                    up: UpAxis::Y,
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
            ModelFormat::Ply | ModelFormat::Stl => shape,
        }
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

    /// Positions at rest as they are in the file.
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

    /// The model as a cage: an OBJ's `v` lines and polygons as they are; a glTF's triangles, welded by position in order
    /// of first occurrence (vertices split at seams would make the cage look open), without those that collapse.
    #[must_use]
    pub fn cage_mesh(&self) -> PolygonMesh {
        match &self.document {
            Document::Obj(document) => {
                let face =
                    |f: &[u32]| document.corners[f[0] as usize..f[1] as usize].iter().map(|c| c.v).collect();
                PolygonMesh {
                    positions: self.positions.clone(),
                    faces: document.face_starts.windows(2).map(face).collect(),
                }
            }
            Document::Gltf(_) => {
                let welded = weld(&self.positions);
                let faces = self.triangles.iter().map(|t| t.map(|v| welded.unique_of[v as usize]));
                PolygonMesh {
                    positions: welded.first.iter().map(|&v| self.positions[v as usize]).collect(),
                    faces: faces.filter(|[a, b, c]| a != b && b != c && c != a).map(Vec::from).collect(),
                }
            }
        }
    }

    /// Positions of `pose` for each vertex of this model's [`Self::cage_mesh`].
    ///
    /// A glTF cage is welded at rest; its pose has either the same vertices before welding, or as many as after.
    ///
    /// # Errors
    /// [`PoseError`] when the numbers of vertices do not agree.
    pub fn pose_positions(&self, pose: &Self) -> Result<Vec<Vec3>, PoseError> {
        let first = match self.document {
            Document::Obj(_) => (0..self.positions.len() as u32).collect(),
            Document::Gltf(_) => weld(&self.positions).first,
        };
        if pose.positions.len() == self.positions.len() {
            return Ok(first.iter().map(|&v| pose.positions[v as usize]).collect());
        }
        if pose.positions.len() == first.len() {
            return Ok(pose.positions.clone());
        }
        Err(PoseError {
            pose: pose.name.clone(),
            given: pose.positions.len(),
            cage: self.name.clone(),
            expected: first.len(),
        })
    }

    /// Positions of the file's vertices in a pose of the cage that it is, `[n_cage]`: the way back from
    /// [`Self::pose_positions`].
    #[must_use]
    pub fn posed_as_cage(&self, pose: &[Vec3]) -> Vec<Vec3> {
        match self.document {
            Document::Obj(_) => pose.to_vec(),
            Document::Gltf(_) => weld(&self.positions).unique_of.iter().map(|&u| pose[u as usize]).collect(),
        }
    }

    /// The model with new positions as a file of `format`.
    ///
    /// # Errors
    /// Those of [`Self::write_obj`] and [`Self::write_glb`].
    pub fn write(&self, format: ModelFormat, positions: &[Vec3]) -> Result<Vec<u8>, WriteError> {
        match format {
            ModelFormat::Obj => self.write_obj(positions),
            ModelFormat::Gltf => self.write_glb(positions),
            ModelFormat::Ply => self.write_ply(positions),
            ModelFormat::Stl => self.write_stl(positions),
        }
    }

    /// The model with new positions as an OBJ file.
    ///
    /// An OBJ keeps everything but its coordinates and normals byte for byte; others become a new OBJ with their vertices
    /// in the same order. `positions`: world space, one for each vertex.
    ///
    /// # Errors
    /// [`WriteError`] when there is not one finite position for each vertex.
    pub fn write_obj(&self, positions: &[Vec3]) -> Result<Vec<u8>, WriteError> {
        self.check(positions)?;
        let (rest, positions) = (self.positions_in_file(), self.up.turned_back(positions));
        match &self.document {
            Document::Obj(document) if self.format == ModelFormat::Obj => {
                Ok(obj::patch(document, &rest, &positions))
            }
            Document::Obj(_) => {
                let faces = self.cage_mesh().faces;
                Ok(obj::write_cage_obj(&PolygonMesh { positions: positions.into_owned(), faces }))
            }
            Document::Gltf(document) => {
                let rest = Rest { positions: &rest, triangles: &self.triangles };
                gltf::write_obj(document, rest, &positions)
            }
        }
    }

    /// The model with new positions as a PLY file: polygons, colours of vertices, and normals if a PLY had them; text if it was a
    /// text, big-endian if it was, otherwise binary.
    ///
    /// # Errors
    /// [`WriteError`] when there is not one finite position for each vertex.
    pub fn write_ply(&self, positions: &[Vec3]) -> Result<Vec<u8>, WriteError> {
        self.check(positions)?;
        let (faces, colors) = match &self.document {
            Document::Obj(document) => (self.cage_mesh().faces, Some(&document.colors)),
            Document::Gltf(_) => (self.triangles.iter().map(|t| t.to_vec()).collect(), None),
        };
        let positions = self.up.turned_back(positions);
        Ok(ply::write(ply::Written {
            positions: &positions,
            triangles: &self.triangles,
            faces,
            color: &|v| colors.and_then(|colors| colors.get(&v)).copied(),
            has_colors: colors.is_some_and(|colors| !colors.is_empty()),
            has_normals: self.has_normals,
            encoding: self.encoding,
        }))
    }

    /// The model with new positions as an STL file: triangles and the normals of their planes; text if it was a text, otherwise
    /// binary.
    ///
    /// # Errors
    /// [`WriteError`] when there is not one finite position for each vertex, or no triangle.
    pub fn write_stl(&self, positions: &[Vec3]) -> Result<Vec<u8>, WriteError> {
        self.check(positions)?;
        if self.triangles.is_empty() {
            return Err(WriteError::NoFaces);
        }
        Ok(stl::write(&self.up.turned_back(positions), &self.triangles, self.encoding))
    }

    /// The model with new positions as a GLB file.
    ///
    /// A glTF keeps its materials, textures (those by URI are embedded), texture coordinates, names and nodes; see
    /// the notices for what a deformed shape cannot keep. An OBJ becomes one mesh. `positions`: world space, one for
    /// each vertex.
    ///
    /// # Errors
    /// [`WriteError`] when there is not one finite position for each vertex, there are no triangles, or the file would
    /// be too large.
    pub fn write_glb(&self, positions: &[Vec3]) -> Result<Vec<u8>, WriteError> {
        self.glb(positions, &[], Played::InTurn)
    }

    /// The model with `rest` as its shape and one morph target for each pose, with an animation that goes from rest
    /// through all poses back to rest, a second each.
    ///
    /// # Errors
    /// As [`Self::write_glb`].
    pub fn write_glb_poses(
        &self,
        rest: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
    ) -> Result<Vec<u8>, WriteError> {
        self.glb(rest, poses, Played::InTurn)
    }

    pub(crate) fn glb(
        &self,
        base: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
        played: Played<'_>,
    ) -> Result<Vec<u8>, WriteError> {
        self.check(base)?;
        poses.iter().try_for_each(|(_, positions)| self.check(positions))?;
        if self.triangles.is_empty() {
            return Err(WriteError::NoFaces);
        }
        let at_rest = self.positions_in_file();
        let base = self.up.turned_back(base);
        let turned: Vec<_> = poses.iter().map(|(_, positions)| self.up.turned_back(positions)).collect();
        let document = match &self.document {
            Document::Gltf(document) => {
                let rest = Rest { positions: &at_rest, triangles: &self.triangles };
                return gltf::patch(document, rest, &base, &named(poses, &turned), played);
            }
            Document::Obj(document) => document,
        };
        // One way to deform a GLB: make one of the shape at rest, then patch that.
        let stem = self.name.rsplit_once('.').map_or(self.name.as_str(), |(stem, _)| stem);
        let (glb, source) = gltf::build_from_obj(stem, document, &at_rest)?;
        let built = gltf::read(&self.name, &glb, &mut |_| None, u64::MAX)?;
        let spread = |positions: &[Vec3]| source.iter().map(|&v| positions[v as usize]).collect::<Vec<_>>();
        let spread_poses: Vec<_> = turned.iter().map(|positions| spread(positions).into()).collect();
        let rest = Rest { positions: &built.positions, triangles: &built.triangles };
        gltf::patch(&built.document, rest, &spread(&base), &named(poses, &spread_poses), played)
    }

    fn check(&self, positions: &[Vec3]) -> Result<(), WriteError> {
        if positions.len() != self.positions.len() {
            return Err(WriteError::Count { given: positions.len(), expected: self.positions.len() });
        }
        match positions.iter().position(|p| !p.is_finite()) {
            Some(vertex) => Err(WriteError::NotFinite { vertex }),
            None => Ok(()),
        }
    }
}

/// Poses by the names of `poses`.
fn named<'a>(poses: &'a [(String, Vec<Vec3>)], positions: &'a [Cow<'_, [Vec3]>]) -> Vec<Pose<'a>> {
    poses.iter().zip(positions).map(|((name, _), positions)| Pose { name, positions }).collect()
}
