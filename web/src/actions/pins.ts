/** Points of the model that pulls leave where they are, and the marks of what is held. */

import type { SurfacePoint } from "../contract";
import { T } from "../words";
import type { Context } from "./context";

export interface Pins {
  /** Marks the pins, the point that is held or would be, and where it is to be. */
  show(held?: SurfacePoint, target?: Float32Array): void;
  /** Where a point of the model is in the view; undefined for one that is not there. */
  inView(point: SurfacePoint): { x: number; y: number } | undefined;
  /** Those that are not at a place of the view. */
  free(x: number, y: number): readonly SurfacePoint[];
  /** Takes the pin there away, or pins the point there, if it may; false beside the model. */
  toggle(x: number, y: number, mayPin: boolean): boolean;
  removeAll(): void;
}

/** A grab and a pin that are nearer to each other are one, CSS pixels. */
const SAME_PX = 14;

export function createPins(ctx: Context): Pins {
  const { store } = ctx;
  const engine = () => ctx.session().engine;

  const show = (held?: SurfacePoint, target?: Float32Array) =>
    engine().showHeld([...(held ? [held] : []), ...store.get().pins], target);

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

  /** One step of the history. */
  const change = (label: string, next: readonly SurfacePoint[]) => {
    const { pins } = store.get();
    const set = (list: readonly SurfacePoint[]) => {
      store.set({ pins: list });
      show();
    };
    set(next);
    ctx.history.push({ label, undo: () => set(pins), redo: () => set(next) });
  };

  return {
    show,
    inView,
    free(x, y) {
      const there = at(x, y);
      return store.get().pins.filter((pin) => pin !== there);
    },
    toggle(x, y, mayPin) {
      const { pins } = store.get();
      const there = at(x, y);
      const point = mayPin ? engine().surfaceAt(x, y) : undefined;
      if (there)
        change(
          T.did.unpin,
          pins.filter((pin) => pin !== there),
        );
      else if (point) change(T.did.pin, [...pins, point]);
      return there !== undefined || point !== undefined;
    },
    removeAll: () => change(T.did.unpin, []),
  };
}
