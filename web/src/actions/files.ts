/** Opens samples, files and projects, then makes a cage and binds automatically. */

import type { BindOptions, NamedFile, OpenedFile, Settings, UpAxis } from "../contract";
import { BIND_DEFAULTS } from "../defaults";
import type { DocumentMirror } from "../document";
import { planDrop } from "../drop";
import { type StepName, stateOfNextModel } from "../state";
import { sentence } from "../strings";
import { T } from "../words";
import type { BindActions } from "./bind";
import type { CageActions } from "./cage";
import { attemptLatest, type Context } from "./context";
import type { ControlActions } from "./controls";
import type { Models } from "./models";
import type { Project } from "./project";
import { modelsOf, type ReadResult, readModels } from "./read";
import type { View } from "./view";
import type { WorkActions } from "./works";

export interface FileNeeds {
  readonly know: DocumentMirror["know"];
  readonly made: DocumentMirror["made"];
  readonly bind: Pick<BindActions, "start">;
  readonly cage: Pick<CageActions, "load" | "make">;
  readonly controls: Pick<ControlActions, "load">;
  readonly models: Pick<Models, "join">;
  readonly project: Pick<Project, "write">;
  readonly view: Pick<View, "tools">;
  readonly works: Pick<WorkActions, "flush" | "leave">;
  /** Ends playback and operations in progress before something else is opened. */
  settle(): void;
  /** Called before a sample or a file is opened. `sample` is null for a file. */
  beforeOpen(sample: string | null): void;
}

/**
 * Limit on the estimated work of the automatic bind of a project, in updates of one value at a grid node. This many
 * take about 10 s on one processor core; the options of a project file could request hours of work.
 */
const MAX_UPDATES = 1e10;

/** What is opened together with a model: further models, a cage, and bind options. */
interface Companions {
  readonly others: readonly ReadResult[];
  readonly cageFiles: readonly NamedFile[] | undefined;
  readonly signal: AbortSignal;
  readonly bind: BindOptions | undefined;
}

export function createFiles(ctx: Context, needs: FileNeeds) {
  const { store } = ctx;
  let prepared: Promise<void> = Promise.resolve();

  const take = async (opened: OpenedFile, sample: string | null, along: Partial<Companions> = {}) => {
    const { others = [], cageFiles, signal, bind } = along;
    // A cage generation or bind in progress is for the previous model.
    for (const kind of ["bind", "cage"] as const) ctx.queue.cancel(kind);
    const settings = { ...settingsOf(opened), ...(bind ? { bind } : {}) };
    store.set({
      ...stateOfNextModel(store.get()),
      model: {
        ...opened.model,
        name: T.samples[sample ?? sampleOf(opened) ?? ""]?.name ?? opened.model.name,
      },
      grip: opened.grip ?? null,
      busy: others.length > 0 ? store.get().busy : null,
    });
    if (opened.check) needs.know(opened.check);
    const { bind: bindOptions, cage: cageOptions, rig: rigOptions, symmetry } = settings;
    store.set({
      ...(bindOptions ? { bindOptions } : {}),
      ...(cageOptions ? { cageOptions } : {}),
      ...(rigOptions ? { rigOptions } : {}),
    });
    needs.made();
    needs.view.tools({ symmetry: symmetry ?? false });
    for (const notice of [...opened.model.notices, ...opened.notices]) ctx.tell.say(sentence(notice));
    if (settings.notices.length > 0) ctx.tell.say(sentence(settings.notices.join(" ")));
    // Add the other models first, so that the cage encloses all of them.
    if (signal && others.length > 0) await needs.models.join(others, signal);
    store.set({ busy: null });
    const { length } = store.get().model?.members ?? [];
    const showList = { label: T.models.showList, run: () => store.set({ step: "model" }) };
    const { suggestedUp, splats, up } = opened.model;
    const offerTurn = ([said, label]: readonly [string, string], to: UpAxis) =>
      ctx.tell.say(said, { label, run: () => void actions.turn(to) });
    if (suggestedUp !== null && sample === null) offerTurn(T.model.lies, suggestedUp);
    const isNewCapture = splats > 0 && sample === null && opened.settings === null;
    if (isNewCapture && up !== "y") offerTurn(T.model.turnedUp, "y");
    if (others.length > 0 && length > 1) ctx.tell.say(T.models.together(length), showList);
    prepared = prepare(cageFiles, sample !== null, opened.settings !== null);
  };

  const settingsOf = (opened: OpenedFile): Settings => {
    const { memory_limit } = store.get().bindOptions;
    return opened.settings === null
      ? { notices: [] }
      : ctx.session().readSettings(opened.settings, memory_limit);
  };

  /**
   * If a bind with the options of a project would exceed `MAX_UPDATES`, replaces the options by the defaults. Keeps
   * the memory limit.
   */
  const limitWork = () => {
    const { bindOptions, model } = store.get();
    const updates = ctx.engine().estimateUpdates(bindOptions);
    if (updates <= MAX_UPDATES) return;
    store.set({ bindOptions: { ...BIND_DEFAULTS, memory_limit: bindOptions.memory_limit } });
    ctx.tell.say(T.opening.longBind(model?.name ?? "", updates / (MAX_UPDATES / 10)));
  };

  /**
   * Loads the cage from `cageFiles`, or makes one if the model has none, and binds the model to it. If the cage has
   * faults that prevent a bind, shows step Cage instead. Except for samples and projects, shows step Bind during the
   * bind and step Pose after it.
   */
  const prepare = async (
    cageFiles: readonly NamedFile[] | undefined,
    isSample: boolean,
    isProject: boolean,
  ) => {
    const familiar = isSample || isProject;
    let shown = store.get().step;
    /** Goes on to `step` from one of the steps `from`, unless the user has chosen another step in the meantime. */
    const goTo = (from: readonly StepName[], step: StepName) => {
      if (store.get().step !== shown || !from.includes(shown)) return;
      shown = step;
      store.set({ step });
    };
    if (cageFiles) {
      if (!(await needs.cage.load(cageFiles, true))) return;
    } else if (!store.get().cage) {
      if (!familiar) goTo(["model", "bind", "pose", "export"], "cage");
      if (!(await needs.cage.make(true))) return;
    }
    if (!store.get().cage?.usable) {
      goTo(["model", "bind", "pose", "export"], "cage");
      return;
    }
    if (isProject) limitWork();
    if (!familiar) goTo(["model", "cage"], "bind");
    if ((await needs.bind.start(true)) && !familiar) goTo(["bind"], "pose");
  };

  /** Runs `work` while the page is blocked. A new call cancels the previous one. */
  const busy = (what: string, title: string, work: (signal: AbortSignal) => Promise<void>) => {
    ctx.tell.clear();
    return attemptLatest(ctx, title, "open", async (signal) => {
      store.set({ busy: what });
      await work(signal).finally(() => store.set({ busy: null }));
    });
  };

  /** Saves the open work, then opens another model. */
  const replace = async (
    open: () => Promise<OpenedFile>,
    sample: string | null,
    along: Partial<Companions>,
  ) => {
    needs.settle();
    needs.beforeOpen(sample);
    await needs.works.flush();
    const opened = await open();
    needs.works.leave();
    await take(opened, sample, along);
  };

  const actions = {
    /** Resolves when the model that was opened last has a cage and is bound, or cannot be. */
    prepared: (): Promise<void> => prepared,
    /** `bind`: options of the bind; the default options if omitted. */
    openSample(id: string, bind?: BindOptions): Promise<boolean> {
      // Cancel cage generation and binds, because their worker also builds the sample.
      for (const kind of ["bind", "cage"] as const) ctx.queue.cancel(kind);
      return busy(T.opening.file(T.samples[id]?.name ?? id), T.failed.sample, (signal) =>
        replace(() => ctx.session().openSample(id, signal), id, { bind }),
      );
    },
    /** Opens dropped or chosen files, whose names determine their roles. */
    openFiles(files: readonly NamedFile[]): Promise<boolean> {
      const plan = planDrop(files.map((file) => file.path || file.name));
      const main = plan.main === undefined ? undefined : files[plan.main];
      if (!main) {
        ctx.tell.problem({ title: T.opening.nothing, message: plan.sentence }, ctx.fixFor("file"));
        return Promise.resolve(false);
      }
      if (plan.kind === "controls" && store.get().cage) return needs.controls.load([main]);
      const second = plan.second === undefined ? undefined : files[plan.second];
      return busy(T.opening.file(main.name), T.failed.open(main.name), async (signal) => {
        const models = modelsOf(files, plan);
        // If one of several models fails, the others open: offer to add a file to their cage.
        const another = models.length > 1 ? "add" : "file";
        const [first, ...others] = await readModels(ctx, signal, models, another);
        const along = { others, cageFiles: second && [second], signal };
        if (first) await replace(() => ctx.session().open(first.read), null, along);
      });
    },
    /** Rotates the model with its cage and poses to another up axis. */
    turn(up: UpAxis): Promise<boolean> {
      return busy(T.opening.turning, T.failed.turn, async () => {
        needs.settle();
        await take(await ctx.session().turn(needs.project.write(), up), null);
      });
    },
  };
  return actions;
}

export type Files = ReturnType<typeof createFiles>;

/**
 * Finds the sample that a project was made from. The page shows the sample's name in place of the name in the project
 * file.
 */
function sampleOf({ settings }: OpenedFile): string | undefined {
  try {
    const { sample } = JSON.parse(settings ?? "");
    return typeof sample === "string" ? sample : undefined;
  } catch {
    return undefined;
  }
}
