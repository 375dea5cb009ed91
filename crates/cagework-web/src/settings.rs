//! Reads the page's settings of a project. Project files are untrusted, so each value is checked.

use std::mem::discriminant;

use cagework_cage::generate::{CLEARANCE, CageOptions, DETAIL, DIVISIONS, TARGET, VOXELS};
use cagework_core::options::{GRID, INNER_RADIUS, MAX_ITERATIONS, Number, SMOOTH, SPARSIFY, TAU};
use cagework_editor::{BRUSH, PROPORTIONAL};
use cagework_io::value_fault;
use cagework_pose::pull::REACH;
use serde::Serialize;
use serde_json::{Map, Value};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::error::{ErrorName, Fault};
use crate::options::{JsBindOptions, JsRigOptions};
use crate::views::object;

/// Maximum number of characters that a notice shows of an invalid value.
const MAX_VALUE_CHARS: usize = 40;

/// Ranges of numeric options, by the names that the page uses.
pub(crate) const NUMBERS: [(&str, Number); 14] = [
    ("grid", GRID),
    ("tau", TAU),
    ("max_iterations", MAX_ITERATIONS),
    ("sparsify", SPARSIFY),
    ("vertices", TARGET),
    ("detail", DETAIL),
    ("margin", CLEARANCE),
    ("voxels", VOXELS),
    ("divisions", DIVISIONS),
    ("smooth", SMOOTH),
    ("radius", INNER_RADIUS),
    ("proportional", PROPORTIONAL),
    ("brush", BRUSH),
    ("reach", REACH),
];

/// Settings of a project, with all values valid.
#[derive(Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Settings {
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional, as = "Option<JsBindOptions>"))]
    bind: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional, as = "Option<CageOptions>"))]
    cage: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional, as = "Option<JsRigOptions>"))]
    rig: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    symmetry: Option<bool>,
    /// Notices about values that were replaced by defaults, one sentence each.
    notices: Vec<String>,
}

/// Reads the settings of a project, and replaces missing and invalid values by defaults. `text`: JSON of the settings.
/// `defaults`: JSON object with `bind`, `cage` and `rig`. The memory limit is always that of `defaults`, because the
/// right limit depends on the computer.
///
/// # Errors
/// If `defaults` is not a JSON object.
#[wasm_bindgen(js_name = readSettings, unchecked_return_type = "Settings")]
pub fn read_settings(text: &str, defaults: &str) -> Result<JsValue, JsValue> {
    let defaults: Map<String, Value> =
        serde_json::from_str(defaults).map_err(|error| Fault::new(ErrorName::Error, error))?;
    Ok(object(&Settings::read(text, &defaults))?)
}

impl Settings {
    fn read(text: &str, defaults: &Map<String, Value>) -> Self {
        let mut settings = Self::default();
        let text = if text.is_empty() { "{}" } else { text };
        let Ok(mut given) = serde_json::from_str::<Map<String, Value>>(text) else {
            settings.notices.push("The settings of this project cannot be read.".to_owned());
            return settings;
        };
        settings.bind = settings.group("bind", &mut given, defaults, |request: JsBindOptions| {
            request.options.check().map_err(|wrong| wrong.allowed)
        });
        settings.cage = settings.group("cage", &mut given, defaults, |request: CageOptions| {
            request.check().map_err(|wrong| wrong.allowed)
        });
        settings.rig = settings.group("rig", &mut given, defaults, |_: JsRigOptions| Ok(()));
        settings.symmetry = given.get("symmetry").and_then(Value::as_bool);
        settings
    }

    /// Options of one group. Each valid value replaces its default. `None` if the group is missing.
    fn group<T: serde::de::DeserializeOwned>(
        &mut self,
        name: &str,
        given: &mut Map<String, Value>,
        defaults: &Map<String, Value>,
        check: impl Fn(T) -> Result<(), &'static str>,
    ) -> Option<Map<String, Value>> {
        let Value::Object(given) = given.remove(name)? else { return None };
        let defaults = defaults.get(name)?.as_object()?;
        let mut taken = defaults.clone();
        for (key, default) in defaults.iter().filter(|(key, _)| *key != "memory_limit") {
            let Some(value) = given.get(key) else { continue };
            taken.insert(key.clone(), value.clone());
            let wrong = match is_in_range(key, value) {
                Err(allowed) => Some(format!("; it must be {allowed}")),
                // serde also accepts an object whose key is the variant's name, so compare the JSON types first.
                Ok(()) if discriminant(value) != discriminant(default) => Some(String::new()),
                Ok(()) => match serde_json::from_value(Value::Object(taken.clone())) {
                    Err(error) => Some(format!(" ({})", value_fault(&error.to_string()))),
                    Ok(request) => check(request).err().map(|allowed| format!("; it must be {allowed}")),
                },
            };
            if let Some(wrong) = wrong {
                let (name, value, instead) = (key.replace('_', " "), shown(value), shown(default));
                self.notices
                    .push(format!("In this project {name} is {value}{wrong}: {instead} is taken instead."));
                taken.insert(key.clone(), default.clone());
            }
        }
        Some(taken)
    }
}

/// Checks a numeric option against its range; accepts other options. The error is the allowed range.
fn is_in_range(key: &str, value: &Value) -> Result<(), &'static str> {
    let Some((_, number)) = NUMBERS.iter().find(|(name, _)| *name == key) else { return Ok(()) };
    number.check(value.as_f64().unwrap_or(f64::NAN)).map_err(|wrong| wrong.allowed)
}

fn shown(value: &Value) -> String {
    value.to_string().chars().take(MAX_VALUE_CHARS).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const GIB: u64 = 1 << 30;

    /// Default settings of the page.
    fn defaults() -> Map<String, Value> {
        let all = json!({
            "bind": {
                "grid": 64, "method": "embedded", "solver": "multigrid", "preconditioner": "none",
                "backend": "gpu", "cell_shape": "box", "delta_norm": "euclidean", "tau": 1e-5,
                "max_iterations": 20_000, "sparsify": 0, "outside": "extend", "memory_limit": 2 * GIB,
            },
            "cage": {
                "vertices": 80, "margin": 0, "symmetry": "auto", "voxels": 0, "shape": "follow",
                "detail": 0.028,
                "quads": true,
                "per_component": false,
            },
            "rig": { "joints": "follow", "keep_travel": false, "rigid": [], "plain": false, "dynamic": false },
        });
        all.as_object().cloned().unwrap()
    }

    fn read(settings: &Value) -> Settings {
        Settings::read(&settings.to_string(), &defaults())
    }

    #[test]
    fn settings_round_trip() {
        let mut saved = defaults();
        saved["bind"]["grid"] = json!(128);
        saved["bind"]["tau"] = json!(0.001);
        saved["cage"]["vertices"] = json!(120);
        saved["rig"] = json!({ "joints": "stay", "keep_travel": true, "rigid": ["hat"], "plain": false, "dynamic": true });
        let rest = json!({ "symmetry": true });
        saved.extend(rest.as_object().cloned().unwrap());
        let settings = read(&Value::Object(saved.clone()));
        assert_eq!(settings.notices, Vec::<String>::new());
        assert_eq!(serde_json::to_value(settings).unwrap(), {
            saved.insert("notices".to_owned(), json!([]));
            Value::Object(saved)
        });
    }

    #[test]
    fn missing_options_get_defaults() {
        let settings = read(&json!({ "bind": { "grid": 32 }, "cage": { "vertices": 120 } }));
        assert_eq!(settings.rig, None);
        let bind = settings.bind.unwrap();
        assert_eq!((&bind["grid"], &bind["preconditioner"]), (&json!(32), &json!("none")));
        let cage = settings.cage.unwrap();
        assert_eq!((&cage["vertices"], &cage["voxels"]), (&json!(120), &json!(0)));
        assert_eq!(read(&json!({})), Settings::default());
        assert_eq!(Settings::read("", &defaults()), Settings::default());
    }

    /// If such values were accepted, every bind and memory estimate would fail until the page is reloaded.
    #[test]
    fn invalid_values_are_replaced_by_defaults() {
        for (group, key, value, allowed) in [
            ("bind", "grid", json!(64.5), "a whole number from 8 to 512"),
            ("bind", "grid", json!(100_000), "a whole number from 8 to 512"),
            ("bind", "tau", json!(0), "a number above 0"),
            // This number is positive as f64, but 0 as f32, the type that the solver uses.
            ("bind", "tau", json!(1e-60), "a number above 0"),
            ("bind", "max_iterations", json!(1e300), "has the wrong type"),
            ("bind", "sparsify", json!(0.5), "a threshold below 0.1"),
            ("bind", "solver", json!("gauss"), "one of jacobi"),
            ("bind", "backend", json!({ "gpu": null }), "is taken instead"),
            ("cage", "vertices", json!(9_000_000_000_u64), "a whole number from 8 to 400"),
            ("cage", "vertices", json!("many"), "a whole number from 8 to 400"),
            ("cage", "margin", json!(-0.1), "from 0 to 0.25"),
            ("cage", "voxels", json!(4), "8 to 128"),
            ("rig", "joints", json!("dance"), "one of follow"),
            ("rig", "rigid", json!([7]), "is taken instead"),
        ] {
            let mut given = json!({ "bind": { "grid": 32 }, "cage": { "vertices": 100 }, "rig": {} });
            given[group][key] = value.clone();
            let settings = serde_json::to_value(read(&given)).unwrap();
            assert_eq!(settings[group][key], defaults()[group][key], "{key} {value}");
            let notices = settings["notices"].as_array().unwrap();
            assert!(notices.len() == 1 && notices[0].as_str().unwrap().contains(allowed), "{notices:?}");
            // Valid values of the same group are kept.
            if key != "grid" {
                assert_eq!(settings["bind"]["grid"], 32);
            }
        }
    }

    #[test]
    fn a_file_does_not_change_the_memory_limit() {
        for bytes in [json!(0), json!(-1), json!(1_000_000_000_000_000_000_u64), json!(1e18), json!("all")] {
            let settings = read(&json!({ "bind": { "memory_limit": bytes } }));
            assert_eq!(
                (&settings.bind.unwrap()["memory_limit"], settings.notices.len()),
                (&json!(2 * GIB), 0)
            );
        }
    }

    #[test]
    fn malformed_settings_give_defaults_and_a_notice() {
        for text in ["not json", "[1]", "7"] {
            let settings = Settings::read(text, &defaults());
            assert_eq!(settings.notices, ["The settings of this project cannot be read."]);
            assert_eq!((settings.bind, settings.cage), (None, None));
        }
        let odd =
            read(&json!({ "bind": "none", "cage": [], "pose": 7, "sample": "nobody", "symmetry": "yes" }));
        assert_eq!(odd, Settings::default());
    }
}
