import { createFrames } from "@cagework/core/session/frames";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";

/** Time between two frames, ms. */
const FRAME = 16;

/** A time longer than the delay after which an idle page draws a sharp frame, ms. */
const IDLE_MS = 2000;

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("requestAnimationFrame", (then: () => void) => setTimeout(then, FRAME));
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

/** Creates a frame loop on a simulated GPU. `drawn`: for each draw call, whether it requests full resolution. */
function slow(answer: (sharp: boolean) => boolean | undefined, calm = () => true) {
  const drawn: boolean[] = [];
  const pointers = new EventTarget();
  const frames = createFrames(pointers);
  frames.start((sharp) => {
    drawn.push(sharp);
    return answer(sharp);
  }, calm);
  return { frames, drawn, pointers };
}

describe("frames", () => {
  it("many requests lead to one frame on a fast GPU", () => {
    const { frames, drawn } = slow(() => true);
    frames.ask();
    frames.ask();
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn).toEqual([false]);
  });

  it("a frame at low resolution is sharpened when nothing moves", () => {
    const { frames, drawn } = slow((sharp) => sharp);
    for (let k = 0; k < 50; k++) {
      frames.ask();
      vi.advanceTimersByTime(2 * FRAME);
    }
    expect(drawn.length).toBeGreaterThan(40);
    expect(drawn.every((sharp) => !sharp)).toBe(true);
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn.filter((sharp) => sharp)).toEqual([true]);
    expect(drawn.at(-1)).toBe(true);
  });

  it("nothing is sharpened while a pointer is pressed", () => {
    const { drawn, pointers } = slow((sharp) => sharp);
    pointers.dispatchEvent(Object.assign(new Event("pointerdown"), { buttons: 1 }));
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn).toEqual([false]);
    pointers.dispatchEvent(Object.assign(new Event("pointermove"), { buttons: 0 }));
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn).toEqual([false, true]);
  });

  it("nothing is sharpened while a job uses the GPU", () => {
    let isCalm = false;
    const { drawn } = slow(
      (sharp) => sharp,
      () => isCalm,
    );
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn).toEqual([false]);
    isCalm = true;
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn).toEqual([false, true]);
  });

  it("a busy GPU is tried again with the same request", () => {
    let isBusy = true;
    const { drawn } = slow((sharp) => (isBusy && sharp ? undefined : sharp));
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn.length).toBeGreaterThan(10);
    isBusy = false;
    drawn.length = 0;
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn).toEqual([true]);
  });

  it("a new request takes precedence over sharpening", () => {
    let isBusy = true;
    const { frames, drawn } = slow((sharp) => (isBusy && sharp ? undefined : sharp));
    vi.advanceTimersByTime(IDLE_MS);
    drawn.length = 0;
    frames.ask();
    vi.advanceTimersByTime(4 * FRAME);
    expect(drawn).toContain(false);
    isBusy = false;
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn.at(-1)).toBe(true);
  });

  it("nothing is drawn after stop", () => {
    const { frames, drawn } = slow((sharp) => sharp);
    frames.stop();
    frames.ask();
    vi.advanceTimersByTime(IDLE_MS);
    expect(drawn).toEqual([]);
  });
});
