/**
 * The contract between the page and Rust: types only. The page imports them from here and `openSession` from
 * "./session"; nothing else touches the wasm package or the worker.
 *
 * Errors: every rejected promise and every throw from Rust is an `Error` whose `name` is an `ErrorName` and whose `message`
 * is a sentence for the user, its first letter in lower case. After an error the state is as before the call.
 *
 * Coordinates: x, y are CSS pixels from the canvas's top left corner. Arrays of points are `[n, 3]` flattened.
 */

export type * from "./contract/bind";
export type * from "./contract/cage";
export type * from "./contract/generated";
export type * from "./contract/session";
export type { Engine } from "./pkg/cagework";
