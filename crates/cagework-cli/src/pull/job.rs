//! What to pull where: the JSON of `cagework pull --job`.

use std::path::{Path, PathBuf};

use cagework_io::{json_fault, shown};
use cagework_pose::pull::{Handle, Reach};
use glam::{DVec3, Vec3};
use serde::Deserialize;

use crate::error::CliError;
use crate::files::{read, shown_path};

/// Largest file of a job, bytes: thousands of grabs.
const MAX_JOB_BYTES: usize = 1 << 20;

/// Most frames of a drag.
const MAX_FRAMES: u32 = 10_000;

/// A job as its file says it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Said {
    grabs: Vec<HandleSaid>,
    #[serde(default)]
    pins: Vec<HandleSaid>,
    #[serde(default)]
    reach: Option<ReachSaid>,
    start: Option<PathBuf>,
    #[serde(default = "half")]
    relax: f64,
    #[serde(default = "thirty")]
    frames: u32,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct HandleSaid {
    vertex: Option<u32>,
    triangle: Option<u32>,
    bary: Option<[f64; 3]>,
    cage: Option<u32>,
    to: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum ReachSaid {
    Of(f64),
    Word(String),
}

fn half() -> f64 {
    0.5
}

fn thirty() -> u32 {
    30
}

/// A job.
pub(super) struct Job {
    pub(super) grabs: Vec<Handle>,
    /// Where each grab goes, in the file's axes. `[n_grabs]`, object units
    to: Vec<DVec3>,
    pub(super) pins: Vec<Handle>,
    pub(super) reach: Reach,
    /// A pose of the cage to begin with.
    pub(super) start: Option<PathBuf>,
    pub(super) relax: f64,
    pub(super) frames: u32,
}

impl Job {
    /// Where each grab goes, in the file's axes, as seen from an origin. `[n_grabs]`, object units
    pub(super) fn to(&self, origin: DVec3) -> Vec<Vec3> {
        self.to.iter().map(|&to| (to - origin).as_vec3()).collect()
    }

    /// Reads a job; numbers of vertices are checked by who knows the model.
    ///
    /// # Errors
    /// When the file cannot be read, is no JSON, or asks for what there is not.
    pub(super) fn read(path: &Path) -> Result<Self, CliError> {
        let bytes = read(path)?;
        let wrong = |what: String| CliError::Mismatch {
            message: format!("{}: {what}", shown_path(path)),
            hint: "see `cagework pull --help` for an example of a job",
        };
        if bytes.len() > MAX_JOB_BYTES {
            return Err(wrong(format!(
                "is {} kB long; a job has at most {} kB",
                bytes.len() >> 10,
                MAX_JOB_BYTES >> 10
            )));
        }
        let said: Said = serde_json::from_slice(&bytes)
            .map_err(|e| wrong(format!("is no job: {}", json_fault(&bytes, &e))))?;
        let handle = |list: &str, k: usize, said: &HandleSaid| match said {
            HandleSaid { vertex: Some(v), triangle: None, bary: None, cage: None, .. } => {
                Ok(Handle::Vertex(*v))
            }
            HandleSaid { triangle: Some(t), vertex: None, cage: None, bary, .. } => {
                Ok(Handle::Triangle(*t, bary.unwrap_or([1.0 / 3.0; 3])))
            }
            HandleSaid { cage: Some(i), vertex: None, triangle: None, bary: None, .. } => {
                Ok(Handle::Cage(*i))
            }
            _ => Err(wrong(format!("{list} {k} must name one of vertex, triangle (with bary) and cage"))),
        };
        let reach = match said.reach {
            None => Reach::Automatic,
            Some(ReachSaid::Of(share)) => Reach::Of(share),
            Some(ReachSaid::Word(word)) if word == "all" => Reach::Whole,
            Some(ReachSaid::Word(word)) => {
                return Err(wrong(format!(
                    "the reach is '{}'; it must be null, a number or \"all\"",
                    shown(&word)
                )));
            }
        };
        if !(1..=MAX_FRAMES).contains(&said.frames) {
            return Err(wrong(format!("frames is {}; it must be from 1 to {MAX_FRAMES}", said.frames)));
        }
        let mut grabs = Vec::with_capacity(said.grabs.len());
        let mut to = Vec::with_capacity(said.grabs.len());
        for (k, grab) in said.grabs.iter().enumerate() {
            grabs.push(handle("grab", k, grab)?);
            let target = grab.to.ok_or_else(|| wrong(format!("grab {k} has no target \"to\": [x, y, z]")))?;
            if let Some(x) = target.map(|x| x as f32).iter().find(|x| !x.is_finite()) {
                return Err(wrong(format!("grab {k} goes to {x}: numbers of 32 bits end at {:e}", f32::MAX)));
            }
            to.push(DVec3::from_array(target));
        }
        let pins =
            said.pins.iter().enumerate().map(|(k, pin)| handle("pin", k, pin)).collect::<Result<_, _>>()?;
        let beside = |start: PathBuf| {
            let beside = path.parent().unwrap_or(Path::new("")).join(&start);
            if beside.exists() { beside } else { start }
        };
        let start = said.start.map(beside);
        Ok(Self { grabs, to, pins, reach, start, relax: said.relax, frames: said.frames })
    }
}
