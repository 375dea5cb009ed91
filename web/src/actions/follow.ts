/** What follows when the cage at rest has changed: the page looks again, and the model is bound again. */

import { effect, untracked } from "@preact/signals";
import { optionsInUse } from "../derived";
import type { BindActions } from "./bind";
import type { Context } from "./context";
import type { Edit } from "./edit";
import type { Pulling } from "./pull";
import type { View } from "./view";

/** A hand that has not moved the cage for so long rests, ms. */
const PAUSE_MS = 150;
/** A finer grid waits for the user's word. */
const FINEST = 128;

export interface Followers {
  bind: Pick<BindActions, "covers" | "start">;
  edit: Pick<Edit, "active">;
  view: Pick<View, "refresh">;
  pull: Pick<Pulling, "prepare">;
}

export function followCage({ store }: Context, { bind, edit, view, pull }: Followers): void {
  let soon: ReturnType<typeof setTimeout> | undefined;
  const bindSoon = (pause: number) => {
    clearTimeout(soon);
    soon = setTimeout(() => {
      const { cage } = store.get();
      const options = optionsInUse(store.get());
      // A gesture may end without a change, and then nobody else would ask for the bind.
      if (edit.active()) bindSoon(PAUSE_MS);
      else if (cage?.usable && !bind.covers() && options.grid <= FINEST) void bind.start(true, options);
    }, pause);
  };
  let isFirst = true;
  effect(() => {
    store.get().cage;
    if (!isFirst) {
      untracked(() => {
        view.refresh();
        bindSoon(PAUSE_MS);
      });
    }
    isFirst = false;
  });
  effect(() => {
    const { bound, bindRun, cage } = store.get();
    // After the last pass: the worker that solves pulls would take time from it.
    if (cage && bound && bindRun === null) untracked(() => pull.prepare());
  });
  effect(() => {
    if (!store.get().editingRest) untracked(() => store.get().cage && bindSoon(0));
  });
}
