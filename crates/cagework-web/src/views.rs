//! What JavaScript is told about things, as plain objects: the types of contract.ts.

use cagework_core::cage::CageNotice;
use cagework_core::cage_check::{Code, Repair, Severity};
use cagework_core::edit::Topology;
use cagework_core::{Bounds, ControlSet};
use cagework_io::{Clip, Model, ModelFormat, UpAxis};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::controls::{CageControls, MadeCage};
use crate::error::Answer;

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

/// A point of the model's surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct SurfacePoint {
    pub(crate) triangle: u32,
    /// Barycentric coordinates in it.
    pub(crate) bary: [f32; 3],
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
}

impl ModelInfo {
    pub(crate) fn of(model: &Model) -> Self {
        let counts = model.counts;
        Self {
            name: model.name.clone(),
            format: model.format(),
            up: model.up(),
            vertices: model.positions.len(),
            triangles: model.triangles.len(),
            faces: model.n_faces(),
            materials: counts.materials,
            textures: counts.textures,
            skins: counts.skins,
            joints: counts.joints,
            clips: model.clips().iter().map(ClipView::of).collect(),
            targets: TargetView::all(model),
            // What is wrong with a rig is said where it is used.
            props: model.props().unwrap_or_default(),
            rigged: model.is_rigged(),
            bounds: BoundsView::of(Bounds::of(&model.positions)),
            notices: model.notices.clone(),
        }
    }
}

/// A clip.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct ClipView {
    /// Its name; empty if it has none.
    name: String,
    seconds: f32,
}

impl ClipView {
    fn of(clip: &Clip) -> Self {
        Self { name: clip.name.clone().unwrap_or_default(), seconds: clip.seconds }
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
    fn all(model: &Model) -> Vec<Self> {
        if !model.is_rigged() {
            return Vec::new();
        }
        let Ok(Some(player)) = model.player() else { return Vec::new() };
        let (names, defaults) = player.targets();
        names.iter().zip(defaults).map(|(name, &default)| Self { name: name.clone(), default }).collect()
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
    pub(crate) fn of(made: &MadeCage) -> Self {
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
            notices: notices.chain(made.notice.clone()).collect(),
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
