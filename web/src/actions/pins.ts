/** Pins, the points of the model that pulls keep in place, and the mark of the grabbed point. */

import type { SurfacePoint } from "../contract";
import { T } from "../words";
import type { Context } from "./context";
import type { Edit } from "./edit";

export interface Pins {
  /** Marks the point that is grabbed, or would be by a press, and its target. Without arguments, removes the marks. */
  show(held?: SurfacePoint, target?: Float32Array): void;
  /** Position of a model point in the view, CSS pixels; undefined if its model was removed. */
  inView(point: SurfacePoint): { x: number; y: number } | undefined;
  /** All pins except the one at this position of the view. */
  free(x: number, y: number): readonly SurfacePoint[];
  /** Removes the pin at a position of the view, or pins the model there if `mayPin`. False if neither is possible. */
  toggle(x: number, y: number, mayPin: boolean): boolean;
  removeAll(): void;
}

/** Maximum distance between a grab and a pin that count as the same point, CSS pixels. */
const SAME_PX = 14;

export function createPins(ctx: Context, apply: Edit["apply"]): Pins {
  const { store } = ctx;
  const engine = () => ctx.session().engine;

  const inView = (point: SurfacePoint) => {
    const [x, y, z] = engine().placeOf(point);
    if (x === undefined || y === undefined || z === undefined) return undefined;
    const [px = 0, py = 0] = engine().project(x, y, z);
    return { x: px, y: py };
  };

  const at = (x: number, y: number) =>
    store.get().pins.find((pin) => {
      const place = inView(pin);
      return place && Math.hypot(place.x - x, place.y - y) < SAME_PX;
    });

  const free = (x: number, y: number) => {
    const there = at(x, y);
    return store.get().pins.filter((pin) => pin !== there);
  };

  return {
    show: (held, target) => engine().showHeld(held ? [held] : [], target),
    inView,
    free,
    toggle(x, y, mayPin) {
      if (at(x, y)) return apply({ do: "set_pins", pins: free(x, y) }, T.did.unpin);
      const point = mayPin ? engine().surfaceAt(x, y) : undefined;
      return point !== undefined && apply({ do: "set_pins", pins: [...store.get().pins, point] }, T.did.pin);
    },
    removeAll: () => void apply({ do: "set_pins", pins: [] }, T.did.unpin),
  };
}
