import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { createExports } from "../../src/actions/exports";
import { createProject } from "../../src/actions/project";
import { cageOf, createFake, MODEL, memberOf, modelOf, settled } from "../fake";

/** File names and MIME types of downloads, and texts copied to the clipboard, since the start of the test. */
let downloads: string[] = [];
let types: string[] = [];
let copied: string[] = [];

beforeEach(() => {
  downloads = [];
  types = [];
  vi.spyOn(URL, "createObjectURL").mockImplementation((blob) => {
    types.push((blob as Blob).type);
    return "";
  });
  copied = [];
  const link = {
    href: "",
    download: "",
    click() {
      downloads.push(this.download);
    },
  };
  vi.stubGlobal("document", { createElement: () => ({ ...link }) });
  vi.stubGlobal("location", { origin: "https://cagework.example", pathname: "/" });
  vi.stubGlobal("navigator", { clipboard: { writeText: async (text: string) => copied.push(text) } });
});
afterEach(() => {
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

function page() {
  const fake = createFake();
  const project = createProject(fake.ctx, () => undefined);
  const pull = { released: () => Promise.resolve<unknown>(undefined) };
  const exports = createExports(fake.ctx, project, pull);
  fake.showModel(MODEL);
  fake.showCage(cageOf(2));
  return { ...fake, exports, project, pull };
}

it("a posed capture is exported once the lattice that deforms it is ready", async () => {
  const { exports, ctx, store, asked, teach, showModel } = page();
  showModel({ ...MODEL, splats: 10 });
  store.set({ posed: true });
  teach({ hasLattice: false, exportGlb: () => new Uint8Array(1), rigNotices: () => [] });
  // The job that starts after each bind of a capture.
  const followed = ctx.queue.replace("lattice", () => ctx.session().loadLattice(8).done);
  const saved = exports.save("glb");
  await settled();
  expect(downloads).toEqual([]);
  teach({ hasLattice: true });
  asked.at(-1)?.resolve(undefined);
  await Promise.all([followed, saved]);
  expect(downloads).toEqual(["cube-posed.glb"]);
  expect(asked.filter(({ kind }) => kind === "lattice")).toHaveLength(1);
});

it("an export waits until a released pull has ended", async () => {
  const { exports, pull, teach } = page();
  let isPulling = true;
  pull.released = async () => {
    await settled();
    isPulling = false;
  };
  const during: boolean[] = [];
  teach({
    exportShape: () => {
      during.push(isPulling);
      return new Uint8Array(1);
    },
    rigNotices: () => [],
  });
  await exports.save("shape");
  expect(during).toEqual([false]);
});

it("files are named after the model and their size is shown", async () => {
  const { exports, teach, said, store } = page();
  teach({
    exportGlb: () => new Uint8Array(2000),
    rigNotices: () => ["3 of 4 joints moved"],
    lostIn: () => ["the stl file does not keep: colours"],
    exportCage: () => Uint8Array.of(1),
    exportShape: (_id: number, format: string, frame: boolean) =>
      new TextEncoder().encode(format + (frame ? "!" : "")),
  });
  await exports.save("glb");
  await exports.save("cage");
  expect(downloads).toEqual(["cube-posed.glb", "cube-cage.obj"]);
  expect(said.slice(0, 2)).toEqual(["3 of 4 joints moved.", "cube-posed.glb is in your downloads (2 kB)."]);
  store.set({ model: { ...MODEL, name: "someone.vrm" } });
  await exports.save("glb");
  expect(downloads.at(-1), "a VRM keeps its extension").toBe("someone-posed.vrm");
  store.set({ shapeFormat: "stl", shapeMoment: "rest" });
  await exports.save("shape");
  expect(downloads.at(-1), "a shape has its own format").toBe("someone-posed.stl");
  expect(said.at(-1)).toContain("(3 byte)");
  store.set({ shapeFormat: "ply", shapeMoment: "frame" });
  await exports.save("shape");
  expect(said.at(-1), "the shown frame of a clip").toContain("(4 byte)");
  const glb = "model/gltf-binary";
  expect(types).toEqual([glb, "model/obj", glb, "model/stl", "application/octet-stream"]);
});

it("each of several models is exported to its own file; one of them can be exported alone", async () => {
  const { exports, teach, said, store } = page();
  const members = [memberOf(4, "body.vrm"), memberOf(5, "a/shirt.glb"), memberOf(7, "shirt.glb")];
  store.set({ model: modelOf(members) });
  const asked: number[] = [];
  teach({
    exportGlb: (id: number) => {
      asked.push(id);
      return new Uint8Array(1000);
    },
    rigNotices: () => ["3 of 4 joints moved"],
    exportWeights: () => Uint8Array.of(1),
    exportCage: () => Uint8Array.of(1),
  });
  await exports.save("glb");
  expect([asked, downloads]).toEqual([
    [4, 5, 7],
    ["body-posed.vrm", "shirt-posed.glb", "shirt-posed-2.glb"],
  ]);
  expect(said).toEqual([
    "3 of 4 joints moved.",
    "body-posed.vrm, shirt-posed.glb, and shirt-posed-2.glb are in your downloads (3 kB).",
  ]);
  store.set({ exportOnly: 5 });
  await exports.save("weights");
  await exports.save("cage");
  expect(downloads.slice(3), "all models share the cage").toEqual(["shirt-weights.npz", "body-cage.obj"]);
  store.set({ exportOnly: 6 });
  await exports.save("weights");
  expect(downloads.length, "a removed model cannot be chosen").toBe(8);
  store.set({ exportOnly: "zip" });
  await exports.save("glb");
  expect([downloads.slice(8), types.at(-1)]).toEqual([["body-posed.zip"], "application/zip"]);
  expect(said.at(-1)).toBe("body-posed.zip is in your downloads (1 byte).");
});

it("files of clips are fitted to the skeleton and downloaded", async () => {
  const { exports, teach, said, problems } = page();
  const file = (name: string) => ({ name, path: name, file: new File([name], name) });
  teach({
    exportClips: (name: string, bytes: Uint8Array) => {
      if (new TextDecoder().decode(bytes) !== name) throw new Error("other bytes");
      if (name === "tree.glb") throw new Error("no joints in common");
      return Uint8Array.of(1);
    },
    rigNotices: () => ["3 of 4 joints moved"],
  });
  await exports.clips([file("walk.glb"), file("walk.glb")]);
  expect(downloads).toEqual(["walk-posed.glb", "walk-posed-2.glb"]);
  expect(said).toEqual([
    "3 of 4 joints moved.",
    "walk-posed.glb and walk-posed-2.glb are in your downloads (2 byte).",
  ]);
  await exports.clips([file("tree.glb")]);
  expect(downloads.length).toBe(2);
  expect(problems).toMatchObject([{ title: "The file could not be written" }]);
});

it("a failed export is reported and saves nothing", async () => {
  const { exports, teach, problems, asked } = page();
  teach({
    exportWeights: () => {
      throw Object.assign(new Error("the model has no weights yet: bind it first"), { name: "Missing" });
    },
  });
  await exports.save("weights");
  expect(problems).toMatchObject([{ title: "The file could not be written", fix: "file" }]);
  const picture = exports.save("picture");
  await settled();
  asked[0]?.reject(new Error("the GPU is gone"));
  await picture;
  expect([problems.length, downloads]).toEqual([2, []]);
});

it("a project contains the page's settings", async () => {
  const { project, store, teach } = page();
  const written: string[] = [];
  teach({
    writeProject: (settings: string) => {
      written.push(settings);
      return Uint8Array.of(1);
    },
  });
  store.set({ tools: { ...store.get().tools, symmetry: true } });
  project.write();
  expect(JSON.parse(written[0] ?? "")).toMatchObject({
    bind: { grid: 0 },
    cage: { target: 80 },
    symmetry: true,
  });
  expect(project.fileName()).toBe("cube.cagework.glb");
});

it("links work for samples in their own cage; otherwise the page suggests saving a project", async () => {
  const { exports, store, said } = page();
  await exports.share();
  expect([copied, said[0]]).toEqual([
    [],
    "Links work for samples only. Save a project to share your own model.",
  ]);
  store.set({ sample: "rat", sampleCage: true });
  await exports.share();
  expect(copied).toEqual([expect.stringMatching(/^https:\/\/cagework\.example\/#.*rat/)]);
  const [member = memberOf(0, "cube.obj")] = MODEL.members;
  store.set({
    model: { ...MODEL, members: [{ ...member, options: { ...member.options, rigid: ["all"] } }] },
  });
  await exports.share();
  expect([copied.length, said.length], "a link cannot contain rigid parts").toEqual([1, 3]);
});
