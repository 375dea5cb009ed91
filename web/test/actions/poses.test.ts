import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { createEdit } from "../../src/actions/edit";
import { createPlayer } from "../../src/actions/player";
import { createPoses, freshName, snapshotCage } from "../../src/actions/poses";
import { createWalk } from "../../src/actions/walk";
import { cageOf, createFake } from "../fake";

beforeEach(() => {
  vi.stubGlobal("requestAnimationFrame", () => 1);
  vi.stubGlobal("cancelAnimationFrame", () => undefined);
});
afterEach(() => {
  vi.unstubAllGlobals();
});

const POINT = [9, 9, 9];

/** A page with one saved pose and a cage of two vertices, both of them moved to (1, 1, 1). */
function page() {
  const fake = createFake();
  const edit = createEdit(fake.ctx);
  const player = createPlayer(fake.ctx, edit);
  const poses = createPoses(fake.ctx, edit, player, createWalk(fake.ctx, edit, player));
  fake.showCage(cageOf(2));
  fake.engine.setCagePositions(new Float32Array(6).fill(1));
  fake.engine.commit("Move");
  fake.show({
    poses: [{ name: "Pose 1", fits: true, seconds: 1, interpolation: null, hash: 7 }],
    shares: [1],
    posed: true,
  });
  return { ...fake, poses };
}

it("saving, showing, renaming and deleting a pose are undo steps", () => {
  const { poses, commands, did, said } = page();
  poses.save();
  poses.apply(0);
  poses.rename(0, " Wave ");
  poses.rename(0, "  ");
  poses.remove(0);
  poses.update(0);
  poses.duplicate(0);
  poses.move(1, 0);
  expect(poses.time(0, 0.4)).toBe(true);
  poses.interpolation(0, "step");
  const transition = { name: "Wave", interpolation: "cubic", loops: false, back: 1 } as const;
  poses.transition(transition);
  expect(commands).toEqual([
    { do: "save_pose", name: "Pose 2" },
    { do: "apply_pose", index: 0 },
    { do: "rename_pose", index: 0, name: "Wave" },
    { do: "remove_pose", index: 0 },
    { do: "update_pose", index: 0 },
    { do: "duplicate_pose", index: 0, name: "Pose 1 copy" },
    { do: "move_pose", index: 1, to: 0 },
    { do: "set_pose_time", index: 0, seconds: 0.4 },
    { do: "set_pose_interpolation", index: 0, interpolation: "step" },
    { do: "set_transition", transition },
  ]);
  expect([said, did.length]).toEqual([['Saved as "Pose 2".'], 11]);
});

it("a button of a row acts on its pose although the press has sorted or renamed the poses", () => {
  const { poses, show } = page();
  const pose = (name: string, hash: number) =>
    ({ name, fits: true, seconds: 1, interpolation: null, hash }) as const;
  const [a, b, same] = [pose("a", 7), pose("b", 8), pose("c", 8)];
  show({ poses: [b, a, same] });
  expect([poses.indexOf(a, 0), poses.indexOf(b, 0), poses.indexOf(same, 2)]).toEqual([1, 0, 2]);
  show({ poses: [pose("renamed", 7), b] });
  expect([poses.indexOf(a, 0), poses.indexOf(a, 1)]).toEqual([0, undefined]);
});

it("every pose that fits the cage gets a picture, once, unless the list changes while it is drawn", async () => {
  const { poses, asked, store, show } = page();
  const pose = (hash: number, fits = true) =>
    ({ name: `Pose ${hash}`, fits, seconds: 1, interpolation: null, hash }) as const;
  show({ bound: true, poses: [pose(7), pose(8, false), pose(9)] });
  const wanted = () => asked.filter(({ kind }) => kind === "posePicture").map(({ input }) => input);
  const drawn = async () => {
    asked.at(-1)?.resolve(new Blob());
    await new Promise((done) => setTimeout(done));
  };
  const all = poses.drawPictures();
  void poses.drawPictures();
  expect(wanted(), "one at a time").toEqual([0]);
  show({ poses: [pose(9), pose(7)] });
  await drawn();
  expect(Object.keys(store.get().pictures), "another pose has taken its place").toEqual([]);
  await drawn();
  await drawn();
  await all;
  expect([wanted(), Object.keys(store.get().pictures)]).toEqual([
    [0, 0, 1],
    ["7", "9"],
  ]);
  await poses.drawPictures();
  expect(wanted().length).toBe(3);
});

it("an animation that does not loop ends with the pose before it", () => {
  const { poses, calls, show, store } = page();
  let frame: (now: number) => void = () => undefined;
  vi.stubGlobal("requestAnimationFrame", (step: typeof frame) => {
    frame = step;
    return 1;
  });
  const shown = { name: "", interpolation: "linear", back: 1 } as const;
  show({ animationSeconds: 1, transition: { ...shown, loops: false } });
  poses.togglePlay();
  frame(performance.now() + 500);
  expect([store.get().playing, store.get().playingPose]).toEqual([true, "Pose 1"]);
  frame(performance.now() + 2000);
  expect([store.get().playing, calls.at(-1)]).toEqual([false, "revert"]);
});

it("an animation plays from the playhead at the speed of the timeline, and a loop starts again", () => {
  const { poses, engine, show, store, teach } = page();
  let frame: (now: number) => void = () => undefined;
  vi.stubGlobal("requestAnimationFrame", (step: typeof frame) => {
    frame = step;
    return 1;
  });
  const now = vi.spyOn(performance, "now").mockReturnValue(0);
  const shown: number[] = [];
  teach({ playAt: (seconds) => shown.push(seconds) });
  show({ animationSeconds: 2, transition: { name: "", interpolation: "linear", back: 1, loops: true } });
  poses.scrub(0.5);
  poses.keepMoment();
  store.set({ clip: { ...store.get().clip, speed: 0.5 } });
  poses.togglePlay();
  frame(1000);
  frame(4000);
  // 0.5 s + 0.5 * 1 s = 1 s, and 1 s + 0.5 * 3 s = 2.5 s, which is 0.5 s after the loop of 2 s.
  expect(shown).toEqual([0.5, 1, 0.5]);
  poses.togglePlay();
  expect([store.get().moment, engine.cagePositions()[0]]).toEqual([0.5, 1]);
  now.mockRestore();
});

it("poses of a previous cage are carried over as one step", async () => {
  const { poses, ctx, show, showCage, asked, commands, did } = page();
  show({ cageId: 77 });
  const before = snapshotCage(ctx);
  if (!before) throw new Error("no cage");
  showCage(cageOf(3));
  show({ editingRest: true, cageId: 78 });
  const done = poses.carry(before, "Carry poses over");
  await Promise.resolve();
  expect(asked.at(-1)).toMatchObject({ kind: "carry", input: { old: before.cage, poses: before.poses } });
  asked.at(-1)?.resolve(new Float32Array(9).fill(7));
  await done;
  const positions = Array(3).fill([7, 7, 7]);
  expect(commands).toEqual([{ do: "carry_poses", from: 77, positions, shares: [1] }]);
  expect([did.at(-1), ctx.store.get().editingRest]).toEqual(["Carry poses over", false]);
});

it("carrying poses over to a new control adds no undo step, and a pose at rest stays at rest", async () => {
  const { poses, engine, ctx, showCage, asked, commands, did, calls } = page();
  showCage(cageOf(2));
  const before = snapshotCage(ctx);
  if (!before) throw new Error("no cage");
  await poses.carry(before);
  expect(asked.length, "there is nothing to carry").toBe(0);
  const twice = { ...before, poses: new Float32Array(12) };
  showCage(cageOf(3, 4));
  const [steps, rest] = [did.length, engine.cagePositions()];
  const done = poses.carry(twice);
  await Promise.resolve();
  asked.at(-1)?.resolve(new Float32Array(18).fill(7));
  await done;
  const positions = [...Array(3).fill([...rest.slice(0, 3)]), ...Array(3).fill([7, 7, 7])];
  expect(commands).toMatchObject([{ do: "carry_poses", positions }]);
  expect([did.length, calls.includes("amend")]).toEqual([steps, true]);
});

it("one drag of a blend slider is one undo step", () => {
  const { poses, commands, did } = page();
  for (const share of [0.25, 0.5, 0.75]) poses.blend(0, share, share === 0.75);
  expect(commands).toEqual([0.25, 0.5, 0.75].map((share) => ({ do: "blend", index: 0, share })));
  expect(did).toEqual(["Move", "Blend poses"]);
});

it("playing poses restores the pose before it; applying a pose ends it", () => {
  const { poses, engine, store } = page();
  poses.togglePlay();
  expect(store.get().playing).toBe(true);
  engine.setCagePositions(new Float32Array(6).fill(9));
  poses.apply(0);
  expect([store.get().playing, engine.cagePositions()[0]]).toEqual([false, 1]);
});

it("saving while poses are playing saves the pose on screen", () => {
  const { poses, engine, commands, store } = page();
  poses.togglePlay();
  engine.setCagePositions(new Float32Array(6).fill(9));
  poses.save();
  expect(commands).toEqual([
    { do: "set_pose", positions: [POINT, POINT] },
    { do: "save_pose", name: "Pose 2" },
  ]);
  expect(store.get().playing).toBe(false);
});

it("reset returns to rest; playing without poses is reported", () => {
  const { poses, commands, said, show, store } = page();
  poses.reset();
  show({
    posed: false,
    poses: [{ name: "of another cage", fits: false, seconds: 1, interpolation: null, hash: 7 }],
  });
  poses.reset();
  expect(commands).toEqual([{ do: "reset_pose" }]);
  poses.togglePlay();
  expect([store.get().playing, said]).toEqual([false, ["Save a pose first, then play it."]]);
});

it("a new pose gets an unused name", () => {
  expect(freshName([{ name: "Pose 2" }])).toBe("Pose 3");
});
