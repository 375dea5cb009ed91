/** Converts FBX files to GLB. Downloaded when the first such file is opened. */

import { ConvertedFbx, initSync } from "./pkg-fbx/cagework_fbx";
import wasm from "./pkg-fbx/cagework_fbx_bg.wasm?url";
import { named } from "./session/client";
import { fetchPart } from "./session/parts";

/** Limit on the memory of a conversion, bytes: half of what a wasm module can address. */
const MEMORY_LIMIT = 2 ** 31;

let ready = false;

/** Converts an FBX file to a GLB. `notices`: what was not converted. */
export async function convert(
  name: string,
  bytes: Uint8Array,
): Promise<{ glb: Uint8Array; notices: string[] }> {
  if (!ready) {
    initSync({ module: await fetchPart(wasm, (response) => response.arrayBuffer()) });
    ready = true;
  }
  try {
    const converted = new ConvertedFbx(bytes, MEMORY_LIMIT);
    const { notices } = converted;
    const glb = converted.takeGlb();
    converted.free();
    return { glb, notices };
  } catch (error) {
    // A trap leaves the module in an unknown state, and is not about the file.
    if (!(error instanceof Error) || error instanceof WebAssembly.RuntimeError) throw error;
    throw named("Format", `${name}: ${error.message}`);
  }
}
