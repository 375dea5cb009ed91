// Draws Gaussian splats (Kerbl et al. 2023) from back to front into a layer of their own. Colours are blended in sRGB,
// because splats are trained that way. Six vertices per splat.

/// Variance that is added to each splat on the screen, square pixels, so that no splat is smaller than about a pixel
/// (Kerbl et al. 2023).
const PIXEL_VARIANCE = 0.3;
/// Alpha below which a splat is invisible, because colours have 8 bits. It limits the size of the drawn quad.
const MIN_ALPHA = 1.0 / 255.0;
/// Limit on the standard deviation of a splat on the screen, pixels. Longer axes of a splat are shortened to it.
const MAX_REACH = 1024.0;
/// Limit of the normalised device coordinates at which the projection of a covariance is linearised. It prevents huge
/// ellipses of splats far outside the picture.
const MAX_CENTER_OFFSET = 1.3;

struct Varying {
    @builtin(position) clip: vec4f,
    /// Offset from the centre, standard deviations. Interpolated linearly on the screen, because all corners have the
    /// same w.
    @location(0) place: vec2f,
    @location(1) @interpolate(flat) color: vec4f,
}

/// The first three entries of row k of `clip_from_world`.
fn row_of_clip(k: u32) -> vec3f {
    return vec3f(camera.clip_from_world[0][k], camera.clip_from_world[1][k], camera.clip_from_world[2][k]);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let entry = entry_at(index / 6u);
    let k = index % 6u;
    let color = unpack4x8unorm(entry.y);
    let center = row_at(3u * entry.x).xyz;
    let clip = camera.clip_from_world * vec4f(center, 1.0);
    if color.a < MIN_ALPHA || clip.z < 0.0 || clip.w <= 0.0 {
        return Varying(HIDDEN_POSITION, vec2f(0.0), vec4f(0.0));
    }
    let low = row_at(3u * entry.x + 1u);
    let high = row_at(3u * entry.x + 2u);
    let covariance = mat3x3f(low.x, low.y, low.z, low.y, low.w, high.x, low.z, high.x, high.y);
    // Derivatives of the pixel position (x, y) by the position in world space.
    let at = clamp(clip.xy / clip.w, vec2f(-MAX_CENTER_OFFSET), vec2f(MAX_CENTER_OFFSET));
    let along_w = row_of_clip(3u);
    let x = 0.5 * camera.viewport.x / clip.w * (row_of_clip(0u) - at.x * along_w);
    let y = 0.5 * camera.viewport.y / clip.w * (row_of_clip(1u) - at.y * along_w);
    let a = dot(x, covariance * x) + PIXEL_VARIANCE;
    let b = dot(x, covariance * y);
    let c = dot(y, covariance * y) + PIXEL_VARIANCE;
    let mean = 0.5 * (a + c);
    let spread = sqrt(max(0.25 * (a - c) * (a - c) + b * b, 0.0));
    // Direction of the longer axis of the ellipse: an eigenvector of [[a, b], [b, c]].
    var axis = vec2f(1.0, 0.0);
    if spread > 1e-6 * mean {
        axis = normalize(select(vec2f(b, spread + 0.5 * (c - a)), vec2f(spread + 0.5 * (a - c), b), a >= c));
    }
    let corner = vec2f(
        select(-1.0, 1.0, k == 1u || k == 3u || k == 5u),
        select(-1.0, 1.0, k == 2u || k == 3u || k == 4u),
    );
    // At this many standard deviations from the centre, alpha falls below MIN_ALPHA.
    let place = corner * sqrt(2.0 * log(color.a / MIN_ALPHA));
    let sigmas = sqrt(vec2f(mean + spread, max(mean - spread, PIXEL_VARIANCE)));
    let along = min(sigmas, vec2f(MAX_REACH)) * place;
    let pixels = along.x * axis + along.y * vec2f(-axis.y, axis.x);
    return Varying(vec4f(clip.xy + pixels * camera.pixel * clip.w, clip.zw), place, color);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let alpha = in.color.a * exp(-0.5 * dot(in.place, in.place));
    if alpha < MIN_ALPHA { discard; }
    return vec4f(in.color.rgb * alpha, alpha);
}
