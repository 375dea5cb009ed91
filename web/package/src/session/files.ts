/** Dropped files to bytes: which one is the model, and where its siblings are. */

import type { NamedFile } from "../contract";
import { extension, isModel } from "../names";
import { named } from "./client";

/** Files that name others: buffers and textures, or materials and theirs. */
const NAMING: readonly string[] = ["gltf", "obj"];

/** Larger files are refused, bytes: the browser's memory for them would be several times as much. */
const LARGEST = 1 << 30;

export interface Bytes {
  readonly name: string;
  readonly bytes: Uint8Array;
  /** What lies beside it, by name and by path from its folder. */
  readonly siblings: ReadonlyMap<string, Uint8Array>;
  /** The compressed file that the bytes were decoded from. */
  readonly packed?: Uint8Array;
}

/** Finds a sibling by the path that the model has for it. */
export function siblingOf(siblings: Bytes["siblings"]): (path: string) => Uint8Array | undefined {
  return (path) => {
    const plain = path.replace(/^(\.\/)+/, "");
    return siblings.get(plain) ?? siblings.get(plain.slice(plain.lastIndexOf("/") + 1));
  };
}

/** The model's bytes and those of its siblings. */
export async function readFiles(files: readonly NamedFile[]): Promise<Bytes> {
  const main = files.find(({ name }) => isModel(name)) ?? files[0];
  if (!main) throw named("Empty", "there is no file to open");
  const bytes = await read(main);
  const siblings = new Map<string, Uint8Array>();
  if (NAMING.includes(extension(main.name))) {
    const folder = main.path.slice(0, main.path.lastIndexOf("/") + 1);
    for (const file of files.filter((file) => file !== main)) {
      const content = await read(file);
      siblings.set(file.name, content);
      if (file.path.startsWith(folder)) siblings.set(file.path.slice(folder.length), content);
    }
  }
  return { name: main.name, bytes, siblings };
}

/** What is said of a file that is too large; undefined when none is. */
export function tooLarge(files: readonly NamedFile[]): Error | undefined {
  const large = files.find(({ file }) => file.size > LARGEST);
  const size = ((large?.file.size ?? 0) / LARGEST).toFixed(1);
  const message = `${large?.name} has ${size} GiB; files of up to 1 GiB are opened: make it smaller first`;
  return large && named("TooLarge", message);
}

async function read({ name, file }: NamedFile): Promise<Uint8Array> {
  try {
    return new Uint8Array(await file.arrayBuffer());
  } catch {
    throw named(
      "Unreadable",
      `${name} could not be read: it may have been moved, or is too large for this browser`,
    );
  }
}
