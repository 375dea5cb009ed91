/** The gallery: its examples move and then stop drawing, and a title opens the page in the example's pose. */

import links from "../src/gallery/links.json" with { type: "json" };
import { decodeShare } from "../src/share";
import { complaintsOfAxe } from "./stories";
import { bound, expect, largestMove, open, restPositions, shoot, test } from "./support";

/** Lower limit for the size of a picture of an example, bytes. A PNG of a view in a single colour is smaller. */
const PNG_OF_NOTHING = 3000;

/** Limit for the files that the gallery downloads until all examples are live, bytes before compression. */
const MAX_DOWNLOAD = 6_900_000;

test.use({ viewport: { width: 1440, height: 900 } });

test("both pages name a picture for links to them", async ({ page }) => {
  for (const [path, title] of [
    ["./", "Cagework"],
    ["./gallery.html", "Gallery - Cagework"],
  ] as const) {
    const html = await (await page.request.get(path)).text();
    const tag = (key: string) => new RegExp(`property="${key}" content="([^"]+)"`).exec(html)?.[1] ?? "";
    expect(tag("og:title")).toBe(title);
    expect(tag("og:description")).toMatch(/in your browser/);
    expect(tag("twitter:card")).toBe("summary_large_image");
    const picture = await (await page.request.get(tag("og:image"))).body();
    expect(picture.length).toBeLessThan(150_000);
    // The first frame header of a JPEG: marker, length, precision, height, width.
    const frame = picture.indexOf(Buffer.from([0xff, 0xc0]));
    expect([picture.readUInt16BE(frame + 7), picture.readUInt16BE(frame + 5)].map(String)).toEqual([
      tag("og:image:width"),
      tag("og:image:height"),
    ]);
  }
});

test("a link shows coordinates side by side, and is copied with them", async ({ page, context }) => {
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  await open(page, `./${links.compare}`);
  // Both further kinds are computed after the bind: 34 s at a load average of 15.
  await expect(page.locator(".compare-labels")).toHaveText("HarmonicMean valueGreen", { timeout: 100_000 });
  await shoot(page, "link-compare");
  await page.getByRole("button", { name: /link/i }).first().click();
  const copied = async () => {
    const text = await page.evaluate(() => navigator.clipboard.readText());
    return decodeShare(text.slice(text.indexOf("#")));
  };
  await expect
    .poll(async () => (await copied())?.seen?.scene.compare)
    .toEqual(["harmonic", "mean_value", "green"]);
});

test("every example is drawn, and a title opens the page in its pose", async ({ page }) => {
  await page.goto("./gallery.html");
  const examples = page.locator("[data-example]");
  await expect(page.locator("[data-live=true]")).toHaveCount(6, { timeout: 100_000 });
  for (const example of await examples.all()) {
    await expect(example, "fits on one screen").toBeInViewport({ ratio: 1 });
    const picture = await example.locator("canvas").screenshot();
    expect(picture.length, (await example.getAttribute("data-example")) ?? "").toBeGreaterThan(
      PNG_OF_NOTHING,
    );
  }
  // Count each file once: a server that allows caching sends the script of the six workers once.
  const downloads = await page.evaluate(() => {
    const ofType = (type: string) => performance.getEntriesByType(type) as PerformanceResourceTiming[];
    const entries = [...ofType("navigation"), ...ofType("resource")];
    return [...new Map(entries.map(({ name, encodedBodySize }) => [name, encodedBodySize]))];
  });
  expect(downloads.filter(([name]) => name.endsWith(".wasm"))).toHaveLength(1);
  const bytes = downloads.reduce((sum, [, bytes]) => sum + bytes, 0);
  expect(bytes, downloads.join("\n")).toBeLessThan(MAX_DOWNLOAD);
  // Wait until the last example draws nothing for 60 frames of the browser. If it never stops, the test times out.
  await page.evaluate(async () => {
    let quiet = 0;
    globalThis.cagework?.onFrame(() => {
      quiet = 0;
    });
    for (; quiet < 60; quiet++) await new Promise(requestAnimationFrame);
  });
  expect(await complaintsOfAxe(page)).toEqual([]);
  await shoot(page, "gallery");

  const title = page.getByRole("link", { name: "Bend a capture" });
  const link = await decodeShare(new URL((await title.getAttribute("href")) ?? "", page.url()).hash);
  await title.click();
  await expect(page).toHaveTitle(/Spot/);
  await bound(page);
  const [shown, wanted] = await page.evaluate(
    (pose) => {
      const engine = globalThis.cagework?.engine;
      if (!engine) throw new Error("no session");
      const shown = Array.from(engine.cagePositions());
      engine.decodePose(Uint8Array.from(pose));
      return [shown, Array.from(engine.cagePositions())] as const;
    },
    Array.from(link?.pose ?? []),
  );
  expect(shown).toEqual(wanted);
  expect(largestMove(shown, await restPositions(page)), "the capture is posed").toBeGreaterThan(0.1);
});
