/** Inputs and outputs of worker jobs. */

import type { ErrorName, PullOptions } from "./generated";

/** Start of a pull. `start` is the current pose of the cage and of the controls inside, `[n_controls, 3]`. */
export interface GrabInput {
  readonly start: Float32Array;
  /** Weights of the grabs, followed by those of the pins. `[n_grips, n_controls]` */
  readonly rows: Float64Array;
  /** The model vertex nearest to each grip. */
  readonly seeds: Uint32Array;
  readonly grabs: number;
  readonly options: PullOptions;
}

export interface Grabbed {
  /** Positions of the grabs. `[n_grabs, 3]` */
  readonly place: Float32Array;
  /** How strongly each model vertex is kept in place. `[n_vertices]` */
  readonly stays: Float32Array;
  /** Radius of the pull, relative to the model's size. */
  readonly reach: number;
}

export interface PullFrame {
  /** `[n_controls, 3]` */
  readonly cage: Float32Array;
  /** True once further frames would not change the pose. */
  readonly settled: boolean;
  /** Distance of grabs and pins from their targets, relative to the model's size. */
  readonly error: number;
}

/** Why WebGPU cannot be used: the browser lacks it, it found no graphics card, or the device did not start. */
export type Lack = "NoWebGPU" | Extract<ErrorName, "NoAdapter" | "NoDevice">;

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
  /** Within the stage, 0 to 1; 0 if unknown. */
  readonly fraction: number;
}
