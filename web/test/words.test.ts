import { afterEach, describe, expect, it } from "vitest";
import { sayGesture } from "../src/actions/edit";
import { decimals, duration, scientific, setLocale } from "../src/format";
import { PSEUDO_LANGUAGE, pseudo } from "../src/words/pseudo";

describe("the pseudo-locale", () => {
  it("accents each letter and lengthens by two fifths", () => {
    const { text } = pseudo({ text: "Choose a model" });
    expect(text).toBe("Çĥööšéçĥ á ɱöðéļɱö");
  });
  it("leaves inserted values unchanged", () => {
    const { list, none } = pseudo({
      list: (names: string[], n: number) => `${names.join(" and ")}: ${n} files`,
      none: (name: string) => (name ? `With ${name}` : "Nothing"),
    });
    expect(list(["horse.glb", "a"], 2)).toMatch(/^horse\.glb áñðá a: 2 /);
    expect(none("rat")).toMatch(/ rat$/);
    expect(none("")).not.toContain("undefined");
  });
  it("leaves no plain letter in a sentence", () => {
    const plain = (value: unknown): unknown[] => {
      if (typeof value === "string") return /[a-z]/i.test(value.replaceAll("Cagework", "")) ? [value] : [];
      return typeof value === "object" && value !== null ? Object.values(value).flatMap(plain) : [];
    };
    expect(plain(PSEUDO_LANGUAGE.words)).toEqual([]);
  });
});

describe("another language", () => {
  afterEach(() => setLocale("en"));
  it("has its own numbers and units", () => {
    setLocale("de");
    expect(scientific(0.5)).toBe("0,5");
    expect(scientific(0.000123)).toBe("1,23e-4");
    expect(duration(1234)).toBe("1,2 Sek.");
    expect(decimals(-0.25)).toBe("-0,25");
  });
});

describe("the status line of a gesture", () => {
  const say = (kind: "grab" | "rotate" | "scale", amounts: number[], axis: number | null, plane = false) =>
    sayGesture({ kind, amounts, axis, plane });
  it("gives amounts with at most three decimals, and the constraint", () => {
    expect(say("grab", [0.30001, -0.4, -0.0001], null)).toBe("Move (0.3, -0.4, 0)");
    expect(say("grab", [0.25], 0)).toBe("Move 0.25 along X");
    expect(say("grab", [0, 1, 2], 0, true)).toBe("Move (0, 1, 2) in YZ");
    expect(say("rotate", [90], null)).toBe("Rotate 90°");
    expect(say("rotate", [90], 1, true)).toBe("Rotate 90° around Y");
    expect(say("scale", [2], 2, true)).toBe("Scale × 2 in XY");
  });
});
