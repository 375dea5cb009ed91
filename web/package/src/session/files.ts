/** Reads files that are opened together: finds the model, and its siblings, the other files that it may refer to. */

import type { NamedFile } from "../contract";
import { NAMING_ENDINGS } from "../contract/generated";
import { extension, isModel } from "../names";
import type { FileBytes } from "../pkg/cagework";
import type { Package } from "./artifact";
import { named } from "./client";

/** Maximum size of a file, bytes. Opening a file takes several times its size in memory. */
const MAX_FILE_BYTES = 1 << 30;

/** Number of bytes that are read at a time. */
const CHUNK = 1 << 23;

export interface Bytes {
  readonly name: string;
  readonly content: Blob;
  /** Functions that read the siblings, by name and by path relative to the model's folder. */
  readonly siblings: ReadonlyMap<string, () => Uint8Array>;
}

/** Returns a function that finds a sibling by the path in the model's file, or else by the file name in that path. */
export function siblingOf(siblings: Bytes["siblings"]): (path: string) => Uint8Array | undefined {
  return (path) => {
    const plain = path.replace(/^(\.\/)+/, "");
    return (siblings.get(plain) ?? siblings.get(plain.slice(plain.lastIndexOf("/") + 1)))?.();
  };
}

export async function readFiles(files: readonly NamedFile[]): Promise<Bytes> {
  const main = files.find(({ name }) => isModel(name)) ?? files[0];
  if (!main) throw named("Empty", "there is no file to open");
  const siblings = new Map<string, () => Uint8Array>();
  if ((NAMING_ENDINGS as readonly string[]).includes(extension(main.name))) {
    const folder = main.path.slice(0, main.path.lastIndexOf("/") + 1);
    for (const file of files.filter((file) => file !== main)) {
      const content = await reader(file);
      siblings.set(file.name, content);
      if (file.path.startsWith(folder)) siblings.set(file.path.slice(folder.length), content);
    }
  }
  return { name: main.name, content: main.file, siblings };
}

/**
 * Returns a function that reads a file. In a browser's worker it reads when it is called, because a model may not use
 * all files that were dropped with it. Node has no synchronous read of a Blob, and the bytes of its files are in memory.
 */
async function reader({ name, file }: NamedFile): Promise<() => Uint8Array> {
  if (typeof FileReaderSync === "undefined") {
    const content = await read(name, file);
    return () => content;
  }
  return () => new Uint8Array(new FileReaderSync().readAsArrayBuffer(file));
}

/** Creates an error for the first file above the size limit; undefined if there is none. */
export function tooLarge(files: readonly NamedFile[]): Error | undefined {
  const large = files.find(({ file }) => file.size > MAX_FILE_BYTES);
  const size = ((large?.file.size ?? 0) / MAX_FILE_BYTES).toFixed(1);
  const message = `${large?.name} has ${size} GiB; the limit is 1 GiB: make it smaller first`;
  return large && named("TooLarge", message);
}

/** Copies a file into wasm memory, in chunks. `tell` is called with the fraction done. */
export async function toWasm(
  pkg: Package,
  name: string,
  file: Blob,
  tell: (share: number) => void = () => {},
): Promise<FileBytes> {
  const bytes = new pkg.FileBytes(file.size);
  for (let at = 0; at < file.size; at += CHUNK) {
    tell(at / file.size);
    bytes.push(await read(name, file.slice(at, at + CHUNK)));
  }
  return bytes;
}

export async function read(name: string, file: Blob): Promise<Uint8Array> {
  try {
    return new Uint8Array(await file.arrayBuffer());
  } catch {
    throw named(
      "Unreadable",
      `${name} could not be read: it may have been moved, or is too large for this browser`,
    );
  }
}
