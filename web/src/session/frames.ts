/** Frames on demand: many requests make one, and none makes none. */

/** A GPU that is behind, or waiting for something, is asked again after this pause, ms. */
const BUSY_PAUSE = 12;

export interface Frames {
  ask(): void;
  /** Begins to draw; false from `draw` means: not now. */
  start(draw: () => boolean): void;
  listen(listener: (ms: number) => void): () => void;
  stop(): void;
}

export function createFrames(): Frames {
  const listeners = new Set<(ms: number) => void>();
  let draw: (() => boolean) | undefined;
  let asked = false;
  let stopped = false;

  const ask = () => {
    if (asked || stopped) return;
    asked = true;
    requestAnimationFrame(frame);
  };
  const frame = () => {
    asked = false;
    if (!draw || stopped) return;
    const began = performance.now();
    let drawn = true;
    try {
      drawn = draw();
    } catch (error) {
      // A lost device is told by the session; anything else is for the page's handler of errors.
      if (!(error instanceof Error && error.name === "DeviceLost")) reportError(error);
      return;
    }
    if (!drawn) {
      setTimeout(ask, BUSY_PAUSE);
      return;
    }
    const ms = performance.now() - began;
    for (const listener of listeners) listener(ms);
  };
  return {
    ask,
    start(first) {
      draw = first;
      ask();
    },
    listen(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
    stop() {
      stopped = true;
      listeners.clear();
    },
  };
}
