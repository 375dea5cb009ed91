//! Orientation of faces: which ones point inwards.

use std::collections::VecDeque;

use glam::DVec3;

use super::edges::Edges;
use super::{Code, Fix, Places, Problem, Repair, Severity, problem, sentences};
use cagework_core::cage::Solid;
use cagework_core::mesh::PolygonMesh;

#[derive(Clone, Debug)]
pub(super) struct Component {
    pub(super) faces: Vec<u32>,
    /// Whether each of `faces` must be flipped so that all of them point away from the solid.
    pub(super) turn: Vec<bool>,
    /// An edge at which no consistent orientation exists.
    pub(super) one_sided: Option<[u32; 2]>,
}

/// Finds the components, in the order of their first faces, and decides which of their faces must be flipped.
pub(super) fn components(mesh: &PolygonMesh, sound: &[u32], edges: &Edges) -> Vec<Component> {
    let n = mesh.faces.len();
    let mut neighbours: Vec<Vec<(u32, bool, [u32; 2])>> = vec![Vec::new(); n];
    for group in edges.groups().filter(|g| g.len() == 2) {
        let against = group[0].forward == group[1].forward;
        for (a, b) in [(0, 1), (1, 0)] {
            neighbours[group[a].face as usize].push((group[b].face, against, [group[a].lo, group[a].hi]));
        }
    }
    let mut turn: Vec<Option<bool>> = vec![None; n];
    let mut components = Vec::new();
    for &seed in sound {
        if turn[seed as usize].is_some() {
            continue;
        }
        let mut component = Component { faces: Vec::new(), turn: Vec::new(), one_sided: None };
        turn[seed as usize] = Some(false);
        let mut queue = VecDeque::from([(seed, false)]);
        while let Some((f, turned)) = queue.pop_front() {
            component.faces.push(f);
            component.turn.push(turned);
            for &(g, against, edge) in &neighbours[f as usize] {
                match turn[g as usize] {
                    None => {
                        turn[g as usize] = Some(turned != against);
                        queue.push_back((g, turned != against));
                    }
                    Some(other) if other != (turned != against) => component.one_sided = Some(edge),
                    Some(_) => {}
                }
            }
        }
        components.push(component);
    }
    turn_outward(mesh, &mut components);
    components
}

/// Flips whole components whose volume has the wrong sign. The volume must be positive, or negative for a cavity: a
/// component that lies inside an odd number of other components. There are no cavities if [`Solid::depths`] would take
/// too long.
fn turn_outward(mesh: &PolygonMesh, components: &mut [Component]) {
    let solids: Vec<Solid> =
        components.iter().map(|component| Solid::new(triangles(mesh, component))).collect();
    let depths = Solid::depths(&solids).unwrap_or_else(|_| vec![0; solids.len()]);
    for ((component, solid), depth) in components.iter_mut().zip(solids).zip(depths) {
        if (solid.volume < 0.0) != (depth % 2 == 1) {
            for turn in &mut component.turn {
                *turn = !*turn;
            }
        }
    }
}

/// Cuts a component's faces into consistently oriented triangle fans. Fan triangles of a concave face overlap, but the
/// overlaps cancel in signed volumes and winding numbers.
fn triangles(mesh: &PolygonMesh, component: &Component) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for (&f, &turned) in component.faces.iter().zip(&component.turn) {
        let face = &mesh.faces[f as usize];
        for k in 1..face.len() - 1 {
            let mut t = [face[0], face[k], face[k + 1]];
            if turned {
                t.swap(1, 2);
            }
            triangles.push(t.map(|i| mesh.positions[i as usize].as_dvec3()));
        }
    }
    triangles
}

/// Reports faces that point inwards. Returns the number of components.
pub(super) fn report(mesh: &PolygonMesh, sound: &[u32], edges: &Edges, found: &mut Vec<Problem>) -> usize {
    let components = components(mesh, sound, edges);
    for (k, component) in components.iter().enumerate() {
        if let Some(edge) = component.one_sided {
            found.push(Problem {
                places: Places { edges: vec![edge], ..Places::default() },
                message: sentences::one_sided(k),
                ..problem(Code::OneSided, Severity::Error, 1)
            });
            continue;
        }
        let turned: Vec<u32> =
            component.faces.iter().zip(&component.turn).filter(|(_, t)| **t).map(|(f, _)| *f).collect();
        if turned.is_empty() {
            continue;
        }
        let (count, all) = (turned.len(), component.faces.len());
        found.push(Problem {
            places: Places { faces: turned, ..Places::default() },
            fixes: vec![Fix::Repair { repair: Repair::Flip }],
            message: sentences::flipped(k, count, all),
            ..problem(Code::Flipped, Severity::Note, count)
        });
    }
    components.len()
}
