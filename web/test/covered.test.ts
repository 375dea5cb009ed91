import { expect, it } from "vitest";
import { marginsOf } from "../src/ui/covered";

const box = (left: number, top: number, width: number, height: number) => ({
  left,
  top,
  right: left + width,
  bottom: top + height,
});

it("columns cover the side that they are at, rows the top or the bottom", () => {
  const view = box(10, 50, 1000, 600);
  const tools = box(22, 110, 44, 400);
  const looks = box(870, 62, 128, 44);
  expect(marginsOf(view, [tools, looks])).toEqual([56, 56, 0, 0]);
  const row = box(18, 590, 380, 50);
  const status = box(18, 580, 980, 0);
  expect(marginsOf(view, [row, status])).toEqual([0, 0, 0, 70]);
});

it("overlays that are not displayed cover nothing", () => {
  expect(marginsOf(box(0, 0, 500, 500), [box(0, 0, 0, 0)])).toEqual([0, 0, 0, 0]);
});
