/** What may go wrong and must not break the page: settings of a project, links, crashes of the module; and whose work it is. */

import { expect, open, test } from "./support";

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
