/** Defaults and ranges of options. They are generated from Rust's definitions, which document them. */

import { BIND_DEFAULTS, type BindOptions, USUAL_SOLVERS } from "@cagework/core/contract/generated";

export * from "@cagework/core/contract/generated";

/** The nearest value within the range of a slider. */
export const clamped = (
  value: number,
  { min, max }: { readonly min: number; readonly max: number },
): number => Math.min(max, Math.max(min, value));

/** Options of the published method (Joshi et al. 2007, as K. Smith describes it; see docs/method.md). */
export const PAPER_DEFAULTS: BindOptions = {
  ...BIND_DEFAULTS,
  method: "classic",
  solver: USUAL_SOLVERS.classic,
};
