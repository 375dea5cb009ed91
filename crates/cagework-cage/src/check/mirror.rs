//! Detects and completes half a cage, modelled with a mirror modifier that was not applied. All open edges of such a
//! cage lie in one axis-aligned plane.

use cagework_core::mesh::PolygonMesh;
use glam::DVec3;

/// Largest distance of a vertex that counts as in the mirror plane, as a fraction of the diagonal of the mesh. It
/// allows for rounding by the modelling program.
const PLANE_TOLERANCE: f64 = 1e-4;

/// An axis-aligned plane that contains all open edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    axis: usize,
    at: f32,
}

impl Plane {
    /// Returns the plane that contains all `open` edges, if there is one, the whole mesh lies on one side of it, and the
    /// open edges enclose an area. They enclose none where a vertex of one face lies on an edge of another.
    pub(super) fn of(mesh: &PolygonMesh, open: &[[u32; 2]]) -> Option<Self> {
        let reach = (PLANE_TOLERANCE * mesh.diagonal()) as f32;
        let first = mesh.positions[open.first()?[0] as usize];
        let position =
            |v: u32| mesh.positions.get(v as usize).map_or(DVec3::ZERO, |p| (*p - first).as_dvec3());
        let area = open.iter().map(|&[a, b]| 0.5 * position(a).cross(position(b))).sum::<DVec3>();
        let min_area = PLANE_TOLERANCE * mesh.diagonal().powi(2);
        (0..3).find_map(|axis| {
            if area[axis].abs() <= min_area {
                return None;
            }
            let at = if first[axis].abs() <= reach { 0.0 } else { first[axis] };
            // Faces may have invalid indices.
            let from_plane = |v: u32| mesh.positions.get(v as usize).map_or(0.0, |p| p[axis] - at);
            let is_border = open.as_flattened().iter().all(|&v| from_plane(v).abs() <= reach);
            let mut sides = mesh.faces.iter().flatten().map(|&v| from_plane(v)).filter(|x| x.abs() > reach);
            let side = sides.next()?;
            (is_border && sides.all(|x| (x > 0.0) == (side > 0.0))).then_some(Self { axis, at })
        })
    }

    /// Whether the plane goes through the origin, as the mirror plane of a modelling program does by default.
    pub(super) fn is_central(self) -> bool {
        self.at == 0.0
    }

    /// Adds the mirror image of the mesh. Moves the vertices of open edges, which both halves share, into the plane.
    pub(super) fn mirror(self, mesh: &mut PolygonMesh, open: &[[u32; 2]]) -> String {
        let Self { axis, at } = self;
        let mut other: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        let mut is_used = vec![false; other.len()];
        for &v in mesh.faces.iter().flatten().filter(|v| (**v as usize) < other.len()) {
            is_used[v as usize] = true;
        }
        for &v in open.as_flattened() {
            mesh.positions[v as usize][axis] = at;
            is_used[v as usize] = false;
        }
        for v in (0..other.len()).filter(|&v| is_used[v]) {
            other[v] = mesh.positions.len() as u32;
            let mut p = mesh.positions[v];
            p[axis] = 2.0 * at - p[axis];
            mesh.positions.push(p);
        }
        let mirrored = |face: &Vec<u32>| {
            face.iter().rev().map(|&v| other.get(v as usize).copied().unwrap_or(v)).collect()
        };
        let faces: Vec<Vec<u32>> = mesh.faces.iter().map(mirrored).collect();
        let n = faces.len();
        mesh.faces.extend(faces);
        format!("Mirrored {n} faces across {} = {at}.", ["x", "y", "z"][axis])
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::check::{Code, Fix, Repair, check, repair};
    use cagework_core::cage::Cage;
    use cagework_core::cage::subdivided_box;
    use cagework_core::mesh::Bounds;

    /// Half of a box of side 2, cut by a plane normal to `axis`. The centre of the whole box is at `at` along `axis`.
    fn half(axis: usize, at: f32) -> PolygonMesh {
        let mut mesh = subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.0, [2; 3]);
        mesh.faces.retain(|face| face.iter().all(|&v| mesh.positions[v as usize][axis] <= 0.0));
        mesh.positions.iter_mut().for_each(|p| p[axis] += at);
        mesh
    }

    #[test]
    fn half_a_cage_is_completed() {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let mesh = half(axis, 0.0);
            let fixes = check(&mesh, None, None).problem(Code::OpenEdge).unwrap().fixes.clone();
            assert_eq!(fixes[0], Fix::Repair { repair: Repair::Mirror });
            let mended = repair(&mesh, &[Repair::DropDegenerate, Repair::Mirror], None).unwrap();
            assert_eq!(mended.done[1], format!("Mirrored 12 faces across {name} = 0."));
            let cage = Cage::new(&mended.mesh).unwrap();
            // The whole box has 3^3 points minus the one at its centre, and 6 sides of 4 faces.
            assert_eq!((cage.n_vertices(), cage.faces().len(), cage.notices().len()), (26, 24, 0));
            assert_eq!((cage.bounds().min, cage.bounds().max), (Vec3::splat(-1.0), Vec3::ONE));
        }
        let beside = half(0, 3.0);
        let fixes = check(&beside, None, None).problem(Code::OpenEdge).unwrap().fixes.clone();
        assert_eq!(
            fixes,
            [Fix::Repair { repair: Repair::FillHoles }],
            "a plane away from the origin is not offered, but can be requested"
        );
        let mended = repair(&beside, &[Repair::Mirror], None).unwrap();
        assert_eq!(mended.done, ["Mirrored 12 faces across x = 3."]);
        // A corner in the middle of one edge leaves three open edges in a plane, which enclose no area: a T-junction.
        let mut whole = subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, 0.0, [1; 3]);
        let face = &mut whole.faces[0];
        let [a, b] = [face[0], face[1]].map(|v| whole.positions[v as usize]);
        face.insert(1, whole.positions.len() as u32);
        whole.positions.push(a.midpoint(b));
        let problem = check(&whole, None, None);
        let problem = problem.problem(Code::OpenEdge).unwrap();
        assert_eq!((problem.count, &problem.fixes[..]), (3, &[Fix::Repair { repair: Repair::Weld }][..]));
        // The open boundary is not planar, so there is no mirror plane.
        let mut bent = half(0, 0.0);
        bent.positions.iter_mut().filter(|p| p.x == 0.0 && p.y > 0.5).for_each(|p| p.x = 0.25);
        assert_eq!(repair(&bent, &[Repair::Mirror], None).unwrap().done, [""; 0]);
    }
}
