import { expect, it } from "vitest";
import { shapeFormatOf } from "../src/derived";
import { INITIAL_STATE } from "../src/state";
import { fieldsOf, switchOf } from "../src/ui/controls";
import { MODEL } from "./fake";

it("a field shows one key of an object and passes changes of this key", () => {
  const patches: object[] = [];
  const option = fieldsOf({ grid: 64, feet: "free" }, (patch) => patches.push(patch));
  expect(option("grid").value).toBe(64);
  option("grid").onChange(32);
  expect(patches).toEqual([{ grid: 32 }]);
});

it("a switch is off for one value of its field and on for all others", () => {
  const chosen: string[] = [];
  const joints = (value: string) =>
    switchOf({ value, onChange: (next) => chosen.push(next) }, "follow", "stay");
  expect(["stay", "follow", "turn"].map((value) => joints(value).value)).toEqual([false, true, true]);
  joints("stay").onChange(true);
  joints("turn").onChange(false);
  expect(chosen).toEqual(["follow", "stay"]);
});

it("a shape is exported in the chosen format if its model can have it, otherwise in the first that it can", () => {
  const formatOf = (model: object) =>
    shapeFormatOf({ ...INITIAL_STATE, shapeFormat: "stl", model: { ...MODEL, ...model } });
  expect(formatOf({})).toBe("stl");
  // STL stores only faces.
  expect(formatOf({ points: 9 })).toBe("obj");
  expect(formatOf({ splats: 9, format: "gltf" })).toBe("ply");
  expect(formatOf({ splats: 9, format: "spz" })).toBe("spz");
});
