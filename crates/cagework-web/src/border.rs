//! Generates TypeScript declarations of the serde types that Rust and the page exchange, the page's default values and
//! ranges, and the table of ranges in docs/limits.md.

use std::any::TypeId;
use std::collections::{BTreeMap, HashSet};
use std::fmt::Write as _;
use std::fs;

use cagework_cage::check::Problem;
use cagework_cage::generate::{BOX_DIVISIONS, CageOptions, HULL_TARGET};
use cagework_core::options::{Choice, Method};
use cagework_core::report::BindReport;
use cagework_core::{Coordinates, ProgressEvent};
use cagework_editor::edit::{GestureView, SelectMode};
use cagework_editor::{
    CageState, Command, HumanoidInfo, ModelInfo, NUMBERS, PageBindOptions, RigOptions, Settings, WalkInfo,
    fields,
};
use cagework_gpu::render::colormap::Legend;
use cagework_gpu::render::{CameraView, GizmoPart};
use cagework_gpu::session::MAX_PICTURE;
use cagework_io::{FormatFacts, ModelFormat};
use cagework_pose::proportions::{PRESETS, Proportion, ProportionRange};
use cagework_pose::pull::DragOptions;
use serde_json::{Map, Value, json};
use ts_rs::{Config, TS, TypeVisitor};

use crate::binder::page::BuiltSample;
use crate::cage::RigArrays;
use crate::error::ErrorName;
use crate::folds::FoldArrays;
use crate::opening::OpenContents;
use crate::options::JsSceneOptions;
use crate::puller::{GrabInput, GrabResult, PullFrame};
use crate::reshape::ProportionsRequest;
use crate::views::View;
use crate::weights::BoundArrays;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../web/package/src/contract/generated.ts");

/// Document with a generated table of the ranges of numeric options, between two HTML comments.
const LIMITS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/limits.md");
const TABLE_START: &str = "<!-- Written by crates/cagework-web/src/border.rs -->";
const TABLE_END: &str = "<!-- end -->";

/// TypeScript declarations of types and of all types that these refer to, by name: the order in which types are visited
/// can change with each compilation.
struct Declarations {
    config: Config,
    seen: HashSet<TypeId>,
    found: BTreeMap<String, String>,
}

impl TypeVisitor for Declarations {
    fn visit<T: TS + 'static + ?Sized>(&mut self) {
        // A type of the standard library has no declaration, hence no file.
        if T::output_path().is_none() || !self.seen.insert(TypeId::of::<T>()) {
            return;
        }
        T::visit_dependencies(self);
        let (docs, declaration) = (T::docs().unwrap_or_default(), T::decl(&self.config));
        self.found.insert(T::ident(&self.config), format!("{docs}export {declaration}\n"));
    }
}

/// Writes the declaration of a TypeScript constant.
fn constant(name: &str, r#type: &str, value: impl Into<Value>) -> String {
    format!("export const {name}: {type} = {};\n", value.into())
}

#[test]
fn generated_types_are_up_to_date() {
    // 64-bit integers are sent as JavaScript numbers.
    let config = Config::default().with_large_int("number");
    let mut found = Declarations { config, seen: HashSet::new(), found: BTreeMap::new() };
    found.visit::<ErrorName>();
    found.visit::<ProgressEvent>();
    found.visit::<BoundArrays>();
    found.visit::<BuiltSample>();
    found.visit::<BindReport>();
    found.visit::<CageState>();
    found.visit::<RigArrays>();
    found.visit::<ProportionsRequest>();
    found.visit::<Problem>();
    found.visit::<ModelInfo>();
    found.visit::<Command>();
    found.visit::<View>();
    found.visit::<OpenContents>();
    found.visit::<Settings>();
    found.visit::<JsSceneOptions>();
    found.visit::<CameraView>();
    found.visit::<DragOptions>();
    found.visit::<GrabInput>();
    found.visit::<GrabResult>();
    found.visit::<PullFrame>();
    found.visit::<HumanoidInfo>();
    found.visit::<WalkInfo>();
    found.visit::<FoldArrays>();
    found.visit::<ProportionRange>();
    found.visit::<Legend>();
    found.visit::<SelectMode>();
    found.visit::<GestureView>();
    found.visit::<GizmoPart>();
    let declarations: String = found.found.into_values().collect();
    let mut text = format!(
        "// Written by crates/cagework-web/src/border.rs from Rust's types. To change them, change those.\n\n{}",
        declarations.replace(" \n", "\n")
    );
    text += &constant("BIND_DEFAULTS", "BindOptions", fields(&PageBindOptions::default()));
    text += &constant("CAGE_DEFAULTS", "CageOptions", fields(&CageOptions::default()));
    text += &constant("RIG_DEFAULTS", "RigOptions", fields(&RigOptions::default()));
    text += &constant("VIEW_DEFAULTS", "View", fields(&View::default()));
    text += &constant("SCENE_DEFAULTS", "SceneOptions", fields(&JsSceneOptions::default()));
    let kinds: Vec<&str> = Coordinates::ALL.iter().map(|(word, _)| *word).collect();
    text += &constant("COORDINATES", "readonly Coordinates[]", kinds);
    let all =
        |of: fn(&FormatFacts) -> &'static [&'static str]| ModelFormat::ALL.map(|f| of(f.facts())).concat();
    let splats = ModelFormat::ALL.into_iter().filter(|format| format.holds_splats() && !format.holds_poses());
    let shapes = ModelFormat::ALL.into_iter().filter(|format| format.holds_faces() && !format.holds_poses());
    for (about, name, values) in [
        ("File extensions of models, preferred first.", "MODEL_ENDINGS", all(|facts| facts.endings)),
        (
            "Names of model files whose extension is not that of a model.",
            "MODEL_NAMES",
            all(|facts| facts.names),
        ),
        ("MIME types of models.", "MODEL_TYPES", all(|facts| facts.mime_types)),
        ("Extensions of models that refer to other files.", "NAMING_ENDINGS", all(|facts| facts.naming)),
        ("Extensions of these other files.", "COMPANION_ENDINGS", all(|facts| facts.companions)),
        ("Formats that store only a shape.", "SHAPE_FORMATS", shapes.map(ModelFormat::name).collect()),
        (
            "Formats that store splats and nothing else.",
            "SPLAT_FORMATS",
            splats.map(ModelFormat::name).collect(),
        ),
    ] {
        writeln!(text, "/** {about} */\nexport const {name} = {values:?} as const;").unwrap();
    }
    text += "/** MIME types of exported models, by extension. */\nexport const EXPORT_TYPES: Readonly<Record<string, string>> = {";
    for facts in ModelFormat::ALL.map(ModelFormat::facts) {
        let Some(mime_type) = facts.mime_types.first() else { continue };
        facts.endings.iter().for_each(|ending| write!(text, " {ending:?}: {mime_type:?},").unwrap());
    }
    text += " };\n";
    text += "/** Sliders of options, by name. */\nexport const SLIDERS = {";
    for number in NUMBERS {
        let Some(slider) = number.slider else { continue };
        write!(text, " {}: {},", number.name, serde_json::to_string(&slider).unwrap()).unwrap();
    }
    writeln!(text, " }} as const;\nexport const BOX_DIVISIONS = {BOX_DIVISIONS};").unwrap();
    writeln!(text, "export const HULL_TARGET = {HULL_TARGET};").unwrap();
    let proportions = Proportion::ALL.iter().map(|(name, proportion)| {
        let facts = proportion.facts();
        let (group, sided, natural) = (facts.group, facts.is_sided, facts.natural);
        json!({ "name": name, "group": group, "sided": sided, "natural": natural })
    });
    let about = "Proportions of a humanoid, in the order of their sliders.";
    writeln!(text, "/** {about} */\nexport const PROPORTIONS = {} as const;", Value::from_iter(proportions))
        .unwrap();
    let presets = PRESETS.map(|preset| preset.name);
    writeln!(text, "/** Presets of proportions. */\nexport const PRESETS = {presets:?} as const;").unwrap();
    let about = "Maximum length of a picture's longer side, pixels.";
    writeln!(text, "/** {about} */\nexport const MAX_PICTURE = {MAX_PICTURE};").unwrap();
    let solver = |method: Method| serde_json::to_value(method.usual_solver()).unwrap();
    let solvers: Map<String, Value> =
        Method::ALL.iter().map(|&(word, method)| (word.to_owned(), solver(method))).collect();
    text += "/** Default solver of each method. */\n";
    text += &constant("USUAL_SOLVERS", "Record<Method, Solver>", solvers);
    let mut table = "| option | unit | meaning and range |\n|---|---|---|\n".to_owned();
    for number in NUMBERS {
        writeln!(table, "| {} | {} | {} |", number.name, number.unit, number.about()).unwrap();
    }
    let limits = fs::read_to_string(LIMITS).unwrap();
    let (head, rest) = limits.split_once(TABLE_START).expect("docs/limits.md has the table's first mark");
    let (_, tail) = rest.split_once(TABLE_END).expect("docs/limits.md has the table's last mark");
    let limits = format!("{head}{TABLE_START}\n\n{table}\n{TABLE_END}{tail}");
    for (file, text) in [(FILE, text), (LIMITS, limits)] {
        if fs::read_to_string(file).unwrap_or_default() != text {
            fs::write(file, text).unwrap();
            panic!("{file} was out of date and has been rewritten: review and commit it");
        }
    }
}
