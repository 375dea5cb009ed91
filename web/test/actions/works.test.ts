import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { createWorks } from "../../src/actions/works";
import type { NamedFile } from "../../src/contract";
import type { Entry } from "../../src/works/entry";
import { cageOf, createFake, MODEL } from "../fake";

/**
 * Simulated browser storage: saved work by identifier. `held`: identifiers that a tab has locked; `own`: identifier of
 * the work that this tab has open.
 */
const kept = new Map<string, { entry: Entry; file: Blob | undefined }>();
const disk: { error: Error | undefined } = { error: undefined };
let held: string[] = [];
let own: string | null = null;
let changed = 0;
/** Listeners of the page, by event. */
const listeners = new Map<string, () => void>();

vi.mock("../../src/works/database", () => ({
  newId: () => `work${kept.size}`,
  readEntries: async () => ({ entries: Array.from(kept.values(), ({ entry }) => entry), damaged: 0 }),
  readFile: async (id: string) => kept.get(id)?.file,
  async writeEntry(entry: Entry, file?: Blob) {
    if (disk.error) throw disk.error;
    kept.set(entry.id, { entry, file: file ?? kept.get(entry.id)?.file });
  },
  writeLast: (entry: Entry, file: Blob) => void kept.set(entry.id, { entry, file }),
  deleteEntry: async (id: string) => void kept.delete(id),
}));
vi.mock("../../src/works/holds", () => ({
  async hold(id: string) {
    if (held.includes(id)) return undefined;
    held.push(id);
    return () => {
      held = held.filter((other) => other !== id);
    };
  },
  heldIds: async () => new Set(held),
  rememberOwn(id: string | null) {
    own = id;
  },
  ownId: () => own,
  rememberChange(when: number) {
    changed = when;
  },
  changedAt: () => changed,
}));

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("addEventListener", (type: string, run: () => void) => listeners.set(type, run));
});
afterEach(() => {
  vi.useRealTimers();
  kept.clear();
  [disk.error, held, own, changed] = [undefined, [], null, 0];
  vi.unstubAllGlobals();
});

function page({ isEmpty = false, tooLarge = "" } = {}) {
  const fake = createFake();
  const opened: string[] = [];
  const works = createWorks(fake.ctx, {
    write() {
      if (tooLarge) throw Object.assign(new Error(tooLarge), { name: "TooLarge" });
      return new Blob([new Uint8Array(10)]);
    },
    async openFiles(files: readonly NamedFile[]) {
      opened.push(files[0]?.name ?? "");
      return true;
    },
    startFresh: () => opened.push("fresh"),
  });
  if (!isEmpty) {
    fake.showModel(MODEL);
    fake.showCage(cageOf(8));
  }
  return { ...fake, works, opened };
}

const entryOf = (id: string, when = Date.now()): Entry => ({ id, name: `${id}.obj`, when, size: 10 });
const keep = (id: string, when?: number) => kept.set(id, { entry: entryOf(id, when), file: new Blob(["1"]) });

it("work is saved after a pause without changes, but not during a gesture", async () => {
  const { works, store } = page();
  store.set({ gesture: "Move" });
  works.touch();
  await vi.advanceTimersByTimeAsync(5000);
  expect(kept.size).toBe(0);
  store.set({ gesture: null });
  await vi.advanceTimersByTimeAsync(2000);
  expect([kept.size, kept.get("work0")?.entry.name, own]).toEqual([1, "cube.obj", "work0"]);
  works.touch();
  await vi.advanceTimersByTimeAsync(2000);
  expect([kept.size, store.get().works[0]?.where]).toEqual([1, "here"]);
});

it("a change is saved 50 ms later, or at once when the page is left, also during a gesture", async () => {
  const { works, store } = page();
  works.touch();
  await vi.advanceTimersByTimeAsync(49);
  expect(kept.size).toBe(0);
  await vi.advanceTimersByTimeAsync(1);
  expect(kept.size).toBe(1);
  kept.clear();
  listeners.get("pagehide")?.();
  expect(kept.size, "nothing changed").toBe(0);
  store.set({ gesture: "Move", playing: true });
  works.touch();
  listeners.get("pagehide")?.();
  expect(kept.size, "an animation plays").toBe(0);
  store.set({ playing: false });
  listeners.get("pagehide")?.();
  expect(kept.get("work0")?.entry.when).toBe(Date.now());
});

it("a change that was not kept is named when the work is back", async () => {
  const { works, said } = page({ isEmpty: true });
  keep("a", Date.now() - 10);
  [own, changed] = ["a", Date.now()];
  await works.restore();
  expect(said.at(-1)).toMatch(
    /^Your work on a\.obj is back as it was kept .* last change after that was not kept/,
  );
});

it("opening another model saves the previous work and offers it", async () => {
  const { works, store, said } = page();
  await works.flush();
  works.leave();
  await vi.advanceTimersByTimeAsync(0);
  expect([kept.size, said, held, store.get().savedAt]).toEqual([
    1,
    ["Your work on cube.obj is kept in this browser."],
    [],
    null,
  ]);
});

it("work that is too large is not kept, and the reason is said once", async () => {
  const { works, said } = page({ tooLarge: "the project takes 300 MiB, more than the limit of 200 MiB" });
  for (let k = 0; k < 2; k++) {
    works.touch();
    await vi.advanceTimersByTimeAsync(2000);
  }
  expect([kept.size, said.length]).toEqual([0, 1]);
  expect(said[0]).toMatch(/^Your work on cube\.obj is not kept.*: the project takes 300 MiB.*200 MiB\. /);
});

it("a full disk is reported once, with a remedy", async () => {
  const { works, said } = page();
  disk.error = new DOMException("full", "QuotaExceededError");
  works.touch();
  await vi.advanceTimersByTimeAsync(2000);
  works.touch();
  await vi.advanceTimersByTimeAsync(2000);
  expect(said).toEqual([expect.stringMatching(/no room left .* Save a project file/)]);
});

it("work of this tab is restored; with several others, the user chooses", async () => {
  const { works, opened, said, store } = page({ isEmpty: true });
  keep("a");
  keep("b");
  expect(await works.restore()).toBe(false);
  own = "b";
  expect(await works.restore()).toBe(true);
  expect([opened, store.get().step, said.at(-1)]).toEqual([
    ["b.cagework.glb"],
    "pose",
    expect.stringMatching(/^Your work on b\.obj is back/),
  ]);
});

it("work is not restored over files that were dropped while the list was read", async () => {
  const { works, opened, store } = page({ isEmpty: true });
  keep("a");
  own = "a";
  store.set({ busy: "Opening cube.obj" });
  expect([await works.restore(), opened]).toEqual([true, []]);
});

it("work open in another tab is opened as a copy", async () => {
  const { works, opened } = page();
  keep("a");
  held = ["a"];
  expect(await works.open({ ...entryOf("a"), where: "elsewhere" })).toBe(true);
  expect([opened, held, own]).toEqual([["a.cagework.glb"], ["a"], null]);
});

it("damaged work is deleted and reported", async () => {
  const { works, said, opened } = page();
  kept.set("a", { entry: entryOf("a"), file: undefined });
  expect(await works.open({ ...entryOf("a"), where: "nowhere" })).toBe(false);
  expect([kept.size, opened, said[0]]).toEqual([
    0,
    [],
    expect.stringContaining("was damaged and has been deleted"),
  ]);
});

it("work older than 30 days is deleted unless a tab has it open", async () => {
  const { works, store } = page();
  const old = Date.now() - 31 * 24 * 3600 * 1000;
  keep("old", old);
  keep("open elsewhere", old);
  keep("new");
  held = ["open elsewhere"];
  await works.refresh();
  expect(
    store
      .get()
      .works.map(({ id }) => id)
      .sort(),
  ).toEqual(["new", "open elsewhere"]);
  expect(kept.has("old")).toBe(false);
});
