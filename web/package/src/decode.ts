/** Decompresses glTF files with Draco or meshopt compression. Downloaded when the first such file is opened. */

import { type Document, WebIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS, EXTMeshoptCompression, KHRDracoMeshCompression } from "@gltf-transform/extensions";
import { dequantize, unpartition } from "@gltf-transform/functions";
import dracoWasm from "draco3dgltf/draco_decoder_gltf.wasm?url";
import createDecoder from "draco3dgltf/draco_decoder_gltf_nodejs.js";
import { MeshoptDecoder } from "meshoptimizer/decoder";
import { named } from "./session/client";
import { fetchPart } from "./session/parts";

const GLB = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
/** Deviation from 1 up to which the sum of a vertex's weights is attributed to rounding and is not corrected. */
const SUM_TOLERANCE = 1e-6;

/** Decompresses a GLB or glTF to a plain GLB. */
export async function decompress(
  name: string,
  bytes: Uint8Array,
  sibling: (path: string) => Uint8Array | undefined,
): Promise<Uint8Array> {
  await MeshoptDecoder.ready;
  const io = new WebIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
    "meshopt.decoder": MeshoptDecoder,
    ...(mentions(bytes, "KHR_draco_mesh_compression") ? { "draco3d.decoder": await openDraco() } : {}),
  });
  try {
    const document = await readDocument(io, renamed(bytes), sibling);
    // Merge the buffers, because a GLB has only one. Files with meshopt compression have a second one for fallback
    // data.
    await document.transform(dequantize(), unpartition());
    normaliseWeights(document);
    for (const extension of document.getRoot().listExtensionsUsed()) {
      const { extensionName } = extension;
      if ([KHRDracoMeshCompression, EXTMeshoptCompression].some((e) => e.EXTENSION_NAME === extensionName)) {
        extension.dispose();
      }
    }
    return await io.writeBinary(document);
  } catch (error) {
    const reason = error instanceof Error ? error.message : String(error);
    throw named("Damaged", `${name} is compressed, and its geometry could not be decoded: ${reason}`);
  }
}

/**
 * Repairs weights of skins that were quantised: scales each vertex's weights to sum to 1. Also sets the joint indices
 * of zero weights to 0, as the glTF specification recommends.
 */
function normaliseWeights(document: Document): void {
  for (const primitive of document
    .getRoot()
    .listMeshes()
    .flatMap((mesh) => mesh.listPrimitives())) {
    const sets = primitive.listSemantics().filter((name) => name.startsWith("WEIGHTS_"));
    const all = sets.flatMap((name) => primitive.getAttribute(name) ?? []);
    for (let v = 0; v < (all[0]?.getCount() ?? 0); v += 1) {
      const weights = all.map((set) => set.getElement(v, []));
      const sum = weights.flat().reduce((a, b) => a + b, 0);
      if (!(sum > 0) || Math.abs(sum - 1) <= SUM_TOLERANCE) continue;
      for (const [k, set] of all.entries()) {
        set.setElement(v, weights[k]?.map((weight) => weight / sum) ?? []);
      }
    }
    for (const [k, set] of all.entries()) {
      const joints = primitive.getAttribute(sets[k]?.replace("WEIGHTS", "JOINTS") ?? "");
      for (let v = 0; joints && v < set.getCount(); v += 1) {
        const weights = set.getElement(v, []);
        joints.setElement(
          v,
          joints.getElement(v, []).map((joint, c) => (weights[c] ? joint : 0)),
        );
      }
    }
  }
}

async function openDraco(): Promise<unknown> {
  const wasmBinary = await fetchPart(dracoWasm, (response) => response.arrayBuffer());
  return createDecoder({ wasmBinary });
}

async function readDocument(
  io: WebIO,
  bytes: Uint8Array,
  sibling: (path: string) => Uint8Array | undefined,
): Promise<Document> {
  if (new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true) === GLB) return io.readBinary(bytes);
  const json = JSON.parse(new TextDecoder().decode(bytes));
  const resources: Record<string, Uint8Array<ArrayBuffer>> = {};
  for (const { uri } of [...(json.buffers ?? []), ...(json.images ?? [])]) {
    const found = typeof uri === "string" ? sibling(decodeURIComponent(uri)) : undefined;
    if (found) resources[uri] = new Uint8Array(found);
  }
  return io.readJSON({ json, resources });
}

function mentions(bytes: Uint8Array, word: string): boolean {
  const head = jsonRange(bytes);
  return new TextDecoder().decode(bytes.subarray(...head)).includes(word);
}

/** Finds the byte range of the JSON in a GLB or glTF file. */
function jsonRange(bytes: Uint8Array): [number, number] {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const isGlb =
    bytes.length > 20 && view.getUint32(0, true) === GLB && view.getUint32(16, true) === JSON_CHUNK;
  return isGlb ? [20, 20 + view.getUint32(12, true)] : [0, bytes.length];
}

/**
 * Renames KHR_meshopt_compression to EXT_meshopt_compression, the only name that the library knows. Both names have the
 * same length and the streams are the same.
 */
function renamed(bytes: Uint8Array): Uint8Array<ArrayBuffer> {
  const copy = new Uint8Array(bytes);
  const [from, to] = jsonRange(copy);
  const text = new TextDecoder("latin1").decode(copy.subarray(from, to));
  const old = new TextEncoder().encode("EXT_meshopt_compression");
  for (let at = text.indexOf("KHR_meshopt_compression"); at >= 0; ) {
    copy.set(old, from + at);
    at = text.indexOf("KHR_meshopt_compression", at + 1);
  }
  return copy;
}
