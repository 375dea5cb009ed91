/** Progress of a bind. */

import type { BindReport, Stage } from "./generated";

export type BindEvent =
  | {
      readonly kind: "progress";
      readonly pass: "coarse" | "fine";
      readonly stage: Stage;
      /** Within this pass, 0 to 1. */
      readonly fraction: number;
      readonly etaMs: number | null;
      readonly iteration: number;
      readonly delta: number | null;
    }
  /** New weights are in use: the model can be dragged (coarse) or the result is final (fine). */
  | { readonly kind: "adopted"; readonly pass: "coarse" | "fine"; readonly report: BindReport }
  /** The GPU failed and the CPU continues; `reason` is a sentence. */
  | { readonly kind: "fallback"; readonly reason: string };
