//! `cagework info`: describes a model, and says whether it is a valid cage.

use std::collections::HashMap;
use std::fmt::Write as _;

use cagework_core::crossing::notices;
use cagework_core::mesh::weld;
use cagework_core::words::counted;
use cagework_core::{Bounds, Cage};
use cagework_io::{Clip, Model, ModelFormat, Vrm, read_inner_controls, shown};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::InfoArgs;
use crate::error::CliError;
use crate::files::{json, print, read};
use crate::load::{cage_mesh, load_any};

/// Largest number of part names that the text output lists.
const MAX_LISTED_NAMES: usize = 30;

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Info {
    file: String,
    format: &'static str,
    vertices: usize,
    unique_vertices: usize,
    triangles: usize,
    nodes: usize,
    primitives: usize,
    materials: usize,
    skins: usize,
    joints: usize,
    morph_targets: usize,
    clips: Vec<Clip>,
    /// Names of meshes that are attached to a joint but not skinned, such as a hat; `--rigid` accepts them.
    props: Vec<String>,
    /// Names of parts that `--rigid` and `--mask` accept, with their kinds.
    parts: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vrm: Option<Vrm>,
    /// `None` unless the file is a capture of Gaussian splats.
    #[serde(skip_serializing_if = "Option::is_none")]
    splats: Option<SplatInfo>,
    bounds: BoundsInfo,
    /// Whether every edge belongs to two triangles after vertices at equal positions are merged.
    closed: bool,
    cage: CageInfo,
    notices: Vec<String>,
}

/// Facts about a capture of Gaussian splats.
#[derive(Debug, Serialize)]
struct SplatInfo {
    /// Degree of the spherical harmonics that give the splats' colours.
    degree: u8,
    median_opacity: f32,
    /// Median of the largest standard deviation of each splat, object units.
    median_size: f32,
}

/// Bounding box of the model, object units.
#[derive(Debug, Serialize)]
struct BoundsInfo {
    min: [f64; 3],
    max: [f64; 3],
    diagonal: f64,
}

/// Whether the model is a valid cage, and why not.
#[derive(Debug, Serialize)]
struct CageInfo {
    valid: bool,
    /// Message about the first fault; `None` if the model is a valid cage.
    problem: Option<String>,
    notices: Vec<String>,
}

/// Runs `cagework info`.
///
/// # Errors
/// If the model cannot be read.
pub(crate) fn run(args: &InfoArgs, as_json: bool) -> Result<(), CliError> {
    let inner = inner_info(args)?;
    let model = load_any(&args.model, args.read.axis(), args.read.memory);
    let has_faces = model.as_ref().is_ok_and(|model| model.n_faces() > 0);
    if let Some(inner) = inner.filter(|_| !has_faces) {
        return print(&if as_json { json(&inner) } else { inner.to_string() });
    }
    let model = model?;
    let info = inspect(&args.model.display().to_string(), &model)?;
    print(&if as_json { json(&info) } else { text(&info) })
}

/// Contents of an OBJ file of inner controls.
#[derive(Debug, Serialize)]
struct InnerInfo {
    file: String,
    format: &'static str,
    /// Number of vertices, each of which is a column of the weights.
    vertices: usize,
    points: usize,
    lines: usize,
    faces: usize,
}

impl std::fmt::Display for InnerInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { file, vertices, points, lines, faces, .. } = self;
        writeln!(f, "{} (OBJ), controls inside a cage for `cagework bind --controls`", shown(file))?;
        let elements = [
            counted(*points, "point", "points"),
            counted(*lines, "line", "lines"),
            counted(*faces, "face", "faces"),
        ];
        writeln!(f, "  vertices    {vertices}\n  elements    {}", elements.join(", "))
    }
}

/// Reads a model file as inner controls. `None` unless it is an OBJ file with points or lines.
fn inner_info(args: &InfoArgs) -> Result<Option<InnerInfo>, CliError> {
    if ModelFormat::of_export(&args.model.to_string_lossy()) != Some(ModelFormat::Obj) {
        return Ok(None);
    }
    let Ok(inner) = read_inner_controls(&read(&args.model)?, DVec3::ZERO, args.read.memory.bytes()) else {
        return Ok(None);
    };
    let count = |name| inner.elements.iter().filter(|element| element.name() == name).count();
    let [points, lines, faces] = ["point", "line", "face"].map(count);
    let (file, vertices) = (args.model.display().to_string(), inner.positions.len());
    Ok((points + lines > 0).then_some(InnerInfo { file, format: "obj", vertices, points, lines, faces }))
}

fn inspect(file: &str, model: &Model) -> Result<Info, CliError> {
    let counts = model.counts;
    let bounds =
        Bounds::around(&model.positions).ok_or_else(|| CliError::file(file.as_ref(), "has no vertices"))?;
    let welded = weld(&model.positions);
    let cage = match cage_mesh(model).and_then(|mesh| Cage::new(&mesh)) {
        Ok(cage) => CageInfo { valid: true, problem: None, notices: notices(&cage) },
        Err(error) => CageInfo { valid: false, problem: Some(error.to_string()), notices: vec![] },
    };
    Ok(Info {
        file: file.to_owned(),
        format: model.format().name(),
        vertices: model.positions.len(),
        unique_vertices: welded.first.len(),
        triangles: model.triangles.len(),
        nodes: counts.nodes,
        primitives: counts.primitives,
        materials: counts.materials,
        skins: counts.skins,
        joints: counts.joints,
        morph_targets: counts.morph_targets,
        clips: model.clips(),
        // Ignore errors of the rig here; commands that deform it report them.
        props: model.props().unwrap_or_default(),
        parts: model.part_names(),
        vrm: model.vrm(),
        splats: model.splats().map(|splats| SplatInfo {
            degree: splats.degree,
            median_opacity: median(splats.opacities.clone()),
            median_size: median(splats.scales.iter().map(|scale| scale.max_element()).collect()),
        }),
        bounds: BoundsInfo {
            min: in_world(model, bounds.min),
            max: in_world(model, bounds.max),
            diagonal: in_single_precision(bounds.max.as_dvec3().distance(bounds.min.as_dvec3())),
        },
        closed: is_closed(&model.triangles, &welded.unique_of),
        cage,
        notices: model.notices.clone(),
    })
}

fn median(mut numbers: Vec<f32>) -> f32 {
    let middle = numbers.len() / 2;
    if numbers.is_empty() { 0.0 } else { *numbers.select_nth_unstable_by(middle, f32::total_cmp).1 }
}

/// Rounds to the shortest decimal of the nearest `f32`, so that 0.1 in the file is printed as 0.1. A number beyond the
/// range of `f32`, such as a diagonal of 5e38, is returned as it is.
fn in_single_precision(x: f64) -> f64 {
    (x as f32).to_string().parse().ok().filter(|x: &f64| x.is_finite()).unwrap_or(x)
}

/// Converts a position to world coordinates with Y up. Rounds along axes on which the origin is 0.
fn in_world(model: &Model, position: Vec3) -> [f64; 3] {
    let origin = model.up().vector_turned(model.origin()).to_array();
    let mut axes = origin
        .into_iter()
        .zip(position.to_array())
        .map(|(origin, x)| if origin == 0.0 { in_single_precision(x.into()) } else { origin + f64::from(x) });
    std::array::from_fn(|_| axes.next().unwrap_or_default())
}

/// Whether every edge belongs to exactly two triangles. Ignores triangles of which two corners are merged.
fn is_closed(triangles: &[[u32; 3]], unique_of: &[u32]) -> bool {
    let mut uses: HashMap<(u32, u32), u32> = HashMap::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| unique_of[i as usize]);
        if a == b || b == c || c == a {
            continue;
        }
        for (i, j) in [(a, b), (b, c), (c, a)] {
            *uses.entry((i.min(j), i.max(j))).or_default() += 1;
        }
    }
    !uses.is_empty() && uses.values().all(|&n| n == 2)
}

fn text(info: &Info) -> String {
    let mut out = format!("{} ({})\n", shown(&info.file), info.format);
    let mut row = |name: &str, value: String| {
        let _ = writeln!(out, "  {name:<12}{value}");
    };
    row("vertices", format!("{} ({} unique positions)", info.vertices, info.unique_vertices));
    row("triangles", info.triangles.to_string());
    row(
        "document",
        [
            counted(info.nodes, "node", "nodes"),
            counted(info.primitives, "primitive", "primitives"),
            counted(info.materials, "material", "materials"),
        ]
        .join(", "),
    );
    if info.skins + info.morph_targets + info.clips.len() > 0 {
        row(
            "rig",
            [
                counted(info.skins, "skin", "skins"),
                counted(info.joints, "joint", "joints"),
                counted(info.morph_targets, "morph target", "morph targets"),
            ]
            .join(", "),
        );
    }
    for (number, clip) in info.clips.iter().enumerate() {
        let name = shown(&clip.label(number));
        row("clip", format!("{name}, {} s, {} channels, {} keys", clip.seconds, clip.channels, clip.keys));
    }
    if let Some(vrm) = &info.vrm {
        row(
            "VRM",
            [
                shown(&vrm.version),
                counted(vrm.springs, "spring", "springs"),
                counted(vrm.colliders, "collider", "colliders"),
            ]
            .join(", "),
        );
        if !vrm.expressions.is_empty() {
            row("expressions", listed(&vrm.expressions));
        }
    }
    if !info.props.is_empty() {
        row("on joints", listed(&info.props));
    }
    if !info.parts.is_empty() {
        row("parts", listed(&info.parts));
    }
    let [min, max] = [info.bounds.min, info.bounds.max];
    row("bounds", format!("{min:?} to {max:?}, diagonal {:?}", info.bounds.diagonal));
    if let Some(SplatInfo { degree, median_opacity, median_size }) = info.splats {
        row("splats", format!("spherical harmonics of degree {degree}"));
        row("medians", format!("opacity {median_opacity:.2}, largest standard deviation {median_size:.2e}"));
    }
    if info.triangles > 0 {
        row("surface", if info.closed { "closed".into() } else { "open".into() });
        let problem = info.cage.problem.as_ref();
        row("as a cage", problem.map_or_else(|| "valid".into(), |why| format!("not valid: {why}")));
    } else {
        row("surface", "none: points".into());
    }
    for notice in info.notices.iter().chain(&info.cage.notices) {
        let _ = writeln!(out, "note: {notice}");
    }
    out
}

/// Joins names with commas. After [`MAX_LISTED_NAMES`], only the number of further names follows; `--json` lists all.
fn listed(names: &[String]) -> String {
    let first: Vec<String> = names.iter().take(MAX_LISTED_NAMES).map(|name| shown(name)).collect();
    let first = first.join(", ");
    match names.len().saturating_sub(MAX_LISTED_NAMES) {
        0 => first,
        more => format!("{first} and {more} more (--json lists all)"),
    }
}

#[cfg(test)]
mod tests {
    use super::is_closed;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn tetrahedron_is_closed_until_a_face_is_removed() {
        let same = [0, 1, 2, 3];
        assert!(is_closed(&TETRAHEDRON, &same));
        assert!(!is_closed(&TETRAHEDRON[1..], &same));
        assert!(!is_closed(&[], &same));
    }

    #[test]
    fn seams_between_welded_vertices_are_closed() {
        // Vertex 4 is at the position of vertex 0.
        let mut split = TETRAHEDRON;
        split[0][0] = 4;
        assert!(!is_closed(&split, &[0, 1, 2, 3, 4]));
        assert!(is_closed(&split, &[0, 1, 2, 3, 0]));
    }
}
