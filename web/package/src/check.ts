/** Arguments of the package's functions: what is not as it must be is said with its name. */

import { named } from "./session/client";

/** The largest number of 32 bits. */
const MOST = 0xffffffff;

function wrong(message: string): Error {
  return named("Error", message);
}

function lengthOf(name: string, given: unknown): number {
  const length =
    typeof given === "object" && given !== null ? (given as ArrayLike<number>).length : undefined;
  if (typeof length === "number") return length;
  throw wrong(`${name} is ${given === null ? "null" : typeof given}; it must be an array of numbers`);
}

/** Three numbers for each point, flattened. */
export function pointsOf(name: string, given: ArrayLike<number>): Float32Array {
  requireTriples(name, lengthOf(name, given), "point");
  return given instanceof Float32Array ? given : Float32Array.from(given);
}

/** Three vertices for each triangle, flattened. */
export function trianglesOf(name: string, given: ArrayLike<number>): Uint32Array {
  requireTriples(name, lengthOf(name, given), "triangle");
  return indicesOf(name, given);
}

/** Whole numbers from 0 on. */
export function indicesOf(name: string, given: ArrayLike<number>): Uint32Array {
  lengthOf(name, given);
  if (given instanceof Uint32Array) return given;
  const wrongOne = Array.from(given).findIndex((x) => !Number.isInteger(x) || x < 0 || x > MOST);
  if (wrongOne >= 0) {
    throw wrong(`${name} has ${given[wrongOne]} at ${wrongOne}; it must be whole numbers from 0 on`);
  }
  return Uint32Array.from(given);
}

function requireTriples(name: string, length: number, what: string): void {
  if (length % 3 === 0) return;
  const next = 3 * Math.ceil(length / 3);
  throw wrong(`${name} has ${length} numbers; three for each ${what} are needed, so ${next - 3} or ${next}`);
}

/** Three finite numbers. */
export function originOf(name: string, given: ArrayLike<number>): Float64Array {
  if (lengthOf(name, given) === 3 && Array.from(given).every(Number.isFinite))
    return Float64Array.from(given);
  throw wrong(`${name} is ${Array.from(given).join(", ")}; it must be three finite numbers`);
}

/** A pose has as many points as the cage. */
export function poseOf(given: ArrayLike<number>, cage: Float32Array): Float32Array {
  const posed = pointsOf("posed", given);
  if (posed.length !== cage.length) {
    throw wrong(`posed has ${posed.length} numbers; it must have as many as the cage, ${cage.length}`);
  }
  const wrongOne = posed.findIndex((x) => !Number.isFinite(x));
  if (wrongOne < 0) return posed;
  throw wrong(`posed has ${posed[wrongOne]} at ${wrongOne}; it must be finite numbers of 32 bits`);
}

/** Those of the options that belong to a set, over its defaults; what words and numbers may be is Rust's to say. */
export function optionsOf<T extends object>(defaults: T, given: object): T {
  const known = Object.entries(given).filter(([name, value]) => name in defaults && value !== undefined);
  for (const [name, value] of known) {
    const kind = typeof defaults[name as keyof T];
    if (typeof value !== kind) throw wrong(`${name} is a ${typeof value}; it must be a ${kind}`);
  }
  return { ...defaults, ...Object.fromEntries(known) };
}

/** A word that no set knows is a slip of the pen. */
export function requireKnown(given: object, ...sets: readonly object[]): void {
  const names = sets.flatMap((set) => Object.keys(set));
  const unknown = Object.keys(given).find((name) => !names.includes(name));
  if (unknown !== undefined) throw wrong(`there is no option ${unknown}; there are ${names.join(", ")}`);
}
