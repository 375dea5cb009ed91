import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { createClips, loadLattice } from "../../src/actions/clips";
import { rigOf } from "../../src/derived";
import { createFake, MODEL, settled } from "../fake";

const frames: ((now: number) => void)[] = [];

beforeEach(() => {
  frames.length = 0;
  vi.stubGlobal("requestAnimationFrame", (run: (now: number) => void) => frames.push(run));
  vi.stubGlobal("cancelAnimationFrame", () => frames.splice(0));
  vi.stubGlobal("matchMedia", () => ({ matches: false }));
  vi.spyOn(performance, "now").mockReturnValue(1000);
});
afterEach(() => {
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

/**
 * A page with a bound model that has a clip of two seconds and two morph targets. `shown` lists the calls of
 * `showClip`, `starts` counts those of `startClip`, and `end` stops the clip as the engine does.
 */
function page() {
  const fake = createFake();
  const shown: [clip: number | undefined, seconds: number, targets: number[]][] = [];
  let starts = 0;
  let paused = false;
  fake.teach({
    showsClip: false,
    startClip: () => {
      fake.teach({ showsClip: true });
      starts += 1;
      return Promise.resolve();
    },
    stopClip: () => fake.teach({ showsClip: false }),
    showClip: (clip, seconds, targets, isPaused) => {
      shown.push([clip ?? undefined, seconds, [...targets]]);
      paused = isPaused;
    },
  });
  const targets = [
    { name: "wide", default: 0.25 },
    { name: "tall", default: 0 },
  ];
  fake.store.set({
    bound: true,
    model: { ...MODEL, rigged: true, clips: [{ name: "Walk", seconds: 2 }], targets },
  });
  const clips = createClips(fake.ctx, () => undefined);
  /** Runs the next requested animation frame with the timestamp `now`, ms. */
  const frame = (now: number) => frames.shift()?.(now);
  return {
    ...fake,
    clips,
    shown,
    frame,
    starts: () => starts,
    paused: () => paused,
    end: () => fake.teach({ showsClip: false }),
  };
}

it("a chosen clip plays in a loop and pauses in place", async () => {
  const { clips, shown, frame, store, starts, paused } = page();
  await clips.choose(0);
  frame(1500);
  frame(3250);
  expect(paused()).toBe(false);
  expect(shown.map(([clip, seconds]) => [clip, seconds])).toEqual([
    [0, 0],
    [0, 0.5],
    [0, 0.25],
  ]);
  await clips.toggle();
  expect([store.get().clip.playing, frames.length, starts(), paused()]).toEqual([false, 0, 1, true]);
  await clips.scrub(1.5);
  expect(shown.at(-1)).toEqual([0, 1.5, []]);
});

it("without looping it stops at the end; at half speed it takes twice as long", async () => {
  const { clips, shown, frame, store } = page();
  clips.loop(false);
  clips.speed(0.5);
  await clips.choose(0);
  frame(3000);
  expect(shown.at(-1)?.[1]).toBe(1);
  frame(9000);
  expect([shown.at(-1)?.[1], store.get().clip.playing]).toEqual([2, false]);
});

it("with reduced motion the clip starts paused", async () => {
  vi.stubGlobal("matchMedia", () => ({ matches: true }));
  const { clips, shown, store } = page();
  await clips.choose(0);
  expect([shown.length, store.get().clip.playing]).toEqual([1, false]);
});

it("changing a morph target keeps the others' defaults", async () => {
  const { clips, shown } = page();
  await clips.target(1, 0.8);
  expect(shown.at(-1)).toEqual([undefined, 0, [0.25, expect.closeTo(0.8)]]);
});

it("another cage ends a clip", async () => {
  const { clips, frame, store, end } = page();
  await clips.choose(0);
  end();
  frame(1100);
  expect(store.get().clip).toMatchObject({ clip: null, playing: false, seconds: 0 });
});

it("asks for a bind first, and reports clips that cannot be played", async () => {
  const { clips, store, said, problems, teach } = page();
  store.set({ bound: false });
  await clips.choose(0);
  expect(said[0]).toContain("Bind the model first");
  store.set({ bound: true });
  teach({ startClip: () => Promise.reject(new Error("no room")) });
  await clips.choose(0);
  await settled();
  expect(problems).toMatchObject([{ title: "The clip cannot be played" }]);
});

it("another cage and reshaping end a paused clip, posing the cage does not", async () => {
  const { clips, store, end } = page();
  await clips.choose(0);
  await clips.scrub(0.5);
  store.set({ gesture: "Move", steps: 1 });
  expect(store.get().clip).toMatchObject({ clip: 0, seconds: 0.5 });
  end();
  store.set({ steps: 2 });
  expect(store.get().clip).toMatchObject({ clip: null, seconds: 0 });
  await clips.choose(0);
  store.set({ editingRest: true });
  expect(store.get().clip).toMatchObject({ clip: null, playing: false });
});

it("rigid parts are limited to those of the open model", () => {
  const { clips, store } = page();
  clips.rig({ rigid: ["hat", "sword"] });
  expect(rigOf(store.get()).rigid).toEqual([]);
  store.set({ model: { ...MODEL, rigged: true, props: ["sword"] } });
  expect(rigOf(store.get()).rigid).toEqual(["sword"]);
});

it("a clip is prepared again for each change of options, and shows the same time", async () => {
  const { clips, store, starts, shown, engine } = page();
  await clips.choose(0);
  await clips.scrub(0.5);
  await Promise.all([clips.rig({ joints: "stay" }), clips.rig({ ground: true })]);
  expect(store.get().rigOptions).toMatchObject({ joints: "stay", ground: true });
  expect([store.get().clip, starts()]).toMatchObject([{ clip: 0, seconds: 0.5, playing: false }, 3]);
  expect(shown.at(-1)).toEqual([0, 0.5, []]);
  const changed = clips.rig({ ground: false });
  await clips.choose(null);
  await changed;
  expect([store.get().clip.clip, engine.showsClip], "the user has ended it").toEqual([null, false]);
});

it("with the option `dynamic`, a clip starts once the lattice is ready, which is requested once", async () => {
  const { clips, asked, ctx, starts, teach, said } = page();
  clips.rig({ dynamic: true });
  teach({ hasLattice: false });
  const chosen = clips.choose(0);
  await settled();
  expect([starts(), said.at(-1)]).toEqual([0, "Computing how the cage bends the moving model"]);
  const exported = loadLattice(ctx);
  await settled();
  asked.at(-1)?.resolve(undefined);
  teach({ hasLattice: true });
  await Promise.all([chosen, exported]);
  expect(starts()).toBe(1);
  await clips.choose(null);
  await clips.choose(0);
  expect(asked.filter(({ kind }) => kind === "lattice")).toHaveLength(1);
});
