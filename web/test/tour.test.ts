import { expect, it, vi } from "vitest";
import type { View } from "../src/actions/view";
import type { BindOptions } from "../src/contract";
import { stopOf } from "../src/share";
import { createGuide, type GuideNeeds } from "../src/tour/guide";
import { isOf, STOPS, type StopName } from "../src/tour/stops";
import { cageOf, createFake, MODEL, reportOf, settled } from "./fake";

/** A page with the rat sample in its own cage, and a tour whose binds finish at once. */
function page() {
  const fake = createFake();
  const { store } = fake;
  fake.showModel(MODEL);
  fake.showCage(cageOf(8));
  fake.show({ sample: "rat", sampleCage: true, bound: true });
  const opened: string[] = [];
  const binds: BindOptions[] = [];
  vi.stubGlobal("location", { hash: "", pathname: "/", search: "" });
  vi.stubGlobal("window", { history: { replaceState: () => undefined } });
  const view: Partial<View> = {
    scene: (patch) => store.set({ scene: { ...store.get().scene, ...patch } }),
    sliceNow: async () => true,
    compare: async () => undefined,
  };
  const files: GuideNeeds["files"] = {
    async openSample(id) {
      guide.beforeOpen(id);
      opened.push(id);
      fake.show({ sample: id, sampleCage: true });
      return true;
    },
    prepared: async () => undefined,
  };
  const guide = createGuide(fake.ctx, {
    bind: {
      async start() {
        const { bindOptions } = store.get();
        binds.push(bindOptions);
        store.set({ report: reportOf(bindOptions) });
        return true;
      },
    },
    edit: { setEditingRest: () => undefined },
    view: view as View,
    files,
    works: { flush: async () => undefined, open: async () => true, restore: async () => false },
  });
  return { ...fake, guide, opened, binds, view, files };
}

it("leaving the tour restores the user's settings and sample", async () => {
  const { guide, store, opened, binds } = page();
  const own: BindOptions = { ...store.get().bindOptions, grid: 128, tau: 1e-7 };
  store.set({ bindOptions: own, step: "cage", seeOpen: true });
  await guide.start(STOPS.indexOf("coordinates"));
  expect(opened).toEqual(["clamp"]);
  await guide.go(STOPS.indexOf("paper"));
  expect(store.get()).toMatchObject({
    bindOptions: { grid: 16, method: "classic" },
    seeOpen: false,
    step: "bind",
  });
  expect(store.get().tour?.reports.map(({ grid }) => grid)).toEqual([16]);
  await guide.end();
  expect(store.get()).toMatchObject({ tour: null, bindOptions: own, step: "cage", seeOpen: true });
  expect(store.get().scene.colour, "as it was").toBe("material");
  expect(opened.at(-1)).toBe("rat");
  expect(binds.every(({ memory_limit }) => memory_limit === own.memory_limit)).toBe(true);
});

it.each<[StopName, string]>([
  ["grid", "its slice is shown"],
  ["splat", "its capture has a cage and is bound"],
])("stop %s is busy until %s", async (stop) => {
  const { guide, store, view, files } = page();
  let end = () => {};
  const ended = new Promise<void>((resolve) => {
    end = resolve;
  });
  view.sliceNow = () => ended.then(() => true);
  files.prepared = () => ended;
  const started = guide.start(STOPS.indexOf(stop));
  await settled();
  expect(store.get().tour?.doing).not.toBeNull();
  end();
  await started;
  expect(store.get().tour?.doing).toBeNull();
});

it("opening a file ends the tour and restores the settings", async () => {
  const { guide, store, opened } = page();
  const own = store.get().bindOptions;
  await guide.start(STOPS.indexOf("smoothing"));
  guide.beforeOpen(null);
  expect(store.get()).toMatchObject({ tour: null, bindOptions: own });
  await guide.end();
  expect(opened, "nothing else is opened").toEqual([]);
});

it("links count stops from 1; invalid numbers mean the first one", () => {
  expect(["#tour=1", "#tour=10", "#tour=x", "#tour=-4", "#sample=rat"].map(stopOf)).toEqual([
    0,
    9,
    0,
    0,
    undefined,
  ]);
});

it("a report matches the options of its bind although Rust rounds tau to f32", () => {
  const report = reportOf({ grid: 32, tau: Math.fround(1e-3) });
  expect(isOf(report, { grid: 32, tau: 1e-3 })).toBe(true);
  expect(isOf(report, { grid: 32, tau: 1e-4 })).toBe(false);
});
