/** The build for functions that need no files, no drawing and no GPU: a third of the others' size. Import it dynamically. */

import * as pkg from "../pkg-compute/cagework_compute";
import type { Artifact, Package } from "./artifact";

export const COMPUTE: Artifact = {
  // It has fewer classes than the other builds: `api.ts` uses only those.
  pkg: pkg as unknown as Package,
  wasm: new URL("../pkg-compute/cagework_compute_bg.wasm", import.meta.url).href,
  openWorker: () =>
    new Worker(new URL("../worker-compute.ts", import.meta.url), {
      type: "module",
      name: "cagework-compute",
    }),
};
