/** Cages with the result of checking them. */

import type { CageArrays, Problem } from "./generated";

/** A cage with the problems that a check found; `check` is null if it has not been checked. */
export interface CheckedCage extends CageArrays {
  readonly check: readonly Problem[] | null;
}
