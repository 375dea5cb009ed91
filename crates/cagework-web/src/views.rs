//! Plain objects passed to JavaScript: the types of contract.ts.

use cagework_cage::check::{Code, Repair, Severity};
use cagework_core::cage::CageNotice;
use cagework_core::{Bounds, ControlSet};
use cagework_editor::edit::Topology;
use cagework_editor::{CageControls, DocumentView, Member, Models, PartOptions, RestCage};
use cagework_io::{Model, ModelFormat, UpAxis};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::error::Answer;
use crate::playing::SharedClip;

/// Corners of a box.
#[derive(Clone, Copy, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(rename = "Bounds"))]
pub(crate) struct BoundsView {
    min: [f32; 3],
    max: [f32; 3],
}

impl BoundsView {
    /// Converts bounds; `None` becomes zero.
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
    /// Centre of orbiting, object units.
    pub(crate) target: [f32; 3],
    /// Rotation about y, and elevation above the horizon, radians.
    pub(crate) yaw: f32,
    pub(crate) pitch: f32,
    /// Distance from the eye to the target, object units.
    pub(crate) distance: f32,
    pub(crate) parallel: bool,
}

/// Weights and nearest vertex of a surface point.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Grip {
    /// Weights of the point. `[n_cage]`
    pub(crate) row: Vec<f64>,
    /// The nearest vertex of the model.
    pub(crate) seed: u32,
}

/// Document and bind state that panels show.
#[derive(Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct View {
    #[serde(flatten)]
    pub(crate) document: DocumentView,
    /// Whether the models are bound to the current cage.
    pub(crate) bound: bool,
}

/// Properties of the models in the cage.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct ModelInfo {
    name: String,
    format: ModelFormat,
    up: UpAxis,
    vertices: usize,
    triangles: usize,
    faces: usize,
    materials: usize,
    textures: usize,
    skins: usize,
    joints: usize,
    clips: Vec<ClipView>,
    /// Morph targets of all models, and their weights at rest.
    targets: Vec<TargetView>,
    /// Names of unskinned parts attached to joints or animated nodes; they can be kept rigid.
    props: Vec<String>,
    /// Whether exports keep a rig.
    rigged: bool,
    bounds: BoundsView,
    notices: Vec<String>,
    /// Properties of each model.
    members: Vec<MemberInfo>,
}

impl ModelInfo {
    /// # Errors
    /// If no model is open.
    pub(crate) fn of(models: &Models) -> Answer<Self> {
        let first = &*models.first()?.model;
        let all = || models.iter().map(|member| &*member.model);
        let sum = |of: fn(&Model) -> usize| all().map(of).sum();
        let more = all().count() - 1;
        Ok(Self {
            name: if more == 0 { first.name.clone() } else { format!("{} and {more} more", first.name) },
            format: first.format(),
            up: first.up(),
            vertices: sum(|model| model.positions.len()),
            triangles: sum(|model| model.triangles.len()),
            faces: sum(Model::n_faces),
            materials: sum(|model| model.counts.materials),
            textures: sum(|model| model.counts.textures),
            skins: sum(|model| model.counts.skins),
            joints: sum(|model| model.counts.joints),
            clips: SharedClip::all(models).into_iter().map(ClipView::of).collect(),
            targets: TargetView::all(models),
            // Errors of a rig are reported when it is used.
            props: all().flat_map(|model| model.props().unwrap_or_default()).collect(),
            rigged: all().any(Model::is_rigged),
            bounds: BoundsView::of(Bounds::of(models.positions())),
            notices: all().flat_map(|model| model.notices.clone()).chain(models.origin_notice()).collect(),
            members: models.iter().map(MemberInfo::of).collect(),
        })
    }
}

/// One of the models in a cage.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct MemberInfo {
    /// Identifier; never changes.
    id: u32,
    name: String,
    format: ModelFormat,
    vertices: usize,
    triangles: usize,
    rigged: bool,
    /// Names of the parts with their kinds, such as `material:Cloth`.
    parts: Vec<String>,
    options: PartOptions,
    /// Whether a part of the model is painted to stay in place.
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
            rigged: model.is_rigged(),
            parts: model.part_names(),
            options: member.options.clone(),
            painted: !member.painted.is_empty(),
        }
    }
}

/// A clip.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct ClipView {
    /// The name, or the number if it has none.
    name: String,
    seconds: f32,
}

impl ClipView {
    fn of(SharedClip { name, seconds, .. }: SharedClip) -> Self {
        Self { name, seconds }
    }
}

/// A morph target.
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
            let player = model.player().ok().flatten().filter(|_| model.is_rigged());
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

/// Size of the cage.
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

/// The cage, its controls and notices.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CageState {
    pub(crate) usable: bool,
    pub(crate) info: CageInfo,
    pub(crate) controls: CageControls,
    /// Radius of interior points and lines, object units.
    pub(crate) radius: f32,
}

/// A kind of fault of a cage.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Problem {
    pub(crate) code: Code,
    pub(crate) severity: Severity,
    /// A complete sentence.
    pub(crate) message: String,
    pub(crate) count: usize,
    pub(crate) fix: Option<Fix>,
}

/// A fix, and the label of its button.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Fix {
    pub(crate) label: String,
    #[serde(flatten)]
    pub(crate) mend: Mend,
}

/// Action of a fix.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum Mend {
    /// Repairs the cage.
    Repair { repair: Repair },
    /// Binds with a grid of `cells` along the longest side.
    Grid { cells: u32 },
    /// Makes another cage.
    Regenerate,
}

/// Legend of the colours of model or slice.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Legend {
    pub(crate) low: f32,
    pub(crate) high: f32,
    pub(crate) logarithmic: bool,
    pub(crate) map: ColorMap,
    /// Largest of the displayed weights; `None` for other quantities.
    pub(crate) largest: Option<Largest>,
}

/// The largest displayed value, and the model vertex that has it.
#[derive(Clone, Copy, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Largest {
    pub(crate) value: f32,
    pub(crate) vertex: u32,
}

/// Colour map of a legend.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum ColorMap {
    Viridis,
    Error,
    Kinds,
}

/// Converts a value to a plain JavaScript object; `None` becomes null.
pub(crate) fn object(value: &impl Serialize) -> Answer<JsValue> {
    let serializer = serde_wasm_bindgen::Serializer::json_compatible();
    Ok(value.serialize(&serializer)?)
}
