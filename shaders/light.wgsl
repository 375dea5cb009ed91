// Studio lighting. The key light from the upper left and the weak fill light from the right are fixed to the camera.
// The light from sky and ground is fixed to the world.

/// Directions to the key light and the fill light, unit, view space.
const KEY_DIRECTION = vec3f(-0.43, 0.56, 0.71);
const FILL_DIRECTION = vec3f(0.81, 0.05, 0.58);
/// Colours of the four lights, linear.
const KEY_COLOR = vec3f(0.90, 0.88, 0.84);
const FILL_COLOR = vec3f(0.14, 0.16, 0.20);
const SKY_COLOR = vec3f(0.26, 0.28, 0.32);
const GROUND_COLOR = vec3f(0.10, 0.095, 0.09);
/// Blinn-Phong exponent of the highlight, and strengths of highlight and rim light.
const HIGHLIGHT_EXPONENT = 28.0;
const HIGHLIGHT_STRENGTH = 0.07;
const RIM_STRENGTH = 0.10;

/// Light that a surface of this colour reflects to the eye, linear. `normal`: unit, world space, facing the eye.
fn studio_light(color: vec3f, point: vec3f, normal: vec3f) -> vec3f {
    let view = to_eye(point);
    let in_view = (camera.view_from_world * vec4f(normal, 0.0)).xyz;
    let view_in_view = (camera.view_from_world * vec4f(view, 0.0)).xyz;
    // Wrapped diffuse reflection, squared below, gives the key light a soft terminator.
    let key = max(0.0, (dot(in_view, KEY_DIRECTION) + 0.25) / 1.25);
    let fill = max(0.0, dot(in_view, FILL_DIRECTION));
    let sky = mix(GROUND_COLOR, SKY_COLOR, 0.5 + 0.5 * normal.y);
    let half_way = normalize(KEY_DIRECTION + view_in_view);
    let highlight = HIGHLIGHT_STRENGTH * pow(max(0.0, dot(in_view, half_way)), HIGHLIGHT_EXPONENT);
    let edge = 1.0 - clamp(dot(normal, view), 0.0, 1.0);
    let rim = RIM_STRENGTH * edge * edge * edge * (0.5 + 0.5 * normal.y);
    return color * (key * key * KEY_COLOR + fill * FILL_COLOR + sky) + highlight + rim;
}
