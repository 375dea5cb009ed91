/** Dropped files to bytes: which one is the model, and where its siblings are. */

import type { NamedFile, UpAxis } from "../contract";
import { extension, isModel } from "../drop";
import type { Loaded } from "../pkg/cagework";
import type { Package } from "./artifact";
import { named } from "./client";
import { decodeTextures } from "./textures";

/** Larger files are refused, bytes: the browser's memory for them would be several times as much. */
const LARGEST = 1 << 30;

export interface Bytes {
  readonly name: string;
  readonly bytes: Uint8Array;
  readonly sibling: (path: string) => Uint8Array | undefined;
  /** What points up in it, if that is not what the file says. */
  readonly up?: UpAxis;
}

/** The model's bytes and those of its siblings. */
export async function readFiles(files: readonly NamedFile[]): Promise<Bytes> {
  const main = files.find(({ name }) => isModel(name)) ?? files[0];
  if (!main) throw named("Empty", "there is no file to open");
  const bytes = await read(main);
  const siblings = new Map<string, Uint8Array>();
  if (extension(main.name) === "gltf") {
    const folder = main.path.slice(0, main.path.lastIndexOf("/") + 1);
    for (const file of files.filter((file) => file !== main)) {
      const content = await read(file);
      siblings.set(file.name, content);
      if (file.path.startsWith(folder)) siblings.set(file.path.slice(folder.length), content);
    }
  }
  const sibling = (path: string) => {
    const plain = path.replace(/^(\.\/)+/, "");
    return siblings.get(plain) ?? siblings.get(plain.slice(plain.lastIndexOf("/") + 1));
  };
  return { name: main.name, bytes, sibling };
}

async function read({ name, file }: NamedFile): Promise<Uint8Array> {
  if (file.size > LARGEST) {
    const size = (file.size / LARGEST).toFixed(1);
    throw named(
      "TooLarge",
      `${name} has ${size} GiB; files of up to 1 GiB are opened: make it smaller first`,
    );
  }
  try {
    return new Uint8Array(await file.arrayBuffer());
  } catch {
    throw named(
      "Unreadable",
      `${name} could not be read: it may have been moved, or is too large for this browser`,
    );
  }
}

/** A model that was read, and what the page should say about it. */
export interface Read {
  readonly loaded: Loaded;
  readonly notices: readonly string[];
}

/** Events and frames that wait have their turn. */
const pause = () => new Promise((resolve) => setTimeout(resolve));

/** Reads a model, decompressed if need be, its textures decoded. */
export async function load(pkg: Package, { name, bytes, sibling, up }: Bytes): Promise<Read> {
  let loaded: Loaded;
  try {
    loaded = pkg.Loaded.read(name, bytes, sibling);
  } catch (error) {
    if (!(error instanceof Error) || error.name !== "Compressed") throw error;
    const { decompress } = await import("../decode");
    loaded = pkg.Loaded.read(name, await decompress(name, bytes, sibling), sibling);
  }
  if (up) loaded.setUp(up);
  await pause();
  loaded.prepare();
  const failed = await decodeTextures(loaded);
  const many = failed === 1 ? "a texture" : `${failed} textures`;
  const notice = `this browser cannot decode ${many}: the material's plain colour is shown, exports keep the file`;
  return { loaded, notices: failed > 0 ? [notice] : [] };
}
