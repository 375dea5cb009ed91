/** The builds of the wasm module: for WebGPU, for WebGL2, and without files and drawing. Each is downloaded when needed. */

import { fetchPart } from "./parts";

/** The exports of a build. */
export type Package = typeof import("../pkg/cagework");

/** One build of the wasm module: its JavaScript, its wasm file and its worker. */
export interface Artifact {
  readonly pkg: Package;
  /** URL of the build's wasm file. */
  readonly wasm: string;
  openWorker(): Worker;
}

/** Modules by URL. Several views on a page share a module. */
const modules = new Map<string, Promise<WebAssembly.Module>>();

/** Downloads and compiles a wasm module. Calls with the same URL share the module, unless the download failed. */
export function compile(url: string): Promise<WebAssembly.Module> {
  const known = modules.get(url) ?? download(url);
  modules.set(url, known);
  known.catch(() => modules.delete(url));
  return known;
}

/** Compiles during the download if the server sends the MIME type of wasm. */
function download(url: string): Promise<WebAssembly.Module> {
  return fetchPart(url, async (response) => {
    if (response.headers.get("Content-Type")?.startsWith("application/wasm")) {
      return WebAssembly.compileStreaming(response);
    }
    return WebAssembly.compile(await response.arrayBuffer());
  });
}
