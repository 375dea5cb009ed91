/** Painting what of a model stays as it is. */

import { effect, untracked } from "@preact/signals";
import type { Painting } from "../state";
import { T } from "../words";
import { type Context, report } from "./context";
import type { Edit } from "./edit";

export interface PaintActions {
  /** Begins to paint on a model, or ends it (null). */
  on(id: number | null): void;
  brush(patch: Partial<Omit<Painting, "id">>): void;
  /** Takes away what is painted. */
  clear(id: number): void;
  /** Begins a stroke; false beside the model. */
  begin(x: number, y: number): boolean;
  drag(x: number, y: number): void;
  /** Keeps the stroke, or puts back what was there before. */
  end(keep: boolean): void;
  active(): boolean;
  /** Radius of the brush, CSS pixels: null where it would not paint, undefined while the GPU is busy for a moment. */
  radiusAt(x: number, y: number): number | null | undefined;
}

/** Farther apart than this a stroke gets dabs between, CSS pixels. */
const DAB_PX = 6;
/** Of the brush at first, over the model's size. */
const RADIUS = 0.05;
/** What a dab leaves: all follows, or all stays. */
const [FOLLOWS, STAYS] = [0, 255];

/** `settle` ends what plays or is in progress. */
export function createPainting(
  ctx: Context,
  edit: Pick<Edit, "apply" | "settle">,
  settle: () => void,
): PaintActions {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
  /** Kept from one time to the next. */
  let radius = RADIUS;
  let stroke: { readonly x: number; readonly y: number } | undefined;

  const dab = (x: number, y: number): boolean => {
    const { painting } = store.get();
    return painting !== null && engine().paint(x, y, painting.radius, painting.erase ? FOLLOWS : STAYS);
  };

  const actions: PaintActions = {
    on(id) {
      actions.end(true);
      if (id !== null) settle();
      if ((store.get().painting?.id ?? null) === id) return;
      store.set({ painting: id === null ? null : { id, radius, erase: false }, boxArmed: false });
      engine().showPainting(id ?? undefined);
    },
    brush(patch) {
      const { painting } = store.get();
      radius = patch.radius ?? radius;
      store.set({ painting: painting && { ...painting, ...patch } });
    },
    clear(id) {
      actions.end(true);
      if (engine().painted(id).length > 0)
        edit.apply({ do: "set_painted", id, amounts: [] }, T.did.clearPaint);
    },
    begin(x, y) {
      const { painting } = store.get();
      if (!painting || stroke) return false;
      edit.settle();
      try {
        if (!dab(x, y)) return false;
      } catch (error) {
        if (!store.get().bound) {
          report(ctx, T.models.notPainted, error);
          return false;
        }
        // The GPU is busy with the stroke before for a moment: this one paints from its first movement on.
      }
      stroke = { x, y };
      return true;
    },
    drag(x, y) {
      if (!stroke) return;
      const { x: x0, y: y0 } = stroke;
      const n = Math.max(1, Math.ceil(Math.hypot(x - x0, y - y0) / DAB_PX));
      try {
        for (let k = 0; k <= n; k += 1) dab(x0 + ((x - x0) * k) / n, y0 + ((y - y0) * k) / n);
        stroke = { x, y };
      } catch {
        // The GPU was busy for a moment: the next movement goes on from here.
      }
    },
    end(keepIt) {
      const { painting } = store.get();
      const isOpen = stroke !== undefined && painting !== null;
      stroke = undefined;
      // Something else may have been opened during the stroke.
      if (!isOpen) return;
      if (keepIt) engine().commit(painting.erase ? T.did.erase : T.did.paint);
      else engine().revert();
    },
    active: () => stroke !== undefined,
    radiusAt(x, y) {
      const { painting } = store.get();
      try {
        return (painting && engine().brushRadius(x, y, painting.radius)) ?? null;
      } catch {
        return store.get().bound ? undefined : null;
      }
    },
  };
  effect(() => {
    const { editingRest, model, painting } = store.get();
    const isGone = !model?.members.some(({ id }) => id === painting?.id);
    // A hand that reshapes the cage does not paint.
    if (painting && (editingRest || isGone)) untracked(() => actions.on(null));
  });
  return actions;
}
