//! Orients components so that faces point away from the solid.

use glam::{DVec3, Vec3};

use super::defects::{CageError, CageNotice};
use super::polygon::{MIN_FACE_HEIGHT, Polygon};
use super::topology::Surface;
use crate::geometry::winding_number;

/// Number of sample points of a component for the test of whether it lies inside another one. Odd, so that inside or
/// outside has the majority; large, because samples disagree where components touch or overlap.
const NESTING_SAMPLES: usize = 31;

/// A point with a winding number of at most this is outside a component, not on its surface.
const MAX_OUTSIDE_WINDING: f64 = 0.25;

/// Limit on the triangles that the tests of nested components visit. Each takes about 40 ns, so all take 5 s.
const MAX_NESTING_TRIANGLES: u64 = 1 << 27;

/// Components with fewer triangles are not tested for enclosing other components: two triangles enclose no volume.
const MIN_ENCLOSING_TRIANGLES: usize = 3;

/// Orients the faces of every component away from the solid (outward, or into a cavity) and projects all faces to their
/// planes. `diagonal`: diagonal of the cage's bounding box.
pub(super) fn orient(
    positions: &[Vec3],
    surface: &mut Surface,
    diagonal: f64,
    notices: &mut Vec<CageNotice>,
) -> Result<Vec<Polygon>, CageError> {
    let measure = |faces: &[Vec<u32>], f: usize| {
        let corners: Vec<DVec3> = faces[f].iter().map(|&i| positions[i as usize].as_dvec3()).collect();
        Polygon::new(&corners, diagonal).map_err(|why| CageError::DegenerateFace { face: f as u32, why })
    };
    let mut polygons =
        (0..surface.faces.len()).map(|f| measure(&surface.faces, f)).collect::<Result<Vec<_>, _>>()?;

    let mut components = vec![Vec::new(); surface.n_components];
    let mut faces_of = vec![Vec::new(); surface.n_components];
    for (f, polygon) in polygons.iter().enumerate() {
        let component = surface.component[f] as usize;
        faces_of[component].push(f);
        let corner = |k: u32| positions[surface.faces[f][k as usize] as usize].as_dvec3();
        components[component].extend(polygon.triangles.iter().map(|t| t.map(corner)));
    }
    let solids: Vec<Solid> = components.into_iter().map(Solid::new).collect();
    for (component, solid) in solids.iter().enumerate() {
        // Volume divided by area measures the thickness. Below the rounding of coordinates, the component is flat.
        if solid.volume.abs() <= MIN_FACE_HEIGHT * diagonal * solid.area {
            return Err(CageError::Flat { component: component as u32, face: faces_of[component][0] as u32 });
        }
    }
    let depths = Solid::depths(&solids).map_err(|needed| CageError::Nested {
        components: solids.len(),
        needed,
        limit: MAX_NESTING_TRIANGLES,
    })?;
    for (component, (solid, depth)) in solids.iter().zip(depths).enumerate() {
        let cavity = depth % 2 == 1;
        let faces = &faces_of[component];
        if (solid.volume < 0.0) != cavity {
            for &f in faces {
                surface.turn(f);
                polygons[f] = measure(&surface.faces, f)?;
            }
        }
        let component = component as u32;
        let turned = faces.iter().filter(|&&f| surface.turned[f]).count();
        if turned > 0 {
            notices.push(CageNotice::Flipped { component, faces: turned, of: faces.len() });
        }
        if cavity {
            notices.push(CageNotice::Cavity { component });
        }
    }
    Ok(polygons)
}

/// A component of a surface as a set of triangles.
#[derive(Clone, Debug)]
pub struct Solid {
    triangles: Vec<[DVec3; 3]>,
    min: DVec3,
    max: DVec3,
    /// Signed volume, positive if the triangles are counter-clockwise seen from outside.
    pub volume: f64,
    area: f64,
}

impl Solid {
    /// Computes bounds, volume and area. `triangles`: corners, all counter-clockwise or all clockwise seen from outside.
    #[must_use]
    pub fn new(triangles: Vec<[DVec3; 3]>) -> Self {
        let corners = || triangles.iter().flatten();
        let min = corners().fold(DVec3::INFINITY, |m, &p| m.min(p));
        let max = corners().fold(DVec3::NEG_INFINITY, |m, &p| m.max(p));
        // Sum tetrahedra with a nearby apex: with the origin as apex, the volumes of a component far from the origin
        // would cancel.
        let center = 0.5 * (min + max);
        let (mut volume, mut area) = (0.0, 0.0);
        for t in &triangles {
            let [a, b, c] = t.map(|p| p - center);
            volume += a.dot(b.cross(c)) / 6.0;
            area += 0.5 * (b - a).cross(c - a).length();
        }
        Self { triangles, min, max, volume, area }
    }

    /// Counts the components that each component lies inside.
    ///
    /// # Errors
    /// The number of triangles to visit, if it exceeds the limit of 2^27.
    pub fn depths(solids: &[Self]) -> Result<Vec<usize>, u64> {
        // A triangle soup may have as many components as triangles.
        let can_enclose = |k: &usize| solids[*k].triangles.len() >= MIN_ENCLOSING_TRIANGLES;
        let around: Vec<usize> = (0..solids.len()).filter(can_enclose).collect();
        let others = |component: usize| around.iter().filter(move |&&k| k != component).map(|&k| &solids[k]);
        let cost = |(component, solid): (usize, &Self)| -> u64 {
            others(component).map(|other| solid.cost_of_is_inside(other)).sum()
        };
        let needed: u64 = solids.iter().enumerate().map(cost).sum();
        if needed > MAX_NESTING_TRIANGLES {
            return Err(needed);
        }
        let depth = |(component, solid): (usize, &Self)| {
            others(component).filter(|other| solid.is_inside(other)).count()
        };
        Ok(solids.iter().enumerate().map(depth).collect())
    }

    /// Number of points of this component that [`Self::is_inside`] tests; 0 if the bounding boxes decide.
    fn samples(&self, other: &Self) -> usize {
        let n = self.triangles.len();
        if n == 0 || self.min.cmplt(other.min).any() || self.max.cmpgt(other.max).any() {
            return 0;
        }
        NESTING_SAMPLES.min(if n.is_multiple_of(2) { n - 1 } else { n })
    }

    /// Number of triangles that [`Self::is_inside`] visits.
    fn cost_of_is_inside(&self, other: &Self) -> u64 {
        self.samples(other) as u64 * other.triangles.len() as u64
    }

    /// Whether this component lies inside `other`; false if they overlap, or without triangles.
    fn is_inside(&self, other: &Self) -> bool {
        let (n, samples) = (self.triangles.len(), self.samples(other));
        if samples == 0 {
            return false;
        }
        let windings = (0..samples).map(|k| {
            let [a, b, c] = self.triangles[k * n / samples];
            winding_number((a + b + c) / 3.0, other.triangles.iter().copied()).abs()
        });
        let windings: Vec<f64> = windings.collect();
        let inside = windings.iter().filter(|w| **w > 0.5).count();
        2 * inside > samples && windings.iter().all(|w| *w > MAX_OUTSIDE_WINDING)
    }
}
