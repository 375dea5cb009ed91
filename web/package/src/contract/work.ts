/** Inputs and outputs of worker jobs. */

import type { ErrorName } from "./generated";

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
  readonly stage: "bytes" | "convert" | "geometry" | "textures" | "check";
  /** Finished fraction of the stage, 0 to 1; 0 if unknown. */
  readonly fraction: number;
}
