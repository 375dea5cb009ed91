/** The store of the page's state: a signal a key. */

import { batch, signal } from "@preact/signals";
import type { AppState } from "./state";

export interface Store {
  /** The state of the moment; a panel or an effect that reads a key hears of its changes. */
  get(): AppState;
  /** Changes some keys at once. */
  set(patch: Partial<AppState>): void;
}

/** A store with a signal a key. */
export function createStore(initial: AppState): Store {
  const entries = Object.entries(initial).map(([key, value]) => [key, signal<unknown>(value)] as const);
  const signals = new Map(entries);
  const state = Object.defineProperties(
    {},
    Object.fromEntries(entries.map(([key, own]) => [key, { enumerable: true, get: () => own.value }])),
  ) as AppState;
  return {
    get: () => state,
    set: (patch) =>
      batch(() => {
        for (const [key, value] of Object.entries(patch)) {
          const own = signals.get(key);
          if (own) own.value = value;
        }
      }),
  };
}
