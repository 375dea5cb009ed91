// Vertices of the mesh in storage buffers, which deform_vertices and vertex_normals write. See also mesh_textures.wgsl.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;
@group(1) @binding(1) var<storage, read> normals: array<vec4f>;
/// For each vertex, the weight, the error, or how much it is greyed or painted (0 to 1).
@group(1) @binding(2) var<storage, read> values: array<f32>;

fn point_at(index: u32) -> vec3f { return positions[index].xyz; }
fn normal_at(index: u32) -> vec3f { return normals[index].xyz; }
fn value_at(index: u32) -> f32 { return values[index]; }
