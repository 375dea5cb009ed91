//! What JavaScript is told about things, as plain objects: the types of contract.ts.

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
    /// Of points that may be none.
    pub(crate) fn of(bounds: Option<Bounds>) -> Self {
        let zero = [0.0; 3];
        bounds
            .map_or(Self { min: zero, max: zero }, |b| Self { min: b.min.to_array(), max: b.max.to_array() })
    }
}

/// Where the camera is.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CameraView {
    /// What it turns around, object units.
    pub(crate) target: [f32; 3],
    /// Turn around y and height above the horizon, radians.
    pub(crate) yaw: f32,
    pub(crate) pitch: f32,
    /// From the eye to the target, object units.
    pub(crate) distance: f32,
    pub(crate) parallel: bool,
}

/// How a point of the model follows the cage.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Grip {
    /// Its weights. `[n_cage]`
    pub(crate) row: Vec<f64>,
    /// The nearest vertex of the model.
    pub(crate) seed: u32,
}

/// What panels show.
#[derive(Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct View {
    #[serde(flatten)]
    pub(crate) document: DocumentView,
    /// Whether the models follow the cage: there are weights for both as they are.
    pub(crate) bound: bool,
}

/// `ModelInfo`.
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
    /// Morph targets of all that is shown, and their weights at rest.
    targets: Vec<TargetView>,
    /// Names of what hangs on the skeleton without a skin: it can be kept rigid.
    props: Vec<String>,
    /// Whether exports keep more than the shape.
    rigged: bool,
    bounds: BoundsView,
    notices: Vec<String>,
    /// Each of the models in the cage; all else is of all of them.
    members: Vec<MemberInfo>,
}

impl ModelInfo {
    /// # Errors
    /// When there is no model.
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
            // What is wrong with a rig is said where it is used.
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
    /// Its number, which stays.
    id: u32,
    name: String,
    format: ModelFormat,
    vertices: usize,
    triangles: usize,
    rigged: bool,
    /// Names of its parts, each with its kind: "material:Cloth".
    parts: Vec<String>,
    options: PartOptions,
    /// Whether some of it is painted to stay.
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
    /// Its name, or its number if it has none.
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

/// `CageInfo`.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CageInfo {
    vertices: usize,
    edges: usize,
    faces: usize,
    /// Quads among the faces.
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

/// `CageState`.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CageState {
    pub(crate) usable: bool,
    pub(crate) info: CageInfo,
    pub(crate) controls: CageControls,
    /// Radius of points and lines inside, object units.
    pub(crate) radius: f32,
}

/// A kind of fault, as the page says it.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Problem {
    pub(crate) code: Code,
    pub(crate) severity: Severity,
    /// A whole sentence with numbers.
    pub(crate) message: String,
    pub(crate) count: usize,
    pub(crate) fix: Option<Fix>,
}

/// What helps, and what its button says.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Fix {
    pub(crate) label: String,
    #[serde(flatten)]
    pub(crate) mend: Mend,
}

/// What a button beside a problem does.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum Mend {
    /// Repairs the cage.
    Repair { repair: Repair },
    /// Binds with so many cells.
    Grid { cells: u32 },
    /// Makes another cage.
    Regenerate,
}

/// `Legend`.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Legend {
    pub(crate) low: f32,
    pub(crate) high: f32,
    pub(crate) logarithmic: bool,
    pub(crate) map: ColorMap,
    /// Of the weights that the model's colours show; none for other colours.
    pub(crate) largest: Option<Largest>,
}

/// The largest value that colours show, and the vertex of the model that has it.
#[derive(Clone, Copy, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Largest {
    pub(crate) value: f32,
    pub(crate) vertex: u32,
}

/// How colours of a legend follow each other.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum ColorMap {
    Viridis,
    Error,
    Kinds,
}

/// A plain object of JavaScript; what is not there is null.
pub(crate) fn object(value: &impl Serialize) -> Answer<JsValue> {
    let serializer = serde_wasm_bindgen::Serializer::json_compatible();
    Ok(value.serialize(&serializer)?)
}
