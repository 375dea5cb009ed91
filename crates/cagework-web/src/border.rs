//! Writes TypeScript declarations of the serde types that cross the border between Rust and the page, and the page's
//! default values and ranges.

use std::fmt::Write as _;
use std::fs;

use cagework_cage::check::{Code, Repair, Severity};
use cagework_cage::generate::{
    CageOptions, DETAILS, MAX_CLEARANCE, MAX_TARGET, MAX_VOXELS, MIN_TARGET, MIN_VOXELS, Shape,
};
use cagework_core::deform::OutsideVertex;
use cagework_core::options::{
    Backend, CellShape, Choice, DeltaNorm, MAX_GRID, MIN_GRID, Method, OutsidePolicy, Preconditioner, Solver,
};
use cagework_core::report::{
    BindReport, CellCounts, MeanMax, MemoryBytes, RawError, RestError, Timings, WeightStats,
};
use cagework_core::{BindOptions, Coordinates, Frames, InnerElement, Stage};
use cagework_editor::edit::{Element, GestureKind, Pivot, SelectMode};
use cagework_editor::{
    CageControls, Command, DocumentSettings, InnerKind, MemberSettings, PartOptions, PoseView, RestEdit,
    SelectionView, SurfacePoint,
};
use cagework_io::{ModelFormat, UpAxis};
use serde::Serialize;
use ts_rs::{Config, TS};

use crate::binder::Offsets;
use crate::clock::Event;
use crate::error::ErrorName;
use crate::opening::{CageContents, OpenContents, PoseContents};
use crate::options::{
    Colour, GizmoHandle, JsBindOptions, JsCageOptions, JsGizmo, JsJoints, JsPullOptions, JsRigOptions,
    JsSceneOptions, JsSymmetry, JsTheme, SliceShown,
};
use crate::settings::Settings;
use crate::views::{
    BoundsView, CageInfo, CageState, CameraView, ClipView, ColorMap, Fix, Grip, Largest, Legend, MemberInfo,
    Mend, ModelInfo, Problem, TargetView, View,
};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../web/package/src/contract/generated.ts");

/// Default memory limit of a bind in the page, bytes: half of the 4 GiB of a tab.
const PAGE_MEMORY: u64 = 2 << 30;

/// Doc comment and TypeScript declaration of each type.
macro_rules! declarations {
    ($($type:ty),* $(,)?) => {{
        // 64-bit integers are sent as JavaScript numbers.
        let config = Config::default().with_large_int("number");
        [$((<$type>::docs().unwrap_or_default(), <$type>::decl(&config)),)*]
    }};
}

/// A TypeScript constant. `serde_json::to_string` keeps `f32` decimals; `json!` would widen them to `f64`.
fn constant(name: &str, r#type: &str, value: &impl Serialize) -> String {
    let json = serde_json::to_string(value).unwrap().replace("\"threads\":0,", "");
    format!("export const {name}: {type} = {json};\n")
}

#[test]
fn generated_types_are_up_to_date() {
    let mut text =
        "// Written by crates/cagework-web/src/border.rs from Rust's types. To change them, change those.\n\n"
            .to_owned();
    for (docs, declaration) in declarations![
        ErrorName,
        Method,
        Solver,
        Preconditioner,
        Backend,
        CellShape,
        DeltaNorm,
        OutsidePolicy,
        JsBindOptions,
        Stage,
        Event,
        Frames,
        OutsideVertex,
        Offsets,
        BindReport,
        CellCounts,
        Timings,
        MemoryBytes,
        RestError,
        RawError,
        MeanMax,
        WeightStats,
        Shape,
        JsSymmetry,
        JsCageOptions,
        BoundsView,
        InnerElement,
        InnerKind,
        CageControls,
        CageInfo,
        CageState,
        Code,
        Severity,
        Repair,
        Mend,
        Fix,
        Problem,
        ModelFormat,
        UpAxis,
        PartOptions,
        MemberInfo,
        MemberSettings,
        ModelInfo,
        DocumentSettings,
        Command,
        PoseView,
        SelectionView,
        View,
        CageContents,
        PoseContents,
        OpenContents,
        Settings,
        JsTheme,
        Colour,
        Coordinates,
        SliceShown,
        JsGizmo,
        JsSceneOptions,
        CameraView,
        SurfacePoint,
        Grip,
        JsPullOptions,
        JsJoints,
        JsRigOptions,
        ClipView,
        TargetView,
        ColorMap,
        Largest,
        Legend,
        Element,
        Pivot,
        SelectMode,
        GestureKind,
        GizmoHandle,
        RestEdit,
    ] {
        writeln!(text, "{docs}export {declaration}").unwrap();
        text = text.replace(" \n", "\n");
    }
    let options = BindOptions { memory_limit: PAGE_MEMORY, ..BindOptions::default() };
    text += &constant("BIND_DEFAULTS", "BindOptions", &JsBindOptions { backend: Backend::Gpu, options });
    text += &constant("CAGE_DEFAULTS", "CageOptions", &JsCageOptions::from(CageOptions::default()));
    text += &constant("RIG_DEFAULTS", "RigOptions", &JsRigOptions::default());
    text += &constant("SCENE_DEFAULTS", "SceneOptions", &JsSceneOptions::default());
    let kinds: Vec<&str> = Coordinates::ALL.iter().map(|(word, _)| *word).collect();
    text += &constant("COORDINATES", "readonly Coordinates[]", &kinds);
    let all = |of: fn(ModelFormat) -> &'static [&'static str]| ModelFormat::ALL.map(of).concat();
    let shapes = ModelFormat::ALL.into_iter().filter(|format| !format.holds_poses());
    for (about, name, values) in [
        ("File extensions of models, preferred first.", "MODEL_ENDINGS", all(ModelFormat::endings)),
        ("MIME types of models.", "MODEL_TYPES", all(ModelFormat::mime_types)),
        (
            "Extensions of models that refer to other files.",
            "NAMING_ENDINGS",
            all(ModelFormat::naming_endings),
        ),
        ("Extensions of these other files.", "COMPANION_ENDINGS", all(ModelFormat::companions)),
        ("Formats that store only a shape.", "SHAPE_FORMATS", shapes.map(ModelFormat::name).collect()),
    ] {
        writeln!(text, "/** {about} */\nexport const {name} = {values:?} as const;").unwrap();
    }
    writeln!(
        text,
        "/** Least and most of each option that is a number. */\nexport const RANGES = {{ grid: [{MIN_GRID}, {MAX_GRID}], \
         vertices: [{MIN_TARGET}, {MAX_TARGET}], detail: [{}, {}], margin: [0, {MAX_CLEARANCE}], voxels: [{MIN_VOXELS}, {MAX_VOXELS}] }} \
         as const;",
        DETAILS[0], DETAILS[1]
    )
    .unwrap();
    if fs::read_to_string(FILE).unwrap_or_default() != text {
        fs::write(FILE, text).unwrap();
        panic!(
            "web/package/src/contract/generated.ts was out of date and has been rewritten: review and commit it"
        );
    }
}
