import { named } from "@cagework/core/session/client";
import { expect, it } from "vitest";
import { createFiles } from "../../src/actions/files";
import type { BindOptions } from "../../src/contract";
import { BIND_DEFAULTS } from "../../src/defaults";
import { MODEL_STATE, PERSON_STATE } from "../../src/state";
import { cageOf, createFake, MODEL, memberOf, modelOf, OPENED_FILE, settled } from "../fake";

const file = (name: string, content = "v") => ({ name, path: name, file: new Blob([content]) });

/** `making`: called while the cage is made. */
function page(making = () => undefined) {
  const fake = createFake();
  const steps: string[] = [];
  const does = (step: string) => async () => steps.push(step) > 0;
  const loads = (what: string) => async (list: readonly { name: string }[]) =>
    steps.push(`${what} ${list[0]?.name}`) > 0;
  const files = createFiles(fake.ctx, {
    know: fake.mirror.know,
    made: fake.mirror.made,
    bind: { start: does("bind") },
    cage: {
      async make() {
        making();
        fake.showCage(cageOf(8));
        return steps.push("make a cage") > 0;
      },
      load: loads("load"),
    },
    controls: { load: loads("controls") },
    models: {
      async join(others) {
        const added = others.map(({ name }, k) => memberOf(k + 1, name));
        fake.store.set({ model: modelOf([memberOf(0, "body.glb"), ...added]) });
        return loads("join")(others);
      },
    },
    project: { write: () => Uint8Array.of(1) },
    view: { tools: (patch) => fake.show({ tools: { ...fake.store.get().tools, ...patch } }) },
    works: { flush: async () => void steps.push("keep"), leave: () => steps.push("leave") },
    settle: () => undefined,
    beforeOpen: () => undefined,
  });
  return { ...fake, files, steps, offers: () => fake.offered };
}

it("asks whether to stand a model up that seems to lie on its back", async () => {
  const { files, asked, said, offers } = page();
  const opened = files.openFiles([file("statue.obj")]);
  await settled();
  asked[0]?.resolve({});
  await settled();
  asked[1]?.resolve({ ...OPENED_FILE, model: { ...MODEL, suggestedUp: "z" } });
  await opened;
  expect(said).toContain("The model seems to lie on its back.");
  offers()[0]?.run();
  await settled();
  expect(asked.at(-1)).toMatchObject({ kind: "turn", input: { up: "z" } });
});

it("says that a capture was turned upright, and offers to turn it back", async () => {
  const { files, asked, said, offers } = page();
  const opened = files.openFiles([file("plant.ply")]);
  await settled();
  asked[0]?.resolve({});
  await settled();
  asked[1]?.resolve({ ...OPENED_FILE, model: { ...MODEL, splats: 9, up: "y_down" } });
  await opened;
  expect(said).toContain("This capture was turned upright.");
  offers()[0]?.run();
  await settled();
  expect(asked.at(-1)).toMatchObject({ kind: "turn", input: { up: "y" } });
});

it("a step that the user chooses while the cage is made stays", async () => {
  const { files, asked, store, steps } = page(() => void store.set({ step: "model" }));
  const opened = files.openFiles([file("cube.obj")]);
  await settled();
  asked[0]?.resolve({ vertices: 4 });
  await settled();
  asked[1]?.resolve(OPENED_FILE);
  await opened;
  await settled();
  expect([steps.at(-1), store.get().step]).toEqual(["bind", "model"]);
});

it("a dropped model gets a cage and is bound; the previous work is saved first", async () => {
  const { files, asked, store, steps } = page();
  const opened = files.openFiles([file("cube.obj")]);
  await settled();
  expect(store.get().busy).toBe("Opening cube.obj");
  asked[0]?.resolve({ vertices: 4 });
  await settled();
  asked[1]?.resolve(OPENED_FILE);
  expect(await opened).toBe(true);
  await settled();
  expect(steps).toEqual(["keep", "leave", "make a cage", "bind"]);
  expect(store.get()).toMatchObject({ model: { name: "cube.obj" }, sample: null, busy: null, step: "pose" });
});

it("models dropped together are read before the cage is made; unreadable ones are named", async () => {
  const { files, asked, steps, problems, store, said } = page();
  const list = ["bad.glb", "body.glb", "skin.png", "shirt.gltf", "body-cage.obj"].map((name) => file(name));
  const opened = files.openFiles(list);
  await settled();
  asked[0]?.reject(named("Format", "bad.glb: not a GLB"));
  for (const at of [1, 2]) {
    await settled();
    asked[at]?.resolve({ vertices: 4 });
  }
  await settled();
  expect(asked[2]?.input, "with what may belong to it").toMatchObject([
    { name: "shirt.gltf" },
    { name: "skin.png" },
  ]);
  asked[3]?.resolve(OPENED_FILE);
  expect(await opened).toBe(true);
  await settled();
  expect(steps).toEqual(["keep", "leave", "join shirt.gltf", "load body-cage.obj"]);
  expect(problems).toMatchObject([{ title: "bad.glb could not be opened" }]);
  expect(said).toEqual(["2 models share this cage."]);
  expect(store.get().busy).toBeNull();
});

it("a second file cancels reading the first", async () => {
  const { files, asked, store, problems, steps } = page();
  const first = files.openFiles([file("a.obj")]);
  await settled();
  const second = files.openFiles([file("b.obj")]);
  await settled();
  expect(asked.map(({ cancelled }) => cancelled)).toEqual([true, false]);
  asked[1]?.resolve({ vertices: 4 });
  await settled();
  asked[2]?.resolve({ ...OPENED_FILE, model: { ...MODEL, name: "b.obj" } });
  expect(await Promise.all([first, second])).toEqual([false, true]);
  expect([store.get().model?.name, problems, steps.filter((step) => step === "keep").length]).toEqual([
    "b.obj",
    [],
    1,
  ]);
});

it("an unreadable file is named and the open model stays", async () => {
  const { files, asked, store, problems, steps } = page();
  store.set({ model: MODEL });
  const opened = files.openFiles([file("bad.glb")]);
  await settled();
  asked[0]?.reject(named("Format", "bad.glb: not a GLB"));
  expect(await opened).toBe(false);
  expect(problems).toMatchObject([
    { title: "bad.glb could not be opened", message: "bad.glb: not a GLB.", fix: "file" },
  ]);
  expect([store.get().model, store.get().busy, steps]).toEqual([MODEL, null, []]);
});

it("a file of more than two million vertices needs confirmation", async () => {
  const { files, asked, store, problems } = page();
  const opened = files.openFiles([file("large.glb")]);
  await settled();
  asked[0]?.resolve({ vertices: 2_100_000 });
  await settled();
  expect([store.get().busyStep, store.get().confirmBusy]).toEqual([
    "Large model (2,100,000 vertices): it may need more memory than the browser allows.",
    expect.any(Function),
  ]);
  store.get().cancelBusy?.();
  expect(await opened).toBe(false);
  expect([store.get().busy, store.get().confirmBusy, problems, asked.length]).toEqual([null, null, [], 1]);
});

it("a cage file dropped with a model is loaded; an empty file and a drop without models are reported", async () => {
  const { files, asked, steps, problems } = page();
  const opened = files.openFiles([file("cube.obj"), file("cube-cage.obj")]);
  await settled();
  asked[0]?.resolve({ vertices: 4 });
  await settled();
  asked[1]?.resolve(OPENED_FILE);
  await opened;
  await settled();
  expect(steps).toContain("load cube-cage.obj");
  expect(await files.openFiles([file("empty.obj", "")])).toBe(false);
  expect(await files.openFiles([file("notes.txt")])).toBe(false);
  expect(problems.map(({ title }) => title)).toEqual(["This file is empty", "Nothing to open"]);
});

it("a project restores settings except the memory limit, and reports what it cannot restore", async () => {
  const { files, asked, store, said } = page();
  store.set({ bindOptions: { ...store.get().bindOptions, memory_limit: 7 } });
  const opened = files.openFiles([file("work.cagework.glb")]);
  await settled();
  asked[0]?.resolve({ vertices: 4 });
  await settled();
  const settings = JSON.stringify({ bind: { ...store.get().bindOptions, grid: 32, memory_limit: 99 } });
  asked[1]?.resolve({ ...OPENED_FILE, settings, notices: ["the pose is damaged"] });
  await opened;
  expect([store.get().bindOptions, said]).toMatchObject([
    { grid: 32, memory_limit: 7 },
    ["The pose is damaged."],
  ]);
});

it("a sample that cannot be built is named", async () => {
  const { files, asked, store, problems } = page();
  store.set({ samples: ["rat"] });
  const opened = files.openSample("rat");
  await settled();
  expect(store.get().busy).toBe("Opening Rat");
  asked[0]?.reject(new Error("unknown sample"));
  expect([await opened, problems[0]?.title, store.get().busy]).toEqual([
    false,
    "The sample could not be opened",
    null,
  ]);
});

it("a project that asks for a long bind gets the default options", async () => {
  const { files, asked, store, said, teach } = page();
  const estimateUpdates = ({ solver }: BindOptions) => (solver === "jacobi" ? 3e11 : 1e9);
  teach({ estimateUpdates });
  const opened = files.openFiles([file("slow.cagework.glb")]);
  await settled();
  asked[0]?.resolve({ vertices: 4 });
  await settled();
  const settings = JSON.stringify({ bind: { ...store.get().bindOptions, solver: "jacobi" } });
  asked[1]?.resolve({ ...OPENED_FILE, settings });
  await opened;
  expect(store.get().bindOptions.solver).toBe("multigrid");
  expect(said.at(-1)).toContain("a solve of about 5 min: the default settings are used instead");
});

it("a new model resets model settings; user settings, backend and memory limit stay", async () => {
  const { files, asked, store } = page();
  const { scene, cageOptions, rigOptions, bindOptions } = store.get();
  store.set({
    pullWhole: true,
    ortho: true,
    boxDivisions: 5,
    exportOnly: 1,
    slice: { axis: 0, position: 0.9, busy: false },
    cageOptions: { ...cageOptions, target: 222, clearance: 0.1, per_component: true },
    rigOptions: { ...rigOptions, plain: !rigOptions.plain },
    bindOptions: { ...bindOptions, grid: 32, tau: 1e-3, backend: "cpu", memory_limit: 7 },
    theme: "light",
    scene: { ...scene, gizmo: "scale", floor: false },
  });
  const { step: _, busy: __, ...person } = PERSON_STATE;
  const keys = Object.keys(person) as (keyof typeof person)[];
  const persons = () => keys.map((key) => [key, store.get()[key]]);
  const before = persons();
  const opened = files.openFiles([file("cube.obj")]);
  await settled();
  asked[0]?.resolve({ vertices: 4 });
  await settled();
  asked[1]?.resolve(OPENED_FILE);
  await opened;
  expect(persons()).toEqual(before);
  expect(store.get()).toMatchObject({
    ...MODEL_STATE,
    model: MODEL,
    cage: expect.anything(),
    check: expect.anything(),
    bindOptions: { ...BIND_DEFAULTS, backend: "cpu", memory_limit: 7 },
  });
});
