/** Work saved in IndexedDB. Entries and project files are in separate stores, so that listing entries reads no file. */

import { type Entry, isEntry, isWhole } from "./entry";

const DATABASE = "cagework";
const VERSION = 2;
const ENTRIES = "entries";
const FILES = "projects";

/** Creates an id. `randomUUID` does not exist on pages served over plain HTTP. */
export function newId(): string {
  return crypto.randomUUID?.() ?? Array.from(crypto.getRandomValues(new Uint32Array(4))).join("-");
}

function open(): Promise<IDBDatabase> {
  return new Promise((resolve, reject) => {
    const request = indexedDB.open(DATABASE, VERSION);
    request.onupgradeneeded = () => {
      const { result } = request;
      for (const table of [ENTRIES, FILES])
        if (!result.objectStoreNames.contains(table)) result.createObjectStore(table);
    };
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

async function run<T>(
  mode: IDBTransactionMode,
  work: (entries: IDBObjectStore, files: IDBObjectStore) => IDBRequest<T>,
): Promise<T> {
  const database = await open();
  try {
    return await new Promise<T>((resolve, reject) => {
      const transaction = database.transaction([ENTRIES, FILES], mode);
      const request = work(transaction.objectStore(ENTRIES), transaction.objectStore(FILES));
      transaction.oncomplete = () => resolve(request.result);
      transaction.onabort = () => reject(transaction.error);
      transaction.onerror = () => reject(transaction.error);
    });
  } finally {
    database.close();
  }
}

/** Whether any work is saved. False if the browser forbids storage. */
export async function hasEntries(): Promise<boolean> {
  return (await run("readonly", (entries) => entries.count()).catch(() => 0)) > 0;
}

/** Reads all valid entries. Invalid ones are deleted; `damaged` counts them. */
export async function readEntries(): Promise<{ entries: Entry[]; damaged: number }> {
  let names: IDBRequest<IDBValidKey[]> | undefined;
  const values: unknown[] = await run("readonly", (entries) => {
    names = entries.getAllKeys();
    return entries.getAll();
  });
  const keys = (names?.result ?? []).map(String);
  const isGood = (value: unknown, k: number): value is Entry => isEntry(value) && value.id === keys[k];
  const damaged = keys.filter((_, k) => !isGood(values[k], k));
  for (const key of damaged) await deleteEntry(key);
  return { entries: values.filter(isGood), damaged: damaged.length };
}

/** Reads the project file of an entry; undefined if it is missing or incomplete. */
export async function readFile(id: string): Promise<Blob | undefined> {
  const file: unknown = await run("readonly", (_, files) => files.get(id));
  return file instanceof Blob && (await isWhole(file)) ? file : undefined;
}

/**
 * Writes an entry and its project file, replacing those with the same id. Without `file`, leaves the stored file. The
 * browser stores a Blob without a copy in the memory of the page.
 */
export async function writeEntry(entry: Entry, file?: Blob): Promise<void> {
  await run("readwrite", (entries, files) => {
    if (file) files.put(file, entry.id);
    return entries.put(entry, entry.id);
  });
}

export async function deleteEntry(id: string): Promise<void> {
  await run("readwrite", (entries, files) => {
    files.delete(id);
    return entries.delete(id);
  });
}
