//! What can be said about cages: where one comes from, how one is made, what is checked and mended.

use std::path::PathBuf;
use std::str::FromStr;

use cagework_cage::check::Repair;
use cagework_cage::generate::{CageOptions, DETAIL, MAX_TARGET, MIN_TARGET, Shape, Symmetry};
use clap::{Args, ValueEnum};

use super::{MemoryArgs, ModelOutput, ReadArgs, SmoothArgs, fraction, positive};

/// Quads along each edge of a box cage unless said otherwise.
pub(crate) const DEFAULT_DIVISIONS: u32 = 2;
/// Room around the model in a box cage, as a fraction of its bounding box's diagonal.
pub(crate) const DEFAULT_MARGIN: f32 = 0.05;
/// 16 divisions make 1,538 cage vertices: more than anyone moves by hand, and still solved in minutes.
const MAX_DIVISIONS: u32 = 16;
/// Vertices of a generated cage unless said otherwise: enough for body, head and four limbs.
const DEFAULT_TARGET: u32 = 80;
/// Vertices of a hull unless said otherwise.
const DEFAULT_HULL: u32 = 24;

/// `cagework cage`
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    cagework cage horse.glb -o cage.obj\n  \
    cagework cage horse.glb -o cage.glb --vertices 120 --symmetry x\n  \
    cagework cage horse.glb -o box.obj --kind box --divisions 3")]
pub(crate) struct CageArgs {
    /// Model to make a cage for.
    #[arg(help = super::model_help("Model to make a cage for"))]
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// File to write (.obj keeps the cage's vertices as they are, .glb opens anywhere).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: ModelOutput,
    /// What the cage follows: the model limb by limb, its box, or its convex hull
    /// [default: auto; box if --divisions is given].
    #[arg(long, value_enum)]
    pub(crate) kind: Option<KindArg>,
    /// Most vertices of the cage, 8 to 400: a shape that needs fewer gets fewer [default: 80; 24 for a hull].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(i64::from(MIN_TARGET)..=i64::from(MAX_TARGET)))]
    pub(crate) vertices: Option<u32>,
    /// How far the cage may be from the model's shape, as a fraction of its longest side, 0.005 to 0.2.
    #[arg(long, default_value_t = CageOptions::default().detail, value_name = "FRACTION", value_parser = super::number::<f32>(DETAIL))]
    pub(crate) detail: f32,
    /// Triangles only, no quads.
    #[arg(long)]
    pub(crate) triangles: bool,
    /// Make the cage its own mirror image: if the model is (auto), never, or along an axis in any case.
    #[arg(long, default_value_t, value_parser = super::words::<Symmetry>())]
    pub(crate) symmetry: Symmetry,
    /// One closed part for each separate part of the model, instead of bridges between them.
    #[arg(long)]
    pub(crate) per_component: bool,
    /// Distance to keep from the model, as a fraction of its bounding box's diagonal [default: half a voxel].
    /// Gaps up to twice as wide are closed.
    #[arg(long, default_value_t = 0.0, value_name = "FRACTION", value_parser = fraction)]
    pub(crate) clearance: f32,
    /// Voxels along the model's longest side, 8 to 128; gaps below three of them are closed. 0: by the vertices.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) voxels: u32,
    #[command(flatten)]
    pub(crate) smooth: SmoothArgs,
    /// Name of a clip of which the cage encloses every frame, too.
    #[arg(long, value_name = "NAME")]
    pub(crate) around_clip: Option<String>,
    /// Quads along each edge of a box.
    #[arg(long, value_name = "N", value_parser = divisions)]
    pub(crate) divisions: Option<u32>,
    /// Room around the model in a box, as a fraction of its bounding box's diagonal.
    #[arg(long, default_value_t = DEFAULT_MARGIN, value_name = "FRACTION", value_parser = positive)]
    pub(crate) margin: f32,
}

impl CageArgs {
    /// The kind that was asked for, by name or by an option that only one kind has.
    pub(crate) fn kind(&self) -> KindArg {
        let guess = if self.divisions.is_some() { KindArg::Box } else { KindArg::Auto };
        self.kind.unwrap_or(guess)
    }

    /// The options of a generated cage.
    pub(crate) fn options(&self) -> CageOptions {
        let hull = self.kind() == KindArg::Hull;
        CageOptions {
            target: self.vertices.unwrap_or(if hull { DEFAULT_HULL } else { DEFAULT_TARGET }),
            detail: self.detail,
            quads: !self.triangles,
            shape: if hull { Shape::Hull } else { Shape::Follow },
            symmetry: self.symmetry,
            per_component: self.per_component,
            clearance: self.clearance,
            voxels: self.voxels,
            smooth: self.smooth.smooth,
        }
    }
}

/// `cagework check`
#[derive(Args, Debug)]
#[command(after_help = "The exit code is 1 if the mesh cannot be used as a cage.\n\n\
    Examples:\n  \
    cagework check cage.obj\n  \
    cagework check cage.obj --mesh horse.glb -g 64 --json\n  \
    cagework check cage.obj --repair weld,fill-holes,flip -o mended.obj\n  \
    cagework check cage.obj --mesh horse.glb --repair grow -o grown.obj")]
pub(crate) struct CheckArgs {
    /// The cage.
    #[arg(help = super::model_help("The cage"))]
    pub(crate) cage: PathBuf,
    /// The model that should be inside.
    #[arg(long, value_name = "FILE")]
    pub(crate) mesh: Option<PathBuf>,
    /// Look for parts thinner than a cell of a grid with so many cells, 8 to 512.
    #[arg(short, long, default_value_t = 64, value_parser = super::number::<u32>(cagework_core::options::GRID))]
    pub(crate) grid: u32,
    /// Mend it first; several, separated by commas.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "WHAT", requires = "output")]
    pub(crate) repair: Vec<RepairArg>,
    /// Write the mended cage; the name's ending says the format.
    #[arg(short, long, value_name = "FILE", requires = "repair")]
    pub(crate) output: Option<ModelOutput>,
    #[command(flatten)]
    pub(crate) smooth: SmoothArgs,
    #[command(flatten)]
    pub(crate) memory: MemoryArgs,
}

/// Where a cage comes from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum CageSource {
    /// A file.
    File(PathBuf),
    /// A subdivided box around the mesh.
    Box {
        /// Quads along each edge.
        divisions: u32,
    },
    /// A generated cage.
    Auto(CageOptions),
}

impl FromStr for CageSource {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, number) = text.split_once(':').map_or((text, None), |(kind, n)| (kind, Some(n)));
        let generated = |shape, default| {
            let target = number.map_or(Ok(default), target)?;
            Ok(Self::Auto(CageOptions { target, shape, ..CageOptions::default() }))
        };
        match kind {
            "box" => Ok(Self::Box { divisions: number.map_or(Ok(DEFAULT_DIVISIONS), divisions)? }),
            "auto" => generated(Shape::Follow, DEFAULT_TARGET),
            "hull" => generated(Shape::Hull, DEFAULT_HULL),
            _ => Ok(Self::File(PathBuf::from(text))),
        }
    }
}

/// Kinds of cages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum KindArg {
    Auto,
    Box,
    Hull,
}

/// Repairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum RepairArg {
    /// Join vertices at one place.
    Weld,
    /// Drop faces without area, doubled faces and unused vertices.
    DropDegenerate,
    /// Add the other half of a cage that ends in a plane across an axis.
    Mirror,
    /// Close holes.
    FillHoles,
    /// Turn faces outward.
    Flip,
    /// Move vertices outward until the model is inside.
    Grow,
}

impl From<RepairArg> for Repair {
    fn from(arg: RepairArg) -> Self {
        match arg {
            RepairArg::Weld => Self::Weld,
            RepairArg::DropDegenerate => Self::DropDegenerate,
            RepairArg::Mirror => Self::Mirror,
            RepairArg::FillHoles => Self::FillHoles,
            RepairArg::Flip => Self::Flip,
            RepairArg::Grow => Self::Grow,
        }
    }
}

fn divisions(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(n) if (1..=MAX_DIVISIONS).contains(&n) => Ok(n),
        _ => Err(format!("divisions of a box cage are a whole number from 1 to {MAX_DIVISIONS}")),
    }
}

fn target(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(n) if (MIN_TARGET..=MAX_TARGET).contains(&n) => Ok(n),
        _ => {
            Err(format!("vertices of a generated cage are a whole number from {MIN_TARGET} to {MAX_TARGET}"))
        }
    }
}
