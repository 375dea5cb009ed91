/** Several models in one cage: dropped together, each with its own way to follow, each its own file again. */

import { readFileSync } from "node:fs";
import type { Download, Page } from "@playwright/test";
import { WITH_WEBGL } from "./browser";
import { savedSince } from "./kept";
import { box, validationErrors } from "./models";
import { complaintsOfAxe } from "./stories";
import {
  bound,
  calm,
  carry,
  type Dropped,
  download,
  drag,
  drawn,
  drop,
  expect,
  largestMove,
  modelPositions,
  open,
  pull,
  shoot,
  test,
} from "./support";
import { distances, pointsOf, SIZES, wardrobe } from "./wardrobe";

/** Of the buckle's size: what keeps its shape does so up to rounding. */
const RIGID = 1e-5;
/** What is drawn is what is exported, up to the file's rounding. */
const SAME = 1e-5;
const BUCKLE = 0.2;

const step = (page: Page, name: string) => page.getByRole("button", { name, exact: false }).first().click();
const rows = (page: Page) => page.locator("[data-adds] li.card");
const row = (page: Page, name: string) => page.getByRole("listitem", { name });
const press = (page: Page, name: string) => page.getByRole("button", { name, exact: true }).click();
const undo = (page: Page) => page.keyboard.press("Control+z");

/** Drops the three and waits until they are bound; shows the list. */
async function dressed(page: Page): Promise<readonly Dropped[]> {
  const files = await wardrobe();
  await drop(page, files);
  await expect(page).toHaveTitle(/body\.glb and 2 more/);
  await bound(page);
  await step(page, "Model");
  await expect(rows(page)).toHaveCount(3);
  return files;
}

/** Bends all of the cage: no part of what is inside keeps its shape, or stays, by itself. */
async function bend(page: Page): Promise<void> {
  await page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    const rest = engine?.restPositions() ?? new Float32Array();
    const height = (k: number) => rest[k - (k % 3) + 1] ?? 0;
    engine?.setCagePositions(
      rest.map((x, k) => (k % 3 === 0 ? (1 + 0.4 * height(k)) * x + 0.5 * height(k) ** 2 : x)),
    );
  });
}

/** Of all models, in the order of the list: body, shirt, buckle. */
function apart(all: readonly number[]) {
  const [shirt, buckle] = [3 * SIZES.body, 3 * (SIZES.body + SIZES.shirt)];
  return { body: all.slice(0, shirt), shirt: all.slice(shirt, buckle), buckle: all.slice(buckle) };
}

/** All files that one click brings. */
async function downloads(page: Page, kind: string, n: number): Promise<Dropped[]> {
  await step(page, "Export");
  const heard: Download[] = [];
  const hear = (file: Download) => heard.push(file);
  page.on("download", hear);
  await page.locator(`button[data-kind="${kind}"]`).click();
  await expect.poll(() => heard.length).toBe(n);
  page.off("download", hear);
  return Promise.all(
    heard.map(async (file) => ({ name: file.suggestedFilename(), bytes: readFileSync(await file.path()) })),
  );
}

/** What is exported of each is what is drawn of it. */
async function exportsEach(page: Page): Promise<Record<"body" | "shirt" | "buckle", number[]>> {
  const drawn = apart(await modelPositions(page));
  const files = await downloads(page, "glb", 3);
  expect(files.map(({ name }) => name).sort()).toEqual([
    "body-posed.glb",
    "buckle-posed.glb",
    "shirt-posed.glb",
  ]);
  const found = { body: [] as number[], shirt: [] as number[], buckle: [] as number[] };
  for (const name of ["body", "shirt", "buckle"] as const) {
    const file = files.find((one) => one.name.startsWith(name));
    expect(await validationErrors(file?.bytes ?? new Uint8Array())).toEqual([]);
    found[name] = file ? await pointsOf(file) : [];
    expect(found[name].length).toBe(3 * SIZES[name]);
    expect(largestMove(found[name], drawn[name]), `${name} as it is drawn`).toBeLessThan(SAME);
  }
  return found;
}

/** How much of the body's skin and trousers does not move. */
function still(points: readonly number[], rest: readonly number[]): [skin: number, trousers: number] {
  const half = SIZES.body / 2;
  const kept = Array.from({ length: SIZES.body }, (_, v) =>
    [0, 1, 2].every((c) => points[3 * v + c] === rest[3 * v + c]),
  );
  const share = (list: boolean[]) => list.filter(Boolean).length / half;
  return [share(kept.slice(0, half)), share(kept.slice(half))];
}

test("a body, its shirt and a buckle are dropped, told apart, undone, exported and kept", async ({
  page,
}) => {
  await open(page);
  const files = await dressed(page);
  const rest = await modelPositions(page);
  const own = apart(rest);

  await test.step("one cage, one bind, and all of them follow", async () => {
    expect(rest.length / 3).toBe(SIZES.body + SIZES.shirt + SIZES.buckle);
    const cage = await page.evaluate(() => globalThis.cagework?.engine.cageCorners().length ?? 0);
    expect(cage).toBeGreaterThan(0);
    await drag(page, 50, -30);
    const moved = apart(await modelPositions(page));
    for (const name of ["body", "shirt", "buckle"] as const)
      expect(largestMove(moved[name], own[name]), name).toBeGreaterThan(1e-6);
    await undo(page);
    await shoot(page, "several");
  });

  await test.step("an eye hides one", async () => {
    const picture = async () => {
      await drawn(page);
      return page.locator("canvas").first().screenshot();
    };
    const before = await picture();
    await press(page, "Hide shirt.glb");
    await expect(row(page, "shirt.glb")).toContainText("hidden");
    expect(before.equals(await picture())).toBe(false);
    await press(page, "Hide shirt.glb");
    expect(before.equals(await picture())).toBe(true);
  });

  await bend(page);
  const bent = apart(await modelPositions(page));
  const size = (points: readonly number[]) => distances(points);
  const worst = (points: readonly number[]) =>
    Math.max(...size(points).map((d, k) => Math.abs(d - (size(own.buckle)[k] ?? 0))));

  await test.step("the buckle keeps its shape, the trousers stay; each is undone", async () => {
    expect(worst(bent.buckle), "bent, if nobody says otherwise").toBeGreaterThan(0.01);
    await press(page, "buckle.glb keeps its shape");
    await expect(row(page, "buckle.glb")).toContainText("keeps its shape");
    expect(worst(apart(await modelPositions(page)).buckle)).toBeLessThan(RIGID * BUCKLE);
    await undo(page);
    expect(worst(apart(await modelPositions(page)).buckle)).toBeGreaterThan(0.01);
    await page.keyboard.press("Control+y");

    await row(page, "body.glb").getByText("What follows the cage").click();
    await press(page, "Trousers stays as it is");
    expect(still(apart(await modelPositions(page)).body, own.body)).toEqual([expect.any(Number), 1]);
    await undo(page);
    expect(still(apart(await modelPositions(page)).body, own.body)[1]).toBeLessThan(0.2);
    await page.keyboard.press("Control+y");
  });

  await test.step("a stroke of the brush stays, another takes some of it back", async () => {
    await row(page, "body.glb").getByRole("button", { name: "Paint what stays" }).click();
    const before = still(apart(await modelPositions(page)).body, own.body)[0];
    await shoot(page, "several-painting");
    const at = await paintable(page, 0);
    await pull(page, at, 12, 12);
    const painted = still(apart(await modelPositions(page)).body, own.body)[0];
    expect(painted).toBeGreaterThan(before);
    expect(painted, "not all of it").toBeLessThan(0.9);
    await expect(row(page, "body.glb")).toContainText("painted");
    await undo(page);
    expect(still(apart(await modelPositions(page)).body, own.body)[0]).toBe(before);
    await page.keyboard.press("Control+y");
    await page.getByText("Follows again", { exact: true }).click();
    await pull(page, at, 2, 6);
    expect(still(apart(await modelPositions(page)).body, own.body)[0]).toBeLessThan(painted);
    await undo(page);
    await page.keyboard.press("Escape");
    await expect(row(page, "body.glb").getByRole("button", { name: "Paint what stays" })).toBeVisible();
  });

  const exported = await test.step("each leaves as its own file", async () => {
    const found = await exportsEach(page);
    expect(worst(found.buckle)).toBeLessThan(RIGID * BUCKLE);
    const before = await pointsOf(files[0] ?? { bytes: new Uint8Array() });
    const [skin, trousers] = still(found.body, before);
    expect([skin > 0, trousers], "the trousers to the last bit").toEqual([true, 1]);
    await page.getByRole("combobox", { name: "Which model" }).selectOption({ label: "shirt.glb" });
    const [alone] = await downloads(page, "weights", 1);
    expect(alone?.name).toBe("shirt-weights.npz");
    return found;
  });

  await test.step("the shirt is taken out, and comes back", async () => {
    await step(page, "Model");
    await press(page, "Take shirt.glb out of the cage");
    await expect(rows(page)).toHaveCount(2);
    await bound(page);
    expect((await modelPositions(page)).length / 3).toBe(SIZES.body + SIZES.buckle);
    await undo(page);
    await expect(rows(page)).toHaveCount(3);
    await bound(page);
    expect(largestMove(apart(await modelPositions(page)).shirt, exported.shirt)).toBeLessThan(SAME);
  });

  const same = async () => {
    await step(page, "Model");
    await expect(rows(page)).toHaveCount(3);
    for (const [name, text] of [
      ["body.glb", /1 part stays.*painted/],
      ["buckle.glb", /keeps its shape/],
    ] as const)
      await expect(row(page, name)).toContainText(text);
    const again = await exportsEach(page);
    for (const name of ["body", "shirt", "buckle"] as const)
      expect(largestMove(again[name], exported[name]), name).toBeLessThan(SAME);
  };

  await test.step("a reload brings all of it back", async () => {
    const moment = await page.evaluate(() => Date.now());
    await drag(page, 3, 0);
    await undo(page);
    await expect.poll(() => savedSince(page, moment), { timeout: 60_000 }).toBe(true);
    await page.reload();
    await bound(page);
    await same();
  });

  await test.step("and so does a project", async () => {
    await bend(page);
    const project = await download(page, "project");
    expect(project.name).toBe("body.cagework.glb");
    expect(await validationErrors(project.bytes)).toEqual([]);
    await page.evaluate(() => globalThis.cagework?.openSample("clamp"));
    await drop(page, [project]);
    await expect(page).toHaveTitle(/body/);
    await bound(page);
    await same();
  });
});

/** A place of the view where the brush touches a model, beside its handles; nothing is left painted. */
async function paintable(page: Page, id: number): Promise<{ x: number; y: number }> {
  const found = await page.evaluate((id) => {
    const engine = globalThis.cagework?.engine;
    const {
      left = 0,
      top = 0,
      width = 0,
      height = 0,
    } = document.querySelector("canvas")?.getBoundingClientRect() ?? {};
    const before = engine?.painted(id) ?? new Uint8Array();
    for (let y = 0.1 * height; y < height; y += 6) {
      for (let x = 0.3 * width; x < 0.7 * width; x += 6) {
        // Well within: its neighbours are the model's as well.
        const isOn = [0, 14].every((d) => engine?.paint(x + d, y + d, 0.005, 255));
        if (!isOn) continue;
        engine?.setPainted(id, before);
        engine?.showPainting(id);
        return { x: left + x, y: top + y };
      }
    }
    return null;
  }, id);
  if (!found) throw new Error("the brush finds nothing");
  return found;
}

test("clothes are added to a sample, dropped on the list, and said when they reach outside", async ({
  page,
}) => {
  await open(page);
  await step(page, "Model");
  const list = page.locator("[data-adds]");
  const data = await carry(page, [{ name: "hat.obj", bytes: box(0.05) }]);
  for (const type of ["dragenter", "dragover"]) await list.dispatchEvent(type, { dataTransfer: data });
  await expect(page.getByText("Drop to add it to this cage")).toBeVisible();
  await shoot(page, "several-hover");
  await list.dispatchEvent("drop", { dataTransfer: data });
  await expect(rows(page)).toHaveCount(2);
  await bound(page);
  const chooser = page.waitForEvent("filechooser");
  await press(page, "Add to this cage");
  await (await chooser).setFiles([
    { name: "notes.obj", mimeType: "text/plain", buffer: Buffer.from("no model") },
    { name: "tent.obj", mimeType: "text/plain", buffer: Buffer.from(box(9)) },
  ]);
  await expect(page.getByRole("alert").getByText("notes.obj could not be opened")).toBeVisible();
  await expect(rows(page)).toHaveCount(3);
  await expect(page.getByText(/tent\.obj, which reaches outside/)).toBeVisible();
  await shoot(page, "several-outside");
  await press(page, "Make a cage around all");
  await bound(page);
  const holds = await page.evaluate(() => Math.max(...(globalThis.cagework?.engine.restPositions() ?? [0])));
  expect(holds).toBeGreaterThan(9);
  for (const n of [3, 2]) {
    await undo(page);
    await expect(rows(page)).toHaveCount(n);
  }
  await undo(page);
  await expect(page).toHaveTitle(/Rat/);
  await bound(page);
});

test("the list is legible on every screen, and axe finds nothing", async ({ page }) => {
  await open(page);
  await dressed(page);
  await press(page, "buckle.glb keeps its shape");
  for (const [width, height] of [
    [1440, 900],
    [390, 844],
  ] as const) {
    await page.setViewportSize({ width, height });
    for (const colorScheme of ["light", "dark"] as const) {
      await page.emulateMedia({ colorScheme });
      const shot = (what: string) => shoot(page, `several-${width}-${colorScheme}-${what}`);
      await row(page, "body.glb").scrollIntoViewIfNeeded();
      await calm(page);
      await shot("list");
      const fold = row(page, "body.glb").getByText("What follows the cage");
      await fold.click();
      await press(page, "Trousers stays as it is");
      await row(page, "body.glb").getByText("Trousers").scrollIntoViewIfNeeded();
      await shot("parts");
      await row(page, "body.glb").getByRole("button", { name: "Paint what stays" }).click();
      await row(page, "body.glb").getByRole("slider").scrollIntoViewIfNeeded();
      await calm(page);
      await shot("painting");
      expect(await complaintsOfAxe(page), `${width} ${colorScheme}`).toEqual([]);
      await row(page, "body.glb").getByRole("button", { name: "Done" }).click();
      await press(page, "Trousers stays as it is");
      await fold.click();
    }
  }
});

test.describe("without WebGPU", () => {
  test.use({ launchOptions: WITH_WEBGL });

  test("two models follow, keep their shape and stay as they are exported", async ({ page }) => {
    await page.addInitScript(() => {
      Object.defineProperty(Navigator.prototype, "gpu", { get: () => undefined });
    });
    await open(page);
    await dressed(page);
    await bend(page);
    const own = apart(
      await page.evaluate(() => Array.from(globalThis.cagework?.engine.modelPositions() ?? [])),
    );
    await press(page, "buckle.glb keeps its shape");
    await row(page, "body.glb").getByText("What follows the cage").click();
    await press(page, "Trousers stays as it is");
    await row(page, "body.glb").getByRole("button", { name: "Paint what stays" }).click();
    await pull(page, await paintable(page, 0), 10, 10);
    await shoot(page, "several-webgl");
    await page.keyboard.press("Escape");
    const found = await exportsEach(page);
    const [skin, trousers] = still(found.body, own.body);
    expect([skin > 0, trousers]).toEqual([true, 1]);
    const before = distances(own.buckle);
    expect(Math.max(...distances(found.buckle).map((d, k) => Math.abs(d - (before[k] ?? 0))))).toBeLessThan(
      RIGID * BUCKLE,
    );
  });
});
