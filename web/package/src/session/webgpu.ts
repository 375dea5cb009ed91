/** The build that draws and computes with WebGPU. */

import * as pkg from "../pkg/cagework";
import wasm from "../pkg/cagework_bg.wasm?url";
import type { Artifact } from "./artifact";

export const WEBGPU: Artifact = {
  pkg,
  wasm,
  openWorker: () =>
    new Worker(new URL("../worker.ts", import.meta.url), { type: "module", name: "cagework" }),
};
