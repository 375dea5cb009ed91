// Splats and their order in storage buffers, which deform_splats and scatter_splats write. See also
// splat_textures.wgsl.

@group(1) @binding(0) var<storage, read> splats: array<vec4f>;
@group(1) @binding(1) var<storage, read> order: array<vec2u>;

fn row_at(index: u32) -> vec4f { return splats[index]; }
fn entry_at(index: u32) -> vec2u { return order[index]; }
