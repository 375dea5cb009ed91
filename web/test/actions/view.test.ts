import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { createView } from "../../src/actions/view";
import type { SceneOptions } from "../../src/contract";
import { cageOf, createFake, settled } from "../fake";

beforeEach(() => {
  vi.stubGlobal("document", { documentElement: { dataset: {} } });
  vi.stubGlobal("localStorage", { setItem: () => undefined, removeItem: () => undefined });
});
afterEach(() => {
  vi.unstubAllGlobals();
});

function page(canCompare = true) {
  const fake = createFake();
  const dark = Object.assign(new EventTarget(), { matches: true }) as MediaQueryList;
  const scenes: SceneOptions[] = [];
  fake.teach({ setScene: (scene) => scenes.push(scene) });
  const view = createView(fake.ctx, async () => canCompare, dark);
  fake.showCage(cageOf(8));
  return { ...fake, view, scenes };
}

it("the theme follows the system unless one is chosen", () => {
  const { view, scenes, store } = page();
  view.theme("auto");
  view.theme("light");
  expect(scenes.map(({ theme }) => theme)).toEqual(["dark", "light"]);
  expect(store.get().theme).toBe("light");
});

it("only the last slice that a slider requests is computed", async () => {
  vi.useFakeTimers();
  const { view, asked, store } = page();
  view.slice({}, "kinds");
  view.slice({ position: 0.6 });
  view.slice({ position: 0.7 });
  await vi.advanceTimersByTimeAsync(100);
  vi.useRealTimers();
  expect([asked.length, asked[0]?.input]).toEqual([1, { axis: 2, position: 0.7 }]);
  expect(store.get().slice.busy).toBe(true);
  asked[0]?.resolve(undefined);
  await settled();
  expect(store.get().slice.busy).toBe(false);
});

it("a failed slice is reported and ends the busy state", async () => {
  vi.useFakeTimers();
  const { view, asked, store, problems } = page();
  view.slice({}, "value");
  await vi.advanceTimersByTimeAsync(100);
  vi.useRealTimers();
  asked[0]?.reject(new Error("needs 9 GiB"));
  await settled();
  expect([store.get().slice.busy, problems[0]?.title]).toEqual([false, "The slice could not be computed"]);
});

it("a single kind of coordinates, or weights that are missing, end the comparison", async () => {
  const { view, store } = page();
  await view.compare(["harmonic", "green"]);
  await view.compare(["harmonic", "mean_value", "green"]);
  await view.compare(["green"]);
  expect(store.get().scene.compare, "a single kind ends the comparison").toEqual(["harmonic"]);
  const other = page(false);
  await other.view.compare(["harmonic", "green"]);
  expect(other.store.get().scene.compare).toEqual(["harmonic"]);
});

it("choosing faces ends pulling, except while the cage is reshaped", () => {
  const { view, show, store } = page();
  show({ editingRest: true });
  view.element("face");
  expect([store.get().scene.pull, store.get().tools.element]).toEqual([true, "face"]);
  show({ editingRest: false });
  view.element("edge");
  expect([store.get().scene.pull, store.get().tools.element]).toEqual([false, "edge"]);
});
