//! Poses of a cage that follow the clip of a rig, for captures and for models without a rig of their own.

use cagework_cage::skeleton::{Skeleton, SkeletonError};
use cagework_core::Bounds;
use cagework_core::progress::{Cancellation, Progress};
use cagework_core::rig::Rig;
use cagework_io::{Clip, JointPlayer, Model};
use cagework_pose::drive::BoneWeights;
use cagework_pose::figure::{BentJoint, ClipMaps, Figure, Fit, Landmarks};
use cagework_pose::humanoid::{Bone, Humanoid};
use glam::{DVec3, Vec3};

use crate::error::JobError;

/// Angle of an elbow or a knee beyond which its inner side collapses, degrees: measured in docs/splats.md.
pub const MAX_BEND: f64 = 100.0;

/// Surface of a model at rest, and its curve skeleton.
#[derive(Clone, Debug, Default)]
pub struct FigureSurface {
    /// Points, object units. `[n_points]`
    pub points: Vec<Vec3>,
    /// Triangles of these points, any soup.
    pub triangles: Vec<[u32; 3]>,
    /// Chains of the skeleton: the trunk first, then polylines from it to the tips of limbs. Empty if it has none.
    pub chains: Vec<Vec<DVec3>>,
    /// Chain of each point. `[n_points]`, or empty
    pub chain_of: Vec<u32>,
}

impl FigureSurface {
    /// Derives the curve skeleton of a surface. `points`, `triangles`: as in [`Self::points`], [`Self::triangles`].
    ///
    /// # Errors
    /// If `progress` cancels.
    pub fn new(
        points: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
        progress: &dyn Progress,
    ) -> Result<Self, Cancellation> {
        let (chains, chain_of) = match Skeleton::of_surface(&points, &triangles, progress) {
            Ok(skeleton) => (skeleton.chains.into_iter().map(|chain| chain.at).collect(), skeleton.chain_of),
            Err(SkeletonError::Cancelled(cancelled)) => return Err(cancelled),
            Err(_) => Default::default(),
        };
        Ok(Self { points, triangles, chains, chain_of })
    }

    /// The head, arms and legs; `None` if they are not found.
    #[must_use]
    pub fn landmarks(&self) -> Option<Landmarks> {
        Landmarks::find(&self.points, &self.triangles, &self.chains)
    }
}

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
        let bounds = corners(if model.positions.is_empty() { &joints } else { &model.positions });
        Ok(Self { rig, humanoid, player, bounds })
    }

    /// Clips of the file.
    #[must_use]
    pub fn clips(&self) -> &[Clip] {
        self.player.clips()
    }

    /// Fits the joints to another model: by the limbs of both, or else by their heights; then also returns a sentence that
    /// says so. `own`: the surface of the rig's model; without points if it has no mesh.
    #[must_use]
    pub fn fit(&self, own: &FigureSurface, target: &FigureSurface) -> (Fit, Option<String>) {
        let figure = Figure::of_rig(&self.rig, &self.humanoid);
        let whose = match (own.landmarks(), target.landmarks()) {
            (Some(from), Some(to)) => return (Fit::by_limbs(&figure, &from, &to), None),
            (_, None) => "the model",
            (None, _) => "the rig's model",
        };
        let notice = format!(
            "No head, two arms and two legs were found in {whose}, so the joints are fitted by the height alone: look at \
             them, and correct them."
        );
        (Fit::by_bounds(&figure, self.bounds, corners(&target.points)), Some(notice))
    }

    /// Lets a cage follow the clips. `target`: surface of the model in the cage; `rest`, `rings`: positions of the controls,
    /// object units, `[n_controls]`, and loops of them around limbs, as for [`BoneWeights::of_skin`].
    #[must_use]
    pub fn drive(&self, fit: &Fit, target: &FigureSurface, rest: &[Vec3], rings: &[Vec<u32>]) -> ClipPoses {
        let landmarks = target.landmarks();
        let limbs = landmarks.as_ref().map(|landmarks| (landmarks, target.chain_of.as_slice()));
        let weights = BoneWeights::of_figure(rest, rings, &target.points, &fit.figure, limbs);
        let maps = ClipMaps::new(fit, &self.rig, &self.humanoid);
        ClipPoses { player: self.player.clone(), maps, weights, rest: rest.to_vec() }
    }
}

fn corners(points: &[Vec3]) -> [DVec3; 2] {
    let bounds = Bounds::around(points);
    bounds.map_or([DVec3::ZERO; 2], |bounds| [bounds.min.as_dvec3(), bounds.max.as_dvec3()])
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
