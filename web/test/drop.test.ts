import { describe, expect, it } from "vitest";
import { extension, hoverSentence, planDrop } from "../src/drop";

describe("dropped files", () => {
  it("open a model and announce a cage", () => {
    expect(planDrop(["horse.glb"])).toEqual({
      kind: "model",
      main: 0,
      sentence: "Opens horse.glb and makes a cage for it.",
    });
  });

  it('use the file with "cage" in its name as the cage, in any order', () => {
    const plan = planDrop(["horse_cage.obj", "horse.obj"]);
    expect([plan.main, plan.second]).toEqual([1, 0]);
    expect(planDrop(["a/horse.glb", "a/Cage.glb"]).second).toBe(1);
  });

  it('ignore words that merely contain "cage"', () => {
    expect(planDrop(["birdcages.glb"]).second).toBeUndefined();
    expect(planDrop(["horse.glb", "cagework.glb"]).second).toBeUndefined();
  });

  it("open a lone cage as a model", () => expect(planDrop(["cage.obj"]).main).toBe(0));

  it("open a lone controls file; ignore it beside a model", () => {
    expect(planDrop(["a/horse-controls.obj"])).toMatchObject({ kind: "controls", main: 0 });
    expect(planDrop(["controlsystem.obj"]).kind).toBe("model");
    expect(planDrop(["horse.glb", "controls.obj"])).toMatchObject({ kind: "model", main: 0 });
  });

  it("find the .gltf among its files", () => {
    const plan = planDrop(["scene/scene.bin", "scene/textures/a.png", "scene/scene.gltf"]);
    expect(plan.main).toBe(2);
    expect(plan.sentence).toBe("Opens scene.gltf with its 2 files and makes a cage for it.");
  });

  it("find the meta.json of a capture among its images", () => {
    const plan = planDrop(["plant/means_l.webp", "plant/meta.json", "plant/sh0.webp"]);
    expect(plan).toMatchObject({ kind: "model", main: 1 });
    expect(planDrop(["plant/means_l.webp", "plant/joints.json"]).kind).toBe("unknown");
  });

  it("let several models share a cage, generated or given", () => {
    expect(planDrop(["body.glb", "skin.png", "shirt.obj", "a/buckle.glb"])).toEqual({
      kind: "model",
      main: 0,
      more: [2, 3],
      sentence: "Opens body.glb and 2 more with their 1 file and makes a cage for all of them.",
    });
    expect(planDrop(["body-cage.obj", "shirt-cage.obj", "body.glb", "shirt.glb"])).toEqual({
      kind: "model",
      main: 2,
      more: [3],
      second: 0,
      sentence: "Opens body.glb and 1 more and uses body-cage.obj as the cage.",
    });
    expect(planDrop(["body.glb", "body-controls.obj"]).more, "controls are not a model").toBeUndefined();
  });

  it("open one of several formats of the same model", () => {
    const plan = planDrop(["fox/fox.stl", "fox/fox.obj", "fox/fox.mtl", "fox/fox.glb"]);
    expect(plan).toMatchObject({ kind: "model", main: 3 });
    expect(plan.more).toBeUndefined();
    expect(planDrop(["body/scene.gltf", "shirt/scene.gltf"]).more, "of two folders they are two").toEqual([
      1,
    ]);
  });

  it("recognise a project by its name", () => {
    expect(planDrop(["horse.cagework.glb"])).toMatchObject({ kind: "project", main: 0 });
  });

  it("ask for the model if only companion files were dropped", () => {
    expect(planDrop(["scene.bin", "a.png"]).kind).toBe("textures");
  });

  it("list the formats if no file can be opened", () => {
    expect(planDrop(["notes.txt"])).toEqual({
      kind: "unknown",
      sentence:
        "Cagework opens .glb, .vrm, .gltf, .fbx, .obj, .ply, .stl, .off, .3mf, .splat, .spz, and .sog files.",
    });
    expect(planDrop([]).kind).toBe("nothing");
  });

  it("compare extensions in lower case", () => {
    expect(extension("A/B.GLB")).toBe("glb");
    expect(extension("folder.x/file")).toBe("");
  });

  it("announce the effect of a drop", () => {
    expect(hoverSentence(1, false, false)).toContain("gets a cage");
    expect(hoverSentence(1, true, true)).toContain("Cage panel");
    expect(hoverSentence(1, true, false)).toContain("To add it instead, drop it on the list of models");
    expect(hoverSentence(3, true, false)).toContain("share one cage");
  });
});
