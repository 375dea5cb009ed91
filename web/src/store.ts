/** What the browser keeps between visits: the project of the moment, in IndexedDB, the theme, and notices that were read. Nothing leaves it. */

import type { Crash } from "./crash";

const DATABASE = "cagework";
const TABLE = "projects";
const KEY = "autosave";
const THEME = "cagework.theme";
const SEEN = "cagework.seen.";

export interface Saved {
  /** The project file, a GLB. */
  bytes: Uint8Array;
  name: string;
  /** Milliseconds since 1970. */
  when: number;
}

function open(): Promise<IDBDatabase> {
  return new Promise((resolve, reject) => {
    const request = indexedDB.open(DATABASE, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(TABLE);
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

async function run<T>(mode: IDBTransactionMode, work: (table: IDBObjectStore) => IDBRequest<T>): Promise<T> {
  const database = await open();
  try {
    return await new Promise<T>((resolve, reject) => {
      const transaction = database.transaction(TABLE, mode);
      const request = work(transaction.objectStore(TABLE));
      transaction.oncomplete = () => resolve(request.result);
      transaction.onabort = () => reject(transaction.error);
      transaction.onerror = () => reject(transaction.error);
    });
  } finally {
    database.close();
  }
}

/** Keeps a project, in place of the one before. */
export async function saveLocally(saved: Saved): Promise<void> {
  await run("readwrite", (table) => table.put(saved, KEY));
}

/** The project kept, if any. */
export async function loadLocally(): Promise<Saved | undefined> {
  const found: unknown = await run("readonly", (table) => table.get(KEY));
  return isSaved(found) ? found : undefined;
}

/** Whether there is one. */
export async function hasLocally(): Promise<boolean> {
  try {
    return (await run("readonly", (table) => table.count(KEY))) > 0;
  } catch {
    // Storage is forbidden: nothing was kept.
    return false;
  }
}

/** Forgets it. */
export async function forgetLocally(): Promise<void> {
  await run("readwrite", (table) => table.delete(KEY));
}

function isSaved(value: unknown): value is Saved {
  if (typeof value !== "object" || value === null) return false;
  const saved = value as Partial<Saved>;
  return (
    saved.bytes instanceof Uint8Array && typeof saved.name === "string" && typeof saved.when === "number"
  );
}

const CRASH = "cagework.crash";

/** Keeps what happened for the page that comes after in this tab; whether that was possible. */
export function keepCrash(crash: Crash): boolean {
  try {
    sessionStorage.setItem(CRASH, JSON.stringify(crash));
    return true;
  } catch {
    return false;
  }
}

/** What happened to the page before in this tab. */
export function lastCrash(): Crash | undefined {
  try {
    const { during, report } = JSON.parse(sessionStorage.getItem(CRASH) ?? "{}");
    return typeof during === "string" && typeof report === "string" ? { during, report } : undefined;
  } catch {
    return undefined;
  }
}

export function forgetCrash(): void {
  try {
    sessionStorage.removeItem(CRASH);
  } catch {
    // Storage is forbidden: nothing was kept.
  }
}

export type Theme = "auto" | "light" | "dark";

/** The theme chosen last. */
export function loadTheme(): Theme {
  const theme = readItem(THEME);
  return theme === "light" || theme === "dark" ? theme : "auto";
}

export function saveTheme(theme: Theme): void {
  writeItem(THEME, theme);
}

/** Whether a notice has been read and closed. */
export function hasSeen(notice: string): boolean {
  return readItem(SEEN + notice) !== null;
}

export function markSeen(notice: string): void {
  writeItem(SEEN + notice, "yes");
}

function writeItem(key: string, value: string): void {
  try {
    localStorage.setItem(key, value);
  } catch {
    // Storage is forbidden or full: it holds until the page is closed.
  }
}

function readItem(key: string): string | null {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}
