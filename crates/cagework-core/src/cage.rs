//! The cage: a polygon mesh that is closed and oriented by construction, with its boundary values.
//!
//! [`Cage::new`] establishes the invariants of all later stages: every edge belongs to two faces with opposite
//! directions along it, every face has an area, every component encloses a volume and faces away from the solid. The
//! solid consists of the points enclosed by an odd number of components, so a component inside another one bounds a
//! cavity. Faults that can be repaired without changing the solid are repaired with a [`CageNotice`]; all others are a
//! [`CageError`] with their location. Indices of vertices, faces and components start at 0. Self-intersection is not
//! checked.
//!
//! [`Cage::hats_at`] gives the boundary values ("hats").

mod defects;
mod hats;
mod orient;
mod patch;
mod polygon;
#[cfg(test)]
pub(crate) mod shapes;
mod subdivided_box;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_hats;
mod topology;

mod triangulate;

use glam::{DVec3, Vec3};

use crate::mesh::{Bounds, PolygonMesh};

pub use defects::{CageError, CageNotice, FaceDefect};
pub use orient::Solid;
use polygon::Polygon;
pub use subdivided_box::subdivided_box;
use topology::Surface;
pub use topology::{Side, sides_of};

/// Smallest allowed diagonal of a cage, object units. Squares and cubes of lengths are then within the range of f32 and
/// f64.
pub const MIN_DIAGONAL: f64 = 1e-12;
/// Largest allowed diagonal of a cage, object units, for the same reason as [`MIN_DIAGONAL`].
pub const MAX_DIAGONAL: f64 = 1e12;

/// Largest allowed number of faces of a cage. Checking more faces would take minutes. So many faces usually mean that a
/// model was given as its own cage.
pub const MAX_FACES: usize = 100_000;

/// A point counts as on the surface if its distance from the cage, as a fraction of the cage's diagonal, is at most
/// this: the resolution of f32 coordinates.
pub(crate) const CAGE_TOLERANCE: f64 = 1e-6;

/// Largest number of corners for which hat values need no heap memory.
const STACK_CORNERS: usize = 8;

/// A closed, outward-oriented polygon mesh around the model.
#[derive(Clone, Debug)]
pub struct Cage {
    positions: Vec<Vec3>,
    faces: Vec<Vec<u32>>,
    triangles: Vec<[u32; 3]>,
    face_of_triangle: Vec<u32>,
    component_of_face: Vec<u32>,
    facets: Vec<[u32; 3]>,
    facet_points: Vec<DVec3>,
    face_of_facet: Vec<u32>,
    first_facet: Vec<u32>,
    polygons: Vec<Polygon>,
    bounds: Bounds,
    notices: Vec<CageNotice>,
}

impl Cage {
    /// Checks a polygon mesh and builds a cage from it.
    ///
    /// Inverted faces are turned, and vertices split at a seam (equal positions along open edges, as in glTF files) are
    /// joined: the first one replaces the others. A notice reports each repair.
    ///
    /// # Errors
    /// [`CageError`] naming the face, edge or vertex.
    pub fn new(mesh: &PolygonMesh) -> Result<Self, CageError> {
        let bounds = check_numbers(mesh)?;
        let diagonal = bounds.max.as_dvec3().distance(bounds.min.as_dvec3());
        let mut notices = Vec::new();
        let mut surface = topology::close(mesh, &mut notices)?;
        topology::check_doubled(&mesh.positions, &surface)?;
        let polygons = orient::orient(&mesh.positions, &mut surface, diagonal, &mut notices)?;
        topology::note_vertices(mesh, &surface, &mut notices);

        let Surface { faces, component, .. } = surface;
        Ok(Self::assembled(mesh.positions.clone(), faces, polygons, component, bounds, notices))
    }

    /// Returns this cage with walls inside it: additional faces that are not checked and need not enclose a volume. A
    /// face has values on its outer side only. A wall with values on both sides has each face twice, with opposite
    /// orientations.
    ///
    /// `positions`: additional vertices, appended to those of the cage; `faces`: vertex indices into the combined list;
    /// `parts`: index of the connected component of each face.
    ///
    /// # Errors
    /// [`CageError`] if there are too many faces, or one has no area.
    pub(crate) fn with_walls(
        &self,
        positions: &[Vec3],
        faces: &[Vec<u32>],
        parts: &[u32],
    ) -> Result<Self, CageError> {
        let n_faces = self.faces.len() + faces.len();
        if n_faces > MAX_FACES {
            return Err(CageError::TooManyFaces { faces: n_faces });
        }
        let all = [self.positions.as_slice(), positions].concat();
        let mut polygons = self.polygons.clone();
        for (f, face) in (self.faces.len() as u32..).zip(faces) {
            let corners: Vec<DVec3> = face.iter().map(|&i| all[i as usize].as_dvec3()).collect();
            let polygon = Polygon::new(&corners, f64::from(self.diagonal()));
            polygons.push(polygon.map_err(|why| CageError::DegenerateFace { face: f, why })?);
        }
        let first = self.component_of_face.iter().max().map_or(0, |last| last + 1);
        let parts =
            self.component_of_face.iter().copied().chain(parts.iter().map(|part| first + part)).collect();
        let faces = self.faces.iter().chain(faces).cloned().collect();
        Ok(Self::assembled(all, faces, polygons, parts, self.bounds, self.notices.clone()))
    }

    /// Builds a cage from faces that have been checked.
    fn assembled(
        positions: Vec<Vec3>,
        faces: Vec<Vec<u32>>,
        polygons: Vec<Polygon>,
        component_of_face: Vec<u32>,
        bounds: Bounds,
        notices: Vec<CageNotice>,
    ) -> Self {
        let mut cage = Self {
            positions,
            triangles: Vec::new(),
            face_of_triangle: Vec::new(),
            component_of_face,
            facets: Vec::new(),
            facet_points: Vec::new(),
            face_of_facet: Vec::new(),
            first_facet: Vec::new(),
            faces,
            polygons,
            bounds,
            notices,
        };
        let mut n_points = cage.positions.len();
        for (f, (face, polygon)) in (0u32..).zip(cage.faces.iter().zip(&cage.polygons)) {
            cage.triangles.extend(polygon.triangles.iter().map(|t| t.map(|k| face[k as usize])));
            cage.face_of_triangle.resize(cage.triangles.len(), f);
            let point = |k: u32| {
                let inner = || (n_points + k as usize - face.len()) as u32;
                face.get(k as usize).copied().unwrap_or_else(inner)
            };
            cage.first_facet.push(cage.facets.len() as u32);
            cage.facets.extend(polygon.facets.iter().map(|facet| facet.map(point)));
            cage.face_of_facet.resize(cage.facets.len(), f);
            n_points += polygon.inner.len();
        }
        cage.facet_points = cage.facet_points_at(&cage.positions);
        cage
    }

    /// Vertex positions in the order of the input. `[n_cage]`, object units.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Number of vertices, including unused ones.
    #[must_use]
    pub fn n_vertices(&self) -> usize {
        self.positions.len()
    }

    /// Vertex indices of each face in the order of the input, counter-clockwise seen from outside. `[n_faces]`
    #[must_use]
    pub fn faces(&self) -> &[Vec<u32>] {
        &self.faces
    }

    /// Triangulation of all faces in their order, counter-clockwise seen from outside. `[n_triangles]`
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Face of each triangle. `[n_triangles]`
    #[must_use]
    pub fn face_of_triangle(&self) -> &[u32] {
        &self.face_of_triangle
    }

    /// Connected component of each face, numbered in order of their first faces. `[n_faces]`
    #[must_use]
    pub fn component_of_face(&self) -> &[u32] {
        &self.component_of_face
    }

    /// The surface that a model is bound to, as indices into [`Self::facet_points`], counter-clockwise seen from
    /// outside: the [`Self::triangles`], with bent faces subdivided. `[n_facets]`
    #[must_use]
    pub fn facets(&self) -> &[[u32; 3]] {
        &self.facets
    }

    /// Face of each facet. `[n_facets]`
    #[must_use]
    pub fn face_of_facet(&self) -> &[u32] {
        &self.face_of_facet
    }

    /// The cage's vertices, then points inside bent faces, object units. `[n_cage + n_inner]`
    #[must_use]
    pub fn facet_points(&self) -> &[DVec3] {
        &self.facet_points
    }

    /// [`Self::facet_points`] with the cage's vertices at `positions`. `[n_cage + n_inner]`
    ///
    /// # Panics
    /// If there are fewer positions than cage vertices.
    #[must_use]
    pub fn facet_points_at(&self, positions: &[Vec3]) -> Vec<DVec3> {
        let at = |i: u32| positions[i as usize].as_dvec3();
        let mut points: Vec<DVec3> = (0..self.positions.len() as u32).map(at).collect();
        for (face, polygon) in self.faces.iter().zip(&self.polygons) {
            let inner =
                polygon.inner.iter().map(|hats| face.iter().zip(hats).map(|(&i, h)| *h * at(i)).sum());
            points.extend(inner.collect::<Vec<DVec3>>());
        }
        points
    }

    /// Corners of one of [`Self::facets`], object units.
    #[must_use]
    pub fn facet_corners(&self, facet: u32) -> [DVec3; 3] {
        self.facets[facet as usize].map(|i| self.facet_points[i as usize])
    }

    /// Corners of one of [`Self::triangles`], object units.
    #[must_use]
    pub fn triangle_corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize].as_dvec3())
    }

    /// Bounding box of the surface, without unused vertices. Object units.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Diagonal of [`Self::bounds`], object units.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        self.bounds.diagonal()
    }

    /// Notices about repairs and about properties that may be unintended.
    #[must_use]
    pub fn notices(&self) -> &[CageNotice] {
        &self.notices
    }

    /// The cage with repairs applied: faces outward, seams closed.
    #[must_use]
    pub fn to_polygon_mesh(&self) -> PolygonMesh {
        PolygonMesh { positions: self.positions.clone(), faces: self.faces.clone() }
    }

    /// Computes the Dirichlet values ("hats") of the cage vertices at a point of the surface, given by one of
    /// [`Self::facets`] and barycentric coordinates in it. Calls `each(cage vertex, value)` for non-zero values. The
    /// values sum to 1 and reproduce the point; on a face whose corners are up to 1e-4 diagonals off its plane, with an
    /// error of up to 2e-6 diagonals.
    ///
    /// Hats are linear on triangles. On convex planar quads they are the coordinates of Meyer et al. 2002 (bilinear on
    /// a rectangle), blended with pseudo-harmonic coordinates if a corner is nearly straight. On all other planar
    /// polygons they are pseudo-harmonic coordinates (after Gordon and Wixom 1974: means over the chords through the
    /// point), which depend continuously on the corners. A bent face is a patch over its best-fitting plane, with the
    /// coordinates of its projected outline at the corners of facets, linear in between; if that outline crosses
    /// itself or a side of it vanishes, hats are linear on the triangles of the face. All hats are non-negative and
    /// linear along edges, so neighbouring faces agree.
    ///
    /// # Panics
    /// If there is no such facet.
    pub fn hats_at(&self, facet: u32, barycentric: [f64; 3], each: &mut dyn FnMut(u32, f64)) {
        let f = self.face_of_facet[facet as usize] as usize;
        let (face, polygon) = (&self.faces[f], &self.polygons[f]);
        let rank = (facet - self.first_facet[f]) as usize;
        if polygon.outline.is_empty() {
            for (&i, b) in self.facets[facet as usize].iter().zip(barycentric) {
                if b != 0.0 {
                    each(i, b);
                }
            }
            return;
        }
        let (mut stack, mut heap) = ([0.0; STACK_CORNERS], Vec::new());
        let values = if let Some(values) = stack.get_mut(..face.len()) {
            values
        } else {
            heap.resize(face.len(), 0.0);
            heap.as_mut_slice()
        };
        polygon.values_on(rank, barycentric, values);
        for (&i, &value) in face.iter().zip(values.iter()) {
            if value != 0.0 {
                each(i, value);
            }
        }
    }
}

/// Triangulates a face. Returns triangles as indices of its corners. `diagonal`: diagonal of the cage, object units.
pub fn face_triangles(corners: &[DVec3], diagonal: f64) -> Result<Vec<[u32; 3]>, FaceDefect> {
    Polygon::new(corners, diagonal).map(|polygon| polygon.triangles)
}

/// Checks numbers and indices. Returns the bounds of the vertices that faces use.
fn check_numbers(mesh: &PolygonMesh) -> Result<Bounds, CageError> {
    let n = mesh.positions.len();
    if mesh.faces.is_empty() || n == 0 {
        return Err(CageError::Empty);
    }
    if mesh.faces.len() > MAX_FACES {
        return Err(CageError::TooManyFaces { faces: mesh.faces.len() });
    }
    if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(CageError::NotFinite { vertex: vertex as u32 });
    }
    for (f, face) in mesh.faces.iter().enumerate() {
        let f = f as u32;
        if face.len() < 3 {
            return Err(CageError::TooFewCorners { face: f, corners: face.len() });
        }
        if let Some(&vertex) = face.iter().find(|&&i| i as usize >= n) {
            return Err(CageError::Index { face: f, vertex, n });
        }
    }
    topology::check_repeats(&mesh.faces)?;
    let used: Vec<Vec3> = mesh.faces.iter().flatten().map(|&i| mesh.positions[i as usize]).collect();
    let bounds = Bounds::around(&used).ok_or(CageError::Empty)?;
    // f64, because the square of a length overflows f32 from 1e19 on.
    let diagonal = bounds.max.as_dvec3().distance(bounds.min.as_dvec3());
    if !(MIN_DIAGONAL..=MAX_DIAGONAL).contains(&diagonal) {
        return Err(CageError::Size { diagonal });
    }
    Ok(bounds)
}
