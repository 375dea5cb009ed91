//! Properties of models and cage that panels show.

use cagework_core::cage::CageNotice;
use cagework_core::splats::Splats;
use cagework_core::{Bounds, ControlSet};
use cagework_io::{Model, ModelFormat, UpAxis, lies_on_back, up_of_floor};
use serde::Serialize;

use crate::controls::{CageControls, RestCage};
use crate::edit::Topology;
use crate::error::EditError;
use crate::models::{Member, Models, PartOptions};
use crate::playback::SharedClip;

/// Combined properties of all models in the cage.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct ModelInfo {
    /// Name of the first model.
    name: String,
    format: ModelFormat,
    up: UpAxis,
    vertices: usize,
    triangles: usize,
    faces: usize,
    materials: usize,
    textures: usize,
    /// Number of splats of a capture, otherwise 0.
    splats: usize,
    /// Number of points of a point cloud, otherwise 0.
    points: usize,
    skins: usize,
    joints: usize,
    clips: Vec<SharedClip>,
    /// Morph targets of all models, and their weights at rest.
    targets: Vec<TargetView>,
    /// Names of unskinned parts attached to joints or animated nodes, which an export can keep rigid.
    props: Vec<String>,
    /// Whether a model has a rig that an export keeps.
    rigged: bool,
    /// Whether a model is a VRM.
    vrm: bool,
    bounds: Bounds,
    /// Another up axis that the file probably has: z for a 3MF file and for a mesh that seems to lie on its back. Null if
    /// there is none, if the up axis is not y, and for captures, which are turned when they are opened.
    suggested_up: Option<UpAxis>,
    notices: Vec<String>,
    /// Properties of each model.
    members: Vec<MemberInfo>,
}

impl ModelInfo {
    /// Collects the properties of the open models.
    ///
    /// # Errors
    /// If no model is open.
    pub fn from_models(models: &Models) -> Result<Self, EditError> {
        let first = &*models.first()?.model;
        let all = || models.iter().map(|member| &*member.model);
        let sum = |of: fn(&Model) -> usize| all().map(of).sum();
        Ok(Self {
            name: first.name.clone(),
            format: first.format(),
            up: first.up(),
            vertices: sum(|model| model.positions.len()),
            splats: first.splats().map_or(0, Splats::len),
            points: if first.n_faces() == 0 && first.splats().is_none() { first.positions.len() } else { 0 },
            triangles: sum(|model| model.triangles.len()),
            faces: sum(Model::n_faces),
            materials: sum(|model| model.counts.materials),
            textures: sum(|model| model.counts.textures),
            skins: sum(|model| model.counts.skins),
            joints: sum(|model| model.counts.joints),
            clips: SharedClip::group(models),
            targets: TargetView::all(models),
            // Errors of a rig are reported when the rig is used.
            props: all().flat_map(|model| model.props().unwrap_or_default()).collect(),
            rigged: all().any(Model::is_rigged),
            vrm: all().any(|model| model.vrm().is_some()),
            bounds: Bounds::around(models.positions()).unwrap_or_default(),
            suggested_up: suggested_up(models, first),
            notices: all().flat_map(|model| model.notices.clone()).chain(models.origin_notice()).collect(),
            members: models.iter().map(MemberInfo::of).collect(),
        })
    }
}

fn suggested_up(models: &Models, first: &Model) -> Option<UpAxis> {
    let is_z = first.format() == ModelFormat::ThreeMf || lies_on_back(models.positions());
    (first.splats().is_none() && first.up() == UpAxis::Y && is_z).then_some(UpAxis::Z)
}

/// The up axis that the file of a capture probably has: by its floor, or the conventional one of the format. `None` for
/// models that are not captures. Call it before the up axis is set.
#[must_use]
pub fn up_of_capture(model: &Model) -> Option<UpAxis> {
    let splats = model.splats()?;
    Some(up_of_floor(splats).unwrap_or_else(|| model.format().usual_up()))
}

/// Properties and options of one of the models in the cage.
#[derive(Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
struct MemberInfo {
    /// Identifier, which stays the same for the model's lifetime.
    id: u32,
    name: String,
    format: ModelFormat,
    vertices: usize,
    triangles: usize,
    /// Number of joints of its skins.
    joints: usize,
    /// Names of the parts, prefixed by their kind, such as `material:Cloth`.
    parts: Vec<String>,
    options: PartOptions,
    /// Whether some vertices of the model are painted to stay in place.
    painted: bool,
}

impl MemberInfo {
    fn of(member: &Member) -> Self {
        let model = &member.model;
        Self {
            id: member.id,
            name: model.name.clone(),
            format: model.format(),
            vertices: model.positions.len(),
            triangles: model.triangles.len(),
            joints: model.counts.joints,
            parts: model.part_names(),
            options: member.options.clone(),
            painted: !member.painted.is_empty(),
        }
    }
}

/// A morph target and its default weight.
#[derive(Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
struct TargetView {
    name: String,
    default: f32,
}

impl TargetView {
    fn all(models: &Models) -> Vec<Self> {
        let is_alone = models.iter().nth(1).is_none();
        let of = |member: &Member| {
            let model = &member.model;
            // Making a player reads the whole skin: do so only if there can be targets.
            let player = model.is_rigged().then(|| model.player().ok().flatten()).flatten();
            let named =
                |name: &String| if is_alone { name.clone() } else { format!("{}: {name}", model.name) };
            player.map_or_else(Vec::new, |player| {
                let (names, defaults) = player.targets();
                names
                    .iter()
                    .zip(defaults)
                    .map(|(name, &default)| Self { name: named(name), default })
                    .collect()
            })
        };
        models.iter().flat_map(of).collect()
    }
}

/// Counts, bounds and notices of the cage.
#[derive(Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
struct CageInfo {
    vertices: usize,
    edges: usize,
    faces: usize,
    /// Number of quads among the faces.
    quads: usize,
    bounds: Bounds,
    notices: Vec<String>,
}

impl CageInfo {
    fn of(made: &RestCage) -> Self {
        let (mesh, cage) = (&made.mesh, made.set.as_ref().ok().map(ControlSet::cage));
        let notices = cage.into_iter().flat_map(|c| c.notices().iter().map(CageNotice::to_string));
        Self {
            vertices: made.n_cage(),
            edges: Topology::new(&mesh.faces).edges.len(),
            faces: mesh.faces.len(),
            quads: mesh.faces.iter().filter(|face| face.len() == 4).count(),
            bounds: Bounds::around(&mesh.positions).unwrap_or_default(),
            notices: notices.chain(made.notices.clone()).collect(),
        }
    }
}

/// The cage's properties, and its inner controls.
#[derive(Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct CageState {
    /// Whether the cage is valid; otherwise it is a draft.
    usable: bool,
    info: CageInfo,
    controls: CageControls,
    /// Radius of interior point and line controls, object units.
    radius: f32,
}

impl CageState {
    /// Collects the properties of a cage or draft; `None` without faces.
    #[must_use]
    pub fn from_cage(cage: &RestCage) -> Option<Self> {
        (!cage.mesh.faces.is_empty()).then(|| Self {
            usable: cage.set.is_ok(),
            info: CageInfo::of(cage),
            controls: cage.controls.clone(),
            radius: cage.radius(),
        })
    }
}
