/** Cages as arrays, and the result of checking them. */

import type { CageControls, Problem } from "./generated";

/**
 * `positions` is `[n_controls, 3]`: cage vertices, then controls inside. `corners` lists, for each face, the number of its
 * corners and then their vertices.
 */
export interface CageArrays {
  readonly positions: Float32Array;
  readonly corners: Uint32Array;
  /** Undefined for a new cage, which keeps the current controls. */
  readonly controls?: CageControls | undefined;
}

/**
 * Result of a cage check: the problems, and the vertices, edges, faces and points to mark. `outside` lists model vertices
 * outside the cage.
 */
export interface Check {
  readonly problems: readonly Problem[];
  readonly vertices: Uint32Array;
  readonly edges: Uint32Array;
  readonly faces: Uint32Array;
  readonly points: Float32Array;
  readonly outside: Uint32Array;
}

/** A cage with the result of its check; `check` is null before it. */
export interface CheckedCage extends CageArrays {
  readonly check: Check | null;
  /** For a generated cage: the number of separate parts of the model that it joins. */
  readonly bridged?: number;
  /** For a generated cage: gaps of the model that it closes, and the settings that would keep them open. */
  readonly notices?: readonly string[];
}
