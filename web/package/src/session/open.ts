/** Chooses between WebGPU and WebGL2, and loads the build of the module for it. */

import type { WebGpuFault } from "../contract";
import { findAdapter, hasWebGl2, lackOf } from "./adapter";
import { type Artifact, compile } from "./artifact";
import { loadPart } from "./parts";
import { WEBGPU } from "./webgpu";

/** Canvases to draw on. A canvas that was used with one graphics API cannot be used with the other. */
export interface Canvases {
  canvas(): HTMLCanvasElement;
  freshCanvas(): HTMLCanvasElement;
}

/** The build, canvas and GPU that were opened. */
export interface OpenResult {
  readonly artifact: Artifact;
  readonly module: WebAssembly.Module;
  readonly canvas: HTMLCanvasElement;
  /** Name of the GPU; "WebGL2" without WebGPU. */
  readonly adapter: string;
  /** Why WebGL2 is used; null with WebGPU. */
  readonly lack: WebGpuFault | null;
}

/**
 * Calls `start` with WebGPU, or if that is missing, with WebGL2 and the processor. Throws an error named NoWebGPU,
 * NoAdapter or NoDevice if both are missing.
 */
export async function openOn<T>(canvases: Canvases, start: (opened: OpenResult) => Promise<T>): Promise<T> {
  try {
    // Without an adapter, the other build is needed instead: do not download both.
    const adapter = await findAdapter();
    const module = await compile(WEBGPU.wasm);
    return await start({ artifact: WEBGPU, module, canvas: canvases.canvas(), adapter, lack: null });
  } catch (error) {
    const lack = lackOf(error);
    if (!lack || !hasWebGl2()) throw error;
    const { WEBGL } = await loadPart(import("./webgl"));
    try {
      const module = await compile(WEBGL.wasm);
      const canvas = canvases.freshCanvas();
      return await start({ artifact: WEBGL, module, canvas, adapter: "WebGL2", lack });
    } catch (other) {
      // WebGL2 failed as well. Report the missing WebGPU, which is easier to fix.
      const isNone = lackOf(other) || (other instanceof Error && other.name === "Canvas");
      throw isNone ? error : other;
    }
  }
}
