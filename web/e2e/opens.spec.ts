/** The first visit: the page opens with a sample that can be dragged at once. */

import { box } from "./models";
import { drawsNothing, followsAHandle } from "./stories";
import { cagePositions, drag, drop, expect, largestMove, open, shoot, test } from "./support";

test("opens below any path with a bound sample, draws nothing when idle, and shares its pose by a link", {
  tag: "@story",
}, async ({ page, context, complaints }) => {
  const foreign: string[] = [];
  page.on("request", (request) => {
    const { hostname, protocol } = new URL(request.url());
    if (protocol.startsWith("http") && hostname !== "127.0.0.1") foreign.push(request.url());
  });
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  await open(page, "~student/some%20where/cagework/");
  await shoot(page, "opens");
  await test.step("an idle page draws nothing", () => drawsNothing(page));
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
  await test.step("the page lists the licences of everything compiled into it", async () => {
    await page.getByRole("button", { name: "Model", exact: false }).first().click();
    const opened = context.waitForEvent("page");
    await page.getByRole("link", { name: "Licences" }).click();
    const licences = await opened;
    const text = (await licences.textContent("body")) ?? "";
    for (const name of ["wgpu", "glam", "serde", "gltf", "draco-core", "meshoptimizer-rs", "preact"])
      expect(text).toMatch(new RegExp(`^${name} v\\d.*: .*(MIT|Apache)`, "m"));
    expect(text).toContain("Permission is hereby granted");
    expect(text).toContain("Apache License");
    // The list contains no build tools, whose code is not part of the page.
    expect(text).not.toMatch(/^(vite|syn|wasm-bindgen-cli-support) v/m);
    const library = await page.request.get("./rust-standard-library.html");
    expect(library.ok()).toBe(true);
  });
  await test.step("parts that cannot be loaded are not blamed on the file", async () => {
    await context.setOffline(true);
    const alert = page.locator("#toasts [role=alert]");
    await page.getByRole("button", { name: "Take the tour" }).click();
    await expect(alert).toContainText("The tour could not start");
    await drop(page, [{ name: "good.obj", bytes: box(0.5) }]);
    await expect(alert).toContainText(
      "good.obj could not be openedPart of the page could not be loaded. Check the connection and reload; your work is kept.",
    );
    await shoot(page, "unloaded");
    expect(await alert.getByRole("button", { name: "Reload the page" }).count()).toBe(1);
    complaints.length = 0;
  });
  expect(foreign, "all requests go to the server of the page").toEqual([]);
});
