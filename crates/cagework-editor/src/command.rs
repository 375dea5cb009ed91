//! Commands that change a document. They are data, so panels, scripts and tests use the same interface.

use std::sync::Arc;

use cagework_core::{InnerElement, PolygonMesh};
use cagework_io::{Interpolation, MAX_SECONDS, MIN_GAP, SECONDS_PER_POSE, TimelineError, check_times};
use cagework_pose::blend::reblend;
#[cfg(feature = "typescript")]
use cagework_pose::humanoid::Bone;
use cagework_pose::proportions::Proportions;
use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::controls::{CageControls, InnerKind, RestCage};
use crate::document::{NamedPose, Transition};
use crate::edit::SelectMode;
use crate::editor::Editor;
use crate::error::EditError;
use crate::models::PartOptions;
use crate::rest_edit::{CageEdit, collapse_edge, delete_faces, extrude_faces, split_edge};
use crate::surface::SurfacePoint;

/// Distance of an extrusion, as a fraction of the diagonal of model and cage.
const EXTRUSION: f32 = 0.08;
/// Number of sizes that are tried for a sheet, each 4/5 of the previous one.
const SHEET_SIZES: i32 = 16;

/// An edit of the selected elements of the cage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum RestEdit {
    /// Inserts a vertex at the middle of each selected edge.
    SplitEdge,
    /// Merges the two ends of the first selected edge.
    CollapseEdge,
    /// Extrudes selected faces outwards.
    ExtrudeFace,
    /// Removes selected vertices and closes the holes. If inner controls are selected, removes only those.
    DeleteVertex,
    /// Removes selected faces and closes the holes.
    DeleteFace,
}

/// A change of the document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Command {
    /// Moves the cage's vertices and inner controls.
    SetPose {
        /// Positions of cage vertices, then of inner controls, object units. `[n_controls]`
        #[cfg_attr(feature = "typescript", ts(type = "readonly (readonly [number, number, number])[]"))]
        positions: Vec<Vec3>,
    },
    /// Moves the cage to its rest position.
    ResetPose,
    /// Sets the factor of a proportion of the humanoid that the models form. Displaces the pose by the difference to the
    /// previous factor.
    SetProportion {
        /// Name of the proportion, such as "leg" for both sides or "left_leg" for one.
        name: String,
        /// Factor, 0.5 to 2; 1 keeps the length at rest.
        factor: f64,
    },
    /// Sets the factors of a preset, or all to 1. A preset of one factor keeps the others.
    SetPreset {
        /// Name of the preset; null sets all factors to 1.
        name: Option<String>,
    },
    /// Gives the right side the factors of the left side.
    MirrorProportions,
    /// Names the joint of a humanoid bone.
    SetBone {
        /// Name of the bone.
        #[cfg_attr(feature = "typescript", ts(as = "Bone"))]
        bone: String,
        /// Name of the joint; null takes the joint that the file's data, names or shape tell.
        joint: Option<String>,
    },
    /// Saves the pose under a name.
    SavePose {
        /// Name of the new saved pose.
        name: String,
    },
    /// Moves the cage to a saved pose, with its pins.
    ApplyPose {
        /// Index of the pose in the list of saved poses.
        index: usize,
    },
    /// Gives a saved pose another name.
    RenamePose {
        /// Index of the pose in the list of saved poses.
        index: usize,
        /// New name of the pose.
        name: String,
    },
    /// Deletes a saved pose. The animation shows later poses earlier, by the time from the previous pose to the deleted
    /// one.
    RemovePose {
        /// Index of the pose in the list of saved poses.
        index: usize,
    },
    /// Replaces a saved pose, with its pins, by the current pose.
    UpdatePose {
        /// Index of the pose in the list of saved poses.
        index: usize,
    },
    /// Copies a saved pose; the copy is the next pose in the list. The animation shows the copy one second after the
    /// pose, and delays later poses by one second.
    DuplicatePose {
        /// Index of the pose in the list of saved poses.
        index: usize,
        /// Name of the copy.
        name: String,
    },
    /// Moves a saved pose to another place in the list. Each place of the list keeps its time: the pose that becomes
    /// first gets the time of the previous first pose, and so on.
    MovePose {
        /// Index of the pose in the list of saved poses.
        index: usize,
        /// New index of the pose in the list.
        to: usize,
    },
    /// Sets when the animation shows a saved pose. Other poses keep their times; the list is sorted by time.
    SetPoseTime {
        /// Index of the pose in the list of saved poses.
        index: usize,
        /// Seconds since the start of the animation.
        seconds: f32,
    },
    /// Sets the interpolation of the animation from the previous pose to a saved pose.
    SetPoseInterpolation {
        /// Index of the pose in the list of saved poses.
        index: usize,
        /// The interpolation; null uses that of the whole animation.
        interpolation: Option<Interpolation>,
    },
    /// Sets how the animation of the saved poses goes from one to the next, and how it ends.
    SetTransition {
        /// Interpolation between the poses, and how the animation ends.
        transition: Transition,
    },
    /// Changes the share of a saved pose in the current pose. The new pose is computed from the pose of the last
    /// history step, so edits of the pose since that step are dropped.
    Blend {
        /// Index of the pose in the list of saved poses.
        index: usize,
        /// New share of the pose, 0 to 1.
        share: f32,
    },
    /// Sets poses that were transferred from another cage of the same models: the current pose, then each saved pose
    /// of that cage.
    CarryPoses {
        /// Identifier of the other cage, as the view of a document gives it.
        from: u32,
        /// Positions of the controls of this cage, concatenated over the poses. `[n_poses, n_controls]`
        #[cfg_attr(feature = "typescript", ts(type = "readonly (readonly [number, number, number])[]"))]
        positions: Vec<Vec3>,
        /// Shares of the saved poses in the current pose.
        shares: Vec<f32>,
    },
    /// Sets the surface points that pulls keep in place.
    SetPins {
        /// Points on the surfaces of the models.
        pins: Vec<SurfacePoint>,
    },
    /// Replaces the cage by another cage, or by a mesh that is not a valid cage yet. The new cage is at rest.
    ReplaceCage {
        /// Positions of the vertices of the new cage, then of its inner controls, and the cage's faces.
        #[cfg_attr(feature = "typescript", ts(type = "unknown"))]
        mesh: PolygonMesh,
        /// Subdivision and inner controls; null keeps the current ones if they fit.
        controls: Option<CageControls>,
        /// Notices of the cage generator about the new cage.
        notices: Vec<String>,
        /// Loops of vertices around the limbs of a generated cage.
        #[serde(default)]
        #[cfg_attr(feature = "typescript", ts(optional, as = "Option<Vec<Vec<u32>>>"))]
        rings: Vec<Vec<u32>>,
    },
    /// Makes the current positions of the cage its rest position. Saved poses keep their displacements from it.
    MoveRest,
    /// Edits the selected elements of the cage, and selects the result. Saved poses keep their displacements; those of
    /// new vertices are the means of the displacements of the vertices that they were made from.
    EditRest {
        /// What to do with the selected elements.
        edit: RestEdit,
    },
    /// Sets how often the cage's surface is subdivided before boundary values are prescribed on it.
    Subdivide {
        /// Number of subdivision steps, 0 to 3.
        steps: u32,
    },
    /// Sets the radius of interior points and lines.
    SetRadius {
        /// Radius, object units; null for 1/32 of the cage's longest side.
        radius: Option<f32>,
    },
    /// Adds an inner control, and selects it.
    AddControl {
        /// A point, a polyline through `places`, or a sheet with corners at `places`.
        kind: InnerKind,
        /// Positions of the corners of the new element, object units.
        #[cfg_attr(feature = "typescript", ts(type = "readonly (readonly [number, number, number])[]"))]
        places: Vec<Vec3>,
    },
    /// Adds a rectangular sheet and selects it. Tries smaller and smaller sheets until one fits in the cage.
    AddSheet {
        /// Centre of the sheet, object units.
        #[cfg_attr(feature = "typescript", ts(type = "readonly [number, number, number]"))]
        center: Vec3,
        /// Half axes of the sheet before it is shrunk: the largest size that is tried is 4/5 of these axes.
        #[cfg_attr(feature = "typescript", ts(type = "readonly (readonly [number, number, number])[]"))]
        axes: [Vec3; 2],
    },
    /// Replaces the inner controls.
    ReplaceControls {
        /// Positions of the new controls, object units. `[n_inner]`
        #[cfg_attr(feature = "typescript", ts(type = "readonly (readonly [number, number, number])[]"))]
        positions: Vec<Vec3>,
        /// Points, lines and faces; indices are relative to `positions`.
        elements: Vec<InnerElement>,
    },
    /// Removes a model from the cage.
    RemoveModel {
        /// Identifier of the model in the document.
        id: u32,
    },
    /// Sets whether a model is visible, and which of its parts are rigid or stay in place.
    SetParts {
        /// Identifier of the model in the document.
        id: u32,
        /// Visibility, and names of the parts that are rigid or stay in place.
        options: PartOptions,
    },
    /// Sets how strongly each vertex of a model stays in place, as the user painted it.
    SetPainted {
        /// Identifier of the model in the document.
        id: u32,
        /// Amounts, 0 (moves with the cage) to 255 (stays in place). `[n_vertices]`, or empty for an unpainted model
        amounts: Vec<u8>,
    },
}

impl Editor {
    /// Changes the document; [`Editor::commit`] adds the change to the history.
    ///
    /// # Errors
    /// If the command cannot be applied. Nothing changes then.
    pub fn apply(&mut self, command: Command) -> Result<(), EditError> {
        // Each arm of the match checks its command before it changes anything.
        match command {
            Command::SetPose { positions } => {
                self.set_pose(positions)?;
                self.document_mut().proportions = Proportions::default();
            }
            Command::ResetPose => self.reset_pose(),
            Command::SetProportion { name, factor } => self.set_proportion(&name, factor)?,
            Command::SetPreset { name: Some(name) } => self.set_preset(&name)?,
            Command::SetPreset { name: None } => self.set_proportions(Proportions::default())?,
            Command::MirrorProportions => self.mirror_proportions()?,
            Command::SetBone { bone, joint } => self.set_bone(bone.parse()?, joint)?,
            Command::SavePose { name } => {
                let pose = self.document().pose.clone();
                let pins = Some(self.document().pins.clone());
                let document = self.document_mut();
                let (cage, proportions) = (Some(document.cage_id), document.proportions);
                // The pose equals the new saved pose, so the share of the new one is 1 and all other shares are 0.
                document.shares = std::iter::repeat_n(0.0, document.poses.len()).chain([1.0]).collect();
                Arc::make_mut(&mut document.poses).push(NamedPose {
                    name: name.into(),
                    positions: pose,
                    cage,
                    pins,
                    lead: SECONDS_PER_POSE,
                    interpolation: None,
                    proportions,
                });
            }
            Command::ApplyPose { index } => {
                let NamedPose { positions, pins, proportions, .. } = self.fitting_pose(index)?.clone();
                self.set_pose(positions.to_vec())?;
                let document = self.document_mut();
                document.proportions = proportions;
                document.shares = only(index, document.poses.len());
                if let Some(pins) = pins {
                    document.pins = pins;
                }
            }
            Command::RenamePose { index, name } => {
                self.pose(index)?;
                Arc::make_mut(&mut self.document_mut().poses)[index].name = name.into();
            }
            Command::RemovePose { index } => {
                self.pose(index)?;
                let document = self.document_mut();
                Arc::make_mut(&mut document.poses).remove(index);
                let shares = document.shares.iter().enumerate().filter(|(k, _)| *k != index);
                document.shares = shares.map(|(_, share)| *share).collect();
            }
            Command::UpdatePose { index } => {
                self.pose(index)?;
                let document = self.document_mut();
                let (positions, pins) = (document.pose.clone(), Some(document.pins.clone()));
                let (cage, proportions) = (Some(document.cage_id), document.proportions);
                let pose = &mut Arc::make_mut(&mut document.poses)[index];
                (pose.positions, pose.cage, pose.pins) = (positions, cage, pins);
                pose.proportions = proportions;
                document.shares = only(index, document.poses.len());
            }
            Command::DuplicatePose { index, name } => {
                let copy =
                    NamedPose { name: name.into(), lead: SECONDS_PER_POSE, ..self.pose(index)?.clone() };
                let document = self.document_mut();
                Arc::make_mut(&mut document.poses).insert(index + 1, copy);
                let mut shares = document.shares.to_vec();
                shares.insert(index + 1, 0.0);
                document.shares = shares.into();
            }
            Command::MovePose { index, to } => {
                self.pose(index)?;
                self.pose(to)?;
                let mut order: Vec<usize> = (0..self.document().poses.len()).collect();
                let moved = order.remove(index);
                order.insert(to, moved);
                let leads: Vec<f32> = self.document().poses.iter().map(|pose| pose.lead).collect();
                self.arrange(&order, &leads);
            }
            Command::SetPoseTime { index, seconds } => self.set_pose_time(index, seconds)?,
            Command::SetPoseInterpolation { index, interpolation } => {
                self.pose(index)?;
                Arc::make_mut(&mut self.document_mut().poses)[index].interpolation = interpolation;
            }
            Command::SetTransition { transition } => {
                if !transition.back.is_finite() {
                    return Err(EditError::NotFinite { what: "seconds" });
                }
                self.document_mut().transition = transition.within_limits();
            }
            Command::Blend { index, share } => self.blend(index, share)?,
            Command::CarryPoses { from, positions, shares } => {
                self.take_carried(from, &positions, &shares)?;
            }
            Command::SetPins { pins } => self.document_mut().pins = pins.into(),
            Command::ReplaceCage { mesh, controls, notices, rings } => {
                let mut cage = match controls {
                    Some(controls) => RestCage::new(mesh, controls)?,
                    None => self.document().cage.replaced(&mesh)?,
                };
                cage.notices.extend(notices);
                if !rings.is_empty() {
                    cage.controls.rings = rings;
                }
                self.set_cage(cage);
                self.document_mut().has_sample_cage = false;
            }
            Command::MoveRest => {
                let document = self.document();
                let mesh = PolygonMesh {
                    positions: document.pose.to_vec(),
                    faces: document.cage.mesh.faces.clone(),
                };
                let cage = RestCage::new(mesh, document.cage.controls.clone())?;
                if let (Ok(_), Err(error)) = (&document.cage.set, &cage.set) {
                    return Err(error.clone().into());
                }
                let selection = self.selection.clone();
                let from: Vec<Vec<u32>> = (0..document.pose.len() as u32).map(|v| vec![v]).collect();
                self.set_reshaped(cage, &from);
                self.selection = selection;
                self.document_mut().has_sample_cage = false;
            }
            Command::EditRest { edit } => self.edit_rest(edit)?,
            Command::Subdivide { steps } => {
                self.change_controls(|now| CageControls { smooth: steps, ..now })?;
            }
            Command::SetRadius { radius } => self.change_controls(|now| CageControls { radius, ..now })?,
            Command::AddControl { kind, places } => {
                self.require_cage()?;
                let cage = self.document().cage.with(kind, &places)?;
                self.add_control(cage);
            }
            Command::AddSheet { center, axes: [right, up] } => {
                self.require_cage()?;
                let sheet = |k: i32| {
                    let size = 0.8_f32.powi(k);
                    let corner = |(x, y): (f32, f32)| center + size * (x * right + y * up);
                    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner);
                    self.document().cage.with(InnerKind::Face, &corners)
                };
                let largest = (1..SHEET_SIZES).find_map(|k| sheet(k).ok());
                let cage = largest.map_or_else(|| sheet(SHEET_SIZES), Ok)?;
                self.add_control(cage);
            }
            Command::ReplaceControls { positions, elements } => {
                let cage = &self.document().cage;
                let mut mesh = cage.mesh.clone();
                mesh.positions.truncate(cage.n_cage());
                mesh.positions.extend(&positions);
                let controls = CageControls { inner: positions.len(), elements, ..cage.controls.clone() };
                let cage = RestCage::new(mesh, controls)?;
                self.set_cage(cage);
            }
            Command::RemoveModel { id } => self.change_models(|models| models.remove(id))?,
            Command::SetParts { id, options } => {
                self.change_parts(|models| models.set_options(id, options))?;
            }
            Command::SetPainted { id, amounts } => {
                self.change_parts(|models| models.set_painted(id, amounts))?;
            }
        }
        Ok(())
    }

    fn pose(&self, index: usize) -> Result<&NamedPose, EditError> {
        let poses = &self.document().poses;
        let missing = EditError::NoSuchPose { number: index + 1, count: poses.len() };
        poses.get(index).ok_or(missing)
    }

    fn fitting_pose(&self, index: usize) -> Result<&NamedPose, EditError> {
        let pose = self.pose(index)?;
        if self.document().fits(pose) { Ok(pose) } else { Err(EditError::OtherCage { number: index + 1 }) }
    }

    /// Replaces the cage by one that was made from it, and keeps the displacements of the saved poses that fit. `from`:
    /// the controls that each control of `cage` was made from; its displacement is the mean of theirs. `[n_controls]`
    fn set_reshaped(&mut self, cage: RestCage, from: &[Vec<u32>]) {
        let before = self.document().clone();
        self.set_cage(cage);
        let document = self.document_mut();
        let rest = &document.cage.mesh.positions;
        if from.len() != rest.len() || before.fitting_poses().next().is_none() {
            return;
        }
        for pose in Arc::make_mut(&mut document.poses).iter_mut().filter(|pose| before.fits(pose)) {
            let at = |(&p, from): (&Vec3, &Vec<u32>)| {
                let moved = from
                    .iter()
                    .map(|&v| v as usize)
                    .map(|v| pose.positions[v] + (p - before.cage.mesh.positions[v]));
                if from.is_empty() { p } else { moved.sum::<Vec3>() / from.len() as f32 }
            };
            pose.positions = rest.iter().zip(from).map(at).collect();
            pose.cage = Some(document.cage_id);
        }
    }

    /// Reorders the saved poses. `order`: old index of each pose; `leads`: time from the previous pose to each pose in
    /// the new order, seconds. `[n_poses]` each
    fn arrange(&mut self, order: &[usize], leads: &[f32]) {
        let document = self.document_mut();
        let of = |(&k, &lead): (&usize, &f32)| NamedPose { lead, ..document.poses[k].clone() };
        let poses = order.iter().zip(leads).map(of).collect();
        document.shares = order.iter().map(|&k| document.shares[k]).collect();
        document.poses = Arc::new(poses);
    }

    fn set_pose_time(&mut self, index: usize, seconds: f32) -> Result<(), EditError> {
        self.fitting_pose(index)?;
        let document = self.document();
        let places: Vec<usize> =
            (0..document.poses.len()).filter(|&k| document.fits(&document.poses[k])).collect();
        let mut timed: Vec<(f32, usize)> =
            document.pose_seconds().into_iter().zip(places.iter().copied()).collect();
        let Some(own) = timed.iter_mut().find(|(_, k)| *k == index) else {
            return Err(EditError::OtherCage { number: index + 1 });
        };
        own.0 = seconds;
        timed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let times: Vec<f32> = timed.iter().map(|(at, _)| *at).collect();
        check_times(&times).map_err(|error| {
            let name = |pose: usize| document.poses[pose].name.to_string();
            let limit = if let TimelineError::Order { number, .. } = error {
                // One of two poses that are too close is this one.
                let (before, after) = (timed[number - 2], timed[number - 1]);
                let (at, pose) = if before.1 == index { after } else { before };
                format!("{} is at {at} s, and poses are at least {MIN_GAP} s apart", name(pose))
            } else {
                format!("times are from 0 to {MAX_SECONDS} s")
            };
            EditError::PoseTime { name: name(index), seconds, limit }
        })?;
        let mut order: Vec<usize> = (0..document.poses.len()).collect();
        let mut leads: Vec<f32> = document.poses.iter().map(|pose| pose.lead).collect();
        let mut before = 0.0;
        for (&place, (at, k)) in places.iter().zip(timed) {
            (order[place], leads[place]) = (k, at - before);
            before = at;
        }
        self.arrange(&order, &leads);
        Ok(())
    }

    fn require_cage(&self) -> Result<(), EditError> {
        if self.document().cage.set.is_ok() { Ok(()) } else { Err(EditError::NoCage) }
    }

    /// Changes the share of a saved pose. Starts from the pose of the last history step, because a slider sends many
    /// shares, each of which replaces the previous one.
    fn blend(&mut self, index: usize, share: f32) -> Result<(), EditError> {
        self.pose(index)?;
        if !share.is_finite() {
            return Err(EditError::NotFinite { what: "shares of a pose" });
        }
        let (document, committed) = (self.document(), self.committed());
        let rest = &document.cage.mesh.positions;
        let mut shares = document.shares.to_vec();
        shares.resize(document.poses.len(), 0.0);
        shares[index] = share;
        let fitting: Vec<usize> =
            (0..document.poses.len()).filter(|&k| document.fits(&document.poses[k])).collect();
        let poses: Vec<Vec<Vec3>> = fitting.iter().map(|&k| document.poses[k].positions.to_vec()).collect();
        let of = |all: &[f32]| -> Vec<f32> {
            fitting.iter().map(|&k| all.get(k).copied().unwrap_or_default()).collect()
        };
        let from = if committed.cage_id == document.cage_id { &committed.pose } else { &document.pose };
        let mixed = reblend(rest, &poses, from, &of(&committed.shares), &of(&shares))?;
        self.set_pose(mixed)?;
        // The blend of factors is not the factor of the blend.
        let document = self.document_mut();
        (document.shares, document.proportions) = (shares.into(), Proportions::default());
        Ok(())
    }

    fn take_carried(&mut self, from: u32, positions: &[Vec3], shares: &[f32]) -> Result<(), EditError> {
        let n = self.document().cage.mesh.positions.len();
        let mut carried = positions.chunks_exact(n.max(1));
        let pose = carried.next().map(<[Vec3]>::to_vec).unwrap_or_default();
        self.set_pose(pose)?;
        let proportions = self.proportions_with(from);
        let document = self.document_mut();
        document.proportions = proportions;
        let cage = Some(document.cage_id);
        for pose in Arc::make_mut(&mut document.poses).iter_mut().filter(|pose| pose.cage == Some(from)) {
            if let Some(carried) = carried.next() {
                (pose.positions, pose.cage) = (carried.into(), cage);
            }
        }
        if shares.len() == document.poses.len() {
            document.shares = shares.into();
        }
        Ok(())
    }

    /// Replaces the controls of the cage; keeps the pose.
    fn change_controls(
        &mut self,
        change: impl FnOnce(CageControls) -> CageControls,
    ) -> Result<(), EditError> {
        let (cage, pose) = (&self.document().cage, self.document().pose.clone());
        let cage = RestCage::new(cage.mesh.clone(), change(cage.controls.clone()))?;
        let (shares, proportions) = (self.document().shares.clone(), self.document().proportions);
        self.set_cage(cage);
        self.set_pose(pose.to_vec())?;
        let document = self.document_mut();
        (document.shares, document.proportions) = (shares, proportions);
        Ok(())
    }

    /// Replaces the cage by `cage`, which has one more inner control, and selects this control.
    fn add_control(&mut self, cage: RestCage) {
        let first = cage.n_cage() as u32;
        let corners = cage.controls.elements.last().map(|element| element.corners().to_vec());
        self.set_cage(cage);
        let corners: Vec<u32> = corners.unwrap_or_default().iter().map(|&i| first + i).collect();
        self.selection.change(&corners, SelectMode::Replace);
    }

    fn edit_rest(&mut self, edit: RestEdit) -> Result<(), EditError> {
        let cage = &self.document().cage;
        let inner: Vec<u32> =
            self.selection.vertices().into_iter().filter(|&v| v as usize >= cage.n_cage()).collect();
        if edit == RestEdit::DeleteVertex && !inner.is_empty() {
            let without = cage.without(&inner)?;
            self.set_cage(without);
            return Ok(());
        }
        let n_cage = cage.n_cage() as u32;
        let CageEdit { mesh, vertex_of, made_from, touched } = self.edited(edit)?;
        let replaced = cage.replaced(&mesh)?;
        let first_new = mesh.positions.len() - made_from.len();
        let mut from = vec![Vec::new(); first_new];
        for (old, new) in (0..n_cage).zip(vertex_of).filter_map(|(old, new)| Some((old, new?))) {
            if let Some(from) = from.get_mut(new as usize) {
                from.push(old);
            }
        }
        from.extend(made_from.into_iter().map(Vec::from));
        if replaced.controls.inner == cage.controls.inner {
            from.extend((n_cage..cage.mesh.positions.len() as u32).map(|control| vec![control]));
        }
        self.set_reshaped(replaced, &from);
        self.document_mut().has_sample_cage = false;
        self.selection.change(&touched, SelectMode::Replace);
        Ok(())
    }

    /// The faces whose corners are the mirror images of the corners of `faces`.
    fn mirror_images(&self, faces: &[u32]) -> Vec<u32> {
        let all = &self.topology().faces;
        let image = |&face: &u32| {
            let corners: Option<Vec<u32>> =
                all[face as usize].iter().map(|&i| self.symmetry().partner(i)).collect();
            let corners = corners?;
            let is_image =
                |face: &Vec<u32>| face.len() == corners.len() && face.iter().all(|i| corners.contains(i));
            all.iter().position(is_image).map(|face| face as u32)
        };
        faces.iter().filter_map(image).collect()
    }

    fn edited(&self, edit: RestEdit) -> Result<CageEdit, EditError> {
        let mesh = self.cage_as_shown();
        let topology = self.topology();
        let (mut edges, faces) = (self.selection.edges(topology), self.selection.faces(topology));
        edges.retain(|edge| edge.iter().all(|&i| (i as usize) < mesh.positions.len()));
        let edge = EditError::NothingSelected { what: "an edge, or both its ends," };
        let face = EditError::NothingSelected { what: "a face, or all its corners," };
        Ok(match edit {
            RestEdit::SplitEdge => {
                each(&mesh, &edges, |mesh, &edge| split_edge(mesh, edge, 0.5))?.ok_or(edge)?
            }
            // A collapse moves vertices of adjacent edges, so only the first edge is collapsed.
            RestEdit::CollapseEdge => collapse_edge(&mesh, *edges.first().ok_or(edge)?, 0.5)?,
            RestEdit::ExtrudeFace | RestEdit::DeleteFace if faces.is_empty() => return Err(face),
            RestEdit::ExtrudeFace => {
                let distance = EXTRUSION * self.bounds().map_or(1.0, |b| b.diagonal());
                let images = if self.tools().symmetry { self.mirror_images(&faces) } else { Vec::new() };
                extrude_faces(&mesh, &[faces, images].concat(), distance)?
            }
            RestEdit::DeleteFace => delete_faces(&mesh, &faces)?,
            RestEdit::DeleteVertex if self.selection.is_empty() => {
                return Err(EditError::NothingSelected { what: "a vertex" });
            }
            RestEdit::DeleteVertex => {
                let around =
                    |f: &u32| topology.faces[*f as usize].iter().any(|&i| self.selection.contains(i));
                let faces: Vec<u32> = (0..topology.faces.len() as u32).filter(around).collect();
                delete_faces(&mesh, &faces)?
            }
        })
    }
}

/// Shares of a pose that equals the saved pose `index`: 1 for this pose and 0 for all others. `[n_poses]`
fn only(index: usize, n_poses: usize) -> Arc<[f32]> {
    (0..n_poses).map(|k| f32::from(u8::from(k == index))).collect()
}

/// Applies an edit to one item after another; `None` if `items` is empty. The edit must keep the indices of all
/// vertices and of later items.
fn each<T, E>(
    mesh: &PolygonMesh,
    items: &[T],
    edit: impl Fn(&PolygonMesh, &T) -> Result<CageEdit, E>,
) -> Result<Option<CageEdit>, E> {
    let mut all: Option<CageEdit> = None;
    for item in items {
        let mut next = edit(all.as_ref().map_or(mesh, |e| &e.mesh), item)?;
        if let Some(before) = all {
            next.touched.splice(0..0, before.touched);
            next.made_from.splice(0..0, before.made_from);
        }
        all = Some(next);
    }
    Ok(all)
}
