/** What page and worker say to each other. */

import type { BindOptions, BindReport, CageOptions } from "../contract";

/** Cage as arrays: positions `[n_cage, 3]`; for each face the number of its corners, then them. */
export interface CageArrays {
  readonly positions: Float32Array;
  readonly corners: Uint32Array;
}

/** Weights as compressed sparse rows, and vertices outside the cage. */
export interface BoundArrays {
  readonly indptr: Uint32Array;
  readonly indices: Uint32Array;
  readonly data: Float32Array;
  readonly outside: Uint32Array;
  readonly offsets: Float32Array;
  readonly report: BindReport | undefined;
}

export interface SampleArrays {
  readonly glb: Uint8Array;
  readonly cage: CageArrays;
  readonly poses: readonly { readonly name: string; readonly positions: Float32Array }[];
}

/** A job's name, what it needs, and what it results in. */
export interface Jobs {
  bind: { input: { positions: Float32Array; cage: CageArrays; options: BindOptions }; output: BoundArrays };
  meanValue: { input: { positions: Float32Array; cage: CageArrays }; output: BoundArrays };
  slice: {
    input: { cage: CageArrays; axis: number; fraction: number; options: BindOptions };
    output: BoundArrays | undefined;
  };
  cage: {
    input: { positions: Float32Array; triangles: Uint32Array; options: CageOptions };
    output: CageArrays;
  };
  sample: { input: { id: string }; output: SampleArrays };
}

export type JobKind = keyof Jobs;

/** One step of a job. */
export interface Step {
  readonly stage: "voxelize" | "solve" | "sample" | "simplify";
  readonly fraction: number;
  readonly iteration: number;
  readonly delta: number | null;
}

export type ToWorker =
  | { readonly kind: "start"; readonly module: WebAssembly.Module }
  | { readonly kind: "job"; readonly id: number; readonly job: JobKind; readonly input: unknown }
  | { readonly kind: "cancel"; readonly id: number };

export type FromWorker =
  | { readonly kind: "step"; readonly id: number; readonly step: Step }
  | { readonly kind: "done"; readonly id: number; readonly output: unknown }
  | { readonly kind: "failed"; readonly id: number; readonly name: string; readonly message: string };
