//! Weights of the models in a cage, and what follows from them: deformed vertices, displacements and fields.

use std::cell::{OnceCell, RefCell};
use std::sync::Arc;

use cagework_core::deform::{OutsideVertex, deform_bound, displacements};
use cagework_core::field::{Field, FieldWeights};
use cagework_core::{Frames, Weights};
use cagework_io::{Ground, Model, ReadError, WriteError};
use cagework_job::{Follow, JobError};
use cagework_pose::parts::{BoundParts, Parts};
use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::document::Document;
use crate::editor::Editor;
use crate::error::EditError;
use crate::joints::JointDots;
use crate::options::RigOptions;
use crate::surface::SurfacePoint;

/// Reason why bound models cannot be deformed or exported.
#[derive(Debug, Error)]
pub enum BoundError {
    /// Something does not exist yet.
    #[error("there is no {what} yet: {how}")]
    Missing {
        /// What is missing, such as "cage".
        what: &'static str,
        /// What to do first.
        how: &'static str,
    },
    /// A pose has another number of positions than the cage.
    #[error("a pose belongs to another cage")]
    OtherCage,
    /// A file of clips also contains a model.
    #[error("{name} has a mesh: open it as a model")]
    HasMesh {
        /// Name of the file.
        name: String,
    },
    /// Splats and points cannot be exported in this way.
    #[error("splats and points have neither morph targets nor weights: export them as PLY")]
    Capture,
    /// The document does not allow it.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// A file of clips cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file cannot be written, or a rig cannot be read.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A model cannot be deformed in this way.
    #[error(transparent)]
    Job(#[from] JobError),
}

/// Weights of all models in a cage.
pub struct BoundModels {
    /// Weights of the models' vertices.
    pub weights: Arc<Weights>,
    /// Frames that the columns after those of the controls refer to.
    pub frames: Arc<Frames>,
    /// Weights of the points of the models' rigs; `None` if there are none.
    pub rig: Option<Weights>,
    /// Vertices outside the cage, then points of rigs outside the cage. The indices of rig points start after the last
    /// vertex.
    pub outside: Vec<OutsideVertex>,
    /// Joints of the rigs; `None` if a rig cannot be read.
    pub joints: Option<JointDots>,
}

impl BoundModels {
    /// Splits the weights of a document's vertices and of the points of its rigs, in this order.
    #[must_use]
    pub fn new(document: &Document, all: Weights, frames: Frames, outside: Vec<OutsideVertex>) -> Self {
        let (n, n_vertices) = (all.n_rows(), document.models.positions().len());
        let (weights, rig) = if n <= n_vertices {
            (all, None)
        } else {
            (all.row_range(0..n_vertices), Some(all.row_range(n_vertices..n)))
        };
        let joints = rig.as_ref().and_then(|weights| {
            let of_rig = outside.iter().filter_map(|o| o.vertex.checked_sub(n_vertices as u32));
            let of_rig: Vec<u32> = of_rig.collect();
            // A rig with errors gets no joint marks here; the export reports the errors.
            JointDots::new(&document.models, weights, frames.clone(), &of_rig).ok()
        });
        Self { weights: Arc::new(weights), frames: Arc::new(frames), rig, outside, joints }
    }

    /// Control whose weight a picture shows best: its squared weights have the largest sum over the vertices on the near
    /// side of the models' centre. `positions`: of the vertices, object units; `backward`: unit vector towards the eye.
    /// 0 without such vertices.
    #[must_use]
    pub fn clearest_control(&self, positions: &[Vec3], backward: Vec3, n_controls: usize) -> u32 {
        let centre = positions.iter().sum::<Vec3>() / positions.len().max(1) as f32;
        let mut sums = vec![0.0; n_controls];
        for (v, at) in positions.iter().enumerate().take(self.weights.n_rows()) {
            if (*at - centre).dot(backward) <= 0.0 {
                continue;
            }
            let (columns, weights) = self.weights.row(v);
            for (&column, weight) in columns.iter().zip(weights) {
                if let Some(sum) = sums.get_mut(column as usize) {
                    *sum += weight * weight;
                }
            }
        }
        let clearest = sums.iter().enumerate().rev().max_by(|a, b| a.1.total_cmp(b.1));
        clearest.map_or(0, |(control, _)| control as u32)
    }

    /// Size of the weights, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.weights.bytes() + self.rig.as_ref().map_or(0, Weights::bytes)
    }
}

/// Lowest points of several models in the current pose, with the weights and options that they were computed with.
pub type KnownGround = RefCell<Option<(Arc<BoundModels>, RigOptions, Ground)>>;

/// A document, and the weights by which its models follow the cage.
#[derive(Clone, Copy)]
pub struct BoundDocument<'a> {
    /// Models, cage and poses.
    pub editor: &'a Editor,
    /// Weights of the models; `None` before a bind.
    pub bound: Option<&'a Arc<BoundModels>>,
    /// Parts that stay in place or are rigid; `None` if all vertices follow the cage.
    pub parts: Option<&'a BoundParts>,
    /// Weights on a lattice around the cage. They deform splats, and models that a clip moves.
    pub lattice: Option<&'a FieldWeights>,
    /// Cached lowest points.
    pub ground: &'a KnownGround,
}

impl<'a> BoundDocument<'a> {
    pub(crate) fn document(&self) -> &'a Document {
        self.editor.document()
    }

    /// The weights of the models.
    ///
    /// # Errors
    /// Before a bind.
    pub fn require_bound(&self) -> Result<&'a Arc<BoundModels>, BoundError> {
        self.bound.ok_or(BoundError::Missing { what: "weights", how: "bind the model first" })
    }

    pub(crate) fn rest(&self) -> &'a [Vec3] {
        &self.document().cage.mesh.positions
    }

    /// Computes the vertices of all models in a pose of the cage; their rest positions before a bind. `[n_vertices]`
    ///
    /// # Errors
    /// If the pose belongs to another cage.
    pub fn deformed(&self, pose: &[Vec3]) -> Result<Vec<Vec3>, BoundError> {
        // At rest, return the vertices unchanged: weighted sums would add rounding errors.
        let bound = self.bound.filter(|_| pose != self.rest());
        let Some(bound) = bound else { return Ok(self.document().models.positions().to_vec()) };
        if !fits(bound, pose) {
            return Err(BoundError::OtherCage);
        }
        let mut positions = deform_bound(&bound.weights, &bound.frames, pose);
        if let Some(parts) = self.parts {
            parts.hold(pose, &mut positions);
        }
        Ok(positions)
    }

    /// Positions of surface points in the current pose, if every vertex follows the cage. Empty before a bind; omits
    /// points whose model was removed.
    #[must_use]
    pub fn followed(&self, points: &[SurfacePoint]) -> Vec<Vec3> {
        let pose = &*self.document().pose;
        let Some(bound) = self.bound.filter(|bound| !points.is_empty() && fits(bound, pose)) else {
            return Vec::new();
        };
        let posed = bound.frames.columns(pose);
        let place = |point: &SurfacePoint| {
            let corners = self.document().models.corners(point.triangle)?;
            let follow = |v: u32| -> Vec3 {
                let (columns, values) = bound.weights.row(v as usize);
                columns.iter().zip(values).map(|(&c, &w)| w * posed[c as usize]).sum()
            };
            Some(corners.iter().zip(point.bary).map(|(&v, share)| share * follow(v)).sum())
        };
        points.iter().filter_map(place).collect()
    }

    /// Height by which exports with the option `ground` lift the models in the current pose at rest, object units.
    ///
    /// # Errors
    /// If a rig cannot be read.
    pub fn lift(&self) -> Result<f32, BoundError> {
        let pose = &self.document().pose;
        let (posed, mut all) = (self.deformed(pose)?, Ground::default());
        for member in self.document().models.iter() {
            all.add(if member.model.is_rigged() {
                let by = MovedModel::new(*self, member.id, None).displacements(&member.model, pose)?;
                member.model.ground_of_rig(&by, &member.parts()?)?
            } else {
                member.model.ground(member.share(&posed))
            });
        }
        Ok(all.lift() as f32)
    }

    /// Computes the field that deforms the splats of a capture; `None` at rest and without a lattice.
    #[must_use]
    pub fn field_of_splats(&self) -> Option<Field> {
        let is_posed = !self.editor.is_editing_rest() && self.document().is_posed();
        if is_posed { self.field().ok() } else { None }
    }

    /// Computes the displacement field of the posed cage.
    ///
    /// # Errors
    /// If the lattice is not available.
    pub fn field(&self) -> Result<Field, BoundError> {
        let missing = BoundError::Missing { what: "lattice", how: "bind it first" };
        Ok(self.lattice.ok_or(missing)?.pose(self.rest(), &self.document().pose))
    }

    /// Copies the weights of one model.
    pub(crate) fn rows(&self, id: u32, bound: &'a BoundModels) -> Result<ModelRows<'a>, BoundError> {
        let models = &self.document().models;
        let BoundModels { weights: all, frames, .. } = bound;
        let n = models.positions().len();
        let (own, of_rig) = (models.get(id)?.vertices.clone(), models.extra_of(id)?);
        let rig = match &bound.rig {
            Some(rows) => rows.row_range(of_rig.clone()),
            None => Weights::with_room(all.n_columns() as u32, 0, 0),
        };
        let numbered = |o: &OutsideVertex| {
            let v = o.vertex as usize;
            let in_own = own.contains(&v).then(|| v - own.start);
            let in_rig =
                || v.checked_sub(n).filter(|v| of_rig.contains(v)).map(|v| v - of_rig.start + own.len());
            in_own.or_else(in_rig).map(|v| OutsideVertex { vertex: v as u32, ..*o })
        };
        let outside = bound.outside.iter().filter_map(numbered).collect();
        Ok(ModelRows { weights: all.row_range(own.clone()), frames, outside, rig })
    }
}

fn fits(bound: &BoundModels, pose: &[Vec3]) -> bool {
    pose.len() + bound.frames.n_columns() == bound.weights.n_columns()
}

/// Weights of one model: rows of its vertices, and rows of its rig's points. Indices of points are relative to the
/// model.
pub(crate) struct ModelRows<'a> {
    pub(crate) weights: Weights,
    pub(crate) frames: &'a Frames,
    /// Points outside the cage. Indices of the rig's points follow the indices of the vertices.
    pub(crate) outside: Vec<OutsideVertex>,
    pub(crate) rig: Weights,
}

/// One model of a document, and how it follows the cage. Before a bind, its points stay.
pub(crate) struct MovedModel<'a> {
    all: BoundDocument<'a>,
    id: u32,
    /// Rows of the model, copied when they are first needed; `None` before a bind.
    rows: OnceCell<Option<ModelRows<'a>>>,
    /// Vertices of all models that are exported instead of those in a pose. `[n_vertices]`
    shown: Option<Vec<Vec3>>,
}

impl<'a> MovedModel<'a> {
    /// `shown`: vertices of all models that are exported instead of those in a pose, such as a frame of a clip.
    pub(crate) fn new(all: BoundDocument<'a>, id: u32, shown: Option<Vec<Vec3>>) -> Self {
        Self { all, id, rows: OnceCell::new(), shown }
    }

    fn rows(&self) -> Result<Option<&ModelRows<'a>>, BoundError> {
        if self.rows.get().is_none() {
            let rows = self.all.bound.map(|bound| self.all.rows(self.id, bound)).transpose()?;
            // Cannot fail: the cell is empty.
            let _ = self.rows.set(rows);
        }
        Ok(self.rows.get().and_then(Option::as_ref))
    }
}

impl Follow for MovedModel<'_> {
    type Error = BoundError;

    fn displacements(&self, model: &Model, pose: &[Vec3]) -> Result<Vec<DVec3>, BoundError> {
        let rest = self.all.rest();
        match self.rows()? {
            Some(ModelRows { weights, frames, rig, .. }) if pose.len() == rest.len() => {
                let mut by = displacements(weights, frames, rest, pose);
                by.extend(displacements(rig, frames, rest, pose));
                Ok(by)
            }
            Some(_) => Err(BoundError::OtherCage),
            None => Ok(vec![DVec3::ZERO; model.positions.len() + model.extra_points()?.len()]),
        }
    }

    fn vertices(&self, _: &Model, pose: &[Vec3], _: &Parts) -> Result<Vec<Vec3>, BoundError> {
        let member = self.all.document().models.get(self.id)?;
        match &self.shown {
            Some(shown) => Ok(member.share(shown).to_vec()),
            None => Ok(member.share(&self.all.deformed(pose)?).to_vec()),
        }
    }

    fn field(&self, pose: &[Vec3]) -> Result<Option<Field>, BoundError> {
        if pose == self.all.rest() {
            return Ok(None);
        }
        let how = "wait until the space around the cage is bound";
        let lattice = self.all.lattice.ok_or(BoundError::Missing { what: "lattice", how })?;
        Ok(Some(lattice.pose(self.all.rest(), pose)))
    }

    fn outside(&self) -> Result<Vec<u32>, BoundError> {
        Ok(self.rows()?.into_iter().flat_map(|rows| &rows.outside).map(|o| o.vertex).collect())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use cagework_core::subdivided_box;
    use cagework_io::ModelFormat;
    use cagework_pose::parts::Parts;

    use super::*;
    use crate::playback::Playback;
    use crate::{Command, Contents};

    /// An editor with a tetrahedron in a box of eight vertices, whose margin is a tenth of the tetrahedron's size.
    pub(crate) fn boxed() -> Editor {
        let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
        let mut editor = Editor::default();
        editor.open([(Model::read("a.obj", text, &mut |_| None).unwrap(), None)], Contents::default());
        let mesh = subdivided_box(editor.bounds().unwrap(), 0.1, [1; 3]);
        editor
            .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
            .unwrap();
        editor
    }

    /// Weights 1 of the control with the number of each vertex.
    pub(crate) fn bound_to_corners(editor: &Editor) -> Arc<BoundModels> {
        let rows = Weights::new(8, (0..=4).collect(), (0..4).collect(), vec![1.0; 4]).unwrap();
        Arc::new(BoundModels::new(editor.document(), rows, Frames::default(), Vec::new()))
    }

    /// Calls a function with an editor and its weights.
    pub(crate) fn with<T>(
        editor: &Editor,
        bound: Option<&Arc<BoundModels>>,
        parts: Option<&BoundParts>,
        call: impl FnOnce(BoundDocument<'_>) -> T,
    ) -> T {
        let ground = KnownGround::default();
        call(BoundDocument { editor, bound, parts, lattice: None, ground: &ground })
    }

    fn pose_by(editor: &mut Editor, by: Vec3) {
        editor.set_pose(editor.document().pose.iter().map(|p| *p + by).collect()).unwrap();
    }

    #[test]
    fn deformed_vertices_follow_their_weights_except_parts_that_stay() {
        let editor = boxed();
        let rest = editor.document().models.positions();
        let pose: Vec<Vec3> = editor.document().pose.iter().map(|p| *p + Vec3::X).collect();
        assert_eq!(with(&editor, None, None, |all| all.deformed(&pose)).unwrap(), rest, "before a bind");
        let bound = bound_to_corners(&editor);
        let parts = Parts { stays: vec![0.0, 1.0, 0.0, 0.0], ..Parts::default() };
        let cage = &editor.document().cage.mesh.positions;
        let held = BoundParts::new(&parts, rest, &bound.weights, &bound.frames, cage);
        let deformed = |pose: &[Vec3]| with(&editor, Some(&bound), Some(&held), |all| all.deformed(pose));
        assert_eq!(deformed(&pose).unwrap(), [pose[0], rest[1], pose[2], pose[3]]);
        assert_eq!(deformed(cage).unwrap(), rest);
        assert!(matches!(deformed(&pose[1..]), Err(BoundError::OtherCage)));
    }

    /// Two vertices follow control 5, one follows control 2, and the vertex at the far side follows control 7.
    #[test]
    fn the_clearest_control_moves_most_of_the_near_side() {
        let editor = boxed();
        let rows = Weights::new(8, (0..=4).collect(), vec![2, 5, 5, 7], vec![1.0; 4]).unwrap();
        let bound = BoundModels::new(editor.document(), rows, Frames::default(), Vec::new());
        let at = [Vec3::X, Vec3::X, Vec3::X, -9.0 * Vec3::X];
        assert_eq!(bound.clearest_control(&at, Vec3::X, 8), 5);
        assert_eq!(bound.clearest_control(&at, -Vec3::X, 8), 7, "seen from behind");
        assert_eq!(bound.clearest_control(&[], Vec3::X, 8), 0, "without vertices");
    }

    /// Vertex 1 of the model is outside the cage, at a constant offset of 0.5 in x from the cage's first vertex.
    /// The offset is an entry of the first of the six columns that follow those of the eight vertices.
    #[test]
    fn surface_points_follow_the_offsets_of_points_outside() {
        let editor = boxed();
        let models = &editor.document().models;
        let bary = models.triangles()[0].map(|v| f32::from(u8::from(v == 1)));
        let points = [SurfacePoint { triangle: models.number_of(0), bary }];
        assert!(with(&editor, None, None, |all| all.followed(&points)).is_empty(), "before a bind");
        let rows = Weights::new(14, vec![0, 1, 3, 4, 5], vec![0, 0, 8, 0, 0], vec![1.0, 1.0, 0.5, 1.0, 1.0]);
        let frames = Frames::of_cage(&editor.document().pose);
        let bound = Arc::new(BoundModels::new(editor.document(), rows.unwrap(), frames, Vec::new()));
        let at = editor.document().pose[0] + Vec3::new(0.5, 0.0, 0.0);
        assert_eq!(with(&editor, Some(&bound), None, |all| all.followed(&points)), [at]);
    }

    #[test]
    fn exports_and_playback_contain_the_posed_shape() {
        let mut editor = boxed();
        let bound = bound_to_corners(&editor);
        pose_by(&mut editor, Vec3::Y);
        let export = |all: BoundDocument<'_>| all.shape(0, ModelFormat::Obj, None).unwrap().bytes;
        let obj = with(&editor, Some(&bound), None, export);
        let read = Model::read("b.obj", &obj, &mut |_| None).unwrap();
        let corners = &editor.document().pose[..4];
        assert_eq!(read.positions, corners);
        let playback = with(&editor, Some(&bound), None, |all| Playback::new(all, RigOptions::default()));
        let playback = playback.unwrap();
        assert_eq!(playback.positions(), corners);
        pose_by(&mut editor, Vec3::Z);
        assert!(playback.is_stale(&editor));
        let current = with(&editor, Some(&bound), None, |all| playback.current_positions(all)).unwrap();
        assert_eq!(current, editor.document().pose[..4]);
        let weights = with(&editor, None, None, |all| all.weights(0)).unwrap_err();
        assert_eq!(weights.to_string(), "there is no weights yet: bind the model first");
    }
}
