// Vertices of the mesh in storage buffers, which deform_vertices and vertex_normals write. See also mesh_textures.wgsl.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;
@group(1) @binding(1) var<storage, read> normals: array<vec4f>;
/// Value of each vertex from which draw_mesh.wgsl computes its colour: the weight of the shown control, the
/// reproduction error, or the strength, 0 to 1, with which the colour is blended towards grey or PAINT_COLOR.
@group(1) @binding(2) var<storage, read> values: array<f32>;

fn point_at(index: u32) -> vec3f { return positions[index].xyz; }
fn normal_at(index: u32) -> vec3f { return normals[index].xyz; }
fn value_at(index: u32) -> f32 { return values[index]; }
