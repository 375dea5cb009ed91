/** Inputs and outputs of worker jobs. */

import type { DragOptions, ErrorName } from "./generated";

/** Start of a pull. `start` is the current pose of the cage and of the controls inside it, `[n_controls, 3]`. */
export interface GrabInput {
  readonly start: Float32Array;
  /** Weights of the grabbed points, then of the pinned points. `[n_grabs + n_pins, n_controls]` */
  readonly rows: Float64Array;
  /**
   * For each row of `rows`, the model vertex nearest to the point; 2^32 - 1 if the point is a cage vertex.
   * `[n_grabs + n_pins]`
   */
  readonly seeds: Uint32Array;
  /** Number of grabbed points. */
  readonly grabs: number;
  readonly options: Partial<DragOptions>;
}

/** Result of starting a pull: the grabbed points, and which part of the model the pull moves. */
export interface GrabResult {
  /** Positions of the grabbed points in the pose `start`. `[n_grabs, 3]` */
  readonly place: Float32Array;
  /** How strongly the pull keeps each model vertex in place, 0 to 1. `[n_vertices]` */
  readonly stays: Float32Array;
  /** Distance along the surface within which the pull moves the model, as a fraction of the model's size. */
  readonly reach: number;
}

export interface PullFrame {
  /** Pose of the cage. `[n_controls, 3]` */
  readonly cage: Float32Array;
  /** True once further frames would not change the pose. */
  readonly settled: boolean;
  /** Largest distance of a grabbed or pinned point from its target, as a fraction of the model's size. */
  readonly error: number;
}

/** Why WebGPU cannot be used: the browser lacks it or found no graphics card, or the device did not start. */
export type WebGpuFault = "NoWebGPU" | Extract<ErrorName, "NoAdapter" | "NoDevice">;

export interface Job<T> {
  readonly done: Promise<T>;
  cancel(): void;
}

export interface NamedFile {
  readonly name: string;
  readonly path: string;
  readonly file: Blob;
}

/** Progress of reading a file. */
export interface Reading {
  readonly stage: "bytes" | "decompress" | "geometry" | "textures" | "check";
  /** Finished fraction of the stage, 0 to 1; 0 if unknown. */
  readonly fraction: number;
}
