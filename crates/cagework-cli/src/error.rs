//! Errors of the command, with hints for the user.

use std::error::Error;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use cagework_cage::check::RepairError;
use cagework_cage::generate::CageGenError;
use cagework_core::bind::BindError;
use cagework_core::cage::CageError;
use cagework_core::{ClosedFormError, ControlError};
use cagework_gpu::GpuError;
use cagework_io::{GltfError, ObjError, ReadError, shown};
use cagework_job::JobError;
use thiserror::Error;

/// Displays a path with control characters escaped.
pub(crate) fn shown_path(path: &Path) -> String {
    shown(&path.display().to_string())
}

/// Reason why a command failed.
#[derive(Debug, Error)]
pub(crate) enum CliError {
    /// An error about one file.
    #[error("{}: {source}", shown_path(path))]
    File {
        path: PathBuf,
        /// The error without the file's name.
        source: Box<dyn Error + Send + Sync>,
    },
    /// A model could not be read. The source names the file.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file does not contain a pose of the cage.
    #[error(transparent)]
    Pose(#[from] cagework_io::PoseError),
    /// A mesh is not a valid cage.
    #[error("{}: {source}", shown(name))]
    Cage {
        /// Path or description of the cage.
        name: String,
        source: CageError,
    },
    /// Poses or their times do not match the job.
    #[error(transparent)]
    Job(#[from] JobError),
    /// The bind failed.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The GPU is not available, or a bind on it failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Cage generation failed.
    #[error(transparent)]
    CageGen(#[from] CageGenError),
    /// The cage cannot be subdivided, or an inner control is invalid.
    #[error(transparent)]
    Controls(#[from] ControlError),
    /// A repair of the cage failed.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// Closed-form coordinates could not be computed.
    #[error(transparent)]
    ClosedForm(#[from] ClosedFormError),
    /// A picture could not be encoded.
    #[error("a picture cannot be encoded: {message}")]
    Picture { message: String },
    /// Files do not match each other, an output would overwrite an input, or arguments are in conflict.
    #[error("{message}")]
    Mismatch {
        /// What conflicts, with the numbers or names involved.
        message: String,
        /// What the user can do.
        hint: &'static str,
    },
}

impl CliError {
    /// Creates an error about one file.
    pub(crate) fn file(path: &Path, source: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::File { path: path.to_path_buf(), source: source.into() }
    }

    /// Creates an error about the job of one file. Errors of binds do not name the file.
    pub(crate) fn job(path: &Path, error: JobError) -> Self {
        match error {
            JobError::Bind(error) => error.into(),
            error => Self::file(path, error),
        }
    }

    /// Returns the error's message, followed by its chain of causes, each cause once.
    pub(crate) fn message(&self) -> String {
        let mut text = self.to_string();
        let mut cause = self.source();
        while let Some(error) = cause {
            let cause_text = error.to_string();
            // Some error messages already include the message of their cause.
            if !text.contains(&cause_text) {
                text = format!("{text}: {cause_text}");
            }
            cause = error.source();
        }
        text
    }

    /// Returns advice about what the user can do.
    pub(crate) fn hint(&self) -> Option<&'static str> {
        match self {
            Self::Mismatch { hint, .. } => Some(hint),
            Self::Cage { source: CageError::Empty, .. } => {
                Some("a cage is a closed mesh around the model; `--cage auto` makes one")
            }
            Self::Bind(BindError::Outside { .. }) | Self::Gpu(GpuError::Bind(BindError::Outside { .. })) => {
                Some(
                    "`--outside extend` lets vertices near the cage follow it, `--outside stay` leaves them in place",
                )
            }
            Self::Bind(BindError::NoneInside { .. })
            | Self::Gpu(GpuError::Bind(BindError::NoneInside { .. })) => Some(
                "`--outside` applies only if some vertices are inside; `--cage auto` makes a cage that fits",
            ),
            Self::Gpu(GpuError::NoAdapter { .. }) => Some(
                "binding works without a GPU: leave out `--backend gpu`; CAGEWORK_ADAPTER selects one of several adapters",
            ),
            Self::Bind(BindError::Memory { .. }) | Self::Gpu(GpuError::Bind(BindError::Memory { .. })) => {
                Some("the limit is set by --memory-limit, in MiB")
            }
            Self::Bind(BindError::WeightsMemory { .. })
            | Self::Gpu(GpuError::Bind(BindError::WeightsMemory { .. })) => Some(
                "the limit is set by --memory-limit, in MiB; `bind --static` binds a rigged model's mesh only, without \
                 joints and morph targets",
            ),
            Self::Read(
                ReadError::Obj { source: ObjError::Memory(_), .. }
                | ReadError::Gltf { source: GltfError::Memory(_), .. },
            ) => Some("the limit is set by --memory-limit, in MiB"),
            Self::Repair(RepairError::NoModel) => Some("give the model with `--mesh`"),
            _ => None,
        }
    }
}

/// Prints an error and its hint on stderr. As JSON, it is one line: an object with `error` and `hint`, which may be null.
pub(crate) fn print_error(message: &str, hint: Option<&str>, as_json: bool) {
    let text = if as_json {
        format!("{}\n", serde_json::json!({ "error": message, "hint": hint }))
    } else {
        let hint = hint.map_or_else(String::new, |hint| format!("hint: {hint}\n"));
        format!("error: {message}\n{hint}")
    };
    // Ignore failures: if stderr is closed, the error cannot be reported.
    let _ = std::io::stderr().write_all(text.as_bytes());
}
