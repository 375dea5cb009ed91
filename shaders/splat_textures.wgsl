// Splats and their order in textures, which the CPU uploads. See also splat_buffers.wgsl.

@group(1) @binding(0) var splats: texture_2d<f32>;
@group(1) @binding(1) var order: texture_2d<u32>;

fn row_at(index: u32) -> vec4f { return textureLoad(splats, place_of(index), 0); }
fn entry_at(index: u32) -> vec2u { return textureLoad(order, place_of(index), 0).xy; }
