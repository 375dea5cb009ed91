/** What may go wrong and must not break the page: settings of a project, links, crashes of the module; and whose work it is. */

import { bound, cagePositions, drag, drop, expect, open, test } from "./support";

test("a project whose settings no bind could have is opened with others, and says which", async ({
  page,
}) => {
  await open(page);
  // All of them were taken once; then neither a bind nor an estimate worked until the page was loaded anew.
  const settings = {
    bind: { grid: 64.5, tau: 0, memory_limit: 1e18 },
    cage: { vertices: 9e9 },
    pose: "AAEC",
    sample: "nobody",
  };
  const project = await page.evaluate(
    (settings) => Array.from(globalThis.cagework?.engine.writeProject([], [], settings) ?? []),
    JSON.stringify(settings),
  );
  await drop(page, [{ name: "strange.cagework.glb", bytes: Uint8Array.from(project) }]);
  const said = page.locator("#toasts");
  await expect(said).toContainText(
    "grid is 64.5; it must be a whole number from 8 to 512: 64 is taken instead",
  );
  await expect(said).toContainText("tau is 0; it must be a number above 0");
  await expect(said).toContainText("vertices is 9000000000; it must be a whole number from 12 to 400");
  await expect(said).toContainText("The pose in this project is damaged");
  await bound(page);
  await drag(page, 30, 20);
});

test("a damaged link says so and opens the page", async ({ page }) => {
  await open(page, "./#sample=rat&pose=****");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("This link is damaged");
  await expect(alert).toContainText("Its pose cannot be read.");
  const before = await cagePositions(page);
  await drag(page, 30, 20);
  expect(await cagePositions(page)).not.toEqual(before);
});

test("the page has the licences of all that is compiled into it", async ({ page, context }) => {
  await open(page);
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
