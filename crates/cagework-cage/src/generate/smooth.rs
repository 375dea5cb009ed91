//! Cages whose subdivided surface encloses the model. Subdivision shrinks a cage, so cages are generated with
//! increasing clearance, and grown if they are not mirror-symmetric, until one encloses the model.

use glam::{DVec3, Vec3};

use super::Effort;
use super::options::{self, CageGenError, CageOptions, GeneratedCage};
use crate::check::grow;
use cagework_core::cage::Cage;
use cagework_core::contact::{Corners, meeting};
use cagework_core::controls::{ControlSet, Controls, InnerControls};
use cagework_core::enclosure::Enclosure;
use cagework_core::progress::Progress;

/// Clearances that are tried in this order, as fractions of the diagonal of the model's box. All test models need at
/// most 0.05; the larger clearances are a reserve. A model that takes long gets the first ones and [`MAX_CLEARANCE`].
const CLEARANCES: [f32; 8] = [0.0, 0.01, 0.02, 0.03, 0.045, 0.06, 0.08, MAX_CLEARANCE];

const MAX_CLEARANCE: f32 = 0.12;

/// Generates a cage whose surface encloses the model after `options.smooth` subdivision steps.
pub(super) fn generate(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &CageOptions,
    effort: &Effort,
    progress: &dyn Progress,
) -> Result<GeneratedCage, CageGenError> {
    options::check(positions, triangles, options)?;
    // Points to enclose: vertices, edge midpoints and triangle centroids.
    let middles = triangles.iter().flat_map(|t| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0]
    });
    let points: Vec<Vec3> = positions.iter().copied().chain(middles).collect();
    let began = progress.now_ms();
    for (attempt, room) in
        (1u32..).zip(CLEARANCES.into_iter().filter(|&room| room == 0.0 || room > options.clearance))
    {
        if effort.is_low() && room < MAX_CLEARANCE {
            continue;
        }
        let clearance = room.max(options.clearance);
        let mut made = super::generate_plain(
            positions,
            triangles,
            &CageOptions { clearance, ..*options },
            effort,
            progress,
        )?;
        let mut mesh = made.cage.to_polygon_mesh();
        // Growing would break the symmetry of a mirrored cage.
        if made.report.mirror.is_none() && grow(&mut mesh, &points, options.smooth).is_err() {
            continue;
        }
        let Ok(cage) = Cage::new(&mesh) else { continue };
        let Ok(set) = ControlSet::new(&cage, options.smooth, InnerControls::default()) else { continue };
        let surface = Controls::from(&set).surface();
        if Enclosure::new(surface, &points).outside().is_empty() && keeps_apart(&cage) && keeps_apart(surface)
        {
            made.cage = cage;
            made.report.attempts = attempt;
            made.report.elapsed_ms = progress.now_ms() - began;
            return Ok(made);
        }
    }
    Err(CageGenError::Unsmooth)
}

/// Whether a cage is free of self-intersections.
fn keeps_apart(cage: &Cage) -> bool {
    let at = |index: [u32; 3]| index.map(|i| -> DVec3 { cage.positions()[i as usize].as_dvec3() });
    let triangles: Vec<Corners> =
        cage.triangles().iter().map(|&index| Corners { index, at: at(index) }).collect();
    meeting(&triangles).is_empty()
}
