/** Opens samples, files and projects, then makes a cage and binds automatically. */

import type { BindOptions, NamedFile, Opened, Settings, UpAxis } from "../contract";
import { BIND_DEFAULTS } from "../defaults";
import type { DocumentMirror } from "../document";
import { planDrop } from "../drop";
import { type StepName, stateOfNextModel } from "../state";
import { sentence } from "../strings";
import { T } from "../words";
import type { BindActions } from "./bind";
import type { CageActions } from "./cage";
import { attempt, type Context } from "./context";
import type { ControlActions } from "./controls";
import type { Models } from "./models";
import type { Project } from "./project";
import { modelsOf, type Named, readModels } from "./read";
import type { View } from "./view";
import type { WorkActions } from "./works";

export interface Files {
  /** `bind`: bind options in place of the defaults. */
  openSample(id: string, bind?: BindOptions): Promise<boolean>;
  /** Opens dropped or chosen files, whose names determine their roles. */
  openFiles(files: readonly NamedFile[]): Promise<boolean>;
  /** Rotates the model with its cage and poses to another up axis. */
  turn(up: UpAxis): Promise<boolean>;
}

export interface FileNeeds {
  readonly know: DocumentMirror["know"];
  readonly made: DocumentMirror["made"];
  readonly bind: Pick<BindActions, "start">;
  readonly cage: Pick<CageActions, "load" | "make">;
  readonly controls: Pick<ControlActions, "load">;
  readonly models: Pick<Models, "join">;
  readonly project: Pick<Project, "write">;
  readonly view: Pick<View, "symmetry">;
  readonly works: Pick<WorkActions, "flush" | "leave">;
  /** Ends playback and operations in progress before something else is opened. */
  settle(): void;
  /** Called before a sample is opened, or before a file is opened (null). */
  overtaken(sample: string | null): void;
}

/**
 * Largest work of a bind that starts by itself, updates of one value: 10 s on one processor core. A number in a project could
 * otherwise ask for hours.
 */
const MOST_UPDATES = 1e10;

/** What is opened together with a model: further models, a cage, and bind options. */
interface Along {
  readonly others: readonly Named[];
  readonly cageFiles: readonly NamedFile[] | undefined;
  readonly signal: AbortSignal;
  readonly bind: BindOptions | undefined;
}

export function createFiles(ctx: Context, needs: FileNeeds): Files {
  const { store } = ctx;
  const take = async (opened: Opened, sample: string | null, along: Partial<Along> = {}) => {
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
    needs.view.symmetry(symmetry ?? false);
    for (const notice of [...opened.model.notices, ...opened.notices]) ctx.tell.say(sentence(notice));
    if (settings.notices.length > 0) ctx.tell.say(sentence(settings.notices.join(" ")));
    // Add the other models first, so that the cage encloses all of them.
    if (signal && others.length > 0) await needs.models.join(others, signal);
    store.set({ busy: null });
    const { length } = store.get().model?.members ?? [];
    const showList = { label: T.models.showList, run: () => store.set({ step: "model" }) };
    if (opened.model.lies && sample === null) {
      ctx.tell.say(T.model.lies, { label: T.model.stand, run: () => void actions.turn("z") });
    }
    if (others.length > 0 && length > 1) ctx.tell.say(T.models.together(length), showList);
    void prepare(cageFiles, sample !== null, opened.settings !== null);
  };

  const settingsOf = (opened: Opened): Settings => {
    // The memory limit depends on this computer, not on the file.
    const bind = { ...BIND_DEFAULTS, memory_limit: store.get().bindOptions.memory_limit };
    return opened.settings === null ? { notices: [] } : ctx.session().readSettings(opened.settings, bind);
  };

  const goTo = (from: readonly StepName[], step: StepName) => {
    if (from.includes(store.get().step)) store.set({ step });
  };

  /** Replaces the bind options of a project by the defaults if a bind with them would take long. */
  const limitWork = () => {
    const { bindOptions, model } = store.get();
    const updates = ctx.session().engine.estimateUpdates(bindOptions);
    if (updates <= MOST_UPDATES) return;
    store.set({ bindOptions: { ...BIND_DEFAULTS, memory_limit: bindOptions.memory_limit } });
    ctx.tell.say(T.opening.longBind(model?.name ?? "", updates / (MOST_UPDATES / 10)));
  };

  /**
   * Makes the cage and binds, unless the user has to repair the cage first. Changes the step of the page, except for samples
   * and projects.
   */
  const prepare = async (
    cageFiles: readonly NamedFile[] | undefined,
    isSample: boolean,
    isProject: boolean,
  ) => {
    const familiar = isSample || isProject;
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
  const busy = (what: string, title: string, work: (signal: AbortSignal) => Promise<void>) =>
    attempt(ctx, title, () => {
      ctx.tell.clear();
      return ctx.queue.replace("open", async (signal) => {
        store.set({ busy: what });
        await work(signal).finally(() => store.set({ busy: null }));
      });
    });

  /** Saves the open work, then opens another model. */
  const replace = async (open: () => Promise<Opened>, sample: string | null, along: Partial<Along>) => {
    needs.settle();
    needs.overtaken(sample);
    await needs.works.flush();
    const opened = await open();
    needs.works.leave();
    await take(opened, sample, along);
  };

  const actions: Files = {
    openSample(id, bind) {
      // Free the worker for the sample: it also generates cages and binds.
      for (const kind of ["bind", "cage"] as const) ctx.queue.cancel(kind);
      return busy(T.opening.file(T.samples[id]?.name ?? id), T.failed.sample, () =>
        replace(() => ctx.session().openSample(id), id, { bind }),
      );
    },
    openFiles(files) {
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
    turn(up) {
      return busy(T.opening.turning, T.failed.turn, async () => {
        needs.settle();
        await take(await ctx.session().turn(needs.project.write(), up), null);
      });
    },
  };
  return actions;
}

/** The sample that a project was made from. The name of its model is not that of a file. */
function sampleOf({ settings }: Opened): string | undefined {
  try {
    const { sample } = JSON.parse(settings ?? "");
    return typeof sample === "string" ? sample : undefined;
  } catch {
    return undefined;
  }
}
