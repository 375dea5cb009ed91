//! `cagework cage`: makes a cage for a model.

use cagework_cage::generate::{BOX_DIVISIONS, CageKind, CageReport, MIN_VOXELS, Rings};
use cagework_core::PolygonMesh;
use cagework_core::rig::Rig;
use cagework_core::words::{counted, three_digits};
use cagework_io::{MemoryError, Model, ModelFormat, shown, write_cage_obj};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::{CageArgs, KindArg, ModelOutput};
use crate::bind::export;
use crate::error::CliError;
use crate::files::{check_outputs, json, models_of_folders, print, write};
use crate::load::{box_mesh, generate_for, load_any, states_of};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct CageSummary {
    output: String,
    /// Number of models that the cage encloses.
    models: usize,
    /// Kind of the cage: skeleton, shell, hull or box.
    kind: String,
    vertices: usize,
    faces: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    divisions: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    margin: Option<f32>,
    /// Report of the cage generator; `None` for a box.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<CageReport>,
    /// Rings of a cage along the skeleton.
    #[serde(skip_serializing_if = "Option::is_none")]
    rings: Option<Rings>,
    notices: Vec<String>,
}

/// Vertices and triangles of all models that the cage encloses.
struct CageInput {
    /// Positions of the vertices relative to `origin`, Y up. `[n_vertices]`, object units
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Joints of all models at rest.
    rig: Rig,
    /// Origin of the first model, in the axes of its file.
    origin: DVec3,
    models: usize,
    notices: Vec<String>,
}

/// Runs `cagework cage`.
///
/// # Errors
/// If a model cannot be read, or the cage cannot be made or written.
pub(crate) fn run(args: &CageArgs, as_json: bool) -> Result<(), CliError> {
    args.check()?;
    let around = enclosed(args)?;
    let mut summary = CageSummary {
        output: args.output.path.display().to_string(),
        models: around.models,
        kind: "box".to_owned(),
        vertices: 0,
        faces: 0,
        divisions: None,
        margin: None,
        report: None,
        rings: None,
        notices: around.notices,
    };
    let cage = match args.kind() {
        KindArg::Box => {
            let divisions = args.divisions.unwrap_or(BOX_DIVISIONS);
            (summary.divisions, summary.margin) = (Some(divisions), Some(args.margin));
            box_mesh(&around.positions, divisions, args.margin)?
        }
        _ => {
            let made =
                generate_for(&around.positions, &around.triangles, Some(&around.rig), &args.options())?;
            summary.kind = made.report.kind.to_string();
            (summary.report, summary.rings) = (Some(made.report), made.rings);
            made.cage.to_polygon_mesh()
        }
    };
    (summary.vertices, summary.faces) = (cage.positions.len(), cage.faces.len());
    let cage = args.read.axis().mesh_turned_back(&cage);
    match &summary.rings {
        Some(rings) if args.output.format == ModelFormat::Obj => {
            write(&args.output.path, &obj_with_rings(&cage, around.origin, rings))?;
        }
        _ => write_cage(&args.output, &cage, around.origin)?,
    }
    if as_json {
        return print(&json(&summary));
    }
    print(&text(&summary))
}

/// Reads the models that the cage encloses, one at a time, and joins their vertices and triangles.
fn enclosed(args: &CageArgs) -> Result<CageInput, CliError> {
    let paths = models_of_folders(&args.models, &[&args.output.path])?;
    check_outputs(&[&args.output.path], &paths.iter().map(AsRef::as_ref).collect::<Vec<_>>())?;
    let mut all = CageInput {
        positions: Vec::new(),
        triangles: Vec::new(),
        rig: Rig::default(),
        origin: DVec3::ZERO,
        models: paths.len(),
        notices: Vec::new(),
    };
    let (mut unknown_clip, mut has_clip) = (None, args.around_clip.is_none());
    for path in &paths {
        let mut model = load_any(path, args.read.axis(), args.read.memory)?;
        if all.positions.is_empty() {
            all.origin = model.origin();
        }
        let n_notices = model.notices.len();
        model.set_origin(all.origin);
        all.notices.extend(model.notices[n_notices..].iter().map(|n| format!("{}: {n}", shown(&model.name))));
        let (positions, triangles) = match states_of(&model, args.around_clip.as_deref()) {
            Ok(states) => {
                has_clip = true;
                states
            }
            Err(unknown) => {
                unknown_clip = unknown_clip.or(Some(unknown));
                states_of(&model, None)?
            }
        };
        let first = all.positions.len() as u32;
        let n_positions = all.positions.len() + positions.len();
        let bytes = 12 * (n_positions + all.triangles.len() + triangles.len()) as u64;
        // Vertices and triangles take 12 bytes each. Cap the limit at `u32::MAX` of them, so that indices fit in 32
        // bits.
        MemoryError::check(bytes, args.read.memory.bytes().min(12 * u64::from(u32::MAX)))
            .map_err(|e| CliError::file(path, format!("with the models before it, {e}")))?;
        all.rig.append(model.rest_rig().unwrap_or_default().as_ref(), positions.len());
        all.positions.extend(positions);
        all.triangles.extend(triangles.iter().map(|t| t.map(|v| first + v)));
    }
    match unknown_clip {
        Some(unknown) if !has_clip => Err(unknown),
        _ => Ok(all),
    }
}

/// Writes a cage in the output's format. `origin` is added to all its positions.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn write_cage(output: &ModelOutput, cage: &PolygonMesh, origin: DVec3) -> Result<(), CliError> {
    write(&output.path, &export(&Model::of_mesh("cage.obj", cage, origin)?, &cage.positions, output)?)
}

/// Writes a cage as an OBJ file with a group for each ring: the faces that end at ring 2 of the chain "leg.L" are in the
/// group `leg.L.2`. Consecutive faces of a ring are written together.
fn obj_with_rings(cage: &PolygonMesh, origin: DVec3, rings: &Rings) -> Vec<u8> {
    let text = write_cage_obj(cage, origin);
    let lines = text.split_inclusive(|&byte| byte == b'\n');
    let (faces, vertices): (Vec<&[u8]>, Vec<&[u8]>) = lines.partition(|line| line.starts_with(b"f "));
    let ring =
        |face: &Vec<u32>| face.iter().map(|&v| rings.places[v as usize]).map(|at| (at.chain, at.ring)).max();
    let mut grouped: Vec<_> = cage.faces.iter().map(ring).zip(faces).collect();
    grouped.sort_by_key(|(ring, _)| *ring);
    let mut text = vertices.concat();
    for group in grouped.chunk_by(|a, b| a.0 == b.0) {
        if let Some((chain, ring)) = group[0].0 {
            let name: String = rings.chains[chain as usize]
                .chars()
                .map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c })
                .collect();
            text.extend(format!("g {name}.{ring}\n").bytes());
        }
        group.iter().for_each(|(_, face)| text.extend_from_slice(face));
    }
    text
}

fn text(summary: &CageSummary) -> String {
    let around = match summary.models {
        1 => String::new(),
        n => format!(" around {n} models"),
    };
    let notices: String = summary.notices.iter().map(|notice| format!("\nnote: {notice}")).collect();
    let Some(report) = &summary.report else {
        return format!(
            "wrote {}: a box{around} of {} vertices and {} faces{notices}",
            shown(&summary.output),
            summary.vertices,
            summary.faces
        );
    };
    let mut text = format!(
        "wrote {}{around}: {} vertices and {} faces ({:.0} % quads) in {:.0} ms",
        shown(&summary.output),
        summary.vertices,
        summary.faces,
        100.0 * f64::from(report.quads) / f64::from(report.faces.max(1)),
        report.elapsed_ms,
    );
    text += &match &summary.rings {
        Some(rings) => {
            let n = |count: usize, one, many| counted(count, one, many);
            let (loops, chains) = (rings.loops().len(), rings.chains.len());
            format!(", in {} along {}", n(loops, "ring", "rings"), n(chains, "chain", "chains"))
        }
        None => format!("; minimum distance from the model {}", three_digits(report.clearance)),
    };
    if let Some(mirror) = report.mirror {
        text.push_str(&format!(", symmetric in {}", format!("{mirror:?}").to_lowercase()));
    }
    if report.parts > 1 {
        text.push_str(&format!(", {} closed parts", report.parts));
    }
    if report.vertices > report.target && report.kind != CageKind::Skeleton {
        text.push_str(&format!(
            ".\nnote: the model's shape needs {} vertices instead of {}",
            report.vertices, report.target
        ));
        if report.voxels as usize > MIN_VOXELS {
            text.push_str(&format!(
                "; fewer --voxels than {} close more of its holes and gaps",
                report.voxels
            ));
        }
    }
    let refusal = report
        .refusal
        .iter()
        .map(|why| format!("a {} instead of rings along the skeleton: {why}", report.kind));
    for notice in report.notices.iter().cloned().chain(refusal) {
        text.push_str(&format!("\nnote: {notice}"));
    }
    text + &notices
}

#[cfg(test)]
mod tests {
    use cagework_cage::generate::RingPlace;

    use super::*;

    #[test]
    fn faces_are_grouped_by_the_ring_at_which_they_end() {
        // A box of two rings of four vertices; the faces between them, then the ends.
        let mut faces: Vec<Vec<u32>> = (0..4).map(|k| vec![k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k]).collect();
        faces.insert(2, vec![3, 2, 1, 0]);
        faces.push(vec![4, 5, 6, 7]);
        let cage = PolygonMesh { positions: vec![Vec3::ZERO; 8], faces };
        let place = |v: u32| RingPlace { chain: 0, ring: v / 4, place: v % 4 };
        let rings = Rings { chains: vec!["upper leg".into()], places: (0..8).map(place).collect() };
        let text = String::from_utf8(obj_with_rings(&cage, DVec3::ZERO, &rings)).unwrap();
        let faces = text.split_once("g upper_leg.0\n").unwrap().1;
        assert_eq!(
            faces,
            "f 4 3 2 1\ng upper_leg.1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\n"
        );
        assert_eq!(rings.loops()[&(0, 1)], [4, 5, 6, 7]);
    }
}
