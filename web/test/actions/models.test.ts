import { expect, it } from "vitest";
import { createEdit } from "../../src/actions/edit";
import { createModels } from "../../src/actions/models";
import type { Problem } from "../../src/contract";
import { cageOf, createFake, memberOf, modelOf, settled } from "../fake";

const file = (name: string, content = "v") => ({ name, path: name, file: new Blob([content]) });
const OUTSIDE_FAULT: Problem = {
  code: "model_outside",
  severity: "warning",
  message: "",
  count: 1,
  places: { vertices: [], edges: [], faces: [], points: [] },
  fixes: [],
};

/** A page with a bound body in a cage. */
function page() {
  const fake = createFake();
  const steps: string[] = [];
  const models = createModels(fake.ctx, {
    edit: createEdit(fake.ctx),
    checked: async () => undefined,
    cage: {
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
  const body = memberOf(0, "body.glb", 100);
  fake.showModel(modelOf([body]));
  fake.showCage(cageOf(8));
  fake.show({ bound: true });
  /** Resolves the pending read. If all files are read, also resolves the add job, which adds models of these names. */
  const read = async (...names: string[]) => {
    fake.asked.at(-1)?.resolve({ vertices: 4 });
    await settled();
    const job = fake.asked.at(-1);
    if (job?.kind !== "add") return;
    fake.showModel(modelOf([body, ...names.map((name, k) => memberOf(k + 1, name))]));
    job.resolve(["a texture"]);
    await settled();
  };
  const names = () => fake.store.get().model?.members.map(({ name }) => name);
  return { ...fake, models, steps, read, names, offer: () => fake.offered[0] };
}

/** The undo labels that an add job would use for one model and for two models. */
const labels = (input: unknown) => [1, 2].map((input as { label: (n: number) => string }).label);

it("an added model joins the cage as one step, with its notices", async () => {
  const { models, asked, read, names, store, steps } = page();
  const added = models.add([file("shirt.glb")]);
  await settled();
  await read("shirt.glb");
  expect([await added, names(), store.get().busy]).toEqual([true, ["body.glb", "shirt.glb"], null]);
  expect([labels(asked.at(-1)?.input), store.get().model?.notices]).toEqual([
    ["Add a model", "Add 2 models"],
    ["a texture"],
  ]);
  expect(steps).toEqual(["settle"]);
});

it("adding several models reads each; unreadable ones are named and skipped", async () => {
  const { models, asked, read, names, problems } = page();
  const added = models.add([file("bad.glb"), file("empty.obj", ""), file("shirt.glb"), file("hat.glb")]);
  await settled();
  asked.at(-1)?.reject(Object.assign(new Error("bad.glb: not a GLB"), { name: "Format" }));
  await settled();
  asked.at(-1)?.resolve({ vertices: 4 });
  await settled();
  await read("shirt.glb", "hat.glb");
  await added;
  expect(asked.at(-1)).toMatchObject({ kind: "add", input: { reads: { length: 2 } } });
  expect(names()).toEqual(["body.glb", "shirt.glb", "hat.glb"]);
  expect(problems.map(({ title, fix }) => [title, fix])).toEqual([
    ["bad.glb could not be opened", "add"],
    ["This file is empty", "add"],
  ]);
});

it("cancelling the read adds no model; neither does an engine that refuses them", async () => {
  const { models, asked, store, names, problems } = page();
  const cancelled = models.add([file("shirt.glb"), file("hat.glb")]);
  await settled();
  expect(store.get().busy).toBe("Opening shirt.glb (1 of 2)");
  store.get().cancelBusy?.();
  asked.at(-1)?.resolve({ vertices: 4 });
  expect([await cancelled, store.get().busy, problems]).toEqual([false, null, []]);
  const refused = models.add([file("shirt.glb"), file("hat.glb")]);
  for (const _ of [1, 2]) {
    await settled();
    asked.at(-1)?.resolve({ vertices: 4 });
  }
  await settled();
  expect(store.get().busy).toBe("Joining 3 models");
  asked.at(-1)?.reject(new Error("too many vertices"));
  await refused;
  expect([problems.map(({ title }) => title), names()]).toEqual([["Nothing was added"], ["body.glb"]]);
});

it("a model outside the cage is reported once, with the offer of a new cage", async () => {
  const { models, read, mirror, said, offer, steps } = page();
  const added = models.add([file("skirt.glb"), file("body-cage.obj")]);
  await settled();
  mirror.know([OUTSIDE_FAULT]);
  await read("skirt.glb");
  await added;
  expect(said).toEqual(["The added model reaches outside the cage."]);
  offer()?.run();
  expect(steps).toEqual(["settle", "cage body-cage.obj", "cage around all"]);
});

it("adds neither projects nor unknown files; on an empty page the models are opened instead", async () => {
  const { models, store, problems, steps, names } = page();
  expect(await models.add([file("notes.txt")])).toBe(false);
  expect(await models.add([file("work.cagework.glb")])).toBe(false);
  expect(problems.map(({ title }) => title)).toEqual(["Nothing was added", "Nothing was added"]);
  expect(names()).toEqual(["body.glb"]);
  store.set({ model: null });
  expect(await models.add([file("body.glb"), file("shirt.glb")])).toBe(true);
  expect(steps).toEqual(["open 2"]);
});

it("removing a model is one step; the last one cannot be removed, which is reported", () => {
  const { models, commands, did, problems, teach } = page();
  expect(models.remove(0)).toBe(true);
  expect([commands, did]).toEqual([[{ do: "remove_model", id: 0 }], ["Remove body.glb"]]);
  teach({
    apply: () => {
      throw new Error("this is the only model in the cage");
    },
  });
  expect([models.remove(0), problems[0]?.title]).toEqual([false, "The model could not be removed"]);
});

it("a model added while a cage is generated restarts it around all models", async () => {
  const { models, steps, read, show, teach } = page();
  teach({ cageState: () => undefined });
  show({ cage: 9 });
  const added = models.add([file("shirt.glb")]);
  await settled();
  await read("shirt.glb");
  expect(await added).toBe(true);
  expect(steps).toContain("cage around all");
});

it('"keeps its shape" and "stays" exclude each other; each is an undo step, visibility is not', () => {
  const { models, showModel, commands, did, calls, problems, teach } = page();
  const options = { shown: true, rigid: ["all"], stays: [] };
  showModel(modelOf([{ ...memberOf(0, "body.glb"), options }]));
  models.part(0, "all", "stays");
  models.part(0, "all", "rigid");
  expect(did.length).toBe(2);
  models.show(0, false);
  expect(commands).toEqual([
    { do: "set_parts", id: 0, options: { shown: true, rigid: [], stays: ["all"] } },
    { do: "set_parts", id: 0, options: { shown: true, rigid: [], stays: [] } },
    { do: "set_parts", id: 0, options: { ...options, shown: false } },
  ]);
  expect([did.length, calls.includes("amend")]).toEqual([2, true]);
  teach({
    apply: () => {
      throw new Error("body.glb has no node called Gone");
    },
  });
  models.part(0, "node:Gone", "rigid");
  expect(problems).toMatchObject([{ message: "body.glb has no node called Gone." }]);
});
