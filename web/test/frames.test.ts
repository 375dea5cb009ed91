import { createFrames } from "@cagework/core/session/frames";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";

/** Between two frames, ms. */
const FRAME = 16;

/** Longer than any pause after which a picture is sharpened, ms. */
const LONG = 2000;

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("requestAnimationFrame", (then: () => void) => setTimeout(then, FRAME));
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

/** Frames of a GPU that answers as told, and how each was asked for. */
function slow(answer: (sharp: boolean) => boolean | undefined, calm = () => true) {
  const drawn: boolean[] = [];
  const frames = createFrames();
  frames.start((sharp) => {
    drawn.push(sharp);
    return answer(sharp);
  }, calm);
  return { frames, drawn };
}

describe("frames", () => {
  it("a fast GPU draws once for many requests, and nothing more", () => {
    const { frames, drawn } = slow(() => true);
    frames.ask();
    frames.ask();
    vi.advanceTimersByTime(LONG);
    expect(drawn).toEqual([false]);
  });

  it("what was drawn roughly is sharpened once nothing moves any more", () => {
    const { frames, drawn } = slow((sharp) => sharp);
    for (let k = 0; k < 50; k++) {
      frames.ask();
      vi.advanceTimersByTime(2 * FRAME);
    }
    expect(drawn.length).toBeGreaterThan(40);
    expect(drawn.every((sharp) => !sharp)).toBe(true);
    vi.advanceTimersByTime(LONG);
    expect(drawn.filter((sharp) => sharp)).toEqual([true]);
    expect(drawn.at(-1)).toBe(true);
  });

  it("as long as something waits for the GPU nothing is sharpened", () => {
    let isCalm = false;
    const { drawn } = slow(
      (sharp) => sharp,
      () => isCalm,
    );
    vi.advanceTimersByTime(LONG);
    expect(drawn).toEqual([false]);
    isCalm = true;
    vi.advanceTimersByTime(LONG);
    expect(drawn).toEqual([false, true]);
  });

  it("a busy GPU is asked again, as it was asked before", () => {
    let isBusy = true;
    const { drawn } = slow((sharp) => (isBusy && sharp ? undefined : sharp));
    vi.advanceTimersByTime(LONG);
    expect(drawn.length).toBeGreaterThan(10);
    isBusy = false;
    drawn.length = 0;
    vi.advanceTimersByTime(LONG);
    expect(drawn).toEqual([true]);
  });

  it("a request meanwhile comes before sharpness", () => {
    let isBusy = true;
    const { frames, drawn } = slow((sharp) => (isBusy && sharp ? undefined : sharp));
    vi.advanceTimersByTime(LONG);
    drawn.length = 0;
    frames.ask();
    vi.advanceTimersByTime(4 * FRAME);
    expect(drawn).toContain(false);
    isBusy = false;
    vi.advanceTimersByTime(LONG);
    expect(drawn.at(-1)).toBe(true);
  });

  it("once stopped nothing is drawn", () => {
    const { frames, drawn } = slow((sharp) => sharp);
    frames.stop();
    frames.ask();
    vi.advanceTimersByTime(LONG);
    expect(drawn).toEqual([]);
  });
});
