/** Smooth cages and controls inside: undo, poses, and drawing bones by clicks. */

import { named } from "@cagework/core/session/client";
import { expect, test } from "vitest";
import { createCage, type Posed } from "../../src/actions/cage";
import { createControls } from "../../src/actions/controls";
import { createEdit } from "../../src/actions/edit";
import { cageOf, createFake, type Fake, settled } from "../fake";

const BEFORE = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1);

function actions(fake: Fake) {
  const carried: Posed[] = [];
  const cage = createCage(fake.ctx, {
    refine: () => undefined,
    carry: () => Promise.resolve(),
    carryAlong: (before) => Promise.resolve(carried.push(before) > 0),
  });
  const edit = createEdit(fake.ctx, cage.adopt);
  cage.adopt(fake.ctx.session().takeCage({ ...cageOf(4), positions: BEFORE }), cageOf(4).check);
  fake.store.set({ sampleCage: true, sample: "rat" });
  return { cage, edit, carried, controls: createControls(fake.ctx, cage, edit) };
}

test("smoothing keeps the pose, binds again, and can be undone and redone", async () => {
  const fake = createFake();
  const { cage, carried } = actions(fake);
  const pose = BEFORE.map((x) => x + 1);
  fake.engine.setCagePositions(pose);
  fake.store.set({ bound: true });
  const { revision } = fake.engine;
  expect(cage.setSmooth(2)).toBe(true);
  expect(fake.engine.revision).toBe(revision + 1);
  expect(fake.store.get()).toMatchObject({ bound: false, sampleCage: true });
  expect(fake.store.get().cage?.controls.smooth).toBe(2);
  expect(fake.engine.cagePositions()).toEqual(pose);
  expect(carried).toEqual([]);
  await fake.ctx.history.undo();
  expect(fake.store.get().cage?.controls.smooth).toBe(0);
  expect(fake.engine.cagePositions()).toEqual(pose);
  await fake.ctx.history.redo();
  expect(fake.store.get().cage?.controls.smooth).toBe(2);
});

test("a control that does not fit is reported and changes nothing", () => {
  const fake = createFake();
  const { controls } = actions(fake);
  fake.teach({
    addControl() {
      throw named("Error", "control 0 is outside the cage: move it in");
    },
  });
  const { revision } = fake.engine;
  expect(controls.add("point", [[9, 9, 9]])).toBe(false);
  expect(fake.problems.map(({ message }) => message)).toEqual(["Control 0 is outside the cage: move it in."]);
  expect([fake.engine.revision, fake.ctx.history.undoLabel]).toEqual([revision, undefined]);
});

test("clicks draw a bone, a double click ends it, and poses are kept", async () => {
  const fake = createFake();
  const { controls, carried } = actions(fake);
  controls.arm("line");
  expect(fake.store.get()).toMatchObject({ placing: "line", editingRest: true });
  controls.place(10, 10);
  controls.place(50, 10);
  expect(fake.store.get().cage?.controls.inner).toBe(0);
  controls.place(52, 11);
  expect(fake.store.get().placing).toBe(null);
  expect(fake.store.get().cage?.controls.elements).toEqual([{ line: [0, 1] }]);
  expect(fake.engine.restPositions().slice(12)).toEqual(Float32Array.of(10, 10, 0, 50, 10, 0));
  expect(carried.map(({ positions }) => positions.length)).toEqual([12]);
  await settled();
  await fake.ctx.history.undo();
  expect(fake.engine.restPositions()).toEqual(BEFORE);
});

test("one click makes a point but no bone", () => {
  const fake = createFake();
  const { controls } = actions(fake);
  controls.arm("line");
  controls.place(10, 10);
  controls.finish();
  expect(fake.ctx.history.undoLabel).toBe(undefined);
  controls.arm("point");
  controls.place(30, 20);
  expect(fake.store.get().cage?.controls.elements).toEqual([{ point: 0 }]);
  expect(fake.store.get().placing).toBe(null);
});

test("a link contains smoothing and controls inside", () => {
  const fake = createFake();
  const { controls } = actions(fake);
  expect(controls.shared()).toBe(undefined);
  controls.add("point", [[0.25, 0.5, 0]]);
  const shared = controls.shared();
  expect(shared?.inner).toEqual([0.25, 0.5, 0]);
  const other = createFake();
  const there = actions(other);
  if (shared) there.controls.takeShared(shared);
  expect(other.engine.restPositions()).toEqual(fake.engine.restPositions());
  expect(other.store.get()).toMatchObject({ sampleCage: true, cage: { controls: { inner: 1 } } });
});
