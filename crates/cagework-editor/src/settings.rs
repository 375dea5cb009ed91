//! Settings of a document in a project. The project file itself stores models, cage and saved poses.

use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use cagework_core::PolygonMesh;
use cagework_io::{Interpolation, MAX_SECONDS, SECONDS_PER_POSE, position_bytes, positions_of};
use cagework_pose::humanoid::Bone;
use cagework_pose::proportions::Proportions;
use glam::Vec3;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::controls::{CageControls, RestCage};
use crate::document::{Document, NamedPose, Transition, cage_id};
use crate::models::MemberSettings;
use crate::surface::SurfacePoint;

/// Settings of a document in a project.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DocumentSettings {
    /// Identifier of the built-in sample that the cage belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample: Option<String>,
    /// Subdivision and inner controls. The last positions of the project's cage mesh are those of the controls.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controls: Option<CageControls>,
    /// The pose in the axes of the model's file: [`cagework_io::position_bytes`] in URL-safe base 64. Null
    /// at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<String>,
    /// Factors of the proportions that the pose contains.
    #[serde(skip_serializing_if = "is_unscaled")]
    pub proportions: Proportions,
    /// Humanoid bones, and the names of the joints that the user has given them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bones: Vec<(String, String)>,
    /// Pinned surface points, which stay in place when the user pulls others.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pins: Vec<SurfacePoint>,
    /// Settings of the saved poses, in the order of the project's poses. Poses beyond the list have default settings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub saved_poses: Vec<PoseSettings>,
    /// How the animation of the saved poses goes from one to the next, and how it ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transition: Option<Transition>,
    /// Visibility, rigid parts and fixed areas of each model.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<MemberSettings>,
}

/// What a project stores of a saved pose, beside its name and positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PoseSettings {
    /// Factors of the proportions that the pose contains.
    #[serde(skip_serializing_if = "is_unscaled")]
    pub proportions: Proportions,
    /// Pinned surface points; null if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pins: Option<Vec<SurfacePoint>>,
    /// Whether the pose was saved for another cage than that of the project, with as many controls.
    pub other_cage: bool,
    /// Share of the pose in the current pose, 0 to 1.
    pub share: f32,
    /// Time from the previous pose to this one, seconds.
    pub lead: f32,
    /// Interpolation towards the pose; null uses that of [`DocumentSettings::transition`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<Interpolation>,
}

impl Default for PoseSettings {
    fn default() -> Self {
        Self {
            proportions: Proportions::default(),
            pins: None,
            other_cage: false,
            share: 0.0,
            lead: SECONDS_PER_POSE,
            interpolation: None,
        }
    }
}

impl DocumentSettings {
    /// Collects the settings of a document, as a project stores them.
    #[must_use]
    pub fn from_document(document: &Document) -> Self {
        let Document { cage, poses, shares, transition, pins, sample, has_sample_cage, models, .. } =
            document;
        let in_file = models.up().turned_back(&document.pose);
        let pose_is_stored = document.is_posed();
        let pose = pose_is_stored.then(|| URL_SAFE_NO_PAD.encode(position_bytes(&in_file)));
        let n_controls = cage.mesh.positions.len();
        let of_pose = |(k, pose): (usize, &NamedPose)| PoseSettings {
            proportions: pose.proportions,
            pins: pose.pins.as_ref().map(|pins| pins.to_vec()),
            other_cage: pose.positions.len() == n_controls && !document.fits(pose),
            share: shares.get(k).copied().filter(|_| pose_is_stored).unwrap_or_default(),
            lead: pose.lead,
            interpolation: pose.interpolation,
        };
        let mut saved_poses: Vec<_> = poses.iter().enumerate().map(of_pose).collect();
        if saved_poses.iter().all(|pose| *pose == PoseSettings::default()) {
            saved_poses.clear();
        }
        Self {
            sample: sample.as_deref().filter(|_| *has_sample_cage).map(str::to_owned),
            controls: (cage.controls != CageControls::default()).then(|| cage.controls.clone()),
            pose,
            proportions: document.proportions,
            bones: models
                .given_bones()
                .iter()
                .map(|(bone, joint)| (bone.to_string(), joint.clone()))
                .collect(),
            pins: pins.to_vec(),
            saved_poses,
            transition: (*transition != Transition::default()).then(|| transition.clone()),
            models: models.settings(),
        }
    }

    /// Reads the settings of a project; skips fields that cannot be read.
    #[must_use]
    pub fn read(text: &str) -> Self {
        let mut given: Value = serde_json::from_str(text).unwrap_or_default();
        if let Some(Value::Array(poses)) = given.get_mut("saved_poses") {
            for pose in poses {
                let mut own: PoseSettings = readable(pose.take());
                own.share = own.share.clamp(0.0, 1.0);
                own.lead = own.lead.clamp(0.0, MAX_SECONDS);
                *pose = json!(own);
            }
        }
        let mut settings: Self = readable(given);
        settings.transition = settings.transition.map(Transition::within_limits);
        settings
    }

    /// Share of each saved pose in the current pose, 0 to 1.
    #[must_use]
    pub fn shares(&self) -> Vec<f32> {
        self.saved_poses.iter().map(|pose| pose.share).collect()
    }

    /// Adds these settings to `others`, a JSON object, and replaces fields of the same name. Returns JSON text.
    #[must_use]
    pub fn beside(&self, others: &str) -> String {
        let mut all: Map<String, Value> = serde_json::from_str(others).unwrap_or_default();
        // Serialization of numbers and text never fails.
        if let Ok(Value::Object(own)) = serde_json::to_value(self) {
            all.extend(own);
        }
        Value::Object(all).to_string()
    }

    /// The cage of a project's mesh, and a notice about dropped controls. `None` if the mesh has no faces.
    #[must_use]
    pub fn cage(&self, mesh: &PolygonMesh) -> (Option<RestCage>, Option<&'static str>) {
        if mesh.faces.is_empty() {
            return (None, None);
        }
        let with = |controls| RestCage::new(mesh.clone(), controls);
        match self.controls.clone().map(with) {
            Some(Ok(cage)) => (Some(cage), None),
            Some(Err(_)) => {
                let notice = "The smooth surface or the controls inside this project's cage cannot be used: they are left out.";
                (with(CageControls::default()).ok(), Some(notice))
            }
            None => (with(CageControls::default()).ok(), None),
        }
    }

    /// Humanoid bones, and the names of the joints that the user has given them. Skips unknown bones.
    #[must_use]
    pub fn given_bones(&self) -> Vec<(Bone, String)> {
        self.bones.iter().filter_map(|(bone, joint)| Some((bone.parse().ok()?, joint.clone()))).collect()
    }

    /// Saved poses with their pins and times. `cage`: the cage of the project.
    #[must_use]
    pub fn poses(
        &self,
        poses: impl IntoIterator<Item = (String, Vec<Vec3>)>,
        cage: Option<&RestCage>,
    ) -> Vec<NamedPose> {
        let cage = cage.map(|cage| (cage.mesh.positions.len(), cage_id(&cage.mesh)));
        let named = |(k, (name, positions)): (usize, (String, Vec<Vec3>))| {
            let PoseSettings { proportions, pins, other_cage, lead, interpolation, .. } =
                self.saved_poses.get(k).cloned().unwrap_or_default();
            NamedPose {
                name: name.into(),
                cage: cage.filter(|(n, _)| !other_cage && *n == positions.len()).map(|(_, id)| id),
                positions: Arc::from(positions),
                pins: pins.map(Into::into),
                lead,
                interpolation,
                proportions,
            }
        };
        poses.into_iter().enumerate().map(named).collect()
    }

    /// Decodes the stored pose; `None` if the cage is at rest. `[n_controls]`
    ///
    /// # Errors
    /// A message for the user if the pose is damaged or belongs to another cage.
    pub fn pose_of(&self, document: &Document) -> Result<Option<Vec<Vec3>>, &'static str> {
        let Some(text) = &self.pose else { return Ok(None) };
        let damaged = "The pose in this project is damaged: the cage is at rest.";
        let bytes = URL_SAFE_NO_PAD.decode(text.trim_end_matches('=')).map_err(|_| damaged)?;
        let up = document.models.up();
        let n_controls = document.cage.mesh.positions.len();
        let pose = positions_of(&bytes).filter(|pose| pose.len() == n_controls).ok_or(damaged)?;
        Ok(Some(up.turned(&pose).into_owned()))
    }
}

/// Reads a JSON object, and skips members that cannot be read.
fn readable<T: Default + DeserializeOwned>(value: Value) -> T {
    let Value::Object(mut members) = value else { return T::default() };
    members.retain(|name, value| serde_json::from_value::<T>(json!({ name: value })).is_ok());
    serde_json::from_value(members.into()).unwrap_or_default()
}

fn is_unscaled(proportions: &Proportions) -> bool {
    *proportions == Proportions::default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unreadable_fields_are_skipped() {
        let read = |given: Value| DocumentSettings::read(&given.to_string());
        let shares = [0.25, -3.0, 1e300].map(|share| json!({ "share": share }));
        assert_eq!(read(json!({ "saved_poses": shares })).shares(), [0.25, 0.0, 1.0]);
        let damaged = json!([{ "share": "half", "lead": 2.5 }, 7]);
        let read_poses = read(json!({ "saved_poses": damaged, "sample": 7, "pins": {}, "pose": [] }));
        let known = PoseSettings { lead: 2.5, ..PoseSettings::default() };
        assert_eq!(
            read_poses,
            DocumentSettings {
                saved_poses: vec![known, PoseSettings::default()],
                ..DocumentSettings::default()
            }
        );
        for text in ["not json", "[1]", ""] {
            assert_eq!(DocumentSettings::read(text), DocumentSettings::default());
        }
    }

    /// A document whose cage is one vertex at (1, 1, 1).
    fn one_vertex() -> Document {
        let mesh = PolygonMesh { positions: vec![Vec3::ONE], faces: Vec::new() };
        let cage = Arc::new(RestCage { mesh, ..RestCage::default() });
        Document { cage, ..Document::default() }
    }

    #[test]
    fn pins_of_poses_are_kept_or_unknown() {
        let pin = SurfacePoint { triangle: 2, bary: [0.5, 0.5, 0.0] };
        let some = |pins: &[SurfacePoint]| Some(Arc::from(pins));
        for all in [vec![some(&[]), some(&[])], vec![None, some(&[pin])], vec![None, None]] {
            let empty = || ("pose".to_owned(), vec![Vec3::ZERO]);
            let mut poses = DocumentSettings::default().poses(all.iter().map(|_| empty()), None);
            poses.iter_mut().zip(&all).for_each(|(pose, pins)| pose.pins.clone_from(pins));
            let document = Document { poses: Arc::new(poses), ..one_vertex() };
            let text = DocumentSettings::from_document(&document).beside("{}");
            let read = DocumentSettings::read(&text).poses(all.iter().map(|_| empty()), None);
            assert_eq!(read.into_iter().map(|pose| pose.pins).collect::<Vec<_>>(), all);
        }
    }

    #[test]
    fn damaged_poses_give_a_message() {
        let document = one_vertex();
        // The last pose has 12 bytes, but a coordinate is NaN.
        for pose in ["!", "AAEC", "", "AAAAAAAAwH8AAAAA"] {
            let settings = DocumentSettings { pose: Some(pose.to_owned()), ..DocumentSettings::default() };
            assert!(settings.pose_of(&document).unwrap_err().contains("at rest"), "{pose}");
        }
    }
}
