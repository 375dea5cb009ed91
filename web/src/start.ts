/** The first moments of a visit, and what goes on by itself: size, title, autosave, and what to open. */

import { report } from "./actions/context";
import type { App } from "./app";
import type { Crash, Crashes } from "./crash";
import { percent } from "./format";
import type { Shared } from "./share";
import type { Theme } from "./store";
import { CRASHED, showReport } from "./ui/crashed";
import type { Stage } from "./ui/viewport";
import { hasEntries } from "./works/database";

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
      if (bound && !untouched) app.works.touch();
    },
  );

  store.watch(["step"], () => app.view.scene({}));

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

/** Whether this visit begins with the first sample: no link, and nothing to come back to. */
export async function isFresh(): Promise<boolean> {
  return location.hash.length <= 1 && !(await hasEntries());
}

/** A link comes first, then the work of the last visit, then the first sample. */
async function open(
  app: App,
  shared: () => Promise<Shared | undefined>,
  crash: Crash | undefined,
): Promise<void> {
  const link = await openShared(app, shared);
  if (!link.opened) await openFirst(app);
  else void app.works.refresh();
  // Last, because whatever is opened takes messages away.
  sayDamage(app, link.damage);
  if (crash) {
    const report = { label: "Show the report", run: () => showReport(crash) };
    app.ctx.tell.problem({ title: CRASHED, message: crash.during }, report);
  }
}

/** What this tab had open, or the only work there is; else a sample, and the list of what there is to choose from. */
async function openFirst(app: App): Promise<void> {
  if (await app.works.restore()) return;
  const { works, samples } = app.store.get();
  if (works.length > 1) app.store.set({ worksOpen: true });
  const [first] = samples;
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

/** Whether a GPU is made of processor cores: then the processor itself binds faster, and drawing does not wait for it. */
export function isSoftware(adapter: string): boolean {
  return /swiftshader|llvmpipe|lavapipe|software|basic render/i.test(adapter);
}
