/** Puts the page together: the only room that knows all others. */

import { createBind } from "./actions/bind";
import { createCage } from "./actions/cage";
import type { Context, Fix } from "./actions/context";
import { createEdit } from "./actions/edit";
import { createExports } from "./actions/exports";
import { createFiles } from "./actions/files";
import { createPoses } from "./actions/poses";
import { createProject, poseOf } from "./actions/project";
import { createView } from "./actions/view";
import { createWorks } from "./actions/works";
import type { App } from "./app";
import type { Session } from "./contract";
import { watchCrashes } from "./crash";
import { createHistory } from "./history";
import { choose } from "./input/choose";
import { createCommands } from "./input/commands";
import { attachDrop } from "./input/drop";
import { attachKeyboard } from "./input/keyboard";
import { attachPointer } from "./input/pointer";
import { isMac, shortcutText } from "./input/shortcuts";
import { createQueue } from "./queue";
import { openSession } from "./session";
import { lackOf } from "./session/adapter";
import { decodeShare } from "./share";
import { isFresh, startUp } from "./start";
import { createStore, INITIAL } from "./state";
import { forgetCrash, loadTheme } from "./store";
import { type Explained, explain, FIX_LABELS, PRODUCT } from "./strings";
import { createBar } from "./ui/bar";
import { createBindPanel } from "./ui/bind";
import { createCagePanel } from "./ui/cage";
import { askAfterCrash } from "./ui/crashed";
import { createExportPanel } from "./ui/export";
import { attachLost } from "./ui/lost";
import { createModelPanel } from "./ui/model";
import { createPanel } from "./ui/panel";
import { createPosePanel } from "./ui/pose";
import { createSeePanel } from "./ui/see";
import { createSheet } from "./ui/sheet";
import { createOverlays } from "./ui/stage";
import { createToasts } from "./ui/toasts";
import { createUnsupported } from "./ui/unsupported";
import { createStage } from "./ui/viewport";
import { createWithout } from "./ui/without";
import { createWorksList } from "./ui/works";

/** A hand that has not moved the cage for so long rests. */
const PAUSE_MS = 150;

function byId(id: string): HTMLElement {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page lacks #${id}`);
  return element;
}

async function main(): Promise<void> {
  const root = byId("app");
  const stageElement = byId("stage");
  const panelElement = byId("panel");
  const stage = createStage(stageElement);
  const store = createStore(INITIAL);
  const { element: toasts, tell } = createToasts();
  root.append(toasts);

  let session: Session | undefined;
  const current = (): Session => {
    if (!session) throw new Error("The page is still starting.");
    return session;
  };
  const history = createHistory(() => {
    store.set({ undoLabel: history.undoLabel ?? null, redoLabel: history.redoLabel ?? null });
  });
  const fixFor = (fix: NonNullable<Explained["fix"]>): Fix => ({
    label: FIX_LABELS[fix],
    run: () => fixes[fix](),
  });
  const ctx: Context = { session: current, store, history, queue: createQueue(), tell, fixFor };

  const bind = createBind(ctx);
  const project = createProject(ctx);
  const startFresh = () => void files.openSample(store.get().samples[0]?.id ?? "");
  const works = createWorks(ctx, {
    write: project.write,
    openFiles: (list) => files.openFiles(list),
    startFresh,
  });
  /** Not by its link again, which may be the cause. */
  const restart = () => {
    window.history.replaceState(null, "", location.pathname + location.search);
    location.reload();
  };
  const crashes = watchCrashes(store, restart, (crash) => {
    askAfterCrash(crash, () => {
      forgetCrash();
      void works.distrust().finally(restart);
    });
  });
  let soon: ReturnType<typeof setTimeout> | undefined;
  /** A changed cage is bound again once the hand rests; a fine grid waits for the user's word. */
  const bindSoon = (pause: number) => {
    clearTimeout(soon);
    soon = setTimeout(() => {
      const { cage: now, bindOptions } = store.get();
      // A gesture may end without a change, and then nobody else would ask for the bind.
      if (edit.active()) bindSoon(PAUSE_MS);
      else if (now?.usable && !bind.covers() && bindOptions.grid <= 128) void bind.start(true);
    }, pause);
  };
  const edit = createEdit(ctx, {
    changed: (state, check) => cage.adopt(state, check),
    left: () => bindSoon(0),
  });
  const follow = () => {
    edit.sync();
    view.refresh();
    bindSoon(PAUSE_MS);
  };
  const cage = createCage(ctx, follow, (grid) => {
    bind.setOptions({ grid });
    void bind.start();
  });
  const view = createView(ctx, bind.prepareCompare, matchMedia("(prefers-color-scheme: dark)"), () =>
    stage.viewport.getBoundingClientRect(),
  );
  const poses = createPoses(ctx, edit);
  const exports = createExports(ctx, project, () => stage.viewport.getBoundingClientRect());
  const files = createFiles(ctx, {
    adoptCage: (opened) => cage.adopt(opened.cage, opened.check),
    makeCage: () => cage.make(),
    loadCage: (list) => cage.load(list),
    bind: () => bind.start(),
    applySettings(settings) {
      store.set({
        ...(settings.bind ? { bindOptions: settings.bind } : {}),
        ...(settings.cage ? { cageOptions: settings.cage } : {}),
      });
      view.symmetry(settings.symmetry ?? store.get().symmetry);
    },
    applyPose(settings) {
      const pose = poseOf(settings);
      try {
        if (pose) current().engine.decodePose(pose);
      } catch {
        tell.say("The pose in this project is damaged; it opens at rest.");
      }
      edit.sync();
    },
    writeProject: project.write,
    keep() {
      edit.setEditingRest(false);
      return works.flush();
    },
    leave: works.leave,
  });

  const MODELS = ".glb,.gltf,.obj,.bin,.png,.jpg,.jpeg,.webp,.ktx2,.mtl,model/gltf-binary,model/gltf+json";

  const mac = isMac(navigator.platform);
  const sheet = createSheet(mac);
  const without = createWithout(navigator.userAgent, isSecureContext);
  root.append(sheet.element, without.element);
  const app: App = {
    ctx,
    store,
    edit,
    cage,
    bind,
    poses,
    view,
    files,
    project,
    works,
    exports,
    mac,
    run: (command) => commands[command](),
    go(step) {
      if (step === "pose" || step === "export") edit.setEditingRest(false);
      store.set({ step });
    },
    chooseModel: () => choose(MODELS, false, (list) => void files.openFiles(list)),
    chooseFolder: () => choose("", true, (list) => void files.openFiles(list)),
    chooseCage: () => choose(".obj,.glb,.gltf,.bin", false, (list) => void cage.load(list)),
    share: () => void exports.share(),
    showWays: () => without.show(store.get().lack ?? "NoWebGPU"),
    startFresh,
    pointer: () => ({ x: 0, y: 0 }),
    key: (command) => shortcutText(command, mac),
  };
  root.append(createWorksList(app));
  const commands = createCommands(app, sheet.show);
  const fixes: Record<NonNullable<Explained["fix"]>, () => void> = {
    coarser() {
      bind.setOptions({ grid: Math.max(16, store.get().bindOptions.grid / 2) });
      void bind.start();
    },
    cpu() {
      bind.setOptions({ backend: "cpu" });
      void bind.start();
    },
    file: () => app.chooseModel(),
    regenerate: () => void cage.regenerate(),
    reload: () => location.reload(),
  };

  createBar(byId("bar"), app, sheet.show);
  createPanel(panelElement, app, {
    model: createModelPanel(app),
    cage: createCagePanel(app),
    bind: createBindPanel(app),
    pose: createPosePanel(app),
    export: createExportPanel(app),
  });
  createOverlays(stageElement, app, createSeePanel(app), matchMedia("(pointer: coarse)"));

  try {
    session = await openSession(stage, isFresh());
  } catch (error) {
    const lack = lackOf(error);
    if (!lack) {
      store.set({ busy: null });
      tell.problem(explain(error, "Cagework did not start"), fixFor("reload"));
      return;
    }
    document.body.replaceChildren(createUnsupported(lack, navigator.userAgent, isSecureContext));
    return;
  }
  attachPointer(stage, app);
  attachKeyboard({ viewport: stage.viewport, app, run: app.run, original: (on) => view.original(on) });
  attachDrop(root, panelElement, app);
  attachLost({
    stage: stageElement,
    session,
    freshCanvas: stage.freshCanvas,
    recovered: () => view.resized(),
  });
  const notice = session.lack && without.notice(session.lack);
  if (notice) stageElement.before(notice);
  startUp({
    app,
    stage,
    crashes,
    theme: loadTheme(),
    shared: () => decodeShare(location.hash),
    product: PRODUCT,
  });
}

void main();
