/** Creates and connects all actions. Panels and input handlers call them through `App`. */

import { createBind } from "./actions/bind";
import { createCage } from "./actions/cage";
import { createClips } from "./actions/clips";
import type { Context } from "./actions/context";
import { createControls } from "./actions/controls";
import { createEdit } from "./actions/edit";
import { createExports } from "./actions/exports";
import { createFiles } from "./actions/files";
import { followCage, followSettings } from "./actions/follow";
import { createModels } from "./actions/models";
import { createPainting } from "./actions/painting";
import { createPlayer } from "./actions/player";
import { createPoses } from "./actions/poses";
import { createProject } from "./actions/project";
import { createProportions } from "./actions/proportions";
import { createPulling } from "./actions/pull";
import { createTour } from "./actions/tour";
import { createView } from "./actions/view";
import { createWalk } from "./actions/walk";
import { createWorks } from "./actions/works";
import type { NamedFile } from "./contract";
import { COMPANION_ENDINGS, MODEL_ENDINGS, MODEL_NAMES, MODEL_TYPES, SLIDERS } from "./defaults";
import { followDocument } from "./document";
import { commitDraft } from "./draft";
import { extension } from "./drop";
import { choose } from "./input/choose";
import { createCommands } from "./input/commands";
import { type Command, isMac, shortcutText } from "./input/shortcuts";
import { createQueue } from "./queue";
import type { StepName } from "./state";
import type { Explanation } from "./strings";
import { T } from "./words";

const CAGES = `${MODEL_ENDINGS.map((ending) => `.${ending}`)},.bin`;
/** Files of clips must contain their buffers: the file dialog gives no access to files beside them. */
const CLIPS = ".glb,.gltf";
const CLIPS_OF_RIGS = ".glb,.gltf,.vrm,.bin";
const BESIDE = [...COMPANION_ENDINGS, ...MODEL_NAMES.map(extension)].map((ending) => `.${ending}`);
const MODELS = `${CAGES},${BESIDE},${MODEL_TYPES}`;

/** Media query for windows in which the See panel covers the panel of the step; stage.css has the same query. */
const NARROW_WINDOW = "(max-width: 1279.98px)";

export function createApp(needs: Pick<Context, "store" | "session" | "tell" | "viewport">) {
  const { store, session } = needs;
  const fixFor = (fix: NonNullable<Explanation["fix"]>) => ({ label: T.fixes[fix], run: () => fixes[fix]() });
  const engine = () => session().engine;
  const ctx: Context = { ...needs, engine, queue: createQueue(), fixFor };
  const bind = createBind(ctx);
  const { take, know, made, checked } = followDocument(ctx);
  const edit = createEdit(ctx);
  const player = createPlayer(ctx, edit);
  const walk = createWalk(ctx, edit, player);
  const poses = createPoses(ctx, edit, player, walk);
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
  const proportions = createProportions(ctx, edit);
  const project = createProject(ctx, controls.shared);
  const exports = createExports(ctx, project, pull);
  const startFresh = () => void files.openSample(store.get().samples[0] ?? "");
  const works = createWorks(ctx, { write: project.writeKept, openFiles, startFresh });
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
    beforeOpen: (sample) => tour.guide()?.beforeOpen(sample),
  });
  const tour = createTour(ctx, { bind, edit, view, files, works });
  const fixes: Record<NonNullable<Explanation["fix"]>, () => void> = {
    coarser: () =>
      void bind.again({
        grid: Math.max(16, (store.get().bindOptions.grid || (store.get().report?.grid ?? 64)) / 2),
      }),
    fewer() {
      const { cage: found, cageOptions } = store.get();
      const vertices = Math.min(cageOptions.target, found?.info.vertices ?? cageOptions.target);
      store.set({
        cageOptions: { ...cageOptions, target: Math.max(SLIDERS.target.min, Math.floor(vertices / 2)) },
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
    // Once the work is saved, remove a share link from the address. Otherwise the reloaded page would open the link
    // instead of the work.
    if (store.get().savedAt !== null) history.replaceState(null, "", location.pathname + location.search);
    location.reload();
  };
  const mac = isMac(navigator.platform);
  const narrow = matchMedia(NARROW_WINDOW);
  const app = {
    ctx,
    store,
    /** Updates the state after a change of the document. */
    take,
    edit,
    pull,
    cage,
    controls,
    bind,
    poses,
    proportions,
    walk,
    clips,
    view,
    files,
    models,
    painting,
    works,
    exports,
    tour,
    mac,
    /** Runs a command of the shortcut table. */
    run(command: Command) {
      commitDraft();
      commands[command]();
    },
    go(step: StepName) {
      if (step !== "cage" && store.get().placing) controls.arm(null);
      if (step !== "model") painting.on(null);
      if (step === "pose" || step === "export") edit.setEditingRest(false);
      // In a narrow window, the See panel covers the panel of the step.
      store.set({ step, seeOpen: store.get().seeOpen && !narrow.matches });
    },
    /** Opens the browser's file dialog, and opens the chosen model. */
    chooseModel: () => choose(MODELS, false, (list) => void files.openFiles(list)),
    chooseFolder: () => choose("", true, (list) => void files.openFiles(list)),
    /** Opens the file dialog, and lets the cage follow the clips of the chosen rig. */
    chooseRig: () => choose(CLIPS_OF_RIGS, false, (list) => void walk.open(list)),
    /** Opens the file dialog, and adds the chosen models to the cage. */
    chooseMore: () => choose(MODELS, false, (list) => void models.add(list)),
    chooseCage: () => choose(CAGES, false, (list) => void cage.load(list)),
    /** Opens the file dialog, fits the clips of the chosen files to the skeleton, and downloads them. */
    chooseClips: () => choose(CLIPS, false, (list) => void exports.clips(list)),
    /** Opens the file dialog, and reads inner controls from the chosen OBJ file. */
    chooseControls: () => choose(".obj", false, (list) => void controls.load(list)),
    /** Opens the first sample. The open work stays saved in the browser. */
    startFresh,
    /** Reloads the page with the open work. */
    reload,
    /** Returns the last position of the pointer, CSS pixels in the view. input/pointer.ts replaces this function. */
    pointer: () => ({ x: 0, y: 0 }),
    /** Text of the shortcut of a command, for example "Ctrl+Z". */
    key: (command: Command) => shortcutText(command, mac),
    /** Shortcut and action of a command, for its button. */
    command: (command: Command) => ({
      shortcut: shortcutText(command, mac),
      onClick: () => app.run(command),
    }),
  };
  const commands = createCommands(app);
  return app;
}

export type App = ReturnType<typeof createApp>;
