import { expect, it } from "vitest";
import { createModels } from "../../src/actions/models";
import type { MemberInfo, PartOptions } from "../../src/contract";
import { cageOf, createFake, memberOf, modelOf, settled } from "../fake";

const file = (name: string, content = "v") => ({ name, path: name, file: new Blob([content]) });
const none = new Uint32Array();
const CHECK = { vertices: none, edges: none, faces: none, points: new Float32Array(), outside: none };
const OUTSIDE = { code: "model_outside", severity: "warning", message: "", count: 1, fix: null } as const;

/** A page with a bound body. The engine keeps models in order, and removed ones for undo. */
function page() {
  const fake = createFake();
  let all: readonly (MemberInfo & { readonly binned?: boolean })[] = [memberOf(0, "body.glb", 100)];
  const info = () => modelOf(all.filter(({ binned }) => !binned));
  const patch = (id: number, change: object) => {
    all = all.map((one) => (one.id === id ? { ...one, ...change } : one));
    return info();
  };
  fake.teach({
    async bin(ids: Uint32Array, binned: boolean) {
      for (const id of ids) patch(id, { binned });
      return info();
    },
    setParts(id: number, options: PartOptions) {
      if (options.rigid.includes("node:Gone")) throw new Error("body.glb has no node called Gone");
      return patch(id, { options });
    },
  });
  const adopted: unknown[] = [];
  const steps: string[] = [];
  let outside = false;
  let look = Promise.resolve();
  const models = createModels(fake.ctx, {
    cage: {
      async adopt(cage, check) {
        adopted.push(cage);
        fake.store.set({ cage, bound: false, sampleCage: false, check });
        await look;
        fake.store.set({ check: { ...CHECK, problems: outside ? [OUTSIDE] : [] } });
        return true;
      },
      async load(list) {
        steps.push(`cage ${list[0]?.name}`);
        return true;
      },
      async regenerate() {
        steps.push("cage around all");
        return true;
      },
    },
    async openFiles(list) {
      steps.push(`open ${list.length}`);
      return true;
    },
    settle: () => steps.push("settle"),
  });
  const { positions, corners } = cageOf(8);
  fake.store.set({ model: info(), cage: fake.engine.setCage(positions, corners), bound: true });
  /** Completes the last read and add. */
  const read = async (name: string, id: number, triangles = 50) => {
    fake.asked.at(-1)?.resolve({ took: 0 });
    await settled();
    if (fake.asked.at(-1)?.kind !== "add") return;
    all = [...all, memberOf(id, name, triangles)];
    fake.asked.at(-1)?.resolve(info());
    await settled();
  };
  const names = () => fake.store.get().model?.members.map(({ name }) => name);
  return {
    ...fake,
    models,
    adopted,
    steps,
    read,
    names,
    offer: () => fake.offered[0],
    reachOut: () => {
      outside = true;
    },
    /** From now on, a cage check ends when the returned function is called. */
    holdLooks() {
      let end = () => {};
      look = new Promise((resolve) => {
        end = resolve;
      });
      return end;
    },
  };
}

async function withShirt() {
  const all = page();
  const first = all.store.get().cage;
  const added = all.models.add([file("shirt.glb")]);
  await settled();
  await all.read("shirt.glb", 1);
  expect(await added).toBe(true);
  return { ...all, first };
}

it("an added model joins the cage, which is checked and bound again; undo removes it", async () => {
  const { store, names, adopted, ctx, first } = await withShirt();
  expect(names()).toEqual(["body.glb", "shirt.glb"]);
  expect([store.get().bound, adopted.length, store.get().busy]).toEqual([false, 1, null]);
  expect(adopted[0], "another value, so that the bind follows").not.toBe(first);
  expect(ctx.history.undoLabel).toBe("Add a model");
  await ctx.history.undo();
  expect([names(), adopted.length]).toEqual([["body.glb"], 2]);
  await ctx.history.redo();
  expect([names(), adopted.length]).toEqual([["body.glb", "shirt.glb"], 3]);
});

it("adding several models is one step; unreadable ones are named and skipped", async () => {
  const { models, asked, read, names, problems, ctx } = page();
  const added = models.add([file("bad.glb"), file("empty.obj", ""), file("shirt.glb"), file("hat.glb")]);
  await settled();
  asked.at(-1)?.reject(Object.assign(new Error("bad.glb: not a GLB"), { name: "Format" }));
  await settled();
  asked.at(-1)?.resolve({ took: 0 });
  await settled();
  await read("hat.glb", 1);
  await added;
  expect(asked.at(-1)).toMatchObject({ kind: "add", input: { length: 2 } });
  expect(names()).toEqual(["body.glb", "hat.glb"]);
  expect(problems.map(({ title, fix }) => [title, fix])).toEqual([
    ["bad.glb could not be opened", "add"],
    ["This file is empty", "add"],
  ]);
  await ctx.history.undo();
  expect([names(), ctx.history.undoLabel]).toEqual([["body.glb"], undefined]);
});

it("cancelling the read adds nothing; neither does running out of memory", async () => {
  const { models, asked, store, names, problems, ctx } = page();
  const cancelled = models.add([file("shirt.glb"), file("hat.glb")]);
  await settled();
  expect(store.get().busy).toBe("Opening shirt.glb (1 of 2)");
  store.get().cancelBusy?.();
  asked.at(-1)?.resolve({ took: 0 });
  expect([await cancelled, store.get().busy, problems]).toEqual([false, null, []]);
  const refused = models.add([file("shirt.glb"), file("hat.glb")]);
  for (const _ of [1, 2]) {
    await settled();
    asked.at(-1)?.resolve({ took: 0 });
  }
  await settled();
  asked.at(-1)?.reject(new Error("too many vertices"));
  await refused;
  expect(problems.map(({ title }) => title)).toEqual(["Nothing was added"]);
  expect([names(), ctx.history.undoLabel]).toEqual([["body.glb"], undefined]);
});

it("a model outside the cage is reported once, with the offer of a new cage", async () => {
  const all = page();
  all.reachOut();
  const added = all.models.add([file("skirt.glb"), file("body-cage.obj")]);
  await settled();
  await all.read("skirt.glb", 1);
  await added;
  expect(all.said).toEqual(["The added model reaches outside the cage."]);
  all.offer()?.run();
  expect(all.steps).toEqual(["settle", "cage body-cage.obj", "cage around all"]);
});

it("a sample with added models counts as changed until they are removed", async () => {
  const all = page();
  all.store.set({ sample: "rat", sampleCage: true });
  const added = all.models.add([file("hat.glb")]);
  await settled();
  await all.read("hat.glb", 1);
  await added;
  expect(all.store.get()).toMatchObject({ sample: null, sampleCage: false });
  await all.ctx.history.undo();
  expect(all.store.get()).toMatchObject({ sample: "rat", sampleCage: true });
});

it("adds no project or unknown file, and nothing to an empty page", async () => {
  const { models, store, problems, steps, names } = page();
  expect(await models.add([file("notes.txt")])).toBe(false);
  expect(await models.add([file("work.cagework.glb")])).toBe(false);
  expect(problems.map(({ title }) => title)).toEqual(["Nothing was added", "Nothing was added"]);
  expect(names()).toEqual(["body.glb"]);
  store.set({ model: null });
  expect(await models.add([file("body.glb"), file("shirt.glb")])).toBe(true);
  expect(steps).toEqual(["open 2"]);
});

it("removing a model is one step; pins keep their model numbers", async () => {
  const { models, store, names, ctx } = await withShirt();
  const pins = [{ triangle: 120, bary: [1, 0, 0] as [number, number, number] }];
  store.set({ pins, bound: true });
  expect(await models.bin(0)).toBe(true);
  expect([names(), ctx.history.undoLabel]).toEqual([["shirt.glb"], "Remove body.glb"]);
  expect(store.get()).toMatchObject({ pins, bound: false });
  await ctx.history.undo();
  expect(names()).toEqual(["body.glb", "shirt.glb"]);
});

it("removing a model during a cage check is one step; undo restores only the model", async () => {
  const { models, names, ctx, holdLooks } = await withShirt();
  const looked = holdLooks();
  const binned = models.bin(1);
  await settled();
  expect([names(), ctx.history.undoLabel]).toEqual([["body.glb"], "Remove shirt.glb"]);
  const undone = ctx.history.undo();
  await settled();
  expect(names()).toEqual(["body.glb", "shirt.glb"]);
  looked();
  await Promise.all([binned, undone]);
  expect([ctx.history.undoLabel, ctx.history.redoLabel]).toEqual(["Add a model", "Remove shirt.glb"]);
});

it("a model added while a cage is generated restarts it around all models", async () => {
  const { models, store, steps, read } = page();
  store.set({ cage: null, cageProgress: 0.5 });
  const added = models.add([file("shirt.glb")]);
  await settled();
  await read("shirt.glb", 1);
  expect(await added).toBe(true);
  expect(steps).toContain("cage around all");
});

it("the last model cannot be removed, which is reported", async () => {
  const { models, problems, names, teach, ctx } = page();
  teach({ bin: () => Promise.reject(new Error("this is the only model in the cage")) });
  expect(await models.bin(0)).toBe(false);
  expect([problems[0]?.title, names(), ctx.history.undoLabel]).toEqual([
    "The model could not be removed",
    ["body.glb"],
    undefined,
  ]);
});

it('"keeps its shape" and "stays" exclude each other; each is an undo step, visibility is not', async () => {
  const { models, store, ctx, problems } = await withShirt();
  const options = () => store.get().model?.members[1]?.options;
  models.part(1, "material:Cloth", "rigid");
  models.part(1, "all", "rigid");
  models.part(1, "material:Cloth", "stays");
  expect(options()).toEqual({ shown: true, rigid: ["all"], stays: ["material:Cloth"] });
  models.show(1, false);
  await ctx.history.undo();
  expect(options(), "and the eye stays as it is").toEqual({
    shown: false,
    rigid: ["material:Cloth", "all"],
    stays: [],
  });
  await ctx.history.redo();
  models.part(1, "material:Cloth", "stays");
  expect(options()).toMatchObject({ rigid: ["all"], stays: [] });
  const before = ctx.history.undoLabel;
  models.part(0, "node:Gone", "rigid");
  expect(problems).toMatchObject([{ message: "body.glb has no node called Gone." }]);
  expect(ctx.history.undoLabel).toBe(before);
});
