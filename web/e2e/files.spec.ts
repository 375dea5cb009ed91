/** Files dropped on the page. */

import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { box, boxFaces, dracoGlb, fbx, glb, gltfFiles, meshoptGlb, obj, objOf } from "./models";
import {
  bound,
  cagePositions,
  drag,
  drop,
  dropBox,
  expect,
  modelPositions,
  open,
  openWith,
  shoot,
  test,
  unfold,
} from "./support";

test("good files get a cage and can be dragged, bad files leave the model open and report the cause", {
  tag: "@story",
}, async ({ page, complaints }) => {
  await page.setViewportSize({ width: 820, height: 520 });
  const worm = [{ name: "worm.glb", bytes: await glb() }];
  const draco = [{ name: "draco.glb", bytes: await dracoGlb() }];
  const meshopt = [{ name: "meshopt.glb", bytes: await meshoptGlb() }];
  const tetra = [{ name: "tetra.fbx", bytes: fbx() }];
  const inItsCage = [
    { name: "tetra.obj", bytes: obj(1) },
    { name: "tetra-cage.obj", bytes: obj(1.5) },
  ];
  await open(page);
  for (const files of [worm, draco, meshopt, tetra, inItsCage, await gltfFiles()]) {
    const name = files[0]?.name ?? "";
    await test.step(name, async () => {
      await drop(page, files);
      await expect(page).toHaveTitle(new RegExp(name));
      await bound(page);
      if (files === tetra) expect(Math.max(...(await modelPositions(page)))).toBeCloseTo(1);
      if (files === inItsCage) expect((await cagePositions(page)).length).toBe(3 * 4);
      await drag(page, 30, 20);
      await shoot(page, `dropped-${name}`);
    });
  }

  await test.step("a dropped folder is opened with the files in it", async () => {
    // The browser simulates a real drop, because a DataTransfer that a script creates cannot contain folders.
    const folder = mkdtempSync(join(tmpdir(), "cagework-"));
    const model = join(folder, "garden");
    mkdirSync(join(model, "parts"), { recursive: true });
    const files = await gltfFiles();
    const document = JSON.parse(Buffer.from(files[0]?.bytes ?? []).toString());
    // The texture and the buffer are in a subfolder. The folder also has a text file and a hidden file.
    for (const part of [...document.buffers, ...document.images]) part.uri = `parts/${part.uri}`;
    writeFileSync(join(model, "garden.gltf"), JSON.stringify(document));
    for (const { name, bytes } of files.slice(1)) writeFileSync(join(model, "parts", name), bytes);
    writeFileSync(join(model, "notes.txt"), "drawn on a rainy day");
    writeFileSync(join(model, ".hidden.gltf"), "not a model");
    const cdp = await page.context().newCDPSession(page);
    const data = { items: [], files: [model], dragOperationsMask: 1 };
    for (const type of ["dragEnter", "dragOver", "drop"] as const)
      await cdp.send("Input.dispatchDragEvent", { type, x: 200, y: 250, data });
    await expect(page).toHaveTitle(/garden/);
    await bound(page);
    const [triangles, textures] = [2 * 40 * 32, 1];
    await page.getByRole("button", { name: "Model", exact: false }).first().click();
    const facts = page.locator("#panel").filter({ visible: true });
    await expect(facts).toContainText(new RegExp(`${triangles.toLocaleString("en")}|${triangles}`));
    await expect(facts).toContainText(new RegExp(`Textures\\s*${textures}`));
    await shoot(page, "dropped-folder");
    rmSync(folder, { recursive: true });
  });

  await test.step("changed settings of the cage apply when it is made", async () => {
    await page.getByRole("button", { name: "Cage", exact: false }).first().click();
    await unfold(page);
    const gaps = page.getByLabel("Gaps left open");
    await expect(gaps).toHaveAttribute("aria-valuetext", "as small as the number of vertices allows");
    await gaps.fill("128");
    await expect(gaps).toHaveAttribute("aria-valuetext", "from 2.3% of the model's size");
    const primary = page.locator(".panel-foot .primary").filter({ visible: true });
    await expect(primary).toHaveText("Make this cage");
    await shoot(page, "cage-unmade");
    await primary.click();
    await bound(page);
    await expect(primary).toHaveText("Pose it");
  });

  await test.step("a bad file is reported", async () => {
    const before = await cagePositions(page);
    const good = await glb();
    const alert = page.locator("#toasts [role=alert]");
    const cases: [string, Uint8Array, RegExp][] = [
      ["empty.glb", new Uint8Array(), /empty|no content/i],
      ["broken.glb", good.slice(0, good.length - 1000), /cut off|damaged/i],
      ["noise.glb", new Uint8Array(5000).map((_, k) => (k * 7919) % 251), /not a GLB|damaged/i],
      ["picture.blend", new TextEncoder().encode("BLENDER-v401"), /opens|Blender/i],
      ["numbers.obj", new TextEncoder().encode("v 1 2\nf 1 2 3\n"), /line 1/i],
    ];
    for (const [name, bytes, message] of cases) {
      await drop(page, [{ name, bytes }]);
      await expect(alert.getByText(message).first(), name).toBeVisible();
      await alert.getByRole("button", { name: /close/i }).first().click();
    }
    await shoot(page, "bad-files");
    expect(await cagePositions(page)).toEqual(before);
    expect(complaints).toEqual([]);
  });

  await test.step("a file too large for a browser is refused before it is read", async () => {
    await page.evaluate(() => {
      const file = new File(["glTF"], "huge.glb");
      Object.defineProperty(file, "size", { value: 5 * 2 ** 30 });
      const session = globalThis.cagework;
      return session
        ?.readFiles([{ name: file.name, path: file.name, file }], { pixels: 0, bytes: 0 })
        .done.catch((error) => {
          document.body.dataset.refused = `${error.name}: ${error.message}`;
        });
    });
    await expect(page.locator("body")).toHaveAttribute("data-refused", /TooLarge: huge.glb has 5.0 GiB/);
  });

  await test.step("an open cage is drawn with its faults and can be repaired", async () => {
    await drop(page, [
      { name: "tetra.obj", bytes: obj(1) },
      { name: "tetra-cage.obj", bytes: obj(1.5, true) },
    ]);
    const fault = page.locator("#panel").getByText(/not closed|open edge/i);
    await expect(fault.first()).toBeVisible();
    await shoot(page, "open-cage");
  });

  await test.step("a cage with a vertex at 1e30 is refused or opened as a draft", async () => {
    const { positions, faces } = boxFaces(0.8);
    const far = objOf({ positions: positions.map((p, k) => (k === 7 ? [1e30, 1e30, 1e30] : p)), faces });
    await drop(page, [
      { name: "model.obj", bytes: box(0.5) },
      { name: "model-cage.obj", bytes: far },
    ]);
    await expect(page).toHaveTitle(/model/);
    await expect(page.locator("#stage .busy")).toBeHidden();
    await dropBox(page, "good");
    await drag(page, 20, 10);
  });
});

test("choosing Z as the up axis turns model, cage and pose, but not exported files", async ({ page }) => {
  await openWith(page, [
    { name: "tower.obj", bytes: box([0.5, 0.7, 1.5]) },
    { name: "tower-cage.obj", bytes: box([0.8, 1, 2]) },
  ]);
  await bound(page);
  await drag(page, 30, -20);
  const lying = await cagePositions(page);
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  await unfold(page);
  const choice = page.getByRole("group", { name: "Up axis" });
  await choice.getByRole("radio", { name: "Z" }).click();
  // The model turns by -90 degrees about x.
  const TOLERANCE = 1e-3;
  const farthest = (a: number[], b: number[]) => Math.max(...a.map((x, k) => Math.abs(x - (b[k] ?? 1e9))));
  const upright = lying.map((x, k) => [x, lying[k + 1] ?? 0, -(lying[k - 1] ?? 0)][k % 3] ?? 0);
  await expect.poll(async () => farthest(await cagePositions(page), upright)).toBeLessThan(TOLERANCE);
  await bound(page);
  const files = await page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    const cage = new TextDecoder().decode(engine?.exportCage());
    return { cage, project: Array.from(engine?.writeProject("{}") ?? []) };
  });
  const written = files.cage.match(/^v .*/gm)?.flatMap((line) => line.split(" ").slice(1).map(Number));
  expect(farthest(written ?? [], lying)).toBeLessThan(TOLERANCE);
  await shoot(page, "turned");
  // An added model is turned as well, even if it is set to stay in place while the cage bends.
  const chooser = page.waitForEvent("filechooser");
  await page.getByRole("button", { name: "Add to this cage" }).click();
  const beam = { name: "beam.obj", mimeType: "text/plain", buffer: Buffer.from(box([0.1, 0.2, 0.6])) };
  await (await chooser).setFiles([beam]);
  await bound(page);
  await page.getByRole("button", { name: "beam.obj stays as it is", exact: true }).click();
  const off = async () =>
    farthest((await modelPositions(page)).slice(-24).map(Math.abs), Array(8).fill([0.1, 0.6, 0.2]).flat());
  await expect.poll(off).toBeLessThan(1e-5);
  await drop(page, [{ name: "tower.cagework.glb", bytes: Uint8Array.from(files.project) }]);
  await bound(page);
  await unfold(page);
  await expect(choice.getByLabel("Z")).toBeChecked();
  const heights = (await cagePositions(page)).filter((_, k) => k % 3 === 1);
  expect(Math.max(...heights)).toBe(2);
});
