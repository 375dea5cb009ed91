import { named } from "@cagework/core/session/client";
import { expect, it } from "vitest";
import { createBind } from "../../src/actions/bind";
import { hasUnappliedOptions, optionsInUse } from "../../src/derived";
import { cageOf, createFake, MODEL, reportOf, settled } from "../fake";

/** A page with a model in a cage. */
function page() {
  const fake = createFake();
  const bind = createBind(fake.ctx);
  const { positions, corners } = cageOf(8);
  fake.store.set({ model: MODEL, cage: fake.engine.setCage(positions, corners) });
  return { ...fake, bind };
}

it("a finished bind provides weights and a report, valid until the cage changes", async () => {
  const { bind, asked, store, engine } = page();
  const bound = bind.start();
  await settled();
  expect(store.get().bindRun).not.toBeNull();
  expect(bind.covers(), "while it runs").toBe(true);
  asked[0]?.resolve(reportOf());
  expect(await bound).toBe(true);
  expect(store.get()).toMatchObject({ bound: true, bindRun: null, report: { grid: 64 } });
  const { positions, corners } = cageOf(8, 1);
  store.set({ cage: engine.setCage(positions, corners), bound: false });
  expect(bind.covers()).toBe(false);
});

it("a second bind cancels the first silently; the latest report of each solver is kept", async () => {
  const { bind, asked, store, problems } = page();
  const first = bind.start();
  await settled();
  const second = bind.start();
  await settled();
  expect(asked.map(({ cancelled }) => cancelled)).toEqual([true, false]);
  asked[1]?.resolve(reportOf({ solver: "jacobi" }));
  expect(await Promise.all([first, second])).toEqual([false, true]);
  expect(problems).toEqual([]);
  const third = bind.start();
  await settled();
  asked[2]?.resolve(reportOf());
  await third;
  expect([store.get().report, ...store.get().earlier].map((report) => report?.solver)).toEqual([
    "multigrid",
    "jacobi",
  ]);
});

it("a cancelled bind leaves the previous one, and the settings just chosen are marked as not applied", async () => {
  const { bind, asked, store, said, problems } = page();
  const first = bind.start();
  await settled();
  asked[0]?.resolve(reportOf());
  await first;
  expect(hasUnappliedOptions(store.get())).toBe(false);
  bind.setOptions({ grid: 256 });
  const second = bind.start();
  await settled();
  bind.cancel();
  await second;
  expect(said).toEqual(["Cancelled. The previous bind is still active."]);
  expect(store.get()).toMatchObject({ bound: true, bindRun: null, bindOptions: { grid: 256 } });
  expect([hasUnappliedOptions(store.get()), optionsInUse(store.get()).grid]).toEqual([true, 64]);
  expect(problems).toEqual([]);
  const third = bind.start();
  await settled();
  asked[2]?.resolve(reportOf({ grid: 256 }));
  await third;
  expect([hasUnappliedOptions(store.get()), optionsInUse(store.get()).grid]).toEqual([false, 256]);
});

it("an error is shown with its fix", async () => {
  const { bind, asked, problems } = page();
  const bound = bind.start();
  await settled();
  asked[0]?.reject(named("Memory", "binding needs 9 GiB"));
  expect(await bound).toBe(false);
  expect(problems).toMatchObject([
    { title: "The bind did not finish", message: "Binding needs 9 GiB.", fix: "coarser" },
  ]);
});

it("reports a solver at its iteration limit; does not bind a faulty cage", async () => {
  const { bind, asked, said, store } = page();
  const bound = bind.start();
  await settled();
  asked[0]?.resolve(reportOf({ converged: false }));
  await bound;
  expect(said).toEqual([expect.stringContaining("iteration limit")]);
  const { cage } = store.get();
  store.set({ cage: cage && { ...cage, usable: false } });
  expect(await bind.start()).toBe(false);
  expect(asked.length).toBe(1);
});

it("coordinates by formula are computed once", async () => {
  const { bind, asked, others } = page();
  const both = [bind.prepareCompare(["harmonic", "green"]), bind.prepareCompare(["green"])];
  await settled();
  others.push("green");
  asked[0]?.resolve(undefined);
  expect(await Promise.all(both)).toEqual([true, true]);
  expect(asked.map(({ input }) => input)).toEqual(["green"]);
});
