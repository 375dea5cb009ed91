import { expect, it } from "vitest";
import { createEdit } from "../../src/actions/edit";
import { createPoses, freshName } from "../../src/actions/poses";
import { cageOf, createFake } from "../fake";

/** A page with a cage of two vertices, posed at height 1. */
function page() {
  const fake = createFake();
  const edit = createEdit(fake.ctx, () => undefined);
  const poses = createPoses(fake.ctx, edit);
  const { positions, corners } = cageOf(2);
  fake.store.set({ cage: fake.engine.setCage(positions, corners) });
  fake.engine.setCagePositions(positions.fill(1));
  const height = () => fake.engine.cagePositions()[0];
  return { ...fake, poses, height };
}

it("saving, renaming and deleting a pose are undo steps", async () => {
  const { poses, store, ctx, said } = page();
  poses.save();
  const [pose] = store.get().poses;
  if (!pose) throw new Error("no pose");
  expect([pose.name, store.get().shares, said]).toEqual([
    "Pose 1",
    [1],
    ['Saved as "Pose 1". It is the rest pose.'],
  ]);
  poses.rename(pose, " Wave ");
  poses.rename(pose, "  ");
  expect(store.get().poses.map(({ name }) => name)).toEqual(["Wave"]);
  const [renamed] = store.get().poses;
  if (renamed) poses.remove(renamed);
  expect(store.get().poses).toEqual([]);
  await ctx.history.undo();
  await ctx.history.undo();
  expect(store.get().poses).toEqual([pose]);
  await ctx.history.undo();
  expect(store.get().poses).toEqual([]);
});

it("showing a saved pose can be undone", async () => {
  const { poses, store, ctx, engine, height } = page();
  poses.save();
  engine.setCagePositions(new Float32Array(6).fill(5));
  const [pose] = store.get().poses;
  if (pose) poses.apply(pose);
  expect(height()).toBe(1);
  await ctx.history.undo();
  expect(height()).toBe(5);
});

it("showing a pose restores its pins; undo restores the previous ones", async () => {
  const { poses, store, engine, ctx } = page();
  const pin = { triangle: 3, weights: [1, 0, 0] } as never;
  store.set({ pins: [pin] });
  poses.save();
  store.set({ pins: [] });
  engine.setCagePositions(new Float32Array(6));
  const [pose] = store.get().poses;
  if (pose) poses.apply(pose);
  expect(store.get().pins).toEqual([pin]);
  await ctx.history.undo();
  expect(store.get().pins).toEqual([]);
  await ctx.history.redo();
  expect(store.get().pins).toEqual([pin]);
});

it("poses of a previous cage are carried over as one step", async () => {
  const { poses, store, ctx, engine, asked, height } = page();
  poses.save();
  const before = { cage: cageOf(2), positions: engine.cagePositions(), shares: [1], sampleCage: false };
  const { positions, corners } = cageOf(3);
  store.set({ cage: engine.setCage(positions, corners) });
  const done = poses.carry(before);
  await Promise.resolve();
  const job = asked.at(-1);
  // The current pose comes first, then the saved ones.
  expect(job).toMatchObject({ kind: "carry", input: { poses: [before.positions, before.positions] } });
  job?.resolve([new Float32Array(9).fill(7), new Float32Array(9).fill(8)]);
  await done;
  expect([height(), store.get().poses[0]?.positions[0], store.get().shares]).toEqual([7, 8, [1]]);
  await ctx.history.undo();
  expect([height(), store.get().poses[0]?.positions.length]).toEqual([positions[0], 6]);
});

it("one drag of a blend slider is one undo step", async () => {
  const { poses, store, ctx, teach, engine, height } = page();
  poses.save();
  const blended: number[][] = [];
  teach({
    blend(_: readonly Float32Array[], from: Float32Array, before: Float32Array, shares: Float32Array) {
      blended.push([from[0] ?? 0, ...before, ...shares]);
      engine.setCagePositions(new Float32Array(6).fill(shares[0] ?? 0));
    },
  });
  const [pose] = store.get().poses;
  if (!pose) throw new Error("no pose");
  for (const [share, done] of [
    [0.25, false],
    [0.5, false],
    [0.75, true],
  ] as const) {
    poses.blend(pose, share, done);
  }
  // Each blend starts from the pose at the start of the drag.
  const [a, b, c] = [0.25, 0.5, 0.75].map((share) => [1, 1, share]);
  expect([blended, store.get().shares, height()]).toEqual([[a, b, c], [0.75], 0.75]);
  await ctx.history.undo();
  expect([height(), store.get().shares, ctx.history.undoLabel]).toEqual([1, [1], "Save a pose"]);
  await ctx.history.redo();
  expect([height(), store.get().shares]).toEqual([0.75, [0.75]]);
  poses.apply(pose);
  expect(store.get().shares, "a pose is all of itself").toEqual([1]);
  await ctx.history.undo();
  expect([height(), store.get().shares]).toEqual([0.75, [0.75]]);
});

it("reset returns to rest; playing without poses is reported", () => {
  const { poses, store, height, said } = page();
  store.set({ posed: true });
  poses.reset();
  expect(height()).toBe(0);
  poses.togglePlay();
  expect([store.get().playing, said]).toEqual([false, ["Save a pose first, then play it."]]);
});

it("a new pose gets an unused name", () => {
  const positions = new Float32Array();
  expect(freshName([{ name: "Pose 2", positions }])).toBe("Pose 3");
});
