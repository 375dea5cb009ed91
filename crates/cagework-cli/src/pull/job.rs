//! Reads the JSON file of `cagework pull --job`.

use std::path::{Path, PathBuf};

use cagework_io::{json_fault, shown, without_byte_order_mark};
use cagework_pose::pull::{DRAG_FRAMES, Handle, Reach};
use glam::{DVec3, Vec3};
use serde::Deserialize;

use crate::error::CliError;
use crate::files::{read, shown_path};

/// Maximum size of a job file, bytes. It is enough for thousands of grabs.
const MAX_JOB_BYTES: usize = 1 << 20;

/// Maximum number of frames of a drag.
const MAX_FRAMES: u32 = 10_000;

/// Contents of a job file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct JobJson {
    grabs: Vec<HandleJson>,
    #[serde(default)]
    pins: Vec<HandleJson>,
    #[serde(default)]
    reach: Option<ReachJson>,
    start: Option<PathBuf>,
    #[serde(default = "half")]
    relax: f64,
    #[serde(default = "default_frames")]
    frames: u32,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct HandleJson {
    vertex: Option<u32>,
    triangle: Option<u32>,
    bary: Option<[f64; 3]>,
    cage: Option<u32>,
    to: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum ReachJson {
    Fraction(f64),
    Word(String),
}

fn half() -> f64 {
    0.5
}

fn default_frames() -> u32 {
    DRAG_FRAMES
}

/// A job with validated values.
pub(super) struct Job {
    pub(super) grabs: Vec<Handle>,
    /// Target position of each grab, in the file's axes. `[n_grabs]`, object units
    to: Vec<DVec3>,
    pub(super) pins: Vec<Handle>,
    pub(super) reach: Reach,
    /// File of the cage's initial pose; `None` for the rest pose.
    pub(super) start: Option<PathBuf>,
    pub(super) relax: f64,
    pub(super) frames: u32,
}

impl Job {
    /// Target position of each grab relative to `origin`, in the file's axes. `[n_grabs]`, object units
    pub(super) fn to(&self, origin: DVec3) -> Vec<Vec3> {
        self.to.iter().map(|&to| (to - origin).as_vec3()).collect()
    }

    /// Reads a job from a file. Vertex and triangle indices are not checked here, because that needs the model.
    ///
    /// # Errors
    /// If the file cannot be read or is larger than [`MAX_JOB_BYTES`], or its JSON or a value is invalid.
    pub(super) fn read(path: &Path) -> Result<Self, CliError> {
        let bytes = read(path)?;
        let wrong = |what: String| CliError::Mismatch {
            message: format!("{}: {what}", shown_path(path)),
            hint: "see `cagework pull --help` for an example of a job",
        };
        if bytes.len() > MAX_JOB_BYTES {
            return Err(wrong(format!(
                "has {} kB; a job has at most {} kB",
                bytes.len() >> 10,
                MAX_JOB_BYTES >> 10
            )));
        }
        let text = without_byte_order_mark(&bytes);
        let file: JobJson = serde_json::from_slice(text)
            .map_err(|e| wrong(format!("not a job: {}", json_fault(text, &e))))?;
        let handle = |list: &str, k: usize, handle: &HandleJson| match handle {
            HandleJson { vertex: Some(v), triangle: None, bary: None, cage: None, .. } => {
                Ok(Handle::Vertex(*v))
            }
            HandleJson { triangle: Some(t), vertex: None, cage: None, bary, .. } => {
                Ok(Handle::Triangle(*t, bary.unwrap_or([1.0 / 3.0; 3])))
            }
            HandleJson { cage: Some(i), vertex: None, triangle: None, bary: None, .. } => {
                Ok(Handle::Cage(*i))
            }
            _ => Err(wrong(format!("{list} {k} needs one of vertex, triangle (with bary) and cage"))),
        };
        let reach = match file.reach {
            None => Reach::Automatic,
            Some(ReachJson::Fraction(fraction)) => Reach::Of(fraction),
            Some(ReachJson::Word(word)) if word == "all" => Reach::Whole,
            Some(ReachJson::Word(word)) => {
                return Err(wrong(format!(
                    "the reach is '{}'; it must be null, a number or \"all\"",
                    shown(&word)
                )));
            }
        };
        if !(1..=MAX_FRAMES).contains(&file.frames) {
            return Err(wrong(format!("frames is {}; it must be from 1 to {MAX_FRAMES}", file.frames)));
        }
        let mut grabs = Vec::with_capacity(file.grabs.len());
        let mut to = Vec::with_capacity(file.grabs.len());
        for (k, grab) in file.grabs.iter().enumerate() {
            grabs.push(handle("grab", k, grab)?);
            let target = grab.to.ok_or_else(|| wrong(format!("grab {k} has no target \"to\": [x, y, z]")))?;
            if let Some(x) = target.map(|x| x as f32).iter().find(|x| !x.is_finite()) {
                return Err(wrong(format!(
                    "grab {k} has the target coordinate {x}; 32-bit floats end at {:e}",
                    f32::MAX
                )));
            }
            to.push(DVec3::from_array(target));
        }
        if let Some(k) = file.pins.iter().position(|pin| pin.to.is_some()) {
            return Err(wrong(format!(
                "pin {k} has a target \"to\", but pins stay in place: leave \"to\" out, or list it among the grabs"
            )));
        }
        let pins =
            file.pins.iter().enumerate().map(|(k, pin)| handle("pin", k, pin)).collect::<Result<_, _>>()?;
        // A relative path refers to the job's folder if the file exists there, otherwise to the working directory.
        let resolve = |start: PathBuf| {
            let beside = path.parent().unwrap_or(Path::new("")).join(&start);
            if beside.exists() { beside } else { start }
        };
        let start = file.start.map(resolve);
        Ok(Self { grabs, to, pins, reach, start, relax: file.relax, frames: file.frames })
    }
}

#[cfg(test)]
mod tests {
    use cagework_core::words::grouped;
    use clap::CommandFactory;

    use super::*;
    use crate::args::Cli;

    #[test]
    fn help_gives_the_defaults_and_the_limit_of_frames() {
        let command = Cli::command();
        let pull = command.find_subcommand("pull").expect("the command has this subcommand");
        let help = pull.get_after_help().expect("pull describes jobs").to_string();
        let frames = format!("1 to {}; the default is {DRAG_FRAMES}.", grouped(MAX_FRAMES as usize));
        assert!(help.contains(&frames), "{help}");
        assert!(help.contains(&format!("the default is {}.", half())), "{help}");
    }
}
