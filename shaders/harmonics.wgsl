// Colours that depend on the direction of view: spherical harmonics of bands 0 to 3, with the constants and signs of
// 3DGS files. The value of band 0 is 1: its coefficients are the colour. CPU: cagework_core::splats::harmonic_basis.

fn harmonic_basis(direction: vec3f) -> array<f32, 16> {
    let x = direction.x;
    let y = direction.y;
    let z = direction.z;
    let xx = x * x;
    let yy = y * y;
    let zz = z * z;
    return array<f32, 16>(
        1.0,
        -0.48860252 * y,
        0.48860252 * z,
        -0.48860252 * x,
        1.0925485 * x * y,
        -1.0925485 * y * z,
        0.31539157 * (2.0 * zz - xx - yy),
        -1.0925485 * x * z,
        0.54627424 * (xx - yy),
        -0.5900436 * y * (3.0 * xx - yy),
        2.8906114 * x * y * z,
        -0.4570458 * y * (4.0 * zz - xx - yy),
        0.37317634 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.4570458 * x * (4.0 * zz - xx - yy),
        1.4453057 * z * (xx - yy),
        -0.5900436 * x * (xx - 3.0 * yy),
    );
}
