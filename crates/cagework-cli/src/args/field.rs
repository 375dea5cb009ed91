//! Arguments of `cagework map`.

use std::path::PathBuf;

use cagework_core::field;
use clap::Args;

use super::{ControlArgs, ReadArgs, number};

/// Arguments of `cagework map`.
#[derive(Args, Debug)]
#[command(
    after_help = "Points are a table with one point per line (.csv: x, y, z first or in columns with these names; other \
    columns are kept), a NumPy array [n, 3] (.npy), or the vertices of a model or point cloud. Points inside the cage move \
    with it; further out they move less and less.\n\n\
    Examples:\n  \
    cagework map probes.csv --cage cage.obj --pose bent.obj -o moved.csv\n  \
    cagework map sliced.csv --cage cage.obj --pose bent.obj --inverse -o straight.csv"
)]
pub(crate) struct MapArgs {
    /// Points to map.
    pub(crate) points: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Cage at rest, in the units and axes of the points.
    #[arg(long, value_name = "FILE")]
    pub(crate) cage: PathBuf,
    /// Moved cage: the same vertices in the same order.
    #[arg(long, value_name = "FILE")]
    pub(crate) pose: PathBuf,
    /// Moved controls inside the cage (.obj): the same vertices in the same order.
    #[arg(long, value_name = "FILE", requires = "controls")]
    pub(crate) pose_controls: Option<PathBuf>,
    /// Map points of the deformed space back to the space at rest.
    #[arg(long)]
    pub(crate) inverse: bool,
    #[arg(long, help = field::CELLS_RANGE.about(), default_value_t = field::CELLS, value_name = "N", value_parser = number::<u32>(field::CELLS_RANGE))]
    pub(crate) cells: u32,
    /// File to write, in the format of the points; for a model, in any format.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) controls: ControlArgs,
}
