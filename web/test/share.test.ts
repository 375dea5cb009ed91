import { describe, expect, it } from "vitest";
import { decodeShare, encodeShare, fromBase64Url, toBase64Url } from "../src/share";

const pose = Uint8Array.from({ length: 480 }, (_, i) => (i * 7919) % 256);

describe("share links", () => {
  it("bring sample and pose back", async () => {
    const link = await encodeShare({ sample: "rat", pose });
    expect(await decodeShare(link)).toEqual({ sample: "rat", pose });
  });

  it("use only letters that an address allows", async () => {
    expect(await encodeShare({ sample: "rat", pose })).toMatch(/^#sample=rat&pose=[A-Za-z0-9_-]+$/);
  });

  it("leave a rest pose out", async () => {
    expect(await encodeShare({ sample: "clamp" })).toBe("#sample=clamp");
    expect(await decodeShare("#sample=clamp")).toEqual({ sample: "clamp" });
  });

  it("are not every fragment", async () => {
    expect(await decodeShare("")).toBeUndefined();
    expect(await decodeShare("#top")).toBeUndefined();
    expect(await decodeShare(`#sample=${"x".repeat(20_000)}`)).toBeUndefined();
  });

  it("with a damaged pose are an error", async () => {
    await expect(decodeShare("#sample=rat&pose=****")).rejects.toThrow();
  });

  it("encode every byte", () => {
    const all = Uint8Array.from({ length: 256 }, (_, i) => i);
    expect(fromBase64Url(toBase64Url(all))).toEqual(all);
  });
});
