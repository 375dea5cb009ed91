//! Grows a cage until it encloses the model.

use glam::{DVec3, Vec3};

use super::RepairError;
use cagework_core::cage::Cage;
use cagework_core::controls::{ControlSet, Controls, InnerControls};
use cagework_core::enclosure::Enclosure;
use cagework_core::geometry::closest_point_on_triangle;
use cagework_core::mesh::{Bounds, PolygonMesh};

/// Limit on rounds. Each round moves the cage's surface past the vertices that are still outside.
const MAX_ROUNDS: usize = 40;

/// Distance from a model vertex to the triangle that is moved past it, as a fraction of the cage's diagonal.
const MARGIN: f64 = 0.004;

fn control_set(mesh: &PolygonMesh, smooth: u32) -> Result<ControlSet, RepairError> {
    Ok(ControlSet::new(&Cage::new(mesh)?, smooth, InnerControls::default())?)
}

fn outside(mesh: &PolygonMesh, smooth: u32, model: &[Vec3]) -> Result<Vec<u32>, RepairError> {
    Ok(Enclosure::new(Controls::from(&control_set(mesh, smooth)?).surface(), model).outside())
}

/// Moves the vertices of a cage outward until its surface, subdivided `smooth` times, encloses the model. Returns the
/// number of moved vertices.
pub(crate) fn grow(mesh: &mut PolygonMesh, model: &[Vec3], smooth: u32) -> Result<usize, RepairError> {
    let before = mesh.positions.clone();
    let mut left = 0;
    for _ in 0..MAX_ROUNDS {
        let set = control_set(mesh, smooth)?;
        let controls = Controls::from(&set);
        let outside = Enclosure::new(controls.surface(), model).outside();
        left = outside.len();
        if left == 0 {
            return Ok(before.iter().zip(&mesh.positions).filter(|(a, b)| a != b).count());
        }
        push(mesh, controls, outside.iter().map(|&v| model[v as usize].as_dvec3()));
    }
    // Scale the mesh about the model's centre to enclose the vertices that the local moves have left outside.
    scale(mesh, model, smooth)?;
    let left_now = outside(mesh, smooth, model)?.len();
    if left_now > 0 {
        return Err(RepairError::StillOutside { left: left.min(left_now) });
    }
    Ok(before.iter().zip(&mesh.positions).filter(|(a, b)| a != b).count())
}

/// For each point, moves the nearest triangle of the surface outward past the point. This moves the triangle's corners
/// or, if the surface is subdivided, the corners of the triangle's cage face.
fn push(mesh: &mut PolygonMesh, controls: Controls<'_>, points: impl Iterator<Item = DVec3>) {
    let (cage, is_smooth) = (controls.surface(), controls.smooth() > 0);
    let margin = MARGIN * f64::from(cage.diagonal());
    let mut offset = vec![DVec3::ZERO; mesh.positions.len()];
    for p in points {
        let nearest = (0..cage.triangles().len() as u32)
            .map(|t| (t, closest_point_on_triangle(p, cage.triangle_corners(t))))
            .min_by(|a, b| a.1.point.distance_squared(p).total_cmp(&b.1.point.distance_squared(p)));
        let Some((t, closest)) = nearest else { continue };
        let [a, b, c] = cage.triangle_corners(t);
        let way = p - closest.point;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let direction = way.try_normalize().unwrap_or(normal);
        let needed = direction * (way.length() + margin);
        let face = cage.face_of_triangle()[t as usize];
        let corners = match controls.cage_face(face) {
            Some(face) if is_smooth => &controls.cage().faces()[face as usize][..],
            _ => &cage.triangles()[t as usize],
        };
        for &i in corners {
            let so_far = &mut offset[i as usize];
            // Moves towards earlier points may already displace the corner in this direction: add only the missing
            // part.
            let missing = needed.length() - so_far.dot(direction);
            if missing > 0.0 {
                *so_far += direction * missing;
            }
        }
    }
    for (p, o) in mesh.positions.iter_mut().zip(offset) {
        *p = (p.as_dvec3() + o).as_vec3();
    }
}

/// Scales a mesh about the model's centre until its surface encloses all model vertices, by `STEP` up to `STEPS` times.
fn scale(mesh: &mut PolygonMesh, model: &[Vec3], smooth: u32) -> Result<(), RepairError> {
    const STEPS: usize = 24;
    const STEP: f32 = 1.08;
    let Some(bounds) = Bounds::around(model) else { return Ok(()) };
    let center = bounds.center();
    for _ in 0..STEPS {
        for p in &mut mesh.positions {
            *p = center + STEP * (*p - center);
        }
        if outside(mesh, smooth, model)?.is_empty() {
            break;
        }
    }
    Ok(())
}
