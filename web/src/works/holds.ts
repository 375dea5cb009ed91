/**
 * Web Locks for saved work, so that one tab at a time has it open. The browser releases a lock when its tab closes or
 * crashes.
 */

import { tryStorage } from "../store";

const PREFIX = "cagework.work.";
const OWN_KEY = "cagework.work";
const CHANGED_KEY = "cagework.changed";
/** Time to wait for a lock, ms. After a reload, the previous page may still hold it. */
const PATIENCE_MS = 1000;

/** Locks work for this tab until the returned function is called; undefined if another tab holds the lock. */
export function hold(id: string): Promise<(() => void) | undefined> {
  const { locks } = navigator;
  // Pages served over plain HTTP have no locks: treat the work as free.
  if (!locks) return Promise.resolve(() => undefined);
  return new Promise((resolve) => {
    const held = () => new Promise<void>((release) => resolve(release));
    const signal = AbortSignal.timeout(PATIENCE_MS);
    locks.request(PREFIX + id, { signal }, held).catch(() => resolve(undefined));
  });
}

/** Returns the ids of the works that are open in any tab. */
export async function heldIds(): Promise<ReadonlySet<string>> {
  const held = (await navigator.locks?.query())?.held ?? [];
  const names = held.flatMap(({ name }) => (name?.startsWith(PREFIX) ? [name.slice(PREFIX.length)] : []));
  return new Set(names);
}

/** Remembers, across reloads, which work this tab has open. */
export function rememberOwn(id: string | null): void {
  tryStorage(() => {
    if (id === null) sessionStorage.removeItem(OWN_KEY);
    else sessionStorage.setItem(OWN_KEY, id);
  });
}

/** Reads the id stored by `rememberOwn`. */
export function ownId(): string | null {
  return tryStorage(() => sessionStorage.getItem(OWN_KEY)) ?? null;
}

/** Stores the time of the last change in this tab, ms since 1970. */
export function rememberChange(when: number): void {
  tryStorage(() => sessionStorage.setItem(CHANGED_KEY, String(when)));
}

/** Reads the time stored by `rememberChange`; 0 without one. */
export function changedAt(): number {
  return Number(tryStorage(() => sessionStorage.getItem(CHANGED_KEY)) ?? 0);
}
