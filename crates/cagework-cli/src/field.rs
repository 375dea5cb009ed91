//! The deformation as a field: `cagework map`, and the lattice of `cagework deform --lattice`.

use std::path::Path;

use cagework_core::BindOptions;
use cagework_core::field::{Field, FieldWeights, InverseField, Lattice};
use cagework_core::team::Team;
use cagework_core::words::{counted, grouped};
use cagework_io::{Model, ModelFormat, PointFile, UpAxis, shown, write_field_blender, write_field_npz};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::{
    CageSource, ControlArgs, DeformArgs, LatticeFormat, MapArgs, MemoryArgs, ModelOutput, SmoothArgs,
};
use crate::bind::export;
use crate::controls::with_inner;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, read, shown_path, write};
use crate::load::{LoadedCage, load_any, load_cage, load_cage_file};
use crate::progress::Bar;

/// Number of points that one thread maps at a time.
const POINTS_PER_RUN: usize = 4096;

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct MapSummary {
    output: String,
    points: usize,
    /// Indices of the points without an inverse, from 0. These points are unchanged.
    not_found: Vec<usize>,
    /// Number of points beyond the lattice around the cage. These points are unchanged.
    beyond_lattice: usize,
    lattice: [u32; 3],
    notices: Vec<String>,
}

/// Runs `cagework map`.
///
/// # Errors
/// If a file cannot be read or written, files do not match, or the bind fails.
pub(crate) fn run(args: &MapArgs, as_json: bool) -> Result<(), CliError> {
    let mut inputs = vec![args.points.as_path(), args.cage.as_path(), args.pose.as_path()];
    inputs.extend(args.controls.controls.as_deref());
    inputs.extend(args.pose_controls.as_deref());
    check_outputs(&[&args.output], &inputs)?;
    let (up, memory) = (args.read.axis(), args.read.memory);
    let wrong = |e| CliError::file(&args.output, e);
    let name = args.points.display().to_string();
    let (bytes, mapped, lattice, mut notices) = if PointFile::is_named(&name) {
        if ending(&args.points) != ending(&args.output) {
            return Err(CliError::Mismatch {
                message: format!(
                    "{}: points are written in the format that they were read in",
                    shown_path(&args.output)
                ),
                hint: "give the output the extension of the input",
            });
        }
        let file = PointFile::read(&read(&args.points)?, memory.bytes())
            .map_err(|e| CliError::file(&args.points, e))?;
        let cage = load_cage_file(&args.cage, up, None, memory, &args.controls)?;
        let held = (file.bytes, args.cells);
        let field = field_of(&cage, &args.pose, args.pose_controls.as_deref(), (up, memory), held)?;
        let origin = cage.origin();
        let local = |p: &DVec3| up.vector_turned(*p - origin).as_vec3();
        let points: Vec<Vec3> = file.positions.iter().map(local).collect();
        let mapped = map(&field, &points, args.inverse);
        // Displacements are added in f64, so that points with the displacement 0 keep all digits of their coordinates.
        let moved = file.positions.iter().zip(points.iter().zip(&mapped.points));
        let moved: Vec<DVec3> = moved
            .map(|(p, (from, to))| *p + up.vector_turned_back(to.as_dvec3() - from.as_dvec3()))
            .collect();
        (file.write(&moved), mapped, field.lattice, Vec::new())
    } else {
        let output: ModelOutput = args.output.display().to_string().parse().map_err(wrong)?;
        let model = load_any(&args.points, up, memory)?;
        if model.splats().is_some() {
            return Err(CliError::Mismatch {
                message: "`map` would move the centres of the splats and leave their shapes".into(),
                hint: "use `cagework deform`, which takes splats without weights",
            });
        }
        let cage = load_cage(&CageSource::File(args.cage.clone()), &model, memory, &args.controls)?;
        let held = (model.bytes(), args.cells);
        let field = field_of(&cage, &args.pose, args.pose_controls.as_deref(), (up, memory), held)?;
        let mapped = map(&field, &model.positions, args.inverse);
        let bytes = export(&model, &mapped.points, &output)?;
        let mut notices = model.notices.clone();
        notices.extend(model.lost_in(output.format));
        if output.format == ModelFormat::Gltf && model.has_skin_or_targets() {
            let lost = "the glb file does not keep skins and morph targets; `cagework deform` does";
            notices.push(lost.into());
        }
        notices.extend(model.copies_in(output.format, &bytes));
        (bytes, mapped, field.lattice, notices)
    };
    if let [first, ..] = mapped.not_found[..] {
        notices.push(format!(
            "{} of {} points have no inverse within 1e-6 of the cage's size and are unchanged: the deformation folds \
             there, or they are not reached. The first is point {}.",
            mapped.not_found.len(),
            mapped.points.len(),
            first + 1
        ));
    }
    if let [first, ..] = mapped.beyond_lattice[..] {
        let n = mapped.beyond_lattice.len();
        let [are, stay] = if n == 1 { ["is", "stays where it is"] } else { ["are", "stay where they are"] };
        notices.push(format!(
            "{} of {} {are} beyond the lattice around the cage and {stay}. The first is point {}.",
            grouped(n),
            counted(mapped.points.len(), "point", "points"),
            first + 1
        ));
    }
    write(&args.output, &bytes)?;
    let summary = MapSummary {
        output: args.output.display().to_string(),
        points: mapped.points.len(),
        not_found: mapped.not_found,
        beyond_lattice: mapped.beyond_lattice.len(),
        lattice: lattice.dims.to_array(),
        notices,
    };
    print(&if as_json { json(&summary) } else { text(&summary) })
}

/// A lattice that was written.
#[derive(Debug, Serialize)]
pub(crate) struct LatticeSummary {
    output: String,
    nodes: [u32; 3],
    spacing: f32,
}

impl LatticeSummary {
    pub(crate) fn text(&self) -> String {
        let [x, y, z] = self.nodes;
        format!("wrote {}: {x} x {y} x {z} nodes, {} apart\n", shown(&self.output), self.spacing)
    }
}

/// Writes the lattice of `--lattice`.
///
/// # Errors
/// If a file cannot be read or written, files do not match, or the bind fails.
pub(crate) fn write_lattice(
    args: &DeformArgs,
    output: &Path,
    model: &Model,
) -> Result<LatticeSummary, CliError> {
    let (wanted, hint) = match args.lattice_format {
        LatticeFormat::Npz => ("npz", "name it .npz, or add --lattice-format blender"),
        LatticeFormat::Blender => ("py", "name it .py, or leave out --lattice-format"),
    };
    if ending(output).as_deref() != Some(wanted) {
        let message = format!("{}: a lattice of this format ends in .{wanted}", shown_path(output));
        return Err(CliError::Mismatch { message, hint });
    }
    let field = field_of_deform(args, model)?;
    let bytes = match args.lattice_format {
        LatticeFormat::Npz => write_field_npz(&field, model.origin(), model.up()),
        LatticeFormat::Blender => write_field_blender(&field, model.up().vector_turned(model.origin())),
    };
    write(output, &bytes)?;
    let Lattice { dims, cell, .. } = field.lattice;
    Ok(LatticeSummary { output: output.display().to_string(), nodes: dims.to_array(), spacing: cell })
}

/// Loads the cage, and computes the field of the only pose, for `--lattice`.
///
/// # Errors
/// If a file cannot be read, files do not match, or the bind fails.
fn field_of_deform(args: &DeformArgs, model: &Model) -> Result<Field, CliError> {
    let [pose] = args.pose.as_slice() else {
        return Err(CliError::Mismatch {
            message: format!("a lattice takes one pose, but {} were given", args.pose.len()),
            hint: "run the command once per pose",
        });
    };
    if !args.pose_controls.is_empty() {
        return Err(CliError::Mismatch {
            message: "a lattice does not take --pose-controls".into(),
            hint: "`cagework map` takes controls inside the cage",
        });
    }
    let controls = ControlArgs { smooth: SmoothArgs { smooth: args.smooth }, ..ControlArgs::default() };
    let cage = load_cage(&args.cage, model, args.read.memory, &controls)?;
    let held = (model.bytes(), args.lattice_cells);
    field_of(&cage, pose, None, (model.up(), args.read.memory), held)
}

/// Computes the field of a pose of a cage. `held`: memory in use, bytes. `cells`: number of lattice cells along the
/// longest side.
fn field_of(
    cage: &LoadedCage,
    pose: &Path,
    pose_controls: Option<&Path>,
    (up, memory): (UpAxis, MemoryArgs),
    (held, cells): (u64, u32),
) -> Result<Field, CliError> {
    let rest = cage.controls().rest();
    let inner = &rest[cage.cage.n_vertices()..];
    let files: Vec<_> = pose_controls.map(Path::to_path_buf).into_iter().collect();
    let poses = with_inner(vec![cage.load_pose(pose)?], &files, inner, (up, cage.origin()), memory)?;
    let options = BindOptions { memory_limit: memory.bytes(), held, ..BindOptions::default() };
    let bar = Bar::start();
    Ok(FieldWeights::bind(cage.controls(), cells, &options, &bar)?.pose(rest, &poses[0]))
}

/// Mapped points, and the indices of those without an inverse and of those beyond the reach of the cage.
struct MappedPoints {
    points: Vec<Vec3>,
    not_found: Vec<usize>,
    /// Indices of the points beyond the lattice, at rest.
    beyond_lattice: Vec<usize>,
}

fn map(field: &Field, points: &[Vec3], backwards: bool) -> MappedPoints {
    let inverse = backwards.then(|| InverseField::new(field));
    let runs: Vec<&[Vec3]> = points.chunks(POINTS_PER_RUN).collect();
    let of_run = |(): &mut (), run: usize| -> Vec<Option<Vec3>> {
        let map = |&p: &Vec3| inverse.as_ref().map_or_else(|| Some(field.map(p)), |inverse| inverse.find(p));
        runs[run].iter().map(map).collect()
    };
    let found = Team::new(0).share(runs.len(), || (), of_run).concat();
    let not_found = (0..points.len()).filter(|&k| found[k].is_none()).collect();
    let at_rest = |k: usize| if backwards { found[k] } else { Some(points[k]) };
    let is_beyond = |&k: &usize| at_rest(k).is_some_and(|p| !field.lattice.contains(p));
    let beyond_lattice = (0..points.len()).filter(is_beyond).collect();
    MappedPoints {
        points: found.iter().zip(points).map(|(found, p)| found.unwrap_or(*p)).collect(),
        not_found,
        beyond_lattice,
    }
}

fn ending(path: &Path) -> Option<String> {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase())
}

fn text(summary: &MapSummary) -> String {
    let mut out = format!("mapped {} points\nwrote {}\n", summary.points, shown(&summary.output));
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
