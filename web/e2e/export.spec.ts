/** Exported files match the screen and are valid. */

import { validationErrors } from "./models";
import { exportsAPicture, exportsWhatIsShown } from "./stories";
import { bound, cagePositions, download, drag, drop, expect, open, test } from "./support";

test("every export is valid and opens again", { tag: "@story" }, async ({ page }) => {
  await open(page);

  await test.step("poses, cage, weights and picture are valid files", async () => {
    await drag(page, 40, -40);
    await page.keyboard.press("Shift+P");
    const poses = await download(page, "poses");
    expect(await validationErrors(poses.bytes)).toEqual([]);
    const cage = new TextDecoder().decode((await download(page, "cage")).bytes);
    expect(cage.match(/^v /gm)?.length).toBe((await cagePositions(page)).length / 3);
    const weights = await download(page, "weights");
    // An NPZ file is a zip archive, which starts with these bytes.
    expect(Array.from(weights.bytes.slice(0, 4))).toEqual([0x50, 0x4b, 3, 4]);
    await exportsAPicture(page);
  });

  await test.step("a posed model opens as it was exported", async () => {
    await exportsWhatIsShown(page, "export");
  });

  await test.step("the shape is exported in the chosen format and opens again", async () => {
    const plain = await download(page, "shape");
    expect(plain.name).toMatch(/-posed\.obj$/);
    await page.getByRole("radio", { name: "PLY" }).check({ force: true });
    const shape = await download(page, "shape");
    expect(new TextDecoder().decode(shape.bytes.slice(0, 3))).toBe("ply");
    const corners = await page.evaluate(() => globalThis.cagework?.engine.modelTriangles().length ?? 0);
    await drop(page, [shape]);
    await expect(page).toHaveTitle(/-posed\.ply/);
    await bound(page);
    expect(await page.evaluate(() => globalThis.cagework?.engine.modelTriangles().length)).toBe(corners);
  });
});
