/** The first moments of a visit, and what goes on by itself: size, title, autosave, and what to open. */

import { attempt } from "./actions/context";
import type { App } from "./app";
import { percent } from "./format";
import type { Shared } from "./share";
import type { Theme } from "./store";
import type { Stage } from "./ui/viewport";

/** Sharper than this nobody sees, and it costs four times the pixels. */
const MOST_SHARP = 2;

export interface Start {
  app: App;
  stage: Stage;
  theme: Theme;
  shared: () => Promise<Shared | undefined>;
  product: string;
}

export function startUp({ app, stage, theme, shared, product }: Start): void {
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

  void open(app, shared);
  window.addEventListener("hashchange", () => void openShared(app, shared));
}

/** A link comes first, then the work of the last visit, then the first sample. */
async function open(app: App, shared: () => Promise<Shared | undefined>): Promise<void> {
  if (await openShared(app, shared)) return;
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

async function openShared(app: App, shared: () => Promise<Shared | undefined>): Promise<boolean> {
  let link: Shared | undefined;
  const readable = await attempt(app.ctx, "The pose in this link cannot be read", async () => {
    link = await shared();
  });
  if (!readable || !link) return false;
  const { sample, pose } = link;
  if (!app.store.get().samples.some(({ id }) => id === sample)) {
    app.ctx.tell.problem({
      title: "This link is not for this page",
      message: `There is no sample called "${sample}" here.`,
    });
    return false;
  }
  if (!(await app.files.openSample(sample))) return false;
  if (pose) {
    await attempt(app.ctx, "The pose in this link does not fit", () => {
      app.ctx.session().engine.decodePose(pose);
      app.edit.sync();
    });
  }
  app.store.set({ step: "pose" });
  return true;
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
