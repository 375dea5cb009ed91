/** Start of a visit: canvas size, window title, autosave, and what to open. */

import { isSoftware } from "@cagework/core/session/adapter";
import { effect, untracked } from "@preact/signals";
import { report } from "./actions/context";
import { isComparison } from "./actions/view";
import type { App } from "./app";
import type { Crash, Crashes } from "./crash";
import { COORDINATES } from "./defaults";
import { percent } from "./format";
import type { OfflineCopy } from "./offline/keep";
import { decodeShare, stopOf } from "./share";
import { loadTheme } from "./store";
import { PageError } from "./strings";
import { coveredIn } from "./ui/covered";
import { showReport } from "./ui/crashed";
import { shown } from "./ui/shown";
import type { Stage } from "./ui/viewport";
import { T } from "./words";
import { hasEntries } from "./works/database";

/** Maximum device pixel ratio. A ratio of 3 takes 2.25 times as many pixels as 2, for a barely visible difference. */
const MAX_PIXEL_RATIO = 2;

export interface Start {
  app: App;
  stage: Stage;
  crashes: Crashes;
  offline: OfflineCopy;
}

export function startUp({ app, stage, crashes, offline }: Start): void {
  const { store } = app;
  const session = app.ctx.session();
  store.set({ adapter: session.adapter, lack: session.lack, samples: session.samples, busy: null });
  if (session.lack || isSoftware(session.adapter)) app.bind.setOptions({ backend: "cpu" });

  const resize = () => {
    const { clientWidth, clientHeight } = stage.viewport;
    if (clientWidth === 0 || clientHeight === 0) return;
    session.engine.resize(clientWidth, clientHeight, Math.min(MAX_PIXEL_RATIO, devicePixelRatio));
    session.engine.cover(...coveredIn(stage.viewport));
  };
  new ResizeObserver(resize).observe(stage.viewport);
  resize();
  app.view.resized = resize;
  app.view.theme(loadTheme());

  effect(() => {
    const { bindRun, cageProgress, model } = store.get();
    const share = bindRun?.fraction ?? cageProgress;
    const name = model ? `${model.name} - ${T.product}` : T.product;
    document.title = shown(share === null ? name : `${percent(share)} - ${name}`);
  });
  effect(() => {
    const { model, cage, steps, appliedOptions, tools } = store.get();
    const { bound, undo, sampleCage, tour } = store.get();
    // Do not save a sample that was not modified.
    const isUntouched = sampleCage && undo === null;
    const isWork = bound && !isUntouched && tour === null;
    // Reading these keys subscribes this effect to their changes, after which the work must be saved.
    if (isWork && [model, cage, steps, appliedOptions, tools]) untracked(() => app.works.touch());
  });
  effect(() => {
    if (store.get().step) untracked(() => app.view.scene({}));
  });

  const stop = session.onFrame(() => {
    if (!store.get().bound) return;
    crashes.settled();
    stop();
    // Safari has no requestIdleCallback.
    const whenIdle = globalThis.requestIdleCallback ?? setTimeout;
    whenIdle(() => void offline.register());
  });
  void open(app, crashes.before);
  window.addEventListener("hashchange", () => {
    const stop = stopOf(location.hash);
    if (stop !== undefined) void app.tour.start(stop);
    else void openShared(app).then(({ damage }) => sayDamage(app, damage));
  });
}

/** Whether this visit opens the first sample, because the address has no link and no work is saved in the browser. */
export async function isFresh(): Promise<boolean> {
  return location.hash.length <= 1 && !(await hasEntries());
}

/**
 * Opens, in this order of preference: what the address links to (a stop of the tour or a sample), the work of the last
 * visit, or the first sample.
 */
async function open(app: App, crash: Crash | undefined): Promise<void> {
  const stop = stopOf(location.hash);
  const link: Link = stop === undefined ? await openShared(app) : { opened: true };
  if (stop !== undefined) await app.tour.start(stop);
  else if (!link.opened) await openFirst(app);
  else void app.works.refresh();
  // Show messages last, because opening a model clears them.
  sayDamage(app, link.damage);
  if (crash) {
    const report = { label: T.crash.showReport, run: () => showReport(crash) };
    app.ctx.tell.problem({ title: T.crash.title, message: crash.during }, report);
  }
}

/**
 * Opens the work that `toOpen` of works/entry.ts chooses. If it chooses none, or the work cannot be opened, opens the
 * first sample and, if several works are saved, shows their list. Opens nothing if the user has dropped files in the
 * meantime.
 */
async function openFirst(app: App): Promise<void> {
  if (await app.works.restore()) return;
  const { works, samples } = app.store.get();
  if (works.length > 1) app.store.set({ worksOpen: true });
  const [first] = samples;
  if (first) await app.files.openSample(first);
}

interface Link {
  readonly opened: boolean;
  /** Error if the link is damaged. */
  readonly damage?: unknown;
}

/** Opens the sample, pose and view of the share link in the address, if it contains one. */
async function openShared(app: App): Promise<Link> {
  let opened = false;
  try {
    const link = await decodeShare(location.hash);
    if (!link) return { opened };
    const { sample, pose, seen, controls, clip } = link;
    if (!app.store.get().samples.includes(sample)) throw new PageError(T.link.unknown(sample.slice(0, 40)));
    opened = await app.files.openSample(sample);
    if (!opened) return { opened };
    app.store.set({ step: "pose" });
    // A capture has no cage of its own: wait until one is generated.
    if (!app.store.get().cage) await app.files.prepared();
    if (controls) app.controls.takeShared(controls);
    const { engine } = app.ctx.session();
    if (pose) engine.decodePose(pose);
    engine.amend();
    if (seen) app.view.show(seen);
    const compared = COORDINATES.filter((kind) => seen?.scene.compare?.includes(kind));
    if (clip !== undefined && !app.store.get().model?.clips[clip]) throw new PageError(T.link.noClip(clip));
    if (clip !== undefined || isComparison(compared)) await app.files.prepared();
    await app.view.compare(compared);
    if (clip !== undefined) await app.clips.choose(clip);
    return { opened };
  } catch (damage) {
    return { opened, damage };
  }
}

function sayDamage(app: App, damage: unknown): void {
  if (damage !== undefined) report(app.ctx, T.failed.link, damage);
}
