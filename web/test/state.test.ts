import { effect } from "@preact/signals";
import { describe, expect, it } from "vitest";
import { createStore } from "../src/signals";
import { INITIAL } from "../src/state";

describe("store", () => {
  it("notifies only readers of the changed key", () => {
    const store = createStore(INITIAL);
    const heard: string[] = [];
    effect(() => void heard.push(store.get().step));
    effect(() => void heard.push(`busy ${store.get().busy}`));
    store.set({ step: "cage" });
    store.set({ step: "cage", memory: 3 });
    expect(heard).toEqual(["model", "busy null", "cage"]);
    expect({ ...store.get() }).toMatchObject({ step: "cage", memory: 3 });
  });

  it("changes several keys at once", () => {
    const store = createStore(INITIAL);
    const heard: string[] = [];
    effect(() => void heard.push(`${store.get().poses.length} ${store.get().shares.length}`));
    store.set({ poses: [{ name: "a", fits: true, seconds: 1, interpolation: null, hash: 7 }], shares: [0] });
    expect(heard).toEqual(["0 0", "1 1"]);
  });
});
