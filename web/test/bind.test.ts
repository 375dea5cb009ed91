import { describe, expect, it } from "vitest";
import { BIND_DEFAULTS } from "../src/defaults";
import { canGoOn } from "../src/session/bind";

describe("what the worker kept of the last bind", () => {
  const options = { ...BIND_DEFAULTS, backend: "cpu" } as const;
  const corners = Uint32Array.of(3, 0, 1, 2, 3, 0, 2, 1);
  const kept = { options, corners };

  it("is of use for the same faces and options, wherever the vertices are", () => {
    expect(canGoOn(kept, { ...options }, corners.slice())).toBe(true);
  });

  it("is of none before the first bind, elsewhere, with other options or other faces", () => {
    expect(canGoOn(undefined, options, corners)).toBe(false);
    expect(canGoOn(kept, { ...options, backend: "gpu" }, corners)).toBe(false);
    expect(canGoOn(kept, { ...options, grid: 2 * options.grid }, corners)).toBe(false);
    expect(canGoOn(kept, options, Uint32Array.of(3, 0, 1, 2, 3, 0, 1, 2))).toBe(false);
    expect(canGoOn(kept, options, corners.subarray(4))).toBe(false);
  });
});
