/** The build that draws and computes with WebGPU. */

import * as pkg from "../pkg/cagework";
import type { Artifact } from "./artifact";

export const WEBGPU: Artifact = {
  pkg,
  wasm: new URL("../pkg/cagework_bg.wasm", import.meta.url).href,
  openWorker: () =>
    new Worker(new URL("../worker.ts", import.meta.url), { type: "module", name: "cagework" }),
};
