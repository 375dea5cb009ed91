use super::*;

/// A grid of `n + 1` by `n + 1` vertices: `at(u, v)` for u and v from 0 to 1. The front is where u x v points.
fn sheet(n: u32, at: impl Fn(f32, f32) -> Vec3) -> TriMesh {
    let side = n + 1;
    let share = |k: u32| k as f32 / n as f32;
    let positions = (0..side * side).map(|k| at(share(k % side), share(k / side))).collect();
    let cell = |k: u32| {
        let a = k / n * side + k % n;
        [[a, a + 1, a + 1 + side], [a, a + 1 + side, a + side]]
    };
    TriMesh { positions, triangles: (0..n * n).flat_map(cell).collect() }
}

fn joined(parts: &[TriMesh]) -> TriMesh {
    let mut all = TriMesh::default();
    for part in parts {
        let first = all.positions.len() as u32;
        all.positions.extend_from_slice(&part.positions);
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| first + v)));
    }
    all
}

#[test]
fn missing_values_of_a_path_are_those_of_a_cubic() {
    // In the interior of a path with equal edges, the squared Laplacian is the fourth difference, which is zero for
    // cubics. (The harmonic solution would be linear.) The long path is solved on coarser ones first, which shift it a little.
    for (n, tolerance) in [(30, 1e-3), (3000, 3e-2)] {
        let positions: Vec<Vec3> = (0..n).map(|k| Vec3::new(k as f32, 0.0, 0.0)).collect();
        let edges: Vec<[u32; 3]> = (1..n).map(|k| [k - 1, k, k]).collect();
        let is_free: Vec<bool> = (0..n).map(|k| (n / 10..n - n / 6).contains(&k)).collect();
        let cubic = |k: u32| (k as f32 / n as f32).powi(3) - 0.3 * k as f32 / n as f32;
        // The second column is zero at all known vertices.
        let row = |k: u32| if is_free[k as usize] { [0.5, 1.0] } else { [cubic(k), 0.0] };
        let mut values: Vec<f32> = (0..n).flat_map(row).collect();
        Graph::new(&positions, &edges).fill(&is_free, &mut values, 2);
        let off = |(k, row): (u32, &[f32])| (row[0] - cubic(k)).abs() + row[1].abs();
        let worst = (0..n).zip(values.chunks(2)).map(off).fold(0.0, f32::max);
        assert!(worst < tolerance, "{n}: {worst}");
    }
}

#[test]
fn a_cloth_beside_an_arm_stays_with_its_body() {
    // A torso in the plane x = 0 and an arm at x = 0.1 that face each other. The cloth lies on the torso and bulges
    // towards the arm, so that the closest point of its middle is on the arm.
    let torso = sheet(8, |u, v| Vec3::new(0.0, u, v));
    let arm = sheet(8, |u, v| Vec3::new(0.1, v, u));
    let body = joined(&[torso, arm]);
    let values: Vec<f32> =
        body.positions.iter().flat_map(|p| if p.x > 0.0 { [0.0, 1.0] } else { [1.0, 0.0] }).collect();
    let bulge = |u: f32, v: f32| 0.01 + 0.075 * (4.0 * u * (1.0 - u) * 4.0 * v * (1.0 - v)).powi(2);
    let cloth = sheet(20, |u, v| Vec3::new(bulge(u, v), u, v));
    let inpainting = Inpainting::new(&body, &cloth);
    let Origins { matched, inpainted, copied } = inpainting.origins();
    assert!(inpainted > 50 && copied == 0, "{inpainted} of {matched}");
    for (p, row) in cloth.positions.iter().zip(inpainting.weights(&values, 2).chunks(2)) {
        assert!((row[0] - 1.0).abs() < 1e-3 && row[1] < 1e-3, "{p}: {row:?}");
    }
}

#[test]
fn a_cloth_whose_faces_point_inwards_is_matched_with_its_back() {
    // Seen from its back, the cloth faces the arm of the test above. The same cloth turned around has the same values.
    let torso = sheet(8, |u, v| Vec3::new(0.0, u, v));
    let arm = sheet(8, |u, v| Vec3::new(0.1, v, u));
    let body = joined(&[torso, arm]);
    let values: Vec<f32> =
        body.positions.iter().flat_map(|p| if p.x > 0.0 { [0.0, 1.0] } else { [1.0, 0.0] }).collect();
    let bulge = |u: f32, v: f32| 0.01 + 0.075 * (4.0 * u * (1.0 - u) * 4.0 * v * (1.0 - v)).powi(2);
    let cloth = sheet(20, |u, v| Vec3::new(bulge(u, v), u, v));
    let turned = TriMesh {
        positions: cloth.positions.clone(),
        triangles: cloth.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
    };
    let [cloth, turned] = [cloth, turned].map(|cloth| Inpainting::new(&body, &cloth));
    assert_eq!([cloth.is_turned(), turned.is_turned()], [false, true]);
    assert_eq!(turned.origins(), cloth.origins());
    for row in turned.weights(&values, 2).chunks(2) {
        assert!((row[0] - 1.0).abs() < 1e-3 && row[1] < 1e-3, "{row:?}");
    }
}

#[test]
fn both_sides_of_a_thick_cloth_get_the_same_values() {
    let body = sheet(8, |u, v| Vec3::new(u, v, 0.0));
    let values: Vec<f32> = body.positions.iter().flat_map(|p| [p.x, 1.0 - p.x]).collect();
    let outer = sheet(9, |u, v| Vec3::new(0.1 + 0.8 * u, 0.1 + 0.8 * v, 0.03));
    let inner = sheet(9, |u, v| Vec3::new(0.1 + 0.8 * v, 0.1 + 0.8 * u, 0.02));
    // A button: a part without a match, as it stands on its edge.
    let button = sheet(2, |u, v| Vec3::new(0.5, 0.5 + 0.1 * u, 0.04 + 0.01 * v));
    let cloth = joined(&[outer, inner, button]);
    let inpainting = Inpainting::new(&body, &cloth);
    assert_eq!(inpainting.origins(), Origins { matched: 200, inpainted: 0, copied: 9 });
    // As many positions face away from the body as towards it.
    assert!(!inpainting.is_turned());
    for (p, row) in cloth.positions.iter().zip(inpainting.weights(&values, 2).chunks(2)) {
        assert!((row[0] - p.x).abs() < 1e-5, "{p}: {row:?}");
    }
    assert_eq!(Inpainting::new(&TriMesh::default(), &cloth).origins().matched, 0);
}
