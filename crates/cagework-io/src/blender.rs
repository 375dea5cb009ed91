//! A field as a script that makes a lattice object in Blender.

use cagework_core::field::Field;
use glam::{DVec3, UVec3, Vec3};

use crate::up::UpAxis;

/// Largest number of points of a Blender lattice along an axis.
const MAX_POINTS: u32 = 64;

/// Writes a field as a Python script for Blender. The script creates a lattice object "Cagework" that covers the box of
/// the field, with the deformed points as `co_deform`; a Lattice modifier that refers to this object applies the
/// field's deformation. The field is sampled at no more than 64 points along each axis. Positions are converted to
/// Blender's Z-up axes. `origin`: added to all positions before the conversion, Y up.
#[must_use]
pub fn write_field_blender(field: &Field, origin: DVec3) -> Vec<u8> {
    let lattice = &field.lattice;
    let size = lattice.cell * (lattice.dims - 1).as_vec3();
    let n = lattice.dims.min(UVec3::splat(MAX_POINTS));
    let in_blender = |p: Vec3| UpAxis::Z.vector_turned_back(p.as_dvec3());
    let [center, extent] = [lattice.origin + 0.5 * size, size].map(in_blender);
    let (extent, center) = (extent.abs(), center + UpAxis::Z.vector_turned_back(origin));
    let mut points = String::new();
    // Blender's z axis is the field's y axis, and its y axis is the field's -z axis. A Blender lattice numbers its
    // points with x fastest, and their coordinates are from -0.5 to 0.5.
    for y in 0..n.y {
        for z in (0..n.z).rev() {
            for x in 0..n.x {
                let share = UVec3::new(x, y, z).as_vec3() / (n - 1).as_vec3();
                let moved = field.map(lattice.origin + share * size) - (lattice.origin + 0.5 * size);
                let local = in_blender(moved) / extent;
                for byte in local.to_array().into_iter().flat_map(|x| (x as f32).to_le_bytes()) {
                    points += &format!("{byte:02x}");
                }
            }
        }
    }
    format!(
        "# Makes a lattice in Blender. Give it to the Lattice modifier of the objects to deform.\n\
         import bpy\nimport numpy\n\n\
         data = bpy.data.lattices.new(\"Cagework\")\n\
         data.points_u, data.points_v, data.points_w = {}, {}, {}\n\
         data.interpolation_type_u = data.interpolation_type_v = data.interpolation_type_w = \"KEY_LINEAR\"\n\
         points = numpy.frombuffer(bytes.fromhex(\"{points}\"), dtype=\"<f4\")\n\
         data.points.foreach_set(\"co_deform\", points)\n\
         lattice = bpy.data.objects.new(\"Cagework\", data)\n\
         lattice.location = {:?}\nlattice.scale = {:?}\n\
         bpy.context.collection.objects.link(lattice)\n",
        n.x,
        n.z,
        n.y,
        center.to_array(),
        extent.to_array(),
    )
    .into_bytes()
}
