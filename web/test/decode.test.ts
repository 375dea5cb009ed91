import { decompress } from "@cagework/core/decode";
import { NodeIO } from "@gltf-transform/core";
import { describe, expect, it } from "vitest";
import { meshoptGlb } from "../e2e/models";

const GLB_HEADER = 12;
const CHUNK_HEADER = 8;

interface Json {
  buffers: { byteLength: number; uri?: string; extensions?: object }[];
  extensionsRequired?: string[];
}

/** A meshopt .gltf: streams in worm.bin, and a fallback buffer for programs without the decoder. */
async function twoBuffers(change: (json: Json) => void) {
  const bytes = await meshoptGlb();
  const start = GLB_HEADER + CHUNK_HEADER;
  const end = start + new DataView(bytes.buffer, bytes.byteOffset).getUint32(GLB_HEADER, true);
  const json: Json = JSON.parse(new TextDecoder().decode(bytes.subarray(start, end)));
  Object.assign(json.buffers[0] ?? {}, { uri: "worm.bin" });
  change(json);
  const streams = bytes.subarray(end + CHUNK_HEADER);
  const sibling = (path: string) => (path === "worm.bin" ? streams : undefined);
  return decompress("worm.gltf", new TextEncoder().encode(JSON.stringify(json)), sibling);
}

describe("meshopt files", () => {
  const cases: [string, (json: Json) => void][] = [
    ["marked as fallback", () => undefined],
    // Fallback data, as in the extension's sample file.
    ["that others read", (json) => delete json.extensionsRequired],
    ["without a mark", (json) => delete json.buffers[1]?.extensions],
    // A fallback buffer without a file.
    ["in a file that is not there", (json) => Object.assign(json.buffers[1] ?? {}, { uri: "fallback.bin" })],
  ];
  // A GLB allows one buffer: "GLB must have 0-1 buffers".
  it.each(cases)("open with a fallback buffer %s", async (_, change) => {
    const plain = await new NodeIO().readBinary(await twoBuffers(change));
    const [mesh] = plain.getRoot().listMeshes();
    const indices = mesh?.listPrimitives()[0]?.getIndices();
    expect(indices?.getCount()).toBe(3 * 2 * 40 * 32);
    expect(plain.getRoot().listBuffers()).toHaveLength(1);
  });
});
