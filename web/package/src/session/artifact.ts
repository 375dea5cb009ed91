/** The module in its two builds: for WebGPU, which comes with the page, and for WebGL2, downloaded only where needed. */

/** What both builds offer. */
export type Package = typeof import("../pkg/cagework");

export interface Artifact {
  readonly pkg: Package;
  /** Where its wasm file is. */
  readonly wasm: string;
  openWorker(): Worker;
}

/** Compiles while it downloads, where the server says that it is wasm. */
export async function compile(url: string): Promise<WebAssembly.Module> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url} could not be downloaded (${response.status})`);
  if (response.headers.get("Content-Type")?.startsWith("application/wasm")) {
    return WebAssembly.compileStreaming(response);
  }
  return WebAssembly.compile(await response.arrayBuffer());
}
