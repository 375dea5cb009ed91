//! Options of bind, cage and export that the page stores in projects. Project files are untrusted, so each value is
//! checked.

use cagework_cage::generate::{CLEARANCE, CageOptions, DETAIL, DIVISIONS, TARGET, VOXELS};
use cagework_core::BindOptions;
use cagework_core::options::{
    Backend, GRID, INNER_RADIUS, MAX_ITERATIONS, Number, RangeError, SMOOTH_STEPS, SPARSIFY, TAU,
};
use cagework_io::value_fault;
use cagework_pose::proportions::FACTOR;
use cagework_pose::pull::REACH;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::options::{BRUSH, PROPORTIONAL_RADIUS, RigOptions};

/// Default memory limit of a bind in the page, bytes: half of the 4 GiB that a browser tab can address.
const BIND_LIMIT: u64 = 2 << 30;

/// Maximum number of characters that a notice shows of an invalid value.
const MAX_VALUE_CHARS: usize = 40;

/// Numeric options of the page.
pub const NUMBERS: [Number; 15] = [
    GRID,
    TAU,
    MAX_ITERATIONS,
    SPARSIFY,
    TARGET,
    DETAIL,
    CLEARANCE,
    VOXELS,
    DIVISIONS,
    SMOOTH_STEPS,
    INNER_RADIUS,
    PROPORTIONAL_RADIUS,
    BRUSH,
    REACH,
    FACTOR,
];

/// Options of a bind, and the processor that it runs on.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS), ts(rename = "BindOptions"))]
pub struct PageBindOptions {
    /// The processor.
    pub backend: Backend,
    /// Options of the bind.
    #[serde(flatten)]
    pub options: BindOptions,
}

impl Default for PageBindOptions {
    fn default() -> Self {
        let options = BindOptions { memory_limit: BIND_LIMIT, ..BindOptions::default() };
        Self { backend: Backend::Gpu, options }
    }
}

/// Fields of options as JSON, without `threads` and `smooth`, which JavaScript does not set.
#[must_use]
pub fn fields(options: &impl Serialize) -> Map<String, Value> {
    // Text keeps the digits of an `f32`; `serde_json::to_value` would widen it to `f64`.
    let text = serde_json::to_string(options).unwrap_or_default();
    let mut fields: Map<String, Value> = serde_json::from_str(&text).unwrap_or_default();
    // The page binds with one thread, and smoothing is a property of the cage.
    fields.retain(|name, _| name != "threads" && name != "smooth");
    fields
}

/// Settings of a project, with all values valid.
#[derive(Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Settings {
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "typescript", ts(optional, as = "Option<PageBindOptions>"))]
    bind: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "typescript", ts(optional, as = "Option<CageOptions>"))]
    cage: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "typescript", ts(optional, as = "Option<RigOptions>"))]
    rig: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "typescript", ts(optional))]
    symmetry: Option<bool>,
    /// Notices about values that were replaced by defaults, one sentence each.
    notices: Vec<String>,
}

impl Settings {
    /// Reads the settings of a project. Missing and invalid values of a group become defaults; a missing group stays
    /// undefined. `text`: JSON of the settings. `memory_limit`: the most memory that a bind may use, bytes. The limit in
    /// the file is ignored, because the right limit depends on the computer.
    #[must_use]
    pub fn read(text: &str, memory_limit: u64) -> Self {
        let mut settings = Self::default();
        let text = if text.is_empty() { "{}" } else { text };
        let Ok(mut given) = serde_json::from_str::<Map<String, Value>>(text) else {
            settings.notices.push("The settings of this project cannot be read.".to_owned());
            return settings;
        };
        settings.bind = settings.group(given.remove("bind"), |read: &PageBindOptions| read.options.check());
        settings.cage = settings.group(given.remove("cage"), CageOptions::check);
        settings.rig = settings.group(given.remove("rig"), |_: &RigOptions| Ok(()));
        if let Some(bind) = &mut settings.bind {
            bind.insert("memory_limit".to_owned(), memory_limit.into());
        }
        settings.symmetry = given.get("symmetry").and_then(Value::as_bool);
        settings
    }

    /// Reads the options of one group. Each valid value replaces its default. `None` if the group is missing.
    fn group<T: Default + Serialize + DeserializeOwned>(
        &mut self,
        given: Option<Value>,
        check: impl Fn(&T) -> Result<(), RangeError>,
    ) -> Option<Map<String, Value>> {
        let Value::Object(given) = given? else { return None };
        let defaults = fields(&T::default());
        let mut taken = defaults.clone();
        for (key, value) in given.into_iter().filter(|(key, _)| key != "memory_limit") {
            let is_in_range = NUMBERS
                .iter()
                .find(|number| number.name == key)
                .map_or(Ok(()), |number| number.check(value.as_f64().unwrap_or(f64::NAN)));
            let one = Map::from_iter([(key.clone(), value.clone())]);
            let read = serde_json::from_value::<T>(one.into());
            let wrong = match (is_in_range, read) {
                (Err(wrong), _) => format!("; it must be {}", wrong.allowed),
                (_, Err(error)) => format!(" ({})", value_fault(&error.to_string())),
                (_, Ok(read)) => match check(&read) {
                    Err(wrong) => format!("; it must be {}", wrong.allowed),
                    Ok(()) => {
                        if let (Some(place), Some(value)) = (taken.get_mut(&key), fields(&read).remove(&key))
                        {
                            *place = value;
                        }
                        continue;
                    }
                },
            };
            let instead = defaults.get(&key).map_or_else(|| "the default".to_owned(), shown);
            let (name, value) = (key.replace('_', " "), shown(&value));
            self.notices
                .push(format!("In this project {name} is {value}{wrong}: {instead} is used instead."));
        }
        Some(taken)
    }
}

fn shown(value: &Value) -> String {
    value.to_string().chars().take(MAX_VALUE_CHARS).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const GIB: u64 = 1 << 30;

    /// Default options of bind, cage and rig.
    fn defaults() -> Value {
        let (bind, cage) = (fields(&PageBindOptions::default()), fields(&CageOptions::default()));
        json!({ "bind": bind, "cage": cage, "rig": fields(&RigOptions::default()) })
    }

    fn read(settings: &Value) -> Settings {
        Settings::read(&settings.to_string(), 2 * GIB)
    }

    #[test]
    fn settings_round_trip() {
        let mut saved = defaults();
        saved["bind"]["grid"] = json!(128);
        saved["bind"]["tau"] = json!(0.001);
        saved["cage"]["target"] = json!(120);
        saved["rig"] = json!({
            "joints": "stay", "keep_travel": true, "ground": true, "feet": "lock", "rigid": ["hat"],
            "expressions": true, "plain": false, "dynamic": true, "ground_off": true,
        });
        saved["symmetry"] = json!(true);
        let settings = read(&saved);
        assert_eq!(settings.notices, Vec::<String>::new());
        saved["notices"] = json!([]);
        assert_eq!(serde_json::to_value(settings).unwrap(), saved);
    }

    #[test]
    fn missing_options_get_defaults() {
        let settings = read(&json!({ "bind": { "grid": 32 }, "cage": { "target": 120 } }));
        assert_eq!(settings.rig, None);
        let bind = settings.bind.unwrap();
        assert_eq!((&bind["grid"], &bind["solver"]), (&json!(32), &json!("multigrid")));
        let cage = settings.cage.unwrap();
        assert_eq!((&cage["target"], &cage["voxels"]), (&json!(120), &json!(0)));
        assert_eq!(read(&json!({})), Settings::default());
        assert_eq!(Settings::read("", 2 * GIB), Settings::default());
    }

    /// If invalid values were accepted, every bind and memory estimate would fail until the page is reloaded.
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
            ("cage", "target", json!(9_000_000_000_u64), "a whole number from 8 to 400"),
            ("cage", "target", json!("many"), "a whole number from 8 to 400"),
            ("cage", "clearance", json!(-0.1), "from 0 to 0.25"),
            ("cage", "voxels", json!(4), "8 to 128"),
            ("rig", "joints", json!("dance"), "one of follow"),
            ("rig", "feet", json!("glue"), "one of free"),
            ("rig", "rigid", json!([7]), "is used instead"),
        ] {
            let mut given = json!({ "bind": { "grid": 32 }, "cage": { "target": 100 }, "rig": {} });
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
            let settings = Settings::read(text, 2 * GIB);
            assert_eq!(settings.notices, ["The settings of this project cannot be read."]);
            assert_eq!((settings.bind, settings.cage), (None, None));
        }
        let odd =
            read(&json!({ "bind": "none", "cage": [], "pose": 7, "sample": "nobody", "symmetry": "yes" }));
        assert_eq!(odd, Settings::default());
    }
}
