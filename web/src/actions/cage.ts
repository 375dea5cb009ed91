/** Getting a cage: made for the model, a box, or a file; and repairing it. */

import type {
  CageOptions,
  CageState,
  Check,
  CheckedCage,
  Mend,
  NamedFile,
  Reading,
  Repair,
} from "../contract";
import { SCENE_DEFAULTS } from "../defaults";
import { follow } from "../queue";
import type { CageSource } from "../state";
import { T } from "../words";
import { attempt, type Context, report, waitFor } from "./context";

export interface CageActions {
  /** Subdivides the cage so often (0 to 3) for a smooth surface; false when that is not possible. */
  setSmooth(steps: number): boolean;
  /** Another value beside the same cage, as a step of the history; false when it does not fit. */
  change(label: string, work: () => CageState, failed?: string): boolean;
  /** Makes a cage the way the Cage panel says. True when there is a new one. Problems on screen stay when nobody asked
   * for it. */
  make(unasked?: boolean): Promise<boolean>;
  cancel(): void;
  load(files: readonly NamedFile[], unasked?: boolean): Promise<boolean>;
  repair(kind: Repair): Promise<boolean>;
  /** Another one, by itself. */
  regenerate(): Promise<boolean>;
  /** What the button beside a problem does. */
  mend(fix: Mend): void;
  /** The page's side of a new or changed cage; one that was not checked yet is now, and true when that is done. */
  adopt(state: CageState | null, check: Check | null): Promise<boolean>;
}

/** A hull needs few vertices: it has no limbs to follow. */
const HULL_VERTICES = 24;

/** A cage as it is posed, for a step of the history. */
export interface Posed {
  readonly cage: CheckedCage;
  readonly positions: Float32Array;
  readonly shares: readonly number[];
  readonly sampleCage: boolean;
}

export interface CageNeeds {
  /** Binds with so many cells. */
  refine(grid: number): void;
  /** Brings pose and poses of another cage to the one that is open. */
  carry(before: Posed): Promise<unknown>;
  /** Brings poses along to a cage with other controls, as part of a step that there is. */
  carryAlong(before: Posed): Promise<boolean>;
}

export function createCage(ctx: Context, does: CageNeeds): CageActions {
  const look = () =>
    attempt(ctx, T.failed.check, () =>
      ctx.queue.replace("check", async (signal) =>
        ctx.store.set({ check: await follow(signal, ctx.session().checkCage()) }),
      ),
    );

  const adopt = async (state: CageState | null, check: Check | null) => {
    ctx.store.set({
      cage: state,
      check,
      sampleCage: false,
      bound: false,
      pullReady: false,
      report: null,
      earlier: [],
      scene: { ...ctx.store.get().scene, compare: SCENE_DEFAULTS.compare, slice: "off" },
    });
    return state !== null && check === null && look();
  };

  const now = (): CheckedCage | undefined => {
    const { engine } = ctx.session();
    const { cage, check } = ctx.store.get();
    if (!cage) return undefined;
    const controls = engine.cageControls();
    const { notices } = cage.info;
    return { positions: engine.restPositions(), corners: engine.cageCorners(), controls, check, notices };
  };

  const set = (cage: CheckedCage) => {
    const state = ctx.session().takeCage(cage);
    const notices = [...new Set([...state.info.notices, ...(cage.notices ?? [])])];
    adopt({ ...state, info: { ...state.info, notices } }, cage.check);
  };

  const posedNow = (): Posed | undefined => {
    const cage = now();
    const { shares, sampleCage } = ctx.store.get();
    return cage && { cage, positions: ctx.session().engine.cagePositions(), shares, sampleCage };
  };
  const setPosed = ({ cage, positions, shares, sampleCage }: Posed) => {
    set(cage);
    ctx.session().engine.setCagePositions(positions);
    ctx.store.set({ shares, sampleCage });
  };

  const change = (label: string, work: () => CageState, failed: string = T.failed.controls): boolean => {
    const before = posedNow();
    if (!before) return false;
    try {
      void adopt(work(), null);
    } catch (error) {
      report(ctx, failed, error);
      return false;
    }
    // The sample's cage is still the same.
    ctx.store.set({ sampleCage: before.sampleCage });
    const { poses } = ctx.store.get();
    let next = posedNow();
    let carried = poses;
    ctx.history.push({
      label,
      undo() {
        setPosed(before);
        ctx.store.set({ poses });
      },
      redo() {
        if (next) setPosed(next);
        ctx.store.set({ poses: carried });
      },
    });
    if (next?.positions.length !== before.positions.length) {
      void does.carryAlong(before).then((went) => {
        // Undone meanwhile: what is there now is not what this step leads to.
        if (!went) return;
        next = posedNow();
        carried = ctx.store.get().poses;
      });
    }
    return true;
  };

  /** Takes a new cage as a step of the history; the first cage of a model is none. */
  const take = (label: string, cage: CheckedCage) => {
    const before = posedNow();
    const { posed, poses } = ctx.store.get();
    set(cage);
    // A cage from elsewhere may reach beyond the view.
    if (!before || label === T.did.loadCage) ctx.session().engine.frameAll();
    const next = posedNow();
    if (!before || !next) return;
    ctx.history.push({ label, undo: () => setPosed(before), redo: () => setPosed(next) });
    // What was posed belongs to the cage before.
    const back = { label: T.pose.backToCage, run: () => void ctx.history.undo() };
    const carry = { label: T.pose.carry, run: () => void does.carry(before) };
    if (posed || poses.length > 0) ctx.tell.say(T.cage.posesWait, carry, back);
  };

  const generate = async (source: CageSource, signal: AbortSignal) => {
    const { cageOptions, cageClip } = ctx.store.get();
    const hull = { shape: "hull", vertices: HULL_VERTICES, voxels: 0 } as const;
    const options: CageOptions = source === "hull" ? { ...cageOptions, ...hull } : cageOptions;
    ctx.store.set({ cageProgress: 0 });
    try {
      const hear = (cageProgress: number) => ctx.store.set({ cageProgress });
      const made = await follow(signal, ctx.session().generateCage(options, hear, cageClip ?? undefined));
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
    setSmooth: (steps) => change(T.did.smooth(steps), () => ctx.session().engine.setSmooth(steps)),
    make(unasked = false) {
      if (!unasked) ctx.tell.clear();
      return attempt(ctx, T.failed.noCage, () =>
        ctx.queue.replace("cage", async (signal) => {
          const { cageSource, boxDivisions } = ctx.store.get();
          const box = () => ({ ...ctx.session().boxCage(boxDivisions), check: null });
          take(T.did.makeCage, cageSource === "box" ? box() : await generate(cageSource, signal));
        }),
      );
    },
    cancel: () => ctx.queue.cancel("cage"),
    load(files, unasked = false) {
      if (!unasked) ctx.tell.clear();
      return attempt(ctx, T.failed.cageFile, () =>
        ctx.queue.replace("open", async (signal) => {
          const name = files[0]?.name ?? "the cage";
          const read = (hear: (progress: Reading) => void) => ctx.session().readCage(files, hear);
          const cage = await waitFor(ctx, signal, T.opening.file(name), read);
          ctx.store.set({ cageSource: "file" });
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
      else if (fix.kind === "grid") does.refine(fix.cells);
      else void actions.regenerate();
    },
    adopt,
  };
  return actions;
}
