/** Touch input: one finger acts as the pointer, two fingers move and zoom the view. */

import type { Engine } from "../contract";

interface Spot {
  x: number;
  y: number;
}

export function createTouch(options: { engine: () => Engine; interrupt: () => void }) {
  const fingers = new Map<number, Spot>();
  /**
   * True from the second finger's touch until all fingers are lifted, so that the last finger does not drag anything.
   */
  let navigating = false;

  return {
    /** `down`, `move` and `up` return true if the touch is part of a two-finger gesture: the caller then ignores it. */
    down(id: number, at: Spot): boolean {
      fingers.set(id, at);
      if (fingers.size < 2) return navigating;
      if (!navigating) options.interrupt();
      navigating = true;
      return true;
    },
    move(id: number, at: Spot): boolean {
      const before = [...fingers.values()];
      if (!fingers.has(id)) return navigating;
      fingers.set(id, at);
      if (!navigating) return false;
      const after = [...fingers.values()];
      const change = pinch(before, after);
      if (change) {
        options.engine().pan(change.dx, change.dy);
        options.engine().zoomAt(change.x, change.y, change.factor);
      }
      return true;
    },
    up(id: number): boolean {
      fingers.delete(id);
      const was = navigating;
      if (fingers.size === 0) navigating = false;
      return was;
    },
    /** Treats all fingers as lifted. */
    clear() {
      fingers.clear();
      navigating = false;
    },
  };
}

export type Touch = ReturnType<typeof createTouch>;

/**
 * Computes the change between two positions of two fingers: translation of their midpoint, its new position, and zoom
 * factor. Undefined with fewer fingers.
 */
export function pinch(
  before: readonly Spot[],
  after: readonly Spot[],
): { dx: number; dy: number; x: number; y: number; factor: number } | undefined {
  const [a0, b0] = before;
  const [a1, b1] = after;
  if (!a0 || !b0 || !a1 || !b1) return undefined;
  const x = (a1.x + b1.x) / 2;
  const y = (a1.y + b1.y) / 2;
  const spread = Math.hypot(a0.x - b0.x, a0.y - b0.y);
  const now = Math.hypot(a1.x - b1.x, a1.y - b1.y);
  return {
    dx: x - (a0.x + b0.x) / 2,
    dy: y - (a0.y + b0.y) / 2,
    x,
    y,
    factor: spread > 1 && now > 1 ? now / spread : 1,
  };
}
