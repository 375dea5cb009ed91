import { afterEach, describe, expect, it, vi } from "vitest";
import {
  ago,
  type Entry,
  isEntry,
  isExpired,
  isWhole,
  newestFirst,
  toOpen,
  type Work,
} from "../src/works/entry";
import { heldIds, hold } from "../src/works/holds";

const DAY = 86_400_000;

const entry = (id: string, when: number): Entry => ({ id, name: `${id}.obj`, when, size: 100 });
const work = (id: string, where: Work["where"] = "nowhere"): Work => ({ ...entry(id, 0), where });

/** Writes the 12-byte header of a GLB (magic, version 2, file length), padded with zeros to `length` bytes. */
function glb(length: number): Uint8Array {
  const bytes = new Uint8Array(length);
  const view = new DataView(bytes.buffer);
  for (const [k, value] of [0x46546c67, 2, length].entries()) view.setUint32(4 * k, value, true);
  return bytes;
}

describe("entries", () => {
  it("give their age in words", () => {
    expect(ago(10_000)).toBe("a moment ago");
    expect(ago(60_000)).toBe("1 minute ago");
    expect(ago(7_200_000)).toBe("2 hours ago");
    expect(ago(3 * DAY)).toBe("3 days ago");
  });
  it("are sorted newest first, in a new list", () => {
    const list = [entry("a", 10), entry("b", 30), entry("c", 20)];
    expect(newestFirst(list).map(({ id }) => id)).toEqual(["b", "c", "a"]);
    expect(list[0]?.id).toBe("a");
  });
  it("expire after 30 days", () => {
    expect(isExpired(entry("a", 0), 30 * DAY)).toBe(false);
    expect(isExpired(entry("a", 0), 30 * DAY + 1)).toBe(true);
  });
  it("are validated", () => {
    expect(isEntry(entry("a", 5))).toBe(true);
    const bad = [null, "a", {}, { ...entry("a", 5), when: Number.NaN }, { ...entry("a", 5), size: -1 }];
    expect(bad.map(isEntry)).toEqual(bad.map(() => false));
    expect(isEntry({ ...entry("a", 5), name: 7 })).toBe(false);
  });
  it("need a complete file", async () => {
    const bytes = [glb(40), glb(40).slice(0, 30), glb(40).slice(0, 8), new Uint8Array(40)];
    const files = bytes.map((part) => new Blob([part as BlobPart]));
    expect(await Promise.all(files.map(isWhole))).toEqual([true, false, false, false]);
  });
});

describe("the work opened at the start", () => {
  const opened = (works: Work[], own: string | null = null) => toOpen(works, own)?.id;
  it("is the only work", () => expect(opened([work("a")])).toBe("a"));
  it("is undefined if there are several", () => expect(opened([work("a"), work("b")])).toBeUndefined());
  it("is what this tab had open, even if there are several", () =>
    expect(opened([work("a"), work("b")], "b")).toBe("b"));
  it("is never what another tab has open", () => {
    expect(opened([work("a", "elsewhere")])).toBeUndefined();
    expect(opened([work("a", "elsewhere"), work("b")])).toBe("b");
  });
  it("may still be locked by the page before the reload", () => {
    expect(opened([work("a", "elsewhere"), work("b")], "a")).toBe("a");
  });
  it("is never work that crashed the page", () => {
    expect(opened([{ ...work("a"), stopped: true }], "a")).toBeUndefined();
    expect(opened([{ ...work("a"), stopped: true }, work("b")])).toBeUndefined();
  });
});

describe("locks", () => {
  afterEach(() => vi.unstubAllGlobals());
  it("are missing on plain HTTP, where all work counts as free", async () => {
    vi.stubGlobal("navigator", {});
    expect(await hold("a")).toBeDefined();
    expect([...(await heldIds())]).toEqual([]);
  });
  it("of other pages of the origin are ignored", async () => {
    const held = [{ name: "cagework.work.a" }, { name: "somebody's" }, {}];
    vi.stubGlobal("navigator", { locks: { query: async () => ({ held }) } });
    expect([...(await heldIds())]).toEqual(["a"]);
  });
});
