/** The GPU, before anything is downloaded for it. */

import type { Lack } from "../contract";
import { named } from "./client";

/** Name of the GPU that the browser would use. */
export async function findAdapter(): Promise<string> {
  const { gpu } = navigator;
  if (!gpu) throw named("NoWebGPU", "this browser has no WebGPU");
  const adapter = await gpu.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) throw named("NoAdapter", "this browser found no GPU that it may use");
  const { description, vendor, architecture, device } = adapter.info;
  const words = description || [vendor, architecture || device].filter(Boolean).join(" ");
  return words ? tidy(words) : "this GPU";
}

/** Names as people write them: browsers report them in lower case. */
function tidy(words: string): string {
  return words.replace(/\b[a-z]/g, (letter) => letter.toUpperCase());
}

/** What an error says is missing; undefined for errors of another kind. */
export function lackOf(error: unknown): Lack | undefined {
  const name = error instanceof Error ? error.name : "";
  return name === "NoWebGPU" || name === "NoAdapter" || name === "NoDevice" ? name : undefined;
}

/** Whether a GPU is made of processor cores: then the processor itself binds faster, and drawing does not wait for it. */
export function isSoftware(adapter: string): boolean {
  return /swiftshader|llvmpipe|lavapipe|software|basic render/i.test(adapter);
}

/** Whether this browser can at least draw. */
export function hasWebGl2(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  // Browsers allow a few contexts at a time: this one was only a question.
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return context !== null;
}
