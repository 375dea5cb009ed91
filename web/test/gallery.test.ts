import { expect, it } from "vitest";
import links from "../src/gallery/links.json";
import { decodeShare } from "../src/share";
import { T } from "../src/words";
import { galleryWords } from "../src/words/en/gallery";

it("every example of the gallery is a link to a pose of a sample, with a title", async () => {
  expect(Object.keys(links).toSorted()).toEqual(Object.keys(galleryWords.examples).toSorted());
  for (const [id, text] of Object.entries(links)) {
    const link = await decodeShare(text);
    expect(Object.keys(T.samples), id).toContain(link?.sample);
    expect(link?.pose?.length, id).toBeGreaterThan(0);
    expect(link?.seen?.camera.distance, id).toBeGreaterThan(0);
  }
});
