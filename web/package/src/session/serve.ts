/** Code of the workers. A worker runs the page's jobs one after the other. */

import type { Progress } from "../contract";
import type { Binder, BindResult, Puller } from "../pkg/cagework";
import type { Package } from "./artifact";
import { named } from "./client";
import {
  buffers,
  type JobKind,
  type Jobs,
  type Step,
  type WorkerReply,
  type WorkerRequest,
} from "./messages";
import { checked, copyRig, read, readCage, readModel, readSample } from "./reading";

/** Minimum time between two progress messages of a stage, ms: two frames at 60 frames per second. */
const STEP_PAUSE = 33;

type Sender = (message: WorkerReply, transfer?: Transferable[]) => void;
const send: Sender = (message, transfer = []) => postMessage(message, { transfer });

const cancelled = new Set<number>();
let ready: Promise<unknown> = Promise.resolve();
let queue: Promise<unknown> = Promise.resolve();

/** Starts to run the jobs that the page sends, with one build of the wasm module. */
export function serve(pkg: Package): void {
  const work = createWork(pkg);
  addEventListener("message", ({ data }: MessageEvent<WorkerRequest>) => {
    switch (data.kind) {
      case "start":
        ready = pkg.default({ module_or_path: data.module });
        // Every job awaits `ready` and reports this error itself.
        ready.catch(() => undefined);
        break;
      case "cancel":
        cancelled.add(data.id);
        break;
      case "job":
        queue = queue.then(() => answer(work, data.id, data.job, data.input));
        break;
      default:
        data satisfies never;
    }
  });
}

async function answer(work: Work, id: number, job: JobKind, input: unknown): Promise<void> {
  try {
    await ready;
    const output = await work[job](input as never, steps(id));
    send({ kind: "done", id, output }, buffers(output));
  } catch (error) {
    const { name, message } = error instanceof Error ? error : { name: "Error", message: String(error) };
    send({ kind: "failed", id, name, message });
  } finally {
    cancelled.delete(id);
  }
}

/**
 * Returns a function that sends progress messages at intervals of at least `STEP_PAUSE`, or when the stage changes. The
 * function returns false once the job is cancelled.
 */
function steps(id: number): (step: Step) => boolean {
  let last = Number.NEGATIVE_INFINITY;
  let stage: string | undefined;
  return (step) => {
    const now = performance.now();
    if (now - last >= STEP_PAUSE || step.stage !== stage) {
      last = now;
      stage = step.stage;
      send({ kind: "step", id, step });
    }
    return !cancelled.has(id);
  };
}

type Work = {
  [K in JobKind]: (
    input: Jobs[K]["input"],
    step: (step: Jobs[K]["step"]) => boolean,
  ) => Promise<Jobs[K]["output"]>;
};

function createWork(pkg: Package): Work {
  let shared: Binder | undefined;
  /** Weights of the last `bindKept`, until the job `rows` has fetched all of them. */
  let kept: BindResult | undefined;
  let keptKey = 0;
  let puller: Puller | undefined;
  const opened = (): Puller => {
    if (!puller) throw new Error("no model is ready to be pulled: bind it again");
    return puller;
  };
  const binder = (): Binder => {
    shared ??= new pkg.Binder();
    return shared;
  };
  const bind = async (
    { positions, extra, cage, options }: Jobs["bind"]["input"],
    step: (step: Progress) => boolean,
  ): Promise<BindResult> => {
    return binder().bind(positions, extra, cage, options, step);
  };
  return {
    async bind(input, step) {
      const bound = await bind(input, step);
      const { report } = bound;
      return { ...bound.intoArrays(), report };
    },
    async bindKept(input, step) {
      kept?.free();
      kept = undefined;
      keptKey += 1;
      kept = await bind(input, step);
      const { indptr, offsets, report } = kept;
      return { key: keptKey, indptr, offsets, report };
    },
    async rows({ key, start, end }) {
      if (key < keptKey) throw named("Cancelled", "a newer bind has replaced these weights");
      if (!kept || key > keptKey) throw new Error("the weights are gone: bind again");
      const rows = kept.rows(start, end);
      if (end === kept.count) {
        kept.free();
        kept = undefined;
      }
      return rows;
    },
    formula: async ({ kind, positions, cage }) => binder().bindByFormula(kind, positions, cage).intoArrays(),
    async model({ files, states, clip }, step) {
      const loaded = await read(pkg, files, step);
      try {
        const [positions, triangles] = states ? loaded.states(clip) : [loaded.positions, loaded.triangles];
        const rig = clip === undefined ? loaded.rig() : undefined;
        return { positions, triangles, origin: loaded.origin, ...(rig ? { rig } : {}) };
      } finally {
        loaded.free();
      }
    },
    async reshape({ files, origin, cage, posed, options, rig }, step) {
      const loaded = await read(pkg, files, step);
      try {
        loaded.seeFrom(origin);
        return await binder().reshape(loaded, cage, posed, options, rig, step);
      } finally {
        loaded.free();
      }
    },
    async proportions({ files, origin, cage, request, options }, step) {
      const loaded = await read(pkg, files, step);
      try {
        loaded.seeFrom(origin);
        return await binder().proportions(loaded, cage, request, options, step);
      } finally {
        loaded.free();
      }
    },
    async slice({ cage, axis, fraction, options }, step) {
      const bound = await binder().bindSlice(cage, axis, fraction, options, step);
      return bound?.intoArrays();
    },
    async lattice({ cage, cells, options }, step) {
      return (await binder().bindLattice(cage, cells, options, step)).intoArrays();
    },
    async cage({ positions, triangles, rig, model, options, smooth }, step) {
      let last: Progress = { stage: "voxelize", fraction: 0, iteration: 0, delta: null };
      const hear = (event: Progress) => {
        last = event;
        return step(event);
      };
      const show = (skeleton: Float32Array) => void step({ ...last, skeleton });
      const cage = pkg.Binder.generateCage(positions, triangles, rig, options, smooth, hear, show);
      return checked(pkg, cage, model, smooth);
    },
    read: (input, step) => readModel(pkg, input, step),
    copyRig: (input, step) => copyRig(pkg, input, step),
    readCage: (input, step) => readCage(pkg, input, step),
    check: async ({ cage, model }) => pkg.Binder.checkCage(model, cage),
    repair: async ({ kind, cage, model }) =>
      checked(pkg, pkg.Binder.repairCage(kind, model, cage), model, cage.controls?.smooth),
    carry: async ({ model, cage, old, poses }) => pkg.Binder.carryPoses(model, cage, old, poses),
    folds: async (sample) => pkg.Binder.proportionRanges(sample),
    async pullOpen({ positions, triangles, cage }) {
      puller?.free();
      puller = undefined;
      puller = new pkg.Puller(positions, triangles, cage);
      return null;
    },
    pullGrab: async (input) => opened().grab(input),
    pullFrame: async ({ to }) => opened().frame(to),
    async sample({ id, name }) {
      const sample = pkg.Binder.buildSample(id);
      return { read: await readSample(pkg, name, sample), poses: sample.poses, grip: sample.grip };
    },
  };
}
