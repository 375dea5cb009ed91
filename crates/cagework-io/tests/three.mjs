// Plays GLBs with three.js and compares the vertices with those written by `export_samples`.
//
// usage: node three.mjs DIRECTORY
//
// NAME.played.json: array of `seconds` and `positions` in the first clip, three numbers per vertex of the only
// primitive, relative to `origin`.

import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";

globalThis.self = globalThis;
const { AnimationMixer, Vector3 } = await import("three");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const { MeshoptDecoder } = await import("three/addons/libs/meshopt_decoder.module.js");

/** Largest difference as a fraction of the model's size. three.js computes in doubles, but the file stores floats. */
const LIMIT = 5e-7;

const directory = process.argv[2];
if (directory === undefined) {
  console.error("usage: node three.mjs DIRECTORY");
  process.exit(2);
}
const names = readdirSync(directory).filter((name) => name.endsWith(".played.json"));
let worst = 0;
let compared = 0;
for (const name of names) {
  const glb = readFileSync(join(directory, name.replace(/\.played\.json$/, ".glb")));
  const bytes = glb.buffer.slice(glb.byteOffset, glb.byteOffset + glb.byteLength);
  const gltf = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes, "");
  let mesh;
  gltf.scene.traverse((object) => {
    if (object.isMesh) mesh = object;
  });
  const mixer = new AnimationMixer(gltf.scene);
  mixer.clipAction(gltf.animations[0]).play();
  for (const { seconds, positions, origin } of JSON.parse(readFileSync(join(directory, name), "utf8"))) {
    mixer.setTime(seconds);
    gltf.scene.updateMatrixWorld(true);
    const size = Math.max(...positions) - Math.min(...positions);
    for (let v = 0; v < positions.length / 3; v += 1) {
      const at = mesh.getVertexPosition(v, new Vector3()).applyMatrix4(mesh.matrixWorld);
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
