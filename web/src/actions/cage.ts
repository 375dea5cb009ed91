/** Makes cages (generated, as a box, or from a file) and repairs them. */

import type { CageOptions, CheckedCage, Command, NamedFile, Reading, Repair } from "../contract";
import { HULL_TARGET } from "../defaults";
import { cageKey, cageSettings, hasUnmadeCage, type ProblemFix } from "../derived";
import type { DocumentMirror } from "../document";
import { follow } from "../queue";
import type { CageSettings } from "../state";
import { T } from "../words";
import type { BindActions } from "./bind";
import { attemptLatest, type Context, waitFor } from "./context";
import type { Edit } from "./edit";
import { type PoseActions, snapshotCage } from "./poses";

/** Maximum number of vertices of a model for which cages are previewed, because each preview generates a cage. */
const MAX_PREVIEW_VERTICES = 200_000;

export interface CageNeeds {
  readonly edit: Pick<Edit, "settle" | "step">;
  readonly know: DocumentMirror["know"];
  readonly made: DocumentMirror["made"];
  readonly bind: Pick<BindActions, "again">;
  readonly poses: Pick<PoseActions, "carry">;
}

export function createCage(ctx: Context, { bind, edit, know, made, poses }: CageNeeds) {
  const { engine } = ctx;

  const change = (label: string, change: Command | (() => void), failed = T.failed.controls): boolean => {
    edit.settle();
    const before = snapshotCage(ctx);
    const work = typeof change === "function" ? change : () => engine().apply(change, label);
    if (!before || !edit.step(work, failed)) return false;
    const isOther = engine().restPositions().length !== before.cage.positions.length;
    if (isOther || engine().carriable().length !== before.poses.length) void poses.carry(before);
    return true;
  };

  /** Undoes steps until the cage with this identifier is back. Undoes nothing if the history has forgotten it. */
  const undoTo = (id: number) => {
    if (ctx.store.get().cageId === id || !engine().undo()) return;
    undoTo(id);
    if (ctx.store.get().cageId !== id) engine().redo();
  };

  /** Replaces the cage and adds an undo step, except for the first cage of a model that was not changed. */
  const take = (label: string, cage: CheckedCage) => {
    edit.settle();
    const before = snapshotCage(ctx);
    const { posed, poses: saved } = ctx.store.get();
    const isFirst = !before && ctx.store.get().undo === null;
    ctx.session().takeCage(cage, isFirst ? undefined : label);
    if (cage.check) know(cage.check);
    // A first cage or one from a file may not fit into the view.
    if (!before || label === T.did.loadCage) engine().frameAll();
    if (!before || !(posed || saved.length > 0)) return;
    const back = { label: T.pose.backToCage, run: () => undoTo(before.id) };
    const carry = { label: T.pose.carry, run: () => void poses.carry(before, T.did.carry) };
    ctx.tell.say(T.cage.posesWait(saved.length), carry, back);
  };

  /** The last preview, which `make` takes if nothing has changed since. */
  let previewed: { readonly key: string; readonly revision: number; readonly cage: CheckedCage } | undefined;
  let isPreviewing = false;

  const optionsOf = ({ cageSource, cageOptions }: CageSettings): CageOptions => {
    const hull = { kind: "hull", target: HULL_TARGET, voxels: 0 } as const;
    return cageSource === "hull" ? { ...cageOptions, ...hull } : cageOptions;
  };
  const isCurrent = (settings: CageSettings) =>
    previewed?.key === cageKey(settings) && previewed.revision === engine().revision;
  const box = (divisions: number): CheckedCage => ({ ...ctx.session().boxCage(divisions), check: null });

  const showPreview = (cage: CheckedCage | undefined) => {
    engine().showDraft(cage);
    ctx.store.set({ cagePreview: cage ? cage.positions.length / 3 : null });
  };

  /** Returns the settings to preview; undefined if the cage was made with them, or if they cannot be previewed. */
  const toPreview = (): CageSettings | undefined => {
    const state = ctx.store.get();
    const { step, model, cageSource, cageProgress, editingRest } = state;
    const isSmall = (model?.vertices ?? 0) <= MAX_PREVIEW_VERTICES;
    const isShown = step === "cage" && !editingRest && cageProgress === null && cageSource !== "file";
    return isShown && isSmall && hasUnmadeCage(state) ? cageSettings(state) : undefined;
  };

  const generate = async (settings: CageSettings, signal: AbortSignal) => {
    const options = optionsOf(settings);
    const { cageClip } = settings;
    ctx.queue.cancel("preview");
    ctx.store.set({ cageProgress: 0 });
    let showsSkeleton = false;
    try {
      const hear = (cageProgress: number, skeleton?: Float32Array) => {
        ctx.store.set({ cageProgress });
        if (!skeleton) return;
        engine().showLines(skeleton);
        showsSkeleton = true;
      };
      const made =
        previewed && isCurrent(settings)
          ? previewed.cage
          : await follow(signal, ctx.session().generateCage(options, hear, cageClip ?? undefined));
      const vertices = made.positions.length / 3;
      if (vertices > options.target) ctx.tell.say(T.cage.more(vertices, options.target));
      if (made.bridged) {
        const each = { label: T.cage.perPart, run: () => makeForEachPart() };
        ctx.tell.say(T.cage.bridged(made.bridged, ctx.store.get().model?.members.length ?? 1), each);
      }
      const notices = [
        ...(made.kind === "skeleton" ? [T.cage.sleeves] : []),
        ...(made.notices ?? []),
        ...(made.refusal === undefined ? [] : [made.refusal]),
      ];
      return { ...made, notices };
    } finally {
      if (showsSkeleton) engine().showDraft(undefined);
      ctx.store.set({ cageProgress: null });
    }
  };

  const makeForEachPart = () => {
    const { cageOptions } = ctx.store.get();
    ctx.store.set({ cageOptions: { ...cageOptions, per_component: true } });
    void actions.regenerate();
  };

  const actions = {
    /**
     * Changes smoothing or inner controls of the cage as one undo step. If the number of controls changes, converts
     * the poses to the changed cage. Shows an error and returns false if the change fails.
     */
    change,
    /** Sets the number of subdivision steps that smooth the cage, 0 to 3. Returns false on failure. */
    setSmooth: (steps: number): boolean => change(T.did.smooth(steps), { do: "subdivide", steps }),
    /**
     * Makes a cage with the settings of the Cage panel. Resolves with false on failure. `unasked`: the page called
     * this, not the user, so earlier error messages remain.
     */
    make(unasked = false): Promise<boolean> {
      if (!unasked) ctx.tell.clear();
      return attemptLatest(ctx, T.failed.noCage, "cage", async (signal) => {
        const settings = cageSettings(ctx.store.get());
        const isBox = settings.cageSource === "box";
        take(T.did.makeCage, isBox ? box(settings.boxDivisions) : await generate(settings, signal));
        made(settings);
      });
    },
    cancel: () => ctx.queue.cancel("cage"),
    /**
     * Draws, as lines, a preview of the cage that the panel's settings would make. Removes the preview if the current
     * cage was made with these settings, or if they cannot be previewed.
     */
    async preview() {
      if (!toPreview()) {
        ctx.queue.cancel("preview");
        if (ctx.store.get().cagePreview !== null) showPreview(undefined);
      }
      if (isPreviewing) return;
      isPreviewing = true;
      try {
        // Finish each preview before starting the next one. If each movement of a slider cancelled the preview in
        // progress, none would be shown before the slider stops.
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
        // Ignore the error: making a cage with these settings reports it.
        showPreview(undefined);
      } finally {
        isPreviewing = false;
      }
    },
    load(files: readonly NamedFile[], unasked = false): Promise<boolean> {
      if (!unasked) ctx.tell.clear();
      return attemptLatest(ctx, T.failed.cageFile, "open", async (signal) => {
        const name = files[0]?.name ?? "the cage";
        const read = (hear: (progress: Reading) => void) => ctx.session().readCage(files, hear);
        const cage = await waitFor(ctx, signal, T.opening.file(name), read);
        ctx.store.set({ cageSource: "file", cageMade: "file" });
        take(T.did.loadCage, cage);
      });
    },
    repair(kind: Repair): Promise<boolean> {
      return attemptLatest(ctx, T.failed.repair, "open", async (signal) => {
        const repair = () => ctx.session().repair(kind);
        take(T.did.repairCage, await waitFor(ctx, signal, T.opening.repairing, repair));
      });
    },
    /** Selects generated cages in the panel and generates one. */
    regenerate(): Promise<boolean> {
      ctx.store.set({ cageSource: "auto" });
      return actions.make();
    },
    /** Runs the fix that the check offers for a problem. */
    applyFix(fix: ProblemFix) {
      if (fix.kind === "repair") void actions.repair(fix.repair);
      else if (fix.kind === "regenerate") void actions.regenerate();
      else void bind.again({ grid: fix.cells });
    },
  };
  return actions;
}

export type CageActions = ReturnType<typeof createCage>;
