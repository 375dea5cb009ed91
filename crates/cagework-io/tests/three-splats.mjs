// Reads captures with the loaders of three.js and compares the splats with those that Cagework reads.
//
// usage: node three-splats.mjs DIRECTORY
//
// NAME.json, beside the file NAME: `centers` and `covariances` (xx, xy, xz, yy, yz, zz) of the splats, and the `degree`
// of their spherical harmonics.

import { readFileSync } from "node:fs";
import { join } from "node:path";

globalThis.self = globalThis;
const { GaussianSplatPLYLoader } = await import("three/addons/loaders/GaussianSplatPLYLoader.js");
const { GLTFGaussianSplatLoaderExtension } = await import(
  "three/addons/loaders/GLTFGaussianSplatLoaderExtension.js"
);
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const { SPLATLoader } = await import("three/addons/loaders/SPLATLoader.js");
const { SPZLoader } = await import("three/addons/loaders/SPZLoader.js");

/** Tolerance of centres, as a fraction of the largest coordinate. Both programs decode to 32-bit floats. */
const LIMIT = 1e-6;
/** Tolerance of covariances, as a fraction of the largest: products of rotations and scales are rounded. */
const COVARIANCE_LIMIT = 1e-5;

async function gltf(bytes) {
  const loader = new GLTFLoader().register((parser) => new GLTFGaussianSplatLoaderExtension(parser));
  const { scene } = await loader.parseAsync(bytes, "");
  let found;
  scene.traverse((object) => {
    found ??= object.splatGeometry;
  });
  return found;
}

const readers = {
  ply: (bytes) => new GaussianSplatPLYLoader().parse(bytes),
  splat: (bytes) => new SPLATLoader().parse(bytes),
  spz: (bytes) => new SPZLoader().parse(bytes),
  glb: gltf,
};

const directory = process.argv[2];
if (directory === undefined) {
  console.error("usage: node three-splats.mjs DIRECTORY");
  process.exit(2);
}
const worst = (ours, theirs) => {
  if (ours.length !== theirs.length) return Number.POSITIVE_INFINITY;
  const largest = Math.max(...ours.map(Math.abs));
  return Math.max(...ours.map((value, k) => Math.abs(value - theirs[k]))) / largest;
};
let isEqual = true;
for (const [ending, read] of Object.entries(readers)) {
  const path = join(directory, `capture.${ending}`);
  const file = readFileSync(path);
  const geometry = await read(file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength));
  const { centers, covariances, degree } = JSON.parse(readFileSync(`${path}.json`, "utf8"));
  const { position, covariance } = geometry.attributes;
  const [at, shape] = [worst(centers, position.array), worst(covariances, covariance.array)];
  const bands = [1, 2, 3].filter((band) => geometry.attributes[`sphericalHarmonics${band}`]).length;
  isEqual &&= at <= LIMIT && shape <= COVARIANCE_LIMIT && bands === degree;
  const differences = `centres ${at.toExponential(1)}, covariances ${shape.toExponential(1)} off`;
  console.log(`capture.${ending} in three.js: ${position.count} splats, ${differences}, ${bands} bands`);
}
process.exit(isEqual ? 0 : 1);
