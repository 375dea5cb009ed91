/** Which tab has which work open: Web Locks, which a tab that is closed or has crashed gives back by itself. */

const PREFIX = "cagework.work.";
const OWN = "cagework.work";
/** A tab that is loaded again may still hold, ms, what it had open. */
const PATIENCE_MS = 1000;

/** Holds work for this tab until the returned function is called; undefined when another tab has it. */
export function hold(id: string): Promise<(() => void) | undefined> {
  const { locks } = navigator;
  // Plain HTTP has no locks: nobody can tell.
  if (!locks) return Promise.resolve(() => undefined);
  return new Promise((resolve) => {
    const held = () => new Promise<void>((release) => resolve(release));
    const signal = AbortSignal.timeout(PATIENCE_MS);
    locks.request(PREFIX + id, { signal }, held).catch(() => resolve(undefined));
  });
}

/** What any tab holds. */
export async function heldIds(): Promise<ReadonlySet<string>> {
  const held = (await navigator.locks?.query())?.held ?? [];
  const names = held.flatMap(({ name }) => (name?.startsWith(PREFIX) ? [name.slice(PREFIX.length)] : []));
  return new Set(names);
}

/** Remembers across reloads what this tab has open. */
export function rememberOwn(id: string | null): void {
  try {
    if (id === null) sessionStorage.removeItem(OWN);
    else sessionStorage.setItem(OWN, id);
  } catch {
    // Storage is forbidden: nothing is kept either.
  }
}

/** What this tab had open. */
export function ownId(): string | null {
  try {
    return sessionStorage.getItem(OWN);
  } catch {
    return null;
  }
}
