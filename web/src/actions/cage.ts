/** Makes cages (generated, as a box, or from a file) and repairs them. */

import type { CageOptions, CheckedCage, Command, Mend, NamedFile, Reading, Repair } from "../contract";
import { type CageSettings, cageKey, cageSettings, hasUnmadeCage } from "../derived";
import type { DocumentMirror } from "../document";
import { follow } from "../queue";
import { T } from "../words";
import type { BindActions } from "./bind";
import { attempt, type Context, waitFor } from "./context";
import type { Edit } from "./edit";
import { carriableOf, type PoseActions } from "./poses";

export interface CageActions {
  /** Sets how often the cage is subdivided for a smooth surface, 0 to 3 times. Returns false if that fails. */
  setSmooth(steps: number): boolean;
  /**
   * Changes smoothing or inner controls of the cage as one undo step, and carries poses over. Shows an error and
   * returns false if that fails.
   */
  change(label: string, change: Command | (() => void), failed?: string): boolean;
  /**
   * Makes a cage with the settings of the Cage panel. Resolves with false on failure. `unasked`: the page started this,
   * not the user, so error messages stay on screen.
   */
  make(unasked?: boolean): Promise<boolean>;
  cancel(): void;
  /** Draws the cage of the panel's settings as lines, unless it is the current one. */
  preview(): Promise<void>;
  load(files: readonly NamedFile[], unasked?: boolean): Promise<boolean>;
  repair(kind: Repair): Promise<boolean>;
  /** Selects generated cages in the panel and generates one. */
  regenerate(): Promise<boolean>;
  /** Runs the fix that the check offers for a problem. */
  mend(fix: Mend): void;
}

/** Largest model whose cages are previewed, vertices: each preview generates a cage. */
const MAX_PREVIEWED = 200_000;
/** Maximum number of vertices of a hull cage. It is small, because a hull does not follow limbs. */
const HULL_VERTICES = 24;

export interface CageNeeds {
  readonly edit: Pick<Edit, "settle" | "step">;
  readonly know: DocumentMirror["know"];
  readonly made: DocumentMirror["made"];
  readonly bind: Pick<BindActions, "again">;
  readonly poses: Pick<PoseActions, "carry">;
}

export function createCage(ctx: Context, { bind, edit, know, made, poses }: CageNeeds): CageActions {
  const engine = () => ctx.session().engine;

  const change: CageActions["change"] = (label, change, failed = T.failed.controls) => {
    edit.settle();
    const before = carriableOf(ctx);
    const work = typeof change === "function" ? change : () => engine().apply(change, label);
    if (!before || !edit.step(work, failed)) return false;
    if (engine().restPositions().length !== before.cage.positions.length) void poses.carry(before);
    return true;
  };

  /** Replaces the cage and adds an undo step, except for the first cage of a model. */
  const take = (label: string, cage: CheckedCage) => {
    edit.settle();
    const before = carriableOf(ctx);
    const { posed, poses: saved } = ctx.store.get();
    const isFirst = !before && ctx.store.get().undoLabel === null;
    ctx.session().takeCage(cage, isFirst ? undefined : label);
    if (cage.check) know(cage.check);
    // A first cage or one from a file may not fit into the view.
    if (!before || label === T.did.loadCage) engine().frameAll();
    if (!before || !(posed || saved.length > 0)) return;
    const back = { label: T.pose.backToCage, run: () => void engine().undo() };
    const carry = { label: T.pose.carry, run: () => void poses.carry(before, T.did.carry) };
    ctx.tell.say(T.cage.posesWait, carry, back);
  };

  /** The last preview, which `make` takes if nothing has changed since. */
  let previewed: { readonly key: string; readonly revision: number; readonly cage: CheckedCage } | undefined;
  let isPreviewing = false;

  const optionsOf = ({ cageSource, cageOptions }: CageSettings): CageOptions => {
    const hull = { shape: "hull", vertices: HULL_VERTICES, voxels: 0 } as const;
    return cageSource === "hull" ? { ...cageOptions, ...hull } : cageOptions;
  };
  const isCurrent = (settings: CageSettings) =>
    previewed?.key === cageKey(settings) && previewed.revision === engine().revision;
  const box = (divisions: number): CheckedCage => ({ ...ctx.session().boxCage(divisions), check: null });

  const showPreview = (cage: CheckedCage | undefined) => {
    engine().showDraft(cage?.positions ?? new Float32Array(), cage?.corners ?? new Uint32Array());
    ctx.store.set({ cagePreview: cage ? cage.positions.length / 3 : null });
  };

  /** The settings to preview; undefined if they are those of the cage, or cannot be previewed. */
  const toPreview = (): CageSettings | undefined => {
    const state = ctx.store.get();
    const { step, model, cageSource, cageProgress, editingRest } = state;
    const isSmall = (model?.vertices ?? 0) <= MAX_PREVIEWED;
    const isShown = step === "cage" && !editingRest && cageProgress === null && cageSource !== "file";
    return isShown && isSmall && hasUnmadeCage(state) ? cageSettings(state) : undefined;
  };

  const generate = async (settings: CageSettings, signal: AbortSignal) => {
    const options = optionsOf(settings);
    const { cageClip } = settings;
    ctx.queue.cancel("preview");
    ctx.store.set({ cageProgress: 0 });
    try {
      const hear = (cageProgress: number) => ctx.store.set({ cageProgress });
      const made =
        previewed && isCurrent(settings)
          ? previewed.cage
          : await follow(signal, ctx.session().generateCage(options, hear, cageClip ?? undefined));
      const vertices = made.positions.length / 3;
      if (vertices > options.vertices) {
        ctx.tell.say(T.cage.more(vertices, options.vertices));
      }
      if (made.bridged) {
        const each = { label: T.cage.perPart, run: () => makeForEachPart() };
        ctx.tell.say(T.cage.bridged(made.bridged), each);
      }
      return made;
    } finally {
      ctx.store.set({ cageProgress: null });
    }
  };

  const makeForEachPart = () => {
    const { cageOptions } = ctx.store.get();
    ctx.store.set({ cageOptions: { ...cageOptions, per_component: true } });
    void actions.regenerate();
  };

  const actions: CageActions = {
    change,
    setSmooth: (steps) => change(T.did.smooth(steps), { do: "subdivide", steps }),
    make(unasked = false) {
      if (!unasked) ctx.tell.clear();
      return attempt(ctx, T.failed.noCage, () =>
        ctx.queue.replace("cage", async (signal) => {
          const settings = cageSettings(ctx.store.get());
          const isBox = settings.cageSource === "box";
          take(T.did.makeCage, isBox ? box(settings.boxDivisions) : await generate(settings, signal));
          made(settings);
        }),
      );
    },
    cancel: () => ctx.queue.cancel("cage"),
    async preview() {
      if (!toPreview()) {
        ctx.queue.cancel("preview");
        if (ctx.store.get().cagePreview !== null) showPreview(undefined);
      }
      if (isPreviewing) return;
      isPreviewing = true;
      try {
        // Finish each preview before the next one: a slider that moves would cancel all of them.
        for (let settings = toPreview(); settings && !isCurrent(settings); settings = toPreview()) {
          const { cageSource, boxDivisions, cageClip } = settings;
          const options = optionsOf(settings);
          const { revision } = engine();
          const job = () => ctx.session().generateCage(options, () => undefined, cageClip ?? undefined);
          const cage =
            cageSource === "box"
              ? box(boxDivisions)
              : await ctx.queue.replace("preview", (signal) => follow(signal, job()));
          if (!toPreview()) break;
          previewed = { key: cageKey(settings), revision, cage };
          showPreview(cage);
        }
      } catch {
        // Making the cage reports why these settings fail.
        showPreview(undefined);
      } finally {
        isPreviewing = false;
      }
    },
    load(files, unasked = false) {
      if (!unasked) ctx.tell.clear();
      return attempt(ctx, T.failed.cageFile, () =>
        ctx.queue.replace("open", async (signal) => {
          const name = files[0]?.name ?? "the cage";
          const read = (hear: (progress: Reading) => void) => ctx.session().readCage(files, hear);
          const cage = await waitFor(ctx, signal, T.opening.file(name), read);
          ctx.store.set({ cageSource: "file", cageMade: "file" });
          take(T.did.loadCage, cage);
        }),
      );
    },
    repair(kind) {
      return attempt(ctx, T.failed.repair, () =>
        ctx.queue.replace("open", async (signal) => {
          const repair = () => ctx.session().repair(kind);
          take(T.did.repairCage, await waitFor(ctx, signal, T.opening.repairing, repair));
        }),
      );
    },
    regenerate() {
      ctx.store.set({ cageSource: "auto" });
      return actions.make();
    },
    mend(fix) {
      if (fix.kind === "repair") void actions.repair(fix.repair);
      else if (fix.kind === "regenerate") void actions.regenerate();
      else void bind.again({ grid: fix.cells });
    },
  };
  return actions;
}
