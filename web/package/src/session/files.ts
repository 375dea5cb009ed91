/** Reads dropped files: finds the model among them, and its siblings, the files that it may refer to. */

import type { NamedFile } from "../contract";
import { NAMING_ENDINGS } from "../contract/generated";
import { extension, isModel } from "../names";
import { named } from "./client";

/** Maximum size of a file, bytes. Opening a file takes several times its size in memory. */
const LARGEST = 1 << 30;

export interface Bytes {
  readonly name: string;
  readonly bytes: Uint8Array;
  /** The siblings, by name and by path relative to the model's folder. */
  readonly siblings: ReadonlyMap<string, Uint8Array>;
  /** The compressed original, if `bytes` were decompressed. */
  readonly packed?: Uint8Array;
}

/** Returns a function that finds a sibling by the path in the model's file, or else by the file name in that path. */
export function siblingOf(siblings: Bytes["siblings"]): (path: string) => Uint8Array | undefined {
  return (path) => {
    const plain = path.replace(/^(\.\/)+/, "");
    return siblings.get(plain) ?? siblings.get(plain.slice(plain.lastIndexOf("/") + 1));
  };
}

export async function readFiles(files: readonly NamedFile[]): Promise<Bytes> {
  const main = files.find(({ name }) => isModel(name)) ?? files[0];
  if (!main) throw named("Empty", "there is no file to open");
  const bytes = await read(main);
  const siblings = new Map<string, Uint8Array>();
  if ((NAMING_ENDINGS as readonly string[]).includes(extension(main.name))) {
    const folder = main.path.slice(0, main.path.lastIndexOf("/") + 1);
    for (const file of files.filter((file) => file !== main)) {
      const content = await read(file);
      siblings.set(file.name, content);
      if (file.path.startsWith(folder)) siblings.set(file.path.slice(folder.length), content);
    }
  }
  return { name: main.name, bytes, siblings };
}

/** The error for the first file above the size limit; undefined if there is none. */
export function tooLarge(files: readonly NamedFile[]): Error | undefined {
  const large = files.find(({ file }) => file.size > LARGEST);
  const size = ((large?.file.size ?? 0) / LARGEST).toFixed(1);
  const message = `${large?.name} has ${size} GiB; the limit is 1 GiB: make it smaller first`;
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
