import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { followCage } from "../../src/actions/follow";
import type { BindOptions } from "../../src/contract";
import { BIND_DEFAULTS } from "../../src/defaults";
import { cageOf, createFake } from "../fake";

beforeEach(() => {
  vi.useFakeTimers();
});
afterEach(() => {
  vi.useRealTimers();
});

/** A page that follows changes of its cage. `count` counts updates of the view (`looks`) and binds. */
function page() {
  const fake = createFake();
  const count = { looks: 0, binds: 0 };
  const state = { isActive: false, covers: false, grid: 0 };
  const bind = {
    covers: () => state.covers,
    start: (_unasked = false, options: Partial<BindOptions> = {}) => {
      count.binds += 1;
      state.grid = options.grid ?? 0;
      return Promise.resolve(true);
    },
  };
  const edit = { active: () => state.isActive };
  followCage(fake.ctx, {
    bind,
    edit,
    view: { refresh: () => (count.looks += 1) },
    pull: { prepare: () => undefined },
  });
  const change = () => {
    fake.showCage(cageOf(2));
  };
  return { ...fake, count, state, change };
}

it("a changed cage is checked at once and bound after a pause, once", () => {
  const { count, change } = page();
  for (let k = 0; k < 3; k++) {
    change();
    vi.advanceTimersByTime(100);
  }
  expect(count).toEqual({ looks: 3, binds: 0 });
  vi.advanceTimersByTime(100);
  expect(count.binds).toBe(1);
});

it("does not bind during a gesture, and does not repeat a bind that covers the cage", () => {
  const { count, state, change } = page();
  state.isActive = true;
  change();
  vi.advanceTimersByTime(1000);
  expect(count.binds).toBe(0);
  state.isActive = false;
  vi.advanceTimersByTime(200);
  expect(count.binds).toBe(1);
  state.covers = true;
  change();
  vi.advanceTimersByTime(1000);
  expect(count.binds).toBe(1);
});

it("does not bind by itself on a fine grid", () => {
  const { count, store, change } = page();
  store.set({ bindOptions: { ...store.get().bindOptions, grid: 256 } });
  change();
  vi.advanceTimersByTime(1000);
  expect(count.binds).toBe(0);
});

it("leaving reshape mode binds at once", () => {
  const { count, store, change } = page();
  store.set({ editingRest: true });
  change();
  store.set({ editingRest: false });
  vi.advanceTimersByTime(1);
  expect(count.binds).toBe(1);
});

it("does not bind by itself with unapplied settings", () => {
  const { store, state, change } = page();
  store.set({ bindOptions: { ...BIND_DEFAULTS, grid: 128 }, appliedOptions: { ...BIND_DEFAULTS, grid: 32 } });
  change();
  vi.advanceTimersByTime(200);
  expect(state.grid).toBe(32);
});
