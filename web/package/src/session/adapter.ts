/** Finds the GPU that the browser offers, without loading the wasm module. */

import type { WebGpuFault } from "../contract";
import { named } from "./client";

/**
 * Returns the name of the GPU that the browser would use; empty if the browser hides it. Throws an error if there is no
 * GPU.
 */
export async function findAdapter(): Promise<string> {
  const { gpu } = navigator;
  if (!gpu) throw named("NoWebGPU", "this browser has no WebGPU");
  const adapter = await gpu.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) throw named("NoAdapter", "this browser found no GPU that it may use");
  const { description, vendor, architecture, device } = adapter.info;
  const words = description || [vendor, architecture || device].filter(Boolean).join(" ");
  return tidy(words);
}

/** Capitalises words, because browsers report GPU names in lower case. */
function tidy(words: string): string {
  return words.replace(/\b[a-z]/g, (letter) => letter.toUpperCase());
}

/** Why WebGPU is missing, according to an error's name; undefined for other errors. */
export function lackOf(error: unknown): WebGpuFault | undefined {
  const name = error instanceof Error ? error.name : "";
  return name === "NoWebGPU" || name === "NoAdapter" || name === "NoDevice" ? name : undefined;
}

/** Whether the GPU is emulated in software. Binding on the processor is then faster and does not block drawing. */
export function isSoftware(adapter: string): boolean {
  return /swiftshader|llvmpipe|lavapipe|software|basic render/i.test(adapter);
}

/** Whether the browser can draw with WebGL2. */
export function hasWebGl2(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  // Release the context: browsers limit their number.
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return context !== null;
}
