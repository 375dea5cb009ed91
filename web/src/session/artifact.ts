/** The module in its two builds: for WebGPU, which comes with the page, and for WebGL2, downloaded only where needed. */

/** What both builds offer. */
export type Package = typeof import("../pkg/cagework");

export interface Artifact {
  readonly pkg: Package;
  /** Where its wasm file is. */
  readonly wasm: string;
  openWorker(): Worker;
}
