import { lackOf } from "@cagework/core/session/adapter";
import { named } from "@cagework/core/session/client";
import { describe, expect, it } from "vitest";
import { sayLack } from "../src/ui/unsupported";

describe("what is missing", () => {
  it("is told by the names of errors that mean there is no WebGPU", () => {
    for (const name of ["NoWebGPU", "NoAdapter", "NoDevice"]) expect(lackOf(named(name, ""))).toBe(name);
  });

  it("is not read out of other errors: a failed download is no reason for another artifact", () => {
    expect(lackOf(new TypeError("Failed to fetch"))).toBeUndefined();
    expect(lackOf(named("OutOfMemory", ""))).toBeUndefined();
    expect(lackOf("NoWebGPU")).toBeUndefined();
  });

  it("is the address where that is why browsers keep WebGPU back", () => {
    expect(sayLack("NoWebGPU", false)).toMatch(/https/);
    expect(sayLack("NoWebGPU", true)).not.toMatch(/https/);
    expect(sayLack("NoAdapter", true)).toMatch(/graphics card/);
  });
});
