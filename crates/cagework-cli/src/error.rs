//! What can go wrong with a command, said once on stderr.

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
use thiserror::Error;

/// A path for a message.
pub(crate) fn shown_path(path: &Path) -> String {
    shown(&path.display().to_string())
}

/// Why a command failed.
#[derive(Debug, Error)]
pub(crate) enum CliError {
    /// Something about a file.
    #[error("{}: {source}", shown_path(path))]
    File {
        /// The file.
        path: PathBuf,
        /// What about it.
        source: Box<dyn Error + Send + Sync>,
    },
    /// A file's own reader already names it.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A pose is not one of the cage.
    #[error(transparent)]
    Pose(#[from] cagework_io::PoseError),
    /// The cage is not one.
    #[error("{}: {source}", shown(name))]
    Cage {
        /// File or description of the cage.
        name: String,
        /// What is wrong with it.
        source: CageError,
    },
    /// The bind did not come about.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The GPU, or a bind on it.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// No cage was generated.
    #[error(transparent)]
    CageGen(#[from] CageGenError),
    /// The cage has no smooth surface.
    #[error(transparent)]
    Controls(#[from] ControlError),
    /// The cage could not be mended.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// There are no coordinates by formula to compare with.
    #[error(transparent)]
    ClosedForm(#[from] ClosedFormError),
    /// A plot could not be drawn.
    #[error("a plot cannot be drawn: {message}")]
    Plot {
        /// Why.
        message: String,
    },
    /// Files that do not belong together, outputs that would destroy inputs and the like.
    #[error("{message}")]
    Mismatch {
        /// What is wrong, with both numbers or names.
        message: String,
        /// What to do.
        hint: &'static str,
    },
}

impl CliError {
    /// A failure that concerns one file.
    pub(crate) fn file(path: &Path, source: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::File { path: path.to_path_buf(), source: source.into() }
    }

    /// The whole message: the error and its causes, each once.
    pub(crate) fn message(&self) -> String {
        let mut text = self.to_string();
        let mut cause = self.source();
        while let Some(error) = cause {
            let said = error.to_string();
            // Some errors quote their cause, others leave that to us.
            if !text.contains(&said) {
                text = format!("{text}: {said}");
            }
            cause = error.source();
        }
        text
    }

    /// What to do about it, where that is known and not yet said.
    pub(crate) fn hint(&self) -> Option<&'static str> {
        match self {
            Self::Mismatch { hint, .. } => Some(hint),
            Self::Cage { source: CageError::Empty, .. } => {
                Some("a cage is a closed mesh around the model; `--cage auto` makes one")
            }
            Self::Bind(BindError::Outside { .. }) | Self::Gpu(GpuError::Bind(BindError::Outside { .. })) => {
                Some(
                    "`--outside extend` lets such vertices follow the cage near it, `--outside stay` leaves them where they are",
                )
            }
            Self::Bind(BindError::NoneInside { .. })
            | Self::Gpu(GpuError::Bind(BindError::NoneInside { .. })) => Some(
                "`--outside` cannot help: it is for vertices next to others that are inside; `--cage auto` makes a cage that fits",
            ),
            Self::Gpu(GpuError::NoAdapter { .. }) => Some(
                "a bind does not need one: leave out `--backend gpu`; CAGEWORK_ADAPTER chooses among several",
            ),
            Self::Bind(BindError::Memory { .. }) | Self::Gpu(GpuError::Bind(BindError::Memory { .. })) => {
                Some("the limit is set by --memory-limit, in MiB")
            }
            Self::Bind(BindError::WeightsMemory { .. })
            | Self::Gpu(GpuError::Bind(BindError::WeightsMemory { .. })) => Some(
                "the limit is set by --memory-limit, in MiB; of a rigged model `bind --static` binds the shape alone, without \
                 joints and morph targets",
            ),
            Self::Read(
                ReadError::Obj { source: ObjError::Memory(_), .. }
                | ReadError::Gltf { source: GltfError::Memory(_), .. },
            ) => Some("the limit is set by --memory-limit, in MiB"),
            Self::Repair(RepairError::NoModel) => Some("`--mesh` names it"),
            _ => None,
        }
    }
}

/// Says on stderr what went wrong, and what to do about it where that is known.
pub(crate) fn say(message: &str, hint: Option<&str>) {
    let hint = hint.map_or_else(String::new, |hint| format!("hint: {hint}\n"));
    // A closed stderr leaves nobody to tell.
    let _ = write!(std::io::stderr(), "error: {message}\n{hint}");
}
