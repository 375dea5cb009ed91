import { describe, expect, it } from "vitest";
import {
  bytes,
  coordinate,
  count,
  duration,
  exportStem,
  percent,
  plural,
  scientific,
  stem,
} from "../src/format";

describe("formats", () => {
  it("group thousands", () => expect(count(1234567)).toBe("1,234,567"));
  it("choose singular and plural", () => {
    expect(plural(1, "vertex", "vertices")).toBe("1 vertex");
    expect(plural(0, "pose")).toBe("0 poses");
  });
  it("choose the unit of bytes", () => {
    expect(bytes(999)).toBe("999 byte");
    expect(bytes(1500)).toBe("1.5 kB");
    expect(bytes(999_600)).toBe("1 MB");
    expect(bytes(2_147_483_648)).toBe("2.1 GB");
  });
  it("choose the unit of a duration after rounding", () => {
    expect(duration(0.25)).toBe("0.25 ms");
    expect(duration(45.4)).toBe("45 ms");
    expect(duration(999.7)).toBe("1 sec");
    expect(duration(59_990)).toBe("1 min 0 sec");
    expect(duration(90_000)).toBe("1 min 30 sec");
  });
  it("write small numbers with an exponent", () => {
    expect(scientific(0)).toBe("0");
    expect(scientific(0.5)).toBe("0.5");
    expect(scientific(0.000123)).toBe("1.23e-4");
    expect(scientific(-3.456e-7)).toBe("-3.46e-7");
  });
  it("clamp percentages to 0 and 100", () => {
    expect(percent(0.456)).toBe("46%");
    expect(percent(1.2)).toBe("100%");
    expect(percent(-0.1)).toBe("0%");
  });
  it("show coordinates with five digits at every scale, without minus zero", () => {
    expect(coordinate(-0)).toBe("0");
    expect(coordinate(-0.0012345678)).toBe("-0.001235");
    expect(coordinate(-0.0000123456)).toBe("-1.23e-5");
    expect(coordinate(-1.4895e-8, 0.2)).toBe("0");
    expect(coordinate(-1.4895e-8)).toBe("-1.49e-8");
    expect(coordinate(-1234567.8)).toBe("-1234600");
    expect(coordinate(1.23456)).toBe("1.2346");
    expect(coordinate(0.1 + 0.2)).toBe("0.3");
  });
  it("strip folder and extension", () => {
    expect(stem("models/horse.v2.glb")).toBe("horse.v2");
    expect(stem(".hidden")).toBe(".hidden");
    expect(stem("horse.cagework.glb")).toBe("horse");
  });
  it("of exports drop the endings of earlier exports", () => {
    const stems = ["fox-posed.glb", "fox-poses-posed.obj", "posed.obj", "-posed.obj"].map(exportStem);
    expect(stems).toEqual(["fox", "fox", "posed", "-posed"]);
  });
});
