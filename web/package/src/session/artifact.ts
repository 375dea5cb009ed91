/** The two builds of the wasm module: one for WebGPU, and one for WebGL2, which is downloaded only when needed. */

import { fetchPart } from "./parts";

/** The exports that both builds share. */
export type Package = typeof import("../pkg/cagework");

/** One build of the module. */
export interface Artifact {
  readonly pkg: Package;
  /** URL of the build's wasm file. */
  readonly wasm: string;
  openWorker(): Worker;
}

/** Downloads and compiles a module; compiles during the download if the server sends the MIME type of wasm. */
export async function compile(url: string): Promise<WebAssembly.Module> {
  return fetchPart(url, async (response) => {
    if (response.headers.get("Content-Type")?.startsWith("application/wasm")) {
      return WebAssembly.compileStreaming(response);
    }
    return WebAssembly.compile(await response.arrayBuffer());
  });
}
