//! Arguments that say where a cage comes from, and how it is generated, checked and repaired.

use std::path::PathBuf;
use std::str::FromStr;

use cagework_cage::check::Repair;
use cagework_cage::generate::{
    BOX_DIVISIONS, BOX_MARGIN, CLEARANCE, CageKind, CageOptions, DETAIL, DIVISIONS, HULL_TARGET, Symmetry,
    TARGET, VOXELS,
};
use cagework_core::options::{GRID, Number, parse_grid};
use cagework_io::MAX_CLIP_TIMES;
use clap::{Args, ValueEnum};

use super::{MemoryArgs, ModelOutput, ReadArgs, SmoothArgs, positive};
use crate::error::CliError;

/// Arguments of `cagework cage`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    cagework cage horse.glb -o cage.obj\n  \
    cagework cage horse.glb -o cage.glb --vertices 120 --symmetry x\n  \
    cagework cage body.glb clothes -o cage.obj   (one cage around a body and a folder of clothes)\n  \
    cagework cage horse.glb -o box.obj --kind box --divisions 3")]
pub(crate) struct CageArgs {
    /// Models that the cage encloses together, and folders of models.
    #[arg(value_name = "MODEL", required = true, help = super::model_help("Models that the cage encloses together, and folders of models"))]
    pub(crate) models: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// File to write (.obj keeps the order of the cage's vertices; .glb opens in any viewer).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: ModelOutput,
    /// Kind of cage: skeleton has rings of quads along the limbs, shell follows the surface, hull is the convex hull,
    /// box the bounding box; auto is skeleton if it fits well, otherwise shell
    /// [default: auto; box if --divisions is given].
    #[arg(long, value_enum)]
    pub(crate) kind: Option<KindArg>,
    #[arg(long, help = format!("{} [default: {}; {HULL_TARGET} for a hull]", TARGET.about(), CageOptions::default().target), value_name = "N", value_parser = super::number::<u32>(TARGET))]
    pub(crate) vertices: Option<u32>,
    #[arg(long, help = DETAIL.about(), default_value_t = CageOptions::default().detail, value_name = "FRACTION", value_parser = super::number::<f32>(DETAIL))]
    pub(crate) detail: f32,
    /// Triangles only; no quads.
    #[arg(long)]
    pub(crate) triangles: bool,
    /// Make the cage symmetric: if the model is symmetric (auto), never (none), or always in the plane perpendicular to an axis (x, y, z).
    #[arg(long, default_value_t, value_parser = super::words::<Symmetry>())]
    pub(crate) symmetry: Symmetry,
    /// One closed part per component of the model, without bridges between them. Components within a few voxels of each
    /// other count as one.
    #[arg(long)]
    pub(crate) per_component: bool,
    #[arg(long, help = CLEARANCE.about(), default_value_t = CageOptions::default().clearance, value_name = "FRACTION", value_parser = super::number::<f32>(CLEARANCE))]
    pub(crate) clearance: f32,
    #[arg(long, help = VOXELS.about(), default_value_t = CageOptions::default().voxels, value_name = "N", value_parser = super::number::<u32>(VOXELS))]
    pub(crate) voxels: u32,
    #[command(flatten)]
    pub(crate) smooth: SmoothArgs,
    #[arg(long, value_name = "NAME", help = format!("Enclose the model at up to {MAX_CLIP_TIMES} equally spaced times of the clip with this name as well, in each model that has it"))]
    pub(crate) around_clip: Option<String>,
    #[arg(long, help = DIVISIONS.about(), value_name = "N", value_parser = super::number::<u32>(DIVISIONS))]
    pub(crate) divisions: Option<u32>,
    /// Distance between the model and a box cage (--kind box), as a fraction of the diagonal of the model's bounding box.
    #[arg(long, default_value_t = BOX_MARGIN, value_name = "FRACTION", value_parser = positive)]
    pub(crate) margin: f32,
}

impl CageArgs {
    /// The kind of cage that `--kind` selects. Without it, `--divisions` implies a box.
    pub(crate) fn kind(&self) -> KindArg {
        let guess = if self.divisions.is_some() { KindArg::Box } else { KindArg::Auto };
        self.kind.unwrap_or(guess)
    }

    /// Rejects options that the kind of cage does not use.
    ///
    /// # Errors
    /// If one of these options is given and is not the default.
    pub(crate) fn check(&self) -> Result<(), CliError> {
        let usual = CageOptions::default();
        let of_box = [
            ("--divisions", self.divisions.is_some()),
            ("--margin", self.margin.to_bits() != BOX_MARGIN.to_bits()),
        ];
        let of_others = [
            ("--vertices", self.vertices.is_some()),
            ("--detail", self.detail.to_bits() != usual.detail.to_bits()),
            ("--triangles", self.triangles),
            ("--symmetry", self.symmetry != usual.symmetry),
            ("--per-component", self.per_component),
            ("--clearance", self.clearance.to_bits() != usual.clearance.to_bits()),
            ("--voxels", self.voxels != usual.voxels),
            ("--smooth", self.smooth.smooth != usual.smooth),
        ];
        if self.kind() == KindArg::Skeleton && self.around_clip.is_some() {
            return Err(CliError::Mismatch {
                message: "--around-clip: rings along the skeleton enclose the model at rest only".to_owned(),
                hint: "leave out --kind for a cage that encloses the clip",
            });
        }
        let (unused, why, hint) = if self.kind() == KindArg::Box {
            (
                of_others.as_slice(),
                "a box cage does not have this option",
                "--divisions and --margin shape a box; leave out --kind box and --divisions for a cage that follows the model",
            )
        } else {
            (
                of_box.as_slice(),
                "only a box cage has this option",
                "give --kind box; other cages have --vertices and --clearance",
            )
        };
        match unused.iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(CliError::Mismatch { message: format!("{option}: {why}"), hint }),
            None => Ok(()),
        }
    }

    /// Options for generating the cage.
    pub(crate) fn options(&self) -> CageOptions {
        let kind = self.kind().generated();
        let hull = kind == CageKind::Hull;
        let options = CageOptions {
            target: self.vertices.unwrap_or(if hull { HULL_TARGET } else { CageOptions::default().target }),
            detail: self.detail,
            quads: !self.triangles,
            kind,
            symmetry: self.symmetry,
            per_component: self.per_component,
            clearance: self.clearance,
            voxels: self.voxels,
            smooth: self.smooth.smooth,
        };
        if self.around_clip.is_some() { options.around_clip() } else { options }
    }
}

/// Arguments of `cagework check`.
#[derive(Args, Debug)]
#[command(after_help = "The exit code is 1 if the mesh is not a valid cage.\n\n\
    Examples:\n  \
    cagework check cage.obj\n  \
    cagework check cage.obj --mesh horse.glb -g 64 --json\n  \
    cagework check cage.obj --repair weld,fill-holes,flip -o mended.obj\n  \
    cagework check cage.obj --mesh horse.glb --repair grow -o grown.obj")]
pub(crate) struct CheckArgs {
    /// Cage to check.
    #[arg(help = super::mesh_help("Cage to check"))]
    pub(crate) cage: PathBuf,
    /// Model that should be inside the cage.
    #[arg(long, value_name = "FILE")]
    pub(crate) mesh: Option<PathBuf>,
    #[arg(short, long, help = format!("Report parts of the cage that a grid with this many cells along its longest side does not resolve: {}", GRID.allowed), default_value = "auto", value_parser = parse_grid)]
    pub(crate) grid: u32,
    /// Repairs to apply before the check, separated by commas: weld merges vertices at the same position and
    /// attaches a vertex that lies on a neighbour's open edge to that face, drop-degenerate removes faces without area, duplicate faces
    /// and unused vertices, mirror completes half a cage across an open boundary in a plane of constant x, y or z,
    /// fill-holes closes holes, flip orients all faces outward, grow moves vertices outward until the cage encloses the
    /// model.
    #[arg(long, value_parser = super::words::<Repair>(), value_delimiter = ',', value_name = "WHAT", requires = "output")]
    pub(crate) repair: Vec<Repair>,
    /// File for the repaired cage; the extension selects the format.
    #[arg(short, long, value_name = "FILE", requires = "repair")]
    pub(crate) output: Option<ModelOutput>,
    #[command(flatten)]
    pub(crate) smooth: SmoothArgs,
    #[command(flatten)]
    pub(crate) memory: MemoryArgs,
}

/// Source of a cage: a file, or a generator with its options.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum CageSource {
    File(PathBuf),
    /// A subdivided box around the model.
    Box {
        /// Number of quads along each edge of the box.
        divisions: u32,
    },
    /// A generated cage of any other kind.
    Auto(CageOptions),
}

impl FromStr for CageSource {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, number) = text.split_once(':').map_or((text, None), |(kind, n)| (kind, Some(n)));
        let parse = |what: &str, option: Number, default| {
            let parsed = number.map_or(Ok(default), |n| option.parse(n));
            parsed.map_err(|wrong| format!("{what} must be {}", wrong.allowed))
        };
        let generated = |kind: CageKind| {
            let usual = if kind == CageKind::Hull { HULL_TARGET } else { CageOptions::default().target };
            let target = parse("VERTICES", TARGET, usual)?;
            Ok(Self::Auto(CageOptions { target, kind, ..CageOptions::default() }))
        };
        match kind {
            "box" => Ok(Self::Box { divisions: parse("DIVISIONS", DIVISIONS, BOX_DIVISIONS)? }),
            _ => match kind.parse() {
                Ok(kind) => generated(kind),
                Err(_) => Ok(Self::File(PathBuf::from(text))),
            },
        }
    }
}

/// Kinds of cages that `cagework cage` makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum KindArg {
    Auto,
    Skeleton,
    Shell,
    Hull,
    Box,
}

impl KindArg {
    /// Kind that the generator makes; auto for a box.
    fn generated(self) -> CageKind {
        match self {
            Self::Auto | Self::Box => CageKind::Auto,
            Self::Skeleton => CageKind::Skeleton,
            Self::Shell => CageKind::Shell,
            Self::Hull => CageKind::Hull,
        }
    }
}
