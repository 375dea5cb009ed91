/** The page opens with a model that can be dragged at once. */

import { followsAHandle } from "./stories";
import { cagePositions, drag, drawn, expect, largestMove, open, shoot, test } from "./support";

test("opens with a sample that is bound, is idle, follows a handle, and is passed on by a link", async ({
  page,
  context,
}) => {
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  await open(page);
  await shoot(page, "opens");
  await test.step("an idle page draws nothing", async () => {
    await drawn(page);
    const frames = await page.evaluate(async () => {
      let frames = 0;
      const stop = globalThis.cagework?.onFrame(() => {
        frames += 1;
      });
      // The browser draws a second long, the page nothing.
      for (let k = 0; k < 60; k++) await new Promise(requestAnimationFrame);
      stop?.();
      return frames;
    });
    expect(frames).toBe(0);
  });
  await followsAHandle(page, "posed");
  await test.step("a link carries the pose", async () => {
    await drag(page, -50, -30);
    const posed = await cagePositions(page);
    await page.getByRole("button", { name: /link/i }).first().click();
    const copied = () => page.evaluate(() => navigator.clipboard.readText());
    await expect.poll(copied).toContain("#");
    const link = await copied();
    const other = await context.newPage();
    await open(other, link);
    expect(largestMove(posed, await cagePositions(other))).toBeLessThan(1e-3);
  });
});

test("works below any path, from its own files alone", async ({ page, context }) => {
  const strangers: string[] = [];
  page.on("request", (request) => {
    const { hostname, protocol } = new URL(request.url());
    if (protocol.startsWith("http") && hostname !== "127.0.0.1") strangers.push(request.url());
  });
  await open(page, "~student/some%20where/cagework/");
  await drag(page, 40, 10);
  expect(strangers).toEqual([]);
  await test.step("the page has the licences of all that is compiled into it", async () => {
    await page.getByRole("button", { name: "Model", exact: false }).first().click();
    const opened = context.waitForEvent("page");
    await page.getByRole("link", { name: "Licences" }).click();
    const licences = await opened;
    const text = (await licences.textContent("body")) ?? "";
    for (const name of [
      "wgpu",
      "glam",
      "serde",
      "gltf",
      "@gltf-transform/core",
      "draco3dgltf",
      "meshoptimizer",
    ])
      expect(text).toMatch(new RegExp(`^${name} v\\d.*: .*(MIT|Apache)`, "m"));
    expect(text).toContain("Permission is hereby granted");
    expect(text).toContain("Apache License");
    // Tools that only build the page are no part of it.
    expect(text).not.toMatch(/^(vite|syn|wasm-bindgen-cli-support) v/m);
    const library = await page.request.get("./rust-standard-library.html");
    expect(library.ok()).toBe(true);
  });
});
