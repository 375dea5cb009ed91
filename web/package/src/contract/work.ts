/** What is done in a worker: jobs, files, pulls. */

import type { ErrorName, PullOptions } from "./generated";

/** What is taken hold of, in the pose `start` of the cage and controls inside, `[n_controls, 3]`. */
export interface GrabInput {
  readonly start: Float32Array;
  /** Weights of the grabs, then of the pins. `[n_grips, n_controls]` */
  readonly rows: Float64Array;
  /** The nearest vertex of the model of each. */
  readonly seeds: Uint32Array;
  readonly grabs: number;
  readonly options: PullOptions;
}

export interface Grabbed {
  /** Where the grabs are. `[n_grabs, 3]` */
  readonly place: Float32Array;
  /** How much each vertex of the model stays. `[n_vertices]` */
  readonly stays: Float32Array;
  /** Over the model's size. */
  readonly reach: number;
}

export interface PullFrame {
  /** `[n_controls, 3]` */
  readonly cage: Float32Array;
  /** Another frame would be the same. */
  readonly settled: boolean;
  /** How far grabs and pins are from where they should be, over the model's size. */
  readonly error: number;
}

/** What is missing: the browser has no WebGPU, or has it and found no graphics card for it, or that did not start. */
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

/** What a worker does with a file. */
export interface Reading {
  readonly stage: "bytes" | "decompress" | "geometry" | "textures" | "check";
  /** Of the stage, 0 to 1; 0 where nobody can know. */
  readonly fraction: number;
}
