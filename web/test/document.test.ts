import { expect, it } from "vitest";
import { cageOf, createFake, MODEL, memberOf, modelOf, reportOf, settled } from "./fake";

const [FIRST, SECOND] = [cageOf(8, 1), cageOf(12, 2)];

it("a cage without a check is checked; undoing a change of cage shows the stored check", async () => {
  const { asked, engine, show, store, teach } = createFake();
  const marked: unknown[] = [];
  teach({ showFaults: (problems) => marked.push(problems) });
  engine.setCage(FIRST, undefined);
  expect([store.get().cage?.info.vertices, store.get().check]).toEqual([8, null]);
  await settled();
  await settled();
  asked[0]?.resolve(FIRST.check);
  await settled();
  engine.setCage(SECOND, "Make a cage");
  expect([store.get().check, store.get().undo]).toEqual([null, "Make a cage"]);
  show({ cage: 1 });
  await settled();
  await settled();
  expect([store.get().check, asked.length]).toEqual([FIRST.check, 1]);
  expect(marked).toEqual([FIRST.check, FIRST.check]);
});

it("a cage that comes with its check is not checked again", async () => {
  const { asked, showCage, store } = createFake();
  showCage(FIRST);
  await settled();
  expect([store.get().check, asked.length]).toEqual([FIRST.check, 0]);
});

it("a new cage has no weights: report, comparison and slice are reset; cached weights restore the report", () => {
  const { show, showCage, store, teach } = createFake();
  const report = reportOf();
  teach({ boundReport: () => report, cageState: () => undefined });
  store.set({
    scene: { ...store.get().scene, compare: ["harmonic", "green"], slice: "value" },
    earlier: [report],
  });
  show({ cage: 1, bound: true });
  expect(store.get()).toMatchObject({ bound: true, report, earlier: [], pullReady: false });
  expect(store.get().scene).toMatchObject({ compare: ["harmonic"], slice: "off" });
  showCage(FIRST);
  expect(store.get()).toMatchObject({ bound: false, report: null });
  show({ bound: true });
  expect(store.get().report).toBe(report);
});

it("a new cage cancels a bind in progress", async () => {
  const { ctx, showCage } = createFake();
  const bind = ctx.queue.add(
    "bind",
    (signal) =>
      new Promise<boolean>((done) => {
        signal.addEventListener("abort", () => done(true));
      }),
  );
  await settled();
  showCage(FIRST);
  expect(await bind).toBe(true);
});

it("a single model keeps its displayed name; repeated notices are listed once", () => {
  const { showModel, store } = createFake();
  showModel({ ...MODEL, notices: ["a"] });
  store.set({ model: { ...MODEL, name: "Rat", notices: ["a", "b"] }, cageClip: "Walk" });
  showModel({ ...MODEL, notices: ["a", "c"] });
  expect(store.get()).toMatchObject({ model: { name: "Rat", notices: ["a", "b", "c"] }, cageClip: null });
  showModel(modelOf([memberOf(0, "cube.obj"), memberOf(1, "hat.glb")]));
  expect(store.get().model?.name).toBe("cube.obj and 1 more");
});

it("equal values keep their identity, so that panels are not drawn again", () => {
  const { show, store } = createFake();
  show({ poses: [{ name: "a", fits: true, seconds: 1, interpolation: null, hash: 7 }], shares: [1] });
  const { poses, shares } = store.get();
  show({ poses: [{ name: "a", fits: true, seconds: 1, interpolation: null, hash: 7 }], shares: [0.5] });
  expect([store.get().poses === poses, store.get().shares === shares]).toEqual([true, false]);
});
