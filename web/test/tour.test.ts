import { expect, it, vi } from "vitest";
import type { View } from "../src/actions/view";
import type { BindOptions } from "../src/contract";
import { stopOf } from "../src/share";
import type { TourPlace } from "../src/state";
import { createGuide, type GuideNeeds } from "../src/tour/guide";
import { isOf, STOPS, type StopName, stopsOf } from "../src/tour/stops";
import { cageOf, createFake, MODEL, reportOf, settled } from "./fake";

const placeOf = (stop: StopName): TourPlace => {
  const name = STOPS.first.includes(stop) ? "first" : "how";
  return { name, stop: STOPS[name].indexOf(stop) };
};

/**
 * A page with the rat sample in its own cage, and a tour whose binds finish at once. `totals`: times that the reports of
 * binds name, in turns.
 */
function page(totals = [3]) {
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
        const total = totals[(binds.length - 1) % totals.length] ?? 0;
        const { timings_ms } = reportOf();
        store.set({ report: reportOf({ ...bindOptions, timings_ms: { ...timings_ms, total } }) });
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
  await guide.start(placeOf("coordinates"));
  expect(opened).toEqual(["clamp"]);
  await guide.go(placeOf("paper").stop);
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
  const started = guide.start(placeOf(stop));
  await settled();
  expect(store.get().tour?.doing).not.toBeNull();
  end();
  await started;
  expect(store.get().tour?.doing).toBeNull();
});

it("opening a file ends the tour and restores the settings", async () => {
  const { guide, store, opened } = page();
  const own = store.get().bindOptions;
  await guide.start(placeOf("smoothing"));
  guide.beforeOpen(null);
  expect(store.get()).toMatchObject({ tour: null, bindOptions: own });
  await guide.end();
  expect(opened, "nothing else is opened").toEqual([]);
});

it("links count stops from 1; invalid numbers mean the first one", () => {
  const stops = ["#tour=1", "#tour=10", "#tour=x", "#tour=-4"].map((link) => stopOf(link)?.stop);
  expect(stops).toEqual([0, 9, 0, 0]);
  expect([stopOf("#first-steps=2"), stopOf("#tour=3")?.name]).toEqual([{ name: "first", stop: 1 }, "how"]);
  expect([stopOf("#sample=rat"), stopOf("")]).toEqual([undefined, undefined]);
});

it("a tour begins with the first steps, and continues at the stop where the user left it", async () => {
  const { guide, store } = page();
  const items = new Map<string, string>();
  vi.stubGlobal("localStorage", {
    getItem: (key: string) => items.get(key) ?? null,
    setItem: (key: string, value: string) => items.set(key, value),
  });
  const now = () => store.get().tour && [store.get().tour?.name, store.get().tour?.stop];
  await guide.start();
  expect(now()).toEqual(["first", 0]);
  await guide.go(2, "how");
  await guide.end();
  await guide.start();
  expect(now()).toEqual(["how", 2]);
  await guide.go(STOPS.how.length);
  expect(now(), "the last stop ends the tour").toBeNull();
  await guide.start();
  expect(now()).toEqual(["first", 0]);
});

it("times are the median of three binds after a first one", async () => {
  const { guide, store, binds } = page([90, 5, 7, 6]);
  await guide.start(placeOf("times"));
  const { binds: ways } = stopsOf(true).times;
  expect(binds.length).toBe(4 * ways.length);
  expect(store.get().tour?.reports.map((report) => report.timings_ms.total)).toEqual(ways.map(() => 6));
});

it("a report matches the options of its bind although Rust rounds tau to f32", () => {
  const report = reportOf({ grid: 32, tau: Math.fround(1e-3) });
  expect(isOf(report, { grid: 32, tau: 1e-3 })).toBe(true);
  expect(isOf(report, { grid: 32, tau: 1e-4 })).toBe(false);
});
