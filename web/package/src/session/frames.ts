/** Draws frames on demand. All requests between two animation frames result in one drawing. */

/** Pause before the next attempt if the GPU is busy, ms. */
const BUSY_PAUSE = 12;

/** Idle time after which a frame drawn at low resolution is drawn again at full resolution, ms. */
const SHARP_DELAY_MS = 250;

/** `pointers`: target of pointer events. While a pointer is pressed, frames stay at low resolution. */
export function createFrames(pointers: EventTarget) {
  const listeners = new Set<(ms: number) => void>();
  let draw: ((sharp: boolean) => boolean | undefined) | undefined;
  let calm = () => true;
  let asked: "soon" | "sharp" | undefined;
  let quiet: ReturnType<typeof setTimeout> | undefined;
  const stop = new AbortController();
  let pressed = false;
  const follow = (event: Event) => {
    pressed = (event as PointerEvent).buttons !== 0;
  };
  // A release outside the window is not reported: the next movement shows it.
  for (const type of ["pointerdown", "pointermove", "pointerup", "pointercancel"]) {
    pointers.addEventListener(type, follow, { capture: true, passive: true, signal: stop.signal });
  }

  const request = (how: "soon" | "sharp") => {
    if (stop.signal.aborted) return;
    clearTimeout(quiet);
    if (!asked) requestAnimationFrame(frame);
    // A requested frame takes precedence over drawing the previous frame again at full resolution.
    asked = asked === "soon" ? asked : how;
  };
  const sharpen = () => {
    if (calm() && !pressed) request("sharp");
    else quiet = setTimeout(sharpen, SHARP_DELAY_MS);
  };
  const frame = () => {
    const how = asked ?? "soon";
    asked = undefined;
    if (!draw || stop.signal.aborted) return;
    const began = performance.now();
    let isSharp: boolean | undefined;
    try {
      isSharp = draw(how === "sharp");
    } catch (error) {
      // The session reports a lost device. Other errors go to the page's error handler.
      if (!(error instanceof Error && error.name === "DeviceLost")) reportError(error);
      return;
    }
    if (isSharp === undefined) {
      setTimeout(() => request(how), BUSY_PAUSE);
      return;
    }
    if (!isSharp) quiet = setTimeout(sharpen, SHARP_DELAY_MS);
    const ms = performance.now() - began;
    for (const listener of listeners) listener(ms);
  };
  return {
    ask: () => request("soon"),
    /**
     * Starts drawing. `first` draws a frame, at full resolution if its argument is true. It returns whether the frame
     * has full resolution, or undefined if the GPU is busy and nothing was drawn. `whenCalm` returns whether there is
     * time to draw the last frame again at full resolution.
     */
    start(first: (sharp: boolean) => boolean | undefined, whenCalm: () => boolean) {
      [draw, calm] = [first, whenCalm];
      request("soon");
    },
    listen(listener: (ms: number) => void): () => void {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
    stop() {
      stop.abort();
      clearTimeout(quiet);
      listeners.clear();
    },
  };
}

export type Frames = ReturnType<typeof createFrames>;
