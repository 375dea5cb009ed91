/** Smooth cages and inner controls: their commands, and drawing bones by clicks. */

import { expect, test } from "vitest";
import { createBind } from "../../src/actions/bind";
import { createCage } from "../../src/actions/cage";
import { createControls } from "../../src/actions/controls";
import { createEdit } from "../../src/actions/edit";
import { cageOf, createFake, PLAIN_CONTROLS } from "../fake";

/** A page with a cage of four vertices. */
function page() {
  const fake = createFake();
  const edit = createEdit(fake.ctx);
  const cage = createCage(fake.ctx, {
    edit,
    know: fake.mirror.know,
    made: fake.mirror.made,
    bind: createBind(fake.ctx),
    poses: { carry: async () => true },
  });
  fake.showCage(cageOf(4));
  return { ...fake, controls: createControls(fake.ctx, cage.change, edit.setEditingRest) };
}

test("a control that does not fit is reported", () => {
  const { controls, teach, problems } = page();
  teach({
    apply() {
      throw new Error("control 0 is outside the cage: move it in");
    },
  });
  expect(controls.add("point", [[9, 9, 9]])).toBe(false);
  expect(problems.map(({ message }) => message)).toEqual(["Control 0 is outside the cage: move it in."]);
});

test("clicks draw a bone, a double click ends it", () => {
  const { controls, commands, store } = page();
  controls.arm("line");
  expect(store.get()).toMatchObject({ placing: "line", editingRest: true });
  controls.place(10, 10);
  controls.place(50, 10);
  expect(commands).toEqual([]);
  controls.place(52, 11);
  expect(store.get().placing).toBe(null);
  const places = [
    [10, 10, 0],
    [50, 10, 0],
  ];
  expect(commands).toEqual([{ do: "add_control", kind: "line", places }]);
});

test("one click makes a point but no bone", () => {
  const { controls, commands, store } = page();
  controls.arm("line");
  controls.place(10, 10);
  controls.finish();
  expect(commands).toEqual([]);
  controls.arm("point");
  controls.place(30, 20);
  expect(commands).toEqual([{ do: "add_control", kind: "point", places: [[30, 20, 0]] }]);
  expect(store.get().placing).toBe(null);
});

test("a link contains smoothing and inner controls; opening it adds no undo step", () => {
  const { controls, showCage } = page();
  expect(controls.shared()).toBe(undefined);
  const elements = [{ point: 0 }];
  const positions = Float32Array.of(...new Float32Array(12), 0.25, 0.5, 0);
  showCage({ ...cageOf(5), positions, controls: { ...PLAIN_CONTROLS, smooth: 1, inner: 1, elements } });
  const shared = controls.shared();
  expect(shared?.inner).toEqual([0.25, 0.5, 0]);
  const other = page();
  if (shared) other.controls.takeShared(shared);
  expect(other.commands).toEqual([
    { do: "subdivide", steps: 1 },
    { do: "set_radius", radius: null },
    { do: "replace_controls", positions: [[0.25, 0.5, 0]], elements },
  ]);
  expect([other.did, other.calls.includes("amend")]).toEqual([[], true]);
});
