/**
 * Binds after edits of the rest cage, as share of a whole bind, in the page's own module (build it first: cargo xtask page): one
 * vertex by 1 % of the model, and by 0.1 %.
 *
 *   node benches/edits.mjs                       the samples
 *   node benches/edits.mjs mesh.obj cage.obj     a model and its cage
 */

import { readFileSync } from "node:fs";

/** As many as start from one whole bind: the next one is bound anew. */
const EDITS = 6;
const ROUNDS = 5;
const WARM_UP_MS = 1000;
const PLACES = [0.1, 0.4, 0.6, 0.9];
/** What a vertex moves by in each edit, of the model's longest side: two thirds of a cell, and a fifteenth. */
const STEPS = [0.01, 0.001];
/** Vertices nearer to the cage's box than this share of it would move the grid. */
const RIM = 0.03;

globalThis.self ??= globalThis;
const pkg = new URL("../web/src/pkg/", import.meta.url);
const { Binder, default: init } = await import(new URL("cagework.js", pkg));
await init({ module_or_path: readFileSync(new URL("cagework_bg.wasm", pkg)) });

const options = {
  backend: "cpu",
  method: "embedded",
  solver: "multigrid",
  grid: 64,
  tau: 1e-5,
  max_iterations: 20_000,
  sparsify: 0,
  delta_norm: "euclidean",
  cell_shape: "box",
  memory_limit: 2 ** 31,
  outside: "closest_point",
};

/** Positions of a GLB's first mesh, as samples are built. */
function glbPositions(glb) {
  const view = new DataView(glb.buffer, glb.byteOffset, glb.byteLength);
  const length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(glb.subarray(20, 20 + length)));
  const accessor = json.accessors[json.meshes[0].primitives[0].attributes.POSITION];
  const start = (json.bufferViews[accessor.bufferView].byteOffset ?? 0) + (accessor.byteOffset ?? 0);
  return new Float32Array(glb.slice(28 + length).buffer, start, 3 * accessor.count).slice();
}

/** Positions, and for each face the number of its corners, then them. */
function obj(path) {
  const [positions, corners] = [[], []];
  for (const line of readFileSync(path, "utf8").split("\n")) {
    const [kind, ...words] = line.trim().split(/\s+/);
    if (kind === "v") positions.push(...words.slice(0, 3).map(Number));
    else if (kind === "f") corners.push(words.length, ...words.map((word) => Number.parseInt(word, 10) - 1));
  }
  return { positions: new Float32Array(positions), corners: new Uint32Array(corners) };
}

const median = (times) => times.toSorted((a, b) => a - b)[times.length >> 1];

/** Milliseconds of a bind, and its corrections. */
async function bind(binder, mesh, positions, corners) {
  const began = performance.now();
  const bound = await binder.bind(mesh, positions, corners, options, () => true);
  const ms = performance.now() - began;
  const { corrections } = bound.report;
  bound.free();
  return { ms, corrections };
}

async function measure(name, mesh, { positions, corners }) {
  const axes = [0, 1, 2].map((axis) => positions.filter((_, k) => k % 3 === axis));
  const [low, high] = [axes.map((xs) => Math.min(...xs)), axes.map((xs) => Math.max(...xs))];
  const size = Math.max(...high.map((h, axis) => h - low[axis]));
  const isFree = (k) =>
    axes.every((xs, axis) => xs[k] > low[axis] + RIM * size && xs[k] < high[axis] - RIM * size);
  const all = [...axes[0].keys()];
  // The clamp has none; most of its vertices can move along y all the same.
  const free = all.some(isFree) ? all.filter(isFree) : all;
  // Until V8 has compiled all for speed.
  const warm = performance.now() + WARM_UP_MS;
  while (performance.now() < warm) {
    const binder = new Binder();
    await bind(binder, mesh, positions, corners);
    binder.free();
  }
  const [edits, everyWhole] = [[], []];
  // The first place twice, and once not counted: the code of edits is compiled then.
  for (const [number, place] of [PLACES[0], ...PLACES].entries()) {
    const vertex = free[Math.floor(place * free.length)];
    const shares = [];
    for (const step of STEPS) {
      // In turn: the machine's speed may change from second to second.
      const [times, whole] = [[], []];
      let anew = 0;
      let corrections;
      for (let round = 0; round < ROUNDS; round += 1) {
        const binder = new Binder();
        whole.push((await bind(binder, mesh, positions, corners)).ms);
        for (let k = 1; k <= EDITS; k += 1) {
          const edited = positions.slice();
          // There and back again: no further from the cage's shape after many edits than after one.
          edited[3 * vertex + 1] += (k % 2) * step * size;
          const { ms, corrections: some } = await bind(binder, mesh, edited, corners);
          times.push(ms);
          if (some === undefined) anew += 1;
          else corrections = some;
        }
        binder.free();
      }
      everyWhole.push(...whole);
      const how = [corrections && `${corrections} corrections`, anew && `${anew} of ${times.length} anew`];
      shares.push(`${(median(times) / median(whole)).toFixed(2)} (${how.filter(Boolean).join(", ")})`);
    }
    if (number > 0) edits.push(`vertex ${vertex} ${shares.join(" and ")}`);
  }
  const of = `${mesh.length / 3} vertices, ${positions.length / 3} columns`;
  console.log(`${name}: ${of}; whole ${median(everyWhole).toFixed(0)} ms; ${edits.join("; ")}`);
}

const [mesh, cage] = process.argv.slice(2);
if (mesh && cage) await measure(mesh, obj(mesh).positions, obj(cage));
else {
  for (const id of ["rat", "humanoid", "clamp", "strider"]) {
    const sample = Binder.buildSample(id);
    await measure(id, glbPositions(sample.glb), sample.cage);
  }
}
