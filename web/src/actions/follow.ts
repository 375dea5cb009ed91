/** Updates the view and binds again after the rest cage has changed. */

import { effect, untracked } from "@preact/signals";
import { optionsInUse } from "../derived";
import type { BindActions } from "./bind";
import type { CageActions } from "./cage";
import type { Context } from "./context";
import type { Edit } from "./edit";
import type { Pulling } from "./pull";
import type { View } from "./view";

/** Pause after the last change before binding, ms. */
const PAUSE_MS = 150;
/** Largest number of cells along the cage's longest side with which the page binds automatically. */
const FINEST = 128;

export interface Followers {
  bind: Pick<BindActions, "covers" | "start">;
  edit: Pick<Edit, "active">;
  view: Pick<View, "refresh">;
  pull: Pick<Pulling, "prepare">;
}

/** Previews the cage while its settings change. */
export function followSettings({ store }: Context, cage: Pick<CageActions, "preview">): void {
  effect(() => {
    const { step, cage: current, cageProgress, cageMade, editingRest } = store.get();
    const { cageSource, cageOptions, cageClip, boxDivisions } = store.get();
    // Reading these keys subscribes to their changes.
    const all = [step, cageProgress, cageMade, editingRest, cageSource, cageOptions, cageClip, boxDivisions];
    if (current && all.length > 0) untracked(() => void cage.preview());
  });
}

export function followCage({ store }: Context, { bind, edit, view, pull }: Followers): void {
  let soon: ReturnType<typeof setTimeout> | undefined;
  const bindSoon = (pause: number) => {
    clearTimeout(soon);
    soon = setTimeout(() => {
      const { cage } = store.get();
      const options = optionsInUse(store.get());
      // Wait for the end of a gesture in progress. If it changes nothing, its end does not start a bind.
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
    // Wait for the last pass of the bind, which preparing pulls would slow down.
    if (cage && bound && bindRun === null) untracked(() => pull.prepare());
  });
  effect(() => {
    if (!store.get().editingRest) untracked(() => store.get().cage && bindSoon(0));
  });
}
