/** Frames on demand: many requests make one, and none makes none. */

/** A GPU that is behind, or waiting for something, is asked again after this pause, ms. */
const BUSY_PAUSE = 12;

/** What a slow GPU drew roughly it draws again once nothing has moved for so long, ms. */
const QUIET = 250;

export interface Frames {
  ask(): void;
  /**
   * Begins to draw. `draw` with or without all pixels answers whether the picture has them; undefined means: not now.
   * `calm`: whether there is time for a picture that nobody asked for.
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
    // Whoever wants it soon comes first: it is sharpened later.
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
      // A lost device is told by the session; anything else is for the page's handler of errors.
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
