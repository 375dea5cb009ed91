//! Poses of a cage that follow the clip of a rig, for captures and for models without a rig of their own.

use cagework_core::Bounds;
use cagework_core::rig::Rig;
use cagework_io::{Clip, JointPlayer, Model};
use cagework_pose::drive::BoneWeights;
use cagework_pose::figure::{BentJoint, ClipMaps, Figure, Fit};
use cagework_pose::humanoid::{Bone, Humanoid};
use glam::{DVec3, Vec3};

use crate::error::JobError;

/// Angle of an elbow or a knee beyond which a cage folds its inner side, degrees ([measured](../../docs/splats.md)).
pub const MAX_BEND: f64 = 100.0;

/// A humanoid rig with clips.
#[derive(Clone, Debug)]
pub struct ClipRig {
    rig: Rig,
    humanoid: Humanoid,
    player: JointPlayer,
    bounds: [DVec3; 2],
}

impl ClipRig {
    /// Reads the rig of a model. `bones`: bones and the names of their joints, which take precedence over what is found.
    ///
    /// # Errors
    /// If the joints cannot be read, are not those of a humanoid, or the model has no clips.
    pub fn new(model: &Model, bones: &[(Bone, String)]) -> Result<Self, JobError> {
        let (rig, humanoid) = model.humanoid(bones)?;
        let player = model.joint_player()?;
        if player.clips().is_empty() {
            return Err(JobError::NoClips);
        }
        // A file of clips may have no mesh.
        let joints: Vec<Vec3> = rig.joints.iter().map(|joint| joint.at).collect();
        let bounds = Bounds::around(&model.positions).or(Bounds::around(&joints));
        let bounds = bounds.map_or([DVec3::ZERO; 2], |b| [b.min.as_dvec3(), b.max.as_dvec3()]);
        Ok(Self { rig, humanoid, player, bounds })
    }

    /// Clips of the file.
    #[must_use]
    pub fn clips(&self) -> &[Clip] {
        self.player.clips()
    }

    /// Joints at rest.
    #[must_use]
    pub fn figure(&self) -> Figure {
        Figure::of_rig(&self.rig, &self.humanoid)
    }

    /// Corners of the box of the model or, without a mesh, of the joints. Object units
    #[must_use]
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// Lets a cage follow the clips. `weights`: of the fitted bones at the controls; `rest`: positions of the controls,
    /// object units, `[n_controls]`.
    #[must_use]
    pub fn drive(self, fit: &Fit, weights: BoneWeights, rest: Vec<Vec3>) -> ClipPoses {
        let maps = ClipMaps::new(fit, &self.rig, &self.humanoid);
        ClipPoses { player: self.player, maps, weights, rest }
    }
}

/// Poses of a cage at the times of clips.
#[derive(Clone, Debug)]
pub struct ClipPoses {
    player: JointPlayer,
    maps: ClipMaps,
    weights: BoneWeights,
    rest: Vec<Vec3>,
}

impl ClipPoses {
    /// Pose of the cage at a time of a clip, seconds, and the elbow or knee that bends most. `[n_controls]`, object units
    #[must_use]
    pub fn at(&self, clip: usize, seconds: f32) -> (Vec<Vec3>, Option<BentJoint>) {
        let maps = self.maps.at(&self.player.at(Some(clip), seconds));
        let pose = self.weights.drive(&self.rest, &maps).iter().map(|p| p.as_vec3()).collect();
        (pose, self.maps.most_bent(&maps))
    }

    /// Factor by which the travel of the hips is scaled.
    #[must_use]
    pub fn travel(&self) -> f64 {
        self.maps.travel()
    }
}
