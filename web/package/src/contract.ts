/**
 * The contract between JavaScript and Rust: types only.
 *
 * Errors: every rejected promise and every throw from Rust is an `Error` whose `name` is an `ErrorName` and whose
 * `message` is a sentence for the user, its first letter in lower case. A call that fails leaves the state unchanged.
 *
 * Coordinates: x, y are CSS pixels from the canvas's top left corner. Arrays of points are `[n, 3]` flattened.
 */

export type * from "./contract/bind";
export type * from "./contract/cage";
export type * from "./contract/generated";
export type * from "./contract/work";
export type { Engine } from "./pkg/cagework";
