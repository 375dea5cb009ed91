//! Picking: vertices, edges, faces and surface points under the pointer.

use glam::{Vec2, Vec3};

use cagework_core::view::View;

/// Two ray hits count as one if the distance between them is at most this fraction of their distance from the eye.
const HIT_TOLERANCE: f32 = 1e-5;

/// Element type that a click selects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Element {
    /// A single vertex.
    #[default]
    Vertex,
    /// An edge: both of its ends are selected.
    Edge,
    /// A face: all of its corners are selected.
    Face,
}

/// Edges and faces of a cage, for editing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Corners of each face in order around it. `[n_faces]`
    pub faces: Vec<Vec<u32>>,
    /// Each edge once, smaller index first, ascending. `[n_edges]`
    pub edges: Vec<[u32; 2]>,
}

impl Topology {
    /// Collects the edges of faces, including open edges of an unfinished cage.
    #[must_use]
    pub fn new(faces: &[Vec<u32>]) -> Self {
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for face in faces {
            for (k, &a) in face.iter().enumerate() {
                let b = face[(k + 1) % face.len()];
                edges.push([a.min(b), a.max(b)]);
            }
        }
        edges.sort_unstable();
        edges.dedup();
        Self { faces: faces.to_vec(), edges }
    }
}

/// The vertex within `radius` pixels of the pointer. Vertices of front faces take precedence over vertices of back
/// faces, which are picked only `with_hidden`. Among vertices at about the depth of the frontmost one (within twice the
/// radius), the one nearest to the pointer is picked.
#[must_use]
pub fn pick_vertex(
    positions: &[Vec3],
    topology: &Topology,
    view: &dyn View,
    pointer: Vec2,
    radius: f32,
    with_hidden: bool,
) -> Option<u32> {
    let near = positions.iter().enumerate().filter_map(|(i, &p)| {
        let (pixel, depth) = view.project(p)?;
        let distance = pixel.distance(pointer);
        (distance <= radius).then(|| (i as u32, depth, distance, radius * view.units_per_pixel(p)))
    });
    // Inner controls have no face and are drawn on top: nothing occludes them.
    let (of_faces, inside): (Vec<_>, Vec<_>) =
        near.partition(|near| topology.faces.iter().any(|face| face.contains(&near.0)));
    let inside = inside.into_iter().min_by(|a, b| a.2.total_cmp(&b.2));
    let distances: Vec<(u32, f32)> = of_faces.iter().map(|near| (near.0, near.2)).collect();
    let (seen, hidden): (Vec<_>, Vec<_>) =
        of_faces.into_iter().partition(|near| is_seen(near.0, positions, topology, view));
    let of_faces =
        in_front(seen.into_iter()).or_else(|| in_front(hidden.into_iter()).filter(|_| with_hidden));
    let distance = |vertex| distances.iter().find(|(v, _)| *v == vertex).map_or(f32::INFINITY, |(_, d)| *d);
    match (inside, of_faces) {
        (Some(inside), Some(vertex)) if distance(vertex) < inside.2 => Some(vertex),
        (Some(inside), _) => Some(inside.0),
        (None, of_faces) => of_faces,
    }
}

/// Whether the model covers a vertex that [`pick_vertex`] has picked: its frontmost point under the pointer, `surface`, is
/// in front of the vertex by more than twice the radius. Inner controls are drawn on top, so nothing covers them.
#[must_use]
pub fn is_covered(
    vertex: u32,
    positions: &[Vec3],
    topology: &Topology,
    view: &dyn View,
    radius: f32,
    surface: Vec3,
) -> bool {
    let position = positions[vertex as usize];
    let depth = |p: Vec3| view.project(p).map(|(_, depth)| depth);
    let reach = 2.0 * radius * view.units_per_pixel(position);
    topology.faces.iter().any(|face| face.contains(&vertex))
        && depth(surface).zip(depth(position)).is_some_and(|(near, far)| near + reach < far)
}

/// Whether a face at the vertex is front-facing.
fn is_seen(vertex: u32, positions: &[Vec3], topology: &Topology, view: &dyn View) -> bool {
    topology.faces.iter().filter(|face| face.contains(&vertex)).any(|face| {
        let pixels: Option<Vec<Vec2>> =
            face.iter().map(|&i| view.project(positions[i as usize]).map(|(pixel, _)| pixel)).collect();
        // The pixel y axis points down, so a counter-clockwise outline has a negative area.
        pixels.is_none_or(|pixels| {
            let next = pixels.iter().cycle().skip(1);
            pixels.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>() < 0.0
        })
    })
}

/// A point inside the model under the pointer: midway between the first two hits of the ray. If the ray misses the
/// model, the point of the ray nearest to `center`.
#[must_use]
pub fn pick_middle(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    view: &dyn View,
    pointer: Vec2,
    center: Vec3,
) -> Vec3 {
    let (origin, direction) = view.ray(pointer);
    let meets = |t: &[u32; 3]| ray_meets_triangle(origin, direction, t.map(|v| positions[v as usize]));
    let mut hits: Vec<f32> = triangles.iter().filter_map(meets).map(|(along, _)| along).collect();
    hits.sort_unstable_by(f32::total_cmp);
    // A ray through an edge hits two triangles.
    hits.dedup_by(|b, a| *b - *a <= HIT_TOLERANCE * *a);
    let along = match hits[..] {
        [enters, leaves, ..] => f32::midpoint(enters, leaves),
        _ => (center - origin).dot(direction),
    };
    origin + along * direction
}

/// The edge within `radius` pixels of the pointer, as index into [`Topology::edges`]. If there are several: the one
/// nearest to the pointer among those at about the depth of the frontmost one (within twice the radius).
#[must_use]
pub fn pick_edge(
    positions: &[Vec3],
    topology: &Topology,
    view: &dyn View,
    pointer: Vec2,
    radius: f32,
) -> Option<u32> {
    let near = topology.edges.iter().enumerate().filter_map(|(e, edge)| {
        let [(a, depth_a), (b, depth_b)] =
            [view.project(positions[edge[0] as usize])?, view.project(positions[edge[1] as usize])?];
        let along =
            ((pointer - a).dot(b - a) / (b - a).length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        let distance = pointer.distance(a.lerp(b, along));
        let depth = depth_a + along * (depth_b - depth_a);
        let middle = positions[edge[0] as usize].lerp(positions[edge[1] as usize], along);
        (distance <= radius).then(|| (e as u32, depth, distance, radius * view.units_per_pixel(middle)))
    });
    in_front(near)
}

/// Chooses from (index, depth, distance from the pointer, size of the radius at that depth) the item nearest to the
/// pointer, among those at about the depth of the frontmost one.
fn in_front(near: impl Iterator<Item = (u32, f32, f32, f32)>) -> Option<u32> {
    let near: Vec<_> = near.collect();
    let front = near.iter().map(|n| n.1).fold(f32::INFINITY, f32::min);
    near.iter()
        .filter(|(_, depth, _, size)| *depth <= front + 2.0 * size)
        .min_by(|a, b| a.2.total_cmp(&b.2))
        .map(|n| n.0)
}

/// The frontmost face under the pointer, by the triangle fan around its centroid.
#[must_use]
pub fn pick_face(positions: &[Vec3], topology: &Topology, view: &dyn View, pointer: Vec2) -> Option<u32> {
    let (origin, direction) = view.ray(pointer);
    let mut best: Option<(f32, u32)> = None;
    for (f, face) in topology.faces.iter().enumerate() {
        let corners: Vec<Vec3> = face.iter().map(|&i| positions[i as usize]).collect();
        let middle = corners.iter().sum::<Vec3>() / corners.len().max(1) as f32;
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let Some((along, _)) = ray_meets_triangle(origin, direction, [middle, a, b]) else { continue };
            if best.is_none_or(|(nearest, _)| along < nearest) {
                best = Some((along, f as u32));
            }
        }
    }
    best.map(|(_, f)| f)
}

/// The frontmost point of a model under the pointer: triangle and barycentric coordinates.
#[must_use]
pub fn pick_surface(
    positions: &[Vec3],
    triangles: impl Iterator<Item = (u32, [u32; 3])>,
    view: &dyn View,
    pointer: Vec2,
) -> Option<(u32, [f32; 3])> {
    let (origin, direction) = view.ray(pointer);
    let mut nearest = (f32::INFINITY, None);
    for (t, corners) in triangles {
        let corners = corners.map(|v| positions[v as usize]);
        if let Some((along, barycentric)) = ray_meets_triangle(origin, direction, corners)
            && along < nearest.0
        {
            nearest = (along, Some((t, barycentric)));
        }
    }
    nearest.1
}

/// Vertices whose pixels lie in the rectangle between two corners, ascending, including occluded ones.
#[must_use]
pub fn vertices_in_box(positions: &[Vec3], view: &dyn View, corners: [Vec2; 2]) -> Vec<u32> {
    let (low, high) = (corners[0].min(corners[1]), corners[0].max(corners[1]));
    let inside =
        |p: Vec3| view.project(p).is_some_and(|(pixel, _)| pixel.cmpge(low).all() && pixel.cmple(high).all());
    (0..positions.len() as u32).filter(|&i| inside(positions[i as usize])).collect()
}

/// Distance along a ray to a triangle of either orientation, and barycentric coordinates (Möller and Trumbore 1997).
fn ray_meets_triangle(origin: Vec3, direction: Vec3, [a, b, c]: [Vec3; 3]) -> Option<(f32, [f32; 3])> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let det = ab.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = origin - a;
    let u = s.dot(p) / det;
    let q = s.cross(ab);
    let v = direction.dot(q) / det;
    let along = ac.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && along >= 0.0).then_some((along, [1.0 - u - v, u, v]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::tests::{FrontView, cube};

    fn pixel(x: f32, y: f32) -> Vec2 {
        Vec2::new(200.0 + 100.0 * x, 100.0 - 100.0 * y)
    }

    #[test]
    fn inner_control_is_picked_through_faces() {
        // Control 8 is at the centre of the cube, behind the front face.
        let mut cube = cube();
        let topology = Topology::new(&cube.faces);
        cube.positions.push(Vec3::splat(0.5));
        let pick =
            |at, with_hidden| pick_vertex(&cube.positions, &topology, &FrontView, at, 5.0, with_hidden);
        assert_eq!(pick(pixel(0.5, 0.5), false), Some(8));
        assert_eq!(pick(pixel(0.5, 0.5), true), Some(8));
        // Of a vertex of a front face and a control inside the cube, the click picks the one nearer to the pointer.
        cube.positions[8] = Vec3::new(0.97, 1.0, 0.5);
        let pick = |x| pick_vertex(&cube.positions, &topology, &FrontView, pixel(x, 1.0), 5.0, false);
        assert_eq!((pick(0.975), pick(0.995)), (Some(8), Some(7)));
    }

    #[test]
    fn picked_middle_is_midway_between_the_hits_or_nearest_to_the_centre() {
        let cube = cube();
        let triangles: Vec<[u32; 3]> =
            cube.faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
        let middle = |x, y| {
            pick_middle(&cube.positions, &triangles, &FrontView, pixel(x, y), Vec3::new(0.5, 0.5, 0.25))
        };
        // The points are on a diagonal, where a ray hits two triangles at one place, and off the diagonal.
        for (x, y) in [(0.5, 0.5), (0.25, 0.75), (0.3, 0.8)] {
            assert!(middle(x, y).abs_diff_eq(Vec3::new(x, y, 0.5), 1e-5), "{}", middle(x, y));
        }
        assert!(middle(2.0, 0.5).abs_diff_eq(Vec3::new(2.0, 0.5, 0.25), 1e-5));
    }

    #[test]
    fn vertex_in_front_hides_the_one_behind_it() {
        // The cube's vertices have indices x + 2 y + 4 z; vertex 7 is in front of vertex 3.
        let cube = cube();
        let topology = Topology::new(&cube.faces);
        let at = pixel(1.0, 1.0) + Vec2::new(3.0, 4.0);
        assert_eq!(pick_vertex(&cube.positions, &topology, &FrontView, at, 5.0, true), Some(7));
        assert_eq!(pick_vertex(&cube.positions, &topology, &FrontView, at, 4.9, true), None);
        // Of two vertices at the same depth, the click picks the one that is nearer on the screen.
        let two = [Vec3::ZERO, Vec3::new(0.1, 0.0, 0.0)];
        let none = Topology::default();
        assert_eq!(pick_vertex(&two, &none, &FrontView, pixel(0.06, 0.0), 20.0, true), Some(1));
    }

    #[test]
    fn front_vertices_are_picked_before_hidden_ones() {
        // The back of this thin plate is smaller than its front, and the pointer is exactly at a corner of the back.
        // The depth tolerance is twice the pick radius; with the 24 pixels of touch input it exceeds the plate's
        // thickness.
        let mut plate = cube();
        for (i, p) in plate.positions.iter_mut().enumerate() {
            p.z *= 0.05;
            if i < 4 {
                *p += 0.06 * (Vec3::new(0.5, 0.5, p.z) - *p);
            }
        }
        let topology = Topology::new(&plate.faces);
        let at = pixel(plate.positions[3].x, plate.positions[3].y);
        assert_eq!(pick_vertex(&plate.positions, &topology, &FrontView, at, 24.0, true), Some(7));
        assert_eq!(
            pick_vertex(&plate.positions, &topology, &FrontView, at, 1.0, true),
            Some(3),
            "if no front vertex is near"
        );
    }

    #[test]
    fn the_model_covers_vertices_behind_it_but_no_interior_controls() {
        let mut cube = cube();
        let topology = Topology::new(&cube.faces);
        cube.positions.push(Vec3::new(1.0, 1.0, 0.0));
        let covered = |vertex, z| {
            let surface = Vec3::new(1.0, 1.0, z);
            is_covered(vertex, &cube.positions, &topology, &FrontView, 5.0, surface)
        };
        // Vertex 3 is at z = 0, and twice the radius is 0.1.
        assert!(covered(3, 0.5) && covered(3, 0.11) && !covered(3, 0.09) && !covered(3, -0.5));
        assert!(!covered(8, 0.5), "an inner control at the same place");
    }

    #[test]
    fn the_nearest_point_of_a_surface_is_picked() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::X + Vec3::Z, Vec3::Y + Vec3::Z];
        let triangles = [[0, 1, 2], [3, 4, 5]];
        let (triangle, barycentric) =
            pick_surface(&positions, (0..).zip(triangles), &FrontView, pixel(0.25, 0.5)).unwrap();
        assert_eq!(triangle, 1, "in front of the other one");
        assert!(
            barycentric.iter().zip([0.25, 0.25, 0.5]).all(|(a, b)| (a - b).abs() < 1e-5),
            "{barycentric:?}"
        );
        assert_eq!(pick_surface(&positions, (0..).zip(triangles), &FrontView, pixel(0.6, 0.6)), None);
    }

    #[test]
    fn edge_in_front_is_picked_between_its_ends_only() {
        let cube = cube();
        let topology = Topology::new(&cube.faces);
        assert_eq!(topology.edges.len(), 12);
        let edge = pick_edge(&cube.positions, &topology, &FrontView, pixel(0.5, 1.03), 5.0);
        assert_eq!(edge.map(|e| topology.edges[e as usize]), Some([6, 7]));
        assert_eq!(pick_edge(&cube.positions, &topology, &FrontView, pixel(1.1, 1.1), 5.0), None);
    }

    #[test]
    fn nearest_face_under_the_pointer_is_picked() {
        let cube = cube();
        let topology = Topology::new(&cube.faces);
        let face = pick_face(&cube.positions, &topology, &FrontView, pixel(0.25, 0.75));
        assert_eq!(face.map(|f| topology.faces[f as usize].clone()), Some(vec![4, 5, 7, 6]), "z = 1");
        assert_eq!(pick_face(&cube.positions, &topology, &FrontView, pixel(1.25, 0.75)), None);
    }

    #[test]
    fn box_selection_is_independent_of_the_drag_direction() {
        let cube = cube();
        let corners = [pixel(0.5, 1.5), pixel(1.5, -0.5)];
        assert_eq!(vertices_in_box(&cube.positions, &FrontView, corners), [1, 3, 5, 7]);
        assert_eq!(vertices_in_box(&cube.positions, &FrontView, [corners[1], corners[0]]), [1, 3, 5, 7]);
    }
}
