/** A humanoid gets other proportions, and is exported with them. */

import { NodeIO } from "@gltf-transform/core";
import type { Page } from "@playwright/test";
import { dancer, validationErrors } from "./models";
import { complaintsOfAxe } from "./stories";
import {
  bound,
  cagePositions,
  download,
  expect,
  modelPositions,
  open,
  openWith,
  shoot,
  test,
  unfold,
} from "./support";

const heightOf = (positions: ArrayLike<number>) => {
  const heights = Array.from(positions).filter((_, k) => k % 3 === 1);
  return Math.max(...heights) - Math.min(...heights);
};
const height = async (page: Page) => heightOf(await modelPositions(page));
const slider = (page: Page, name: string) => page.getByRole("slider", { name, exact: true });

test("a humanoid gets longer legs and a bigger head in six steps", async ({ page }) => {
  await open(page, "./#sample=humanoid"); // 1. Open the model.
  const [before, cage] = [await height(page), await cagePositions(page)];
  await page.getByRole("button", { name: "Pose", exact: false }).first().click(); // 2. Step Pose.

  await test.step("sliders change the model, and undo returns", async () => {
    await slider(page, "Legs").fill("1.3"); // 3. Longer legs.
    // The legs are 0.8 units long.
    expect(await height(page)).toBeGreaterThan(before + 0.15);
    await slider(page, "Head").fill("1.4"); // 4. A bigger head.
    await expect(page.getByRole("button", { name: /^Undo/ })).toHaveAttribute("data-tip", /Proportion: Head/);
    await shoot(page, "proportions");
    expect(await complaintsOfAxe(page)).toEqual([]);
  });

  await test.step("the export stands on the same ground", async () => {
    const file = await download(page, "glb"); // 5. Step Export. 6. Download.
    await expect(page.getByRole("switch", { name: "Stand on the same ground" })).toBeChecked();
    expect(await validationErrors(file.bytes)).toEqual([]);
    const root = (await new NodeIO().readBinary(file.bytes)).getRoot();
    const [primitive] = root.listMeshes().flatMap((mesh) => mesh.listPrimitives());
    const exported = primitive?.getAttribute("POSITION")?.getArray() ?? [];
    expect(heightOf(exported)).toBeCloseTo(await height(page), 4);
  });

  await test.step("presets, separate sides and resets", async () => {
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    await page.getByRole("button", { name: "Undo" }).click();
    await expect(slider(page, "Head")).toHaveValue("1");
    await page.getByRole("button", { name: "Chibi" }).click();
    await expect(page.getByRole("button", { name: "Chibi" })).toHaveAttribute("aria-pressed", "true");
    await expect(slider(page, "Legs")).toHaveValue("0.65");
    await unfold(page);
    await page.getByRole("switch", { name: "Left and right apart" }).click();
    await slider(page, "Legs, left").fill("0.9");
    await expect(slider(page, "Legs, right")).toHaveValue("0.65");
    await page.getByRole("switch", { name: "Left and right apart" }).click();
    await expect(slider(page, "Legs")).toHaveValue("0.9");
    const typed = page.getByRole("spinbutton", { name: "Legs, percent" });
    await typed.fill("120");
    await typed.press("Enter");
    await expect(slider(page, "Legs")).toHaveValue("1.2");
    await slider(page, "Legs").dblclick();
    await expect(slider(page, "Legs")).toHaveValue("1");
    await page.getByRole("button", { name: "Reset all" }).click();
    await expect(slider(page, "Head")).toHaveValue("1");
    expect(await cagePositions(page)).toEqual(cage);
  });

  await test.step("the bones are listed and can be changed", async () => {
    await unfold(page);
    const chest = page.getByRole("combobox", { name: "Chest", exact: true });
    await expect(page.getByRole("combobox", { name: "Left thigh" })).toHaveValue("thigh.L");
    await chest.selectOption("spine");
    await expect(chest).toHaveValue("spine");
    await page.getByRole("button", { name: "Undo" }).click();
    await expect(chest).toHaveValue("");
  });
});

test("a skeleton of another kind says which bones are missing", async ({ page }) => {
  await openWith(page, [{ name: "dancer.glb", bytes: await dancer() }]);
  await expect(page).toHaveTitle(/dancer/);
  await bound(page);
  await page.getByRole("button", { name: "Pose", exact: false }).first().click();
  await expect(page.getByRole("heading", { name: "Proportions" })).toBeHidden();
  await page.getByText("No proportions").click();
  await expect(page.getByText(/no joint was found for head/)).toBeVisible();
});
