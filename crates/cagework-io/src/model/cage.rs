//! A model as a cage, and poses of that cage.

use cagework_core::PolygonMesh;
use cagework_core::mesh::weld;
use glam::Vec3;

use super::{Document, Model};
use crate::error::PoseError;
use crate::format::ModelFormat;

impl Model {
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
    /// [`PoseError`] when the numbers of vertices do not agree, or the pose's faces say that they are in another order.
    pub fn pose_positions(&self, pose: &Self) -> Result<Vec<Vec3>, PoseError> {
        let is_welded = matches!(self.document, Document::Gltf(_));
        let (n, given) = (self.positions.len(), pose.positions.len());
        let first = if is_welded { weld(&self.positions).first } else { (0..n as u32).collect() };
        let is_unwelded = given == n;
        if !is_unwelded && given != first.len() {
            let (pose, cage) = (pose.name.clone(), self.name.clone());
            return Err(PoseError::Count { pose, given, cage, expected: first.len() });
        }
        let faces = if is_welded && is_unwelded {
            self.triangles.iter().map(|t| t.to_vec()).collect()
        } else {
            self.cage_mesh().faces
        };
        if let Some(edge) = foreign_edge(&faces, &pose.triangles, given) {
            return Err(PoseError::Order { pose: pose.name.clone(), edge, cage: self.name.clone() });
        }
        Ok(if is_unwelded {
            first.iter().map(|&v| pose.positions[v as usize]).collect()
        } else {
            pose.positions.clone()
        })
    }

    /// Whether a pose of this model as a cage that is written in `format` has its vertices in this model's order when it is read again.
    #[must_use]
    pub fn keeps_order_in(&self, format: ModelFormat) -> bool {
        match format {
            ModelFormat::Obj | ModelFormat::Ply => true,
            // Their vertices are in the order of faces.
            ModelFormat::Gltf | ModelFormat::Stl => self.format == format,
        }
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
}

/// An edge of `triangles` whose ends are corners of no face together. `n`: vertices of both
fn foreign_edge(faces: &[Vec<u32>], triangles: &[[u32; 3]], n: usize) -> Option<[u32; 2]> {
    // Ascending.
    let mut faces_of = vec![Vec::new(); n];
    for (face, corners) in faces.iter().enumerate() {
        corners.iter().for_each(|&v| faces_of[v as usize].push(face));
    }
    let is_known = |[a, b]: [u32; 2]| {
        let [a, b] = [&faces_of[a as usize], &faces_of[b as usize]];
        a.iter().any(|face| b.binary_search(face).is_ok())
    };
    let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    edges.into_iter().find(|&[a, b]| a != b && !is_known([a, b]))
}
