// Plays GLBs with three.js and compares the vertices with those written by `export_samples`.
//
// usage: node three.mjs DIRECTORY
//
// NAME.played.json: array of `seconds` and `positions` in the first clip, three numbers per vertex of the only
// primitive, relative to `origin`. Optional: `clips`, the name of another file whose first clip moves the nodes with the
// same names; `weights` of the morph targets; `expression`, shown at rest instead of a clip.

import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";

globalThis.self = globalThis;
const { AnimationMixer, Vector3 } = await import("three");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");

/** Largest difference as a fraction of the model's size. three.js computes in doubles, but the file stores floats. */
const LIMIT = 5e-7;

const directory = process.argv[2];
if (directory === undefined) {
  console.error("usage: node three.mjs DIRECTORY");
  process.exit(2);
}

async function load(name) {
  const glb = readFileSync(join(directory, `${name}.glb`));
  const bytes = glb.buffer.slice(glb.byteOffset, glb.byteOffset + glb.byteLength);
  return await new GLTFLoader().parseAsync(bytes, "");
}

/** Pairs of a morph target and its weight, 0 to 1, that an expression of a VRM binds. */
function bindsOf(extensions, expression) {
  if (extensions.VRMC_vrm !== undefined) {
    const { preset, custom } = extensions.VRMC_vrm.expressions;
    const { morphTargetBinds } = preset?.[expression] ?? custom[expression];
    return morphTargetBinds.map(({ index, weight }) => [index, weight]);
  }
  const groups = extensions.VRM.blendShapeMaster.blendShapeGroups;
  const { binds } = groups.find(({ name }) => name === expression);
  return binds.map(({ index, weight }) => [index, weight / 100]);
}

const names = readdirSync(directory).filter((name) => name.endsWith(".played.json"));
let worst = 0;
let compared = 0;
for (const name of names) {
  const gltf = await load(name.replace(/\.played\.json$/, ""));
  const frames = JSON.parse(readFileSync(join(directory, name), "utf8"));
  const { clips } = frames[0];
  const { animations } = clips === undefined ? gltf : await load(clips);
  // One per primitive. A model's vertices are those of all primitives, in their order.
  const meshes = [];
  gltf.scene.traverse((object) => {
    if (object.isMesh) meshes.push(object);
  });
  const vertices = meshes.flatMap((mesh) =>
    Array.from({ length: mesh.geometry.attributes.position.count }, (_, k) => ({ mesh, k })),
  );
  const mixer = new AnimationMixer(gltf.scene);
  mixer.clipAction(animations[0]).play();
  for (const { seconds, weights, expression, positions, origin } of frames) {
    if (weights !== undefined) {
      for (const mesh of meshes) mesh.morphTargetInfluences = weights;
    }
    if (expression !== undefined) {
      for (const [target, weight] of bindsOf(gltf.parser.json.extensions, expression)) {
        for (const mesh of meshes) mesh.morphTargetInfluences[target] = weight;
      }
    } else {
      mixer.setTime(seconds);
    }
    gltf.scene.updateMatrixWorld(true);
    const size = Math.max(...positions) - Math.min(...positions);
    if (vertices.length !== positions.length / 3) {
      throw new Error(`${name} has ${positions.length / 3} vertices, three.js reads ${vertices.length}`);
    }
    for (const [v, { mesh, k }] of vertices.entries()) {
      const at = mesh.getVertexPosition(k, new Vector3()).applyMatrix4(mesh.matrixWorld);
      at.sub(new Vector3().fromArray(origin));
      const expected = new Vector3().fromArray(positions, 3 * v);
      worst = Math.max(worst, at.distanceTo(expected) / size);
      compared += 1;
    }
  }
}
console.log(
  `${names.length} files in three.js: ${compared} vertices, at most ${worst.toExponential(1)} of the size off`,
);
process.exit(names.length === 0 || !(worst <= LIMIT) ? 1 : 0);
