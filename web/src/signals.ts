/** Store of the page's state, with one signal per key. */

import { batch, signal } from "@preact/signals";
import type { AppState } from "./state";

export interface Store {
  /** The current state. Panels and effects that read a key are updated when the key's value changes. */
  get(): AppState;
  /** Changes several keys in one batch. */
  set(patch: Partial<AppState>): void;
}

/** Creates a store with one signal per key. */
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
