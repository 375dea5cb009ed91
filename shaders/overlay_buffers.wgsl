// Positions and items of overlays in storage buffers, which kernels can write. See also overlay_textures.wgsl.

@group(1) @binding(1) var<storage, read> positions: array<vec4f>;
@group(1) @binding(2) var<storage, read> items: array<vec2u>;

fn point_at(index: u32) -> vec3f { return positions[index].xyz; }
fn item_at(index: u32) -> vec2u { return items[index]; }
