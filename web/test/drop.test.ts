import { describe, expect, it } from "vitest";
import { extension, hoverSentence, planDrop } from "../src/drop";

describe("dropped files", () => {
  it("open a model and promise a cage", () => {
    expect(planDrop(["horse.glb"])).toEqual({
      kind: "model",
      main: 0,
      sentence: "Opens horse.glb and makes a cage for it.",
    });
  });

  it("take the file with cage in its name as the cage, in any order", () => {
    const plan = planDrop(["horse_cage.obj", "horse.obj"]);
    expect([plan.main, plan.second]).toEqual([1, 0]);
    expect(planDrop(["a/horse.glb", "a/Cage.glb"]).second).toBe(1);
  });

  it("do not take a word that only contains cage for one", () => {
    expect(planDrop(["birdcages.glb"]).second).toBeUndefined();
    expect(planDrop(["horse.glb", "cagework.glb"]).second).toBeUndefined();
  });

  it("open a lone cage as a model", () => expect(planDrop(["cage.obj"]).main).toBe(0));

  it("take a lone file of controls for what it is, beside a model for nothing", () => {
    expect(planDrop(["a/horse-controls.obj"])).toMatchObject({ kind: "controls", main: 0 });
    expect(planDrop(["controlsystem.obj"]).kind).toBe("model");
    expect(planDrop(["horse.glb", "controls.obj"])).toMatchObject({ kind: "model", main: 0 });
  });

  it("find a .gltf among its files", () => {
    const plan = planDrop(["scene/scene.bin", "scene/textures/a.png", "scene/scene.gltf"]);
    expect(plan.main).toBe(2);
    expect(plan.sentence).toBe("Opens scene.gltf with 2 files and makes a cage for it.");
  });

  it("open together: several models share a cage, made for all of them or given", () => {
    expect(planDrop(["body.glb", "skin.png", "shirt.obj", "a/buckle.glb"])).toEqual({
      kind: "model",
      main: 0,
      more: [2, 3],
      sentence: "Opens body.glb and 2 more with 1 file and makes a cage for all of them.",
    });
    expect(planDrop(["body-cage.obj", "shirt-cage.obj", "body.glb", "shirt.glb"])).toEqual({
      kind: "model",
      main: 2,
      more: [3],
      second: 0,
      sentence: "Opens body.glb and 1 more with body-cage.obj as their cage.",
    });
    expect(planDrop(["body.glb", "body-controls.obj"]).more, "controls are no model").toBeUndefined();
  });

  it("open one format of a model that came in several", () => {
    const plan = planDrop(["fox/fox.stl", "fox/fox.obj", "fox/fox.mtl", "fox/fox.glb"]);
    expect(plan).toMatchObject({ kind: "model", main: 3 });
    expect(plan.more).toBeUndefined();
    expect(planDrop(["body/scene.gltf", "shirt/scene.gltf"]).more, "of two folders they are two").toEqual([
      1,
    ]);
  });

  it("know a project by its name", () => {
    expect(planDrop(["horse.cagework.glb"])).toMatchObject({ kind: "project", main: 0 });
  });

  it("say what is missing when only companions came", () => {
    expect(planDrop(["scene.bin", "a.png"]).kind).toBe("textures");
  });

  it("say what can be opened when nothing fits", () => {
    expect(planDrop(["notes.txt"])).toEqual({
      kind: "unknown",
      sentence: "Cagework opens .glb, .vrm, .gltf, .obj, .ply, .stl, and .off files.",
    });
    expect(planDrop([]).kind).toBe("nothing");
  });

  it("have extensions in lower case", () => {
    expect(extension("A/B.GLB")).toBe("glb");
    expect(extension("folder.x/file")).toBe("");
  });

  it("announce what will happen while they hover", () => {
    expect(hoverSentence(1, false, false)).toContain("gets a cage");
    expect(hoverSentence(1, true, true)).toContain("Cage panel");
    expect(hoverSentence(1, true, false)).toContain("To add it instead, drop it on the list of models");
    expect(hoverSentence(3, true, false)).toContain("share one cage");
  });
});
