// Studio lighting. The key light from the upper left and the weak fill light from the right are fixed to the camera.
// The surroundings, a bright sky and a dark ground, are fixed to the world.

/// Directions to the key light and the fill light, unit, view space.
const KEY_DIRECTION = vec3f(-0.43, 0.56, 0.71);
const FILL_DIRECTION = vec3f(0.81, 0.05, 0.58);
/// Colours of the key light and the fill light, linear.
const KEY_COLOR = vec3f(0.88, 0.86, 0.82);
const FILL_COLOR = vec3f(0.13, 0.15, 0.19);
/// Radiance of the surroundings above and below the horizon.
const SKY_COLOR = vec3f(0.29, 0.31, 0.35);
const GROUND_COLOR = vec3f(0.10, 0.093, 0.085);
/// Radiance of the reflected key lamp.
const LAMP_COLOR = vec3f(1.5, 1.47, 1.4);
/// Reflectance of the surface seen from the front, and at grazing angles. Rough surfaces reflect less than 1 there.
const REFLECTANCE = 0.04;
const GRAZING_REFLECTANCE = 0.4;
/// Height above the floor at which the floor blocks 1/e of the light that it blocks at height 0, as a fraction of the
/// floor's radius.
const CONTACT_HEIGHT = 0.03;
/// Fraction of the light that the floor blocks from a surface that touches the floor and faces down.
const CONTACT_STRENGTH = 0.65;

/// Radiance that reaches the surface from a direction. `direction`: unit, world space; `in_view`: view space.
fn surroundings(direction: vec3f, in_view: vec3f) -> vec3f {
    let lamp = smoothstep(0.75, 0.97, dot(in_view, KEY_DIRECTION));
    return mix(GROUND_COLOR, SKY_COLOR, smoothstep(-0.4, 0.4, direction.y)) + lamp * LAMP_COLOR;
}

/// Light that a surface of the given colour reflects to the eye, linear. `normal`: unit, world space, facing the eye.
fn studio_light(color: vec3f, point: vec3f, normal: vec3f) -> vec3f {
    let view = to_eye(point);
    let in_view = (camera.view_from_world * vec4f(normal, 0.0)).xyz;
    // Wrapped diffuse reflection, squared below, gives the key light a soft terminator.
    let key = max(0.0, (dot(in_view, KEY_DIRECTION) + 0.25) / 1.25);
    let fill = max(0.0, dot(in_view, FILL_DIRECTION));
    // Irradiance from two half spaces of uniform radiance, divided by pi.
    let sky = mix(GROUND_COLOR, SKY_COLOR, 0.5 + 0.5 * normal.y);
    let height = max(0.0, point.y - camera.floor_center.y) / (CONTACT_HEIGHT * camera.floor_radius);
    let open = 1.0 - CONTACT_STRENGTH * exp(-height) * (0.5 - 0.5 * normal.y);
    let mirrored = reflect(-view, normal);
    let grazing = 1.0 - clamp(dot(normal, view), 0.0, 1.0);
    let reflectance = mix(REFLECTANCE, GRAZING_REFLECTANCE, grazing * grazing * grazing * grazing);
    let reflected = surroundings(mirrored, (camera.view_from_world * vec4f(mirrored, 0.0)).xyz);
    return open * (color * (key * key * KEY_COLOR + fill * FILL_COLOR + sky) + reflectance * reflected);
}
