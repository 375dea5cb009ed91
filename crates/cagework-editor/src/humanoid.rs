//! Humanoid bones of the models, and the cage prepared for their proportions. Both are computed once.

use std::sync::Arc;

use cagework_core::Weights;
use cagework_core::options::Choice;
use cagework_core::rig::Rig;
use cagework_pose::humanoid::{Bone, BoneSource, Humanoid, HumanoidError};
use cagework_pose::proportions::HumanoidCage;
use serde::Serialize;

use crate::controls::RestCage;
use crate::document::{Document, Key};
use crate::error::EditError;
use crate::models::GivenBones;

/// Humanoid bones of the models, for panels.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct HumanoidInfo {
    /// What told which joint is which bone; null if the skeleton is not that of a humanoid.
    pub source: Option<BoneSource>,
    /// Why the skeleton is not that of a humanoid, one sentence.
    pub fault: Option<String>,
    /// Bones in the order of [`Bone`]. Without a source, only the missing bones and those that the user has given.
    pub bones: Vec<BoneView>,
    /// Distinct names of the joints.
    pub joints: Vec<String>,
}

/// A humanoid bone, as panels show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct BoneView {
    /// Name of the bone.
    #[cfg_attr(feature = "typescript", ts(as = "Bone"))]
    pub bone: String,
    /// Name of its joint, if it has one.
    pub joint: Option<String>,
    /// Whether the user has chosen the joint.
    pub given: bool,
}

/// Results that depend on the models, their given bones and the cage at rest. Recomputed when one of these changes.
#[derive(Debug, Default)]
pub(crate) struct HumanoidCache {
    found: Option<((u64, GivenBones), Result<Humanoid, HumanoidError>)>,
    info: Option<((u64, GivenBones), Option<HumanoidInfo>)>,
    cage: Option<(CageKey, Arc<HumanoidCage>)>,
    /// The last bind, and the models and the cage that were bound.
    pub(crate) bind: Option<(Key, Arc<Weights>)>,
}

/// What a prepared cage depends on.
#[derive(Debug)]
struct CageKey {
    document: Key,
    bones: GivenBones,
    bind: Option<Arc<Weights>>,
}

impl PartialEq for CageKey {
    fn eq(&self, other: &Self) -> bool {
        let is_same_bind = self.bind.as_ref().map(Arc::as_ptr) == other.bind.as_ref().map(Arc::as_ptr);
        is_same_bind && self.document == other.document && self.bones == other.bones
    }
}

impl HumanoidCache {
    /// Humanoid bones of the models of a document.
    pub(crate) fn humanoid(&mut self, document: &Document) -> Result<Humanoid, HumanoidError> {
        let key = (document.mesh_key, document.models.given_bones());
        if let Some((_, found)) = self.found.as_ref().filter(|(known, _)| *known == key) {
            return found.clone();
        }
        let rig = document.models.rest_rig().unwrap_or_default();
        let found = Humanoid::of_rig(&rig, &key.1);
        self.found = Some((key, found.clone()));
        found
    }

    /// The cage of a document, prepared for proportions.
    pub(crate) fn cage(&mut self, document: &Document) -> Result<Arc<HumanoidCage>, EditError> {
        let humanoid = self.humanoid(document)?;
        if document.cage.mesh.faces.is_empty() {
            return Err(EditError::NoCage);
        }
        let bind = self.bind.as_ref().filter(|(bound, _)| *bound == document.key());
        let key = CageKey {
            document: document.key(),
            bones: document.models.given_bones(),
            bind: bind.map(|(_, weights)| Arc::clone(weights)),
        };
        if let Some((_, cage)) = self.cage.as_ref().filter(|(known, _)| *known == key) {
            return Ok(Arc::clone(cage));
        }
        let models = &document.models;
        let rig = models.rest_rig().ok_or(HumanoidError::NoRig)?;
        let (positions, _) = models.states(None).map_err(|_| EditError::NoModel)?;
        let RestCage { mesh, controls, .. } = &*document.cage;
        let mut cage = HumanoidCage::new(&mesh.positions, &controls.rings, &positions, &rig, &humanoid);
        if let (Some(weights), Some(rig)) = (&key.bind, models.vertex_rig()) {
            cage = cage.with_bind(weights, models.positions(), &rig, &humanoid);
        }
        let cage = Arc::new(cage);
        self.cage = Some((key, Arc::clone(&cage)));
        Ok(cage)
    }

    /// Humanoid bones of the models of a document, for panels.
    pub(crate) fn info(&mut self, document: &Document) -> Option<HumanoidInfo> {
        let key = (document.mesh_key, document.models.given_bones());
        if self.info.as_ref().is_none_or(|(known, _)| *known != key) {
            let rig = document.models.rest_rig();
            let info = rig.map(|rig| HumanoidInfo::of(&rig, &key.1, self.humanoid(document)));
            self.info = Some((key, info));
        }
        self.info.as_ref().and_then(|(_, info)| info.clone())
    }
}

impl HumanoidInfo {
    fn of(rig: &Rig, given: &[(Bone, String)], found: Result<Humanoid, HumanoidError>) -> Self {
        let joint_of = |bone: Bone| match &found {
            Ok(humanoid) => {
                humanoid.joint(bone).and_then(|joint| Some(rig.joints.get(joint as usize)?.name.clone()))
            }
            Err(_) => given.iter().find(|(own, _)| *own == bone).map(|(_, joint)| joint.clone()),
        };
        let is_shown = |bone: &Bone| match &found {
            Ok(_) => true,
            Err(HumanoidError::Missing { missing, .. }) if missing.contains(bone) => true,
            Err(_) => given.iter().any(|(own, _)| own == bone),
        };
        let bones = Bone::ALL.iter().map(|(_, bone)| *bone).filter(is_shown).map(|bone| BoneView {
            bone: bone.to_string(),
            joint: joint_of(bone),
            given: given.iter().any(|(own, _)| *own == bone),
        });
        let mut joints: Vec<String> = Vec::new();
        for joint in &rig.joints {
            if !joints.contains(&joint.name) {
                joints.push(joint.name.clone());
            }
        }
        Self {
            bones: bones.collect(),
            joints,
            source: found.as_ref().ok().map(Humanoid::source),
            fault: found.err().map(|fault| fault.to_string()),
        }
    }
}
