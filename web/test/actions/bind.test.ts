import { named } from "@cagework/core/session/client";
import { expect, it } from "vitest";
import { createBind } from "../../src/actions/bind";
import type { BindReport } from "../../src/contract";
import { hasUnappliedOptions, optionsInUse } from "../../src/derived";
import { cageOf, createFake, MODEL, reportOf, settled } from "../fake";

/** A page with a model in a cage. */
function page() {
  const fake = createFake();
  const bind = createBind(fake.ctx);
  fake.showModel(MODEL);
  fake.showCage(cageOf(8));
  /** Ends the requested job number `at` with this report; the engine then has weights. */
  const finish = (at: number, report: BindReport) => {
    fake.show({ bound: true });
    fake.asked[at]?.resolve(report);
  };
  return { ...fake, bind, finish };
}

it("a finished bind provides weights and a report, valid until the cage changes", async () => {
  const { bind, finish, store, showCage } = page();
  const bound = bind.start();
  await settled();
  expect(store.get().bindRun).not.toBeNull();
  expect(bind.covers(), "while it runs").toBe(true);
  finish(0, reportOf());
  expect(await bound).toBe(true);
  expect(store.get()).toMatchObject({ bound: true, bindRun: null, report: { grid: 64 } });
  showCage(cageOf(8, 1));
  expect(bind.covers()).toBe(false);
});

it("a second bind cancels the first silently; the latest report of each solver is kept", async () => {
  const { bind, asked, finish, store, problems } = page();
  const first = bind.start();
  await settled();
  const second = bind.start();
  await settled();
  expect(asked.map(({ cancelled }) => cancelled)).toEqual([true, false]);
  finish(1, reportOf({ solver: "jacobi" }));
  expect(await Promise.all([first, second])).toEqual([false, true]);
  expect(problems).toEqual([]);
  const third = bind.start();
  await settled();
  finish(2, reportOf());
  await third;
  expect([store.get().report, ...store.get().earlier].map((report) => report?.solver)).toEqual([
    "multigrid",
    "jacobi",
  ]);
});

it("a cancelled bind keeps the previous bind active and marks the chosen settings as not applied", async () => {
  const { bind, finish, store, said, problems } = page();
  const first = bind.start();
  await settled();
  finish(0, reportOf());
  await first;
  expect(hasUnappliedOptions(store.get())).toBe(false);
  bind.setOptions({ grid: 256 });
  const second = bind.start();
  await settled();
  bind.cancel();
  await second;
  expect(said).toEqual(["Cancelled. The previous bind is still active."]);
  expect(store.get()).toMatchObject({ bound: true, bindRun: null, bindOptions: { grid: 256 } });
  expect([hasUnappliedOptions(store.get()), optionsInUse(store.get()).grid]).toEqual([true, 0]);
  expect(problems).toEqual([]);
  const third = bind.start();
  await settled();
  finish(2, reportOf({ grid: 256 }));
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
  const { bind, asked, finish, said, store } = page();
  const bound = bind.start();
  await settled();
  finish(0, reportOf({ converged: false }));
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
