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

/**
 * Writes a meshopt .gltf with two buffers: compressed data in worm.bin, and a fallback for programs without the
 * decoder.
 */
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
    // The extension is optional, as in the extension's sample file: programs without it read the fallback buffer.
    ["that others read", (json) => delete json.extensionsRequired],
    ["without a mark", (json) => delete json.buffers[1]?.extensions],
    // The fallback buffer names a file that does not exist.
    ["in a file that is not there", (json) => Object.assign(json.buffers[1] ?? {}, { uri: "fallback.bin" })],
  ];
  // The rewritten file is a GLB, which allows at most one buffer.
  it.each(cases)("open with a fallback buffer %s", async (_, change) => {
    const plain = await new NodeIO().readBinary(await twoBuffers(change));
    const [mesh] = plain.getRoot().listMeshes();
    const indices = mesh?.listPrimitives()[0]?.getIndices();
    expect(indices?.getCount()).toBe(3 * 2 * 40 * 32);
    expect(plain.getRoot().listBuffers()).toHaveLength(1);
  });
});
