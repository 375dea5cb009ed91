/** Saves the open work as an entry in the browser. At most one tab at a time has an entry open. */

import type { NamedFile } from "../contract";
import { isFatal } from "../crash";
import { stem } from "../format";
import { T } from "../words";
import { deleteEntry, newId, readEntries, readFile, writeEntry, writeLast } from "../works/database";
import { ago, type Entry, isExpired, newestFirst, toOpen, type Work } from "../works/entry";
import { changedAt, heldIds, hold, ownId, rememberChange, rememberOwn } from "../works/holds";
import { attempt, type Context } from "./context";

/**
 * Pause after the last change before the work is saved, ms: the shortest, the longest, and its ratio to the time that
 * the last save took on the main thread. Large models are saved less often.
 */
const PAUSE_MS = { least: 50, most: 1500, ratio: 20 };

export interface WorkNeeds {
  /** The project file of the open work. Throws an error named `TooLarge` if it is too large to be saved often. */
  write(): Blob;
  /** Opens files, as a drop does. */
  openFiles(files: readonly NamedFile[]): Promise<boolean>;
  startFresh(): void;
}

export function createWorks(ctx: Context, { write, openFiles, startFresh }: WorkNeeds) {
  const { store } = ctx;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let saving: Promise<void> | undefined;
  /** Time that the last save took on the main thread, ms. */
  let cost = 0;
  /** Whether saving the open work has failed. The user has been notified, and the work is not saved again. */
  let hasFailed = false;
  /** Whether the entry of the open work was deleted, and the work has not changed since. */
  let isUnwanted = false;
  /** Entry of the open work. `release` gives up its lock, so that other tabs can open it. */
  let current: { readonly id: string; readonly name: string; readonly release: () => void } | undefined;

  const hasWork = () => store.get().cage?.usable === true && store.get().model !== null && !hasFailed;

  const fail = (error: unknown, name: string) => {
    if (isFatal(error)) {
      reportError(error);
      return;
    }
    hasFailed = true;
    const isFull = error instanceof DOMException && error.name === "QuotaExceededError";
    const isLarge = error instanceof Error && error.name === "TooLarge";
    // Other errors mean that the browser forbids storage, as in private windows.
    const text = isFull
      ? T.works.full(name)
      : isLarge
        ? T.works.large(name, error.message)
        : T.works.forbidden;
    ctx.tell.say(text, ...(isFull ? [showList] : []));
  };

  /** Makes the entry and the project file of the open work. */
  const made = (): { entry: Entry; file: Blob } => {
    const began = performance.now();
    const when = Date.now();
    const name = current?.name ?? store.get().model?.name ?? "";
    const file = write();
    cost = performance.now() - began;
    if (!current) {
      const id = newId();
      const lock = hold(id);
      current = { id, name, release: () => void lock.then((release) => release?.()) };
    }
    rememberOwn(current.id);
    return { entry: { id: current.id, name, when, size: file.size }, file };
  };

  const put = async () => {
    try {
      const work = made();
      await writeEntry(work.entry, work.file);
      store.set({ savedAt: work.entry.when });
      await refresh();
    } catch (error) {
      fail(error, current?.name ?? store.get().model?.name ?? "");
    }
  };

  const save = async () => {
    await saving;
    clearTimeout(timer);
    timer = undefined;
    if (!hasWork()) return;
    saving = put();
    await saving;
  };

  const touch = () => {
    isUnwanted = false;
    rememberChange(Date.now());
    wait();
  };

  const wait = () => {
    clearTimeout(timer);
    const pause = Math.min(Math.max(PAUSE_MS.ratio * cost, PAUSE_MS.least), PAUSE_MS.most);
    timer = setTimeout(() => {
      const { bindRun, gesture, playing } = store.get();
      if (bindRun || gesture || playing) wait();
      else void save();
    }, pause);
  };

  /** Saves a pending change while the page is being left. */
  const saveLast = () => {
    // While an animation plays, the cage is in a pose that is not part of the work.
    if (timer === undefined || !hasWork() || store.get().playing) return;
    clearTimeout(timer);
    timer = undefined;
    try {
      const work = made();
      writeLast(work.entry, work.file);
    } catch {
      // The page that opens next says that the last change is lost.
    }
  };
  globalThis.addEventListener?.("pagehide", saveLast);

  const refresh = async () => {
    try {
      const [{ entries, damaged }, held] = [await readEntries(), await heldIds()];
      if (damaged > 0) ctx.tell.say(T.works.damaged);
      const works = newestFirst(entries).map((entry): Work => {
        if (entry.id === current?.id) return { ...entry, where: "here" };
        return { ...entry, where: held.has(entry.id) ? "elsewhere" : "nowhere" };
      });
      const isOver = (work: Work) => work.where === "nowhere" && isExpired(work, Date.now());
      for (const { id } of works.filter(isOver)) await deleteEntry(id);
      store.set({ works: works.filter((work) => !isOver(work)) });
    } catch {
      // The browser forbids storage, so nothing is saved.
      store.set({ works: [] });
    }
  };

  const drop = () => {
    current?.release();
    current = undefined;
    hasFailed = false;
    rememberOwn(null);
  };

  const fileOf = async ({ id, name }: Entry): Promise<NamedFile | undefined> => {
    const file = await readFile(id);
    if (!file) {
      await deleteEntry(id);
      await refresh();
      ctx.tell.say(T.works.damagedOf(name));
      return undefined;
    }
    const path = `${stem(name)}.cagework.glb`;
    return { name: path, path, file };
  };

  const open = async (work: Work, isFirst = false): Promise<boolean> => {
    const isCopy = work.where === "elsewhere" && !isFirst;
    const release = isCopy ? undefined : await hold(work.id);
    // Remember the work before opening it. If opening crashes the page, the next start must know which work it was.
    if (isFirst) rememberOwn(release ? work.id : null);
    if (!isCopy && !release) {
      await refresh();
      ctx.tell.say(T.works.elsewhere(work.name), showList);
      return false;
    }
    const file = await fileOf(work).catch(() => undefined);
    const isOpen = file !== undefined && (await openFiles([file]));
    if (!isOpen) {
      release?.();
      if (isFirst) rememberOwn(null);
      if (isFirst && file) ctx.tell.say(T.works.notOpened(work.name), showList);
    }
    if (isOpen && release) {
      current = { id: work.id, name: work.name, release };
      rememberOwn(work.id);
      store.set({ step: "pose", savedAt: work.when });
    }
    await refresh();
    return isOpen;
  };

  const showList = { label: T.works.show, run: () => store.set({ worksOpen: true }) };

  return {
    /** Saves the open work shortly after the last call, but not during a bind, gesture or animation. */
    touch,
    /** Saves pending changes, and a model that was never saved, before something else is opened. */
    async flush() {
      const { sample } = store.get();
      if (timer !== undefined || (sample === null && !current && !isUnwanted)) await save();
      await saving;
    },
    /** Releases the previous work after something else was opened, and offers to return to it. */
    leave() {
      clearTimeout(timer);
      timer = undefined;
      const left = store.get().works.find(({ id }) => id === current?.id);
      drop();
      isUnwanted = false;
      store.set({ savedAt: null });
      void refresh();
      if (!left) return;
      const back = { label: T.works.back, run: () => void open({ ...left, where: "nowhere" }) };
      ctx.tell.say(T.works.left(left.name), back);
    },
    /** Reads the list of saved work into `AppState.works`. */
    refresh,
    /** Opens saved work, as a copy if another tab has it open. */
    open,
    async remove(id: string) {
      if (current?.id === id) {
        clearTimeout(timer);
        timer = undefined;
        drop();
        isUnwanted = true;
      }
      hasFailed = false;
      await attempt(ctx, T.failed.delete, () => deleteEntry(id));
      await refresh();
    },
    /**
     * Opens the work that `toOpen` chooses, unless a model is open or being opened. Resolves with false if nothing is
     * open afterwards: `toOpen` chooses none, or the work cannot be opened.
     */
    async restore(): Promise<boolean> {
      await refresh();
      const { works, busy, model } = store.get();
      // Files that the user dropped in the meantime take precedence.
      if (busy !== null || model !== null) return true;
      const chosen = toOpen(works, ownId());
      const changed = changedAt();
      if (!chosen || !(await open(chosen, true))) return false;
      const isWhole = changed <= chosen.when;
      const since = ago(Date.now() - chosen.when);
      const text = isWhole ? T.works.restored(chosen.name, since) : T.works.restoredPart(chosen.name, since);
      const fresh = { label: T.works.fresh, run: startFresh };
      ctx.tell.say(text, works.length > 1 ? showList : fresh);
      return true;
    },
    /** Excludes the work of this tab from automatic opening, because the page crashed with it. */
    async excludeOwn() {
      const { entries } = await readEntries();
      const entry = entries.find(({ id }) => id === ownId());
      if (entry) await writeEntry({ ...entry, stopped: true });
      rememberOwn(null);
    },
  };
}

export type WorkActions = ReturnType<typeof createWorks>;
