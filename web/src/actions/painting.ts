/** Paints how much each vertex of a model stays in place. */

import { effect, untracked } from "@preact/signals";
import type { Painting } from "../state";
import { T } from "../words";
import { type Context, report } from "./context";
import type { Edit } from "./edit";

/** Maximum distance between consecutive dabs of the brush along a stroke, CSS pixels. */
const DAB_PX = 6;
/** Initial radius of the brush, as a fraction of the model's size. */
const RADIUS = 0.05;
/** Values that the brush paints: vertices with 0 follow the cage completely, vertices with 255 stay in place. */
const [FOLLOWS, STAYS] = [0, 255];

/** `settle` ends playback and operations in progress. */
export function createPainting(ctx: Context, edit: Pick<Edit, "apply" | "settle">, settle: () => void) {
  const { store, engine } = ctx;
  /** Radius of the brush when painting starts again, as a fraction of the model's size. */
  let radius = RADIUS;
  let stroke: { readonly x: number; readonly y: number } | undefined;

  const dab = (x: number, y: number): boolean => {
    const { painting } = store.get();
    return painting !== null && engine().paint(x, y, painting.radius, painting.erase ? FOLLOWS : STAYS);
  };

  const actions = {
    /** Starts painting a model; null ends painting. */
    on(id: number | null) {
      actions.end(true);
      if (id !== null) settle();
      if ((store.get().painting?.id ?? null) === id) return;
      store.set({ painting: id === null ? null : { id, radius, erase: false }, boxArmed: false });
      engine().showPainting(id ?? undefined);
    },
    brush(patch: Partial<Omit<Painting, "id">>) {
      const { painting } = store.get();
      radius = patch.radius ?? radius;
      store.set({ painting: painting && { ...painting, ...patch } });
    },
    /** Removes all paint from a model. */
    clear(id: number) {
      actions.end(true);
      if (engine().painted(id).length > 0)
        edit.apply({ do: "set_painted", id, amounts: [] }, T.did.clearPaint);
    },
    /** Starts a stroke. False if no model is being painted, or the point is not on it. */
    begin(x: number, y: number): boolean {
      const { painting } = store.get();
      if (!painting || stroke) return false;
      edit.settle();
      try {
        if (!dab(x, y)) return false;
      } catch (error) {
        report(ctx, T.models.notPainted, error);
        return false;
      }
      stroke = { x, y };
      return true;
    },
    drag(x: number, y: number) {
      if (!stroke || !store.get().bound) return;
      const { x: x0, y: y0 } = stroke;
      const n = Math.max(1, Math.ceil(Math.hypot(x - x0, y - y0) / DAB_PX));
      for (let k = 0; k <= n; k += 1) dab(x0 + ((x - x0) * k) / n, y0 + ((y - y0) * k) / n);
      stroke = { x, y };
    },
    /** Keeps the stroke as an undo step, or reverts it. */
    end(keepIt: boolean) {
      const { painting } = store.get();
      const isOpen = stroke !== undefined && painting !== null;
      stroke = undefined;
      // During the stroke, another model may have been opened, which ended painting.
      if (!isOpen) return;
      if (keepIt) engine().commit(painting.erase ? T.did.erase : T.did.paint);
      else engine().revert();
    },
    active: (): boolean => stroke !== undefined,
    /** Radius of the brush at a position of the view, CSS pixels; null where the brush would not paint. */
    radiusAt(x: number, y: number): number | null {
      const { painting } = store.get();
      return (painting && engine().brushRadius(x, y, painting.radius)) ?? null;
    },
  };
  effect(() => {
    const { editingRest, model, painting } = store.get();
    const isGone = !model?.members.some(({ id }) => id === painting?.id);
    // Reshaping the cage ends painting.
    if (painting && (editingRest || isGone)) untracked(() => actions.on(null));
  });
  return actions;
}
