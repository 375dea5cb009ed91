//! A model: vertices, triangles and the document they were read from.

mod cage;
mod format;
mod read;
mod stored;
mod write;

pub use cage::PoseState;
pub use format::{FormatError, FormatFacts, ModelFormat};
pub use stored::{RestoreError, Store, StoredArrays};

use std::borrow::Cow;
use std::sync::Arc;

use cagework_core::color::srgb_from_linear;
use cagework_core::splats::Splats;
use cagework_core::{Bounds, PolygonMesh, TriMesh};
use glam::{DVec3, Quat, Vec3};
use thiserror::Error;

use crate::counts::Counts;
use crate::fbx::FbxError;
use crate::gltf::{self, GltfDocument, GltfError};
use crate::look::Look;
use crate::obj::{self, ObjError, PolygonDocument};
use crate::origin::{far_notice, relative};
use crate::polygons::{Encoding, PolygonsError};
use crate::shown::shown;
use crate::siblings::Resolve;
use crate::splats::{Capture, SplatError};
use crate::up::UpAxis;
use read::Source;

/// Error of reading a model.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The format is not supported.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A file of vertices without faces where faces are required.
    #[error(
        "{} has {vertices} vertices but no faces: export it with faces (points and splats can be deformed, pulled, mapped or drawn, and be a pose)",
        shown(name)
    )]
    NoFaces {
        /// Name given by the caller.
        name: String,
        /// Number of vertices in the file.
        vertices: usize,
    },
    /// Error in an OBJ file.
    #[error("{}: {source}", shown(name))]
    Obj {
        /// Name given by the caller.
        name: String,
        /// What is wrong in the file.
        source: ObjError,
    },
    /// Error in a PLY, STL, OFF or 3MF file.
    #[error("{}: {source}", shown(name))]
    Polygons {
        /// Name given by the caller.
        name: String,
        /// What is wrong in the file.
        source: PolygonsError,
    },
    /// Error in a file of splats.
    #[error("{}: {source}", shown(name))]
    Splats {
        /// Name given by the caller.
        name: String,
        /// What is wrong in the file.
        source: SplatError,
    },
    /// Error in an FBX file.
    #[error("{}: {source}", shown(name))]
    Fbx {
        /// Name given by the caller.
        name: String,
        /// What is wrong in the file.
        source: FbxError,
    },
    /// Error in a glTF file.
    #[error("{}: {source}", shown(name))]
    Gltf {
        /// Name given by the caller.
        name: String,
        /// What is wrong in the file.
        source: GltfError,
    },
}

/// A model read from bytes.
#[derive(Clone, Debug)]
pub struct Model {
    /// Name that the caller gave the model.
    pub name: String,
    /// Positions in world space, Y up, relative to [`Self::origin`]. In file order (see the crate
    /// documentation), not welded. `[n_vertices]`
    pub positions: Vec<Vec3>,
    /// Triangles, counter-clockwise from outside; polygons are triangulated. `[n_triangles, 3]`
    pub triangles: Vec<[u32; 3]>,
    /// Numbers of nodes, meshes, materials and other elements of the file.
    pub counts: Counts,
    /// Warnings for the user, one sentence each.
    pub notices: Vec<String>,
    /// Up axis of the file, from which `positions` were converted to Y up.
    pub(crate) up: UpAxis,
    /// Origin of `positions`, in the file's axes.
    pub(crate) origin: DVec3,
    bytes: u64,
    format: ModelFormat,
    /// For PLY, STL and OFF files: the encoding of numbers, and whether vertices have normals. The writers of these
    /// formats use both.
    encoding: Encoding,
    has_normals: bool,
    /// The document that the model was read from; for a capture, a polygon document without faces.
    pub(crate) document: Document,
    pub(crate) capture: Option<Arc<Capture>>,
}

#[derive(Clone, Debug)]
pub(crate) enum Document {
    Polygons(Box<PolygonDocument>),
    Gltf(Box<GltfDocument>),
}

impl Model {
    /// Lists the names of the external files that the model refers to: buffers, images, material libraries. Libraries
    /// of an OBJ name textures in turn, so they are read by calling `resolve`. Empty if the file cannot be read.
    pub fn named_files(
        name: &str,
        bytes: &[u8],
        resolve: &mut Resolve<'_>,
        memory_limit: u64,
    ) -> Vec<String> {
        ModelFormat::of_file(name, bytes)
            .map_or(Vec::new(), |format| (format.facts().named_files)(bytes, resolve, memory_limit))
    }

    /// Reads a file of any [`ModelFormat`], detected from the content; `name` is used in messages. Models far from the
    /// world origin are stored relative to [`Self::origin`], without loss.
    ///
    /// `resolve` is called once for each external file (buffers and textures of a `.gltf`, materials and textures of an
    /// OBJ) with its relative path; `data:` URIs are decoded here. A missing buffer is an error, other missing files
    /// are notices. A file without faces is accepted, since it can be a pose. Memory is not limited.
    ///
    /// # Errors
    /// [`ReadError`] naming the line, accessor, node or file at fault.
    pub fn read(name: &str, bytes: &[u8], resolve: &mut Resolve<'_>) -> Result<Self, ReadError> {
        Self::read_within(name, bytes, resolve, u64::MAX)
    }

    /// Like [`Self::read`], using at most `memory_limit` bytes. The estimate covers `bytes`, the model and the table
    /// for welding positions. Owned bytes of an OBJ become part of the model; borrowed ones are copied.
    ///
    /// # Errors
    /// [`ReadError`]. The memory limit is checked before allocating.
    pub fn read_within<'a>(
        name: &str,
        bytes: impl Into<Cow<'a, [u8]>>,
        resolve: &mut Resolve<'_>,
        memory_limit: u64,
    ) -> Result<Self, ReadError> {
        let bytes = bytes.into();
        Source { name, bytes, resolve, memory_limit, near: true, clips_alone: false }.read()
    }

    /// Like [`Self::read_within`], but also accepts a glTF that contains only clips, without triangles and vertices.
    ///
    /// # Errors
    /// As [`Self::read_within`].
    pub fn read_with_clips<'a>(
        name: &str,
        bytes: impl Into<Cow<'a, [u8]>>,
        resolve: &mut Resolve<'_>,
        memory_limit: u64,
    ) -> Result<Self, ReadError> {
        let bytes = bytes.into();
        Source { name, bytes, resolve, memory_limit, near: true, clips_alone: true }.read()
    }

    /// Makes a model from a generated mesh whose positions are relative to `origin`; same result as reading the mesh as
    /// an OBJ file.
    ///
    /// # Errors
    /// [`ReadError`] if the mesh has no vertices.
    pub fn of_mesh(name: &str, mesh: &PolygonMesh, origin: DVec3) -> Result<Self, ReadError> {
        let text = obj::write_cage_obj(mesh, DVec3::ZERO);
        let model = Source { bytes: text.into(), ..Source::of_made(name, &mut |_| None) }.read()?;
        Ok(Self { origin, ..model })
    }

    /// Makes a capture from splats whose positions are relative to `origin`.
    ///
    /// # Errors
    /// [`ReadError`] if `splats` is empty, or a number is not finite.
    ///
    /// # Panics
    /// If the arrays have different numbers of splats.
    pub fn of_splats(name: &str, splats: Splats, origin: DVec3) -> Result<Self, ReadError> {
        if splats.is_empty() {
            return Err(ReadError::Splats { name: name.into(), source: SplatError::Empty });
        }
        Source::of_made(name, &mut |_| None).new_capture(splats, origin)
    }

    /// Approximate memory of the model and its document, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Approximate additional memory while exporting to `format`, bytes.
    #[must_use]
    pub fn bytes_to_write(&self, format: ModelFormat) -> u64 {
        /// Memory per vertex: deformation gradients and their sums, normals, new positions and the output.
        const VERTEX_BYTES: u64 = 300;
        const TRIANGLE_BYTES: u64 = 60;
        let n = |count: usize| count as u64;
        let shape = VERTEX_BYTES * n(self.positions.len()) + TRIANGLE_BYTES * n(self.triangles.len());
        (format.facts().bytes_to_write)(self, shape)
    }

    /// Additional memory for `n_poses` morph targets on top of [`Self::bytes_to_write`], bytes.
    #[must_use]
    pub fn bytes_of_poses(&self, n_poses: usize) -> u64 {
        /// Position and normal displacement of a vertex, in memory and in the output, twice each. A measurement gave
        /// 103 bytes; the estimate adds a quarter.
        const POSED_VERTEX_BYTES: u64 = 130;
        POSED_VERTEX_BYTES.saturating_mul(n_poses as u64 * self.positions.len() as u64)
    }

    /// Up axis of the file; Y unless set by [`Self::set_up`].
    #[must_use]
    pub fn up(&self) -> UpAxis {
        self.up
    }

    /// Sets the up axis of the file and converts the positions to Y up. Exports use the file's axes.
    pub fn set_up(&mut self, up: UpAxis) {
        self.positions = up.turned(&self.positions_in_file()).into_owned();
        if up != self.up
            && let Some(capture) = &mut self.capture
        {
            let [from, to] = [self.up, up].map(|up| Quat::from_mat4(&up.turn()));
            let capture = Arc::make_mut(capture);
            capture.splats = capture.splats.rotated(to * from.inverse());
            capture.splats.positions.clone_from(&self.positions);
        }
        self.up = up;
    }

    /// Origin of the positions, in the file's axes: zero unless the model is far from the world origin.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Makes the positions relative to another origin, in the file's axes. Cages and poses take their model's
    /// origin. Adds a notice if the model is so far from `origin` that f32 rounds its positions noticeably.
    pub fn set_origin(&mut self, origin: DVec3) {
        if origin != self.origin {
            let from = |p: &Vec3| relative(self.origin + p.as_dvec3(), origin);
            let positions: Vec<Vec3> = self.positions_in_file().iter().map(from).collect();
            self.positions = self.up.turned(&positions).into_owned();
            self.origin = origin;
            if let Some(capture) = &mut self.capture {
                Arc::make_mut(capture).splats.positions.clone_from(&self.positions);
            }
            self.notices.extend(far_notice(&self.positions));
        }
    }

    /// The splats of a capture, in the axes of [`Self::positions`], which are their centres.
    #[must_use]
    pub fn splats(&self) -> Option<&Splats> {
        self.capture.as_ref().map(|capture| &capture.splats)
    }

    /// Returns the splats that show a file without faces: the splats of a capture, or one splat per point. `None` for a
    /// file with faces.
    #[must_use]
    pub fn drawn_splats(&self) -> Option<Cow<'_, Splats>> {
        match &self.capture {
            Some(capture) => Some(Cow::Borrowed(&capture.splats)),
            None if self.n_faces() == 0 => {
                Some(Cow::Owned(Splats::of_points(&self.positions, self.point_colors())))
            }
            None => None,
        }
    }

    /// Returns the colours of vertices, sRGB. A vertex without a colour gets one that depends on its position, so that
    /// the shape is visible.
    fn point_colors(&self) -> Vec<Vec3> {
        let bounds = Bounds::around(&self.positions).unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ONE });
        let size = bounds.extent().max_element().max(f32::MIN_POSITIVE);
        let look = match &self.document {
            Document::Gltf(document) if document.has_colors() => Some(self.look()),
            _ => None,
        };
        let color = |(k, &p): (u32, &Vec3)| match (&self.document, &look) {
            (Document::Polygons(document), _) if document.colors.contains_key(&k) => {
                Vec3::from(document.colors[&k])
            }
            (_, Some(look)) => {
                let [r, g, b, _] = look.vertices[k as usize].color;
                Vec3::new(r, g, b).map(srgb_from_linear)
            }
            _ => 0.3 + 0.6 * (p - bounds.min) / size,
        };
        (0..).zip(&self.positions).map(color).collect()
    }

    /// Rest positions in the file's axes, relative to the origin.
    pub(crate) fn positions_in_file(&self) -> Cow<'_, [Vec3]> {
        self.up.turned_back(&self.positions)
    }

    /// Texture coordinates, colours, materials and encoded images.
    #[must_use]
    pub fn look(&self) -> Look {
        match &self.document {
            Document::Polygons(document) => obj::look(document, &self.positions),
            Document::Gltf(document) => gltf::look(document, &self.positions, &self.triangles),
        }
    }

    /// Format of the file that the model was read from.
    #[must_use]
    pub fn format(&self) -> ModelFormat {
        self.format
    }

    /// Number of faces: triangles for glTF, polygons otherwise.
    #[must_use]
    pub fn n_faces(&self) -> usize {
        match &self.document {
            Document::Polygons(document) => document.face_materials.len(),
            Document::Gltf(_) => self.triangles.len(),
        }
    }

    /// Rejects a file without faces, which can be a pose but not a model or a cage.
    ///
    /// # Errors
    /// [`ReadError::NoFaces`].
    pub fn require_faces(&self) -> Result<(), ReadError> {
        if self.n_faces() > 0 {
            return Ok(());
        }
        Err(ReadError::NoFaces { name: self.name.clone(), vertices: self.positions.len() })
    }

    /// Copies vertices and triangles for `cagework_core`.
    #[must_use]
    pub fn tri_mesh(&self) -> TriMesh {
        TriMesh { positions: self.positions.clone(), triangles: self.triangles.clone() }
    }
}
