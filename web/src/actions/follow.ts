/** Follows changes of the cage: updates the view and previews, binds again, and prepares pulls and splats. */

import { effect, untracked } from "@preact/signals";
import { isCapture, optionsInUse } from "../derived";
import { follow } from "../queue";
import { T } from "../words";
import type { BindActions } from "./bind";
import type { CageActions } from "./cage";
import { attemptLatest, type Context } from "./context";
import type { Edit } from "./edit";
import type { Pulling } from "./pull";
import type { View } from "./view";

/** Pause after the last change before binding, ms. */
const PAUSE_MS = 150;
/** Maximum number of cells along the cage's longest side with which the page binds automatically. */
const MAX_AUTOMATIC_GRID = 128;

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

export function followCage(ctx: Context, { bind, edit, view, pull }: Followers): void {
  const { store } = ctx;
  let soon: ReturnType<typeof setTimeout> | undefined;
  const bindSoon = (pause: number) => {
    clearTimeout(soon);
    soon = setTimeout(() => {
      const { cage } = store.get();
      const options = optionsInUse(store.get());
      // During a gesture, try again after a pause. If the gesture changes nothing, its end does not call `bindSoon`.
      if (edit.active()) bindSoon(PAUSE_MS);
      else if (cage?.usable && !bind.covers() && options.grid <= MAX_AUTOMATIC_GRID)
        void bind.start(true, options);
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
    const { model, bound, bindRun, lattice } = store.get();
    // Splats follow the cage by the deformation field of a lattice, which is bound after the model.
    if (isCapture(model) && bound && bindRun === null && !lattice) untracked(() => void followSplats(ctx));
  });
  effect(() => {
    if (!store.get().editingRest) untracked(() => store.get().cage && bindSoon(0));
  });
}

/** Computes the lattice by which the splats follow the cage. */
async function followSplats(ctx: Context): Promise<void> {
  const { grid } = ctx.store.get().bindOptions;
  const load = (signal: AbortSignal) => follow(signal, ctx.session().loadLattice(grid));
  await attemptLatest(ctx, T.failed.bind, "lattice", load);
}
