/** Cages as arrays, and the result of checking them. */

import type { CageControls, Problem } from "./generated";

/**
 * `positions` is `[n_controls, 3]`: cage vertices, then controls inside the cage. `corners` lists, for each face, the
 * number of its corners and then their vertices.
 */
export interface CageArrays {
  readonly positions: Float32Array;
  readonly corners: Uint32Array;
  /** Undefined for a new cage. The document then keeps its inner controls, as far as they fit into the new cage. */
  readonly controls?: CageControls | undefined;
}

/**
 * Result of a cage check: the problems, and the vertices, edges, faces and points to mark in the view. `outside` lists
 * the model vertices outside the cage.
 */
export interface Check {
  readonly problems: readonly Problem[];
  readonly vertices: Uint32Array;
  readonly edges: Uint32Array;
  readonly faces: Uint32Array;
  readonly points: Float32Array;
  readonly outside: Uint32Array;
}

/** A cage with the result of its check; `check` is null if it has not been checked. */
export interface CheckedCage extends CageArrays {
  readonly check: Check | null;
  /**
   * For a generated cage that joins separate parts of the model, the number of these parts; otherwise 0 or undefined.
   */
  readonly bridged?: number;
  /**
   * For a generated cage, sentences about gaps of the model that the cage closes, with settings that would keep the
   * gaps open.
   */
  readonly notices?: readonly string[];
}
