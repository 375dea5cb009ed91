/** The build that draws with WebGL2 and computes on the processor. Import it when it is needed, not before. */

import * as pkg from "../pkg-webgl/cagework_webgl";
import type { Artifact, Package } from "./artifact";

export const WEBGL: Artifact = {
  // Two builds of one crate: TypeScript holds their classes for strangers, because constructors are private.
  pkg: pkg as unknown as Package,
  wasm: new URL("../pkg-webgl/cagework_webgl_bg.wasm", import.meta.url).href,
  // A name of its own: webpack makes one file of the workers of one name.
  openWorker: () =>
    new Worker(new URL("../worker-webgl.ts", import.meta.url), { type: "module", name: "cagework-webgl" }),
};
