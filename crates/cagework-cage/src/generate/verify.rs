//! Verification of a generated cage in its final f32 coordinates.

use glam::DVec3;

use super::guarded::{MIN_FOLD_COSINE, Obstacle};
use super::shell::Shell;
use super::surface::Surface;
use cagework_core::cage::Cage;
use cagework_core::contact::{Corners, meeting};
use cagework_core::geometry::winding_number;
use cagework_core::mesh::PolygonMesh;

/// Share of the clearance that must remain after rounding to f32.
const MIN_CLEARANCE_SHARE: f64 = 0.98;

/// Share of the clearance that must remain at facets of bent faces and at triangles of a quad's other diagonal. Both
/// may lie slightly inside the triangles for which the full clearance was checked during simplification.
const MIN_FACET_CLEARANCE_SHARE: f64 = 0.1;

/// Largest allowed distance of a winding number from 1; off the surface, winding numbers are integers.
const WINDING_TOLERANCE: f64 = 1e-3;

/// Builds the cage of a whole surface; `None` unless it passes verification: closed, manifold, outward, free of
/// self-intersections, clear of the solid, and enclosing every part of the solid. The solid contains the model, so the
/// cage strictly encloses it.
pub(super) fn verify_surface(shell: &Shell, surface: &Surface) -> Option<Cage> {
    let whole = surface.whole();
    verify_faces(shell, &whole.positions, whole.triangles.iter().map(|t| t.to_vec()).collect()).ok()
}

/// Verifies vertices (centred voxel units) and faces. Bent faces must pass both as triangles and as the finer facets
/// that models are bound to.
///
/// # Errors
/// Indices of the faces that fail, ascending; empty if the cage fails as a whole.
pub(super) fn verify_faces(
    shell: &Shell,
    positions: &[DVec3],
    faces: Vec<Vec<u32>>,
) -> Result<Cage, Vec<u32>> {
    let positions: Vec<_> = positions.iter().map(|&p| shell.lattice.object(p)).collect();
    let cage = Cage::new(&PolygonMesh { positions, faces }).map_err(|_| Vec::new())?;
    if !cage.notices().is_empty() {
        return Err(Vec::new());
    }
    let corners = |index: [u32; 3], points: &[DVec3]| Corners {
        index,
        at: index.map(|i| shell.lattice.centred(points[i as usize].as_vec3())),
    };
    let mut obstacle = Obstacle { voxels: shell.obstacle.voxels.clone(), ..shell.obstacle };
    let mut is_clear = |t: &Corners, share: f64| {
        obstacle.clearance = share * shell.obstacle.clearance;
        obstacle.is_clear(t.at)
    };
    let cut = Cut::new(&cage, |index| corners(index, cage.facet_points()));
    let mut wrong = cut.wrong(&shell.obstacle);
    for (t, corners) in cut.triangles.iter().enumerate() {
        let share = if cut.is_ours[t] { MIN_CLEARANCE_SHARE } else { MIN_FACET_CLEARANCE_SHARE };
        if !is_clear(corners, share) {
            wrong.push(cut.face_of[t]);
        }
    }
    let facets: Vec<Corners> = cage.facets().iter().map(|&f| corners(f, cage.facet_points())).collect();
    let of_facet = |f: usize| cage.face_of_facet()[f];
    let touching = (0..facets.len()).filter(|&f| !is_clear(&facets[f], MIN_FACET_CLEARANCE_SHARE));
    wrong.extend(touching.map(of_facet));
    wrong.extend(meeting(&facets).into_iter().flatten().map(|f| of_facet(f as usize)));
    if !wrong.is_empty() {
        wrong.sort_unstable();
        wrong.dedup();
        return Err(wrong);
    }
    let half = shell.lattice.half();
    let around = shell.parts.iter().all(|&voxel| {
        let p = DVec3::from_array(voxel.map(|x| x as f64 + 0.5)) - half;
        [true, false].into_iter().all(|is_ours| {
            let triangles = cut.triangles.iter().enumerate().filter(|&(t, _)| cut.is_of(t, is_ours));
            (winding_number(p, triangles.map(|(_, t)| t.at)) - 1.0).abs() < WINDING_TOLERANCE
        })
    });
    if around { Ok(cage) } else { Err(Vec::new()) }
}

/// Triangles of a cage. Quads are cut along both diagonals, as other programs may cut them along either.
struct Cut {
    triangles: Vec<Corners>,
    face_of: Vec<u32>,
    /// Whether each triangle is one of the cage's own; false for the halves of quads that are cut along the other
    /// diagonal. `[n_triangles]`
    is_ours: Vec<bool>,
    /// Whether each triangle is half of a quad. `[n_triangles]`
    is_half: Vec<bool>,
}

impl Cut {
    fn new(cage: &Cage, corners: impl Fn([u32; 3]) -> Corners) -> Self {
        let mut cut =
            Self { triangles: Vec::new(), face_of: Vec::new(), is_ours: Vec::new(), is_half: Vec::new() };
        for (&f, own) in cage.face_of_triangle().iter().zip(cage.triangles()) {
            let face = &cage.faces()[f as usize];
            let is_quad = face.len() == 4;
            if cut.face_of.last() == Some(&f) && is_quad {
                continue;
            }
            for k in 0..if is_quad { 4 } else { 1 } {
                let index = if is_quad { [0, 1, 2].map(|step| face[(k + step) % 4]) } else { *own };
                cut.triangles.push(corners(index));
                cut.face_of.push(f);
                cut.is_ours.push([index[0], index[2]].iter().all(|i| own.contains(i)));
                cut.is_half.push(is_quad);
            }
        }
        cut
    }

    /// Whether a triangle exists when quads are cut as by the cage (`ours`), or along the other diagonal.
    fn is_of(&self, t: usize, ours: bool) -> bool {
        !self.is_half[t] || self.is_ours[t] == ours
    }

    /// Finds faces that intersect others or that, when cut along the diagonal that the cage does not use, form a sharp
    /// fold with others. Of two intersecting triangles, lists the face of the one that this other cut made: the face of the
    /// first if the other cut made both, and both faces if it made neither.
    fn wrong(&self, obstacle: &Obstacle) -> Vec<u32> {
        let mut wrong = Vec::new();
        for pair in meeting(&self.triangles) {
            let [f, g] = pair.map(|t| self.face_of[t as usize]);
            if f != g {
                let [a, b] = pair.map(|t| self.is_ours[t as usize]);
                wrong.extend([(f, !a || b), (g, a)].into_iter().filter(|face| face.1).map(|face| face.0));
            }
        }
        let real: Vec<Corners> = self.triangles.iter().map(|t| obstacle.unstretched(t)).collect();
        for (a, x) in real.iter().enumerate().filter(|&(a, _)| !self.is_ours[a]) {
            let sharp = |y: &Corners| x.fold_cosine(y).is_some_and(|fold| fold < MIN_FOLD_COSINE);
            let mut others = real.iter().zip(&self.face_of);
            if others.any(|(y, face)| *face != self.face_of[a] && sharp(y)) {
                wrong.push(self.face_of[a]);
            }
        }
        wrong
    }
}
