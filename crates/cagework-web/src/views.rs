//! Plain objects that JavaScript receives; border.rs generates their TypeScript declarations.

use cagework_cage::check::{Code, Repair, Severity};
use cagework_core::cage::CageNotice;
use cagework_core::splats::Splats;
use cagework_core::{Bounds, ControlSet};
use cagework_editor::edit::Topology;
use cagework_editor::{CageControls, DocumentView, Member, Models, PartOptions, RestCage};
use cagework_io::{Model, ModelFormat, UpAxis, lies_on_back};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::error::Answer;
use crate::playing::SharedClip;

/// Lower and upper corner of an axis-aligned box.
#[derive(Clone, Copy, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(rename = "Bounds"))]
pub(crate) struct BoundsView {
    min: [f32; 3],
    max: [f32; 3],
}

impl BoundsView {
    /// Converts bounds. `None` becomes a box of size zero at the origin.
    pub(crate) fn of(bounds: Option<Bounds>) -> Self {
        let zero = [0.0; 3];
        bounds
            .map_or(Self { min: zero, max: zero }, |b| Self { min: b.min.to_array(), max: b.max.to_array() })
    }
}

/// Position and direction of the camera.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CameraView {
    /// Point that the camera orbits, object units.
    pub(crate) target: [f32; 3],
    /// Rotation of the camera about y, radians; `pitch` is its elevation above the horizon.
    pub(crate) yaw: f32,
    pub(crate) pitch: f32,
    /// Distance from the eye to the target, object units.
    pub(crate) distance: f32,
    pub(crate) parallel: bool,
}

/// Document and bind state that panels show.
#[derive(Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct View {
    #[serde(flatten)]
    pub(crate) document: DocumentView,
    /// Whether the models are bound to the current cage.
    pub(crate) bound: bool,
    /// Whether weights on a lattice around the cage are available.
    pub(crate) lattice: bool,
    /// Number of splats outside the cage; 0 before the lattice is available.
    pub(crate) floaters: usize,
}

/// Combined properties of all models in the cage.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct ModelInfo {
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
    clips: Vec<ClipView>,
    /// Morph targets of all models, and their weights at rest.
    targets: Vec<TargetView>,
    /// Names of unskinned parts attached to joints or animated nodes, which an export can keep rigid.
    props: Vec<String>,
    /// Whether a model has a rig that an export keeps.
    rigged: bool,
    /// Whether a model is a VRM.
    vrm: bool,
    bounds: BoundsView,
    /// Another up axis that the file probably has: the conventional one of the format for captures and 3MF files, z for
    /// other models that seem to lie on their back. Null if there is none, or if the up axis is not y.
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
    pub(crate) fn of(models: &Models) -> Answer<Self> {
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
            clips: SharedClip::all(models).into_iter().map(ClipView::of).collect(),
            targets: TargetView::all(models),
            // Errors of a rig are reported when the rig is used.
            props: all().flat_map(|model| model.props().unwrap_or_default()).collect(),
            rigged: all().any(Model::is_rigged),
            vrm: all().any(|model| model.vrm().is_some()),
            bounds: BoundsView::of(Bounds::of(models.positions())),
            suggested_up: suggested_up(models, first),
            notices: all().flat_map(|model| model.notices.clone()).chain(models.origin_notice()).collect(),
            members: models.iter().map(MemberInfo::of).collect(),
        })
    }
}

fn suggested_up(models: &Models, first: &Model) -> Option<UpAxis> {
    let up = if first.splats().is_some() || first.format() == ModelFormat::ThreeMf {
        first.format().usual_up()
    } else if lies_on_back(models.positions()) {
        UpAxis::Z
    } else {
        UpAxis::Y
    };
    (first.up() == UpAxis::Y && up != UpAxis::Y).then_some(up)
}

/// Properties and options of one of the models in the cage.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct MemberInfo {
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

/// Name and duration of an animation clip, for the list of clips.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct ClipView {
    /// Name of the clip, or its number if it has no name.
    name: String,
    seconds: f32,
}

impl ClipView {
    fn of(SharedClip { name, seconds, .. }: SharedClip) -> Self {
        Self { name, seconds }
    }
}

/// A morph target and its default weight.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct TargetView {
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
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CageInfo {
    vertices: usize,
    edges: usize,
    faces: usize,
    /// Number of quads among the faces.
    quads: usize,
    triangles: usize,
    bounds: BoundsView,
    notices: Vec<String>,
}

impl CageInfo {
    pub(crate) fn of(made: &RestCage) -> Self {
        let (mesh, cage) = (&made.mesh, made.set.as_ref().ok().map(ControlSet::cage));
        let notices = cage.into_iter().flat_map(|c| c.notices().iter().map(CageNotice::to_string));
        let fan: usize = mesh.faces.iter().map(|f| f.len().saturating_sub(2)).sum();
        Self {
            vertices: made.n_cage(),
            edges: Topology::new(&mesh.faces).edges.len(),
            faces: mesh.faces.len(),
            quads: mesh.faces.iter().filter(|face| face.len() == 4).count(),
            triangles: cage.map_or(fan, |c| c.triangles().len()),
            bounds: BoundsView::of(Bounds::of(&mesh.positions)),
            notices: notices.chain(made.notices.clone()).collect(),
        }
    }
}

/// The cage's properties, and its interior controls.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CageState {
    pub(crate) usable: bool,
    pub(crate) info: CageInfo,
    pub(crate) controls: CageControls,
    /// Radius of interior point and line controls, object units.
    pub(crate) radius: f32,
}

/// Faults of one kind in a cage: their number, and the best fix.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Problem {
    pub(crate) code: Code,
    pub(crate) severity: Severity,
    /// Message of one or more complete sentences.
    pub(crate) message: String,
    pub(crate) count: usize,
    pub(crate) fix: Option<Mend>,
}

/// Action of the button that fixes a fault.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum Mend {
    /// Repairs the cage by `repair`.
    Repair { repair: Repair },
    /// Binds with a grid of `cells` along the longest side.
    Grid { cells: u32 },
    /// Generates a new cage.
    Regenerate,
}

/// Legend of the colours of the slice or the model.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Legend {
    pub(crate) low: f32,
    pub(crate) high: f32,
    pub(crate) logarithmic: bool,
    pub(crate) map: ColorMap,
    /// Largest of the displayed weights; null for other quantities.
    pub(crate) largest: Option<LargestWeight>,
}

/// The largest weight, and the index of the model vertex that has it.
#[derive(Clone, Copy, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct LargestWeight {
    pub(crate) value: f32,
    pub(crate) vertex: u32,
}

/// Colour map that a legend shows.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum ColorMap {
    Viridis,
    Error,
    Kinds,
}

/// Converts a value to a plain JavaScript object. `None` becomes null. A whole number of 2^53 or more, which JavaScript
/// cannot represent, makes the object undefined.
pub(crate) fn object(value: &impl Serialize) -> JsValue {
    value.serialize(&serde_wasm_bindgen::Serializer::json_compatible()).unwrap_or(JsValue::UNDEFINED)
}

/// Like [`object`], but `None` becomes undefined.
pub(crate) fn optional(value: Option<impl Serialize>) -> JsValue {
    value.map_or(JsValue::UNDEFINED, |value| object(&value))
}
