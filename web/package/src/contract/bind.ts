/** A bind, as it is followed. */

import type { BindReport, Stage } from "./generated";

export type BindEvent =
  | {
      readonly kind: "progress";
      readonly pass: "coarse" | "fine";
      readonly stage: Stage;
      /** Of this pass, 0 to 1. */
      readonly fraction: number;
      readonly etaMs: number | null;
      readonly iteration: number;
      readonly delta: number | null;
    }
  /** Weights are in: the model can be dragged (coarse) or is final (fine). */
  | { readonly kind: "adopted"; readonly pass: "coarse" | "fine"; readonly report: BindReport }
  /** The GPU could not do it and the CPU does it instead; `reason` is a sentence. */
  | { readonly kind: "fallback"; readonly reason: string };
