// Vertices of the mesh, as written by deform_vertices and vertex_normals. See also mesh_textures.wgsl.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;
@group(1) @binding(1) var<storage, read> normals: array<vec4f>;
/// For each vertex: weight, error or strength of greying.
@group(1) @binding(2) var<storage, read> values: array<f32>;

fn point_at(index: u32) -> vec3f { return positions[index].xyz; }
fn normal_at(index: u32) -> vec3f { return normals[index].xyz; }
fn value_at(index: u32) -> f32 { return values[index]; }
