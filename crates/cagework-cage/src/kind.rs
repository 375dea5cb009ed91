//! Chooses the kind of a generated cage.
//!
//! Sleeves along a skeleton have regular rings, but not every model has them: limbs may touch, or the model has no
//! limbs. The shell exists for every model. [`CageKind::Auto`] makes both and takes the one with the lower score.

use std::ops::ControlFlow;

use cagework_core::closest::distances;
use cagework_core::mesh::TriMesh;
use cagework_core::nearest::KdTree;
use cagework_core::progress::{Cancellation, Progress, ProgressEvent};
use cagework_core::rig::Rig;
use glam::{DVec3, Vec3};

use crate::generate::{
    CageGenError, CageKind, CageOptions, CageReport, GeneratedCage, Mirror, Rings, Symmetry, check_input,
    generate,
};
use crate::skeleton::{Skeleton, SkeletonError};
use crate::sleeves::{self, SleeveError, Sleeves};

/// Score of a cage whose whole surface spans two limbs, in diagonals of the model's box.
const SPANNING: f64 = 0.1;

/// Score of a cage without rings, in diagonals of the model's box: with a rig, and without one.
const NO_RINGS: [f64; 2] = [0.02, 0.01];

/// Score of sleeves if no limb has a ring, in diagonals of the model's box.
const NO_LIMBS: f64 = 0.1;

/// Share of the progress that sleeves take if a shell is made, too.
const SLEEVE_SHARE: f32 = 0.7;

/// Generates a cage of the kind [`CageOptions::kind`].
///
/// With [`CageKind::Auto`], the cage consists of sleeves if they enclose the model and have a lower score than the shell;
/// otherwise [`CageReport::refusal`] says why it does not. The score is a mean distance: that of the cage's surface from
/// the model, in diagonals of the model's box, plus 0.1 times the share of its area whose corners are nearest to two
/// different limbs, plus 0.02 without rings (0.01 without a rig), or 0.1 times the share of the limbs that share the rings of their parent.
/// Models without a rig keep a shell that has at most three quarters of the vertices of the sleeves.
///
/// `positions`: `[n_vertices]`, object units; vertices without triangles are enclosed, too. `triangles`:
/// `[n_triangles]`, any soup. `rig`: joints at the rest of `positions`; an empty one counts as `None`. Without a
/// rig, or if its joints have no limbs, the skeleton is derived from the model's voxels ([`Skeleton::of_surface`]).
///
/// # Errors
/// [`CageGenError`]. With [`CageKind::Skeleton`], [`CageGenError::Sleeves`] if sleeves are refused.
pub fn generate_of_kind(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    rig: Option<&Rig>,
    options: &CageOptions,
    progress: &dyn Progress,
) -> Result<GeneratedCage, CageGenError> {
    generate_with_skeleton(positions, triangles, rig, options, progress, &|_| ())
}

/// Like [`generate_of_kind`]. Calls `show` with the skeleton before sleeves are made along it.
///
/// # Errors
/// Those of [`generate_of_kind`].
pub fn generate_with_skeleton(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    rig: Option<&Rig>,
    options: &CageOptions,
    progress: &dyn Progress,
    show: &dyn Fn(&Skeleton),
) -> Result<GeneratedCage, CageGenError> {
    let began = progress.now_ms();
    let rig = rig.filter(|rig| !rig.joints.is_empty());
    let share = match options.kind {
        CageKind::Shell | CageKind::Hull => return generate(positions, triangles, options, progress),
        CageKind::Skeleton => 1.0,
        CageKind::Auto => SLEEVE_SHARE,
    };
    check_input(positions, triangles, options)?;
    let model = TriMesh { positions: positions.to_vec(), triangles: triangles.to_vec() };
    let sleeves = make_sleeves(&model, rig, options, &Part { whole: progress, from: 0.0, share }, show)?;
    let mut made = match (options.kind, sleeves) {
        (CageKind::Auto, Err(refusal)) => with_refusal(shell(&model, options, progress)?, refusal),
        (CageKind::Auto, Ok((made, skeleton))) => {
            let shell = shell(&model, options, progress)?;
            let no_rings = NO_RINGS[usize::from(rig.is_none())];
            let [own, other] = [&made, &shell].map(|made| score(made, &model, &skeleton, no_rings));
            let [n_sleeves, n_shell] = [made.report.vertices, shell.report.vertices];
            // Corners of a simple shape, such as a cylinder, look like limbs in its voxels.
            if rig.is_none() && 4 * n_shell <= 3 * n_sleeves {
                let refusal = format!(
                    "a shell needs only {n_shell} vertices, and sleeves {n_sleeves}: use the kind skeleton for sleeves"
                );
                with_refusal(shell, refusal)
            } else if own <= other {
                made
            } else {
                let refusal = format!(
                    "sleeves have the score {own:.3} and the shell {other:.3}, where lower is better: use the kind skeleton for sleeves"
                );
                with_refusal(shell, refusal)
            }
        }
        (_, Err(refusal)) => return Err(CageGenError::Sleeves(refusal)),
        (_, Ok((made, _))) => made,
    };
    made.report.elapsed_ms = progress.now_ms() - began;
    Ok(made)
}

/// Part of a longer work. Its progress is a range of the whole.
struct Part<'a> {
    whole: &'a dyn Progress,
    from: f32,
    share: f32,
}

impl Progress for Part<'_> {
    fn report(&self, event: ProgressEvent) -> ControlFlow<()> {
        self.whole.report(ProgressEvent { fraction: self.from + self.share * event.fraction, ..event })
    }

    fn now_ms(&self) -> f64 {
        self.whole.now_ms()
    }
}

/// Makes a cage of sleeves. The inner error says why there is none.
fn make_sleeves(
    model: &TriMesh,
    rig: Option<&Rig>,
    options: &CageOptions,
    progress: &Part<'_>,
    show: &dyn Fn(&Skeleton),
) -> Result<Result<(GeneratedCage, Skeleton), String>, Cancellation> {
    let usual = CageOptions::default();
    let unsupported = [
        ("quads = false", !options.quads),
        ("symmetry", options.symmetry != Symmetry::Auto),
        ("per_component", options.per_component),
        ("clearance", options.clearance > usual.clearance),
        ("voxels", options.voxels != usual.voxels),
        ("smooth", options.smooth > 0),
    ];
    if let Some((name, _)) = unsupported.iter().find(|(_, is_given)| *is_given) {
        return Ok(Err(format!("sleeves do not support the option {name}: use its default")));
    }
    let skeleton = match skeleton_of(model, rig, progress) {
        Err(SkeletonError::Cancelled(cancelled)) => return Err(cancelled),
        Err(error) => return Ok(Err(error.to_string())),
        Ok(skeleton) => skeleton,
    };
    if skeleton.chains.len() == 1 {
        return Ok(Err("the model has no limbs: use the kind shell".to_owned()));
    }
    show(&skeleton);
    match sleeves::generate(&model.positions, &model.triangles, &skeleton, options.target as usize, progress)
    {
        Err(SleeveError::Cancelled(cancelled)) => Err(cancelled),
        Err(SleeveError::Refused(refusal)) => Ok(Err(refusal.to_string())),
        Ok(sleeves) => Ok(Ok((sleeve_cage(sleeves, options), skeleton))),
    }
}

/// Skeleton of the rig, or of the voxels if there is no rig or its joints have no limbs.
fn skeleton_of(
    model: &TriMesh,
    rig: Option<&Rig>,
    progress: &dyn Progress,
) -> Result<Skeleton, SkeletonError> {
    let of_rig = rig.and_then(|rig| Skeleton::of_rig(&model.positions, rig).ok());
    match of_rig.filter(|skeleton| skeleton.chains.len() > 1) {
        Some(skeleton) => Ok(skeleton),
        None => Skeleton::of_surface(&model.positions, &model.triangles, progress),
    }
}

fn sleeve_cage(sleeves: Sleeves, options: &CageOptions) -> GeneratedCage {
    let Sleeves { cage, chains, places, mirror, notices, .. } = sleeves;
    let n_faces = cage.faces().len() as u32;
    let report = CageReport {
        kind: CageKind::Skeleton,
        refusal: None,
        target: options.target,
        vertices: cage.n_vertices() as u32,
        faces: n_faces,
        quads: n_faces,
        target_met: cage.n_vertices() <= options.target as usize,
        voxels: 0,
        voxel_size: 0.0,
        clearance: 0.0,
        mirror: mirror.map(Mirror::of_axis),
        notices,
        parts: 1,
        separate: 1,
        hull_vertices: 0,
        hull: false,
        attempts: 0,
        elapsed_ms: 0.0,
    };
    GeneratedCage { cage, report, rings: Some(Rings { chains, places }) }
}

fn shell(
    model: &TriMesh,
    options: &CageOptions,
    progress: &dyn Progress,
) -> Result<GeneratedCage, CageGenError> {
    let part = Part { whole: progress, from: SLEEVE_SHARE, share: 1.0 - SLEEVE_SHARE };
    generate(&model.positions, &model.triangles, options, &part)
}

fn with_refusal(mut made: GeneratedCage, refusal: String) -> GeneratedCage {
    made.report.refusal = Some(refusal);
    made
}

/// Score of a cage, see [`generate_of_kind`]. The mean distance is the integral over the cage's triangles, of which the
/// middles of the edges are the nodes: exact for quadratic functions.
fn score(made: &GeneratedCage, model: &TriMesh, skeleton: &Skeleton, no_rings: f64) -> f64 {
    let (at, triangles) = (made.cage.positions(), made.cage.triangles());
    let corners = |t: &[u32; 3]| t.map(|v| at[v as usize]);
    let middles: Vec<Vec3> = triangles
        .iter()
        .map(corners)
        .flat_map(|[a, b, c]| [a.midpoint(b), b.midpoint(c), c.midpoint(a)])
        .collect();
    let away = distances(&middles, model);
    let tree = KdTree::new(&model.positions, (0..model.positions.len() as u32).collect());
    let chain = |p: &Vec3| tree.find(*p, f32::INFINITY).map(|(v, _)| skeleton.chain_of[v as usize] as usize);
    let chains: Vec<Option<usize>> = at.iter().map(chain).collect();
    let (mut area, mut distance, mut spanning) = (0.0, 0.0, 0.0);
    for (t, away) in triangles.iter().zip(away.as_chunks::<3>().0) {
        let [a, b, c]: [DVec3; 3] = corners(t).map(Vec3::as_dvec3);
        let own = 0.5 * (b - a).cross(c - a).length();
        area += own;
        distance += own * away.iter().sum::<f64>() / 3.0;
        let of = t.map(|v| chains[v as usize]);
        if (0..3).any(|k| are_apart(skeleton, of[k], of[(k + 1) % 3])) {
            spanning += own;
        }
    }
    let diagonal =
        cagework_core::Bounds::around(&model.positions).map_or(1.0, |bounds| f64::from(bounds.diagonal()));
    let rings = made.rings.as_ref().map_or(no_rings, |rings| {
        NO_LIMBS * (1.0 - rings.chains.len() as f64 / skeleton.chains.len() as f64)
    });
    (distance / diagonal + SPANNING * spanning) / area.max(f64::MIN_POSITIVE) + rings
}

/// Whether two chains are different limbs, of which neither branches from the other.
fn are_apart(skeleton: &Skeleton, a: Option<usize>, b: Option<usize>) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return false };
    let parent = |chain: usize| skeleton.chains[chain].parent;
    a != b && parent(a) != Some(b) && parent(b) != Some(a)
}

#[cfg(test)]
mod tests {
    use cagework_core::progress::NoProgress;

    use super::*;
    use crate::skeleton::tests::{Figure, biped};

    fn made(figure: &Figure, options: &CageOptions) -> Result<GeneratedCage, CageGenError> {
        generate_of_kind(&figure.positions, &figure.triangles, Some(&figure.rig), options, &NoProgress)
    }

    #[test]
    fn a_figure_gets_rings_of_its_limbs() {
        let figure = biped(false);
        let options = CageOptions::default();
        let auto = made(&figure, &options).unwrap();
        assert_eq!((auto.report.kind, auto.report.refusal.as_ref()), (CageKind::Skeleton, None));
        let rings = auto.rings.as_ref().unwrap();
        assert_eq!(rings.chains, ["trunk", "thigh.L", "thigh.R", "arm.L", "arm.R"]);
        assert_eq!((rings.places.len(), auto.report.quads), (auto.cage.n_vertices(), auto.report.faces));
        assert_eq!(rings.loops().values().map(Vec::len).sum::<usize>(), auto.cage.n_vertices());
        let skeleton = made(&figure, &CageOptions { kind: CageKind::Skeleton, ..options }).unwrap();
        assert_eq!(skeleton.cage.positions(), auto.cage.positions());
        let shell = made(&figure, &CageOptions { kind: CageKind::Shell, ..options }).unwrap();
        assert_eq!((shell.report.kind, shell.rings.as_ref()), (CageKind::Shell, None));
    }

    #[test]
    fn a_shell_says_why_it_has_no_rings() {
        // A tetrahedron has no limbs.
        let figure = Figure {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
            ..Figure::default()
        };
        let auto = made(&figure, &CageOptions::default()).unwrap();
        assert_eq!((auto.report.kind, auto.rings.as_ref()), (CageKind::Shell, None));
        assert!(auto.report.refusal.is_some());
        let skeleton = CageOptions { kind: CageKind::Skeleton, ..CageOptions::default() };
        let error = made(&figure, &skeleton).unwrap_err();
        assert!(matches!(&error, CageGenError::Sleeves(why) if !why.is_empty()), "{error}");
        // Sleeves have no clearance.
        let error = made(&biped(false), &CageOptions { clearance: 0.01, ..skeleton }).unwrap_err();
        assert!(error.to_string().contains("clearance"), "{error}");
        let error = made(&Figure { triangles: vec![[0, 1, 9]], ..figure }, &skeleton).unwrap_err();
        assert!(matches!(error, CageGenError::Index { vertex: 9, .. }), "{error}");
    }

    /// A cylinder of 48 sides needs 20 vertices; its rims look like limbs, and sleeves along them take more.
    #[test]
    fn a_simple_shape_keeps_its_shell() {
        let (n, ends) = (48, [0u32, 1]);
        let rim = |end: u32| {
            (0..n).map(move |k| {
                let (sin, cos) = (k as f32 * std::f32::consts::TAU / n as f32).sin_cos();
                Vec3::new(0.3 * cos, 2.0 * end as f32, 0.3 * sin)
            })
        };
        let positions: Vec<Vec3> = ends.into_iter().flat_map(rim).collect();
        let cap = |end: u32| (1..n - 1).map(move |k| [n * end, n * end + k, n * end + k + 1]);
        let side = (0..n).flat_map(|k| [[k, (k + 1) % n, n + k], [(k + 1) % n, n + (k + 1) % n, n + k]]);
        let triangles: Vec<[u32; 3]> = ends.into_iter().flat_map(cap).chain(side).collect();
        let options = CageOptions::default();
        let report = generate_of_kind(&positions, &triangles, None, &options, &NoProgress).unwrap().report;
        assert!(report.vertices <= 24 && 10 * report.quads >= 7 * report.faces, "{report:?}");
    }

    #[test]
    fn faces_that_span_two_legs_raise_the_score() {
        let figure = biped(false);
        let model = TriMesh { positions: figure.positions.clone(), triangles: figure.triangles.clone() };
        let skeleton = Skeleton::of_rig(&figure.positions, &figure.rig).unwrap();
        assert!(are_apart(&skeleton, Some(1), Some(2)) && !are_apart(&skeleton, Some(0), Some(2)));
        let hull = CageOptions { kind: CageKind::Hull, target: 24, ..CageOptions::default() };
        let [hull, sleeves] = [hull, CageOptions { kind: CageKind::Skeleton, ..CageOptions::default() }]
            .map(|options| score(&made(&figure, &options).unwrap(), &model, &skeleton, NO_RINGS[0]));
        assert!(sleeves < 0.5 * hull, "{sleeves} {hull}");
    }
}
