/**
 * Runs a bind. If the model is not bound yet and the requested grid is automatic or finer than `COARSE_GRID`, a coarse pass runs first,
 * so that the model can soon be dragged. There is no coarse pass above the limit `MAX_COARSE_CELLS`.
 */

import type {
  BindEvent,
  BindOptions,
  BindReport,
  CageArrays,
  Engine,
  ErrorName,
  Job,
  Progress,
} from "../contract";
import { createEta } from "../eta";
import { type Client, named } from "./client";
import type { KeptRows } from "./messages";

/** Value of the option `grid` in the coarse pass. */
const COARSE_GRID = 32;

/**
 * Number of bound points times number of controls above which there is no coarse pass: assembling the weights then
 * takes most of the time on any grid.
 */
const MAX_COARSE_CELLS = 1 << 23;

/** Number of weights above which the worker ends after a bind to free its memory, 64 MiB at 8 bytes per weight. */
const MAX_KEPT_WEIGHTS = 1 << 23;

/** Names of errors after which a bind on the GPU is repeated on the CPU. */
const GPU_ERRORS: readonly string[] = ["NoAdapter", "NoDevice", "DeviceLost", "Gpu"] satisfies ErrorName[];

export interface BindStart {
  readonly client: Client;
  readonly engine: Engine;
  readonly adapter: string;
  readonly options: BindOptions;
  readonly listener: (event: BindEvent) => void;
  readonly cage: () => CageArrays;
}

type Pass = "coarse" | "fine";

export function startBind(start: BindStart): Job<BindReport> {
  const { client, engine, adapter, listener, cage } = start;
  let options = start.options;
  let job: Job<KeptRows> | undefined;
  let isCancelled = false;
  const { revision } = engine;
  // Reading the points of a rig takes up to 0.2 s.
  const positions = engine.boundPoints();
  const points = positions.length / 3;
  const extra = points - engine.modelPositions().length / 3;

  const step = (pass: Pass) => {
    const eta = createEta(performance.now());
    return ({ stage, fraction, iteration, delta }: Progress) => {
      if (isCancelled) return;
      const etaMs = eta.update(fraction, performance.now()) ?? null;
      listener({ kind: "progress", pass, stage, fraction, etaMs, iteration, delta });
    };
  };

  async function once(pass: Pass, asked: BindOptions): Promise<BindReport> {
    job = client.run(
      "bindKept",
      () => ({ positions: positions.slice(), extra, cage: cage(), options: asked }),
      step(pass),
    );
    const { key, indptr, offsets, report } = await job.done;
    if (isCancelled || !report) throw named("Cancelled", "cancelled");
    engine.requireCurrent(revision);
    const whole = report.backend === "gpu" ? { ...report, adapter } : report;
    const rows = (start: number, end: number) => client.run("rows", { key, start, end }).done;
    await engine.adopt(indptr, rows, offsets, whole, pass === "fine");
    if ((indptr.at(-1) ?? 0) > MAX_KEPT_WEIGHTS) client.rest();
    if (isCancelled) throw named("Cancelled", "cancelled");
    listener({ kind: "adopted", pass, report: whole });
    return whole;
  }

  /** Runs one pass, and repeats it on the CPU if the GPU fails. */
  async function run(pass: Pass): Promise<BindReport> {
    const asked = () => (pass === "fine" ? options : coarse(options));
    try {
      return await once(pass, asked());
    } catch (error) {
      const isGpus = error instanceof Error && GPU_ERRORS.includes(error.name) && options.backend === "gpu";
      if (!isGpus || isCancelled) throw error;
      listener({ kind: "fallback", reason: error.message });
      options = { ...options, backend: "cpu" };
      return once(pass, asked());
    }
  }

  async function all(): Promise<BindReport> {
    const isLarge = (points * cage().positions.length) / 3 > MAX_COARSE_CELLS;
    if (!engine.bound && !isLarge && (options.grid === 0 || options.grid > COARSE_GRID)) await run("coarse");
    if (isCancelled) throw named("Cancelled", "cancelled");
    return run("fine");
  }

  return {
    done: all(),
    cancel() {
      isCancelled = true;
      job?.cancel();
    },
  };
}

/** The options of the coarse pass. */
function coarse(options: BindOptions): BindOptions {
  return { ...options, grid: COARSE_GRID, solver: "multigrid" };
}
