import { describe, expect, it } from "vitest";
import { createStore, INITIAL } from "../src/state";

describe("store", () => {
  it("tells watchers of their keys, once a turn", () => {
    const queue: (() => void)[] = [];
    const store = createStore(INITIAL, (work) => queue.push(work));
    const heard: string[] = [];
    store.watch(["step"], ({ step }) => heard.push(step));
    store.watch(["busy"], ({ busy }) => heard.push(`busy ${busy}`));
    store.set({ step: "cage" });
    store.set({ step: "bind" });
    for (const work of queue.splice(0)) work();
    expect(heard).toEqual(["model", "busy Starting", "bind"]);
  });

  it("says nothing when nothing changed", () => {
    const queue: (() => void)[] = [];
    const store = createStore(INITIAL, (work) => queue.push(work));
    store.set({ step: "model" });
    expect(queue).toHaveLength(0);
  });

  it("hears of what a watcher sets", () => {
    const queue: (() => void)[] = [];
    const store = createStore(INITIAL, (work) => queue.push(work));
    const shares: (readonly number[])[] = [];
    store.watch(["shares"], ({ shares: now }) => shares.push(now));
    store.watch(["poses"], ({ poses }) => store.set({ shares: poses.map(() => 0) }));
    store.set({ poses: [{ name: "a", positions: new Float32Array(3) }] });
    while (queue.length > 0) queue.shift()?.();
    expect(shares.at(-1)).toEqual([0]);
  });
});
