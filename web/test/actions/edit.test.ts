import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { createEdit } from "../../src/actions/edit";
import { cageOf, createFake } from "../fake";

beforeEach(() => {
  vi.useFakeTimers();
});
afterEach(() => {
  vi.useRealTimers();
});

/** A page with a cage of two vertices, one of them selected. */
function page() {
  const fake = createFake();
  const edit = createEdit(fake.ctx);
  fake.showCage(cageOf(2));
  fake.show({ selected: { count: 1, last: 0, center: [0, 0, 0] } });
  fake.teach({ beginTransform: () => true, endTransform: (keep: boolean) => keep, nudge: () => true });
  return { ...fake, edit };
}

it("a gesture adds one undo step, a cancelled one adds none", () => {
  const { edit, did, store } = page();
  expect(edit.begin("grab", 0, 0)).toBe(true);
  expect(edit.begin("rotate", 0, 0), "one at a time").toBe(false);
  edit.drag(1, 1);
  expect(store.get().gesture).toBe("Move 0.25 along X");
  edit.end(true);
  edit.begin("scale", 0, 0);
  edit.end(false);
  expect([did, edit.active(), store.get().gesture]).toEqual([["Move 1 vertex"], false, null]);
});

it("typed numbers set the amount of a gesture", () => {
  const { edit, teach, store } = page();
  const amounts: (number | undefined)[] = [];
  teach({ typeTransform: (amount) => amounts.push(amount ?? Number.NaN) });
  edit.begin("grab", 0, 0);
  expect([edit.type("1"), edit.type("."), edit.type("5"), edit.type("q")]).toEqual([true, true, true, false]);
  expect([amounts.at(-1), store.get().gesture]).toEqual([1.5, "Move 0.25 along X  [1.5]"]);
});

it("consecutive nudges are one undo step, and come before the next command", () => {
  const { edit, did } = page();
  edit.nudge(1, 0);
  vi.advanceTimersByTime(300);
  edit.nudge(1, 0);
  vi.advanceTimersByTime(300);
  expect(did).toEqual([]);
  vi.advanceTimersByTime(300);
  edit.nudge(1, 0);
  edit.restEdit("split_edge");
  vi.advanceTimersByTime(600);
  expect(did).toEqual(["Nudge 1 vertex", "Nudge 1 vertex", "Split edge"]);
});

it("a gesture while reshaping moves the rest position; an invalid shape is taken back", () => {
  const { edit, teach, commands, did, problems, calls } = page();
  edit.setEditingRest(true);
  edit.begin("grab", 0, 0);
  edit.end(true);
  expect([commands, did]).toEqual([[{ do: "move_rest" }], ["Move 1 vertex of the cage"]]);
  teach({
    apply: () => {
      throw new Error("the cage has no inside");
    },
  });
  edit.begin("grab", 0, 0);
  edit.end(true);
  expect([calls.includes("revert"), problems[0]?.title, problems[0]?.message]).toEqual([
    true,
    "The cage cannot have this shape",
    "The cage has no inside.",
  ]);
});

it("an impossible edit is reported", () => {
  const { edit, teach, problems } = page();
  teach({
    apply: () => {
      throw new Error("select a face first");
    },
  });
  edit.restEdit("extrude_face");
  expect(problems[0]?.message).toBe("Select a face first.");
});
