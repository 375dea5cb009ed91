import { createEta } from "@cagework/core/eta";
import { describe, expect, it } from "vitest";
import { timeLeft } from "../src/ui/bind";

describe("time left", () => {
  it("is unknown at the start", () => {
    const eta = createEta(0);
    expect(eta.update(0.01, 100)).toBeUndefined();
  });

  it("is exact at constant speed: at 0.1 per second, five seconds are left at one half", () => {
    const eta = createEta(0);
    let left: number | undefined;
    for (let i = 1; i <= 5; i += 1) left = eta.update(i / 10, i * 1000);
    expect(left).toBeCloseTo(5000, 6);
  });

  it("counts down between steps", () => {
    const eta = createEta(0);
    eta.update(0.5, 1000);
    expect(eta.update(0.5, 1400)).toBeCloseTo(600, 6);
  });

  it("follows a change of speed", () => {
    const eta = createEta(0);
    eta.update(0.1, 1000);
    const fast = eta.update(0.5, 1100) ?? Number.POSITIVE_INFINITY;
    // At the first speed, 0.1 per second, the remaining half would take 5000 ms.
    expect(fast).toBeLessThan(1000);
  });

  it("is never negative", () => {
    const eta = createEta(0);
    eta.update(0.9, 1000);
    expect(eta.update(0.9, 9000)).toBe(0);
  });
});

it("time left is rounded for reading", () => {
  expect(timeLeft(300)).toBe("about a second left");
  expect(timeLeft(8400)).toBe("about 8 sec left");
  expect(timeLeft(150_000)).toBe("about 3 min left");
});
