/** Binding: what is asked, what is heard, what is reported. */

import type { Point } from "./session";

export interface BindOptions {
  /** Cells along the longest side, 8 to 512. */
  readonly grid: number;
  readonly method: "embedded" | "classic";
  /** Conjugate gradients ("cg") run on the processor only. */
  readonly solver: "multigrid" | "jacobi" | "cg";
  /** Of conjugate gradients; no other solver looks at it. */
  readonly preconditioner: "none" | "v_cycle";
  readonly backend: "gpu" | "cpu";
  /** Classic only. */
  readonly cell_shape: "box" | "cubic";
  readonly delta_norm: "euclidean" | "literal";
  /** Stop threshold. */
  readonly tau: number;
  readonly max_iterations: number;
  /** Weights below it are dropped; 0 keeps all. The paper's c. */
  readonly sparsify: number;
  readonly outside: "closest_point" | "refuse";
  /** Bytes. */
  readonly memory_limit: number;
}

export type BindEvent =
  | {
      readonly kind: "progress";
      readonly pass: "coarse" | "fine";
      readonly stage: "voxelize" | "solve" | "sample";
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

/** As in Rust's BindReport, snake_case as there. */
export interface BindReport {
  readonly method: "classic" | "embedded";
  readonly solver: "jacobi" | "multigrid" | "cg";
  readonly preconditioner?: "none" | "v_cycle";
  readonly backend: "cpu" | "gpu";
  readonly adapter?: string;
  readonly threads: number;
  readonly grid: number;
  readonly dims: Point;
  readonly cell_size: Point;
  readonly cell_shape: "box" | "cubic";
  readonly delta_norm: "euclidean" | "literal";
  readonly tau: number;
  readonly cells: { readonly interior: number; readonly boundary: number; readonly exterior: number };
  readonly levels: readonly number[];
  readonly iterations: number;
  readonly converged: boolean;
  readonly at_round_off: boolean;
  readonly delta_history: readonly number[];
  readonly delta_interval: number;
  readonly residual_history: readonly number[];
  readonly timings_ms: {
    readonly voxelize: number;
    readonly solve: number;
    readonly sample: number;
    readonly total: number;
  };
  readonly memory_bytes: { readonly estimated: number; readonly peak: number };
  /** Distances in object units; *_rel over the cage's diagonal. */
  readonly rest_error: {
    readonly mean: number;
    readonly p99: number;
    readonly max: number;
    readonly mean_rel: number;
    readonly max_rel: number;
  };
  /** What the solver left, before rows were restored: how far they are from a sum of 1, and how far their points from the
   * vertices, over the cage's diagonal. Of vertices inside the cage. */
  readonly raw_error?: {
    readonly sum: { readonly mean: number; readonly max: number };
    readonly point_rel: { readonly mean: number; readonly max: number };
  };
  readonly weights: {
    readonly min: number;
    readonly max: number;
    readonly max_sum_error: number;
    readonly nonzeros: number;
  };
  readonly vertices: number;
  readonly cage_vertices: number;
  readonly outside_vertices: number;
  readonly ambiguous_cells: number;
  readonly notices: readonly string[];
}
