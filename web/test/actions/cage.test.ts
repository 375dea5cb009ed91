import { named } from "@cagework/core/session/client";
import { expect, it } from "vitest";
import { createCage } from "../../src/actions/cage";
import { createEdit } from "../../src/actions/edit";
import type { CageSnapshot } from "../../src/actions/poses";
import type { App } from "../../src/app";
import type { CageOptions } from "../../src/contract";
import { hasUnmadeCage, isCageSparse } from "../../src/derived";
import { nextActions } from "../../src/ui/panel";
import { cageOf, createFake, memberOf, modelOf, settled } from "../fake";

function page() {
  const fake = createFake();
  const grids: number[] = [];
  const carried: CageSnapshot[] = [];
  const cage = createCage(fake.ctx, {
    edit: createEdit(fake.ctx),
    know: fake.mirror.know,
    made: fake.mirror.made,
    bind: { again: async ({ grid }) => grids.push(grid ?? 0) > 0 },
    poses: { carry: async (before) => carried.push(before) > 0 },
  });
  const height = () => fake.engine.restPositions()[0];
  return { ...fake, cage, grids, carried, height, offers: () => fake.offered };
}

it("a generated cage replaces the previous cage as one undo step; the first cage adds no step", async () => {
  const { cage, asked, store, did, height } = page();
  const [first, second] = [cageOf(8, 1), cageOf(12, 2)];
  for (const made of [first, second]) {
    const making = cage.make();
    await settled();
    asked.at(-1)?.resolve(made);
    await making;
    expect([height(), store.get().check]).toEqual([made.positions[0], made.check]);
  }
  expect([did, store.get().cage?.info.vertices]).toEqual([["Make a cage"], 12]);
  await settled();
  expect(asked.length, "a worker has checked each already").toBe(2);
});

it("poses of the previous cage do not fit a new cage: the page offers to carry them over", async () => {
  const { cage, asked, said, show, showCage, carried, teach, offers } = page();
  showCage(cageOf(8, 1));
  show({ poses: [{ name: "a", fits: true, seconds: 1, interpolation: null, hash: 7 }], shares: [0.5] });
  teach({ carriable: () => Float32Array.of(7) });
  const made = cage.make();
  await settled();
  asked[0]?.resolve(cageOf(12, 2));
  await made;
  expect(said).toEqual([expect.stringMatching(/poses/i)]);
  offers()[0]?.run();
  expect(carried).toMatchObject([{ poses: Float32Array.of(7), shares: [0.5] }]);
});

it("going back to the previous cage undoes the steps since, and nothing if the cage is back already", async () => {
  const { cage, asked, show, showCage, teach, offers } = page();
  showCage(cageOf(8, 1));
  show({ cageId: 1, posed: true });
  // The cage of each step, the newest last.
  const cages = [1, 2, 2];
  let undone = 0;
  teach({
    undo() {
      const before = cages.at(-2 - undone);
      if (before === undefined) return false;
      undone += 1;
      show({ cageId: before });
      return true;
    },
  });
  const made = cage.make();
  await settled();
  asked[0]?.resolve(cageOf(12, 2));
  await made;
  show({ cageId: 2 });
  const back = offers()[1];
  back?.run();
  expect(undone, "a pull and the new cage").toBe(2);
  back?.run();
  expect(undone).toBe(2);
});

it("adding a control carries the poses over; smoothing does not need to", () => {
  const { cage, engine, commands, carried, showCage, teach } = page();
  showCage(cageOf(4));
  expect(cage.setSmooth(2)).toBe(true);
  expect([commands, carried]).toEqual([[{ do: "subdivide", steps: 2 }], []]);
  teach({
    apply: () => void engine.setCage(cageOf(5), undefined),
  });
  cage.change("Put a point inside", { do: "add_control", kind: "point", places: [[0, 0, 0]] });
  expect(carried.map(({ cage: { positions } }) => positions.length)).toEqual([12]);
  // Other controls in the same number: the poses no longer fit.
  const saved = [new Float32Array(30), new Float32Array(15)];
  teach({ apply: () => undefined, carriable: () => saved.shift() ?? new Float32Array() });
  cage.change("Other controls", { do: "replace_controls", positions: [], elements: [] });
  expect(carried.map(({ cage: { positions } }) => positions.length)).toEqual([12, 15]);
});

it("of two requested cages only the second is used", async () => {
  const { cage, asked, problems, height, store } = page();
  const both = [cage.make(), cage.make()];
  await settled();
  asked.at(-1)?.resolve(cageOf(8, 5));
  expect(await Promise.all(both)).toEqual([false, true]);
  expect([height(), problems.length, store.get().cageProgress]).toEqual([5, 0, null]);
});

it("after a change of the cage settings, the next action is to make the cage", async () => {
  const { cage, asked, store, ctx } = page();
  const app = { ctx, store, cage, run: () => undefined, go: () => undefined } as unknown as App;
  store.set({ step: "cage" });
  const labels = () => {
    const { primary, second } = nextActions(store.get(), app);
    return [primary.label, second?.label];
  };
  const make = async (vertices: number) => {
    const made = cage.make();
    await settled();
    asked.at(-1)?.resolve(cageOf(vertices));
    await made;
  };
  const change = (patch: Partial<CageOptions>) =>
    store.set({ cageOptions: { ...store.get().cageOptions, ...patch } });
  await make(76);
  expect(labels()).toEqual(["Bind the model", "Make this cage"]);
  store.set({ bound: true });
  expect(labels()).toEqual(["Pose it", "Make this cage"]);
  expect(isCageSparse(store.get()), "76 of 80").toBe(false);
  change({ target: 400 });
  expect(labels()).toEqual(["Make this cage", "Pose it"]);
  expect(isCageSparse(store.get()), "not made yet").toBe(false);
  await make(116);
  expect([labels()[0], isCageSparse(store.get())]).toEqual(["Bind the model", true]);
  store.set({ cageSource: "hull" });
  expect(labels()).toEqual(["Make this cage", "Bind the model"]);
  // A cage from the convex hull does not use the options of automatic cages.
  await make(24);
  change({ target: 100 });
  expect([labels()[0], isCageSparse(store.get())]).toEqual(["Bind the model", false]);
  store.set({ cageSource: "file" });
  expect(labels()).toEqual(["Open a cage file", "Bind the model"]);
});

it("changed settings are previewed, and the preview is taken when it is made", async () => {
  const { cage, asked, store, calls, height } = page();
  const change = (target: number) => store.set({ cageOptions: { ...store.get().cageOptions, target } });
  store.set({ step: "cage" });
  const first = cage.make();
  await settled();
  asked.at(-1)?.resolve(cageOf(8, 1));
  await first;
  await cage.preview();
  expect([asked.length, store.get().cagePreview], "nothing to preview").toEqual([1, null]);
  change(100);
  const previewing = cage.preview();
  await settled();
  change(200);
  void cage.preview();
  expect(asked.length, "one at a time").toBe(2);
  asked.at(-1)?.resolve(cageOf(10, 2));
  await settled();
  expect([store.get().cagePreview, height()]).toEqual([10, 1]);
  asked.at(-1)?.resolve(cageOf(12, 3));
  await previewing;
  expect([store.get().cagePreview, calls.filter((name) => name === "showDraft").length]).toEqual([12, 2]);
  await cage.make();
  expect([asked.length, height(), store.get().cage?.info.vertices]).toEqual([3, 3, 12]);
  await cage.preview();
  expect(store.get().cagePreview).toBe(null);
});

it("undo of a cage returns to the settings of the cage that it shows", async () => {
  const { cage, asked, store, show } = page();
  const make = async (vertices: number) => {
    store.set({ cageOptions: { ...store.get().cageOptions, target: vertices } });
    const made = cage.make();
    await settled();
    asked.at(-1)?.resolve(cageOf(vertices));
    await made;
  };
  await make(80);
  await make(400);
  for (const [key, vertices] of [
    [1, 80],
    [2, 400],
  ] as const) {
    show({ cage: key });
    expect([store.get().cageOptions.target, hasUnmadeCage(store.get())]).toEqual([vertices, false]);
  }
});

it("cancel keeps the current cage", async () => {
  const { cage, asked, store, problems } = page();
  const made = cage.make();
  await settled();
  cage.cancel();
  await made;
  expect([asked[0]?.cancelled, store.get().cage, store.get().cageProgress, problems]).toEqual([
    true,
    null,
    null,
    [],
  ]);
});

it("a box is checked; results of an older check are dropped", async () => {
  const { cage, asked, store } = page();
  store.set({ cageSource: "box", boxDivisions: 3 });
  await cage.make();
  expect([store.get().cage?.usable, store.get().check]).toEqual([true, null]);
  await settled();
  await settled();
  const { check } = cageOf(8);
  asked[0]?.resolve(check);
  await settled();
  expect(store.get().check).toBe(check);
});

it("reports a cage with more vertices than requested", async () => {
  const { cage, asked, said } = page();
  const made = cage.make();
  await settled();
  asked[0]?.resolve(cageOf(100));
  await made;
  expect(said).toEqual(["The model's shape needs more vertices: 100 instead of 80."]);
});

it("a generated cage lists the gaps that it closes", async () => {
  const { cage, asked, store } = page();
  const made = cage.make();
  await settled();
  asked[0]?.resolve({ ...cageOf(8), notices: ["the cage closes the gap"] });
  await made;
  expect(store.get().cage?.info.notices).toEqual(["the cage closes the gap"]);
});

it.each([
  ["model has", ["cube.obj"]],
  ["models have", ["body.obj", "shirt.obj"]],
])("offers one cage per part if a cage joins separate parts: the %s", async (subject, names) => {
  const all = page();
  const { asked, cage, said, store } = all;
  all.showModel(modelOf(names.map((name, id) => memberOf(id, name))));
  const made = cage.make();
  await settled();
  asked[0]?.resolve({ ...cageOf(8), bridged: 3 });
  await made;
  expect(said).toEqual([`The ${subject} 3 separate parts; this cage joins them.`]);
  all.offers()[0]?.run();
  await settled();
  expect(asked[1]?.input).toMatchObject({ per_component: true });
  expect(store.get().cageOptions.per_component, "the switch shows it").toBe(true);
});

it("a problem's button repairs, refines the grid, or generates another cage", async () => {
  const { cage, asked, grids, problems, store, height } = page();
  cage.applyFix({ kind: "grid", cells: 128 });
  expect(grids).toEqual([128]);
  cage.applyFix({ kind: "repair", repair: "grow" });
  await settled();
  expect([asked[0]?.input, store.get().busy]).toEqual(["grow", "Repairing the cage"]);
  asked[0]?.reject(named("Error", "growing did not help"));
  await settled();
  expect(problems).toMatchObject([{ title: "The repair failed", message: "Growing did not help." }]);
  expect(store.get().busy).toBeNull();
  cage.applyFix({ kind: "repair", repair: "weld" });
  await settled();
  asked[1]?.resolve(cageOf(8, 7));
  await settled();
  expect(height()).toBe(7);
  store.set({ cageSource: "file" });
  cage.applyFix({ kind: "regenerate" });
  await settled();
  expect([asked[2]?.kind, store.get().cageSource]).toEqual(["cage", "auto"]);
});

it("a file that is not a cage keeps the current cage and its source", async () => {
  const { cage, asked, problems, store } = page();
  const file = { name: "cage.obj", path: "cage.obj", file: new Blob() };
  const loaded = cage.load([file]);
  await settled();
  asked[0]?.reject(named("Format", "cage.obj: no faces"));
  expect(await loaded).toBe(false);
  expect(problems).toMatchObject([{ title: "This cage cannot be used", fix: "file" }]);
  expect([store.get().cageSource, store.get().cage]).toEqual(["auto", null]);
});
