/** The first moments of a visit, and what goes on by itself: size, title, autosave, and what to open. */

import { report } from "./actions/context";
import type { App } from "./app";
import type { Crash, Crashes } from "./crash";
import { percent } from "./format";
import type { Shared } from "./share";
import type { Theme } from "./store";
import { CRASHED, showReport } from "./ui/crashed";
import type { Stage } from "./ui/viewport";

/** Sharper than this nobody sees, and it costs four times the pixels. */
const MOST_SHARP = 2;

export interface Start {
  app: App;
  stage: Stage;
  crashes: Crashes;
  theme: Theme;
  shared: () => Promise<Shared | undefined>;
  product: string;
}

export function startUp({ app, stage, crashes, theme, shared, product }: Start): void {
  const { store } = app;
  const session = app.ctx.session();
  store.set({ adapter: session.adapter, lack: session.lack, samples: session.samples, busy: null });
  if (session.lack || isSoftware(session.adapter)) app.bind.setOptions({ backend: "cpu" });

  const resize = () => {
    const { clientWidth, clientHeight } = stage.viewport;
    if (clientWidth === 0 || clientHeight === 0) return;
    session.engine.resize(clientWidth, clientHeight, Math.min(MOST_SHARP, devicePixelRatio));
    session.draw();
  };
  new ResizeObserver(resize).observe(stage.viewport);
  resize();
  app.view.resized = resize;
  app.view.theme(theme);

  store.watch(["bindRun", "cageProgress", "model"], ({ bindRun, cageProgress, model }) => {
    const share = bindRun?.fraction ?? cageProgress;
    const name = model ? `${model.name} - ${product}` : product;
    document.title = share === null || share === undefined ? name : `${percent(share)} - ${name}`;
  });
  store.watch(
    ["cage", "poses", "posed", "selected", "bindOptions", "symmetry", "bound", "undoLabel"],
    ({ bound, sampleCage, undoLabel }) => {
      // A sample that nobody has touched is no work to come back to.
      const untouched = sampleCage && undoLabel === null;
      if (bound && !untouched) app.project.touch();
    },
  );

  const stop = session.onFrame(() => {
    if (!store.get().bound) return;
    crashes.settled();
    stop();
  });
  void open(app, shared, crashes.before);
  window.addEventListener("hashchange", () => {
    void openShared(app, shared).then(({ damage }) => sayDamage(app, damage));
  });
}

/** A link comes first, then the work of the last visit, then the first sample. */
async function open(
  app: App,
  shared: () => Promise<Shared | undefined>,
  crash: Crash | undefined,
): Promise<void> {
  const link = await openShared(app, shared);
  if (!link.opened) await openKept(app);
  // Last, because whatever is opened takes messages away.
  sayDamage(app, link.damage);
  if (crash) {
    const report = { label: "Show the report", run: () => showReport(crash) };
    app.ctx.tell.problem({ title: CRASHED, message: crash.during }, report);
  }
}

async function openKept(app: App): Promise<void> {
  const kept = await app.project.restore();
  if (kept && (await app.files.openFiles(kept.files))) {
    app.store.set({ step: "pose", savedAt: kept.when });
    app.ctx.tell.say(`Your work on ${kept.name} is back, as you left it ${ago(Date.now() - kept.when)}.`, {
      label: "Start fresh",
      run: () => app.startFresh(),
    });
    return;
  }
  const first = app.store.get().samples[0];
  if (first) await app.files.openSample(first.id);
}

/** Opens what a link shows. Says whether there is something open now, and what is wrong with the link. */
async function openShared(
  app: App,
  shared: () => Promise<Shared | undefined>,
): Promise<{ opened: boolean; damage?: unknown }> {
  let opened = false;
  try {
    const link = await shared();
    if (!link) return { opened };
    const { sample, pose } = link;
    if (!app.store.get().samples.some(({ id }) => id === sample)) {
      throw new Error(`there is no sample called "${sample.slice(0, 40)}" here`);
    }
    opened = await app.files.openSample(sample);
    if (!opened) return { opened };
    app.store.set({ step: "pose" });
    if (pose) app.ctx.session().engine.decodePose(pose);
    app.edit.sync();
    return { opened };
  } catch (damage) {
    return { opened, damage };
  }
}

function sayDamage(app: App, damage: unknown): void {
  if (damage !== undefined) report(app.ctx, "This link is damaged", damage);
}

/** How long ago, in words. */
export function ago(ms: number): string {
  const minutes = Math.round(ms / 60_000);
  if (minutes < 1) return "a moment ago";
  if (minutes < 60) return `${minutes} minute${minutes === 1 ? "" : "s"} ago`;
  const hours = Math.round(minutes / 60);
  if (hours < 24) return `${hours} hour${hours === 1 ? "" : "s"} ago`;
  const days = Math.round(hours / 24);
  return `${days} day${days === 1 ? "" : "s"} ago`;
}

/** Whether a GPU is made of processor cores: then the processor itself binds faster, and drawing does not wait for it. */
export function isSoftware(adapter: string): boolean {
  return /swiftshader|llvmpipe|lavapipe|software|basic render/i.test(adapter);
}
