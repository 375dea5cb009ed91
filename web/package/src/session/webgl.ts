/** The build that draws with WebGL2 and computes on the processor. Import it dynamically. */

import * as pkg from "../pkg-webgl/cagework_webgl";
import type { Artifact, Package } from "./artifact";

export const WEBGL: Artifact = {
  // The builds have the same classes, but TypeScript treats classes with private constructors as different types.
  pkg: pkg as unknown as Package,
  wasm: new URL("../pkg-webgl/cagework_webgl_bg.wasm", import.meta.url).href,
  // The worker needs a unique name: webpack merges workers of the same name into one file.
  openWorker: () =>
    new Worker(new URL("../worker-webgl.ts", import.meta.url), { type: "module", name: "cagework-webgl" }),
};
