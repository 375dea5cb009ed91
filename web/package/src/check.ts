/** Checks and converts the arguments of the package's functions. Errors name the argument and its value. */

import { named } from "./session/client";

const MAX_INDEX = 0xffffffff;

function wrong(message: string): Error {
  return named("Error", message);
}

function lengthOf(name: string, given: unknown): number {
  const length =
    typeof given === "object" && given !== null ? (given as ArrayLike<number>).length : undefined;
  if (typeof length === "number") return length;
  throw wrong(`${name} is ${given === null ? "null" : typeof given}; it must be an array of numbers`);
}

/** Checks that an array has three numbers per point, and converts it to 32-bit floats. */
export function pointsOf(name: string, given: ArrayLike<number>): Float32Array {
  requireTriples(name, lengthOf(name, given), "point");
  return given instanceof Float32Array ? given : Float32Array.from(given);
}

/** Checks that an array has three indices per triangle, and converts it to 32-bit integers. */
export function trianglesOf(name: string, given: ArrayLike<number>): Uint32Array {
  requireTriples(name, lengthOf(name, given), "triangle");
  return indicesOf(name, given);
}

/** Checks that an array contains integers from 0 to 2^32 - 1, and converts it to 32-bit integers. */
export function indicesOf(name: string, given: ArrayLike<number>): Uint32Array {
  lengthOf(name, given);
  if (given instanceof Uint32Array) return given;
  const wrongOne = Array.from(given).findIndex((x) => !Number.isInteger(x) || x < 0 || x > MAX_INDEX);
  if (wrongOne >= 0) {
    throw wrong(`${name} has ${given[wrongOne]} at ${wrongOne}; it must contain non-negative integers`);
  }
  return Uint32Array.from(given);
}

function requireTriples(name: string, length: number, what: string): void {
  if (length % 3 === 0) return;
  const next = 3 * Math.ceil(length / 3);
  throw wrong(`${name} has ${length} numbers; three for each ${what} are needed, so ${next - 3} or ${next}`);
}

/** Checks that an array contains three finite numbers, and converts it to 64-bit floats. */
export function originOf(name: string, given: ArrayLike<number>): Float64Array {
  if (lengthOf(name, given) === 3 && Array.from(given).every(Number.isFinite))
    return Float64Array.from(given);
  throw wrong(`${name} is ${Array.from(given).join(", ")}; it must be three finite numbers`);
}

/** Checks that a pose has as many points as the cage and that all are finite. Converts it to 32-bit floats. */
export function poseOf(given: ArrayLike<number>, cage: Float32Array): Float32Array {
  const posed = pointsOf("posed", given);
  if (posed.length !== cage.length) {
    throw wrong(`posed has ${posed.length} numbers; the cage has ${cage.length}`);
  }
  const wrongOne = posed.findIndex((x) => !Number.isFinite(x));
  if (wrongOne < 0) return posed;
  throw wrong(`posed has ${posed[wrongOne]} at ${wrongOne}; it must contain finite 32-bit numbers`);
}

/**
 * Returns `defaults`, with values replaced by those of given options of the same name. Checks the types of the values;
 * Rust checks their ranges.
 */
export function optionsOf<T extends object>(defaults: T, given: object): T {
  const known = Object.entries(given).filter(([name, value]) => name in defaults && value !== undefined);
  for (const [name, value] of known) {
    const kind = typeof defaults[name as keyof T];
    if (typeof value !== kind) throw wrong(`${name} is a ${typeof value}; it must be a ${kind}`);
  }
  return { ...defaults, ...Object.fromEntries(known) };
}

/** Throws an error if an option is not a key of any of the `sets`. */
export function requireKnown(given: object, ...sets: readonly object[]): void {
  const names = sets.flatMap((set) => Object.keys(set));
  const unknown = Object.keys(given).find((name) => !names.includes(name));
  if (unknown !== undefined) throw wrong(`unknown option ${unknown}; the options are ${names.join(", ")}`);
}
