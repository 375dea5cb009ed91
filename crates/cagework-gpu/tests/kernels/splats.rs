//! Kernels of splats: deformation by a field, and sorting by depth.

use cagework_core::field::{Field, Lattice};
use cagework_core::splats::{SortedSplats, SplatPose, Splats, deform_splats};
use cagework_core::team::Team;
use cagework_core::{Bounds, Cage, PolygonMesh, TriMesh};
use cagework_gpu::kernels;
use cagework_gpu::skin::field_table;
use cagework_gpu::splats::{BINS, Depths, sort_splats, splat_rows};
use glam::{Quat, Vec3};

use super::support::{Rng, assert_close, egg};
use super::{ROWS, bytes, run};

fn random_splats(rng: &mut Rng, n: usize, at: impl Fn(&mut Rng) -> Vec3) -> Splats {
    Splats {
        positions: (0..n).map(|_| at(rng)).collect(),
        scales: (0..n).map(|_| 0.1 * rng.point()).collect(),
        rotations: (0..n)
            .map(|_| Quat::from_axis_angle(rng.point().normalize_or(Vec3::Y), 3.0 * rng.unit()))
            .collect(),
        opacities: rng.values(n),
        colors: (0..n).map(|_| rng.point()).collect(),
        ..Splats::default()
    }
}

#[test]
fn deform_splats_matches_cpu() {
    let mut rng = Rng(18);
    let TriMesh { positions, triangles } = egg(5, 6);
    let faces = triangles.iter().map(|t| t.to_vec()).collect();
    let lattice = Lattice::new(&Cage::new(&PolygonMesh { positions, faces }).unwrap(), 24);
    // Displacements of neighbouring nodes differ by up to a third of a cell. Bound and other nodes alternate in layers.
    let n = lattice.dims.element_product();
    let values = (0..n).map(|k| (0.3 * lattice.cell * rng.point()).extend((k / 7 % 2) as f32)).collect();
    let size = lattice.cell * (lattice.dims - 1).as_vec3();
    let (origin, field) = (lattice.origin, Field::of_values(lattice, values));
    // The splats are inside the lattice and outside it.
    let splats = random_splats(&mut rng, 131, |rng| origin + size * (1.2 * rng.point() - 0.1));
    let rest = splats.rest_pose();
    let (table, rows) = (field_table(&field), splat_rows(&rest, &[]));
    let result = run(&kernels::DEFORM_SPLATS, ROWS, 131, &[bytes(&table), bytes(&rows), bytes(&rows)]);
    let sorted = SortedSplats::new(&splats, &field.lattice);
    let (mut posed, mut expected) = (SplatPose::default(), rest);
    deform_splats(&sorted, &field, &Team::new(1), &mut posed);
    for (k, &splat) in sorted.order.iter().enumerate() {
        expected.positions[splat as usize] = posed.positions[k];
        expected.covariances[splat as usize] = posed.covariances[k];
    }
    // Rounding of a point's place in its cell, 1e-6 of a cell, times gradients near 1.
    assert_close(&result, splat_rows(&expected, &[]).as_flattened(), 4e-6);
}

/// Centres and the axis are multiples of powers of two, so that bins have no rounding.
#[test]
fn sorting_kernels_match_cpu() {
    let mut rng = Rng(19);
    let n = 5003;
    let grid = |rng: &mut Rng| (1024.0 * rng.point()).floor() / 1024.0;
    let splats = random_splats(&mut rng, n, grid);
    let within = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
    for backward in [Vec3::Z, Vec3::NEG_X] {
        let depths = Depths::new(n, within, backward, true);
        assert_eq!(depths.n_blocks, 5, "the last block is not full");
        let hidden: Vec<f32> = (0..n).map(|k| (k % 3) as f32).collect();
        let rows = splat_rows(&splats.rest_pose(), &hidden);
        let (colors, none) = (vec![7_u32; n], vec![9_u32; (BINS * depths.n_blocks) as usize]);
        let depths_bytes = bytes(std::slice::from_ref(&depths));
        let inputs = [depths_bytes, bytes(&rows), bytes(&none)];
        let counts = run(&kernels::COUNT_SPLATS, ROWS, depths.n_blocks, &inputs);
        let places = run(&kernels::SCAN_SPLATS, ROWS, 128, &[depths_bytes, bytes(&counts)]);
        let empty = vec![[0_u32; 2]; n];
        let inputs = [depths_bytes, bytes(&rows), bytes(&colors), bytes(&places), bytes(&empty)];
        let order = run(&kernels::SCATTER_SPLATS, ROWS, depths.n_blocks, &inputs);
        let order: Vec<u32> = order.iter().map(|x| x.to_bits()).collect();
        let expected = sort_splats(&splats.positions, &depths);
        let entry = |splat: u32| [splat, if splat.is_multiple_of(3) { 7 } else { 0 }];
        assert_eq!(order.as_chunks().0, expected.into_iter().map(entry).collect::<Vec<_>>());
    }
}
