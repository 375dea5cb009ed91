/** Runs a bind: first a coarse pass, so that the model can soon be dragged, then a pass with the given options. */

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

/** Number of cells along the cage's longest side in the coarse pass. */
const COARSE = 32;

/** Largest number of weights with a coarse pass. Of more, assembling takes most of the time, and both passes take the same. */
const MOST_COARSE = 1 << 23;

/** Number of weights above which the worker ends after a bind, to free its memory: 64 MiB. */
const MOST_KEPT = 1 << 23;

/** Names of errors after which the bind is repeated on the CPU. */
const GPU_ERRORS: readonly string[] = [
  "NoAdapter",
  "NoDevice",
  "DeviceLost",
  "Gpu",
  "Missing",
] satisfies ErrorName[];

export interface BindStart {
  readonly client: Client;
  readonly engine: Engine;
  readonly adapter: string;
  readonly options: BindOptions;
  readonly listener: (event: BindEvent) => void;
  readonly cage: CageArrays;
}

type Pass = "coarse" | "fine";

export function startBind(start: BindStart): Job<BindReport> {
  const { client, engine, adapter, listener, cage } = start;
  let options = start.options;
  let job: Job<KeptRows> | undefined;
  let isCancelled = false;
  const { revision } = engine;
  const positions = engine.boundPoints();
  const extra = (positions.length - engine.modelPositions().length) / 3;

  const step = (pass: Pass) => {
    const eta = createEta(performance.now());
    return ({ stage, fraction, iteration, delta }: Progress) => {
      if (isCancelled) return;
      const etaMs = eta.update(fraction, performance.now()) ?? null;
      listener({ kind: "progress", pass, stage, fraction, etaMs, iteration, delta });
    };
  };

  async function once(pass: Pass, asked: BindOptions): Promise<BindReport> {
    job = client.run("bindKept", { positions, extra, cage, options: asked }, step(pass));
    const { key, indptr, offsets, report } = await job.done;
    if (isCancelled || !report) throw named("Cancelled", "cancelled");
    engine.requireCurrent(revision);
    const whole = report.backend === "gpu" ? { ...report, adapter } : report;
    const rows = (start: number, end: number) => client.run("rows", { key, start, end }).done;
    await engine.adopt(indptr, rows, offsets, whole, pass === "fine");
    if ((indptr.at(-1) ?? 0) > MOST_KEPT) client.rest();
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
    const isLarge = (positions.length / 3) * (cage.positions.length / 3) > MOST_COARSE;
    if (!engine.bound && !isLarge && options.grid > COARSE) await run("coarse");
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
  return { ...options, grid: COARSE, solver: "multigrid" };
}
