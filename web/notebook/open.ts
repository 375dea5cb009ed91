/**
 * Replaces session/open.ts in the notebook widget, whose single file contains the worker. The wasm file has no URL in a
 * notebook, so Python sends it.
 */

import type { Artifact } from "../package/src/session/artifact";
import type { Canvases, OpenResult } from "../package/src/session/open";
import { WEBGL as BASE } from "../package/src/session/webgl";
import PackageWorker from "../package/src/worker-webgl.ts?worker&inline";

const WEBGL: Artifact = { ...BASE, openWorker: () => new PackageWorker() };

/** Each cell loads its own copy of this file. All copies share the compiled module, which is a global variable. */
const shared = globalThis as unknown as { cageworkModule?: Promise<WebAssembly.Module> };

/** Compiles the gzip-compressed wasm file of the build for WebGL2. This build works in all notebooks. */
export function compile(gzip: ArrayBuffer): void {
  const unpacked = () => new Blob([gzip]).stream().pipeThrough(new DecompressionStream("gzip"));
  shared.cageworkModule ??= new Response(unpacked())
    .arrayBuffer()
    .then((bytes) => WebAssembly.compile(bytes));
}

export async function openOn<T>(canvases: Canvases, start: (opened: OpenResult) => Promise<T>): Promise<T> {
  if (!shared.cageworkModule) throw new Error("the widget has not received the wasm file");
  const module = await shared.cageworkModule;
  const canvas = canvases.freshCanvas();
  return start({ artifact: WEBGL, module, canvas, adapter: "WebGL2", lack: "NoWebGPU" });
}
