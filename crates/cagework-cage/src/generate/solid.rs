//! The voxels of a model as a solid, for skeletons.

use cagework_core::progress::Cancellation;
use glam::DVec3;

use super::MAX_ROWS;
use super::footprint::Footprint;
use super::voxels::Voxels;

/// Number of triangles between polls for cancellation.
const TRIANGLES_PER_CHECK: usize = 4096;

/// Finds the voxels that overlap a triangle or that these enclose, of the largest face-connected component, in
/// lexicographic order. Returns `None` if the triangles cover too many rows of voxels.
///
/// `points`: vertices in voxels from the box's corner. The outermost layer of the box must stay empty. `mirror`: axis of
/// the box along which the solid is united with its image.
///
/// # Errors
/// If `go_on` cancels.
pub(crate) fn solid_voxels(
    points: &[DVec3],
    triangles: &[[u32; 3]],
    dims: [usize; 3],
    mirror: Option<usize>,
    go_on: &dyn Fn() -> Result<(), Cancellation>,
) -> Result<Option<Vec<[usize; 3]>>, Cancellation> {
    let mut touched = Voxels::new(dims);
    let mut n_rows = 0.0;
    for (k, t) in triangles.iter().enumerate() {
        if k % TRIANGLES_PER_CHECK == 0 {
            go_on()?;
        }
        let footprint = Footprint::new(t.map(|v| points[v as usize]), 0.0);
        n_rows += footprint.n_rows(dims) as f64;
        if n_rows > MAX_ROWS {
            return Ok(None);
        }
        footprint.add_to(&mut touched);
    }
    if let Some(axis) = mirror {
        let image = touched.mirrored(axis);
        touched.unite(&image);
    }
    go_on()?;
    let islands = touched.filled().islands();
    let mut largest = islands.into_iter().rev().max_by_key(Vec::len).unwrap_or_default();
    largest.sort_unstable();
    Ok(Some(largest))
}
