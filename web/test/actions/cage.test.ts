import { named } from "@cagework/core/session/client";
import { effect } from "@preact/signals";
import { expect, it } from "vitest";
import { createCage } from "../../src/actions/cage";
import { cageOf, createFake, settled } from "../fake";

function page() {
  const fake = createFake();
  const grids: number[] = [];
  let changes = 0;
  const cage = createCage(fake.ctx, {
    refine: (grid) => grids.push(grid),
    carry: () => Promise.resolve(),
    carryAlong: () => Promise.resolve(true),
  });
  effect(() => {
    if (fake.store.get().cage) changes += 1;
  });
  const heights = () => fake.engine.restPositions()[0];
  return { ...fake, cage, grids, changes: () => changes, height: heights };
}

it("a generated cage replaces the previous one; undo restores that and its problems", async () => {
  const { cage, asked, store, ctx, height } = page();
  const first = cage.make();
  await settled();
  asked[0]?.resolve(cageOf(8, 1));
  await first;
  expect(ctx.history.undoLabel, "the first cage adds no undo step").toBeUndefined();
  const checked = store.get().check;
  const second = cage.make();
  await settled();
  asked[1]?.resolve(cageOf(12, 2));
  await second;
  expect([height(), store.get().cage?.info.vertices]).toEqual([2, 12]);
  await ctx.history.undo();
  expect([height(), store.get().cage?.info.vertices, store.get().check]).toEqual([1, 8, checked]);
  await ctx.history.redo();
  expect(height()).toBe(2);
  expect(asked.length, "nothing is checked again").toBe(2);
});

it("undoing a new cage restores pose and blend", async () => {
  const { cage, asked, store, engine, said, ctx } = page();
  const first = cage.make();
  await settled();
  asked[0]?.resolve(cageOf(8, 1));
  await first;
  engine.setCagePositions(new Float32Array(24).fill(7));
  store.set({ posed: true, poses: [{ name: "a", positions: new Float32Array(24) }], shares: [0.5] });
  const second = cage.make();
  await settled();
  asked[1]?.resolve(cageOf(12, 2));
  await second;
  expect(said).toEqual(["The pose and saved poses belong to the previous cage and are kept with it."]);
  store.set({ shares: [0] });
  await ctx.history.undo();
  expect([engine.cagePositions()[0], engine.restPositions()[0], store.get().shares]).toEqual([7, 1, [0.5]]);
});

it("of two requested cages only the later is used", async () => {
  const { cage, asked, problems, height, store } = page();
  const both = [cage.make(), cage.make()];
  await settled();
  asked.at(-1)?.resolve(cageOf(8, 5));
  expect(await Promise.all(both)).toEqual([false, true]);
  expect([height(), problems.length, store.get().cageProgress]).toEqual([5, 0, null]);
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
  const { check } = cageOf(8);
  asked[0]?.resolve(check);
  await settled();
  expect(store.get().check).toBe(check);
});

it("tells when a cage has more vertices than wanted", async () => {
  const { cage, asked, said } = page();
  const made = cage.make();
  await settled();
  asked[0]?.resolve(cageOf(100));
  await made;
  expect(said).toEqual(["The model's holes and gaps need 100 vertices instead of 80."]);
});

it("a generated cage lists the gaps that it closes", async () => {
  const { cage, asked, store } = page();
  const made = cage.make();
  await settled();
  asked[0]?.resolve({ ...cageOf(8), notices: ["the cage closes the gap"] });
  await made;
  expect(store.get().cage?.info.notices).toEqual(["the cage closes the gap"]);
});

it("offers one cage per part if a cage joins separate parts", async () => {
  const fake = createFake();
  const { asked, said, store } = fake;
  const cage = createCage(fake.ctx, {
    refine: () => undefined,
    carry: () => Promise.resolve(),
    carryAlong: () => Promise.resolve(true),
  });
  const made = cage.make();
  await settled();
  asked[0]?.resolve({ ...cageOf(8), bridged: 3 });
  await made;
  expect(said).toEqual(["The model has 3 separate parts; this cage joins them."]);
  fake.offered[0]?.run();
  await settled();
  expect(asked[1]?.input).toMatchObject({ per_component: true });
  expect(store.get().cageOptions.per_component, "the switch shows it").toBe(true);
});

it("a problem's button repairs, refines the grid, or generates another cage", async () => {
  const { cage, asked, grids, problems, store, height } = page();
  cage.mend({ kind: "grid", cells: 128 });
  expect(grids).toEqual([128]);
  cage.mend({ kind: "repair", repair: "grow" });
  await settled();
  expect([asked[0]?.input, store.get().busy]).toEqual(["grow", "Repairing the cage"]);
  asked[0]?.reject(named("Error", "growing did not help"));
  await settled();
  expect(problems).toMatchObject([{ title: "The repair failed", message: "Growing did not help." }]);
  expect(store.get().busy).toBeNull();
  cage.mend({ kind: "repair", repair: "weld" });
  await settled();
  asked[1]?.resolve(cageOf(8, 7));
  await settled();
  expect(height()).toBe(7);
  store.set({ cageSource: "file" });
  cage.mend({ kind: "regenerate" });
  await settled();
  expect([asked[2]?.kind, store.get().cageSource]).toEqual(["cage", "auto"]);
});

it("a file that is not a cage keeps the current cage and its source", async () => {
  const { cage, asked, problems, store, changes } = page();
  const file = { name: "cage.obj", path: "cage.obj", file: new Blob() };
  const loaded = cage.load([file]);
  await settled();
  asked[0]?.reject(named("Format", "cage.obj: no faces"));
  expect(await loaded).toBe(false);
  expect(problems).toMatchObject([{ title: "This cage cannot be used", fix: "file" }]);
  expect([store.get().cageSource, changes()]).toEqual(["auto", 0]);
});
