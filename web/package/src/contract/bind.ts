/** Progress of a bind. */

import type { BindReport, Stage } from "./generated";

export type BindEvent =
  | {
      readonly kind: "progress";
      readonly pass: "coarse" | "fine";
      readonly stage: Stage;
      /** Finished fraction of this pass, 0 to 1. */
      readonly fraction: number;
      readonly etaMs: number | null;
      readonly iteration: number;
      readonly delta: number | null;
    }
  /** The engine uses the weights of `pass`. The weights of the fine pass replace those of the coarse pass. */
  | { readonly kind: "adopted"; readonly pass: "coarse" | "fine"; readonly report: BindReport }
  /** The GPU failed, and the bind continues on the CPU. `reason` is the error message. */
  | { readonly kind: "fallback"; readonly reason: string };
