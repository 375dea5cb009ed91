/** Converts a flat array of coordinates to points `[x, y, z]`, as commands of the engine need them. */
export function triples(flat: ArrayLike<number>): (readonly [number, number, number])[] {
  const at = (i: number) => flat[i] ?? 0;
  return Array.from({ length: flat.length / 3 }, (_, k) => [at(3 * k), at(3 * k + 1), at(3 * k + 2)]);
}
