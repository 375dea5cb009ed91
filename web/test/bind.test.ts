import { describe, expect, it } from "vitest";
import { BIND_DEFAULTS } from "../src/defaults";
import { canGoOn } from "../src/session/bind";

describe("what the worker kept of the last bind", () => {
  const options = { ...BIND_DEFAULTS, backend: "cpu" } as const;
  const corners = Uint32Array.of(3, 0, 1, 2, 3, 0, 2, 1);
  const positions = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0);
  const moved = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 2, 0);
  const kept = { options, positions, corners };
  const edited = { positions: moved, corners };

  it("is of use for the same faces and options, when vertices have moved", () => {
    expect(canGoOn(kept, { ...options }, { positions: moved, corners: corners.slice() })).toBe(true);
  });

  it("is of none before the first bind, elsewhere, with other options or other faces", () => {
    expect(canGoOn(undefined, options, edited)).toBe(false);
    expect(canGoOn(kept, { ...options, backend: "gpu" }, edited)).toBe(false);
    expect(canGoOn(kept, { ...options, grid: 2 * options.grid }, edited)).toBe(false);
    expect(canGoOn(kept, options, { ...edited, corners: Uint32Array.of(3, 0, 1, 2, 3, 0, 1, 2) })).toBe(
      false,
    );
    expect(canGoOn(kept, options, { ...edited, corners: corners.subarray(4) })).toBe(false);
  });

  it("is of none for the same cage, which is bound once more", () => {
    expect(canGoOn(kept, options, { positions: positions.slice(), corners })).toBe(false);
  });
});
