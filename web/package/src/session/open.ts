/** On what a browser draws: WebGPU, or else WebGL2. */

import type { Lack } from "../contract";
import { findAdapter, hasWebGl2, lackOf } from "./adapter";
import { type Artifact, compile } from "./artifact";
import { WEBGPU } from "./webgpu";

/** Where the picture goes; a canvas that one interface has used is lost to the other. */
export interface Canvases {
  canvas(): HTMLCanvasElement;
  freshCanvas(): HTMLCanvasElement;
}

/** What was found to draw with. */
export interface OpenedOn {
  readonly artifact: Artifact;
  readonly module: WebAssembly.Module;
  readonly canvas: HTMLCanvasElement;
  /** Name of the GPU. */
  readonly adapter: string;
  /** Why it is WebGL2, with the processor to compute; null with WebGPU. */
  readonly lack: Lack | null;
}

/**
 * Starts on WebGPU; where that is missing on WebGL2, with the processor to compute. Fails with the name NoWebGPU,
 * NoAdapter or NoDevice where there is neither.
 */
export async function openOn<T>(canvases: Canvases, start: (opened: OpenedOn) => Promise<T>): Promise<T> {
  try {
    const adapter = findAdapter();
    // Downloaded meanwhile, but not where it is of no use.
    const module = navigator.gpu ? compile(WEBGPU.wasm) : adapter.then(() => compile(WEBGPU.wasm));
    const [found, compiled] = await Promise.all([adapter, module]);
    const canvas = canvases.canvas();
    return await start({ artifact: WEBGPU, module: compiled, canvas, adapter: found, lack: null });
  } catch (error) {
    const lack = lackOf(error);
    if (!lack || !hasWebGl2()) throw error;
    const { WEBGL } = await import("./webgl");
    try {
      const module = await compile(WEBGL.wasm);
      const canvas = canvases.freshCanvas();
      return await start({ artifact: WEBGL, module, canvas, adapter: "WebGL2", lack });
    } catch (other) {
      // A WebGL2 that does not do what it promised is none: what helps is WebGPU.
      const isNone = lackOf(other) || (other instanceof Error && other.name === "Canvas");
      throw isNone ? error : other;
    }
  }
}
