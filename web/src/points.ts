/** Converts flat coordinates to points `[x, y, z]`, the form that commands of the engine take. */
export function triples(flat: ArrayLike<number>): (readonly [number, number, number])[] {
  const at = (i: number) => flat[i] ?? 0;
  return Array.from({ length: flat.length / 3 }, (_, k) => [at(3 * k), at(3 * k + 1), at(3 * k + 2)]);
}
