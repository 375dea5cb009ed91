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

/** The open connection. It stays open, so that a page that is being left can write without waiting for it. */
let connection: Promise<IDBDatabase> | undefined;
let connected: IDBDatabase | undefined;

function connect(): Promise<IDBDatabase> {
  const forget = () => {
    connection = undefined;
    connected = undefined;
  };
  connection ??= open().then((database) => {
    connected = database;
    database.onclose = forget;
    // Another tab deletes or upgrades the database.
    database.onversionchange = () => {
      database.close();
      forget();
    };
    return database;
  });
  connection.catch(forget);
  return connection;
}

async function run<T>(
  mode: IDBTransactionMode,
  work: (entries: IDBObjectStore, files: IDBObjectStore) => IDBRequest<T>,
): Promise<T> {
  const database = await connect();
  return await new Promise<T>((resolve, reject) => {
    const transaction = database.transaction([ENTRIES, FILES], mode);
    const request = work(transaction.objectStore(ENTRIES), transaction.objectStore(FILES));
    // Otherwise the browser drops what is not complete when the page is left.
    if (mode === "readwrite") transaction.commit();
    transaction.oncomplete = () => resolve(request.result);
    transaction.onabort = () => reject(transaction.error);
    transaction.onerror = () => reject(transaction.error);
  });
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

/**
 * Writes an entry and its project file while the page is being left. The browser completes a transaction that is
 * committed, also after the page is gone. Does nothing if the database is not open.
 */
export function writeLast(entry: Entry, file: Blob): void {
  const transaction = connected?.transaction([ENTRIES, FILES], "readwrite");
  transaction?.objectStore(FILES).put(file, entry.id);
  transaction?.objectStore(ENTRIES).put(entry, entry.id);
  transaction?.commit();
}

export async function deleteEntry(id: string): Promise<void> {
  await run("readwrite", (entries, files) => {
    files.delete(id);
    return entries.delete(id);
  });
}
