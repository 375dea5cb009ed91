/** The worker's part of opening a file. A file that makes the reader crash or hang does not affect the page. */

import type { BuiltSample, CageArrays, CheckedCage, Reading } from "../contract";
import type { LoadedModel } from "../pkg/cagework";
import type { Package } from "./artifact";
import { read as readBytes, readFiles, siblingOf, toWasm } from "./files";
import type { Jobs, ReadModel } from "./messages";
import { loadPart } from "./parts";
import { decodeTextures } from "./textures";

/** Number of bytes at the start of a file that tell whether it is an FBX. */
const START = 4096;

type ReadListener = (step: Reading) => void;

const say = (tell: ReadListener, stage: Reading["stage"], fraction = 0) => tell({ stage, fraction });

/** Reads a model: converts it if needed, decodes textures, and checks the cage of a project. */
export async function readModel(
  pkg: Package,
  { files, up, held = { pixels: 0, bytes: 0 } }: Jobs["read"]["input"],
  tell: ReadListener,
): Promise<ReadModel> {
  const notices: string[] = [];
  const loaded = await read(pkg, files, tell, notices, held.bytes);
  if (up) loaded.setUp(up);
  const model = await packed(pkg, loaded, held.pixels, tell);
  return { ...model, notices: [...notices, ...model.notices] };
}

/** Gives clothes the joints, joint weights and morph targets of a body. */
export async function copyRig(
  pkg: Package,
  { clothes, body, held }: Jobs["copyRig"]["input"],
  tell: ReadListener,
): Promise<Jobs["copyRig"]["output"]> {
  const [loaded, from] = [pkg.LoadedModel.restore(clothes), pkg.LoadedModel.restore(body)];
  const report = loaded.takeSkinOf(from);
  from.free();
  return { ...(await packed(pkg, loaded, held.pixels, tell)), report };
}

/** Prepares all models of a file for drawing, copies them to arrays, and checks the cage of a project. */
async function packed(
  pkg: Package,
  loaded: LoadedModel,
  used: number,
  tell: ReadListener,
): Promise<ReadModel> {
  loaded.prepare(used);
  const all = [loaded, ...furtherOf(loaded)];
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
  const positions = all.map((one) => one.checkedPositions);
  const vertices = positions.reduce((sum, { length }) => sum + length / 3, 0);
  const cage = mesh && checked(pkg, mesh, flat(positions));
  const bytes = all.reduce((sum, one) => sum + one.bytes, 0);
  return {
    models: all.map((one) => one.store()),
    held: { pixels: drawn.reduce((sum, pixels) => sum + pixels, 0), bytes },
    textures: decoded.map(({ textures }) => textures),
    cage,
    notices: failed > 0 ? [notice] : [],
    vertices,
  };
}

/** Reads a sample's file together with its cage. */
export async function readSample(pkg: Package, name: string, sample: BuiltSample): Promise<ReadModel> {
  const bytes = new pkg.FileBytes(0);
  bytes.push(sample.glb);
  const loaded = pkg.LoadedModel.read(name, bytes, () => undefined, 0);
  const cage = checked(pkg, sample.cage, sample.positions);
  return { ...(await packed(pkg, loaded, 0, () => undefined)), cage };
}

/** Takes all models after `loaded`, the first one, out of an opened project. */
function furtherOf(loaded: LoadedModel): LoadedModel[] {
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
  tell: ReadListener,
): Promise<CheckedCage> {
  const loaded = await read(pkg, files, tell);
  loaded.seeFrom(origin);
  loaded.setUp(up);
  say(tell, "check");
  return checked(pkg, loaded.asCage(), model, smooth);
}

/** Checks a cage. `smooth`: number of subdivision steps if the cage has no controls of its own. */
export function checked(pkg: Package, cage: CageArrays, model: Float32Array, smooth = 0): CheckedCage {
  const controls = cage.controls ?? { smooth, inner: 0, elements: [], radius: null };
  return { ...cage, check: pkg.Binder.checkCage(model, { ...cage, controls }) };
}

/** Reads a file. Adds what a conversion lost to `lost`. `held`: memory of the other models that are open, bytes. */
export async function read(
  pkg: Package,
  files: Jobs["read"]["input"]["files"],
  tell: ReadListener,
  lost: string[] = [],
  held = 0,
): Promise<LoadedModel> {
  say(tell, "bytes");
  const { name, content, siblings } = await readFiles(files);
  let file = content;
  if (pkg.LoadedModel.isFbx(name, await readBytes(name, content.slice(0, START)))) {
    say(tell, "convert");
    const { convert } = await loadPart(import("../fbx"));
    const { glb, notices } = await convert(name, await readBytes(name, content));
    lost.push(...notices);
    file = new Blob([glb as BlobPart]);
  }
  const bytes = await toWasm(pkg, name, file, (share) => say(tell, "bytes", share));
  say(tell, "geometry");
  return pkg.LoadedModel.read(name, bytes, siblingOf(siblings), held);
}
