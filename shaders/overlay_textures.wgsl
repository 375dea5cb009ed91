// Positions and items of overlays in textures, which the CPU uploads. Used instead of overlay_buffers.wgsl where shaders
// cannot read storage buffers.

@group(1) @binding(1) var positions: texture_2d<f32>;
@group(1) @binding(2) var items: texture_2d<u32>;

fn point_at(index: u32) -> vec3f { return textureLoad(positions, place_of(index), 0).xyz; }
fn item_at(index: u32) -> vec2u { return textureLoad(items, place_of(index), 0).xy; }
