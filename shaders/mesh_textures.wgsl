// Vertices of the mesh in textures, uploaded by the CPU. See also mesh_buffers.wgsl.

@group(1) @binding(0) var positions: texture_2d<f32>;
@group(1) @binding(1) var normals: texture_2d<f32>;
/// Value of each vertex from which draw_mesh.wgsl computes its colour: the weight of the shown control, the
/// reproduction error, or the strength, 0 to 1, with which the colour is blended towards grey or PAINT_COLOR.
@group(1) @binding(2) var values: texture_2d<f32>;

fn point_at(index: u32) -> vec3f { return textureLoad(positions, place_of(index), 0).xyz; }
fn normal_at(index: u32) -> vec3f { return textureLoad(normals, place_of(index), 0).xyz; }
fn value_at(index: u32) -> f32 { return textureLoad(values, place_of(index), 0).x; }
