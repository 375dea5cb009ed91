/** The worker's part of opening a file. If a file crashes the reader or never ends, the page is not affected. */

import type { CageArrays, Check, CheckedCage, Reading } from "../contract";
import type { Loaded, Polygons } from "../pkg/cagework";
import type { Package } from "./artifact";
import { type Bytes, read as readBytes, readFiles, siblingOf, toWasm } from "./files";
import type { Jobs, ReadModel } from "./messages";
import { loadPart } from "./parts";
import { decodeTextures } from "./textures";

type Tell = (step: Reading) => void;

const say = (tell: Tell, stage: Reading["stage"], fraction = 0) => tell({ stage, fraction });

/** Reads a model: decompresses it if needed, decodes textures, and checks the cage of a project. */
export async function readModel(
  pkg: Package,
  { files, up, used }: Jobs["read"]["input"],
  tell: Tell,
): Promise<ReadModel> {
  const { loaded, file } = await read(pkg, files, tell);
  const began = performance.now();
  if (up) loaded.setUp(up);
  loaded.prepare(used);
  const all = [loaded, ...furtherOf(loaded)];
  const took = file.took + performance.now() - began;
  const decoded = [];
  for (const one of all) {
    decoded.push(await decodeTextures(one, (share) => say(tell, "textures", share)));
  }
  const drawn = decoded.flatMap(({ textures }) => textures.map((one) => (one ? one.width * one.height : 0)));
  const failed = decoded.reduce((sum, one) => sum + one.failed, 0);
  const many = failed === 1 ? "a texture" : `${failed} textures`;
  const notice = `this browser cannot decode ${many}: the material's plain colour is shown, exports keep the file`;
  say(tell, "check");
  const mesh = loaded.cage;
  const positions = all.map((one) => one.positions);
  const vertices = positions.reduce((sum, { length }) => sum + length / 3, 0);
  const cage = mesh && checked(pkg, mesh, flat(positions));
  return {
    ...file,
    up,
    used,
    pixels: drawn.reduce((sum, pixels) => sum + pixels, 0),
    textures: decoded.map(({ textures }) => textures),
    cage,
    notices: failed > 0 ? [notice] : [],
    took,
    vertices,
  };
}

/** Takes all models after the first out of an opened project. */
export function furtherOf(loaded: Loaded): Loaded[] {
  const next = loaded.takeNext();
  return next ? [next, ...furtherOf(loaded)] : [];
}

/** Concatenates arrays. */
function flat(arrays: readonly Float32Array[]): Float32Array {
  const all = new Float32Array(arrays.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const array of arrays) {
    all.set(array, at);
    at += array.length;
  }
  return all;
}

/** Reads a file as a cage and checks it. */
export async function readCage(
  pkg: Package,
  { files, up, origin, model, smooth }: Jobs["readCage"]["input"],
  tell: Tell,
): Promise<CheckedCage> {
  const { loaded } = await read(pkg, files, tell);
  loaded.seeFrom(origin);
  loaded.setUp(up);
  say(tell, "check");
  return checked(pkg, loaded.asCage(), model, smooth);
}

/**
 * Copies a cage to arrays and checks it. `smooth`: number of subdivision steps if the cage has no controls of its own.
 */
export function checked(pkg: Package, cage: Polygons, model: Float32Array, smooth = 0): CheckedCage {
  const arrays = polygons(cage);
  const controls = arrays.controls ?? { smooth, inner: 0, elements: [], radius: null };
  return { ...arrays, check: check(pkg, { ...arrays, controls }, model) };
}

/** Checks a cage against the model's vertices. */
export function check(
  pkg: Package,
  { positions, corners, controls }: CageArrays,
  model: Float32Array,
): Check {
  const found = pkg.Binder.checkCage(model, positions, corners, controls);
  const { problems, vertices, edges, faces, points, outside } = found;
  found.free();
  return { problems, vertices, edges, faces, points, outside };
}

/** Copies a polygon mesh to arrays and frees its wasm memory. */
export function polygons(mesh: Polygons): CageArrays {
  const { positions, corners, controls } = mesh;
  mesh.free();
  return { positions, corners, controls };
}

export async function read(
  pkg: Package,
  files: Jobs["read"]["input"]["files"],
  tell: Tell,
): Promise<{ loaded: Loaded; file: Bytes & { took: number } }> {
  say(tell, "bytes");
  const file = await readFiles(files);
  const sibling = siblingOf(file.siblings);
  const timed = async (content: Blob) => {
    const bytes = await toWasm(pkg, file.name, content, (share) => say(tell, "bytes", share));
    say(tell, "geometry");
    const began = performance.now();
    const loaded = pkg.Loaded.read(file.name, bytes, sibling);
    return { loaded, file: { ...file, content, took: performance.now() - began } };
  };
  try {
    return await timed(file.content);
  } catch (error) {
    if (!(error instanceof Error) || error.name !== "Compressed") throw error;
    say(tell, "decompress");
    const { decompress } = await loadPart(import("../decode"));
    const packed = await readBytes(file.name, file.content);
    const plain = await decompress(file.name, packed, sibling);
    const { loaded, file: decompressed } = await timed(new Blob([plain as BlobPart]));
    return { loaded, file: { ...decompressed, packed: file.content } };
  }
}
