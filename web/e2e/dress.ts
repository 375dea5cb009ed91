/** The sample "wardrobe": a dressmaker's dummy, a dress and a belt, each a surface through elliptic cross-sections. */

import type { DroppedFile } from "./support";
import { Builder } from "./wardrobe";

/** Height and semi-axes of an elliptic cross-section, metres. */
type Ring = readonly [y: number, x: number, z: number];

const N_SECTORS = 64;

/** Knots of the dummy's profile from the base to the neck. */
const DUMMY: readonly Ring[] = [
  [0, 0, 0],
  [0.001, 0.2, 0.2],
  [0.02, 0.2, 0.2],
  [0.05, 0.05, 0.05],
  [0.1, 0.02, 0.02],
  [0.7, 0.02, 0.02],
  [0.72, 0.13, 0.1],
  [0.78, 0.17, 0.125],
  [0.9, 0.178, 0.13],
  [1.07, 0.125, 0.095],
  [1.25, 0.168, 0.125],
  [1.36, 0.185, 0.1],
  [1.42, 0.13, 0.075],
  [1.46, 0.06, 0.058],
  [1.54, 0.055, 0.055],
  [1.56, 0.04, 0.04],
  [1.565, 0, 0],
];
/** Approximate distance of the dress from the dummy above the hips, metres. */
const GAP = 0.012;
const DRESS: readonly Ring[] = [
  [0.34, 0.36, 0.32],
  [0.6, 0.27, 0.23],
  [0.8, 0.2, 0.155],
  [0.92, 0.178 + GAP, 0.13 + GAP],
  [1.07, 0.125 + GAP, 0.095 + GAP],
  [1.25, 0.168 + GAP, 0.125 + GAP],
  [1.37, 0.18 + GAP, 0.097 + GAP],
];
const BELT: readonly Ring[] = [
  [1.04, 0.15, 0.12],
  [1.045, 0.158, 0.128],
  [1.075, 0.156, 0.126],
  [1.105, 0.158, 0.128],
  [1.11, 0.15, 0.12],
];

/**
 * Interpolates knots by a cubic Hermite curve, with `steps` rings per interval. Slopes are harmonic means of adjacent
 * differences, or 0 at extrema, so the curve does not overshoot.
 */
function rings(knots: readonly Ring[], steps: number): Ring[] {
  const slope = (k: number, axis: number): number => {
    const [a, b, c] = [knots[k - 1] ?? knots[k], knots[k], knots[k + 1] ?? knots[k]].map(
      (ring) => ring?.[axis] ?? 0,
    );
    const [before, after] = [(b ?? 0) - (a ?? 0), (c ?? 0) - (b ?? 0)];
    return before * after <= 0 ? 0 : (2 * before * after) / (before + after);
  };
  const between = (k: number, t: number): Ring => {
    const values = [0, 1, 2].map((axis) => {
      const [p, q] = [knots[k]?.[axis] ?? 0, knots[k + 1]?.[axis] ?? 0];
      const [t2, t3] = [t * t, t * t * t];
      return (
        (2 * t3 - 3 * t2 + 1) * p +
        (t3 - 2 * t2 + t) * slope(k, axis) +
        (3 * t2 - 2 * t3) * q +
        (t3 - t2) * slope(k + 1, axis)
      );
    });
    return [values[0] ?? 0, values[1] ?? 0, values[2] ?? 0];
  };
  const all = knots
    .slice(1)
    .flatMap((_, k) => Array.from({ length: steps }, (_, j) => between(k, j / steps)));
  const last = knots.at(-1);
  return last ? [...all, last] : all;
}

/**
 * Joins consecutive cross-sections by triangles, without normals. `fold`: depth of eight vertical folds at the height
 * `y`, relative to the radius.
 */
function turned(sections: readonly Ring[], fold: (y: number) => number = () => 0) {
  const positions: number[] = [];
  const indices: number[] = [];
  for (const [j, [y, rx, rz]] of sections.entries()) {
    for (let i = 0; i < N_SECTORS; i++) {
      const angle = (2 * Math.PI * i) / N_SECTORS;
      const radius = 1 + fold(y) * Math.cos(8 * angle);
      positions.push(rx * radius * Math.cos(angle), y, rz * radius * Math.sin(angle));
      if (j === 0) continue;
      const [a, b] = [j * N_SECTORS + i, j * N_SECTORS + ((i + 1) % N_SECTORS)];
      indices.push(a - N_SECTORS, a, b - N_SECTORS, b - N_SECTORS, a, b);
    }
  }
  return { positions, indices };
}

function file(
  name: string,
  colour: [number, number, number],
  mesh: ReturnType<typeof turned>,
): Promise<DroppedFile> {
  const all = new Builder();
  const made = all.document.createMesh(name).addPrimitive(all.primitive(mesh, all.material(name, colour)));
  all.add(all.document.createNode(name).setMesh(made));
  return all.file(`${name}.glb`);
}

/** Writes the files of dummy, dress and belt. */
export const dressed = (): Promise<DroppedFile[]> =>
  Promise.all([
    file("dummy", [0.72, 0.62, 0.5], turned(rings(DUMMY, 4))),
    file(
      "dress",
      [0.62, 0.1, 0.16],
      turned(rings(DRESS, 8), (y) => 0.1 * Math.max(0, (0.9 - y) / 0.56)),
    ),
    file("belt", [0.1, 0.09, 0.12], turned(rings(BELT, 2))),
  ]);
