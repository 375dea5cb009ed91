import { describe, expect, it } from "vitest";
import { decodeShare, encodeShare, fromBase64Url, toBase64Url } from "../src/share";

const pose = Uint8Array.from({ length: 480 }, (_, i) => (i * 7919) % 256);

describe("share links", () => {
  it("restore sample and pose", async () => {
    const link = await encodeShare({ sample: "rat", pose });
    expect(await decodeShare(link)).toEqual({ sample: "rat", pose });
  });

  it("restore a smooth surface and controls inside", async () => {
    const controls = {
      controls: { smooth: 2, inner: 2, elements: [{ line: [0, 1] }], radius: null },
      inner: [0, 0.5, 0, 0, 1, 0],
    };
    expect(await decodeShare(await encodeShare({ sample: "rat", controls }))).toEqual({
      sample: "rat",
      controls,
    });
    await expect(decodeShare("#sample=rat&controls=****")).rejects.toThrow("Its controls cannot be read");
  });

  it("restore a clip", async () => {
    const shared = { sample: "humanoid", clip: 3 };
    const link = await encodeShare(shared);
    expect(link).toBe("#sample=humanoid&clip=3");
    expect(await decodeShare(link)).toEqual(shared);
    await expect(decodeShare("#sample=humanoid&clip=-1")).rejects.toThrow("Its clip cannot be read");
  });

  it("use only characters allowed in a URL", async () => {
    expect(await encodeShare({ sample: "rat", pose })).toMatch(/^#sample=rat&pose=[A-Za-z0-9_-]+$/);
  });

  it("omit a rest pose", async () => {
    expect(await encodeShare({ sample: "clamp" })).toBe("#sample=clamp");
    expect(await decodeShare("#sample=clamp")).toEqual({ sample: "clamp" });
  });

  it("ignore other fragments", async () => {
    expect(await decodeShare("")).toBeUndefined();
    expect(await decodeShare("#top")).toBeUndefined();
  });

  it("report damaged links", async () => {
    await expect(decodeShare("#sample=rat&pose=****")).rejects.toThrow("Its pose cannot be read");
    await expect(decodeShare(`#sample=rat&pose=${"A".repeat(20_000)}`)).rejects.toThrow("16384 characters");
    await expect(decodeShare("#sample=&pose=AAAA")).rejects.toThrow("which sample");
    const link = await encodeShare({ sample: "rat", pose });
    await expect(decodeShare(link.slice(0, -60))).rejects.toThrow("Its pose cannot be read");
  });

  it("encode every byte", () => {
    const all = Uint8Array.from({ length: 256 }, (_, i) => i);
    expect(fromBase64Url(toBase64Url(all))).toEqual(all);
  });
});
