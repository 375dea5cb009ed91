/** Draws on demand: any number of requests between two frames lead to one frame. */

/** Pause before the next attempt if the GPU is busy, ms. */
const BUSY_PAUSE = 12;

/** Idle time after which a frame drawn at low resolution is drawn again at full resolution, ms. */
const QUIET = 250;

export interface Frames {
  ask(): void;
  /**
   * Starts drawing. `draw` takes whether to draw at full resolution, and returns whether it did, or undefined if the GPU is
   * busy. `calm` says whether there is time for an unrequested frame at full resolution.
   */
  start(draw: (sharp: boolean) => boolean | undefined, calm: () => boolean): void;
  listen(listener: (ms: number) => void): () => void;
  stop(): void;
}

export function createFrames(): Frames {
  const listeners = new Set<(ms: number) => void>();
  let draw: ((sharp: boolean) => boolean | undefined) | undefined;
  let calm = () => true;
  let asked: "soon" | "sharp" | undefined;
  let quiet: ReturnType<typeof setTimeout> | undefined;
  let stopped = false;

  const request = (how: "soon" | "sharp") => {
    if (stopped) return;
    clearTimeout(quiet);
    if (!asked) requestAnimationFrame(frame);
    // A normal request takes precedence over sharpening, which follows later.
    asked = asked === "soon" ? asked : how;
  };
  const sharpen = () => {
    if (calm()) request("sharp");
    else quiet = setTimeout(sharpen, QUIET);
  };
  const frame = () => {
    const how = asked ?? "soon";
    asked = undefined;
    if (!draw || stopped) return;
    const began = performance.now();
    let isSharp: boolean | undefined;
    try {
      isSharp = draw(how === "sharp");
    } catch (error) {
      // The session reports lost devices; everything else goes to the page's error handler.
      if (!(error instanceof Error && error.name === "DeviceLost")) reportError(error);
      return;
    }
    if (isSharp === undefined) {
      setTimeout(() => request(how), BUSY_PAUSE);
      return;
    }
    if (!isSharp) quiet = setTimeout(sharpen, QUIET);
    const ms = performance.now() - began;
    for (const listener of listeners) listener(ms);
  };
  return {
    ask: () => request("soon"),
    start(first, whenCalm) {
      [draw, calm] = [first, whenCalm];
      request("soon");
    },
    listen(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
    stop() {
      stopped = true;
      clearTimeout(quiet);
      listeners.clear();
    },
  };
}
