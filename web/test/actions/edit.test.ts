import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { createEdit } from "../../src/actions/edit";
import { cageOf, createFake } from "../fake";

beforeEach(() => {
  vi.useFakeTimers();
});
afterEach(() => {
  vi.useRealTimers();
});

/** A page with a cage of two vertices; each gesture moves both by 1. */
function page() {
  const fake = createFake();
  const changed: number[] = [];
  const edit = createEdit(fake.ctx, (state) => changed.push(state.info.vertices));
  const { positions, corners } = cageOf(2);
  fake.store.set({ cage: fake.engine.setCage(positions, corners) });
  const height = () => fake.engine.cagePositions()[0] ?? 0;
  const up = () => fake.engine.setCagePositions(new Float32Array(6).fill(height() + 1));
  fake.teach({
    beginTransform: () => true,
    dragTransform: up,
    endTransform: (keep: boolean) => keep,
    nudge: () => {
      up();
      return true;
    },
  });
  return { ...fake, edit, changed, height };
}

it("reshaping starts at rest; undo restores the pose and its blend", async () => {
  const { edit, ctx, store, height } = page();
  store.set({ shares: [1] });
  expect(edit.begin("grab", 0, 0)).toBe(true);
  edit.drag(1, 1);
  edit.end(true);
  edit.setEditingRest(true);
  expect([store.get().shares, ctx.history.undoLabel]).toEqual([[0], "Reset the pose"]);
  await ctx.history.undo();
  expect([store.get().shares, height(), store.get().editingRest]).toEqual([[1], 1, false]);
});

it("leaving reshape mode ends face selection", () => {
  const { edit, store } = page();
  edit.setEditingRest(true);
  store.set({ element: "face" });
  edit.setEditingRest(false);
  expect(store.get().element).toBe("vertex");
});

it("a gesture adds one undo step, a cancelled one adds none", async () => {
  const { edit, ctx, store, height } = page();
  expect(edit.begin("grab", 0, 0)).toBe(true);
  expect(edit.begin("rotate", 0, 0), "one at a time").toBe(false);
  edit.drag(1, 1);
  edit.drag(2, 2);
  edit.end(true);
  expect([height(), ctx.history.undoLabel, store.get().posed]).toEqual([2, "Move 1 vertex", true]);
  await ctx.history.undo();
  expect([height(), store.get().posed]).toEqual([0, false]);
  await ctx.history.redo();
  expect(height()).toBe(2);
  edit.begin("scale", 0, 0);
  edit.end(false);
  expect([ctx.history.undoLabel, edit.active(), store.get().gesture]).toEqual(["Move 1 vertex", false, null]);
});

it("typed numbers set the amount of a gesture", () => {
  const { edit, teach, store } = page();
  const amounts: (number | undefined)[] = [];
  teach({ typeTransform: (amount) => amounts.push(amount ?? Number.NaN) });
  edit.begin("grab", 0, 0);
  expect([edit.type("1"), edit.type("."), edit.type("5"), edit.type("q")]).toEqual([true, true, true, false]);
  expect([amounts.at(-1), store.get().gesture]).toEqual([1.5, "Move  [1.5]"]);
});

it("consecutive nudges are one undo step", async () => {
  const { edit, ctx, store, height } = page();
  store.set({ selected: { count: 2, last: 0, center: null } });
  edit.nudge(1, 0);
  vi.advanceTimersByTime(300);
  edit.nudge(1, 0);
  expect(ctx.history.undoLabel).toBeUndefined();
  vi.advanceTimersByTime(600);
  expect(ctx.history.undoLabel).toMatch(/^Nudge/);
  await ctx.history.undo();
  expect(height()).toBe(0);
});

it("a reshape replaces the cage; an invalid one is rejected", async () => {
  const { edit, ctx, teach, changed, problems, engine, height } = page();
  edit.setEditingRest(true);
  edit.begin("grab", 0, 0);
  edit.drag(1, 1);
  edit.end(true);
  expect([changed, ctx.history.undoLabel, engine.restPositions()[0]]).toEqual([
    [2],
    "Move 1 vertex of the cage",
    1,
  ]);
  await ctx.history.undo();
  expect([changed, engine.restPositions()[0]]).toEqual([[2, 2], 0]);
  teach({
    commitRest: () => {
      throw new Error("the cage has no inside");
    },
  });
  edit.begin("grab", 0, 0);
  edit.drag(1, 1);
  edit.end(true);
  expect([height(), problems[0]?.title, problems[0]?.message]).toEqual([
    0,
    "The cage cannot have this shape",
    "The cage has no inside.",
  ]);
});

it("an impossible edit is reported and changes nothing", () => {
  const { edit, teach, problems, changed } = page();
  teach({
    editRest: () => {
      throw new Error("select a face first");
    },
  });
  edit.restEdit("extrude_face");
  expect([problems[0]?.message, changed]).toEqual(["Select a face first.", []]);
});
