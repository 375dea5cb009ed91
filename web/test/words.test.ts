import { afterEach, describe, expect, it } from "vitest";
import { duration, scientific, setLocale } from "../src/format";
import { PSEUDO, pseudo } from "../src/words/pseudo";

describe("the pseudo-locale", () => {
  it("accents each letter and lengthens by two fifths", () => {
    const { text } = pseudo({ text: "Choose a model" });
    expect(text).toBe("Çĥööšéçĥ á ɱöðéļɱö");
  });
  it("keeps what is put into a sentence", () => {
    const { list, none } = pseudo({
      list: (names: string[], n: number) => `${names.join(" and ")}: ${n} files`,
      none: (name: string) => (name ? `With ${name}` : "Nothing"),
    });
    expect(list(["horse.glb", "a"], 2)).toMatch(/^horse\.glb áñðá a: 2 /);
    expect(none("rat")).toMatch(/ rat$/);
    expect(none("")).not.toContain("undefined");
  });
  it("has no plain letter in its sentences", () => {
    const plain = (value: unknown): unknown[] => {
      if (typeof value === "string") return /[a-z]/i.test(value.replaceAll("Cagework", "")) ? [value] : [];
      return typeof value === "object" && value !== null ? Object.values(value).flatMap(plain) : [];
    };
    expect(plain(PSEUDO.words)).toEqual([]);
  });
});

describe("another language", () => {
  afterEach(() => setLocale("en"));
  it("has its own numbers and units", () => {
    setLocale("de");
    expect(scientific(0.5)).toBe("0,5");
    expect(scientific(0.000123)).toBe("1,23e-4");
    expect(duration(1234)).toBe("1,2 Sek.");
  });
});
