//! Narrow places of a cage: thin parts, gaps between parts, and vertices with small faces.
//!
//! A grid resolves a place that is several cells wide. The check of a cage, the notice of a bind and the choice of the
//! grid measure narrow places in the same way.

use glam::DVec3;

use crate::controls::Controls;
use crate::geometry::distance_along;
use crate::options::MAX_GRID;
use crate::words::counted;

/// Two faces bound a part or a gap, rather than a corner, if the dot product of their normals is at most this: the angle
/// between them is below 60 degrees.
const MAX_NORMAL_DOT: f64 = -0.5;

/// Limit on the number of tests of a ray against a triangle. The faces of larger cages are sampled evenly.
const MAX_TESTS: u64 = 4_000_000;

/// Width of a part, and of the faces of a vertex, that a grid resolves, in cells. A thinner part may contain no cell centre,
/// and then has no unknowns; smaller faces may meet no grid line, and then have no influence on the solution.
const MIN_CELLS: f64 = 1.0;

/// Barycentric coordinates of the points of a triangle from which rays start: the centres of the four triangles into
/// which its edge midpoints divide it.
const RAY_ORIGINS: [[f64; 3]; 4] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
];

/// Side of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The part of the cage behind the face.
    Inside,
    /// The gap in front of the face.
    Outside,
}

/// The space between a face of a cage and the faces opposite to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NarrowPlace {
    /// Face of the cage.
    pub face: u32,
    /// Side of the face.
    pub side: Side,
    /// Median distance to the opposite faces, object units.
    pub width: f64,
    /// Area of the face, and of the faces near it that are not measured, object units squared.
    pub area: f64,
    /// Point halfway between the face and an opposite one, object units.
    pub middle: DVec3,
}

/// A triangle of the surface.
#[derive(Clone, Copy)]
struct Triangle {
    /// Face of the cage.
    face: u32,
    corners: [DVec3; 3],
    /// Normal times twice the area.
    cross: DVec3,
    /// A sphere that contains the triangle: centre and squared radius.
    sphere: (DVec3, f64),
}

impl Triangle {
    fn new(face: u32, corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let center = (a + b + c) / 3.0;
        let radius_squared = corners.map(|p| p.distance_squared(center)).into_iter().fold(0.0, f64::max);
        Self { face, corners, cross: (b - a).cross(c - a), sphere: (center, 1.001 * radius_squared) }
    }

    /// Whether a line through `from` along a unit vector may meet the triangle.
    fn may_meet(&self, from: DVec3, way: DVec3) -> bool {
        let (center, radius_squared) = self.sphere;
        (center - from).reject_from_normalized(way).length_squared() <= radius_squared
    }
}

/// All narrow places of a cage.
#[derive(Clone, Debug, Default)]
pub struct NarrowPlaces {
    /// Narrowest first.
    places: Vec<NarrowPlace>,
    /// Size of the faces around each vertex of the cage, object units; infinite for a vertex without faces.
    /// `[n_vertices]`
    vertex_sizes: Vec<f64>,
    /// Longest side of the cage's box, object units.
    longest_side: f64,
}

impl NarrowPlaces {
    /// Measures the distance from points of each face to the first face that a ray along the normal meets, on both sides.
    /// Inner walls are ignored.
    #[must_use]
    pub fn new(controls: Controls<'_>) -> Self {
        let surface = controls.surface();
        let triangles: Vec<Triangle> = (0..)
            .zip(surface.face_of_triangle())
            .filter_map(|(triangle, &part)| {
                Some(Triangle::new(controls.cage_face(part)?, surface.triangle_corners(triangle)))
            })
            .collect();
        let cage = controls.cage();
        let mut of_face = vec![Vec::new(); cage.faces().len()];
        for &triangle in &triangles {
            of_face[triangle.face as usize].push(triangle);
        }
        let area_of =
            |own: &[Triangle]| own.iter().map(|triangle| 0.5 * triangle.cross.length()).sum::<f64>();
        // Of the faces of each vertex: their area and their two largest widths.
        let mut of_vertex = vec![(0.0, [0.0; 2]); cage.n_vertices()];
        for (face, own) in cage.faces().iter().zip(&of_face) {
            let outline: Vec<DVec3> =
                face.iter().map(|&vertex| cage.positions()[vertex as usize].as_dvec3()).collect();
            let (area, width) = (area_of(own), width_of(&outline));
            for &vertex in face {
                let (sum, [first, second]) = &mut of_vertex[vertex as usize];
                *sum += area;
                (*first, *second) = (width.max(*first), width.min(*first).max(*second));
            }
        }
        let size = |&(area, [first, second]): &(f64, [f64; 2])| match area {
            0.0 => f64::INFINITY,
            _ => f64::min(f64::sqrt(area), first + second),
        };
        let vertex_sizes = of_vertex.iter().map(size).collect();
        let tests = (2 * RAY_ORIGINS.len()) as u64 * (triangles.len() as u64).pow(2);
        let step = tests.div_ceil(MAX_TESTS).max(1) as usize;
        let mut places = Vec::new();
        for (face, own) in (0..).zip(&of_face).step_by(step) {
            let mut of_sides = [Vec::new(), Vec::new()];
            for [inside, outside] in own.iter().flat_map(|own| widths(own, &triangles)) {
                of_sides[0].push(inside);
                of_sides[1].push(outside);
            }
            for (side, mut widths) in [Side::Inside, Side::Outside].into_iter().zip(of_sides) {
                widths.sort_by(|a, b| a.0.total_cmp(&b.0));
                if let Some(&(width, middle)) = widths.get(widths.len() / 2)
                    && width.is_finite()
                {
                    let area = area_of(own) * step as f64;
                    places.push(NarrowPlace { face, side, width, area, middle });
                }
            }
        }
        places.sort_by(|a, b| a.width.total_cmp(&b.width));
        let longest_side = f64::from(surface.bounds().extent().max_element());
        Self { places, vertex_sizes, longest_side }
    }

    /// Size of a cell, object units, of a grid with `cells` cells along the cage's longest side.
    #[must_use]
    pub fn cell(&self, cells: u32) -> f64 {
        self.longest_side / f64::from(cells.max(1))
    }

    /// The narrowest part or gap; `None` if no two faces are opposite.
    ///
    /// Faces beside a sharp edge are close together only there. Therefore the areas of the faces are added up from the
    /// narrowest place on, and the first width whose square is at most the sum counts.
    #[must_use]
    pub fn narrowest(&self) -> Option<NarrowPlace> {
        narrowest(self.places.iter())
    }

    /// The thinnest part, like [`Self::narrowest`] without gaps.
    #[must_use]
    pub fn thinnest(&self) -> Option<NarrowPlace> {
        narrowest(self.parts())
    }

    fn parts(&self) -> impl Iterator<Item = &NarrowPlace> {
        self.places.iter().filter(|place| place.side == Side::Inside)
    }

    /// The places that a grid does not resolve: parts thinner than a cell, and vertices with faces smaller than a cell.
    /// `cells`: number of cells along the cage's longest side. `None` if it resolves all.
    #[must_use]
    pub fn unresolved(&self, cells: u32) -> Option<Unresolved> {
        let cell = self.cell(cells);
        let is_thin = |place: &NarrowPlace| place.width < MIN_CELLS * cell;
        let thinnest = self.thinnest().filter(is_thin).map(|place| place.width);
        let parts: Vec<NarrowPlace> =
            if thinnest.is_some() { self.parts().copied().filter(is_thin).collect() } else { Vec::new() };
        let vertices: Vec<u32> = (0..)
            .zip(&self.vertex_sizes)
            .filter_map(|(vertex, &size)| (size < MIN_CELLS * cell).then_some(vertex))
            .collect();
        let smallest = vertices.iter().map(|&vertex| self.vertex_sizes[vertex as usize]).reduce(f64::min);
        let enough = |size: Option<f64>| size.map_or(0.0, |size| MIN_CELLS * self.longest_side / size);
        if parts.is_empty() && vertices.is_empty() {
            return None;
        }
        // Rounding can give the number that is not enough.
        let wanted = enough(thinnest).max(enough(smallest)).ceil().max(f64::from(cells) + 1.0);
        let cells = (wanted <= f64::from(MAX_GRID)).then_some(wanted as u32);
        Some(Unresolved { parts, vertices, cells })
    }
}

/// Places that a grid does not resolve.
#[derive(Clone, Debug, PartialEq)]
pub struct Unresolved {
    /// Parts thinner than a cell, thinnest first.
    pub parts: Vec<NarrowPlace>,
    /// Vertices of the cage with faces smaller than a cell, ascending.
    pub vertices: Vec<u32>,
    /// Number of cells along the longest side of a grid that resolves all places; `None` if no grid does.
    pub cells: Option<u32>,
}

impl std::fmt::Display for Unresolved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let places = self.parts.first().map(|thinnest| {
            let [x, y, z] = thinnest.middle.as_vec3().to_array();
            let n = counted(self.parts.len(), "face", "faces");
            format!("the cage is thinner than a cell behind {n}, thinnest at ({x:.3}, {y:.3}, {z:.3})")
        });
        let vertices = self.vertices.first().map(|first| match self.vertices.len() {
            1 => format!("the faces of vertex {first} are smaller than a cell"),
            n => format!("the faces of {n} vertices (from {first} on) are smaller than a cell"),
        });
        let both: Vec<String> = places.into_iter().chain(vertices).collect();
        let advice = match self.cells {
            Some(cells) => format!("use a grid of {cells} cells"),
            None => "no grid is fine enough: make the cage thicker there, or coarser".to_owned(),
        };
        let both = both.join(", and ");
        write!(
            f,
            "The grid does not resolve the cage: {both}. Weights there depend on the cage's place in the grid: {advice}."
        )
    }
}

fn narrowest<'a>(mut places: impl Iterator<Item = &'a NarrowPlace>) -> Option<NarrowPlace> {
    let mut area = 0.0;
    places
        .find(|place| {
            area += place.area;
            place.width * place.width <= area
        })
        .copied()
}

/// Width of a polygon: the smallest distance between an edge's line and the corner farthest from it.
fn width_of(outline: &[DVec3]) -> f64 {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    let of_edge = |(&a, &b): (&DVec3, &DVec3)| {
        let along = (b - a).normalize_or(DVec3::X);
        outline.iter().map(|&p| (p - a).reject_from(along).length()).fold(0.0, f64::max)
    };
    edges.map(of_edge).fold(f64::INFINITY, f64::min)
}

/// Distances along the normal from points of a triangle to the opposite triangle, inside and outside, each with the point
/// halfway; infinite where no triangle is opposite.
fn widths(own: &Triangle, triangles: &[Triangle]) -> [[(f64, DVec3); 2]; RAY_ORIGINS.len()] {
    let normal = own.cross.normalize_or_zero();
    let ways = [-normal, normal];
    RAY_ORIGINS.map(|shares| {
        let from = (0..3).map(|k| shares[k] * own.corners[k]).sum::<DVec3>();
        let mut nearest = [(f64::INFINITY, DVec3::ZERO); 2];
        // Triangles that touch the ray's own are at distance 0. They bound no part and no gap.
        let others =
            triangles.iter().filter(|other| other.may_meet(from, normal) && other.corners != own.corners);
        for triangle in others {
            for (way, nearest) in ways.into_iter().zip(&mut nearest) {
                if let Some(distance) = distance_along(from, way, triangle.corners)
                    && distance > 0.0
                    && distance < nearest.0
                {
                    *nearest = (distance, triangle.cross);
                }
            }
        }
        [0, 1].map(|side| {
            let (width, facing) = nearest[side];
            let is_opposite = normal.dot(facing.normalize_or_zero()) <= MAX_NORMAL_DOT;
            if is_opposite { (width, from + 0.5 * width * ways[side]) } else { (f64::INFINITY, from) }
        })
    })
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;
    use crate::cage::shapes::together;
    use crate::cage::{Cage, subdivided_box};
    use crate::mesh::{Bounds, PolygonMesh};

    #[test]
    fn thickness_and_gap_of_two_plates() {
        let plate = |z: f32, height: f32| {
            let bounds = Bounds { min: vec3(0.0, 0.0, z), max: vec3(4.0, 4.0, z + height) };
            subdivided_box(bounds, 0.0, [4, 4, 1])
        };
        let cage = Cage::new(&together(&plate(0.0, 0.5), &plate(0.75, 1.0))).unwrap();
        let places = NarrowPlaces::new((&cage).into());
        let narrowest = places.narrowest().unwrap();
        assert_eq!((narrowest.side, narrowest.width, narrowest.middle.z), (Side::Outside, 0.25, 0.625));
        let thinnest = places.thinnest().unwrap();
        assert_eq!((thinnest.side, thinnest.width, thinnest.middle.z), (Side::Inside, 0.5, 0.25));
        // A cell of 8 cells along 4 units is as wide as the lower plate is thick.
        assert_eq!(places.unresolved(8), None);
        let unresolved = places.unresolved(7).unwrap();
        assert_eq!((unresolved.parts.len(), unresolved.cells), (32, Some(8)));
        assert!(unresolved.to_string().contains("behind 32 faces"), "{unresolved}");
    }

    /// The faces beside the edge of a wedge are close together only there: the narrowest place is as wide as the faces are
    /// long, whatever their number.
    #[test]
    fn sharp_edge_is_not_a_thin_part() {
        for n in [8, 32] {
            let slab = subdivided_box(Bounds { min: Vec3::ZERO, max: vec3(8.0, 1.0, 8.0) }, 0.0, [n, 1, 1]);
            let positions =
                slab.positions.iter().map(|p| vec3(p.x, p.y * (p.x + 1e-3) / 16.0, p.z)).collect();
            let cage = Cage::new(&PolygonMesh { positions, ..slab }).unwrap();
            let places = NarrowPlaces::new((&cage).into());
            let thinnest = places.thinnest().unwrap().width;
            assert!(thinnest < 0.5 && thinnest > 0.01, "{n}: {thinnest}");
        }
    }

    #[test]
    fn vertex_with_small_faces_is_not_resolved_by_a_coarse_grid() {
        let mut mesh = subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, 0.0, [1, 1, 1]);
        // A vertex at the centre of a corner triangle of the first face. Its three faces are 0.04 wide at most.
        let face = mesh.faces.remove(0);
        let at = |k: usize| mesh.positions[face[k] as usize];
        let (a, b, d) = (at(0), at(0).lerp(at(1), 0.12), at(0).lerp(at(3), 0.12));
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([b, d, (a + b + d) / 3.0]);
        let [b, d, tip] = [first, first + 1, first + 2];
        mesh.faces.extend([vec![face[0], b, tip], vec![b, d, tip], vec![d, face[0], tip]]);
        mesh.faces.push(vec![b, face[1], face[2], face[3], d]);
        let edge = |k: usize, l: usize, new: u32, mesh: &mut PolygonMesh| {
            for outline in &mut mesh.faces[..5] {
                let n = outline.len();
                let at = (0..n).find(|&i| outline[i] == face[l] && outline[(i + 1) % n] == face[k]);
                if let Some(at) = at {
                    outline.insert(at + 1, new);
                }
            }
        };
        edge(0, 1, b, &mut mesh);
        edge(3, 0, d, &mut mesh);
        let cage = Cage::new(&mesh).unwrap();
        let unresolved = NarrowPlaces::new((&cage).into()).unresolved(10).unwrap();
        // A cell is as wide as two faces with 12.5 cells.
        assert_eq!((unresolved.vertices.as_slice(), unresolved.cells), (&[tip][..], Some(13)));
        assert!(unresolved.parts.is_empty() && unresolved.to_string().contains("13 cells"), "{unresolved}");
    }
}
