/** Creates and connects all actions. Panels and input handlers call them through `App`. */

import { type BindActions, createBind } from "./actions/bind";
import { type CageActions, createCage } from "./actions/cage";
import { type ClipActions, createClips } from "./actions/clips";
import type { Context, Tell } from "./actions/context";
import { type ControlActions, createControls } from "./actions/controls";
import { createEdit, type Edit } from "./actions/edit";
import { createExports, type Exports } from "./actions/exports";
import { createFiles, type Files } from "./actions/files";
import { followCage, followSettings } from "./actions/follow";
import { createModels, type Models } from "./actions/models";
import { createPainting, type PaintActions } from "./actions/painting";
import { createPoses, type PoseActions } from "./actions/poses";
import { createProject } from "./actions/project";
import { createPulling, type Pulling } from "./actions/pull";
import { createTour, type TourActions } from "./actions/tour";
import { createView, type View } from "./actions/view";
import { createWorks, type WorkActions } from "./actions/works";
import type { NamedFile, Session } from "./contract";
import { COMPANION_ENDINGS, MODEL_ENDINGS, MODEL_TYPES, SLIDERS } from "./defaults";
import { type DocumentMirror, followDocument } from "./document";
import { choose } from "./input/choose";
import { createCommands } from "./input/commands";
import { type Command, isMac, shortcutText } from "./input/shortcuts";
import { createQueue } from "./queue";
import type { Store } from "./signals";
import type { StepName } from "./state";
import type { Explained } from "./strings";
import { T } from "./words";

export interface App {
  readonly ctx: Context;
  readonly store: Store;
  /** Updates the state after a change of the document. */
  readonly take: DocumentMirror["take"];
  readonly edit: Edit;
  readonly pull: Pulling;
  readonly cage: CageActions;
  readonly controls: ControlActions;
  readonly bind: BindActions;
  readonly poses: PoseActions;
  readonly clips: ClipActions;
  readonly view: View;
  readonly files: Files;
  readonly models: Models;
  readonly painting: PaintActions;
  readonly works: WorkActions;
  readonly exports: Exports;
  readonly tour: TourActions;
  readonly mac: boolean;
  /** Runs a command of the shortcut table. */
  run(command: Command): void;
  go(step: StepName): void;
  /** Opens the browser's file dialog, and opens the chosen model. */
  chooseModel(): void;
  chooseFolder(): void;
  /** Opens the file dialog, and adds the chosen models to the cage. */
  chooseMore(): void;
  chooseCage(): void;
  /** Opens the file dialog, and reads inner controls from the chosen OBJ file. */
  chooseControls(): void;
  /** Opens the first sample. The open work stays saved in the browser. */
  startFresh(): void;
  /** Reloads the page with the open work. */
  reload(): Promise<void>;
  /** Returns the last position of the pointer, CSS pixels in the view. */
  pointer: () => { x: number; y: number };
  /** Text of the shortcut of a command, for example "Ctrl+Z". */
  key(command: Command): string;
}

const CAGES = `${MODEL_ENDINGS.map((ending) => `.${ending}`)},.bin`;
const MODELS = `${CAGES},${COMPANION_ENDINGS.map((ending) => `.${ending}`)},${MODEL_TYPES}`;

/** Windows in which See covers the panel, as in stage.css. */
const NARROW = "(max-width: 1279.98px)";

export interface Needs {
  store: Store;
  /** Returns the session. Throws until it is open. */
  session: () => Session;
  tell: Tell;
  /** Rectangle of the view in the window. */
  viewport: () => DOMRect;
}

export function createApp({ store, session, tell, viewport }: Needs): App {
  const fixFor = (fix: NonNullable<Explained["fix"]>) => ({ label: T.fixes[fix], run: () => fixes[fix]() });
  const ctx: Context = { session, store, queue: createQueue(), tell, fixFor, viewport };
  const bind = createBind(ctx);
  const { take, know, made, checked } = followDocument(ctx);
  const edit = createEdit(ctx);
  const poses = createPoses(ctx, edit);
  const cage = createCage(ctx, { bind, edit, know, made, poses });
  const controls = createControls(ctx, cage.change, edit.setEditingRest);
  const view = createView(ctx, bind.prepareCompare, matchMedia("(prefers-color-scheme: dark)"));
  const pull = createPulling(ctx, edit);
  followCage(ctx, { bind, edit, view, pull });
  followSettings(ctx, cage);
  const clips = createClips(ctx, () => edit.setEditingRest(false));
  const settle = () => {
    clips.stop();
    edit.end(true);
    edit.setEditingRest(false);
    if (store.get().placing) controls.arm(null);
  };
  const openFiles = (list: readonly NamedFile[]) => files.openFiles(list);
  const models = createModels(ctx, { cage, edit, checked, openFiles, settle });
  const painting = createPainting(ctx, edit, settle);
  const project = createProject(ctx, controls.shared);
  const exports = createExports(ctx, project);
  const startFresh = () => void files.openSample(store.get().samples[0] ?? "");
  const works = createWorks(ctx, { write: project.write, openFiles, startFresh });
  const files = createFiles(ctx, {
    know,
    made,
    bind,
    cage,
    controls,
    models,
    project,
    view,
    works,
    settle,
    overtaken: (sample) => tour.guide()?.overtaken(sample),
  });
  const tour = createTour(ctx, { bind, edit, view, files, works });
  const fixes: Record<NonNullable<Explained["fix"]>, () => void> = {
    coarser: () => void bind.again({ grid: Math.max(16, store.get().bindOptions.grid / 2) }),
    fewer() {
      const { cage: found, cageOptions } = store.get();
      const vertices = Math.min(cageOptions.vertices, found?.info.vertices ?? cageOptions.vertices);
      store.set({
        cageOptions: { ...cageOptions, vertices: Math.max(SLIDERS.vertices.min, Math.floor(vertices / 2)) },
      });
      void cage.regenerate().then((made) => made && bind.start());
    },
    cpu: () => void bind.again({ backend: "cpu" }),
    file: () => app.chooseModel(),
    add: () => app.chooseMore(),
    regenerate: () => void cage.regenerate(),
    reload: () => void reload(),
  };
  const reload = async () => {
    await works.flush();
    // Once the work is saved, remove a share link from the address. The reloaded page would open the link instead of
    // the work.
    if (store.get().savedAt !== null) history.replaceState(null, "", location.pathname + location.search);
    location.reload();
  };
  const mac = isMac(navigator.platform);
  const narrow = matchMedia(NARROW);
  const app: App = {
    ctx,
    store,
    take,
    edit,
    pull,
    cage,
    controls,
    bind,
    poses,
    clips,
    view,
    files,
    models,
    painting,
    works,
    exports,
    tour,
    mac,
    run: (command) => commands[command](),
    go(step) {
      if (step !== "cage" && store.get().placing) controls.arm(null);
      if (step !== "model") painting.on(null);
      if (step === "pose" || step === "export") edit.setEditingRest(false);
      // In a narrow window, See covers the panel of the step.
      store.set({ step, seeOpen: store.get().seeOpen && !narrow.matches });
    },
    chooseModel: () => choose(MODELS, false, (list) => void files.openFiles(list)),
    chooseFolder: () => choose("", true, (list) => void files.openFiles(list)),
    chooseMore: () => choose(MODELS, false, (list) => void models.add(list)),
    chooseCage: () => choose(CAGES, false, (list) => void cage.load(list)),
    chooseControls: () => choose(".obj", false, (list) => void controls.load(list)),
    startFresh,
    reload,
    pointer: () => ({ x: 0, y: 0 }),
    key: (command) => shortcutText(command, mac),
  };
  const commands = createCommands(app);
  return app;
}
