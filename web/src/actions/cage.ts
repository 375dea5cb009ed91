/** Getting a cage: made for the model, a box, or a file; and repairing it. */

import type { CageState, CageWish, Job, Mend, NamedFile, RepairKind } from "../contract";
import type { CageSource } from "../state";
import { attempt, type Context, report, waitFor } from "./context";

export interface CageActions {
  /** Makes a cage the way the Cage panel says. True when there is a new one. */
  make(): Promise<boolean>;
  cancel(): void;
  load(files: readonly NamedFile[]): Promise<boolean>;
  repair(kind: RepairKind): void;
  /** What the button beside a problem does. */
  mend(fix: Mend): void;
  /** The page's side of a new or changed cage. */
  adopt(state: CageState | null): void;
}

/** A hull needs few vertices: it has no limbs to follow. */
const HULL_VERTICES = 24;

/** Name of the step that takes a cage from a file. */
const LOAD = "Load a cage";

export function createCage(ctx: Context, after: () => void, refine: (grid: number) => void): CageActions {
  let job: Job<CageState> | undefined;
  /** Counts generations: what an older one still says is not heard. */
  let turn = 0;

  const adopt = (state: CageState | null) => {
    ctx.store.set({
      cage: state,
      sampleCage: false,
      bound: false,
      report: null,
      earlier: [],
      meanValueReady: false,
      scene: { ...ctx.store.get().scene, compare: false, slice: "off" },
    });
    after();
  };

  const now = () => {
    const { engine } = ctx.session();
    return { positions: engine.restPositions(), corners: engine.cageCorners() };
  };

  /** Takes a new cage as a step of the history; the first cage of a model is none. */
  const take = (label: string, before: ReturnType<typeof now> | undefined, state: CageState) => {
    adopt(state);
    // A cage from elsewhere may reach beyond the view.
    if (!before || label === LOAD) ctx.session().engine.frameAll();
    if (!before) return;
    const next = now();
    const set = (shape: typeof next) => adopt(ctx.session().engine.setCage(shape.positions, shape.corners));
    ctx.history.push({ label, undo: () => set(before), redo: () => set(next) });
  };

  const generate = async (source: CageSource) => {
    const { cageOptions } = ctx.store.get();
    const hull = { shape: "hull", vertices: HULL_VERTICES, voxels: 0 } as const;
    const options: CageWish = source === "hull" ? { ...cageOptions, ...hull } : cageOptions;
    turn += 1;
    const mine = turn;
    ctx.store.set({ cageProgress: 0 });
    const running = ctx.session().generateCage(options, (fraction) => {
      if (mine === turn) ctx.store.set({ cageProgress: fraction });
    });
    job = running;
    try {
      const state = await running.done;
      const { vertices } = state.info;
      if (vertices > options.vertices) {
        ctx.tell.say(`The model's holes and gaps need ${vertices} vertices instead of ${options.vertices}.`);
      }
      return state;
    } finally {
      if (mine === turn) {
        job = undefined;
        ctx.store.set({ cageProgress: null });
      }
    }
  };

  return {
    make() {
      const { cageSource, boxDivisions, cage } = ctx.store.get();
      const before = cage ? now() : undefined;
      job?.cancel();
      ctx.tell.clear();
      return attempt(ctx, "No cage could be made", async () => {
        const { engine } = ctx.session();
        const state = cageSource === "box" ? engine.boxCage(boxDivisions) : await generate(cageSource);
        take("Make a cage", before, state);
      });
    },
    cancel: () => job?.cancel(),
    load(files) {
      const before = ctx.store.get().cage ? now() : undefined;
      ctx.tell.clear();
      return attempt(ctx, "This cage cannot be used", async () => {
        const name = files[0]?.name ?? "the cage";
        const read = await waitFor(ctx, `Opening ${name}`, (hear) => ctx.session().readCage(files, hear));
        const state = ctx.session().openCage(read);
        ctx.store.set({ cageSource: "file" });
        take(LOAD, before, state);
      });
    },
    repair(kind) {
      const before = ctx.store.get().cage ? now() : undefined;
      if (kind === "regenerate") {
        ctx.store.set({ cageSource: "auto" });
        void this.make();
        return;
      }
      try {
        take("Repair the cage", before, ctx.session().engine.repair(kind));
      } catch (error) {
        report(ctx, "The repair did not work", error);
      }
    },
    mend({ kind, cells }) {
      if (kind !== "refine_grid") this.repair(kind);
      else if (cells !== null) refine(cells);
    },
    adopt,
  };
}
