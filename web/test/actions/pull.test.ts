import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { createEdit } from "../../src/actions/edit";
import { createPulling } from "../../src/actions/pull";
import type { Frames } from "../../src/contract";
import { cageOf, createFake, settled } from "../fake";

/** Callbacks of requested animation frames; the test calls them. */
let frames: (() => void)[] = [];
beforeEach(() => {
  frames = [];
  vi.stubGlobal("requestAnimationFrame", (run: () => void) => frames.push(run));
});
afterEach(() => {
  vi.unstubAllGlobals();
});

const FRAMES: Frames = { whole: [], joints: [], bones: [], plain: [] };
const POINT = { triangle: 0, bary: [1, 0, 0] as [number, number, number] };

/** A page ready to pull. The model is hit only by pointers with x = 10. */
function page() {
  const fake = createFake();
  const shown: unknown[][] = [];
  fake.teach({
    surfaceAt: (x) => (x === 10 ? POINT : undefined),
    gripsOf: () => [Float64Array.of(0.5, 0.5), Uint32Array.of(3), FRAMES],
    pinsAfter: (x) => (x === 10 ? [POINT] : undefined),
    placeOf: () => Float32Array.of(0, 0, 0),
    project: () => Float32Array.of(10, 10, 1),
    followed: (place, dx, dy) => Float32Array.of((place[0] ?? 0) + dx, (place[1] ?? 0) + dy, 0),
    showHeld: (points: readonly unknown[]) => {
      shown.push([...points]);
    },
  });
  const edit = createEdit(fake.ctx);
  const pull = createPulling(fake.ctx, edit);
  fake.showCage(cageOf(2));
  fake.show({ bound: true });
  fake.store.set({ pullReady: true });
  const answer = async (output: unknown) => {
    fake.asked.at(-1)?.resolve(output);
    await settled();
  };
  const frame = async () => {
    for (const run of frames.splice(0)) run();
    await settled();
  };
  const took = { place: Float32Array.of(0, 0, 0), stays: new Float32Array(4), reach: 0.3 };
  const cage = (height: number, isSettled: boolean) => ({
    cage: new Float32Array(6).fill(height),
    settled: isSettled,
    error: 0,
  });
  return { ...fake, pull, answer, frame, took, cage, shown };
}

it("a pull moves the cage with the worker's answers and is one undo step", async () => {
  const { pull, answer, frame, took, cage, asked, engine, store, did } = page();
  expect(pull.begin(50, 10)).toBe(false);
  expect(pull.begin(10, 10)).toBe(true);
  pull.drag(14, 10);
  await answer(took);
  expect(asked.at(-1)).toMatchObject({ kind: "pullFrame", input: Float32Array.of(4, 0, 0) });
  await answer(cage(2, false));
  expect(engine.cagePositions()[0]).toBe(2);
  pull.end(true);
  await frame();
  await answer(cage(3, true));
  expect([engine.cagePositions()[0], did, store.get().gesture]).toEqual([3, ["Pull"], null]);
});

it("a released pull is awaited until its undo step exists, and a held one is not", async () => {
  const { pull, answer, frame, took, cage, did } = page();
  pull.begin(10, 10);
  pull.drag(14, 10);
  await pull.released();
  await answer(took);
  await answer(cage(2, false));
  pull.end(true);
  let steps: string[] | undefined;
  void pull.released().then(() => {
    steps = [...did];
  });
  await frame();
  expect(steps).toBeUndefined();
  await answer(cage(3, true));
  expect(steps).toEqual(["Pull"]);
});

it("Esc restores the cage and later answers are dropped", async () => {
  const { pull, answer, took, cage, engine, did } = page();
  const before = engine.cagePositions();
  pull.begin(10, 10);
  await answer(took);
  await answer(cage(2, false));
  pull.end(false);
  await answer(cage(5, true));
  expect([engine.cagePositions(), did, pull.active()]).toEqual([before, [], false]);
});

it("a click sets a pin or removes it, as one undo step", () => {
  const { pull, store, did, teach } = page();
  expect(pull.pin(50, 10)).toBe(false);
  pull.pin(10, 10);
  expect(store.get().pins).toEqual([POINT]);
  teach({ pinsAfter: () => [] });
  pull.pin(10, 10);
  expect([store.get().pins, did]).toEqual([[], ["Pin", "Remove pins"]]);
});

it("changing the reach during a pull sends a new grab", async () => {
  const { pull, answer, took, asked } = page();
  pull.begin(10, 10);
  await answer(took);
  pull.reach(2);
  expect(asked.at(-1)).toMatchObject({ kind: "pullGrab", input: { options: { reach: { of: 0.6 } } } });
  pull.reach(10);
  expect(asked.at(-1)).toMatchObject({ input: { options: { reach: "whole" } } });
});

it("a failing worker is reported and leaves the cage unchanged", async () => {
  const { pull, asked, problems, engine } = page();
  const before = engine.cagePositions();
  pull.begin(10, 10);
  asked.at(-1)?.reject(new Error("nothing is ready to be pulled"));
  await settled();
  expect(problems).toMatchObject([{ title: "The model cannot be pulled" }]);
  expect([engine.cagePositions(), pull.active()]).toEqual([before, false]);
});

it("a pull does not change a cage that has been replaced", async () => {
  const { pull, asked, engine, did, problems, showCage } = page();
  pull.begin(10, 10);
  showCage(cageOf(2, 9));
  const other = engine.cagePositions();
  asked.at(-1)?.reject(Object.assign(new Error("the cage was replaced"), { name: "Cancelled" }));
  await settled();
  expect([engine.cagePositions(), did, problems]).toEqual([other, [], []]);
});

it("arrow keys pull the nearest point of the model if the middle of the view is empty", async () => {
  const { pull, answer, took, asked, teach, said } = page();
  // The middle of the view is at x = 50; the model is 40 pixels to its left.
  teach({
    camera: () => ({ target: [0, 0, 0], yaw: 0, pitch: 0, distance: 1, parallel: false }),
    project: () => Float32Array.of(50, 10, 1),
  });
  pull.nudge(0, 1);
  await answer(took);
  expect([asked.at(-1)?.kind, said]).toEqual(["pullFrame", []]);
});
