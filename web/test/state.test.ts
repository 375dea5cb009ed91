import { effect } from "@preact/signals";
import { describe, expect, it } from "vitest";
import { asksToPull } from "../src/derived";
import { createStore } from "../src/signals";
import { type AppState, INITIAL_STATE } from "../src/state";

describe("store", () => {
  it("notifies only readers of the changed key", () => {
    const store = createStore(INITIAL_STATE);
    const heard: string[] = [];
    effect(() => void heard.push(store.get().step));
    effect(() => void heard.push(`busy ${store.get().busy}`));
    store.set({ step: "cage" });
    store.set({ step: "cage", memory: 3 });
    expect(heard).toEqual(["model", "busy null", "cage"]);
    expect({ ...store.get() }).toMatchObject({ step: "cage", memory: 3 });
  });

  it("changes several keys at once", () => {
    const store = createStore(INITIAL_STATE);
    const heard: string[] = [];
    effect(() => void heard.push(`${store.get().poses.length} ${store.get().shares.length}`));
    store.set({ poses: [{ name: "a", fits: true, seconds: 1, interpolation: null, hash: 7 }], shares: [0] });
    expect(heard).toEqual(["0 0", "1 1"]);
  });
});

it("the cue at the sample is shown when pulls are ready, until the first pull, and again when it is undone", () => {
  const bound = { ...INITIAL_STATE, grip: [0, 1, 0], bound: true };
  const opened = { ...bound, pullReady: true };
  const pulled = { ...opened, posed: true, undo: "Pull" };
  const states: AppState[] = [
    INITIAL_STATE,
    bound,
    opened,
    { ...opened, gesture: "Pull" },
    pulled,
    { ...pulled, posed: false, undo: null },
  ];
  expect(states.map(asksToPull)).toEqual([false, false, true, false, false, true]);
});
