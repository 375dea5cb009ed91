import { lackOf } from "@cagework/core/session/adapter";
import { named } from "@cagework/core/session/client";
import { describe, expect, it } from "vitest";
import { sayLack } from "../src/ui/unsupported";

describe("missing WebGPU", () => {
  it("is recognised by the error's name", () => {
    for (const name of ["NoWebGPU", "NoAdapter", "NoDevice"]) expect(lackOf(named(name, ""))).toBe(name);
  });

  it("is not assumed for other errors: a failed download does not switch to WebGL2", () => {
    expect(lackOf(new TypeError("Failed to fetch"))).toBeUndefined();
    expect(lackOf(named("OutOfMemory", ""))).toBeUndefined();
    expect(lackOf("NoWebGPU")).toBeUndefined();
  });

  it("is explained by an insecure address if that is the reason", () => {
    expect(sayLack("NoWebGPU", false)).toMatch(/https/);
    expect(sayLack("NoWebGPU", true)).not.toMatch(/https/);
    expect(sayLack("NoAdapter", true)).toMatch(/graphics card/);
  });
});
