import { Data3DTexture, FloatType, LinearFilter, Vector3 } from "three";

/**
 * Makes the vertex shader of a three.js material displace vertices by `field.texture()`. Returns the texture with the
 * displacements.
 */
export function bend(material, { data, size, origin, spacing }) {
  const texture = new Data3DTexture(data, ...size);
  const filters = { type: FloatType, minFilter: LinearFilter, magFilter: LinearFilter, needsUpdate: true };
  Object.assign(texture, filters);
  material.onBeforeCompile = (shader) => {
    const values = { field: texture, fieldOrigin: new Vector3(...origin), fieldSpacing: spacing };
    for (const name in values) shader.uniforms[name] = { value: values[name] };
    const declared = `uniform highp sampler3D field; uniform vec3 fieldOrigin; uniform float fieldSpacing;
      vec3 bent(vec3 p) {
        return p + texture(field, ((p - fieldOrigin) / fieldSpacing + 0.5) / vec3(textureSize(field, 0))).xyz;
      }
      vec3 bentNormal(vec3 p, vec3 n) {
        vec3 u = fieldSpacing * normalize(abs(n.x) < 0.5 ? cross(n, vec3(1, 0, 0)) : cross(n, vec3(0, 1, 0)));
        return normalize(cross(bent(p + u) - bent(p - u), bent(p + cross(n, u)) - bent(p - cross(n, u))));
      }\n`;
    shader.vertexShader = `${declared}${shader.vertexShader
      .replace("#include <beginnormal_vertex>", "vec3 objectNormal = bentNormal(position, normal);")
      .replace("#include <begin_vertex>", "vec3 transformed = bent(position);")}`;
  };
  return texture;
}
