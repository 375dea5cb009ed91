/** A cage as arrays, and what is wrong with it. */

import type { CageControls, Problem } from "./generated";

/** Positions `[n_controls, 3]`: the cage's, then those of controls inside; for each face the number of its corners, then them. */
export interface CageArrays {
  readonly positions: Float32Array;
  readonly corners: Uint32Array;
  /** Undefined for a cage that was just made: it takes those there are. */
  readonly controls?: CageControls | undefined;
}

/** What is wrong with a cage, and where: in it, or in the model (`outside`). */
export interface Check {
  readonly problems: readonly Problem[];
  readonly vertices: Uint32Array;
  readonly edges: Uint32Array;
  readonly faces: Uint32Array;
  readonly points: Float32Array;
  readonly outside: Uint32Array;
}

/** A cage that a worker has looked at; null while it has not. */
export interface CheckedCage extends CageArrays {
  readonly check: Check | null;
  /** Separate parts of the model that it joins, if it was made so. */
  readonly bridged?: number;
  /** Gaps of the model that it closes, if it was made so, and what would keep each open. */
  readonly notices?: readonly string[];
}
