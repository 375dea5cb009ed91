/** Rigged models are posed, play their clips, and are exported with pose and clips. */

import { readFileSync } from "node:fs";
import { NodeIO } from "@gltf-transform/core";
import type { Page } from "@playwright/test";
import { RIG_DEFAULTS } from "../src/defaults";
import { dancer, positionsOf, shownAt, validationErrors } from "./models";
import {
  bound,
  cagePositions,
  download,
  drawing,
  drawn,
  drop,
  expect,
  grip,
  handle,
  hears,
  largestMove,
  open,
  openWith,
  placeOf,
  pull,
  reachable,
  rested,
  shoot,
  test,
  unfold,
} from "./support";

const TIMES = [0, 0.6, 1.3];

/** Returns the vertex positions while the first clip is at each of the given times, seconds. */
async function played(page: Page, at: readonly number[] = TIMES, rig = RIG_DEFAULTS): Promise<number[][]> {
  return page.evaluate(
    async ({ times, rig }) => {
      const session = globalThis.cagework;
      if (!session) throw new Error("no session");
      await session.engine.startClip(rig);
      const found = times.map((time) => {
        session.engine.showClip(0, time, new Float32Array(), true);
        return [...session.engine.clipPositions()];
      });
      session.engine.stopClip();
      return found;
    },
    { times: at, rig },
  );
}

/** Returns the vertex positions of the frame that is shown. */
const shownFrame = (page: Page) =>
  page.evaluate(() => [...(globalThis.cagework?.engine.clipPositions() ?? [])]);

/**
 * Drags the cage while the clip is paused at `seconds`. Checks that the shown frame follows the cage and equals the
 * exported shape.
 */
async function dragsFrame(page: Page, seconds: number): Promise<void> {
  await page.getByRole("button", { name: "Pose", exact: false }).first().click();
  const [before, cage] = [await shownFrame(page), await cagePositions(page)];
  const { x, y } = await handle(page, await reachable(page));
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 40, y - 20, { steps: 4 });
  await page.mouse.up();
  await expect.poll(async () => largestMove(cage, await cagePositions(page))).toBeGreaterThan(0.01);
  await expect(page.getByRole("combobox", { name: "Clip" })).toHaveValue("0");
  const shape = new TextDecoder().decode((await download(page, "shape")).bytes);
  const vertices = [...shape.matchAll(/^v (.*)$/gm)].flatMap(([, xyz = ""]) => xyz.split(" ").map(Number));
  expect(largestMove(before, vertices), "the frame follows").toBeGreaterThan(0.005);
  // The view shows the new pose a few frames later.
  await expect.poll(async () => largestMove(await shownFrame(page), vertices)).toBeLessThan(2e-5);
  await shoot(page, `clip-posed-${seconds}`);
}

test("a clip is chosen, paused, bent by the cage and exported", async ({ page }) => {
  await open(page, "./#sample=humanoid");
  await expect(page).toHaveTitle(/Legs close together/);
  const rest = await played(page);
  // Clips start by themselves unless the user prefers reduced motion, which is set for all other tests.
  await page.emulateMedia({ reducedMotion: "no-preference" });

  await test.step("a chosen clip plays, and pauses at the time of the slider", async () => {
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    await page.getByRole("combobox", { name: "Clip" }).selectOption("0");
    await expect(page.getByRole("button", { name: "Pause the clip" })).toBeVisible();
    await shoot(page, "clip");
    await page.keyboard.press("Shift+J");
    await expect(page.getByRole("button", { name: "Play the clip" })).toBeVisible();
    await page.getByRole("slider", { name: "Playhead" }).fill("0.6");
    const at = await page.evaluate(() => [...(globalThis.cagework?.engine.clipPositions() ?? [])]);
    expect(largestMove(at, rest[1] ?? [])).toBeLessThan(1e-5);
    expect(largestMove(at, rest[0] ?? []), "the legs swing").toBeGreaterThan(0.1);
  });

  await test.step("Space shows the original, and its release the frame", async () => {
    await page.getByRole("application").focus();
    const frame = await drawing(page);
    await page.keyboard.down(" ");
    await expect.poll(async () => frame.equals(await drawing(page))).toBe(false);
    await shoot(page, "clip-original");
    await page.keyboard.up(" ");
    await expect.poll(async () => frame.equals(await drawing(page))).toBe(true);
    await page.getByRole("application").blur();
  });

  await test.step("the picture of a saved pose leaves the frame as it is", async () => {
    const frame = await shownFrame(page);
    const picture = await drawing(page);
    await page.getByRole("button", { name: "Save pose" }).click();
    await expect(page.locator(".poses > li").last().locator("img")).toBeVisible();
    expect(largestMove(frame, await shownFrame(page))).toBe(0);
    await expect.poll(async () => picture.equals(await drawing(page))).toBe(true);
    await page.getByRole("button", { name: "Undo" }).click();
  });

  await test.step("joints are drawn", async () => {
    const picture = () => drawing(page);
    const without = await picture();
    await page.keyboard.press("n");
    const joints = page.getByRole("switch", { name: "Show joints" });
    await joints.click();
    await expect.poll(async () => without.equals(await picture())).toBe(false);
    await shoot(page, "joints");
    await joints.click();
    await expect.poll(async () => without.equals(await picture())).toBe(true);
    await page.keyboard.press("n");
  });

  await test.step("the cage poses a paused frame, which is exported as it is shown", async () => {
    await dragsFrame(page, 0.6);
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    await page.keyboard.press("Control+z");
    await expect(page.getByRole("button", { name: "Undo" })).toBeDisabled();
  });

  await test.step("a point of the paused frame is pulled, and follows the pointer", async () => {
    await drawn(page);
    const before = await cagePositions(page);
    const at = await grip(page, [0.6, 0.7]);
    await pull(page, at, 30, -20);
    await rested(page);
    await expect(page.getByRole("combobox", { name: "Clip" })).toHaveValue("0");
    expect(largestMove(before, await cagePositions(page))).toBeGreaterThan(0.01);
    const to = await placeOf(page, at.point);
    expect(Math.hypot(to.x - at.x - 30, to.y - at.y + 20), "pixels from the pointer").toBeLessThan(6);
    await shoot(page, "clip-pulled");
  });

  await test.step("the model is pulled without a clip", async () => {
    await page.getByRole("combobox", { name: "Clip" }).selectOption("");
    await drawn(page);
    const before = await cagePositions(page);
    const at = await grip(page, [0.5, 0.2]);
    await pull(page, at, 0, -50);
    await rested(page);
    expect(largestMove(before, await cagePositions(page))).toBeGreaterThan(0.01);
    await expect(page.getByRole("combobox", { name: "Clip" })).toHaveValue("");
  });

  await test.step("the cage bends the moving model, also while it is paused, and the export shows the same", async () => {
    const [plain = []] = await played(page, [1]);
    await page.getByRole("button", { name: "Export", exact: false }).first().click();
    await unfold(page);
    await page.getByRole("switch", { name: "The cage bends the moving model" }).click();
    await page.getByRole("combobox", { name: "Clip" }).selectOption("0");
    await expect(page.getByRole("button", { name: "Pause the clip" })).toBeVisible();
    await shoot(page, "clip-bent");
    await page.keyboard.press("Shift+J");
    await expect(page.getByRole("button", { name: "Play the clip" })).toBeVisible();
    await page.getByRole("slider", { name: "Playhead" }).fill("1");
    const shown = await shownFrame(page);
    expect(largestMove(shown, plain)).toBeGreaterThan(0.01);
    await dragsFrame(page, 1);
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    await page.keyboard.press("Control+z");
    await expect.poll(async () => largestMove(await shownFrame(page), shown)).toBeLessThan(1e-6);
    await expect(page.getByRole("combobox", { name: "Clip" })).toHaveValue("0");
    const file = await download(page, "glb");
    expect(await validationErrors(file.bytes)).toEqual([]);
    expect(largestMove(shown, await shownAt(file.bytes, 1)), "at one second").toBeLessThan(2e-5);
  });

  await test.step("reshaping ends the clip", async () => {
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    await page.getByRole("radio", { name: "Edit cage" }).check({ force: true });
    const shows = () => page.evaluate(() => globalThis.cagework?.engine.showsClip);
    await expect.poll(shows).toBe(false);
  });
});

test("a model with several meshes, morph targets and a clip is the same after pose, export and import", async ({
  page,
}) => {
  const dropped = { name: "dancer.glb", bytes: await dancer() };
  expect(await validationErrors(dropped.bytes)).toEqual([]);
  await openWith(page, [dropped]);
  await expect(page).toHaveTitle(/dancer/);
  await bound(page);
  const before = await played(page, [0, 0.3, 0.5]);
  const cage = await cagePositions(page);
  const at = await grip(page, [0.5, 0.3]);
  await pull(page, at, 60, -30);
  await rested(page);
  expect(largestMove(cage, await cagePositions(page))).toBeGreaterThan(0.01);
  const shaped = await played(page, [0, 0.3, 0.5]);
  expect(largestMove(shaped[1] ?? [], before[1] ?? [])).toBeGreaterThan(0.01);
  await page.getByRole("button", { name: "Export", exact: false }).first().click();
  await unfold(page);
  await page.getByRole("switch", { name: "buckle" }).click();
  const rigid = await download(page, "glb");
  expect(await validationErrors(rigid.bytes)).toEqual([]);
  const buckle = await positionsOf(dropped.bytes, "buckle");
  expect(await positionsOf(rigid.bytes, "buckle"), "as it was, in its own space").toEqual(buckle);
  await page.getByRole("switch", { name: "buckle" }).click();
  await page.getByRole("combobox", { name: "Clip" }).selectOption("0");
  await shoot(page, "dancer");
  const file = await download(page, "glb");
  expect(await positionsOf(file.bytes, "buckle"), "bent").not.toEqual(buckle);
  expect(await validationErrors(file.bytes)).toEqual([]);
  await drop(page, [file]);
  await expect(page).toHaveTitle(/dancer-posed/);
  await bound(page);
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  await expect(page.getByText("2 joints, 1 clip, 2 morph targets")).toBeVisible();
  const again = await played(page, [0, 0.3, 0.5]);
  for (const [k, positions] of shaped.entries())
    expect(largestMove(positions, again[k] ?? []), `time ${k}`).toBeLessThan(2e-5);
});

/** Finds the lowest height of the model during the first clip. */
async function lowest(page: Page, rig = RIG_DEFAULTS): Promise<number> {
  return page.evaluate(async (rig) => {
    const engine = globalThis.cagework?.engine;
    await engine?.startClip(rig);
    let low = Number.POSITIVE_INFINITY;
    for (let k = 0; k <= 60; k++) {
      engine?.showClip(0, k / 30, new Float32Array(), true);
      const positions = engine?.clipPositions() ?? [];
      for (let y = 1; y < positions.length; y += 3) low = Math.min(low, positions[y] ?? low);
    }
    engine?.stopClip();
    return low;
  }, rig);
}

/** Writes a GLB with the nodes and clips of another one, without its meshes. */
async function clipsOf(bytes: Uint8Array): Promise<Buffer> {
  const document = await new NodeIO().readBinary(bytes);
  const root = document.getRoot();
  for (const item of [...root.listSkins(), ...root.listMeshes(), ...root.listMaterials()]) item.dispose();
  return Buffer.from(await new NodeIO().writeBinary(document));
}

/** Reads the translations of the named nodes of a GLB. */
async function placesOf(bytes: Uint8Array): Promise<Record<string, readonly number[]>> {
  const nodes = (await new NodeIO().readBinary(bytes)).getRoot().listNodes();
  return Object.fromEntries(nodes.map((node) => [node.getName(), node.getTranslation()]));
}

test("legs of another length stand and walk on the same ground, also in clips of other files", async ({
  page,
}) => {
  await open(page, "./#sample=humanoid");
  await expect(page).toHaveTitle(/Legs close together/);
  await bound(page);
  const original = await download(page, "glb");
  const before = await lowest(page);
  await page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    const rest = engine?.restPositions() ?? new Float32Array();
    engine?.setCagePositions(rest.map((x, k) => (k % 3 === 1 ? 1.3 * x - 0.2 : x)));
    engine?.commit("Legs");
  });
  const rig = { ...RIG_DEFAULTS, ground: true };
  expect(Math.abs((await lowest(page)) - before)).toBeGreaterThan(0.02);
  expect(Math.abs((await lowest(page, rig)) - before)).toBeLessThan(2e-3);
  const plain = await download(page, "glb");
  await page.getByRole("switch", { name: "Stand on the same ground" }).click();
  await page.getByRole("switch", { name: "Hold planted feet" }).click();
  await shoot(page, "feet");
  const held = await download(page, "glb");
  await hears(page, /held feet in|found 2 legs/i);
  expect(await validationErrors(held.bytes)).toEqual([]);

  await test.step("clips of another file", async () => {
    await page.getByRole("switch", { name: "Stand on the same ground" }).click();
    await page.getByRole("switch", { name: "Hold planted feet" }).click();
    const choose = async (name: string, buffer: Buffer) => {
      const [chooser] = await Promise.all([
        page.waitForEvent("filechooser"),
        page.locator('button[data-kind="clips"]').click(),
      ]);
      await chooser.setFiles({ name, mimeType: "model/gltf-binary", buffer });
    };
    const heard = page.waitForEvent("download");
    await choose("walk.glb", await clipsOf(original.bytes));
    const file = await heard;
    expect(file.suggestedFilename()).toBe("walk-posed.glb");
    const bytes = new Uint8Array(readFileSync(await file.path()));
    const [old, body, clips] = await Promise.all([original.bytes, plain.bytes, bytes].map(placesOf));
    for (const [name, place] of Object.entries(clips ?? {}))
      expect(largestMove([...place], [...(body?.[name] ?? [])]), name).toBeLessThan(1e-5);
    expect(clips).not.toEqual(old);
    await choose("body.glb", Buffer.from(original.bytes));
    await expect(page.getByText(/body\.glb has a mesh/)).toBeVisible();
  });
});
